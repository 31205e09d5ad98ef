// The items of a questionnaire: a fieldset each, and what was answered in it. All texts are shown as text.
"use strict";

const stepItems = (() => {
  function make(name, text, kind) {
    const made = document.createElement(name);
    if (text !== undefined) made.textContent = text;
    if (kind) made.className = kind;
    return made;
  }

  // Texts with blank lines between their paragraphs
  const paragraphs = (text) => (text || "").split(/\n\s*\n/).filter((part) => part.trim()).map((part) => make("p", part.trim()));

  function radio(item, value, label, shown) {
    const box = make("label"), input = make("input");
    input.type = "radio";
    input.name = item.name;
    input.value = value;
    if (label && !shown) input.setAttribute("aria-label", `${value}: ${label}`);
    box.append(input, make("span", shown ? label : String(value)));
    return box;
  }

  const KINDS = {
    likert(item, box) {
      const row = make("div", undefined, "points"), all = item.labels.length > 2;
      for (let point = 1; point <= item.points; point += 1) {
        const label = all ? item.labels[point - 1] : point === 1 ? item.labels[0] : point === item.points ? item.labels[1] : "";
        row.append(radio(item, point, label, all));
      }
      row.classList.toggle("worded", all);
      box.append(row);
      if (item.labels.length === 2 && !all) box.append(ends(item.labels));
      return () => (box.querySelector("input:checked") ? Number(box.querySelector("input:checked").value) : null);
    },
    scale(item, box) {
      const input = make("input"), said = make("output", "not answered yet");
      let set = false;
      Object.assign(input, { type: "range", min: item.lowest, max: item.highest, step: item.step });
      input.value = item.lowest + item.step * Math.floor((item.highest - item.lowest) / item.step / 2);
      input.className = "unset";
      input.setAttribute("aria-label", item.text);
      input.setAttribute("aria-valuetext", "not answered yet");
      const touched = () => {
        set = true;
        input.className = "";
        said.textContent = input.value;
        input.setAttribute("aria-valuetext", input.value);
      };
      input.onpointerup = input.oninput = input.onchange = touched;
      input.onkeydown = (event) => { if (event.key === " " || event.key === "Enter") { event.preventDefault(); touched(); } };
      box.append(input, ends(item.labels.length ? item.labels : [String(item.lowest), String(item.highest)], said));
      return () => (set ? Number(input.value) : null);
    },
    choice(item, box) {
      const row = make("div", undefined, "options");
      row.append(...item.options.map((option) => radio(item, option, option, true)));
      box.append(row);
      return () => box.querySelector("input:checked")?.value ?? null;
    },
    text(item, box) {
      const field = make("textarea");
      field.maxLength = item.most;
      field.rows = item.most > 100 ? 4 : 1;
      field.setAttribute("aria-label", item.text);
      box.append(field, make("small", `at most ${item.most} characters`));
      return () => field.value.trim() || null;
    },
  };

  function ends(labels, between) {
    const row = make("div", undefined, "ends");
    row.append(make("span", labels[0]), between || make("span"), make("span", labels[1]));
    return row;
  }

  // A field for each item in a container; the function that returns the answers, of which none stands for what is open
  function show(container, items) {
    const fields = items.map((item) => {
      const box = make("fieldset"), legend = make("legend", item.text);
      if (!item.required) legend.append(make("small", " (may be left out)"));
      box.append(legend);
      return { item, box, read: KINDS[item.kind](item, box) };
    });
    container.replaceChildren(...fields.map(({ box }) => box));
    const answers = () => Object.fromEntries(fields.map(({ item, read }) => [item.name, read()]).filter(([, value]) => value !== null));
    // Mark what must be answered and is not; the first of it
    const open = () => {
      const missing = fields.filter(({ item, read }) => item.required && read() === null);
      for (const { box } of fields) box.classList.toggle("open", missing.some((field) => field.box === box));
      return missing.length ? missing[0].box : null;
    };
    return { answers, open };
  }

  return { make, paragraphs, show };
})();
