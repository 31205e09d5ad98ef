// The operator's console beside the scene: the run's status, what holds it, and buttons and keys for commands.
"use strict";

const seatConsole = (() => {
  const STEPS_MM = [1, 5, 10, 20, 50, 100], TURNS = [5, 15, 45, 90], SURE_MS = 3000, DRAW_MS = 250;
  const HELD = {
    pause: ["❚❚ Paused", "Go on (space), or carry one move out (s)."],
    protective: ["■ Protective stop", "The robot has stopped by itself. Put it right, then go on (space)."],
    emergency: ["⬣ Emergency stop", "The arm holds until it is reset by hand: reset (r), then go on (space)."],
  };
  const BY = { operator: "by the operator", robot: "by the robot", onlooker: "by somebody who only watches" };
  const LIGHTS = { idle: "○", busy: "▶", done: "✔", failed: "✖" };
  const STATES = { waiting: "○", carried: "➜", "in machine": "▶", done: "✔", lost: "✖" };
  // Group, key, the key's name on the button, command, label, explanation
  const BUTTONS = [
    ["drive", " ", "space", "pause", "❚❚ Pause", "stop when the move under way has ended"],
    ["drive", "s", "s", "step", "▸| Step", "carry one move out, then pause"],
    ["drive", " ", "space", "go", "▶ Go on", "go on after a pause or a protective stop"],
    ["drive", "r", "r", "reset", "↺ Reset", "release the emergency stop; then go on"],
    ["pace", "1", "1", "speed 1", "1 x", "as fast as the clock on the wall"],
    ["pace", "4", "4", "speed 4", "4 x", "four times as fast as the clock on the wall"],
    ["pace", "m", "m", "speed max", "max", "as fast as it can"],
    ["make", "p", "p", "policy", "Make the plan", "find or learn the skills, time them, and find the best order"],
    ["make", "b", "b", "run", "Run", "carry the plan out from where it stands"],
    ["make", "q", "q", "quit", "Leave", "keep everything and leave"],
    ["hand", "o", "o", "open", "Open", "open the gripper"],
    ["hand", "c", "c", "close", "Close", "close the gripper"],
    ["hand", "h", "h", "home", "Home", "bring the arm home, over everything"],
    ["hand", "g", "g", "grasp", "Grasp nearest", "take up the part that is nearest to the gripper, wherever that is"],
  ];
  // Key, its name on the button, command before the chosen number, input with the number, label, explanation, place
  const JOGS = [
    ["ArrowUp", "↑", "jog +y", "run-mm", "+y", "move the tool along +y", "1 / 2"],
    ["ArrowLeft", "←", "jog -x", "run-mm", "-x", "move the tool along -x", "2 / 1"],
    ["ArrowRight", "→", "jog +x", "run-mm", "+x", "move the tool along +x", "2 / 3"],
    ["ArrowDown", "↓", "jog -y", "run-mm", "-y", "move the tool along -y", "2 / 2"],
    ["PageUp", "PgUp", "jog +z", "run-mm", "+z", "move the tool up", "1 / 4"],
    ["PageDown", "PgDn", "jog -z", "run-mm", "-z", "move the tool down", "2 / 4"],
    ["[", "[", "rotate -", "run-degrees", "↷ turn", "turn the gripper clockwise", "1 / 1"],
    ["]", "]", "rotate +", "run-degrees", "↶ turn", "turn the gripper the other way", "1 / 3"],
  ];
  const FIELDS = { k: "parts", d: "order", l: "learn", e: "execute", t: "lead" };
  const el = (id) => document.getElementById(id);
  const { make } = seatStatus;
  const buttons = [];
  let state = null, send = null, refused = null, now = 0, before = 0, said = null, chart = null, chartEnd = 0, later = 0, drawnAt = 0, armed = 0, names = "";

  const held = () => (state && state.held) || { kind: "" };
  const here = () => Boolean(state && state.run);
  const mine = () => Boolean(send && state.you && state.you.seat);
  const takes = (words) => here() && state.run.commands.includes(words.split(" ")[0]);

  // ---- commands

  function say(words) {
    if (!send) return;
    refused("");
    send({ command: words });
  }

  // Any page may request an emergency stop in any state; only the display waits for the answer
  function stop() {
    if (!here() || !send) return;
    send({ command: "stop" });
    el("run-stop").classList.add("pressed");
    setTimeout(() => el("run-stop").classList.remove("pressed"), 400);
  }

  function press(button) {
    const words = button.says();
    if (words !== "quit" || armed) {
      arm(false);
      say(words);
    } else arm(true);
  }

  // Leaving needs a second press
  function arm(on) {
    clearTimeout(armed);
    armed = on ? setTimeout(arm, SURE_MS, false) : 0;
    const { made, label } = buttons.find((one) => one.name === "quit");
    made.classList.toggle("armed", on);
    made.querySelector("span").textContent = on ? "Sure? Once more" : label;
  }

  // Whether the console handled a key; busy: a pending question takes the keys; drawn: a path is waiting to be sent
  function pressed(event, { busy, drawn }) {
    if (!here() || event.ctrlKey || event.altKey || event.metaKey) return false;
    if (event.key === "Escape" && !drawn) {
      event.preventDefault();
      if (!event.repeat) stop();
      return true;
    }
    if (busy || event.target.matches("input, select, textarea")) return false;
    if (event.target.matches("button, summary") && [" ", "Enter"].includes(event.key)) return false; // the button handles this key
    if (FIELDS[event.key] && takes(FIELDS[event.key])) {
      event.preventDefault();
      el(event.key === "k" ? "run-parts-text" : `run-${FIELDS[event.key]}`).focus();
      return true;
    }
    const key = event.key.length === 1 ? event.key.toLowerCase() : event.key;
    const found = buttons.filter((one) => one.key === key && !one.made.hidden);
    if (!found.length) return false;
    event.preventDefault();
    const able = found.find((one) => !one.made.disabled) || (mine() && found.length === 1 ? found[0] : null); // otherwise the run says why not
    if (!able && !mine()) refused(state.you.free ? "Nobody operates yet: press 'Operate here' first." : "Another page operates: here only the emergency stop works.");
    if (able && !event.repeat) press(able);
    return true;
  }

  // ---- display

  const SHOWN = [
    [["run", "held", "you", "question"], showDriving],
    [["run", "held"], showState],
    [["run", "plan", "measured"], chartSoon],
  ];

  function show(shown, parts, how) {
    [state, send] = [shown, how];
    el("run-console").hidden = el("run-state").hidden = el("run-lists").hidden = !here();
    el("page").classList.toggle("steered", here());
    if (!here()) return;
    el("page").classList.toggle("unasked", !state.lesson.asks);
    el("page").classList.toggle("carrying", state.run.phase === "carry out" && !state.question);
    if (parts.has("run")) tellTime();
    for (const [names, draw] of SHOWN) if (names.some((name) => parts.has(name))) draw();
  }

  function tellTime() {
    const { now_s } = state.run;
    now = now_s < before ? now_s : Math.max(now, now_s);
    before = now_s;
  }

  function showDriving() {
    const { kind, why, by, speed } = held(), box = el("run-held"), [title, next] = HELD[kind] || ["", ""];
    const stopped = kind === "emergency" || kind === "protective";
    box.hidden = !kind;
    box.className = kind;
    el("run-held-kind").textContent = kind ? `${title} ${BY[by] || `by the ${by}`}` : "";
    el("run-held-why").textContent = why || "";
    el("run-held-next").textContent = kind === "pause" && state.run.words ? "The move under way ends first." : next;
    const off = { pause: Boolean(kind), go: !kind || kind === "emergency", reset: kind !== "emergency", step: stopped };
    for (const button of buttons) {
      const words = button.says(), [word] = words.split(" ");
      button.made.hidden = !takes(words);
      button.made.disabled = !mine() || Boolean(off[word]) || (stopped && ["jog", "hand"].includes(button.where));
      if (word === "speed") button.made.setAttribute("aria-pressed", String(words === `speed ${speed === null ? "max" : speed}`));
    }
    for (const form of document.querySelectorAll("#run-fields form")) {
      form.hidden = !takes(form.dataset.word);
      form.querySelector("button").disabled = !mine();
    }
    const byHand = takes("jog +x");
    for (const id of ["run-make", "run-jog-box", "run-hand", "run-fields"]) el(id).hidden = !byHand;
    const room = el(byHand ? "run-state" : "run-console"); // the panel with more room
    if (el("run-lists").parentElement !== room) room.insertBefore(el("run-lists"), el(byHand ? "run-trouble" : "run-help"));
    el("run-stop").disabled = !send;
    el("run-keys").textContent = keysInWords();
  }

  function keysInWords() {
    const seen = buttons.filter((one) => !one.made.hidden).map((one) => `${one.shown} ${one.says()}`);
    const fields = Object.entries(FIELDS).filter(([, word]) => takes(word)).map(([key, word]) => `${key} ${word} …`);
    return ["Esc emergency stop, everywhere", ...seen, ...fields].join(" · ");
  }

  function showState() {
    const { run } = state;
    el("run-doing").textContent = doingInWords(run);
    el("run-progress").textContent = `${run.move ? `step ${run.move} of ${run.moves}` : "no step yet"}${run.next_station ? `, next station ${run.next_station}` : ""}; ${run.finished} of ${run.parts.length} finished`;
    list("run-machines", run.machines.map((one) => [one.light, `${LIGHTS[one.light]} ${one.light}`, `${one.station}${one.part ? `: ${one.part}` : ""}`, one]));
    list("run-parts", run.parts.map((one) => [one.state.replace(" ", "-"), `${STATES[one.state]} ${one.state}`, `${one.name}${one.station && ["waiting", "in machine"].includes(one.state) ? ` at ${one.station}` : ""}`]));
    showHappened();
    offer();
    tick();
  }

  function doingInWords({ words, busy, phase, phase_words }) {
    const { kind } = held();
    if (kind && kind !== "pause") return words ? `The arm holds still (it ${words}).` : "The arm holds still.";
    if (words) return `The robot ${words}.`;
    if (kind) return "The run waits.";
    if (busy) return `Under way: ${busy}.`;
    return phase && phase !== "carry out" ? `${phase_words}.` : "Nothing is under way.";
  }

  function list(id, rows) {
    el(id).replaceChildren(...rows.map(([kind, sign, text, machine]) => {
      const row = make("li");
      row.append(make("b", sign, `light ${kind}`), make("span", text));
      if (machine && machine.light === "busy" && machine.until_s !== null) {
        const until = make("span", "", "until");
        until.dataset.until = machine.until_s;
        row.append(until);
      }
      return row;
    }));
  }

  function showHappened() {
    const { run } = state, troubles = [...run.trouble].reverse();
    el("run-trouble").hidden = !troubles.length;
    el("run-trouble").querySelector("ol").replaceChildren(...troubles.map((one) => make("li", `${one.at_s.toFixed(1)} s: ${one.what}. What is done: ${one.answer}.`, "bad")));
    el("run-done").hidden = !run.done.length;
    el("run-done").querySelector("ol").replaceChildren(...[...run.done].reverse().map((one) => make("li", `${one.words}: ${toldOf(one)}`, one.refused || one.failed ? "bad" : "good")));
    const fresh = said === null ? [] : run.done.slice(Math.max(0, run.done.length - (run.said - said)));
    const bad = fresh.filter((one) => one.refused || one.failed).pop();
    if (bad) refused(`${bad.words}: ${toldOf(bad)}`);
    said = run.said;
  }

  const toldOf = (one) => (one.refused ? `refused: ${one.refused}` : one.failed || one.said || "done");

  // Suggestions while a command is typed: the names that may follow it
  function offer() {
    const text = JSON.stringify(state.run.names);
    if (text === names) return;
    names = text;
    for (const word of ["learn", "execute", "lead"]) {
      el(`run-${word}-names`).replaceChildren(...(state.run.names[word] || []).map((name) => Object.assign(make("option"), { value: name })));
    }
    const [kind] = state.run.names.parts || [];
    if (kind) el("run-parts-field").querySelector("input").placeholder = `${kind}=2`;
  }

  // ---- the chart and the clock

  function chartSoon() {
    clearTimeout(later);
    later = setTimeout(drawChart, Math.max(0, drawnAt + DRAW_MS - performance.now()));
  }

  // Current activities of machines and robot, cut off at the current time
  function underWay(end_s) {
    const { run, measured } = state, bars = [];
    for (const one of run.machines) {
      if (!one.part) continue;
      const part = run.parts.findIndex((other) => other.name === one.part) + 1, at = { resource: one.station, part, origin: one.station, target: one.station };
      bars.push({ ...at, kind: "process", start_s: one.since_s, end_s: one.worked_s === null ? end_s : one.worked_s });
      if (one.worked_s !== null) bars.push({ ...at, kind: "blocked", start_s: one.worked_s, end_s });
    }
    const last = measured.reduce((most, one) => (one.resource === "robot" ? Math.max(most, one.end_s) : most), 0);
    if (run.words) bars.push({ resource: "robot", kind: "moves", part: null, origin: "", target: "", start_s: last, end_s });
    return bars;
  }

  function drawChart() {
    const { plan, measured, run } = state, planned = plan ? plan.rows : [];
    drawnAt = performance.now();
    el("run-chart").hidden = !plan && !measured.length;
    if (el("run-chart").hidden) return;
    const last = [...planned, ...measured].reduce((most, one) => Math.max(most, one.end_s), 1);
    chartEnd = now > last ? now * 1.1 : last;
    const done = [...measured, ...underWay(chartEnd)], rows = labGantt.rowsOf([...planned, ...done]);
    const marks = run.trouble.map((one) => ({ at_s: one.at_s, kind: "trouble", words: `${one.what}; ${one.answer}` }));
    chart = labGantt.draw(el("run-gantt"), { rows, measured: done, planned, marks, end_s: chartEnd });
    el("run-chart").querySelector("[data-kind=pallet]").hidden = ![...planned, ...measured].some((one) => one.kind === "pallet");
    el("run-plan").textContent = plan ? planInWords(plan) : "There is no plan yet.";
    el("run-gantt").setAttribute("aria-label", `${el("run-plan").textContent} Measured until ${Math.round(now)} s.`);
    chart.grow(now);
  }

  function planInWords({ makespan_s, gap, proven, why, by }) {
    const worth = gap === null ? "" : proven && gap < 5e-4 ? ", proven: no order is faster" : `, ${(100 * gap).toFixed(1)} % above the ${proven ? "optimum" : "proven bound"}`;
    return `The plan${by ? ` by ${by}` : ""} ends at ${makespan_s.toFixed(1)} s${worth}${why ? ` (new: ${why})` : ""}.`;
  }

  function tick() {
    const { speed } = held();
    el("run-time").textContent = `${now.toFixed(1)} s, ${speed === null || speed === undefined ? "as fast as it can" : `${speed} x`}`;
    for (const one of document.querySelectorAll("#run-machines .until")) {
      const until = Number(one.dataset.until);
      one.textContent = `until ${until.toFixed(0)} s, ${Math.max(0, until - now).toFixed(0)} s more`;
    }
    if (chart && now > chartEnd) chartSoon();
    else if (chart) chart.grow(now);
  }

  // A frame sets the time
  function clock(time_s) {
    now = time_s;
    if (here()) tick();
  }

  // ---- events of the page

  function add({ where, key, shown, says, label, help, name }) {
    const made = make("button");
    Object.assign(made, { type: "button", title: `${help} (${shown})`, hidden: true });
    made.setAttribute("aria-keyshortcuts", key === " " ? "Space" : key);
    made.dataset.say = name;
    made.append(make("span", label), make("kbd", shown));
    buttons.push({ where, key, shown, says, label, name, made });
    made.onclick = (event) => {
      if (event.detail) made.blur(); // after a click, keys go to the console again
      press(buttons.find((one) => one.made === made));
    };
    el(`run-${where}`).append(made);
    return made;
  }

  function build() {
    for (const [where, key, shown, says, label, help] of BUTTONS) add({ where, key, shown, says: () => says, label, help, name: says });
    for (const [key, shown, name, choice, label, help, place] of JOGS) {
      const says = () => `${name}${name.startsWith("jog") ? " " : ""}${el(choice).value}`;
      add({ where: "jog", key, shown, says, label, help, name }).style.gridArea = place;
    }
    for (const [id, choices, chosen] of [["run-mm", STEPS_MM, 10], ["run-degrees", TURNS, 15]]) {
      el(id).replaceChildren(...choices.map((one) => Object.assign(make("option", String(one)), { value: one, selected: one === chosen })));
      el(id).onchange = () => el(id).blur();
    }
    for (const form of document.querySelectorAll("#run-fields form")) {
      form.onsubmit = (event) => {
        event.preventDefault();
        const field = form.querySelector("input");
        if (mine() && field.value.trim()) say(`${form.dataset.word} ${field.value.trim()}`);
        field.blur();
      };
    }
    el("run-stop").onclick = (event) => {
      if (event.detail) el("run-stop").blur();
      stop();
    };
    window.addEventListener("resize", () => here() && chartSoon());
  }

  build();
  return { show, pressed, clock, refusing: (how) => { refused = how; } };
})();
