// A replay: a recording's tracks in the viewer, the player that moves through them, and the run's story beside it.
"use strict";

const SPEEDS = [0.5, 1, 2, 4, 8, 16];
const LEAP_S = 1, LONG_LEAP_S = 10; // of an arrow key, without and with Shift
const MOST_ROWS = 8; // of a chart below the picture; a larger chart stands beside it on a wide page
const LATE_MS = 1000; // delays longer than this are not made up for

function smoothTrack(name, type, { times, values }) {
  return { name, type, times: unpack(times, Float32Array), values: unpack(values, Float32Array) };
}

// The value at a time of steps [[time, value], ...]; before the first step, the body's initial value
function stepTrack(name, type, steps, before, values) {
  const all = steps[0][0] > 0 ? [[0, before], ...steps] : steps;
  const times = all.map(([time]) => time);
  return { name, type, times, values: all.flatMap(([, value]) => values(value)), interpolation: THREE.InterpolateDiscrete };
}

function colorTracks(mesh, shape, steps) {
  const rgba = [shape.rgba, ...steps.map(([, value]) => value)];
  if (rgba.some((color) => color[3] < 1)) Object.assign(mesh.material, { transparent: true, depthWrite: false });
  return [
    stepTrack(".material.color", "color", steps, shape.rgba, (value) => linear(value).toArray()),
    stepTrack(".material.opacity", "number", steps, shape.rgba, (value) => [value[3]]),
  ];
}

function animationsOf(bodies, duration) {
  const animations = [];
  const animate = (path, tracks) => tracks.length && animations.push({ path, clip: { name: path.join("/"), duration, tracks } });
  for (const { name, shapes, motion } of bodies) {
    const tracks = [];
    if (motion.position) tracks.push(smoothTrack(".position", "vector3", motion.position));
    if (motion.quaternion) tracks.push(smoothTrack(".quaternion", "quaternion", motion.quaternion));
    if (motion.visible.length) tracks.push(stepTrack(".visible", "bool", motion.visible, true, (value) => [value]));
    animate([LAB, name], tracks);
    if (!motion.colors.length) continue;
    shapes.forEach((shape, number) => {
      const path = [LAB, name, String(number), "<object>"];
      animate(path, colorTracks(viewer.scene_tree.find(path).object, shape, motion.colors));
    });
  }
  return animations;
}

function replay({ scene, speed, start_s, duration_s, story }) {
  const poses = Object.fromEntries(scene.bodies.map(({ name, motion }) => [name, motion.start]));
  showScene(scene);
  showFrame({ poses, colors: {}, visible: {} });
  const animations = animationsOf(scene.bodies, duration_s);
  if (!animations.length) return;
  const animator = viewer.animator;
  animator.load(animations, { play: false, repetitions: Infinity });
  for (const action of animator.actions) action.play(); // so that they can be set to any time
  animator.seek(0);
  player.begin((time_s) => animator.seek(time_s), { speed, start_s, duration_s, story });
}

