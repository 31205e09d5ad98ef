// The map of the teaching seat: one layer of the grid, or the environment's own drawing; looked at, pointed at, clicked.
"use strict";

const seatMap = (() => {
  const STEPS = [[-1, 0], [1, 0], [0, -1], [0, 1]]; // up, down, left, right
  const HINT = "colours: what it is worth, yellow most; arrows: what it prefers";
  const el = (id) => document.getElementById(id);
  let place = null, slice = null, asked = null, cell = 0, layer = null, told = { go() {}, look() {} };

  function show(state, shown) {
    ({ place, slice } = state);
    asked = shown;
    el("map").hidden = !place || !slice;
    if (el("map").hidden) return;
    const at = shown && shown.at.length ? shown.at : state.robot;
    const room = Math.min(el("map").clientWidth || 340, 440), tall = Math.max(200, Math.min(room, window.innerHeight * (window.innerWidth < 900 ? 0.36 : place.layers > 1 ? 0.4 : 0.43)));
    cell = seatDraw.grid(el("grid"), { place, slice, robot: at, question: shown, directions: place.directions }, room, tall);
    el("grid").setAttribute("aria-label", inWords(at));
    showLayers(at);
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

  // The layer to look at, null for the robot's
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

  // A click beside the robot is the move there
  function clicked(event) {
    const there = under(event);
    if (!there || !asked || !asked.at.length || slice.layer !== asked.at[2]) return;
    const direction = STEPS.findIndex(([down, right]) => there[0] - asked.at[0] === down && there[1] - asked.at[1] === right);
    if (direction >= 0) told.go(direction);
  }

  function picture(shown) {
    if (!shown) return; // the last drawing stays
    el("picture").hidden = !shown.picture.length;
    const lines = shown.picture.flatMap((line) => [...line.map(([text, kind]) => seatStatus.make("span", text, kind)), "\n"]);
    el("picture").replaceChildren(...lines);
  }

  el("layer").oninput = () => look(Number(el("layer").value));
  el("layer").onpointerup = () => el("layer").blur();
  el("layer-robot").onclick = () => look(null);
  el("grid").onpointermove = readOut;
  el("grid").onpointerleave = () => { el("readout").textContent = HINT; };
  el("grid").onclick = clicked;

  return {
    show,
    picture,
    // whom to tell of a click and of a layer, and after a reconnection once more of the layer
    tell(listener) {
      told = listener;
      if (layer !== null) told.look(layer);
    },
  };
})();
