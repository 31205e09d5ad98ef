// What the class says on a pupil's page: lesson, hint, help, pause.
"use strict";

const classBar = (() => {
  const el = (id) => document.getElementById(id);

  function show({ name, lesson, lessons, paused, hint, helped }) {
    el("class").hidden = false;
    el("class-name").textContent = name;
    el("class-lesson").textContent = lessons > 1 ? `lesson ${lesson} of ${lessons}` : "";
    el("class-hint").hidden = !hint;
    el("class-hint").textContent = hint ? `Hint: ${hint}` : "";
    el("class-helped").hidden = !helped;
    el("class-paused").hidden = !paused;
  }

  return { show };
})();
