"""The class lessons in the docs are held as their sheets say, by pupils that are programs; all languages have the same."""

import asyncio
import csv
import json
import os
import re
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import partial
from itertools import takewhile
from pathlib import Path
from typing import Any
from urllib.request import Request, urlopen

import numpy as np
import pytest
from websockets.asyncio.client import ClientConnection, connect

import lab
from lab.mdp import TabularMDP
from lab.tasks.task_file import load_world
from tests.classroom.conftest import WITHIN_S, until

pytestmark = pytest.mark.slow

Json = dict[str, Any]
ROOT = Path(__file__).resolve().parent.parent
LESSONS = ROOT / "docs" / "class-lessons"
ENGLISH = LESSONS / "en"
BLOCK = re.compile(r"^```(\w+)\n(.*?)^```", re.MULTILINE | re.DOTALL)
TIMES, RUN, MARKS = 0, 3, 6  # the sections of a teacher's sheet: its head, the run, the marks
MADE_LATER = "mine-2"  # by a command that follows a change of a file by hand


# ---- what is on a page


def blocks(page: Path) -> list[tuple[str, str]]:
    return BLOCK.findall(page.read_text(encoding="utf-8"))


def sections(page: Path) -> list[str]:
    """The text before the first second-level heading, and after each."""
    return re.split(r"^## .*$", BLOCK.sub("", page.read_text(encoding="utf-8")), flags=re.MULTILINE)


def tables(text: str) -> list[list[list[str]]]:
    """The cells of each table's rows, without its line of dashes."""
    found = re.findall(r"(?:^\|.*\|\n)+", text, re.MULTILINE)
    rows = [[[cell.strip() for cell in row[1:-1].split("|")] for row in table.splitlines()] for table in found]
    return [[row for row in table if not re.fullmatch("-+", "".join(row))] for table in rows]


def numbers(text: str) -> list[float]:
    return [float(number.replace(",", ".")) for number in re.findall(r"(?<!\w)-?\d+(?:[.,]\d+)?", text)]


TEACHERS = sorted(ENGLISH.glob("*-teacher.md"))
LANGUAGES = sorted(folder for folder in LESSONS.iterdir() if folder.is_dir() and folder != ENGLISH)


def command_of(page: Path) -> list[str]:
    """The words of the page's `lab class`; [] for a lesson without one."""
    told = [line.split() for kind, block in blocks(page) if kind == "bash" for line in block.splitlines()]
    return next((words for words in told if words[:2] == ["lab", "class"]), [])


# ---- every language has the same


def differences(folder: Path) -> list[str]:
    """What a language's folder has otherwise than the English one; a folder holds whole lessons, not always all of them."""
    told = []
    for page in sorted(folder.iterdir()):
        english = ENGLISH / page.name
        other = (
            page.name.replace("-teacher", "-pupil")
            if "-teacher" in page.name
            else page.name.replace("-pupil", "-teacher")
        )
        if not english.is_file():
            told.append(f"{page.name}: en has no such page")
            continue
        if not (folder / other).is_file():
            told.append(f"{page.name}: {other} is missing")
        if blocks(page) != blocks(english) and "-pupil" not in page.name:
            told.append(f"{page.name}: other commands, or another output")
        shape = [[[len(row) for row in table] for table in tables(section)] for section in sections(page)]
        if shape != [[[len(row) for row in table] for table in tables(section)] for section in sections(english)]:
            told.append(f"{page.name}: other headings or tables")
        elif any(
            numbers(" ".join(ours)) != numbers(" ".join(theirs))
            for part, whole in zip(sections(page), sections(english), strict=True)
            for table, original in zip(tables(part), tables(whole), strict=True)
            for ours, theirs in zip(table, original, strict=True)
        ):
            told.append(f"{page.name}: other numbers in a table")
    return told


