// The panels beside the question: learning curve, standing of advice, messages, the work, the receipt, a run's progress.
"use strict";

const seatStatus = (() => {
  const el = (id) => document.getElementById(id);
  const percent = (part) => `${Math.round(100 * part)} %`;
  const count = (number, thing) => `${number} ${thing}${number === 1 ? "" : "s"}`;

  function make(name, text, kind) {
    const made = document.createElement(name);
    if (text !== undefined) made.textContent = text;
    if (kind) made.className = kind;
    return made;
  }

  const SHOWN = [
    [["curve", "lesson"], showCurve],
    [["standing", "lesson"], showStanding],
    [["notices"], showNotices],
    [["members"], showMembers],
    [["work"], showWork],
    [["receipt"], showReceipt],
    [["progress"], showProgress],
  ];

  // Draw the changed parts of the document
  function show(state, parts) {
    for (const [names, draw] of SHOWN) if (names.some((name) => parts.has(name))) draw(state);
  }

  function showCurve({ curve, lesson }) {
    el("curve-figure").hidden = !curve.count && !lesson.title;
    el("curve-figure").classList.toggle("order", lesson.unit !== "steps");
    const whose = lesson.method ? ` by ${lesson.method}` : "", guided = curve.guided.some(Boolean) ? "; orange: guided" : "";
    el("curve-title").textContent = lesson.unit === "steps" ? "Steps an episode; orange: guided" : `Cost of each order tried${whose}; green: the best so far${guided}`;
    el("learned").hidden = !lesson.learned.length;
    el("learned").replaceChildren(...lesson.learned.map((line) => make("li", line)));
    if (!el("curve-figure").hidden) seatDraw.curve(el("curve"), curve, lesson);
  }

  function showStanding({ standing: now, lesson }) {
    const rows = [];
    el("rate").hidden = now.rate === null;
    if (now.rate !== null) {
      const means = now.current === null ? "" : ` (${seatDraw.nice(now.current)} after ${seatDraw.nice(now.previous)})`;
      const text = `Improvement ${now.rate > 0 ? "+" : ""}${(100 * now.rate).toFixed(1)} %`;
      el("rate-text").textContent = text + means;
      seatDraw.rate(el("rate-bar"), now.rate, lesson.threshold);
      el("rate-bar").setAttribute("aria-label", `${text}${lesson.threshold === null ? "" : `, it asks below ${percent(lesson.threshold)}`}`);
    }
    if (lesson.kind === "steps" && (now.requests || now.omega !== null)) {
      rows.push(["Asked in", count(now.requests, "episode")], ["Answers", `${now.taken}${now.skipped ? `, ${now.skipped} left to it` : ""}`]);
      rows.push(["Moves helped", now.budget === null ? String(now.helped_steps) : `${now.helped_steps} of ${now.budget}`]);
    }
    if (now.remembered) rows.push(["From memory", count(now.remembered, "step")]);
    if (now.omega !== null && lesson.kind === "steps") rows.push(["Did not help", now.misleads > now.omega ? `${now.misleads}, only ${now.omega} tolerated` : now.omega ? `${now.misleads} of ${now.omega} tolerated` : "never; none tolerated", now.misleads > now.omega ? "bad" : ""]);
    else if (now.misleads && lesson.kind === "steps") rows.push(["Did not help", String(now.misleads), ""]);
    el("standing").replaceChildren(...rows.flatMap(([name, value, kind]) => [make("dt", name), make("dd", value, kind || "")]));
  }

  function showNotices({ notices }) {
    const last = notices[notices.length - 1];
    el("notices").hidden = !last;
    el("notices").querySelector("ol").replaceChildren(...[...notices].reverse().map((one) => make("li", `${one.text}${one.times > 1 ? ` (${one.times} times)` : ""}`, one.tone)));
    el("announce").textContent = last ? last.text : "";
  }

  function showMembers({ members }) {
    el("members").hidden = !members.length;
    el("members").querySelector("div").replaceChildren(...members.flatMap((one) => {
      const bar = seatDraw.trust(one);
      return [make("b", one.name), bar, make("span", one.dropped ? `${percent(one.trust)}, not heard` : percent(one.trust), one.dropped ? "dropped" : "")];
    }));
  }

  function showWork({ work }) {
    el("work").hidden = !work || !work.measured.length;
    if (el("work").hidden) return;
    el("work").querySelector("[data-kind=pallet]").hidden = !work.measured.some((one) => one.kind === "pallet");
    labGantt.draw(el("bars"), { ...work, planned: work.measured, marks: [], end_s: Math.max(work.end_s, work.now_s) }).grow(work.now_s);
    const moves = work.measured.filter((one) => ["carry", "pallet"].includes(one.kind)).length;
    el("bars").setAttribute("aria-label", `${count(moves, "move")} so far, ${Math.round(work.now_s)} s`);
  }

  function receiptRows(of) {
    const rows = [["It asked in", `${count(of.requests, "episode")}, about ${count(of.questions, "step")}`]];
    if (of.taken) rows.push([of.yours ? "With your help" : "With advice", `${count(of.taken, "step")}, ${of.agreed} its own choice, too`]);
    for (const [why, times] of Object.entries(of.refused)) rows.push(["Not followed", `${times}: ${why}`]);
    if (of.guided) rows.push(["Guided", `${count(of.guided, "episode")}, ${of.better} better than before${of.best ? `, ${of.best} as good as the best` : ""}`]);
    if (of.remembered) rows.push(["From memory", count(of.remembered, "step")]);
    if (of.change_percent !== null) rows.push(["Steps an episode", `${seatDraw.nice(of.mean_before)} before, ${seatDraw.nice(of.mean_after)} after (${of.change_percent > 0 ? "+" : ""}${Math.round(of.change_percent)} %)`]);
    if (of.skill) rows.push([of.yours ? "Your skill" : "Skill", `${of.skill.word}: tau ${seatDraw.nice(of.skill.tau)}, ${seatDraw.nice(of.skill.low)} to ${seatDraw.nice(of.skill.high)}`]);
    if (of.against_best !== null && of.taken) rows.push(["Not the best", `${of.against_best} of ${of.taken}`]);
    for (const one of of.differences) rows.push(["", `at ${one.label}: said ${one.said}, best ${one.best.join(" or ")}${one.times > 1 ? ` (${one.times} times)` : ""}`]);
    for (const voice of of.voices) rows.push([voice.name, `${count(voice.said, "answer")}, ${voice.followed} followed`]);
    return [...rows, ...of.hints.map((hint, k) => [k ? "" : "Next time", hint])];
  }

  function showReceipt({ receipt }) {
    el("receipt").hidden = !receipt;
    const rows = receipt ? receiptRows(receipt) : [];
    el("receipt").querySelector("dl").replaceChildren(...rows.flatMap(([name, value]) => [make("dt", name), make("dd", value)]));
  }

  function showProgress({ progress }) {
    const box = el("progress");
    box.hidden = !progress;
    if (!progress) return;
    box.querySelector("h2").textContent = progress.phase;
    Object.assign(box.querySelector("progress"), { max: Math.max(progress.parts, 1), value: Math.min(progress.done, progress.parts) });
    box.querySelector("ol").replaceChildren(...[...progress.lines].reverse().map((line) => make("li", line)));
  }

  // Who answers or, without questions, who operates; live: whether the page is connected to the run
  function chair({ you = {}, lesson: { asks }, run, replay }, live) {
    if (live && replay) return "";
    if (!live) return "connection lost: trying again";
    if (!asks && !run) return "Nobody is asked here";
    if (you.seat) return `${asks ? "You answer here" : "You operate this run"}${you.pages > 1 ? `; ${count(you.pages - 1, "other page")} watching` : ""}`;
    if (you.free) return asks ? "No page answers yet" : "Nobody operates yet";
    return `You are watching: another page ${asks ? "answers" : "operates"}`;
  }

  return { show, chair, make, percent, count };
})();
