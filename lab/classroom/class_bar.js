// What the class says on a pupil's page: lesson, hint, help, pause; whose turn it is; in a study the step, the time that is left, and to go on.
"use strict";

const classBar = (() => {
  const el = (id) => document.getElementById(id);
  const TICK_MS = 500;
  let study = null, until = 0, turnUntil = null, send = null;

  // The teacher's own key opens a pupil's desk, perhaps on a projector: it goes out of the address into this window's memory
  if (new URLSearchParams(location.search).has("pupil")) {
    sessionStorage.setItem("look", location.search);
    history.replaceState(null, "", location.pathname);
  }
  const search = location.search || sessionStorage.getItem("look") || "";

  function show({ name, lesson, lessons, paused, hint, helped, team, fellows, late, turn, study: now }) {
    el("class").hidden = false;
    el("class-name").textContent = name;
    el("class-lesson").textContent = lessons > 1 ? `lesson ${lesson} of ${lessons}` : "";
    el("class-team").hidden = !team;
    if (team) el("class-team").textContent = `${team}${fellows.length ? `, with ${fellows.join(", ")}` : ""}${late ? ": it has begun without you, so you watch until the next lesson" : ""}`;
    el("class-hint").hidden = !hint;
    el("class-hint").textContent = hint ? `Hint: ${hint}` : "";
    el("class-helped").hidden = !helped;
    el("class-paused").hidden = !paused;
    showTurn(turn || null);
    if (now) showStep(now);
  }

  // Of a run that is operated in turns: who operates, and when this pupil does
  function showTurn(turn) {
    el("class-turn").hidden = !turn;
    el("class").classList.toggle("turns", Boolean(turn));
    if (!turn) return;
    if (turn.over) {
      turnUntil = null;
      el("class-operates").textContent = turn.over;
      el("class-over").hidden = true;
      el("class-turn").classList.remove("yours");
      tickTurn();
      return;
    }
    el("class-turn").classList.toggle("yours", turn.yours);
    el("class-operates").textContent = turn.yours ? "Your turn: you operate." : `${turn.name} operates; ${turn.before ? `${turn.before} before you` : "you are next"}.`;
    el("class-over").hidden = !(turn.yours && turn.next);
    el("class-over").textContent = `Hand over to ${turn.next}`;
    turnUntil = turn.left_s === null ? null : performance.now() + 1000 * turn.left_s;
    tickTurn();
  }

  const clock = (left) => `${Math.floor(left / 60)}:${String(left % 60).padStart(2, "0")} left`;
  function tickTurn() {
    el("class-turn-left").textContent = turnUntil === null ? "" : clock(Math.max(0, Math.ceil((turnUntil - performance.now()) / 1000)));
  }

  function showStep(now) {
    if (!now.here) {
      location.replace(`/step/${search}`);
      return;
    }
    study = now;
    el("class").classList.add("study");
    until = now.left_s === null ? null : performance.now() + 1000 * now.left_s;
    el("class-lesson").textContent = `step ${now.step} of ${now.steps}`;
    el("class-step").hidden = false;
    el("class-go").hidden = !now.over;
    el("class-withdraw").href = `/step/${search}#withdraw`;
    tick();
  }

  function tick() {
    if (study === null) return;
    const left = until === null ? null : Math.max(0, Math.ceil((until - performance.now()) / 1000));
    el("class-left").textContent = study.timed_out ? "Your time is up." : study.stuck ? "This lesson has stopped: tell whoever leads the study, or go on." : study.over ? "The lesson is over." : left === null ? "" : clock(left);
  }

  async function goOn() {
    el("class-go").disabled = true;
    let error = "The study does not answer: wait a moment and try again.";
    try {
      const answer = await fetch(`/step/do${search}`, { method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify({ do: "go on", step: study.step }) });
      error = answer.ok ? "" : (await answer.json()).error;
    } catch { /* it is said below */ }
    if (!error) location.replace(`/step/${search}`);
    el("class-left").textContent = error;
    el("class-go").disabled = false;
  }

  el("class-go").onclick = goOn;
  el("class-over").onclick = () => send && send({ class: "hand over" });
  setInterval(() => { tick(); tickTurn(); }, TICK_MS);
  return { search, show, connected: (how) => { send = how; } };
})();