@pytest.mark.parametrize("folder", LANGUAGES, ids=lambda folder: folder.name)
def test_a_language_has_the_same_lessons(folder: Path) -> None:
    assert differences(folder) == []


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("", "", None),
        ("--out lesson-1", "--out stunde-1", "other commands"),
        ("| 5 | The maze", "| 6 | Das Labyrinth", "other numbers"),
        ("## Marks", "Marks", "other headings"),
    ],
)
def test_what_a_language_may_not_change(tmp_path: Path, old: str, new: str, said: str | None) -> None:
    for name in ("1-policy-teacher.md", "1-policy-pupil.md"):
        text = (ENGLISH / name).read_text(encoding="utf-8")
        (tmp_path / name).write_text(text.replace(old, new) if old else text, encoding="utf-8")
    found = differences(tmp_path)
    assert found == [] if said is None else [line for line in found if said in line] == found != []


def test_half_a_lesson_and_a_page_that_english_does_not_have_are_told(tmp_path: Path) -> None:
    (tmp_path / "1-policy-pupil.md").write_text((ENGLISH / "1-policy-pupil.md").read_text(encoding="utf-8"))
    (tmp_path / "6-mine.md").write_text("# Mine\n")
    assert differences(tmp_path) == [
        "1-policy-pupil.md: 1-policy-teacher.md is missing",
        "6-mine.md: en has no such page",
    ]


# ---- the sheets add up


@pytest.mark.parametrize("page", TEACHERS, ids=lambda page: page.stem)
def test_the_minutes_and_points_of_a_lesson_add_up(page: Path) -> None:
    parts = sections(page)
    whole = int(tables(parts[TIMES])[0][0][1].split()[0])
    assert sum(int(row[0]) for row in tables(parts[RUN])[0][1:]) == whole
    assert 20 <= whole <= 45
    assert sum(int(row[0]) for row in tables(parts[MARKS])[0][1:]) == 10
    row = next(row for row in tables((ENGLISH / "index.md").read_text(encoding="utf-8"))[0] if page.name in row[4])
    assert int(row[2]) == whole


# ---- pupils that are programs


@dataclass
class Pupil:
    """A pupil of one kind, who knows the shortest path of each lesson's world.

    kind: "shortest"; "detour": a walk of two moves more; "astray": right and left in turns; "own": the learner's choice; "once":
    shortest, in the first episode with a question, and then no more; digits: the toasts, in the order in which they are moved.
    """

    kind: str
    page: str
    detour: str = ""
    asked: int = 0
    episodes: list[str] = field(default_factory=list)

    def says(self, asks: Json, world: TabularMDP | None) -> Json:
        """The answer to a question; world: None for a question about the order of work."""
        self.asked += 1
        if world is None:
            return {"action": int(self.kind[self.asked - 1])}
        found = re.match(r"Episode (\d+), step (\d+)", asks["title"])
        assert found is not None
        episode, step = found.group(1), int(found.group(2))
        if episode not in self.episodes:
            self.episodes.append(episode)
        if self.kind == "once" and len(self.episodes) > 1:
            return {"word": "auto"}
        labels = list(world.action_labels)
        match self.kind:
            case "own":
                return {"action": asks["own"]}
            case "astray":
                return {"action": labels.index("right" if step % 2 else "left")}
            case "detour":
                return {
                    "action": labels.index({"u": "up", "d": "down", "l": "left", "r": "right"}[self.detour[step - 1]])
                }
        away, state = moves_to_goal(world), int(np.ravel_multi_index(asks["at"][:2], world.shape))
        return {"action": int(np.argmin(away[world.successor[state]]))}


def moves_to_goal(world: TabularMDP) -> Any:
    """The fewest moves from each state to the goal."""
    away = np.where(world.goal, 0.0, np.inf)
    for _ in range(world.n_states):
        away = np.where(world.goal, 0.0, np.minimum(away, 1 + away[world.successor].min(axis=1)))
    return away


async def taught(address: str, pupil: Pupil, world: TabularMDP | None) -> None:
    """Teach a whole lesson at the address of the pupil's page."""
    async with connect(address, max_size=1 << 24, proxy=None) as page:
        seated, last = False, 0
        while True:
            parts = (await until(page, lambda news: "seat" in news))["seat"]
            seated = bool(parts.get("you", {}).get("seat", seated))
            asks = parts.get("question")
            if parts.get("ended"):
                return
            if asks and asks["number"] != last and seated:
                last = asks["number"]
                await page.send(json.dumps({"answer": {"question": last} | pupil.says(asks, world)}))


def has_rows(count: int, news: Json) -> bool:
    """Whether the table on the teacher's page has so many rows."""
    return len(news.get("rows", ())) == count


