// The lab's scene in meshcat's viewer, live (frames from a websocket) or as a replay (tracks in the page itself, replay.js).
// Scene tree: /lab/<body> carries the body's pose, /lab/<body>/<shape number> a shape's place in the body. Metres, z up.
"use strict";

const data = JSON.parse(document.getElementById("lab-data").textContent);
const THREE = MeshCat.THREE;
const LAB = "lab";
const panel = typeof seat === "undefined" ? null : seat; // teaching_question.js, on pages with a teaching seat
var viewer; // a global by this name, as on meshcat's own pages
const LOAD_AGAIN = 4001, ELSEWHERE = 4002; // codes with which a class closes a page
const SLOW_MS = 40; // a picture that takes longer is simplified
const PLAINER = [
  () => {
    viewer.renderer.shadowMap.type = THREE.BasicShadowMap;
    viewer.renderer.setPixelRatio(0.75 * window.devicePixelRatio);
    const { shadow } = viewer.scene_tree.find(["Lights", "Lamp", "<object>"]).object;
    shadow.mapSize.set(1024, 1024);
    if (shadow.map) shadow.map.dispose();
    shadow.map = null;
  },
  () => { viewer.renderer.shadowMap.enabled = false; },
];
let floorPending = true, timed = false;
let lookedFrom = "";

function note(text) {
  document.getElementById("note").textContent = text;
}

function unpack(text, Kind) {
  return new Kind(Uint8Array.from(atob(text), (c) => c.charCodeAt(0)).buffer);
}

// three.js works in the scene's frame with y up; ours has z up
function upright([x, y, z]) {
  return [x, z, -y];
}

function linear([r, g, b]) {
  return new THREE.Color(r, g, b).convertSRGBToLinear();
}

function add(path, object, position) {
  viewer.set_object(path, object);
  if (position) object.position.set(...position);
  return object;
}

function furnish() {
  for (const name of Object.keys(viewer.scene_tree.find(["Lights"]).children)) {
    viewer.set_property(["Lights", name], "visible", false);
  }
  for (const name of ["Grid", "Axes", "Background"]) viewer.set_property([name], "visible", false);
  viewer.renderer.outputEncoding = THREE.sRGBEncoding;
  add(["Lights", "Sky"], new THREE.HemisphereLight(0xffffff, 0xcfc8bd, 0.5), [0, 0, 1]);
  add(["Lights", "Window"], new THREE.DirectionalLight(0xdfe9ff, 0.16), [-2, 3, 2]);
  const lamp = add(["Lights", "Lamp"], new THREE.DirectionalLight(0xfff4e6, 0.56), [2.2, -1.6, 4]);
  lamp.castShadow = true;
  lamp.shadow.mapSize.set(2048, 2048);
  lamp.shadow.radius = 4;
  lamp.shadow.normalBias = 0.01;
  Object.assign(lamp.shadow.camera, { left: -2.4, right: 2.4, top: 2.4, bottom: -2.4, near: 0.5, far: 9 });
}

// A floor that shows only shadows and faint lines, below the lowest body
function layFloor() {
  const box = new THREE.Box3().setFromObject(viewer.scene_tree.find([LAB]).object);
  if (box.isEmpty()) return;
  const reach = Math.max(1, box.getSize(new THREE.Vector3()).length() / 5), lamp = viewer.scene_tree.find(["Lights", "Lamp", "<object>"]).object;
  if (reach > 1) { // in a scene larger than a cell the lamp is farther away, so that everything has a shadow
    lamp.position.multiplyScalar(reach);
    const { camera } = lamp.shadow;
    for (const side of ["left", "right", "top", "bottom", "near", "far"]) camera[side] *= reach;
    camera.updateProjectionMatrix();
  }
  const shade = new THREE.Mesh(new THREE.PlaneGeometry(40 * reach, 40 * reach), new THREE.ShadowMaterial({ opacity: 0.2 }));
  shade.receiveShadow = true;
  add(["Floor", "shade"], shade, [0, 0, box.min.y - 0.002]);
  const lines = new THREE.GridHelper(12 * Math.ceil(reach), 24 * Math.ceil(reach), 0x9aa7b2, 0x9aa7b2).rotateX(Math.PI / 2);
  Object.assign(lines.material, { transparent: true, opacity: 0.3 });
  add(["Floor", "lines"], lines, [0, 0, box.min.y - 0.001]);
  floorPending = false;
}

