// The teacher's page: a tile for each pupil, what the teacher does for all, and the table of what was taught.
"use strict";

const el = (id) => document.getElementById(id), { make, twice } = classTile;
const boxes = new Map();
let study = null, turns = null; // its title, and what this page may do in it; of a run by hand its state and who operates
let socket = null, paused = false, wall = false, isOpen = true;

// Everybody sees the address on a projector: its key goes into this window's memory
if (location.search) {
  sessionStorage.setItem("class", location.search);
  history.replaceState(null, "", location.pathname);
}
const key = sessionStorage.getItem("class") || "";

const say = (message) => socket && socket.readyState === WebSocket.OPEN && socket.send(JSON.stringify(message));
const look = (tile) => window.open(`/desk/${key}&pupil=${tile.number}`, "_blank", "noopener");
const act = {
  look,
  help: (tile) => {
    say({ do: "help", pupil: tile.number, on: !tile.helped });
    if (!tile.helped) look(tile);
  },
  hint: (tile, text) => say({ do: "hint", pupil: tile.number, text }),
  next: (tile) => say({ do: "next", pupil: tile.number }),
  open: (tile) => say({ do: "open", pupil: tile.number }),
  remove: (tile) => say({ do: "remove", pupil: tile.number }),
  turn: (tile) => say({ do: "turn", pupil: tile.number }),
};

function showClass(now) {
  paused = now.paused;
  el("pause").textContent = paused ? "Go on" : "Pause all";
  el("pause").setAttribute("aria-pressed", String(paused));
  study = now.study;
  if (study) {
    el("title").textContent = document.title = study.title;
    el("pause").hidden = !study.may.includes("pause");
    el("to-lesson").hidden = el("all").hidden = true;
    if (el("end").textContent === "End the class") el("end").textContent = "End for now";
  }
  turns = now.turns;
  if (turns) showTurns();
  isOpen = now.open;
  el("door").textContent = isOpen ? "Close the door" : "Open the door";
  el("door").setAttribute("aria-pressed", String(!isOpen));
  el("tried").hidden = !now.tried;
}

// How pupils join, and the lessons: the same as long as the class runs
function showPlace({ picture, join, code, lessons }) {
  el("picture").src = picture;
  el("address").textContent = join.replace(/\?.*/, "");
  el("code").textContent = code;
  el("lesson").replaceChildren(...lessons.map((lesson, k) => {
    const made = make("option", `${k + 1}: ${lesson}`);
    made.value = k + 1;
    return made;
  }));
}

// A run that the pupils operate in turns is the only lesson
function showTurns() {
  el("begin").hidden = turns.state !== "idle" || !boxes.size;
  el("finish").hidden = turns.state !== "open";
  el("to-lesson").hidden = el("all").hidden = true;
  el("report").querySelector("h2").textContent = "What came of the run, and who gave how many commands";
}

function showTiles(tiles, gone) {
  removeTiles(gone);
  for (const tile of tiles) {
    if (!boxes.has(tile.number)) {
      boxes.set(tile.number, classTile.create(act));
      el("tiles").append(boxes.get(tile.number).box);
    }
    classTile.draw(boxes.get(tile.number), tile, study ? study.may : turns ? ["turn", "hint", "remove"] : ["help", "hint", "next", "remove"]);
  }
  if (turns) showTurns();
  count();
}

function removeTiles(numbers) {
  for (const number of numbers) {
    boxes.get(number)?.box.remove();
    boxes.delete(number);
  }
}

function count() {
  const here = document.querySelectorAll("#tiles small.here").length;
  el("how").textContent = boxes.size ? `${here} of ${boxes.size} ${study ? "participants" : "pupils"} are here` : "Nobody has joined yet.";
}

const HEADS = [
  ["lesson", "Lesson"], ["name", "Pupil"], ["solved", "Solved"], ["final_steps", "Steps at the end"], ["optimal_steps", "Fewest possible"],
  ["cost", "Best order"], ["optimal_cost", "Proven optimum"], ["episodes", "Episodes"],
  ["delivered", "Delivered"], ["parts", "Ordered"], ["commands", "Commands"],
  ["answers", "Answers"], ["own_choice_too", "Its own choice, too"], ["not_best", "Not the best"], ["misleads", "Did not help"], ["believed", "Believed to the end"], ["tau", "Skill (tau)"],
];
const shown = (value) => (value === null ? "" : value === true ? "yes" : value === false ? "no" : typeof value === "number" && !Number.isInteger(value) ? value.toFixed(2) : String(value));

function showRows(rows) {
  el("report").hidden = !rows.length;
  const line = (cells, kind) => {
    const made = make("tr");
    made.append(...cells.map((text) => make(kind, text)));
    return made;
  };
  const heads = HEADS.filter(([name]) => rows.some((row) => (row[name] ?? null) !== null));
  el("report").querySelector("thead").replaceChildren(line(heads.map(([, head]) => head), "th"));
  el("report").querySelector("tbody").replaceChildren(...rows.map((row, k) => {
    const made = line(heads.map(([name]) => shown(row[name] ?? null)), "td");
    if (row.solved && row.commands === undefined && (k === 0 || rows[k - 1].lesson !== row.lesson)) made.className = "first";
    return made;
  }));
}

function follow(pause = 300) {
  let first = true; // all tiles come in the first message
  socket = new WebSocket(new URL(`frames${key}`, location.href.replace(/^http/, "ws")));
  socket.onopen = () => { pause = 300; };
  socket.onmessage = (event) => {
    const { place, class: now, rows, tiles, teams, gone, refusal } = JSON.parse(event.data);
    el("told").textContent = refusal || "";
    if (place) showPlace(place);
    if (now) showClass(now);
    if (rows) showRows(rows);
    if (teams) classTeams.show(teams);
    if (tiles) {
      if (first) removeTiles([...boxes.keys()].filter((number) => !tiles.some((tile) => tile.number === number)));
      first = false;
      showTiles(tiles, gone);
    }
  };
  socket.onclose = () => {
    el("how").textContent = "connection lost: trying again";
    setTimeout(follow, pause, Math.min(2 * pause, 3000));
  };
}

el("begin").onclick = () => say({ do: "begin" });
twice(el("finish"), "Once more: finish it", () => say({ do: "finish" }));
el("pause").onclick = () => say({ do: "pause", on: !paused });
el("all").onclick = () => say({ do: "lesson", pupil: null, lesson: Number(el("lesson").value) });
el("board").onclick = () => {
  wall = !wall;
  document.body.classList.toggle("wall", wall);
  el("board").setAttribute("aria-pressed", String(wall));
};
twice(el("end"), "Once more: end it", () => say({ do: "end" }));
el("door").onclick = () => say({ do: "door", open: !isOpen });
for (const [id, file] of [["csv", "class.csv"], ["paper", "report.html"], ["handed", "hand-outs.html"]]) {
  el(id).onclick = () => { // a link shows its address to whoever sees the screen
    el(id).href = file + key;
    setTimeout(() => { el(id).href = "#"; });
  };
}
follow();