def is_at(lesson: int, news: Json) -> bool:
    """Whether a tile on the teacher's page is at this lesson."""
    return any(tile["lesson"] == lesson for tile in news.get("tiles", ()))


async def told(teacher: ClientConnection, message: Json) -> None:
    await teacher.send(json.dumps(message))


@contextmanager
def held(words: list[str]) -> Iterator[tuple[str, str, str]]:
    """The addresses for pupils and teacher, and the code, of a class that runs as it is typed; it has ended afterwards."""
    program = "import sys; from lab.cli import main; sys.argv[0] = 'lab'; main()"
    command = [sys.executable, "-c", program, *words[1:]]
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True) as running:
        try:
            assert running.stderr is not None
            lines = [running.stderr.readline().partition(": ")[2].strip() for _ in range(3)]
            yield lines[0], lines[1], lines[2]
            running.communicate(timeout=WITHIN_S)
        finally:
            running.kill()


KINDS = {
    "1-policy": (("shortest", "once", "own"), {}),
    "2-advice": (("shortest", "astray"), {1: ("astray", "shortest")}),
    "3-reward": (("shortest", "detour"), {}),
    "4-attention": (("shortest",), {}),
    "5-order": (("111222333", "1212123233"), {}),
}
DETOUR = "rrdrurrdrddd"


