// The page of lab find: shows the proposals, and sends their names; page.js calls it as it calls a teaching seat.
"use strict";

const seat = (() => {
  const el = (id) => document.getElementById(id), CELL = 26, LEAST = 8, WIDE = 860;
  let send = null, lines = [], cells = new Map(), drawn = false;

  function make(name, text, kind) {
    const made = document.createElement(name);
    if (text !== undefined) made.textContent = text;
    if (kind) made.className = kind;
    return made;
  }

  function showMap(map) {
    const rows = map.split("\n"), columns = Math.max(...rows.map((row) => row.length));
    el("finding-map").hidden = !map;
    el("finding-map").style.setProperty("--cell", `${Math.max(LEAST, Math.min(CELL, Math.floor(WIDE / columns)))}px`);
    el("finding-map").style.gridTemplateColumns = `repeat(${columns}, var(--cell))`;
    el("finding-map").replaceChildren(...rows.flatMap((row) => [...row.padEnd(columns)].map((mark) => {
      const made = make("i", mark === "." || mark === " " ? "" : mark, mark === " " ? "wall" : mark === "S" || mark === "G" ? "end" : mark === "." ? "" : "way");
      if (made.className === "way") cells.set(mark, [...(cells.get(mark) || []), made]);
      return made;
    })));
  }

  function showLine({ mark, name, where, more }) {
    const line = make("li"), label = make("label"), wanted = make("input"), field = make("input");
    wanted.type = "checkbox";
    wanted.checked = true;
    wanted.setAttribute("aria-label", `accept ${name}`);
    field.type = "text";
    field.maxLength = 40;
    field.value = name;
    field.setAttribute("aria-label", `the name of ${name}`);
    wanted.onchange = () => {
      field.disabled = !wanted.checked;
      for (const cell of cells.get(mark) || []) cell.classList.toggle("refused", !wanted.checked);
    };
    label.append(wanted, make("b", mark));
    line.append(label, field, make("span", `at ${where}${more ? ` and ${more} more` : ""}`));
    lines.push({ wanted, field });
    return line;
  }

  function enable() {
    const chosen = Boolean(el("finding-said").textContent);
    for (const part of el("finding-form").querySelectorAll("input, button")) part.disabled = !send || chosen || (part.type === "text" && !part.closest("li").querySelector("[type=checkbox]").checked);
  }

  function online(how) {
    send = how;
    enable();
  }

  el("finding-form").onsubmit = (event) => {
    event.preventDefault();
    el("finding-refusal").textContent = "";
    send({ names: lines.map(({ wanted, field }) => (wanted.checked ? field.value.trim() : null)) });
  };

  return {
    update({ title, map, proposals, said }) {
      if (!drawn) {
        drawn = true;
        el("finding-title").textContent = `Sub-tasks that were found in ${title}`;
        showMap(map);
        el("finding-list").replaceChildren(...proposals.map(showLine));
      }
      el("finding-said").textContent = said;
      enable();
    },
    refused: (text) => { el("finding-refusal").textContent = text; },
    connected: online,
    lost: () => online(null),
    over: () => online(null),
  };
})();
