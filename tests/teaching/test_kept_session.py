"""Sessions in folders: begun, killed at any moment, gone on with, shown again; what a person said is never lost."""

import json
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from shutil import rmtree
from typing import Any

import pytest

from lab.advice.advising import Advising
from lab.advice.entries import FILE, Answer, SessionEntry, read_journal
from lab.advice.journal import Journal
from lab.advice.receipt import SILENT
from lab.errors import BadInput
from lab.learning.requests import AdviceRequest, Ask
from lab.learning.session_events import AdviceGiven
from lab.tasks.task_file import load_world
from lab.teaching.events import Event, LessonEvent, QuestionAnswered
from lab.teaching.kept_session import KeptSession, NewSession, check_new, claimed
from lab.teaching.lesson import replay, teach
from lab.teaching.lesson_options import LessonOptions
from lab.teaching.lesson_plan import MAX_SESSIONS, Interrupted, LessonPlan
from lab.teaching.lesson_sessions import fits
from lab.teaching.session_list import session_rows
from lab.teaching.teacher import Teacher
from lab.teaching.world_subject import WorldSubject
from lab.toolbox.names import SESSIONS
from lab.toolbox.registry import Toolbox

MAZE = """
S.....
.##.#.
.#..#.
...##.
.#...G
"""
KILLS = 12  # in each test run; 200 were done by hand (see the test below)


@pytest.fixture
def maze(tmp_path: Path) -> Path:
    path = tmp_path / "maze.txt"
    path.write_text(MAZE.strip())
    return path


def person(request: AdviceRequest) -> int:
    """Somebody who is often right, decided by state and episode alone."""
    towards = (1, 3)[(request.state + request.episode) % 2]
    return towards if (request.state * 7 + request.episode) % 5 else 2


def teacher(folder: Path, ask: Ask = person, *names: str) -> Teacher:
    return Teacher(Toolbox(folder / "toolbox"), Advising.of(names or ("terminal",), {"terminal": ask}), seed=3)


def options(maze: Path, *names: str, **changes: Any) -> LessonOptions:
    return replace(LessonOptions(str(maze), advisors=names or ("terminal",), seed=3, episodes=60), **changes)


def taught(
    wanted: LessonOptions, teacher: Teacher, out: Path | None, kept: KeptSession | None = None
) -> dict[str, Any]:
    return teach(WorldSubject.of(wanted), wanted, teacher, out, kept)


def result(folder: Path, document: dict[str, Any]) -> tuple[Any, ...]:
    """All that a session comes to, wherever it was held."""
    (row,) = Toolbox(folder / "toolbox").list()
    policy = Toolbox(folder / "toolbox").find("world", row["signature"])
    assert policy is not None
    kept = {k: v for k, v in document.items() if k not in ("session", "files")}
    return policy.q.tobytes(), policy.visits.tobytes(), policy.curve, policy.guided, kept


def held(folder: Path, maze: Path) -> tuple[Any, ...]:
    """The session without a break."""
    return result(folder, taught(options(maze), teacher(folder), folder / "lesson"))


def gone_on(folder: Path, maze: Path) -> tuple[Any, ...]:
    """The session gone on with until it is over, without pictures."""
    kept = KeptSession(folder / "lesson", "--resume")
    return result(folder, taught(kept.options, teacher(folder), None, kept))


def test_killed_at_any_moment_and_gone_on_with_it_is_the_same_session(tmp_path: Path, maze: Path, root: Path) -> None:
    """In a process of its own, which has one thread only and may be forked."""
    kills = os.environ.get("LAB_KILLS", str(KILLS))
    command = [sys.executable, str(root / "tests" / "teaching" / "killing.py"), str(maze), str(tmp_path), kills]
    ran = subprocess.run(
        command, env={**os.environ, "PYTHONPATH": str(root)}, capture_output=True, text=True, check=False
    )
    assert (ran.returncode, ran.stderr) == (0, "")
    counts = json.loads(ran.stdout)
    assert counts["same"] == int(kills)
    assert counts["broken off"] > int(kills) // 2