@pytest.mark.slow
@pytest.mark.parametrize("name", KINDS)
def test_a_class_is_held_as_its_sheet_says(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The class's command as it stands, a pupil of each kind, and the rows that the sheet has for them."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    page = ENGLISH / f"{name}-teacher.md"
    words = command_of(page)
    lessons = list(takewhile(lambda word: not word.startswith("--"), words[2:]))
    kinds, later = KINDS[name]
    with held(words) as (join, code, teacher):
        base = join.partition("/?")[0]
        addresses = []
        for _ in kinds:
            with urlopen(Request(f"{base}/join", data=json.dumps({"code": code}).encode()), timeout=WITHIN_S) as got:
                addresses.append(base.replace("http", "ws") + json.load(got)["page"].replace("/?", "/frames?"))

        async def hold() -> None:
            frames = teacher.replace("http", "ws").replace("/?", "/frames?")
            async with connect(frames, max_size=1 << 24, proxy=None) as desk:
                for number, lesson in enumerate(lessons):
                    world = None if lesson.startswith("order:") else load_world(lesson).mdp()
                    for address, kind in zip(addresses, later.get(number, kinds), strict=True):
                        await taught(address, Pupil(kind, address, DETOUR), world)
                    await until(desk, partial(has_rows, (number + 1) * len(kinds)))
                    if number + 1 < len(lessons):
                        await told(desk, {"do": "lesson", "pupil": None, "lesson": number + 2})
                        await until(desk, partial(is_at, number + 2))
                await told(desk, {"do": "end"})

        asyncio.run(hold())
    written = (tmp_path / words[words.index("--out") + 1] / "class.csv").read_text()
    kept = sorted(csv.DictReader(written.splitlines()), key=lambda row: (int(row["pupil"]), int(row["lesson"])))
    head, *rows = next(
        table for table in tables(sections(page)[4]) if "`answers`" in table[0] or "`solved`" in table[0]
    )
    assert [[row[column.strip("`")] for column in head[1:]] for row in kept] == [
        [cell.replace("–", "") for cell in row[1:]] for row in rows
    ]


@pytest.mark.slow
@pytest.mark.parametrize("page", TEACHERS, ids=lambda page: page.stem)
def test_the_other_commands_of_a_sheet_print_what_it_says(
    page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shim = tmp_path / "bin" / "lab"
    shim.parent.mkdir()
    program = "import sys; from lab.cli import main; sys.argv[0] = 'lab'; main()"
    shim.write_text(f'#!/bin/sh\nexec "{sys.executable}" -c "{program}" "$@"\n')
    shim.chmod(0o755)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    monkeypatch.setenv("PATH", f"{shim.parent}:{os.environ['PATH']}")
    output = ""
    for kind, block in blocks(page):
        if kind == "bash" and not block.startswith("lab class") and MADE_LATER not in block:
            ran = subprocess.run(["bash", "-c", block], capture_output=True, text=True, check=False)
            assert (ran.returncode, "Traceback" in ran.stderr) in ((0, False), (1, False)), ran.stderr
            output = ran.stdout + ran.stderr
        elif kind == "text":
            assert [line for line in block.splitlines() if line not in output] == []
    if page.name.startswith("2"):
        head, *rows = tables(sections(page)[4])[1]
        with (tmp_path / "good-and-bad" / "rows.csv").open() as file:
            solved = {tuple(row[:2]): float(row[3]) for row in csv.reader(file) if row[2] == "solved_percent"}
        for row in rows:
            advisor = row[0].partition(":")[0].strip("`")
            assert [solved[advisor, gate.strip("`")] for gate in head[1:]] == [float(cell) for cell in row[1:]]


# ---- further numbers of the sheets


@pytest.mark.parametrize("seed", range(3))
def test_a_path_that_is_a_little_too_long_is_believed_and_kept(seed: int) -> None:
    """Lessons 1 and 2: whoever leads by 16 moves, where 14 are the fewest, is believed to the end."""
    moves = ["udlr".index(move) for move in "rrrddrruurrddddd"]
    lesson = lab.teach(
        "class-maze", seed=seed, advisor=lambda asks: moves[asks.step - 1] if asks.step <= len(moves) else None
    )
    assert (lesson.session.final_steps, lesson.session.rejected_at_episode) == (16, None)


@pytest.mark.parametrize("change", [("step = 0.0", "step = -0.1"), ("discount = 1.0", "discount = 0.9")])
def test_either_cure_of_lesson_3_ends_the_circles(tmp_path: Path, change: tuple[str, str]) -> None:
    text = (ROOT / "tasks" / "class-no-hurry.toml").read_text()
    assert text.count(change[0]) == 1
    (tmp_path / "mine.toml").write_text(text)
    assert lab.teach(tmp_path / "mine.toml", advisor=None).session.final_steps is None
    (tmp_path / "mine.toml").write_text(text.replace(*change))
    assert lab.teach(tmp_path / "mine.toml", advisor=None).session.final_steps == 10


def test_alone_most_learners_of_lesson_3_go_round_in_circles_and_none_where_steps_cost() -> None:
    lost = [lab.teach("class-no-hurry", advisor=None, seed=seed).session.final_steps for seed in range(20)]
    assert (lost.count(None), lost.count(12)) == (19, 1)
    assert {lab.teach("class-hurry", advisor=None, seed=seed).session.final_steps for seed in range(20)} == {10}


def test_the_values_of_lesson_3() -> None:
    """Each row's value is the cost of a step plus the discount times the value of the next cell."""
    (table,) = [table for table in tables(sections(ENGLISH / "3-reward-teacher.md")[4]) if "`discount" in table[1][0]]
    for row in table[1:]:
        step, discount = (float(number) for number in re.findall(r"= (-?[\d.]+)", row[0]))
        values = [float(cell) for cell in row[1:]]
        assert values[0] == 1.5
        assert values[1:] == pytest.approx([step + discount * value for value in values[:-1]])


def test_the_model_of_lesson_4() -> None:
    """0.28 s for each key, 1.35 s for each straight part; the sentence is as long as the sheet says."""
    page = ENGLISH / "4-attention-teacher.md"
    (table,) = [table for table in tables(sections(page)[4]) if len(table[0]) == 5 and len(table) == 4]
    for mode, keys, parts, once, whole in table[1:]:
        typed = re.search(r"`(.*)`", mode)
        assert int(keys) == (16 if typed is None else len(typed.group(1)) + 2)
        seconds = 0.28 * int(keys) + 1.35 * int(parts)
        assert (round(seconds, 1), round(3 * seconds)) == (float(once), float(whole))


def test_the_orders_of_lesson_5_cost_what_the_sheet_says() -> None:
    (costs,) = [table for table in tables(sections(ENGLISH / "5-order-teacher.md")[4]) if len(table[0]) == 2]
    assert costs[1][1] == "659"
    for told_as, seconds in costs[2:]:
        method = re.search(r"--method (\S+)`", told_as)
        assert method is not None
        assert lab.sequence("toast-case-1", method=method.group(1)).document["cost"] == float(seconds)