// The clock of the replay, counted from its first picture [s]; keys, buttons, slider and chart set it
const player = (() => {
  const el = (id) => document.getElementById(id);
  const still = { measured: [], planned: [], captions: [], marks: [], begins_s: [] };
  let seek = null, length = 0, start = 0, speed = 1, time = 0, playing = false, story = still, chart = null, before = null, marked = null;

  function begin(how, { speed: first, start_s, duration_s, story: told }) {
    [seek, length, start, speed, story] = [how, duration_s, start_s, first, told || still];
    el("player").hidden = false;
    el("seek").max = length;
    if (!SPEEDS.includes(speed)) SPEEDS.push(speed);
    el("speed").replaceChildren(...SPEEDS.sort((a, b) => a - b).map((one) => new Option(`${one} ×`, one)));
    el("marks").hidden = !story.marks.length;
    el("marks").replaceChildren(...story.marks.map(markButton));
    for (const id of ["back", "next"]) el(id).hidden = !story.begins_s.length;
    el("chart").hidden = !story.measured.length && !story.planned.length;
    for (const kind of el("key").querySelectorAll("[data-kind]")) kind.hidden = !story.measured.some((one) => one.kind === kind.dataset.kind && !one.color);
    listen();
    drawChart();
    move(0);
    pace(speed);
    // the clock starts after the first picture is drawn, or slow machines would miss the beginning
    requestAnimationFrame(() => requestAnimationFrame(play));
  }

  function markButton(mark) {
    const item = document.createElement("li"), button = document.createElement("button");
    button.type = "button";
    button.className = mark.kind;
    button.textContent = `${labGantt.SIGNS[mark.kind]} ${mark.at_s.toFixed(1)} s: ${mark.words}`;
    button.onclick = () => move(mark.at_s - start);
    item.append(button);
    return item;
  }

  function listen() {
    el("play").onclick = toggle;
    el("back").onclick = () => stepTo(-1);
    el("next").onclick = () => stepTo(1);
    el("speed").onchange = (event) => {
      pace(Number(event.target.value));
      event.target.blur(); // so that keys go to the player again
    };
    el("seek").oninput = () => move(Number(el("seek").value));
    const drag = (event) => chart && event.buttons && move(chart.timeAt(event.clientX) - start);
    el("gantt").onpointerdown = (event) => {
      event.currentTarget.setPointerCapture(event.pointerId);
      drag(event);
    };
    el("gantt").onpointermove = drag;
    document.addEventListener("keydown", pressed);
    window.addEventListener("resize", drawChart);
  }

  function drawChart() {
    const { measured, planned, marks } = story, all = [...measured, ...planned], svg = el("gantt");
    if (el("chart").hidden) return;
    const end_s = Math.max(start + length, ...all.map((one) => one.end_s)), rows = labGantt.rowsOf(all);
    document.body.classList.toggle("many", rows.length > MOST_ROWS);
    chart = labGantt.draw(svg, { rows, measured, planned, marks, end_s });
    // the slider's thumb stands under the chart's line
    const room = svg.clientWidth - chart.left - chart.right, x = (at) => chart.left + (room * at) / end_s;
    Object.assign(el("seek").style, { marginLeft: `${x(start) - 8}px`, width: `${x(start + length) - x(start) + 16}px` });
    chart.grow(start + time);
  }

  // ---- controls

  function move(to) {
    time = Math.min(Math.max(to, 0), length);
    seek(time);
    show();
  }

  function pace(to) {
    speed = to;
    el("speed").value = to;
    show();
  }

  function play() {
    if (time >= length) time = 0;
    playing = true;
    before = null;
    requestAnimationFrame(run);
    show();
  }

  function toggle() {
    if (!playing) play();
    else playing = false;
    show();
  }

  function run(now) {
    if (!playing) return;
    const late = before === null ? 0 : Math.min(now - before, LATE_MS);
    before = now;
    if (time >= length) playing = false;
    else requestAnimationFrame(run);
    move(time + (late / 1000) * speed);
  }

  // Go to the beginning of the next move, of this one, or of the one before
  function stepTo(way) {
    const begins = story.begins_s.map((at) => at - start), near = Math.min(0.5, speed * 0.5);
    const next = begins.find((at) => at > time + 0.01), last = begins.filter((at) => at < time - near);
    playing = false;
    move(way > 0 ? next ?? length : last[last.length - 1] ?? 0);
  }

  const faster = (way) => pace(SPEEDS[Math.min(Math.max(SPEEDS.indexOf(speed) + way, 0), SPEEDS.length - 1)]);
  const leap = (event) => (event.shiftKey ? LONG_LEAP_S : LEAP_S);
  const KEYS = {
    " ": toggle, ArrowLeft: (event) => move(time - leap(event)), ArrowRight: (event) => move(time + leap(event)),
    Home: () => move(0), End: () => move(length), n: () => stepTo(1), p: () => stepTo(-1), "+": () => faster(1), "=": () => faster(1), "-": () => faster(-1),
  };

  function pressed(event) {
    const does = KEYS[event.key] || KEYS[event.key.toLowerCase()];
    if (!does || event.ctrlKey || event.altKey || event.metaKey || event.target.matches("select")) return;
    if (event.key === " " && event.target.matches("button")) return; // the button handles this key
    event.preventDefault();
    does(event);
  }

  // ---- display

  function show() {
    const now = start + time;
    const caption = story.captions.filter(([at]) => at <= now + 0.005).pop();
    const mark = story.marks.filter((one) => one.at_s <= now + 0.005 && now - one.at_s < 3 + speed).pop();
    const number = story.begins_s.filter((at) => at <= now + 0.005).length;
    note(`${now.toFixed(1)} s, ${speed} × real time`);
    el("doing").hidden = !story.captions.length;
    el("doing").textContent = caption ? caption[1] : "";
    el("clock").textContent = `${now.toFixed(1)} of ${(start + length).toFixed(1)} s${number ? `, move ${number} of ${story.begins_s.length}` : ""}`;
    el("play").textContent = playing ? "Pause" : time >= length ? "Again" : "Play";
    el("seek").value = time;
    el("seek").setAttribute("aria-valuetext", `${now.toFixed(1)} seconds`);
    if (chart) chart.grow(now);
    if (mark !== marked) {
      marked = mark;
      for (const [k, one] of [...el("marks").querySelectorAll("button")].entries()) one.classList.toggle("now", story.marks[k] === mark);
    }
  }

  return { begin, state: () => ({ time, playing, speed }) };
})();
