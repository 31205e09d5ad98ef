// The teaching seat's panel: shows the server's document, and sends the advisor's answers by keys and buttons.
"use strict";

const seat = (() => {
  const ARROWS = ["↑", "↓", "←", "→", "▾", "▴"], ARROW_KEYS = ["ArrowUp", "ArrowDown", "ArrowLeft", "ArrowRight", "PageDown", "PageUp"];
  const PLACES = ["1 / 2", "3 / 2", "2 / 1", "2 / 3", "3 / 5", "1 / 5"]; // row and column of each direction's button
  const LETTERS = { "+": "+", "=": "+", "-": "-", y: "own", Enter: "own", s: "skip", u: "undo", w: "why", a: "auto", q: "quit" };
  const PACES = { " ": "pause", n: "step", "-": "slower", "+": "faster", "=": "faster" };
  const SURE_MS = 3000, REFUSAL_MS = 6000, SLOW_PAUSE_MS = 600, URGENT = new Set(["question", "you", "ended", "waits_for", "held"]);
  const el = (id) => document.getElementById(id);
  const state = { place: null, slice: null, work: null, run: null, plan: null, measured: [] }, dirty = new Set(), title = document.title;
  let finished = false, whyOpen = false, slow = false, lastDrawn = 0, later = 0, send = null, shown = null, sent = 0, until = null, armed = "", disarm = 0, fade = 0, moveButtons = new Map();

  function update(parts) {
    Object.assign(state, parts);
    if ("you" in parts) refused("");
    if ("question" in parts) until = parts.question && parts.question.left_s !== null ? performance.now() + 1000 * parts.question.left_s : null;
    renew(...Object.keys(parts));
  }

  // Parts are drawn at most once per picture; where pictures are slow, parts that nobody waits for are drawn rarely
  function renew(...parts) {
    if (!("lesson" in state)) return;
    for (const part of parts) dirty.add(part);
    clearTimeout(later);
    const pause = slow && !state.question && !parts.some((part) => URGENT.has(part)) ? lastDrawn + SLOW_PAUSE_MS - performance.now() : 0;
    if (pause > 0) later = setTimeout(requestAnimationFrame, pause, render);
    else requestAnimationFrame(render);
  }

  const RENDERERS = [
    [["you", "question", "lesson", "ended", "waits_for", "standing", "curve", "progress", "replay", "run"], showQuestion],
    [["question", "lesson"], showMoves],
    [["question", "you", "lesson"], enable],
    [["replay", "question", "ended"], showReplay],
    [["question"], () => seatMap.picture(shown)],
    [["place", "slice", "robot", "question"], () => seatMap.show(state, shown)],
  ];

  function render() {
    if (!dirty.size) return;
    const parts = new Set(dirty);
    lastDrawn = performance.now();
    dirty.clear();
    shown = state.question || null;
    for (const [names, draw] of RENDERERS) if (names.some((name) => parts.has(name))) draw();
    seatStatus.show(state, parts);
    seatConsole.show(state, parts, send);
  }

  const { make, percent } = seatStatus;
  const named = (move) => `${move.direction === null ? "" : `${ARROWS[move.direction]} `}${move.label}`;

  // ---- the question

  function showQuestion() {
    const { you = {}, lesson } = state;
    document.body.classList.toggle("waiting", Boolean(shown));
    document.body.classList.toggle("mine", Boolean(you.seat));
    document.title = `${shown && you.seat ? "● " : ""}${title}`;
    el("lesson").textContent = state.run && !shown && state.run.words ? state.run.phase_words : lesson.title || lesson.page;
    el("chair-text").textContent = finished ? "" : seatStatus.chair(state, Boolean(send));
    el("chair").classList.toggle("yours", Boolean(you.seat && send));
    const button = el("chair-button");
    button.hidden = Boolean(state.replay) || !(lesson.asks || state.run) || !(send && (you.seat ? you.pages > 1 : you.free));
    button.textContent = you.seat ? "Hand over" : lesson.asks ? "Answer here" : "Operate here";
    el("says").textContent = shown ? shown.title : state.ended || idle();
    el("where").textContent = shown ? shown.where || "" : "";
    el("detail").textContent = shown ? detail() : "";
    el("words").hidden = !shown || Boolean(state.replay);
    showHeard();
    el("because").hidden = !(shown && whyOpen);
    if (!shown && (state.ended || state.standing.verdict)) el("moves").hidden = true; // no more questions come
    el(state.ended ? "ask" : "learning").append(el("receipt")); // at the end the receipt matters most
    if (shown) showReasons();
    countDown();
  }

  function idle() {
    const { standing, curve, lesson, progress, waits_for: others = [] } = state;
    if (others.length) return `You have answered. It waits for ${others.join(", ")}.`;
    if (progress && !standing.requests) return `${progress.phase}: ${Math.min(progress.done, progress.parts)} of ${progress.parts}.`;
    if (!curve.count && !lesson.title) return `Nothing is being learned yet.${lesson.asks ? " The learner will ask here when it wants advice." : ""}`;
    const episode = `${lesson.kind === "order" ? "Order" : "Episode"} ${curve.count}${lesson.episodes ? ` of ${lesson.episodes}` : ""}`;
    const why = { rejected: "it takes no more advice", converged: "it asks no more", left: "it goes on alone" }[standing.verdict];
    return `${episode}: ${why || `it works alone, and asks ${lesson.asks ? "" : "its advisor "}when it stops improving`}.`;
  }

  const judges = (word) => word === "+" || word === "-";
  const asked = () => (shown.judges === "only" ? " How is that: good (+) or bad (-)?" : "");
  // A sentence: what was understood of it, which counts once the person agrees
  function showHeard() {
    el("say").hidden = !shown || Boolean(state.replay);
    const heard = (shown && shown.heard) || null, waits = Boolean(heard && heard.text);
    el("heard").hidden = !heard;
    el("heard").classList.toggle("refused", Boolean(heard && heard.refused));
    if (heard) el("heard-text").textContent = waits ? `Understood: ${heard.text}.` : heard.refused;
    el("heard-yes").hidden = el("heard-no").hidden = !waits;
  }

  const heardWaits = () => Boolean(shown && shown.heard && shown.heard.text);

  function speak(event) {
    event.preventDefault();
    const text = el("say-text").value.trim();
    if (!text && heardWaits()) return answer({ agree: true });
    if (!text || !canAnswer()) return answer({ say: text });
    el("say-text").value = "";
    answer({ say: text });
  }

  const detail = () => `${shown.would}${asked()}${shown.why ? ` It asks because ${shown.why}.` : ""}${shown.offered && !state.replay ? " The terminal asks, too." : ""}`;

  function countDown() {
    const left = until === null || !shown ? null : Math.max(0, Math.ceil((until - performance.now()) / 1000));
    el("countdown").hidden = left === null;
    if (left !== null) el("countdown").textContent = `It waits ${left} s more, then it goes on alone.`;
  }

  // A replay: its last answer and its pace
  function showReplay() {
    const { replay } = state;
    el("replay").hidden = !replay || Boolean(state.ended);
    el("answered").textContent = replay && shown ? replay.said || "" : "";
    if (!replay) return;
    el("replay").querySelector("[data-replay=pause] span").textContent = replay.paused ? "Go on" : "Pause";
    el("replay-speed").textContent = `${replay.speed} x${replay.paused ? ", paused" : ""}`;
    for (const [action, button] of moveButtons) button.classList.toggle("said", Boolean(shown) && action === replay.action);
  }

  function showReasons() {
    const { lesson } = state, because = el("because");
    const facts = shown.rate === null ? ["There are too few episodes for moving averages so far."] : [
      `Lately ${seatDraw.nice(shown.current)} ${lesson.unit} an episode, before that ${seatDraw.nice(shown.previous)}: an improvement of ${(100 * shown.rate).toFixed(1)} %.`,
      ...(lesson.threshold === null ? [] : [`It asks below ${percent(lesson.threshold)}.`]),
    ];
    if (shown.kind === "step") facts.push(`It chooses by ${shown.selection}${shown.selection === "softmax" ? `, temperature ${seatDraw.nice(shown.temperature)}` : ""}.`);
    because.replaceChildren(make("p", facts.join(" ")));
    if (shown.kind !== "step") return;
    const table = make("table"), head = make("tr");
    head.append(...["move", "its value", "its chance", "leads"].map((text) => make("th", text)));
    table.append(head, ...shown.moves.map((move) => {
      const row = make("tr");
      row.append(...[named(move), String(move.value), percent(move.chance), move.leads || "on"].map((text) => make("td", text)));
      return row;
    }));
    because.append(table);
  }

  function showMoves() {
    const moves = shown ? shown.moves : [];
    const kind = !shown ? "" : shown.kind === "order" ? "order" : moves.filter((move) => move.direction !== null && move.direction < 4).length < 4 ? "list" : moves.some((move) => move.direction > 3) ? "pad deep" : "pad";
    const box = el("moves"), names = moves.map((move) => `${move.action} ${move.label}`).join();
    if (!shown) return; // the buttons stay, disabled, because the next question probably needs the same ones
    box.hidden = false;
    if (box.dataset.names !== names || box.className !== kind) {
      box.className = kind;
      box.dataset.names = names;
      moveButtons = new Map(moves.map((move, k) => [move.action, moveButton(move, k, kind)]));
      box.replaceChildren(...moveButtons.values());
    }
    for (const move of moves) fillMove(moveButtons.get(move.action), move);
  }

  function moveButton(move, k, kind) {
    const button = make("button");
    button.type = "button";
    button.onclick = (event) => choose(move.action, event);
    if (kind.startsWith("pad") && move.direction !== null) button.style.gridArea = PLACES[move.direction];
    else if (kind.startsWith("pad")) button.style.gridRow = "4";
    const key = move.direction !== null ? ARROW_KEYS[move.direction] : k < 9 ? String(k + 1) : "";
    if (key) button.setAttribute("aria-keyshortcuts", key);
    if (move.direction === null && key) button.append(make("kbd", key));
    button.append(make("span", "", "name"), make("span", "", kind === "order" ? "way" : "chance"), make("span", "", kind === "order" ? "chance" : "sure"));
    return button;
  }

  function fillMove(button, move) {
    const own = move.action === shown.own, text = (kind, words) => { button.querySelector(`.${kind}`).textContent = words; };
    button.classList.toggle("own", own);
    button.classList.remove("said");
    text("name", named(move));
    if (shown.kind === "order") {
      text("way", `${move.from} → ${move.to}`);
      text("chance", `${move.ready_s ? `ready in ${move.ready_s} s` : "ready now"}${own ? " · ★ its choice" : ""}`);
      return;
    }
    text("chance", `${move.size ? `${move.size} · ` : ""}${own ? "★ " : ""}${percent(move.chance)}`);
    button.querySelector(".sure").style.width = move.chance < 0.01 ? "0" : `${100 * move.chance}%`;
    button.setAttribute("aria-label", `${move.label}${move.size ? ` ${move.size}` : ""}: chance ${percent(move.chance)}${own ? ", its own choice" : ""}${move.leads ? `, leads ${move.leads}` : ""}`);
  }

  // ---- answers

  const canAnswer = () => Boolean(send && !state.replay && state.you && state.you.seat && shown && sent !== shown.number);

  function enable() {
    const can = canAnswer();
    for (const button of moveButtons.values()) button.disabled = !can || Boolean(shown && shown.judges === "only");
    for (const part of el("say").querySelectorAll("input, button")) part.disabled = !can;
    for (const button of el("words").querySelectorAll("button")) {
      const word = button.dataset.word;
      button.disabled = word === "why" ? !shown : !can || (word === "undo" && !shown.words.includes("undo"));
      button.hidden = Boolean(shown) && ((word === "undo" && shown.kind === "order") || (judges(word) && !shown.words.includes(word)) || (word === "own" && shown.judges === "only"));
    }
  }

  function answer(what, event) {
    if (event && event.detail) event.currentTarget.blur(); // after a click, Enter means "agree" again
    if (!canAnswer()) {
      if (shown && state.you && !state.you.seat) refused(state.you.free ? "No page answers yet: press 'Answer here' first." : "This page only watches.");
      return;
    }
    refused("");
    sent = shown.number;
    send({ answer: { question: shown.number, ...what } });
    enable();
  }

  function choose(action, event) {
    if (canAnswer() && moveButtons.has(action)) moveButtons.get(action).classList.add("said");
    answer({ action }, event);
  }

  // The moves of the whole path that is drawn on the map
  function sendWay() {
    const path = seatMap.drawn().map((direction) => shown.moves.find((one) => one.direction === direction)).filter(Boolean).map((move) => move.action);
    seatMap.drop();
    if (path.length === 1) choose(path[0]);
    else if (path.length) answer({ path });
  }

  function go(direction) {
    const move = shown && shown.moves.find((one) => one.direction === direction);
    if (move) choose(move.action);
  }

  function say(word, event) {
    if (!shown) return;
    if (word === "why") {
      whyOpen = !whyOpen;
      el("because").hidden = !whyOpen;
      el("words").querySelector("[data-word=why]").setAttribute("aria-expanded", String(whyOpen));
      if (whyOpen) el("because").scrollIntoView({ block: "nearest" });
    } else if (word === "own") shown.judges === "only" ? answer({ word: "skip" }, event) : choose(shown.own, event);
    else if (word === "auto" || word === "quit") {
      if (canAnswer() && armed !== word) arm(word);
      else {
        arm("");
        answer({ word }, event);
      }
    } else if (shown.words.includes(word)) answer({ word }, event);
    else refused(judges(word) ? "Nothing was done yet that could be good or bad." : "Nothing of this episode can be taken back.");
  }

  // An action that cannot be undone needs a second press
  function arm(word) {
    clearTimeout(disarm);
    armed = word;
    for (const button of el("words").querySelectorAll("button")) {
      const label = button.querySelector("span"), on = word !== "" && button.dataset.word === word;
      button.dataset.label = button.dataset.label || label.textContent;
      label.textContent = on ? "Sure? Once more" : button.dataset.label;
      button.classList.toggle("armed", on);
    }
    if (word) disarm = setTimeout(arm, SURE_MS, "");
  }

  function refused(text) {
    el("refusal").textContent = text;
    clearTimeout(fade);
    if (!text) return;
    sent = 0;
    fade = setTimeout(refused, REFUSAL_MS, "");
    if (shown) enable();
  }

  // Shift and an arrow key extend the path, Enter sends it
  function draws(event) {
    const direction = ARROW_KEYS.indexOf(event.key);
    if (event.shiftKey && direction >= 0 && direction < 4) return seatMap.step(direction) || true;
    if (event.key !== "Enter" || !seatMap.drawn().length) return false;
    sendWay();
    return true;
  }

  const paced = (word) => send && send({ replay: word });

  function pressed(event) {
    if (seatConsole.pressed(event, { busy: Boolean(shown), drawn: Boolean(shown) && seatMap.drawn().length > 0 })) return;
    if (event.key === "Escape" && heardWaits() && canAnswer()) return answer({ agree: false });
    if (event.key === "Escape" && !seatMap.drop()) event.target.blur();
    const pace = state.replay && !state.ended && !event.ctrlKey && !event.target.matches("input, button") ? PACES[event.key] : undefined;
    if (pace) {
      event.preventDefault();
      return paced(pace);
    }
    if (event.ctrlKey || event.altKey || event.metaKey || !shown || state.replay || event.target.matches("input, select, textarea")) return;
    if (event.key === "Enter" && event.target.matches("button")) return; // the button handles this key
    if (event.key === "Enter" && heardWaits()) return answer({ agree: true });
    if (draws(event)) return event.preventDefault();
    const direction = ARROW_KEYS.indexOf(event.key), digit = Number.parseInt(event.key, 10) - 1;
    const word = LETTERS[event.key] || LETTERS[event.key.toLowerCase()];
    const numbered = shown.moves[digit] && shown.moves[digit].direction === null ? shown.moves[digit] : undefined;
    const move = direction >= 0 ? shown.moves.find((one) => one.direction === direction) : numbered;
    if (direction < 0 && !word && !move) return;
    event.preventDefault();
    if (event.repeat) return;
    if (move) choose(move.action);
    else if (word) say(word);
    else refused("There is no such move here.");
  }

  // ---- events of the page

  function redraw() {
    renew("slice", "curve", "standing", "work");
  }

  function online(how) {
    send = how;
    renew("you");
  }

  seatConsole.refusing(refused);
  document.addEventListener("keydown", pressed);
  document.getElementById("page").classList.add("bare");
  el("words").addEventListener("click", (event) => {
    const button = event.target.closest("button");
    if (button) say(button.dataset.word);
    if (button && event.detail) button.blur();
  });
  el("chair-button").onclick = () => send && send({ seat: state.you.seat ? "give" : "take" });
  el("replay").addEventListener("click", (event) => {
    const button = event.target.closest("button");
    if (button) paced(button.dataset.replay);
    if (button && event.detail) button.blur();
  });
  el("say").addEventListener("submit", speak);
  el("heard-yes").onclick = () => answer({ agree: true });
  el("heard-no").onclick = () => answer({ agree: false });
  el("way-send").onclick = sendWay;
  el("way-drop").onclick = () => seatMap.drop();
  window.addEventListener("resize", redraw);
  setInterval(countDown, 250);

  return {
    update,
    refused,
    connected(how) {
      sent = 0;
      online(how);
      seatMap.tell({ go, look: (layer) => how({ layer }), can: canAnswer });
    },
    clock: (time_s) => seatConsole.clock(time_s),
    lost: () => online(null),
    spare() {
      slow = true;
    },
    over() {
      finished = true;
      state.question = null;
      state.ended = state.ended || "The run has ended: this page shows its last picture.";
      renew("question");
      online(null);
    },
    hasScene() {
      el("page").classList.remove("bare");
      redraw();
    },
  };
})();