function lookFrom(camera) {
  viewer.camera.fov = 38;
  viewer.camera.position.set(...upright(camera.eye));
  viewer.controls.target.set(...upright(camera.target));
  viewer.controls.update();
}

// A label that always faces the camera
function labelOf({ size: [height], text }, rgba) {
  const canvas = document.createElement("canvas"), pen = canvas.getContext("2d"), font = "600 96px system-ui, sans-serif";
  pen.font = font;
  canvas.width = Math.ceil(pen.measureText(text).width) + 8;
  canvas.height = 128;
  Object.assign(pen, { font, textAlign: "center", textBaseline: "middle", fillStyle: "white" });
  pen.fillText(text, canvas.width / 2, canvas.height / 2);
  const sprite = new THREE.Sprite(new THREE.SpriteMaterial({ map: new THREE.CanvasTexture(canvas) }));
  sprite.scale.set((height * canvas.width) / canvas.height, height, 1);
  paint(sprite, rgba);
  Object.assign(sprite.material, { transparent: true, depthWrite: false });
  sprite.castShadow = false;
  return sprite;
}

function geometryOf(spec) {
  if (spec.kind === "label") return spec;
  if (spec.kind === "box") return new THREE.BoxGeometry(...spec.size);
  if (spec.kind === "sphere") return new THREE.SphereGeometry(spec.size[0], 48, 32);
  if (spec.kind === "cylinder") {
    const [radius, length] = spec.size; // three.js lays cylinders along y, ours stand along z
    return new THREE.CylinderGeometry(radius, radius, length, 48).rotateX(Math.PI / 2);
  }
  const mesh = new THREE.BufferGeometry();
  mesh.setAttribute("position", new THREE.BufferAttribute(unpack(spec.positions, Float32Array), 3));
  mesh.setIndex(new THREE.BufferAttribute(unpack(spec.faces, Uint32Array), 1));
  mesh.setAttribute("normal", new THREE.BufferAttribute(unpack(spec.normals, Float32Array), 3));
  return mesh;
}

function meshOf(geometry, shape) {
  const mesh = new THREE.Mesh(geometry, new THREE.MeshStandardMaterial({ roughness: 0.62, metalness: 0.05 }));
  mesh.scale.set(...shape.scale);
  mesh.receiveShadow = true;
  paint(mesh, shape.rgba);
  return mesh;
}

function paint(mesh, rgba) {
  mesh.material.color.copy(linear(rgba));
  mesh.material.opacity = rgba[3];
  mesh.material.transparent = rgba[3] < 1;
  mesh.material.depthWrite = rgba[3] === 1;
  mesh.castShadow = rgba[3] > 0.5;
}

function place(path, pose) {
  const object = viewer.scene_tree.find(path).object;
  object.position.fromArray(pose);
  object.quaternion.fromArray(pose, 3);
}

function showScene(scene) {
  if (viewer.scene_tree.children[LAB]) viewer.delete_path([LAB]);
  const geometries = scene.geometries.map(geometryOf);
  for (const body of scene.bodies) {
    viewer.scene_tree.find([LAB, body.name]);
    body.shapes.forEach((shape, number) => {
      const geometry = geometries[shape.geometry];
      const object = geometry.kind === "label" ? labelOf(geometry, shape.rgba) : meshOf(geometry, shape);
      viewer.set_object([LAB, body.name, String(number)], object);
      place([LAB, body.name, String(number)], shape.pose);
    });
  }
  if (lookedFrom !== JSON.stringify(scene.camera)) lookFrom(scene.camera); // after a reconnection the person's view is kept
  lookedFrom = JSON.stringify(scene.camera);
  floorPending = true;
  viewer.set_dirty();
}

