// A pupil's tile: name, learning curve, whether it asks, whether the pupil is believed, and what the teacher may do.
"use strict";

const classTile = (() => {
  const SVG = "http://www.w3.org/2000/svg", WIDE = 240, HIGH = 64, LONG_S = 60;
  const STATES = { opening: "opens", open: "", over: "done", failed: "failed", stopped: "stopped", lost: "its process has ended" };
  const VERDICTS = { rejected: "dropped: its advice misled", converged: "needs no more advice", left: "works alone" };

  function make(name, text, kind) {
    const made = document.createElement(name);
    if (text !== undefined) made.textContent = text;
    if (kind) made.className = kind;
    return made;
  }

  function button(text, title, act) {
    const made = make("button", text);
    made.type = "button";
    made.title = title;
    made.onclick = act;
    return made;
  }

  // The means of the episodes, guided ones orange, and the fewest steps possible as a line
  function curve({ curve: means, guided, optimal }) {
    const svg = document.createElementNS(SVG, "svg");
    svg.setAttribute("viewBox", `0 0 ${WIDE} ${HIGH}`);
    svg.setAttribute("role", "img");
    svg.setAttribute("aria-label", means.length ? `steps an episode, lately ${Math.round(means[means.length - 1])}` : "no episode yet");
    const top = Math.log(Math.max(2, ...means)), low = Math.log(Math.max(1, Math.min(optimal || 1, ...means)));
    const y = (steps) => HIGH - 4 - ((Math.log(Math.max(1, steps)) - low) / Math.max(1e-9, top - low)) * (HIGH - 8);
    const x = (k) => 3 + (k * (WIDE - 6)) / Math.max(1, means.length - 1);
    const add = (name, attributes) => {
      const made = document.createElementNS(SVG, name);
      for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
      svg.append(made);
    };
    if (optimal) add("line", { x1: 0, x2: WIDE, y1: y(optimal), y2: y(optimal), class: "best" });
    if (means.length > 1) add("polyline", { points: means.map((steps, k) => `${x(k).toFixed(1)},${y(steps).toFixed(1)}`).join(" ") });
    means.forEach((steps, k) => { if (guided[k]) add("circle", { cx: x(k).toFixed(1), cy: y(steps).toFixed(1), r: 2.5 }); });
    return svg;
  }

  function status(tile) {
    if (tile.state !== "open") return [`${STATES[tile.state]}${tile.text ? `: ${tile.text}` : ""}${tile.state === "over" ? (tile.solved ? ": reached its goal" : ": did not reach its goal") : ""}`, tile.state];
    if (!tile.here && tile.asks) return ["asks, and nobody is there", "away"];
    if (tile.asks) return [`asks${tile.asked_s >= LONG_S ? `, waits ${Math.floor(tile.asked_s / 60)} min` : ""}`, tile.asked_s >= LONG_S ? "stuck" : "asks"];
    return [VERDICTS[tile.verdict] || "works alone", tile.verdict === "rejected" ? "dropped" : ""];
  }

  // A tile; act: what its buttons do, by name
  function draw(box, tile, act) {
    const open = box.querySelector("input") && document.activeElement === box.querySelector("input");
    if (open) return; // a hint is being typed
    const [says, kind] = status(tile), head = make("h2");
    head.append(make("span", tile.name), make("small", tile.here ? "here" : "away", tile.here ? "here" : "away"));
    const answers = `${tile.taken} answered${tile.skipped ? `, ${tile.skipped} left to it` : ""}${tile.misleads ? `, ${tile.misleads} did not help` : ""}`;
    const facts = make("p", `${tile.title || "no lesson yet"}: episode ${tile.episode}${tile.episodes ? ` of ${tile.episodes}` : ""}; ${answers}`);
    const row = make("p", undefined, "row"), look = make("a", "Look");
    look.href = `/desk/${location.search}&pupil=${tile.number}`;
    look.target = "_blank";
    look.title = "over the shoulder, live; while you help you answer there";
    row.append(look, button(tile.helped ? "Give back" : "Help", "answer for this pupil", () => act.help(tile)));
    row.append(button("Hint", "a line on this pupil's page", () => hint(box, tile, act)), button("Next", "to the next lesson", () => act.next(tile)));
    if (["failed", "stopped", "lost"].includes(tile.state)) row.append(button("Open again", "go on where it stopped", () => act.open(tile)));
    box.className = `tile ${kind}`;
    box.replaceChildren(head, curve(tile), make("p", says, "says"), facts, ...(tile.hint ? [make("p", `Hint: ${tile.hint}`, "hint")] : []), row);
  }

  function hint(box, tile, act) {
    const form = make("form", undefined, "row"), field = make("input");
    field.maxLength = 200;
    field.value = tile.hint;
    field.setAttribute("aria-label", `hint for ${tile.name}`);
    form.append(field, make("button", "Show"));
    form.onsubmit = (event) => {
      event.preventDefault();
      field.blur();
      act.hint(tile, field.value);
    };
    box.append(form);
    field.focus();
  }

  return { draw, make };
})();
