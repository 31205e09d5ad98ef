// The map of the teaching seat: one layer of the grid, or the environment's own drawing; for viewing, clicking, drawing a path.
"use strict";

const seatMap = (() => {
  const STEPS = [[-1, 0], [1, 0], [0, -1], [0, 1]]; // up, down, left, right
  const HINT = "colours: worth; arrows: what it prefers; drag from R to draw a path";
  const el = (id) => document.getElementById(id);
  let place = null, slice = null, asked = null, cell = 0, layer = null, told = { go() {}, look() {}, can: () => false };
  let said = []; // the cells of the path that a sentence was understood to mean
  let way = [], view = null, pen = null; // the cells of the drawn path, the robot's first; the current view; the pointer that draws

  function show(state, shown) {
    ({ place, slice } = state);
    asked = shown;
    if (way.length && !(shown && same(shown.at, way[0]))) way = [];
    said = shown && shown.heard && shown.heard.path ? shown.heard.path.filter((spot) => !slice || spot[2] === slice.layer) : [];
    el("map").hidden = !place || !slice;
    if (el("map").hidden) return;
    const at = shown && shown.at.length ? shown.at : state.robot;
    const room = Math.min(el("map").clientWidth || 340, 440), tall = Math.max(200, Math.min(room, window.innerHeight * (window.innerWidth < 900 ? 0.36 : place.layers > 1 ? 0.4 : 0.43)));
    view = { at, room, tall };
    paint();
    el("grid").setAttribute("aria-label", inWords(at));
    showLayers(at);
  }

  function paint() {
    cell = seatDraw.grid(el("grid"), { place, slice, way: said.length > 1 ? said : way, robot: view.at, question: asked, directions: place.directions }, view.room, view.tall);
    el("way").hidden = way.length < 2;
    if (way.length > 1) el("way-text").textContent = `A path of ${seatStatus.count(way.length - 1, "move")}`;
  }

  function inWords(at) {
    const named = ([row, column]) => `row ${row + 1}, column ${column + 1}`;
    const goal = place.goals.find((one) => one[2] === slice.layer);
    return `Grid of ${place.rows} rows and ${place.columns} columns${at && at.length ? `, the robot in ${named(at)}` : ""}${goal ? `, the goal in ${named(goal)}` : ""}; ${HINT}`;
  }

  function showLayers(at) {
    el("layers").hidden = place.layers < 2;
    Object.assign(el("layer"), { max: place.layers - 1, value: slice.layer });
    const here = [at && at[2] === slice.layer ? "robot" : "", place.goals.some((one) => one[2] === slice.layer) ? "goal" : ""].filter(Boolean);
    const text = `${slice.layer} of 0–${place.layers - 1}${here.length ? `: ${here.join(", ")}` : ""}`;
    el("layer-name").textContent = text;
    el("layer").setAttribute("aria-valuetext", text);
    el("layer-robot").hidden = layer === null;
  }

  // The layer to show, null for the robot's
  function look(wanted) {
    layer = wanted;
    el("layer-robot").hidden = layer === null;
    told.look(layer);
  }

  function under(event) {
    const box = el("grid").getBoundingClientRect();
    const column = Math.floor((event.clientX - box.left) / cell), row = Math.floor((event.clientY - box.top) / cell);
    return row >= 0 && column >= 0 && row < place.rows && column < place.columns ? [row, column] : null;
  }

  function readOut(event) {
    const there = under(event);
    if (!there) return;
    const index = there[0] * place.columns + there[1], value = slice.values[index];
    const what = { "#": "obstacle", G: "goal", x: "covered" }[slice.marks[index]];
    const worth = value === null ? what || "never tried" : `worth ${value}${what ? `, ${what}` : ""}`;
    el("readout").textContent = `row ${there[0] + 1}, column ${there[1] + 1}: ${worth}`;
  }

  // ---- a path drawn from the robot by mouse, finger, or Shift and the arrow keys

  const same = (one, other) => one.length === other.length && one.every((value, k) => value === other[k]);
  const drawable = () => Boolean(asked && asked.kind === "step" && asked.at.length && slice && slice.layer === asked.at[2] && told.can());
  const end = () => way[way.length - 1];
  const mark = ([row, column]) => slice.marks[row * place.columns + column];

  // Extend the path by a cell, or take its last cell back; false at the grid's edge, an obstacle, or a path's end
  function step(direction) {
    if (!drawable()) return false;
    if (!way.length) way = [asked.at];
    const [row, column] = end(), [down, right] = STEPS[direction], next = [row + down, column + right, asked.at[2]];
    if (way.length > 1 && same(way[way.length - 2], next)) way.pop();
    else if (next[0] < 0 || next[1] < 0 || next[0] >= place.rows || next[1] >= place.columns || mark(next) === "#") return false;
    else if (way.length > 1 && mark(end()) === "G") return false;
    else way.push(next);
    paint();
    return true;
  }

  // Extend the path cell by cell to the pointer, up to the first obstacle
  function toward(there) {
    for (let left = place.rows + place.columns; left > 0 && !(end()[0] === there[0] && end()[1] === there[1]); left -= 1) {
      const down = there[0] - end()[0], right = there[1] - end()[1], upright = down < 0 ? 0 : 1, across = right < 0 ? 2 : 3;
      const [first, second] = Math.abs(down) > Math.abs(right) ? [upright, right ? across : null] : [across, down ? upright : null];
      if (!step(first) && (second === null || !step(second))) return;
    }
  }

  function drop() {
    const had = way.length > 1;
    way = [];
    if (view && place && slice) paint();
    return had;
  }

  const beside = (there, from) => Math.abs(there[0] - from[0]) + Math.abs(there[1] - from[1]) <= 1;

  // A path begins at the robot, or continues at its end; elsewhere a finger scrolls the page
  function begins(event) {
    const there = drawable() ? under(event) : null;
    return there && (beside(there, asked.at) || (way.length > 1 && beside(there, end()))) ? there : null;
  }

  function pressed(event) {
    const there = event.button === 0 ? begins(event) : null;
    if (!there) return;
    if (way.length < 2 || !beside(there, end())) way = [asked.at];
    pen = { id: event.pointerId, from: there, moved: false };
    el("grid").setPointerCapture(event.pointerId);
  }

  function moved(event) {
    readOut(event);
    const there = pen && pen.id === event.pointerId && drawable() ? under(event) : null;
    if (!there || (!pen.moved && same(there, pen.from))) return;
    pen.moved = true;
    toward(there);
  }

  // A press on a cell next to the robot, without drawing, is the move to it
  function released(event) {
    if (!pen || pen.id !== event.pointerId) return;
    const { from, moved: drew } = pen;
    pen = null;
    if (drew || !asked || !asked.at.length) return;
    if (way.length > 1) return toward(from);
    way = [];
    const direction = STEPS.findIndex(([down, right]) => from[0] - asked.at[0] === down && from[1] - asked.at[1] === right);
    if (direction >= 0) told.go(direction);
  }

  // A world without a grid, as lines, areas and discs
  function drawn(shapes) {
    const made = shapes.map((shape) => {
      const name = shape.disc ? "circle" : shape.area ? "polygon" : "polyline";
      const part = document.createElementNS("http://www.w3.org/2000/svg", name);
      const [x, y, r] = shape.disc || [];
      const at = shape.disc ? { cx: x, cy: y, r } : { points: (shape.area || shape.line).map((point) => point.join()).join(" ") };
      for (const [key, value] of Object.entries({ ...at, class: `${shape.kind}${shape.line ? " line" : ""}` })) part.setAttribute(key, value);
      return part;
    });
    el("shapes").toggleAttribute("hidden", !made.length);
    el("shapes").replaceChildren(...made);
  }

  function picture(shown) {
    if (!shown) return; // the last drawing remains
    drawn(shown.shapes);
    el("picture").hidden = !shown.picture.length || shown.shapes.length > 0;
    const lines = shown.picture.flatMap((line) => [...line.map(([text, kind]) => seatStatus.make("span", text, kind)), "\n"]);
    el("picture").replaceChildren(...lines);
  }

  el("layer").oninput = () => look(Number(el("layer").value));
  el("layer").onpointerup = () => el("layer").blur();
  el("layer-robot").onclick = () => look(null);
  el("grid").onpointerdown = pressed;
  el("grid").onpointermove = moved;
  el("grid").onpointerup = released;
  el("grid").onpointercancel = () => { pen = null; };
  el("grid").addEventListener("touchstart", (event) => { if (event.touches.length === 1 && begins(event.touches[0])) event.preventDefault(); }, { passive: false });
  el("readout").textContent = HINT;
  el("grid").onpointerleave = () => { el("readout").textContent = HINT; };

  return {
    show,
    picture,
    step,
    drop,
    // the directions of the drawn path
    drawn: () => way.slice(1).map(([row, column], k) => STEPS.findIndex(([down, right]) => row - way[k][0] === down && column - way[k][1] === right)),
    // the functions to call for a click and for a layer; after a reconnection the layer is reported again
    tell(listener) {
      told = listener;
      if (layer !== null) told.look(layer);
    },
  };
})();
