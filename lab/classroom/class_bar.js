// What the class says on a pupil's page: lesson, hint, help, pause.
"use strict";

const classBar = (() => {
  const el = (id) => document.getElementById(id);

  // The teacher's own key opens a pupil's desk, perhaps on a projector: it goes out of the address into this window's memory
  if (new URLSearchParams(location.search).has("pupil")) {
    sessionStorage.setItem("look", location.search);
    history.replaceState(null, "", location.pathname);
  }
  const search = location.search || sessionStorage.getItem("look") || "";

  function show({ name, lesson, lessons, paused, hint, helped }) {
    el("class").hidden = false;
    el("class-name").textContent = name;
    el("class-lesson").textContent = lessons > 1 ? `lesson ${lesson} of ${lessons}` : "";
    el("class-hint").hidden = !hint;
    el("class-hint").textContent = hint ? `Hint: ${hint}` : "";
    el("class-helped").hidden = !helped;
    el("class-paused").hidden = !paused;
  }

  return { search, show };
})();
