// A pupil's tile: name, learning curve, whether it asks, whether the pupil is believed, and what the teacher may do.
"use strict";

const classTile = (() => {
  const SVG = "http://www.w3.org/2000/svg", WIDE = 240, HIGH = 64, LONG_S = 60, SURE_MS = 3000;
  const STATES = { idle: "", opening: "opens", open: "", over: "done", failed: "failed", stopped: "stopped", lost: "its process has ended" };
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

  // The means of the episodes, guided ones orange, and the fewest steps possible, or the proven bound of an order, as a line
  function curve({ curve: means, guided, optimal, kind }) {
    const svg = document.createElementNS(SVG, "svg");
    svg.setAttribute("viewBox", `0 0 ${WIDE} ${HIGH}`);
    svg.setAttribute("role", "img");
    svg.setAttribute("aria-label", means.length ? `${kind === "order" ? "cost of an episode's order" : "steps an episode"}, lately ${Math.round(means[means.length - 1])}` : "no episode yet");
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

  const best = ({ kind, best: least, optimal, proven }) => (kind !== "order" || least === null ? "" : `; best order ${Math.round(least)}${optimal ? `, ${proven ? "optimum" : "bound"} ${Math.round(optimal)}` : ""}`);
  // How the lesson of a tile ended: solved, or how far it got; a longer path than the shortest is not solved
  function ending({ kind, solved, final_steps: steps, optimal }) {
    if (kind === "order") return solved ? "found a best order" : "its order is not proven the best";
    if (solved) return `solved${steps ? ` in ${Math.round(steps)} steps` : ""}`;
    return steps ? `not solved, ${Math.round(steps)} steps${optimal ? `, fewest ${optimal}` : ""}` : "not solved";
  }


  function status(tile) {
    if (tile.state === "idle") return [tile.study ? tile.study.doing : "", tile.study && tile.study.doing === "finished" ? "over" : ""];
    if (tile.commands !== undefined && ["open", "over"].includes(tile.state)) return tile.state === "over" ? ["the run is over", "over"] : [tile.turn ? "operates" : "watches", tile.turn ? "asks" : ""];
    if (tile.state === "over") return [`${STATES.over}: ${ending(tile)}`, tile.state];
    if (tile.state !== "open") return [`${STATES[tile.state]}${tile.text ? `: ${tile.text}` : ""}`, tile.state];
    if (!tile.here && tile.asks) return ["asks, and nobody is there", "away"];
    if (tile.asks) return [`asks${tile.asked_s >= LONG_S ? `, waits ${Math.floor(tile.asked_s / 60)} min` : ""}`, tile.asked_s >= LONG_S ? "stuck" : "asks"];
    return [VERDICTS[tile.verdict] || "works alone", tile.verdict === "rejected" ? "dropped" : ""];
  }

  // What cannot be undone takes a second click within some seconds
  function twice(made, again, act) {
    let sure = 0;
    made.onclick = () => {
      const text = made.textContent;
      if (performance.now() < sure) {
        sure = 0;
        act();
        return;
      }
      sure = performance.now() + SURE_MS;
      made.textContent = again;
      setTimeout(() => { if (made.textContent === again) made.textContent = text; }, SURE_MS);
    };
  }

  // An empty tile, whose buttons stay the same while what it says changes; act: what they do, by name
  function create(act) {
    const box = make("article", undefined, "tile"), head = make("h2"), says = make("p", "", "says"), facts = make("p"), hint = make("p", "", "hint"), row = make("p", undefined, "row");
    const name = make("span"), here = make("small"), form = make("form", undefined, "row"), field = make("input");
    const parts = { box, name, here, says, facts, hint, picture: curve({ curve: [], guided: [] }), tile: null };
    field.maxLength = 200;
    form.hidden = true;
    form.append(field, make("button", "Show"));
    form.onsubmit = (event) => {
      event.preventDefault();
      form.hidden = true;
      act.hint(parts.tile, field.value);
    };
    parts.help = button("Help", "answer for this pupil", () => act.help(parts.tile));
    parts.open = button("Open again", "go on where it stopped", () => act.open(parts.tile));
    const ask = button("Hint", "a line on this pupil's page", () => {
      form.hidden = false;
      field.value = parts.tile.hint;
      field.setAttribute("aria-label", `hint for ${parts.tile.name}`);
      field.focus();
    });
    const look = button("Look", "over the shoulder, live; while you help you answer there", () => act.look(parts.tile));
    parts.turn = button("Your turn", "let this pupil operate now", () => act.turn(parts.tile));
    const remove = button("Remove", "take this seat away, for good", () => {});
    twice(remove, "Once more: remove", () => act.remove(parts.tile));
    head.append(name, here);
    Object.assign(parts, { hints: ask, next: button("Next", "to the next lesson", () => act.next(parts.tile)), remove });
    row.append(look, parts.turn, parts.help, ask, parts.next, remove, parts.open);
    box.append(head, parts.picture, says, facts, hint, row, form);
    return parts;
  }

  // may: which of the buttons are there
  function draw(parts, tile, may) {
    const [says, kind] = status(tile), picture = curve(tile);
    parts.tile = tile;
    parts.box.className = `tile ${kind}`;
    parts.picture.replaceWith(picture);
    parts.picture = picture;
    parts.name.textContent = tile.name;
    parts.here.textContent = parts.here.className = tile.here ? "here" : "away";
    parts.says.textContent = says;
    const answers = `${tile.taken} answered${tile.skipped ? `, ${tile.skipped} left to it` : ""}${tile.misleads ? `, ${tile.misleads} did not help` : ""}`;
    parts.facts.textContent = `${tile.title || "no lesson yet"}: episode ${tile.episode}${tile.episodes ? ` of ${tile.episodes}` : ""}; ${answers}${best(tile)}`;
    if (tile.study) parts.facts.textContent = `Step ${tile.study.step} of ${tile.study.steps}${tile.study.arm ? `, arm ${tile.study.arm}` : ""} (${tile.study.order.join(", ")})${tile.state === "idle" ? "" : `; ${parts.facts.textContent}`}`;
    if (tile.commands !== undefined) parts.facts.textContent = `${tile.commands} ${tile.commands === 1 ? "command" : "commands"}`;
    parts.picture.classList.toggle("none", tile.commands !== undefined);
    parts.turn.hidden = !may.includes("turn") || tile.turn || tile.state !== "open";
    parts.help.hidden = !may.includes("help");
    parts.hints.hidden = !may.includes("hint");
    parts.next.hidden = !may.includes("next");
    parts.remove.hidden = !may.includes("remove");
    parts.hint.textContent = tile.hint ? `Hint: ${tile.hint}` : "";
    parts.help.textContent = tile.helped ? "Give back" : "Help";
    parts.open.hidden = !["failed", "stopped", "lost"].includes(tile.state);
  }

  return { create, draw, make, twice };
})();
