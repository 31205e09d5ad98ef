// A step of a study that is no lesson: consent, a text, a questionnaire, the end; and to withdraw from every step.
"use strict";

const el = (id) => document.getElementById(id), LOOK_MS = 5000;
const AWAY = "The study does not answer: trying again.";
let shown = null, questionnaire = null, busy = false;

const asks = async (path, wish) => {
  const answer = await fetch(`${path}${location.search}`, wish && { method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify(wish) });
  return { status: answer.status, said: await answer.json() };
};
const same = (one, other) => one && one.kind === other.kind && one.step === other.step;
const last = (kind, text) => ({ kind, text, title: shown ? shown.title : "" });

const LABELS = { consent: "I agree and take part", questionnaire: "Send and go on", text: "Go on", lesson: "Back to the lesson" };
const ENDED = {
  declined: "You do not take part. Nothing about you was kept.",
  withdrawn: "You have withdrawn. Everything that was kept about you has been deleted.",
  nobody: "Nobody takes part with this address. If the study was interrupted before you had agreed, join again with its code.",
};

function show(state) {
  const leaves = location.hash === "#withdraw" && state.participant;
  if (state.kind === "lesson" && !leaves) {
    location.replace(`/desk/${location.search}`);
    return;
  }
  shown = state;
  el("told").textContent = "";
  el("title").textContent = state.title || "";
  el("where").textContent = state.participant ? `${state.participant}${state.kind === "thanks" ? "" : `, step ${state.step} of ${state.steps}`}` : "";
  el("progress").hidden = !state.participant;
  if (state.participant) Object.assign(el("progress"), { max: state.steps, value: state.kind === "thanks" ? state.steps : state.step - 1 });
  el("heading").hidden = !state.heading;
  el("heading").textContent = state.heading || "";
  const text = state.text || ENDED[state.kind] || (state.kind === "thanks" ? "Thank you for taking part." : "");
  el("text").replaceChildren(...stepItems.paragraphs(text));
  el("consent").hidden = !state.consent;
  el("consent").replaceChildren(...stepItems.paragraphs(state.consent));
  questionnaire = stepItems.show(el("items"), state.items || []);
  el("go").hidden = !(state.kind in LABELS);
  el("go").textContent = LABELS[state.kind] || "";
  el("decline").hidden = state.kind !== "consent";
  sure(Boolean(leaves));
  window.scrollTo(0, 0);
}

function sure(wanted) {
  el("sure").hidden = !wanted;
  el("step").hidden = wanted;
  el("withdraw").hidden = wanted || !shown.participant;
  if (wanted) el("withdraw-no").focus();
}

async function say(wish) {
  if (busy) return;
  busy = true;
  el("told").textContent = "";
  try {
    const { status, said } = await asks("/step/do", wish);
    if (status === 200) {
      history.replaceState(null, "", location.pathname + location.search);
      show(ENDED[said.kind] ? last(said.kind) : said);
    } else {
      sure(false);
      el("told").textContent = said.error;
      busy = false;
      if (status !== 409 || wish.do !== "go on") return;
      const now = await asks("/step/state");
      if (now.status === 200 && !same(shown, now.said)) show(now.said); // another window has gone on
    }
  } catch {
    el("told").textContent = "The study does not answer: wait a moment and try again.";
  } finally {
    busy = false;
  }
}

// Another window, or whoever leads the study, may have gone on meanwhile
async function look() {
  if (busy || (shown && shown.kind in ENDED)) return;
  try {
    const { status, said } = await asks("/step/state");
    if (busy) return;
    if (el("told").textContent === AWAY) el("told").textContent = "";
    if (status === 403) show(last("nobody"));
    else if (!same(shown, said)) show(said);
  } catch {
    el("told").textContent = AWAY;
  }
}

el("step").onsubmit = (event) => {
  event.preventDefault();
  if (shown.kind === "consent") say({ do: "agree" });
  else if (shown.kind === "lesson") location.replace(`/desk/${location.search}`);
  else if (shown.kind === "questionnaire") {
    const open = questionnaire.open();
    if (open) {
      el("told").textContent = "Something is not answered yet.";
      open.scrollIntoView({ block: "center" });
    } else say({ do: "go on", step: shown.step, answers: questionnaire.answers() });
  } else say({ do: "go on", step: shown.step });
};
el("decline").onclick = () => say({ do: "decline" });
el("withdraw").onclick = () => sure(true);
el("withdraw-yes").onclick = () => say({ do: "withdraw" });
el("withdraw-no").onclick = () => {
  history.replaceState(null, "", location.pathname + location.search);
  if (shown.kind === "lesson") location.replace(`/desk/${location.search}`);
  else sure(false);
};
look();
setInterval(look, LOOK_MS);
