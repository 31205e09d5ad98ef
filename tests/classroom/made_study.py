"""A tiny study with people as its folder holds it: real lessons in a world of six cells, and questionnaires."""

import json
from collections.abc import Sequence
from contextlib import suppress
from hashlib import sha256
from pathlib import Path
from shutil import copytree
from typing import Any

from rich.console import Console

from lab.advice.answer_times import AnswerTimes
from lab.seat.lesson_seat import LessonSeat
from lab.seat.run_progress import RunProgress
from lab.seat.terminal.prompt import TeachingPrompt
from lab.teaching.lesson import teach
from lab.teaching.lesson_options import LessonOptions
from lab.teaching.lesson_plan import Interrupted
from lab.teaching.subjects import subject_of
from lab.teaching.teacher import Teacher
from lab.toolbox.registry import Toolbox
from lab.view.progress import EscapingConsole

MAP = "S.G\n...\n"
PROTOCOL = """
name = "who-asks"
[[questionnaires]]
name = "tlx"
use = "nasa-tlx"
[[questionnaires]]
name = "robot"
items = [{name = "useful", kind = "likert", text = "It helped.", points = 7, labels = ["no", "yes"]}]
[[questionnaires]]
name = "last"
items = [{name = "remarks", kind = "text", text = "Anything else?"}]
"""
TLX = ("mental", "physical", "temporal", "performance", "effort", "frustration")


def taught(folder: Path, lines: Sequence[str]) -> Path:
    """The folder of a lesson of two episodes with a person who types these lines; it is broken off when they end in "quit"."""
    (folder / "small.txt").write_text(MAP)
    options = LessonOptions(str(folder / "small.txt"), gate="always", advisors=("terminal",), episodes=2)
    said, times = iter(lines), AnswerTimes()
    prompt = TeachingPrompt(Console(quiet=True, width=80), lambda asked: next(said))
    seat = LessonSeat(RunProgress(EscapingConsole(quiet=True)), prompt, None, times=times)
    teacher = Teacher(Toolbox(str(folder / "box")), options.advising(seat.people()), 0, seat.hear)
    with suppress(Interrupted):
        teach(subject_of(options), options, teacher, folder / "lesson")
    times.close()
    return folder / "lesson"


def step(
    kind: str, name: str, at: int, arm: str | None = None, lesson: int | None = None, **more: Any
) -> dict[str, Any]:
    """A step of half a minute that begins at a minute of an hour."""
    began, ended = (f"2026-11-28T19:{at:02}:{second}.000Z" for second in ("00", "30"))
    one = {"kind": kind, "name": name, "arm": arm, "lesson": lesson, "began": began, "ended": ended, "timed_out": False}
    return one | {"answers": {}} | more


def made_class(folder: Path, pupils: Sequence[str], lessons: int, protocol: str = "") -> Path:
    """A class or a study with these pupils, "" for who has withdrawn, each with nothing yet."""
    options = LessonOptions("world-1", advisors=("web",)).to_json()
    roster: dict[str, Any] = {
        "format": "teaching-lab class 1",
        "code": "abcdef",
        "lessons": [options] * lessons,
        "seed": 0,
        "most": 30,
        "typed_names": False,
        "port": 0,
        "pupils": [
            {"number": number, "name": name, "key_hash": "", "lesson": 0} for number, name in enumerate(pupils, start=1)
        ],
    }
    folder.mkdir()
    if protocol:
        digest = sha256(protocol.encode()).hexdigest()
        roster["study"] = {"protocol_sha256": digest, "positions": [None if not name else 0 for name in pupils]}
        (folder / "protocol.toml").write_text(protocol)
    (folder / "class.json").write_text(json.dumps(roster))
    return folder


def made_study(folder: Path) -> Path:
    """Two participants in two arms, and one who has withdrawn; the second participant's time was up in arm a.

    Everybody's finished lesson has two answers in each of two episodes, and before them one that was taken back.
    """
    over = taught(folder, ["left", "undo", *["right"] * 4])
    (folder / "second").mkdir()
    cut = taught(folder / "second", ["right", "quit"])
    made = made_class(folder / "study", ["silver deer", "", "red owl"], 2, PROTOCOL)
    for number, name, order, last in ((1, "silver deer", "ab", "=1+1"), (3, "red owl", "ba", "fine")):
        place = made / f"{number:02}-{name.replace(' ', '-')}"
        steps, at = [], 0
        for arm in order:
            lesson = "ab".index(arm) + 1
            timed_out = (number, arm) == (3, "a")
            copytree(cut if timed_out else over, place / f"lesson-{lesson}")
            tlx = dict.fromkeys(TLX, 20) | {"mental": 80 if timed_out else 50}
            steps += [
                step("text", f"before {arm}", at, arm),
                step("lesson", "small", at + 1, arm, lesson, timed_out=timed_out),
                step("questionnaire", "tlx", at + 2, arm, answers=tlx),
                step("questionnaire", "robot", at + 3, arm, lesson, answers={"useful": lesson}),
            ]
            at += 4
        steps.append(step("questionnaire", "last", at, answers={"remarks": last}))
        person = {
            "format": "teaching-lab participant 1",
            "participant": name,
            "number": number,
            "order": [*order],
            "consented": "2026-11-28T18:59:00.000Z",
            "finished": None,
            "steps": steps,
        }
        (place / "participant.json").write_text(json.dumps(person))
    return made
