// Drawing functions of the teaching seat: the grid with values and preferences, the learning curve, bars.
"use strict";

const seatDraw = (() => {
  const VIRIDIS = ["440154", "472c7a", "3b518b", "2c718e", "21908d", "27ad81", "5cc863", "aadc32", "fde725"];
  const WALL = "#3f464d", FREE = "#f3f4f5", GOAL = "#009e73", ROBOT = "#e69f00", OWN = "#a3447a", INK = "#222222";
  const TURN = [-Math.PI / 2, Math.PI / 2, Math.PI, 0]; // up, down, left, right

  // The colour of a value, 0 lowest and 1 highest: viridis, lightened so that marks are visible on it
  function tint(share) {
    const at = Math.min(Math.max(share, 0), 1) * (VIRIDIS.length - 1), low = Math.min(Math.floor(at), VIRIDIS.length - 2);
    const part = (text, k) => parseInt(text.slice(2 * k, 2 * k + 2), 16);
    const mix = [0, 1, 2].map((k) => part(VIRIDIS[low], k) + (at - low) * (part(VIRIDIS[low + 1], k) - part(VIRIDIS[low], k)));
    return `rgb(${mix.map((value) => Math.round(0.5 * value + 127.5)).join()})`;
  }

  function arrow(pen, x, y, length, turn, thick) {
    const head = Math.min(length * 0.45, 4 * thick + 2);
    pen.save();
    pen.translate(x, y);
    pen.rotate(turn);
    pen.lineWidth = thick;
    pen.beginPath();
    pen.moveTo(-length / 2, 0);
    pen.lineTo(length / 2 - head / 2, 0);
    pen.stroke();
    pen.beginPath();
    pen.moveTo(length / 2, 0);
    pen.lineTo(length / 2 - head, -head * 0.7);
    pen.lineTo(length / 2 - head, head * 0.7);
    pen.fill();
    pen.restore();
  }

  // A small mark for a move along the third axis: a triangle that points up for higher, down for lower
  function level(pen, x, y, size, higher) {
    const up = higher ? -1 : 1;
    pen.beginPath();
    pen.moveTo(x, y + up * size);
    pen.lineTo(x - size, y - up * size * 0.8);
    pen.lineTo(x + size, y - up * size * 0.8);
    pen.fill();
    pen.fillRect(x - size, y + up * size * 1.25 - 0.75, 2 * size, 1.5);
  }

  function point(pen, direction, x, y, length, thick) {
    if (direction === null || direction === undefined) return;
    if (direction < 4) arrow(pen, x, y, length, TURN[direction], thick);
    else level(pen, x, y, length * 0.3, direction === 5);
  }

  function sizeOf(place, width, height) {
    return Math.max(2, Math.floor(Math.min(width / place.columns, height / place.rows, 64)));
  }

  // view: { place, slice, robot: [row, column, layer] or null, question, directions }
  function grid(canvas, view, width, height) {
    const { place, slice } = view, size = sizeOf(place, width, height), sharp = window.devicePixelRatio || 1;
    const wide = size * place.columns, tall = size * place.rows;
    if (canvas.width !== wide * sharp || canvas.height !== tall * sharp) Object.assign(canvas, { width: wide * sharp, height: tall * sharp });
    Object.assign(canvas.style, { width: `${wide}px`, height: `${tall}px` });
    const pen = canvas.getContext("2d");
    pen.setTransform(sharp, 0, 0, sharp, 0, 0);
    cells(pen, view, size);
    goalsElsewhere(pen, view, size);
    if (size >= 9) preferences(pen, view, size);
    robot(pen, view, size);
    if (view.way.length > 1) way(pen, view.way, size);
    return size;
  }

  // A path that is drawn but not sent: a line with a head, on a light line that makes it visible on every colour
  function way(pen, cells, size) {
    const at = ([row, column]) => [(column + 0.5) * size, (row + 0.5) * size];
    pen.save();
    Object.assign(pen, { lineJoin: "round", lineCap: "round" });
    for (const [colour, thick] of [["#ffffff", size / 4 + 3], ["#0072b2", size / 6 + 1]]) {
      Object.assign(pen, { strokeStyle: colour, lineWidth: thick });
      pen.beginPath();
      cells.forEach((cell, k) => (k ? pen.lineTo(...at(cell)) : pen.moveTo(...at(cell))));
      pen.stroke();
    }
    const [from, to] = [at(cells[cells.length - 2]), at(cells[cells.length - 1])];
    pen.translate(...to);
    pen.rotate(Math.atan2(to[1] - from[1], to[0] - from[0]));
    Object.assign(pen, { fillStyle: "#0072b2", strokeStyle: "#ffffff", lineWidth: 1.5 });
    pen.beginPath();
    pen.moveTo(size * 0.45, 0);
    pen.lineTo(-size * 0.15, -size * 0.32);
    pen.lineTo(-size * 0.15, size * 0.32);
    pen.closePath();
    pen.fill();
    pen.stroke();
    pen.restore();
  }

  function cells(pen, { place, slice }, size) {
    const known = slice.values.filter((value) => value !== null);
    const low = known.reduce((a, b) => Math.min(a, b), Infinity), high = known.reduce((a, b) => Math.max(a, b), -Infinity);
    const gap = size > 5 ? 1 : 0;
    pen.fillStyle = "#ffffff";
    pen.fillRect(0, 0, size * place.columns, size * place.rows);
    pen.font = `600 ${Math.round(size * 0.55)}px system-ui, sans-serif`;
    Object.assign(pen, { textAlign: "center", textBaseline: "middle" });
    for (let cell = 0; cell < slice.marks.length; cell += 1) {
      const x = (cell % place.columns) * size, y = Math.floor(cell / place.columns) * size, mark = slice.marks[cell];
      const value = slice.values[cell];
      pen.fillStyle = mark === "#" ? WALL : mark === "G" ? GOAL : value === null ? FREE : tint(high > low ? (value - low) / (high - low) : 0.5);
      pen.fillRect(x, y, size - gap, size - gap);
      if (mark === "#" && size > 7) hatch(pen, x, y, size - gap);
      if (mark === "x") {
        pen.fillStyle = "rgba(230, 159, 0, .45)";
        pen.fillRect(x, y, size - gap, size - gap);
      }
      if (mark === "G" && size > 7) {
        pen.fillStyle = "#ffffff";
        pen.fillText("G", x + size / 2, y + size / 2 + 1);
      }
    }
  }

  // A dashed frame in the cell above or below a goal in another layer
  function goalsElsewhere(pen, { place, slice }, size) {
    pen.save();
    Object.assign(pen, { strokeStyle: GOAL, fillStyle: "#00795a", lineWidth: Math.max(1, size / 14) });
    pen.setLineDash([Math.max(2, size / 6), Math.max(2, size / 8)]);
    for (const [row, column, layer] of place.goals) {
      if (layer === slice.layer) continue;
      pen.strokeRect(column * size + size * 0.12, row * size + size * 0.12, size * 0.74, size * 0.74);
      pen.font = `${Math.round(size * 0.36)}px system-ui, sans-serif`;
      if (size > 18 && slice.marks[row * place.columns + column] === ".") pen.fillText("g", column * size + size * 0.76, row * size + size * 0.74);
    }
    pen.restore();
  }

  function hatch(pen, x, y, size) {
    pen.strokeStyle = "rgba(255, 255, 255, .28)";
    pen.lineWidth = 1;
    pen.beginPath();
    for (const part of [0.35, 0.7]) {
      pen.moveTo(x, y + size * part);
      pen.lineTo(x + size * part, y);
      pen.moveTo(x + size * (1 - part), y + size);
      pen.lineTo(x + size, y + size * (1 - part));
    }
    pen.stroke();
  }

  function preferences(pen, { place, slice, robot: at, directions }, size) {
    const here = at && at[2] === slice.layer ? at[0] * place.columns + at[1] : -1;
    pen.fillStyle = pen.strokeStyle = INK;
    for (const [cell, action, chance] of slice.prefers) {
      if (cell === here) continue;
      pen.globalAlpha = 0.12 + 0.75 * chance * chance;
      point(pen, directions[action], (cell % place.columns + 0.5) * size, (Math.floor(cell / place.columns) + 0.5) * size, size * 0.58, Math.max(1, size / 16));
    }
    pen.globalAlpha = 1;
  }

  function robot(pen, { place, slice, robot: at, question, directions }, size) {
    if (!at || !at.length) return;
    const [row, column, layer] = at, x = (column + 0.5) * size, y = (row + 0.5) * size;
    const own = question && question.kind === "step" ? directions[question.own] : null;
    pen.globalAlpha = layer === slice.layer ? 1 : 0.35;
    if (own !== null && own < 4 && layer === slice.layer) {
      pen.fillStyle = pen.strokeStyle = OWN;
      arrow(pen, x + size * 0.75 * Math.round(Math.cos(TURN[own])), y + size * 0.75 * Math.round(Math.sin(TURN[own])), size * 0.9, TURN[own], Math.max(2, size / 8));
    }
    pen.beginPath();
    pen.arc(x, y, Math.max(2.5, size * 0.4), 0, 2 * Math.PI);
    pen.fillStyle = ROBOT;
    pen.fill();
    pen.lineWidth = Math.max(1, size / 14);
    pen.strokeStyle = INK;
    pen.stroke();
    pen.fillStyle = INK;
    if (own !== null && own > 3 && size > 12) level(pen, x, y, size * 0.16, own === 5);
    else if (size > 12) pen.fillText("R", x, y + 1);
    pen.globalAlpha = 1;
  }

  function node(name, attributes, text) {
    const made = document.createElementNS("http://www.w3.org/2000/svg", name);
    for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
    if (text !== undefined) made.textContent = text;
    return made;
  }

  const nice = (value) => (Math.abs(value) >= 100 ? Math.round(value) : Number(value.toPrecision(3)));

  // The number of episodes on the axis: all of them, or a round number while there are few
  function reach(count, episodes) {
    const round = [20, 50, 100, 200, 500].find((one) => one >= 1.2 * count) || 1.2 * count;
    return Math.max(count, episodes ? Math.min(round, episodes) : Math.round(round));
  }

  // Means as a line, the best order so far as steps, blocks with advice as dots, the bound as a dashed line
  function curve(svg, { per, count, means, guided, bests, best }, { optimal, proven, unit, episodes }) {
    const wide = svg.clientWidth || 400, tall = svg.clientHeight || 170, left = 46, right = 10, top = 10, bottom = 22;
    const last = reach(Math.max(count, per), episodes);
    const high = Math.max(...means, optimal || 0, 1) * 1.05, low = unit === "steps" ? 0 : Math.min(...means, optimal ?? Infinity, high) * 0.97;
    const x = (episode) => left + ((wide - left - right) * episode) / last;
    const y = (value) => top + (tall - top - bottom) * (1 - (value - low) / (high - low || 1));
    const middle = (k) => x(Math.min(per * (k + 0.5) + 0.5, count));
    const parts = [node("line", { x1: left, x2: wide - right, y1: tall - bottom, y2: tall - bottom, stroke: "#8c8c8c" })];
    for (const value of [low, (low + high) / 2, high]) {
      parts.push(node("line", { x1: left, x2: wide - right, y1: y(value), y2: y(value), stroke: "#e3e6e9" }));
      parts.push(node("text", { x: left - 6, y: y(value) + 4, "text-anchor": "end", fill: "#4f5a64" }, nice(value)));
    }
    parts.push(node("text", { x: left, y: tall - 6, fill: "#4f5a64" }, "1"), node("text", { x: wide - right, y: tall - 6, "text-anchor": "end", fill: "#4f5a64" }, `episode ${Math.round(last)}`));
    if (means.length) parts.push(node("polyline", { points: means.map((value, k) => `${middle(k).toFixed(1)},${y(value).toFixed(1)}`).join(" "), fill: "none", stroke: "#0072b2", "stroke-width": 1.4 }));
    if (unit !== "steps" && best) {
      const steps = bests.flatMap((value, k) => [[middle(k), k ? bests[k - 1] : value], [middle(k), value]]);
      parts.push(node("polyline", { points: steps.map(([at, value]) => `${at.toFixed(1)},${y(value).toFixed(1)}`).join(" "), fill: "none", stroke: "#009e73", "stroke-width": 2 }));
      parts.push(node("circle", { cx: x(best[1]), cy: y(best[0]), r: 4, fill: "#009e73", stroke: "#222222", "stroke-width": 0.6 }));
    }
    guided.forEach((times, k) => times && parts.push(node("circle", { cx: middle(k), cy: y(means[k]), r: 3.2, fill: "#e69f00", stroke: "#222222", "stroke-width": 0.6 })));
    if (optimal !== null && optimal !== undefined) {
      parts.push(node("line", { x1: left, x2: wide - right, y1: y(optimal), y2: y(optimal), stroke: "#d55e00", "stroke-width": 1.4, "stroke-dasharray": "6 4" }));
      parts.push(node("text", { x: wide - right, y: y(optimal) - 4, "text-anchor": "end", fill: "#b84f00" }, `${unit === "steps" ? "fewest" : proven ? "optimum" : "bound"} ${nice(optimal)}`));
    }
    svg.replaceChildren(...parts);
    const found = unit !== "steps" && best ? `, best ${nice(best[0])} in episode ${best[1]}` : "";
    const now = means.length ? `, lately ${nice(means[means.length - 1])} ${unit}${found}` : "";
    svg.setAttribute("aria-label", `${seatStatus.count(count, "episode")}${now}, ${guided.filter(Boolean).length} ${per > 1 ? "stretches" : "episodes"} guided`);
  }

  // The improvement rate as a bar from 0, the threshold as a mark; below it the learner asks
  function rate(svg, value, threshold) {
    const wide = svg.clientWidth || 300, most = 0.5, x = (part) => 8 + ((wide - 16) * (Math.min(Math.max(part, -most), most) + most)) / (2 * most);
    const parts = [node("rect", { x: 8, y: 6, width: wide - 16, height: 10, rx: 3, fill: "#ededed" })];
    if (threshold !== null) parts.push(node("rect", { x: 8, y: 6, width: x(threshold) - 8, height: 10, rx: 3, fill: "#f6e2ee" }));
    const from = Math.min(x(0), x(value));
    parts.push(node("rect", { x: from, y: 8, width: Math.max(2, Math.abs(x(value) - x(0))), height: 6, fill: value < (threshold ?? 0) ? "#d55e00" : "#009e73" }));
    parts.push(node("line", { x1: x(0), x2: x(0), y1: 4, y2: 18, stroke: "#222222" }), node("text", { x: x(0) - 4, y: 30, "text-anchor": "end", fill: "#4f5a64" }, "0"));
    if (threshold !== null) {
      parts.push(node("line", { x1: x(threshold), x2: x(threshold), y1: 2, y2: 20, stroke: "#a3447a", "stroke-width": 2 }));
      parts.push(node("text", { x: x(threshold) + 4, y: 30, fill: "#a3447a" }, `asks below ${Math.round(100 * threshold)} %`));
    }
    svg.replaceChildren(...parts);
  }

  // The trust in an advisor, 0 to 1, with its 95 % interval
  function trust({ trust: at, low, high, dropped }) {
    const svg = node("svg", { viewBox: "0 0 100 14", preserveAspectRatio: "none", role: "img", "aria-label": `trust ${Math.round(100 * at)} %, from ${Math.round(100 * low)} to ${Math.round(100 * high)} %` });
    svg.append(node("rect", { x: 0, y: 5, width: 100, height: 4, fill: "#ededed" }));
    svg.append(node("rect", { x: 100 * low, y: 3, width: Math.max(1, 100 * (high - low)), height: 8, fill: dropped ? "#e5b8a0" : "#8fcbef" }));
    svg.append(node("rect", { x: 100 * at - 0.7, y: 0, width: 1.4, height: 14, fill: "#222222" }));
    return svg;
  }

  return { grid, curve, rate, trust, nice };
})();