def test_ctrl_c_says_how_to_go_on(tmp_path: Path, maze: Path) -> None:
    whole = held(tmp_path / "whole", maze)
    asked = 0

    def stops(request: AdviceRequest) -> int:
        nonlocal asked
        asked += 1
        if asked == 7:
            raise KeyboardInterrupt
        return person(request)

    with pytest.raises(Interrupted, match=r"what was learned is kept; go on with: lab teach --resume .*lesson"):
        taught(options(maze), teacher(tmp_path, stops), tmp_path / "lesson")
    assert len(Toolbox(tmp_path / "toolbox").list()) == 1
    assert gone_on(tmp_path, maze) == whole


def test_what_a_session_went_on_from_is_kept_with_it(tmp_path: Path, maze: Path) -> None:
    """An unfinished policy is learned on; broken off and gone on with, it begins from the same table."""

    def half(folder: Path) -> None:
        taught(options(maze, "none", episodes=2, gate="never"), teacher(folder, person, "none"), None)

    again = {"gate": "never", "episodes": 30}
    half(tmp_path / "whole")
    document = taught(
        options(maze, "none", **again), teacher(tmp_path / "whole", person, "none"), tmp_path / "whole" / "lesson"
    )
    assert document["source"] == "continued"
    half(tmp_path / "cut")
    folder = tmp_path / "cut" / "lesson"
    taught(options(maze, "none", **again), teacher(tmp_path / "cut", person, "none"), folder)
    lines = (folder / FILE).read_bytes().splitlines(keepends=True)
    (folder / FILE).write_bytes(b"".join(lines[:9]))
    kept = KeptSession(folder, "--resume")
    document = taught(kept.options, teacher(tmp_path / "cut", person, "none"), folder, kept)
    assert result(tmp_path / "cut", document) == result(tmp_path / "whole", document)
    for policy in (folder / "begun").iterdir():
        policy.unlink()
    (folder / FILE).write_bytes(b"".join(lines[:9]))
    kept = KeptSession(folder, "--resume")
    with pytest.raises(BadInput, match="the policy that it went on from is not in 'begun' any more"):
        taught(kept.options, teacher(tmp_path / "cut", person, "none"), folder, kept)


def test_what_a_lesson_was_warm_started_from_is_kept_with_it(tmp_path: Path, maze: Path) -> None:
    """In a run: a way learned before a wall was moved; broken off and gone on with, it begins from the same table."""
    wanted, box = options(maze, "none", gate="never", sessions=MAX_SESSIONS), Toolbox(tmp_path / "toolbox")
    here = teacher(tmp_path, person, "none")
    before = taught(wanted, here, None)
    assert before["solved"]
    maze.write_text(MAZE.strip().replace("...##.", "..###."))  # on its way
    subject, folder = WorldSubject.of(wanted), tmp_path / "lesson"
    problem, how = subject.prepare(3), subject.settings
    plan = LessonPlan(problem, how.learner, how.gate, subject.name, sessions=MAX_SESSIONS)
    lesson = replace(here, keep=NewSession(folder, box, wanted).keep).find_or_teach(plan, box.index()[0])
    assert (lesson.source, lesson.policy.parent.partition("@")[0]) == ("adapted", before["saved_as"])
    assert lesson.parent is not None
    assert not fits(lesson.parent.q, problem, how.learner)
    box.remove(lesson.policy.name)
    lines = (folder / FILE).read_bytes().splitlines(keepends=True)
    (folder / FILE).write_bytes(b"".join(lines[:9]))
    kept = KeptSession(folder, "--resume")
    document = taught(kept.options, here, folder, kept)
    again = box.find("world", problem.mdp.signature)
    assert again is not None
    assert (document["source"], again.parent) == ("adapted", lesson.policy.parent)
    assert (again.q.tobytes(), again.curve) == (lesson.policy.q.tobytes(), lesson.policy.curve)


