"""The main job end to end: one toast cold and warm; what a changed scene, a damaged file or Ctrl-C does to a run."""

import csv
import json
import os
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from shutil import copytree, rmtree
from typing import Any

import numpy as np
import pytest

import lab.production.taught
from lab.audit.tracks import packed, read_tracks
from lab.errors import BadInput, WorkFailed
from lab.export.program import Program
from lab.mdp import shortest_steps
from lab.production.durations import Durations
from lab.production.outcome import Outcome
from lab.production.report import FILES, Report, write_files
from lab.production.run import remember
from lab.production.taught import Taught, teach_all
from lab.sequencing import SEQUENCERS, find_sequence
from lab.sequencing.cell.schedule import Schedule
from lab.sequencing.methods.exact import optimum
from lab.sim.frames import Recording
from lab.skills.prepared_scene import Prepared, prepare
from lab.tasks.sequencing import search_for
from lab.tasks.task import Task
from lab.tasks.task_file import load
from lab.teaching.events import Event, PhaseBegan, RecordSkipped
from lab.teaching.lesson_sessions import fits
from lab.teaching.teacher import Teacher
from lab.toolbox.policy import Policy
from lab.toolbox.registry import Toolbox
from lab.vision import read_picture

Lab = Callable[..., Any]

RUN_FIELDS = (
    *("task", "seed", "toasts", "parts", "success", "delivered", "dropped", "failure", "retries", "skills", "sequence"),
    *(
        "method",
        "order_learning",
        "replanned",
        "predicted_makespan_s",
        "measured_makespan_s",
        "optimal_makespan_s",
        "bound_s",
    ),
    *("optimality_gap", "optimum_proven", "proven_of"),
    *(
        "camera_deviation_m",
        "sim_s",
        "skipped_s",
        "timed_s",
        "faults",
        "outcome",
        "audit",
        "interrupted",
        "receipts",
        "cyclic",
        "wall_s",
        "files",
    ),
)
SKILL_FIELDS = {"name", "subtask", "source", "policy", "episodes", "requests", "helped_steps", "solved"} | {
    *("reason", "from_task", "parent", "saved_episodes", "saved_helped_steps", "fitness")
}


@dataclass(frozen=True)
class Ran:
    """A finished `lab run toast --toasts 1 --json` in a process of its own, and the folder that it ran in."""

    document: dict[str, Any]
    stdout: str
    stderr: str
    folder: Path


