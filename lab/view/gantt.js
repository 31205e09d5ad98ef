// A growing Gantt chart: activities as bars, the plan in outline behind them, and a line at the current time.
"use strict";

const labGantt = (() => {
  const ROW = 20, TOP = 18, FOOT = 18, RIGHT = 12;
  const SIGNS = { fault: "▲", trouble: "●", stop: "■", lost: "✕", operator: "◆" };
  const SAYS = { carry: "carries", pallet: "carries an empty pallet", empty: "goes empty", wait: "waits", service: "serves", process: "works on", blocked: "has finished, not fetched yet:", store: "keeps" };

  function node(name, attributes, text) {
    const made = document.createElementNS("http://www.w3.org/2000/svg", name);
    for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
    if (text !== undefined) made.textContent = text;
    return made;
  }

  // The robot's row first, then machines in the order of first use
  function rowsOf(activities, robot = "robot") {
    const names = [...new Set([...activities].sort((a, b) => a.start_s - b.start_s).map((one) => one.resource))];
    return [...names.filter((name) => name === robot), ...names.filter((name) => name !== robot)];
  }

  const leftOf = (svg) => (svg.clientWidth < 520 ? 76 : 104);

  function tickOf(last, wide) {
    const most = Math.max(2, Math.floor(wide / 64));
    return [1, 2, 5, 10, 20, 30, 60, 120, 300, 600, 1200, 3600, 7200, 14400, 43200, 86400, 604800, 2592000].find((step) => last / step <= most) || last;
  }

  function words(one) {
    const what = one.part === null || one.kind === "empty" ? "" : ` ${one.name || `part ${one.part}`}`;
    const way = one.origin === one.target ? "" : ` from ${one.origin} to ${one.target}`;
    return `${one.resource} ${SAYS[one.kind] || one.kind}${what}${way}, ${one.start_s.toFixed(1)} to ${one.end_s.toFixed(1)} s`;
  }

  function bar(one, row, x, outline) {
    const wait = one.kind === "wait", top = TOP + row * ROW + (outline ? 1 : wait ? 7 : 4);
    const made = node("rect", {
      x: x(one.start_s), y: top, width: Math.max(1, x(one.end_s) - x(one.start_s)), height: outline ? ROW - 2 : wait ? 6 : ROW - 8,
      class: outline ? "planned" : `k-${one.kind}`,
    });
    made.append(node("title", {}, `${outline ? "planned: " : ""}${words(one)}`));
    if (outline) return [made];
    if (one.color) Object.assign(made.style, { fill: one.color, fillOpacity: one.kind === "blocked" ? 0.35 : 1 });
    const room = x(one.end_s) - x(one.start_s), name = one.name || String(one.part ?? "");
    const text = [name, (name.match(/\d+$/) || [""])[0]].find((words) => room > 4 + 6.4 * words.length);
    if (!text || !["carry", "pallet", "process"].includes(one.kind)) return [made];
    return [made, node("text", { x: (x(one.start_s) + x(one.end_s)) / 2, y: top + 10, "text-anchor": "middle", class: one.color ? "" : `on-${one.kind}` }, text)];
  }

  // chart: { rows, measured, planned, marks, end_s }; returns functions that move the time line, and give the time at a position
  function draw(svg, { rows, measured, planned, marks, end_s }) {
    const wide = svg.clientWidth || 600, left = leftOf(svg), last = Math.max(end_s, 1), foot = TOP + rows.length * ROW;
    const room = wide - left - RIGHT, x = (seconds) => left + (room * Math.min(Math.max(seconds, 0), last)) / last;
    svg.style.height = `${foot + FOOT}px`;
    const most = Math.floor((left - 8) / 6.2), parts = rows.map((row, k) => node("text", { x: left - 8, y: TOP + k * ROW + 14, "text-anchor": "end", class: "row" }, row.length > most ? `${row.slice(0, most - 1)}…` : row));
    for (let at = 0, step = tickOf(last, room); at <= last; at += step) {
      parts.push(node("line", { x1: x(at), x2: x(at), y1: TOP, y2: foot, class: "tick" }));
      parts.push(node("text", { x: x(at), y: foot + 13, "text-anchor": "middle", class: "row" }, at + step > last ? `${at} s` : at));
    }
    const kept = (one) => rows.includes(one.resource), bars = (all, outline) => all.filter(kept).flatMap((one) => bar(one, rows.indexOf(one.resource), x, outline));
    parts.push(...bars(planned, true));
    if (measured.some((one) => one.color)) { // a schedule that is known in advance: future activities are pale
      const all = node("g", { opacity: 0.3 });
      all.append(...bars(measured, false));
      parts.push(all);
    }
    const clip = node("clipPath", { id: `${svg.id}-until` }), cut = node("rect", { x: 0, y: 0, width: wide, height: foot });
    const done = node("g", { "clip-path": `url(#${svg.id}-until)` });
    clip.append(cut);
    done.append(...bars(measured, false));
    parts.push(clip, done);
    for (const mark of marks) {
      const sign = node("text", { x: x(mark.at_s), y: 13, "text-anchor": "middle", class: `mark ${mark.kind}` }, SIGNS[mark.kind]);
      sign.append(node("title", {}, `${mark.at_s.toFixed(1)} s: ${mark.words}`));
      parts.push(node("line", { x1: x(mark.at_s), x2: x(mark.at_s), y1: 15, y2: foot, class: `mark ${mark.kind}` }), sign);
    }
    const hand = node("line", { y1: 4, y2: foot + 3, class: "hand" });
    svg.replaceChildren(...parts, hand);
    return {
      grow(now_s) {
        cut.setAttribute("width", x(now_s));
        hand.setAttribute("x1", x(now_s));
        hand.setAttribute("x2", x(now_s));
      },
      timeAt: (clientX) => (last * Math.min(Math.max(clientX - svg.getBoundingClientRect().left - left, 0), room)) / room,
      left,
      right: RIGHT,
    };
  }

  return { draw, rowsOf, SIGNS };
})();