function showFrame(frame) {
  for (const [name, pose] of Object.entries(frame.poses)) place([LAB, name], pose);
  for (const [name, rgba] of Object.entries(frame.colors)) {
    viewer.scene_tree.find([LAB, name]).object.traverse((object) => object.isMesh && paint(object, rgba));
  }
  for (const [name, visible] of Object.entries(frame.visible)) viewer.set_property([LAB, name], "visible", visible);
  if (floorPending && Object.keys(frame.poses).length) layFloor();
  viewer.set_dirty();
}

// Milliseconds for drawing a picture
function drawingTime() {
  const gl = viewer.renderer.getContext(), pixel = new Uint8Array(4);
  const draw = () => {
    viewer.render();
    gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);
  };
  draw(); // the first picture also compiles the shaders
  const began = performance.now();
  draw();
  return performance.now() - began;
}

// Without a GPU pictures take long: on a page with questions, simplified ones follow the robot in time
function keepUp(steps) {
  if (!steps.length || drawingTime() < SLOW_MS) return;
  steps[0]();
  panel.spare?.();
  viewer.scene.traverse((object) => { if (object.material) object.material.needsUpdate = true; });
  viewer.set_dirty();
  setTimeout(keepUp, 0, steps.slice(1));
}

function follow(pause = 300) {
  const search = typeof classBar === "undefined" ? location.search : classBar.search; // class_bar.js, on the pages of a class
  const socket = typeof PolledSocket === "undefined" // polling.js, behind a proxy that passes no websockets
    ? new WebSocket(new URL(`frames${search}`, location.href.replace(/^http/, "ws"))) : new PolledSocket();
  socket.onopen = () => {
    pause = 300;
    const send = (message) => socket.send(JSON.stringify(message));
    if (panel) panel.connected(send);
    if (typeof classBar !== "undefined") classBar.connected(send);
  };
  socket.onmessage = (event) => {
    const { scene, frame, seat: parts, refusal, class: told } = JSON.parse(event.data);
    if (scene && viewer) showScene(scene);
    if (frame && viewer) showFrame(frame);
    if (panel && viewer && !timed && !floorPending) {
      timed = true;
      setTimeout(keepUp, 0, PLAINER);
    }
    if (frame && frame.time_s !== null) note(frame.time_s ? `${frame.time_s.toFixed(1)} s` : "");
    if (panel && frame && frame.time_s !== null) panel.clock?.(frame.time_s);
    if (panel && scene) panel.hasScene?.();
    if (panel && parts) panel.update(parts);
    if (panel && refusal) panel.refused(refusal);
    if (told) classBar.show(told);
  };
  socket.onclose = ({ code, reason }) => {
    if (code === 1001 && reason) {
      note(`${reason}: this is its last picture`);
      if (panel) panel.over();
      return;
    }
    if (code === LOAD_AGAIN) location.reload();
    note(code === ELSEWHERE ? "open in another window: load this one again to go on here" : "connection lost: trying again");
    if (panel) panel.lost();
    if (code === ELSEWHERE) return;
    setTimeout(follow, pause, Math.min(2 * pause, 3000));
  };
}

// The picture fills its pane at any size; meshcat itself would take the window's height
function fitPane(pane) {
  const fit = viewer.set_3d_pane_size.bind(viewer);
  viewer.set_3d_pane_size = () => fit(pane.clientWidth || 1, pane.clientHeight || 1);
  new ResizeObserver(viewer.set_3d_pane_size).observe(pane);
}

function begin() {
  try {
    viewer = new MeshCat.Viewer(document.getElementById("meshcat-pane"));
    furnish();
    fitPane(document.getElementById("meshcat-pane"));
  } catch (reason) {
    note(`this page needs WebGL: ${reason.message}`);
    if (data.scene) return;
  }
  if (data.scene) {
    replay(data);
  } else {
    note("waiting for the first frame");
    follow();
  }
}

begin();