def run_toast(folder: Path, root: Path) -> Ran:
    code = "import sys; from lab.cli import main; sys.argv[0] = 'lab'; main()"
    ran = subprocess.run(
        [sys.executable, "-c", code, "run", "toast", "--toasts", "1", "--json"],
        cwd=folder,
        env={**os.environ, "LAB_TOOLBOX": str(folder / "toolbox"), "PYTHONPATH": str(root)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert ran.returncode == 0, ran.stderr
    return Ran(json.loads(ran.stdout), ran.stdout, ran.stderr, folder)


@pytest.fixture(scope="module")
def cold(tmp_path_factory: pytest.TempPathFactory, root: Path) -> Ran:
    return run_toast(tmp_path_factory.mktemp("run"), root)


@pytest.fixture(scope="module")
def warm(cold: Ran, root: Path) -> Ran:
    return run_toast(cold.folder, root)


@pytest.mark.slow
def test_a_robot_that_is_slower_than_believed_is_known_by_its_second_run(
    warm: Ran, lab: Lab, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Timed at full speed, carried out at 60 % of it, as set on an operator's pendant."""
    copytree(warm.folder / "toolbox", tmp_path / "toolbox")
    monkeypatch.setenv("LAB_TOOLBOX", str(tmp_path / "toolbox"))
    monkeypatch.chdir(tmp_path)
    slower = ("run", "toast", "--toasts", "1", "--override", "60", "--json")
    first, second = (lab(*slower).json for _ in range(2))
    wrong = [abs(one["predicted_makespan_s"] - one["measured_makespan_s"]) for one in (first, second)]
    assert first["measured_makespan_s"] > 1.05 * warm.document["measured_makespan_s"]
    assert wrong[1] < 0.1 * wrong[0]


# ---- the document -------------------------------------------------------------------------------------------------


def test_stdout_is_one_document_with_all_fields(cold: Ran) -> None:
    assert cold.stdout.count("\n") == 1
    assert tuple(cold.document) == RUN_FIELDS
    assert all(row.keys() >= SKILL_FIELDS for row in cold.document["skills"])


def test_the_toast_is_delivered_as_predicted(cold: Ran) -> None:
    document = cold.document
    assert (document["task"], document["seed"], document["toasts"]) == ("toast", 0, 1)
    assert (document["parts"], document["skipped_s"] > 50) == ({"slice": 1}, True)  # while the toaster toasts
    assert (document["success"], document["delivered"], document["dropped"]) == (True, 1, 0)
    assert (document["failure"], document["sequence"], document["method"]) == (None, [1, 1, 1], "srl-time")
    assert document["measured_makespan_s"] == pytest.approx(document["predicted_makespan_s"], rel=0.03)
    assert (document["optimality_gap"], document["optimum_proven"]) == (pytest.approx(0.0, abs=1e-9), True)
    assert document["camera_deviation_m"] < 0.008
    assert document["sim_s"] + document["skipped_s"] > document["measured_makespan_s"]
    assert document["wall_s"] > 0


def test_every_skill_was_learned_or_adapted_or_has_the_table_of_one_that_was(cold: Ran) -> None:
    learned = {row["policy"] for row in cold.document["skills"] if row["source"] in ("learned", "adapted")}
    assert {row["subtask"] for row in cold.document["skills"]} == {"transfer", "grasp", "insert", "cover", "place"}
    assert {row["policy"] for row in cold.document["skills"]} == learned
    assert sum(row["helped_steps"] for row in cold.document["skills"]) > 100
    assert all(row["solved"] for row in cold.document["skills"])


def test_all_files_are_there_and_whole(cold: Ran) -> None:
    files = {name: cold.folder / path for name, path in cold.document["files"].items()}
    assert {name: path.name for name, path in files.items()} == FILES
    there = {*os.listdir(cold.folder / "toast-run")} - {"run-before.jsonl"}  # a second run has put it aside
    assert there == {*FILES.values(), "known.json", "run.jsonl", "skills"}
    for name in ("gantt", "learning_curves", "value_map", "overhead"):
        assert min(read_picture(files[name]).shape[:2]) > 200
    assert 'id="lab-data"' in files["replay"].read_text(encoding="utf-8")


def test_the_json_files_hold_the_run(cold: Ran, warm: Ran) -> None:
    folder = warm.folder / "toast-run"
    run = json.loads((folder / "run.json").read_text(encoding="utf-8"))
    assert {name: run[name] for name in RUN_FIELDS} == warm.document
    assert run["schedule"]["makespan_s"] == warm.document["measured_makespan_s"]
    order = json.loads((folder / "sequence.json").read_text(encoding="utf-8"))
    assert order["sequence"] == order["optimal_sequence"] == [1, 1, 1]
    assert order["makespan_s"] == warm.document["predicted_makespan_s"]
    assert min(order["episode_makespans_s"]) == pytest.approx(order["makespan_s"])
    assert order["durations"]["process_s"].keys() == {"butter_applier"}


def test_a_kept_run_is_audited_again(warm: Ran, lab: Lab, tmp_path: Path) -> None:
    kept = copytree(warm.folder / "toast-run", tmp_path / "kept")
    again = lab("replay", str(kept), "--audit", "--json").json
    assert {name: again[name] for name in warm.document["audit"]} == warm.document["audit"]
    assert again["delivered"] == ["slice 1"]
    tracks = read_tracks(kept / "frames.npz")
    tracks.poses[-1, tracks.number("slice 1"), 0] += 0.5
    (kept / "frames.npz").write_bytes(packed(tracks))
    moved = lab("replay", str(kept), "--audit")
    assert moved.code == 1
    assert "slice 1" in moved.err
    (kept / "frames.npz").unlink()
    assert lab("replay", str(kept), "--audit").code == 2
    assert lab("replay", str(tmp_path), "--audit").code == 2
    assert lab("replay", "--audit").code == 2


def test_the_program_has_the_runs_moves_and_begins_when_it_does(cold: Ran) -> None:
    program = Program.load(cold.folder / "toast-run")
    carried = [(one.origin, one.target, one.waits_for) for one in program.carried.transfers]
    assert carried == [
        ("plate", "toaster", None),
        ("toaster", "butter_applier", "toaster"),
        ("butter_applier", "finished_plate", "butter_applier"),
    ]
    begins = [motion.at_s for motion in program.motions]
    assert (begins[0], program.carried.transfers[0].leave_s) == (0.0, 0.0)
    assert {one.reach_s for one in program.carried.transfers[:1]} <= set(
        begins
    )  # it goes on at once where it need not wait
    assert program.carried.transfers[-1].drop_s == cold.document["measured_makespan_s"]


def test_the_schedule_is_there_as_a_table_planned_and_measured(warm: Ran) -> None:
    folder = warm.folder / "toast-run"
    rows = json.loads((folder / "schedule.json").read_text(encoding="utf-8"))["schedule"]
    for when, end_s in (("planned", "predicted_makespan_s"), ("measured", "measured_makespan_s")):
        own = [row for row in rows if row["when"] == when]
        assert max(row["end_s"] for row in own) == pytest.approx(warm.document[end_s])
        assert {row["resource"] for row in own} == {"robot", "toaster", "butter_applier"}
    with (folder / "schedule.csv").open(encoding="utf-8", newline="") as file:
        table = list(csv.DictReader(file))
    assert [{name: "" if value is None else str(value) for name, value in row.items()} for row in rows] == table


def test_progress_goes_to_stderr_in_lines_a_log_can_hold(cold: Ran) -> None:
    lines = cold.stderr.splitlines()
    phases = [line for line in lines if line and not line.startswith(" ")]
    assert phases == [
        "Find or learn the skills",
        "Time every move in simulation",
        "Find the order of the transfers",
        "Carry the order out in physics",
        "Draw the pictures",
    ]
    assert "\x1b" not in cold.stderr
    learned = sum(row["source"] == "learned" for row in cold.document["skills"])
    assert sum(line.startswith("  learned ") for line in lines) == learned
    assert any("asked" in line and "helped steps" in line for line in lines)


def test_a_second_run_learns_nothing_and_does_the_same(cold: Ran, warm: Ran) -> None:
    assert {row["source"] for row in warm.document["skills"]} == {"reused"}
    assert sum(row["episodes"] + row["helped_steps"] for row in warm.document["skills"]) == 0
    assert [row["policy"] for row in warm.document["skills"]] == [row["policy"] for row in cold.document["skills"]]
    planned = {
        "order_learning",
        "predicted_makespan_s",
        "optimal_makespan_s",
        "bound_s",
    }  # with the times of the first run
    same = set(RUN_FIELDS) - {"skills", "sim_s", "timed_s", "wall_s", *planned}
    assert {name: warm.document[name] for name in same} == {name: cold.document[name] for name in same}
    wrong = [abs(ran.document["predicted_makespan_s"] - ran.document["measured_makespan_s"]) for ran in (cold, warm)]
    assert wrong[1] < 0.1 * wrong[0]
    assert warm.document["timed_s"] == 0.0 < cold.document["timed_s"]
    assert "Time every move" not in warm.stderr
    reused = [line for line in warm.stderr.splitlines() if line.startswith("  reused    ")]
    assert len(reused) == 2  # of this very problem, and of another one
    assert "of another problem: their paths are free here" in reused[1]


def test_a_skills_log_tells_what_became_of_it(cold: Ran, warm: Ran) -> None:
    box, row = Toolbox(cold.folder / "toolbox"), cold.document["skills"][0]
    events = box.log(row["policy"])
    assert [event["what"] for event in events][:3] == ["learned", "used", "used"]
    assert {name: events[1][name] for name in ("task", "seed", "delivered")} == {
        "task": "toast",
        "seed": 0,
        "delivered": "1 of 1",
    }
    assert events[0]["scene"].startswith("1 slice, cubes A at (0.7")


# ---- what is reused, and what is not -------------------------------------------------------------------------------


def skipped(heard: list[Event]) -> list[str]:
    return [event.why for event in heard if isinstance(event, RecordSkipped)]


def phases(heard: list[Event]) -> list[str]:
    return [event.name for event in heard if isinstance(event, PhaseBegan)]


@pytest.fixture(scope="module")
def prepared() -> Prepared:
    return prepare(load("toast"), ("slice",), 0)


@pytest.fixture
def toolbox(cold: Ran, tmp_path: Path) -> Toolbox:
    """A copy of what the first run learned."""
    kept = cold.folder / "toolbox"
    for path in kept.rglob("*"):
        if path.is_file():
            copy = tmp_path / "toolbox" / path.relative_to(kept)
            copy.parent.mkdir(parents=True, exist_ok=True)
            copy.write_bytes(path.read_bytes())
    return Toolbox(tmp_path / "toolbox")


@pytest.fixture
def measured(monkeypatch: pytest.MonkeyPatch) -> list[Prepared]:
    """The tasks whose moves were timed; each move takes 5 s."""
    timed: list[Prepared] = []

    def measure(prepared: Prepared, *_: object) -> Durations:
        timed.append(prepared)
        skills = prepared.skillset
        empty, loaded = dict.fromkeys(skills.travels, 5.0), dict.fromkeys(skills.legs, 5.0)
        return Durations(empty, loaded, {"butter_applier": 5.0})

    monkeypatch.setattr(lab.production.taught, "measure", measure)
    return timed


def sources(taught: Taught) -> dict[str, str]:
    return {name: lesson.source for name, lesson in taught.lessons.items()}


def test_the_same_scene_needs_nothing(prepared: Prepared, toolbox: Toolbox, measured: list[Prepared]) -> None:
    heard: list[Event] = []
    taught = teach_all(prepared, Teacher(toolbox, tell=heard.append))
    assert set(sources(taught).values()) == {"reused"}
    assert (phases(heard), skipped(heard), measured) == (["learn"], [], [])


def test_a_toolbox_that_may_only_be_read_serves_a_run(
    prepared: Prepared, toolbox: Toolbox, measured: list[Prepared], monkeypatch: pytest.MonkeyPatch
) -> None:
    for kind in ("durations", "reused"):
        rmtree(toolbox.folder / "records" / kind, ignore_errors=True)

    def refused(*_: object, **__: object) -> None:
        raise BadInput("toolbox: cannot be written")

    for method in ("check", "put", "save_record"):
        monkeypatch.setattr(toolbox, method, refused)
    heard: list[Event] = []
    taught = teach_all(prepared, Teacher(toolbox, tell=heard.append))
    assert set(sources(taught).values()) == {"reused"}
    assert "the durations: toolbox: cannot be written" in skipped(heard)
    assert len(measured) == 1


def move(task: Task, name: str, by: tuple[float, float]) -> Task:
    """The task with one stack of cubes elsewhere."""
    obstacles = tuple(
        o.model_copy(update={"position_m": (o.position_m[0] + by[0], o.position_m[1] + by[1])}) if o.name == name else o
        for o in task.obstacles
    )
    return task.model_copy(update={"obstacles": obstacles})


def same(one: Prepared, other: Prepared, name: str) -> bool:
    """Whether a skill has the same problem in both scenes, number by number."""
    a, b = one.problems[name].mdp, other.problems[name].mdp
    arrays = ("successor", "reward", "terminal", "goal")
    return (a.start, a.starts, a.shape) == (b.start, b.starts, b.shape) and all(
        np.array_equal(getattr(a, array), getattr(b, array)) for array in arrays
    )


@pytest.mark.parametrize(
    ("cubes", "by", "must"), [("tower left", (0.0, 0.1), "transfer"), ("cubes A", (0.0, -0.05), "insert")]
)
def test_a_moved_obstacle_is_learned_around_and_nothing_else(
    prepared: Prepared, toolbox: Toolbox, measured: list[Prepared], cubes: str, by: tuple[float, float], must: str
) -> None:
    changed = prepare(move(prepared.task, cubes, by), prepared.order, 0)
    affected = {name for name in prepared.problems if not same(prepared, changed, name)}
    assert must in {prepared.problems[name].subtask for name in affected}
    assert not {prepared.problems[name].subtask for name in affected} & {"grasp", "cover", "place"}
    assert len(affected) < len(prepared.problems)
    taught = teach_all(changed, Teacher(toolbox))
    judged = {name for name, lesson in taught.lessons.items() if lesson.fitness is not None}
    assert affected <= judged
    assert {source for name, source in sources(taught).items() if name not in affected} == {"reused"}
    for name in affected:
        lesson, problem = taught.lessons[name], changed.problems[name]
        assert fits(lesson.policy.q, problem, changed.task.subtask(problem.subtask).learner)
        assert lesson.reason.startswith("'")  # it names the policy that it speaks of
        if lesson.source == "reused":
            assert lesson.steps == (shortest_steps(problem.mdp),) * 2
    before = sum(prepared.task.subtask(changed.problems[name].subtask).learner.episodes for name in affected)
    spent = [lesson.result for lesson in taught.lessons.values() if lesson.result is not None]
    assert sum(len(result.steps) for result in spent) < 0.8 * before
    assert len(measured) == 1


def test_skills_with_one_problem_save_its_lesson_once(prepared: Prepared, toolbox: Toolbox) -> None:
    lessons = teach_all(prepared, Teacher(toolbox)).lessons
    grasps = [name for name in lessons if name.startswith("grasp")]
    assert [lessons[name].saved[0] > 0 for name in grasps] == [True] + [False] * (len(grasps) - 1)
    assert {lessons[name].reason for name in grasps[1:]} == {f"it is the same problem as '{grasps[0]}'"}


def test_damaged_policies_are_named_and_learned_again(
    prepared: Prepared, toolbox: Toolbox, measured: list[Prepared]
) -> None:
    files = {path.stem.partition("-at-")[0]: path for path in toolbox.folder.glob("*-at-*.safetensors")}
    files["insert"].write_bytes(files["insert"].read_bytes()[:-8])
    files["butter"].write_bytes(b"")
    heard: list[Event] = []
    found = sources(teach_all(prepared, Teacher(toolbox, tell=heard.append)))
    assert {name for name, source in found.items() if source == "learned"} == {
        "insert at toaster",
        "butter at butter_applier",
    }
    assert len(skipped(heard)) == 2
    assert all(str(files[name]) in " ".join(skipped(heard)) for name in ("insert", "butter"))
    assert measured == []  # the same seed learns the same tables: the durations still hold


@pytest.mark.parametrize(
    "damage",
    [
        lambda record: {},
        lambda record: record | {"empty_s": {}},
        lambda record: record | {"loaded_s": dict.fromkeys(record["loaded_s"], -1.0)},
        lambda record: record | {"process_s": {"butter_applier": "soon"}},
        lambda record: record | {"empty_s": [1, 2]},
        lambda record: record | {"empty_s": record["empty_s"] | {"plate > elsewhere": 5.0}},
        lambda record: record | {"process_s": record["process_s"] | {"elsewhere": 5.0}},
        lambda record: record | {"process_s": {"butter_applier": 10**400}},
    ],
)
def test_damaged_durations_are_measured_again(
    prepared: Prepared, toolbox: Toolbox, measured: list[Prepared], damage: Callable[[dict[str, Any]], dict[str, Any]]
) -> None:
    (path,) = (toolbox.folder / "records" / "durations").glob("*.json")
    whole = json.loads(path.read_text(encoding="utf-8"))
    toolbox.save_record(whole["kind"], whole["key"], damage(whole["record"]))
    heard: list[Event] = []
    taught = teach_all(prepared, Teacher(toolbox, tell=heard.append))
    assert len(measured) == 1
    assert [what for what in skipped(heard) if what.startswith("durations measured earlier: record '")] == skipped(
        heard
    )
    assert len(skipped(heard)) == 1
    assert set(taught.durations.loaded_s.values()) == {5.0}
    teach_all(prepared, Teacher(toolbox))
    assert len(measured) == 1


def test_edited_durations_are_measured_again_though_they_read_well(
    prepared: Prepared, toolbox: Toolbox, measured: list[Prepared]
) -> None:
    (path,) = (toolbox.folder / "records" / "durations").glob("*.json")
    whole = json.loads(path.read_text(encoding="utf-8"))
    whole["record"]["process_s"]["butter_applier"] = 1.0
    path.write_text(json.dumps(whole), encoding="utf-8")
    heard: list[Event] = []
    teach_all(prepared, Teacher(toolbox, tell=heard.append))
    assert len(measured) == 1
    assert skipped(heard) == [
        f"durations measured earlier: record file {path}: it does not hold what was written: it was changed"
    ]
    assert all(sound for _, sound, _ in toolbox.verify())


def test_only_one_skill_can_be_prepared() -> None:
    assert list(prepare(load("toast"), ("slice",), 0, "butter at butter_applier").problems) == [
        "butter at butter_applier"
    ]


@pytest.mark.slow
@pytest.mark.parametrize("method", [name for name in SEQUENCERS if name != "earliest-due"])
def test_methods_of_sequencing(prepared: Prepared, toolbox: Toolbox, method: str) -> None:
    cell = teach_all(prepared, Teacher(toolbox)).cell
    search = search_for(prepared.task.sequencing, episodes=5)
    assert find_sequence(cell, method, search, prepared.seed).sequence == (1, 1, 1)


# ---- the files of a run ---------------------------------------------------------------------------------------------


@pytest.fixture
def failed(prepared: Prepared, toolbox: Toolbox) -> Report:
    """A run whose second step failed."""
    taught = teach_all(prepared, Teacher(toolbox))
    why = "slice 1 at 'plate': slice 1 is not in the gripper after grasping at 'plate' (tried 3 times)"
    outcome = Outcome(Schedule.from_moves(taught.cell, []), (), (1,), ("try 1",), why, 30.0, ())
    settings = prepared.task.sequencing
    found = find_sequence(taught.cell, settings.method, search_for(settings), 0)
    return Report(prepared, taught, found, "fifo", optimum(taught.cell), outcome, Recording((), []), 0.0)


def test_what_a_run_measured_may_be_lost_but_not_the_run(failed: Report, toolbox: Toolbox) -> None:
    """Its files are written by then; a file stands where the toolbox keeps its records."""
    rmtree(toolbox.folder / "records", ignore_errors=True)
    (toolbox.folder / "records").write_text("in the way")
    heard: list[Event] = []
    failed.taught.durations_key = "k"
    remember(failed, Teacher(toolbox, tell=heard.append))
    (why,) = skipped(heard)
    assert why.startswith("what this run measured: cannot write ")


def drawn(monkeypatch: pytest.MonkeyPatch, stop: BaseException | None = None) -> list[str]:
    """The names of the learning curves, which are not drawn."""
    names: list[str] = []

    def quick(policies: dict[str, Policy], path: Path) -> None:
        names.extend(policies)
        path.write_text("new")
        if stop is not None:
            raise stop

    monkeypatch.setattr("lab.production.report.learning_curves", quick)
    return names


def test_a_failed_run_says_so_and_leaves_no_old_chart(
    failed: Report, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its lessons are drawn once for each table."""
    document = failed.to_json()
    assert (document["success"], document["delivered"], document["dropped"]) == (False, 0, 1)
    assert (document["measured_makespan_s"], document["camera_deviation_m"]) == (None, None)
    assert document["failure"].startswith("slice 1 at 'plate': ")
    out = tmp_path / "out"
    (out / ".run-k3pt_0ab").mkdir(parents=True)  # a run that was killed while it drew has left this
    (out / ".run-k3pt_0ab" / "gantt.png").write_text("half")
    (out / "gantt.png").write_text("old")
    (out / "mine.txt").write_text("mine")
    curves = drawn(monkeypatch)
    write_files(failed, out)
    assert sorted(failed.files) == sorted(set(FILES) - {"gantt", "order_learning", "program", "trajectory"})
    assert sorted(os.listdir(out)) == sorted(["mine.txt", *map(FILES.__getitem__, failed.files)])
    assert len(curves) == len({lesson.policy.name for lesson in failed.taught.lessons.values()})
    assert {"grasp at plate, starts vary", "insert at toaster"} < set(curves)


def test_nothing_is_half_written(failed: Report, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    out = tmp_path / "out"
    out.mkdir()
    (out / "run.json").write_text("old")
    drawn(monkeypatch, KeyboardInterrupt())
    with pytest.raises(KeyboardInterrupt):
        write_files(failed, out)
    assert {path.name: path.read_text() for path in out.iterdir()} == {"run.json": "old"}


@pytest.mark.parametrize(
    "why", [OSError(28, "No space left on device"), BadInput("picture 'x' cannot be written: full")]
)
def test_the_numbers_are_written_though_a_picture_cannot_be(
    failed: Report, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, why: Exception
) -> None:
    drawn(monkeypatch, why)
    (tmp_path / "learning-curves.png").write_text("of a run before")
    write_files(failed, tmp_path)
    there = set(FILES) - {"gantt", "order_learning", "program", "trajectory", "learning_curves"}
    assert sorted(failed.files) == sorted(there)
    assert {path.name for path in tmp_path.iterdir()} >= {FILES[name] for name in there}
    assert not (tmp_path / "learning-curves.png").exists()
    assert json.loads((tmp_path / "run.json").read_text(encoding="utf-8"))["files"] == failed.files
    assert failed.lost == f"'learning-curves.png' is missing: {getattr(why, 'strerror', None) or why}"


def test_without_room_for_the_numbers_nothing_is_written(
    failed: Report, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(rows: object, columns: object) -> str:
        raise OSError(28, "No space left on device")

    out = tmp_path / "out"
    out.mkdir()
    (out / "run.json").write_text("old")
    monkeypatch.setattr("lab.production.report.csv_of", full)
    with pytest.raises(WorkFailed, match=r"\(--out\) cannot be written: No space left on device"):
        write_files(failed, out)
    assert {path.name: path.read_text() for path in out.iterdir()} == {"run.json": "old"}


def short_task(root: Path) -> str:
    """Toast carried from plate to plate; a grasp is learned in short sessions, a person is asked now and then in each."""
    text = (root / "tasks" / "toast.toml").read_text(encoding="utf-8")
    for station, buffer in (("toaster", "toaster_buffer"), ("butter_applier", "butter_buffer")):
        text = text.replace(f'  {{ station = "{station}", buffer = "{buffer}" }},\n', "")
    head, grasp, rest = text.partition("[subtasks.grasp]")
    head = head.replace("max_steps = 200", "max_steps = 5")  # too few for any transfer
    rest = rest.replace("episodes = 1500", "episodes = 150", 1)
    rest = rest.replace('gate = "ccrl"', 'gate = "random", rate = 0.002', 1)
    return head + grasp + rest


def test_the_lessons_of_a_run_are_replayed_and_gone_on_with(
    lab: Lab, root: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A person answers in six sessions of a grasp, shorter ways are looked for alone; no transfer is learned, and it says so."""
    monkeypatch.setenv("LAB_TOOLBOX", str(tmp_path / "toolbox"))
    monkeypatch.chdir(tmp_path)
    (tmp_path / "short.toml").write_text(short_task(root), encoding="utf-8")
    typed = ["right", "skip", *[""] * 60]  # an empty line: what the learner would do itself
    ran = lab("run", "short.toml", "--toasts", "1", "--advisor", "terminal", stdin="\n".join(typed))
    assert (ran.code, "was not learned in 3812 episodes" in ran.err) == (1, True)
    rows = {row["problem"]: row for row in lab("replay", "--json").json["sessions"]}
    assert {problem: row["state"] for problem, row in rows.items()} == {
        "grasp at plate": "solved",
        "transfer plate to finished_plate with slice": "over",
    }
    for row in rows.values():
        assert lab("replay", row["session"], "--json").code == 0
    journal = Path(rows["grasp at plate"]["session"]) / "events.jsonl"
    whole, box = journal.read_bytes(), Toolbox(tmp_path / "toolbox")
    lines = whole.splitlines(keepends=True)
    begun = [n for n, line in enumerate(lines) if b'"kind": "episode", "episode": 1,' in line]
    answers = [n for n, line in enumerate(lines) if b'"kind": "answer"' in line]
    assert [sum(first < n for n in answers) for first in begun] == [21, 17, 12, 11, 6, 1, 0, 0, 0]
    (path,) = tmp_path.glob("toolbox/grasp-*.safetensors")
    learned = box.load(path)
    path.unlink()
    journal.write_bytes(b"".join(lines[: answers[6]]))  # in the second session
    ran = lab("teach", "--resume", str(journal.parent), "--json", stdin="\n" * 60)
    assert (ran.code, ran.json["solved"], ran.json["saved_as"]) == (0, True, learned.name)
    assert journal.read_bytes() == whole
    again = box.load(path)
    assert np.array_equal(again.q, learned.q)
    assert np.array_equal(again.visits, learned.visits)
    assert (again.curve, again.guided, again.requests) == (learned.curve, learned.guided, learned.requests)
