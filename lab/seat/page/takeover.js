// The page of lab clone --teacher page: tells what is asked, and sends a person's command; page.js calls it as a teaching seat.
"use strict";

const seat = (() => {
  const el = (id) => document.getElementById(id);
  let send = null, open = false;

  function enable() {
    for (const part of el("takeover-form").querySelectorAll("button, input")) part.disabled = !send || !open;
  }

  function online(how) {
    send = how;
    enable();
  }

  function tell(command) {
    if (!send || !open) return;
    el("takeover-refusal").textContent = "";
    send({ command });
  }

  for (const button of el("takeover-form").querySelectorAll("[data-move]")) {
    button.onclick = () => tell(`${button.dataset.move} ${el("takeover-size").value || 3}`);
  }
  for (const button of el("takeover-form").querySelectorAll("[data-word]")) button.onclick = () => tell(button.dataset.word);
  el("takeover-form").onsubmit = (event) => {
    event.preventDefault();
    tell(el("takeover-words").value);
  };

  return {
    update({ question, asked }) {
      const asks = Boolean(question);
      if (asks && !open) el("takeover-words").value = "";
      open = asks;
      el("takeover-title").textContent = asks ? question.demonstration || `The clone asks (question ${asked})` : "Nothing is asked now";
      el("takeover-why").textContent = asks ? question.why : "";
      el("takeover-where").textContent = asks ? `${question.where} ${question.fingers} ${question.wanted}` : "";
      el("takeover-refusal").textContent = "";
      enable();
      if (asks) el("takeover-words").focus();
    },
    refused: (text) => { el("takeover-refusal").textContent = text; },
    connected: online,
    lost: () => online(null),
    over: () => online(null),
  };
})();
