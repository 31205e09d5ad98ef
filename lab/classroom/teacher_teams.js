// The board of a class in teams: whose learner is ahead, the curves of all in one picture, and whom each learner trusts.
"use strict";

const classTeams = (() => {
  const { make } = classTile;
  const SVG = "http://www.w3.org/2000/svg", WIDE = 900, HIGH = 200, EDGE = 44;
  const COLOURS = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9"], DASHES = ["", "8 4", "2 3", "10 3 2 3"];
  const el = (id) => document.getElementById(id);

  function drawn(name, attributes, text) {
    const made = document.createElementNS(SVG, name);
    for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
    if (text !== undefined) made.textContent = text;
    return made;
  }

  const colour = (team) => COLOURS[(team - 1) % COLOURS.length];

  // The learning curves of all teams: episodes to the right, steps upwards
  function race(teams) {
    const svg = drawn("svg", { viewBox: `0 0 ${WIDE} ${HIGH}`, role: "img", "aria-label": "the learning curves of the teams" });
    const values = teams.flatMap((team) => team.curve), most = Math.max(1, ...values);
    const last = Math.max(1, ...teams.map((team) => team.episode)), placed = [];
    const x = (share, team) => EDGE + (WIDE - 2 * EDGE - 60) * share * (team.episode / last), y = (value) => 10 + (HIGH - 34) * (1 - value / most);
    svg.append(drawn("line", { x1: EDGE, y1: y(0), x2: WIDE - EDGE, y2: y(0), class: "axis" }), drawn("line", { x1: EDGE, y1: y(0), x2: EDGE, y2: 10, class: "axis" }));
    svg.append(drawn("text", { x: EDGE - 4, y: y(most) + 5, "text-anchor": "end" }, String(Math.round(most))), drawn("text", { x: EDGE - 4, y: y(0), "text-anchor": "end" }, "0"));
    svg.append(drawn("text", { x: WIDE - EDGE - 60, y: HIGH - 6, "text-anchor": "end" }, `episode ${last}`), drawn("text", { x: EDGE, y: HIGH - 6 }, "steps of each episode"));
    const optimal = teams.map((team) => team.optimal).find((value) => value !== null);
    if (optimal) svg.append(drawn("line", { x1: EDGE, y1: y(optimal), x2: WIDE - EDGE, y2: y(optimal), class: "best" }), drawn("text", { x: EDGE + 4, y: y(optimal) + 13 }, `fewest possible: ${optimal}`));
    for (const team of teams.filter((one) => one.curve.length > 1)) {
      const points = team.curve.map((value, k) => `${x(k / (team.curve.length - 1), team).toFixed(1)},${y(value).toFixed(1)}`);
      svg.append(drawn("polyline", { points: points.join(" "), stroke: colour(team.number), "stroke-dasharray": DASHES[Math.floor((team.number - 1) / COLOURS.length) % DASHES.length] }));
      const [at, height] = points[points.length - 1].split(",").map(Number);
      let beside = Math.min(height + 4, y(0) - 2);
      while (placed.some((other) => Math.abs(other - beside) < 14)) beside -= 14; // names of curves that end together
      placed.push(beside);
      svg.append(drawn("text", { x: at + 5, y: beside, class: "name" }, team.name));
      svg.lastChild.style.fill = colour(team.number);
    }
    return svg;
  }

  // Who is ahead among the teams at one lesson: the least steps, and who had them first
  function ahead(teams) {
    const [first, ...others] = teams.filter((team) => team.best !== null).sort((a, b) => a.best - b.best || a.best_at - b.best_at);
    if (!first) return "";
    const shortest = first.optimal !== null && first.best <= first.optimal;
    const level = others.filter((team) => team.best === first.best && team.best_at === first.best_at);
    const names = [first, ...level].map((team) => team.name).join(" and ");
    return `${names} ${!level.length ? "is ahead" : level.length === teams.length - 1 ? "are level" : "are ahead"}: ${shortest ? "the shortest path" : "the best episode"} has ${first.best} steps, in episode ${first.best_at} for the first time.`;
  }

  function bar({ trust, low, high }) {
    const svg = drawn("svg", { viewBox: "0 0 100 12", class: "trust", role: "img", "aria-label": `trust ${Math.round(100 * trust)} %` });
    svg.append(drawn("rect", { x: 0, y: 4, width: 100, height: 4, class: "all" }), drawn("rect", { x: 0, y: 2, width: 100 * trust, height: 8, class: "share" }));
    svg.append(drawn("line", { x1: 100 * low, x2: 100 * high, y1: 6, y2: 6, class: "between" }));
    return svg;
  }

  function member(name, known) {
    const made = make("li", ""), judged = known ? known.good + known.bad : 0;
    made.append(make("b", name));
    if (!known) made.append(make("small", "not asked yet"));
    else made.append(bar(known), make("small", known.dropped ? `dropped: its advice misled` : `${Math.round(100 * known.trust)} % (${Math.round(100 * known.low)} to ${Math.round(100 * known.high)}), ${judged} judged`, known.dropped ? "dropped" : ""));
    return made;
  }

  const STATES = { idle: "waits for you to begin", opening: "opens", open: "learns", over: "done", failed: "failed", stopped: "stopped", lost: "its process has ended" };

  function card(team) {
    const made = make("section", "", "team"), known = new Map(team.board.map((one) => [one.name, one]));
    made.style.borderColor = colour(team.number);
    const facts = `${team.title || `lesson ${team.lesson}`}: ${STATES[team.state]}; episode ${team.episode}${team.episodes ? ` of ${team.episodes}` : ""}, ${team.taken} answers followed`;
    const list = make("ul", "");
    list.append(...team.pupils.map((name) => member(name, known.get(name))));
    made.append(make("h2", team.name), make("p", facts), list);
    return made;
  }

  function show(teams) {
    el("teams").hidden = !teams.length;
    if (!teams.length) return;
    el("begin").hidden = !teams.some((team) => team.state === "idle");
    el("ahead").textContent = new Set(teams.map((team) => team.lesson)).size === 1 ? ahead(teams) : "";
    el("race").replaceChildren(race(teams));
    el("cards").replaceChildren(...teams.map(card));
  }

  return { show };
})();