def test_a_session_without_a_folder_is_kept_in_the_toolbox(tmp_path: Path, maze: Path) -> None:
    for number in (1, 2):
        document = taught(options(maze, "novice", episodes=12), teacher(tmp_path, person, "novice"), None)
        assert document["session"] == str(tmp_path / "toolbox" / SESSIONS / f"maze-{number}")
        assert (Path(document["session"]) / "receipt.json").is_file()
    rows = session_rows(Toolbox(tmp_path / "toolbox"))
    assert {Path(row["session"]).name for row in rows} == {"maze-1", "maze-2"}
    assert {(row["problem"], row["advisor"]) for row in rows} == {("maze", "novice")}
    (tmp_path / "toolbox" / SESSIONS / "maze-1" / FILE).write_text("nonsense\n")
    assert sorted(row["state"] for row in session_rows(Toolbox(tmp_path / "toolbox")))[0] == "damaged"


def test_a_toolbox_without_room_for_sessions(tmp_path: Path) -> None:
    (tmp_path / SESSIONS).touch()
    with pytest.raises(BadInput, match=f"toolbox {tmp_path}: .*{SESSIONS}: File exists"):
        claimed(Toolbox(tmp_path), "maze", Path.mkdir)


def test_what_cannot_be_written_after_the_work_is_said_beside_it(tmp_path: Path, maze: Path) -> None:
    """A folder stands where the picture goes; then all is removed while the lesson is held: the policy is kept each time."""
    (tmp_path / "lesson" / "learning-curve.png").mkdir(parents=True)
    document = taught(options(maze, "novice", episodes=12), teacher(tmp_path, person, "novice"), tmp_path / "lesson")
    assert document["files"].keys() == {"value_map"}
    assert [why.partition("learning-curve.png")[0] for why in document["missing"]] == [f"picture '{tmp_path}/lesson/"]
    assert (tmp_path / "lesson" / "receipt.json").is_file()

    def remove(request: AdviceRequest) -> int:
        rmtree(tmp_path / "gone", ignore_errors=True)
        return person(request)

    document = taught(options(maze), teacher(tmp_path, remove), tmp_path / "gone")
    assert document["missing"] == [
        f"journal '{tmp_path}/gone/{FILE}' is gone: its folder was removed or renamed meanwhile"
    ]
    assert document["saved_as"] in [row["name"] for row in Toolbox(tmp_path / "toolbox").list()]


def test_a_folder_that_holds_a_session(tmp_path: Path, maze: Path) -> None:
    """What it holds goes on meaning the same: it is refused, whatever it is, and nothing in it changes."""
    held(tmp_path, maze)
    journal = tmp_path / "lesson" / FILE
    whole = journal.read_bytes()
    for content, reason in (
        (whole, r"holds a session that is over: look at it again \(lab replay .*lesson\), or choose another folder"),
        (
            b"".join(whole.splitlines(keepends=True)[:5]),
            r"that is not over: go on with it \(lab teach --resume .*lesson",
        ),
        (b"nonsense", "that is not over"),
    ):
        journal.write_bytes(content)
        before = {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()}
        with pytest.raises(BadInput, match=reason):
            check_new(tmp_path / "lesson")
        with pytest.raises(BadInput, match=reason):
            held(tmp_path, maze)
        assert {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()} == before


def test_sessions_kept_elsewhere_are_listed(tmp_path: Path, maze: Path) -> None:
    held(tmp_path, maze)
    taught(options(maze, "novice", episodes=12), teacher(tmp_path, person, "novice"), None)
    places = {tmp_path / "lesson", tmp_path / "toolbox" / SESSIONS / "maze-2"}
    assert {Path(row["session"]) for row in session_rows(Toolbox(tmp_path / "toolbox"))} == places
    (tmp_path / "lesson").rename(tmp_path / "gone")
    (row,) = session_rows(Toolbox(tmp_path / "toolbox"))
    assert row["session"] == str(tmp_path / "toolbox" / SESSIONS / "maze-2")


def test_another_world_in_the_file_is_noticed(tmp_path: Path, maze: Path) -> None:
    held(tmp_path, maze)
    journal = tmp_path / "lesson" / FILE
    journal.write_bytes(b"".join(journal.read_bytes().splitlines(keepends=True)[:-1]))
    maze.write_text(MAZE.strip().replace("...##.", "..###."))  # on its way
    with pytest.raises(BadInput, match=r"is about 'maze' .* its file or the lab has changed"):
        gone_on(tmp_path, maze)


