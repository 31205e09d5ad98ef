// Joining a class: the code becomes the address of a desk.
"use strict";

const el = (id) => document.getElementById(id);
el("code").value = new URLSearchParams(location.search).get("code") || "";

el("join").onsubmit = async (event) => {
  event.preventDefault();
  el("told").textContent = "";
  try {
    const answer = await fetch("/join", { method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify({ code: el("code").value, name: el("name")?.value || "" }) });
    const said = await answer.json();
    if (said.page) location.assign(said.page);
    else el("told").textContent = said.error;
  } catch {
    el("told").textContent = "The class does not answer: is this computer in the teacher's network?";
  }
};