def test_options_are_the_same_in_another_folder(tmp_path: Path, maze: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    said = LessonOptions("maze.txt", advisors=("recorded:lesson", "tau=0.2"), memory=True)
    assert LessonOptions.from_json(said.to_json(), "here") == replace(
        said, subtask=str(maze), advisors=(f"recorded:{tmp_path / 'lesson'}", "tau=0.2")
    )
    with pytest.raises(BadInput, match=r"here: its options are none of lab teach: .*seed"):
        LessonOptions.from_json(said.to_json() | {"seed": "x"}, "here")
    with pytest.raises(BadInput, match="nothing to learn"):
        LessonOptions().complete()
    assert LessonOptions("insert").complete().advisors == ("expert",)


def test_a_session_goes_on_as_it_was_begun(tmp_path: Path, maze: Path) -> None:
    held(tmp_path, maze)
    journal = tmp_path / "lesson" / FILE
    whole = journal.read_bytes()
    journal.write_bytes(b"".join(whole.splitlines(keepends=True)[:-1]))
    kept = KeptSession(tmp_path / "lesson", "--resume")
    assert kept.same(LessonOptions()) == kept.options == options(maze)
    with pytest.raises(BadInput, match="--seed: --resume takes its options"):
        kept.same(LessonOptions(seed=4))
    journal.write_bytes(whole)
    with pytest.raises(BadInput, match="is over: look at it again with lab replay"):
        KeptSession(tmp_path / "lesson", "--resume").same(LessonOptions())


def told(heard: list[Event]) -> list[Any]:
    """What the sessions told."""
    return [event.event for event in heard if isinstance(event, LessonEvent)]


def test_a_replay_shows_every_answer_and_changes_nothing(tmp_path: Path, maze: Path) -> None:
    held(tmp_path, maze)
    before = {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()}
    heard: list[Event] = []
    kept = KeptSession(tmp_path / "lesson", "DIR", read_only=True)
    document = replay(kept, WorldSubject.of(kept.options), heard.append)
    answered = [(event.request, event.action) for event in heard if isinstance(event, QuestionAnswered)]
    shown = [(request.episode, request.step, request.state, action) for request, action in answered]
    read = read_journal(tmp_path / "lesson", "DIR")
    given = [entry for entry in read.entries if isinstance(entry, AdviceGiven)]
    assert shown == [(one.episode, one.step, one.state, one.action) for one in given] != []
    assert [one for one in read.entries if not isinstance(one, Answer)][:-1] == told(heard)
    assert document["closed"]["episodes"] == 60
    assert document["receipt"]["helped_steps"] == sum(one.action is not None for one in given)
    assert {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()} == before


def test_a_replay_of_what_was_broken_off_ends_there(tmp_path: Path, maze: Path) -> None:
    held(tmp_path, maze)
    journal = tmp_path / "lesson" / FILE
    lines = journal.read_bytes().splitlines(keepends=True)
    journal.write_bytes(b"".join(lines[:60]) + lines[60][:9])
    heard: list[Event] = []
    kept = KeptSession(tmp_path / "lesson", "DIR", read_only=True)
    document = replay(kept, WorldSubject.of(kept.options), heard.append)
    assert (document["closed"], document["cut"].encode()) == (None, lines[60][:9])
    assert len(told(heard)) <= 59


def test_a_kept_evening_is_given_to_another_gate(tmp_path: Path, maze: Path) -> None:
    """What was said once is said again where it was said; elsewhere the learner hears nothing, and holds it against nobody."""
    signature = load_world(str(maze)).mdp().signature
    journal = Journal.begin(tmp_path / "lesson", SessionEntry({}, "maze", signature, "test"))
    journal.tell(AdviceGiven(1, 1, 0, 3, 0))  # from the start to the right
    journal.close()
    name = f"recorded:{tmp_path / 'lesson'}"
    document = taught(options(maze, name, gate="always"), teacher(tmp_path / "other", person, name), None)
    assert document["helped_steps"] >= 60  # at least once an episode
    assert document["receipt"]["refused"][SILENT] > 0
