"""Every kind of file that the lab reads: its sound files (`sound_files`), and the lab's own reader of it."""

import json
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from devtools import sound_files as sound

QUICK = 3000  # tries of a batch where a file is read within two milliseconds
MOST_ACTIONS = 300  # a program with more is only read, as exporting it takes long


@dataclass(frozen=True)
class Kind:
    """A kind of file.

    content: the key of its mutations in `mutate.FITTING`; made(folder, room): writes its sound files into a folder; which: the
    pattern of those that are damaged; read(path): reads one as the lab does; tries: the files of a batch, fewer where
    reading one takes long.
    """

    content: str
    made: sound.Maker
    which: str
    read: Callable[[Path], object]
    tries: int = 500


def _any(path: Path) -> object:
    from lab.tasks.task_file import load_any

    return load_any(str(path))


def _cell(path: Path) -> object:
    from lab.tasks.task_file import load_cell

    return load_cell(str(path)).cell()


def _checked(path: Path) -> object:
    from lab.skills.prepared_scene import check_task

    errors, _ = check_task(str(path), None, 0)
    if errors:
        from lab.errors import BadInput

        raise BadInput(errors[0])
    return errors


def _instance(path: Path) -> object:
    from lab.tasks.instances import InstanceRequest, is_instance, read_instance
    from lab.tasks.task_file import load_any

    beside = path.parent
    if path.name.startswith("jobs") or path.name == "layout.csv":
        return read_instance(beside / "jobs.csv", InstanceRequest(beside / "layout.csv", None, "7:1")).cell()
    if path.name.startswith("phillips"):
        return read_instance(
            beside / "phillips-unger-tanks.csv", InstanceRequest(beside / "phillips-unger-empty.csv", None, None)
        ).cell()
    return read_instance(path).cell() if is_instance(path) else load_any(str(path))


def _schedule(path: Path) -> object:
    from lab.tasks.schedule_table import read_schedule
    from lab.view.schedule_scene import scene_of

    return scene_of(read_schedule([path]), path.stem).story.to_json()


def _policy(path: Path) -> object:
    from lab.toolbox.registry import Toolbox

    box = Toolbox(path.parent)
    box.list()
    box.verify()
    return box.load(path)


def _archive(path: Path) -> object:
    from lab.toolbox.archive import unpack

    return unpack(path)


def _hub_read(path: Path) -> object:
    from lab.toolbox.hub_folder import read_folder

    return read_folder(path.parent)


def _replayed(path: Path) -> object:
    from lab.errors import BadInput
    from lab.teaching.kept_session import KeptSession
    from lab.teaching.lesson import replay
    from lab.teaching.session_list import session_rows
    from lab.teaching.subjects import subject_of
    from lab.toolbox.registry import Toolbox

    rows = session_rows(Toolbox(path.parents[2]))
    if rows[0]["state"] == "damaged":
        assert rows[0]["why"], "a damaged row says why"
    kept = KeptSession(path.parent, "DIR", read_only=True)
    if (kept.options.episodes or 0) > 1000 or kept.options.subtask.startswith("gym:"):
        raise BadInput("left out: a lesson with over 1000 episodes, or in an environment of Gymnasium, takes too long")
    return replay(kept, subject_of(kept.options, kept), lambda event: None)


def _recorded(path: Path) -> object:
    from numpy.random import default_rng

    from lab.advice.advisors import AdvisorName
    from lab.advice.table_level import TableLevel

    return TableLevel(_world(), 0.95, default_rng(0)).advisor(AdvisorName.of(f"recorded:{path.parent}"))


@cache
def _world() -> Any:
    from lab.tasks.task_file import load_world

    return load_world("world-1").check()


def _answers(path: Path) -> object:
    from lab.advice.table_level import answers_of

    return answers_of(path, _world())


def _order(path: Path) -> object:
    from lab.teaching.kept_order import kept_order
    from lab.toolbox.registry import Toolbox

    kept = kept_order(path.parent, "DIR", Toolbox(path.parents[2]), read_only=True)
    return kept.durations()


def _run(path: Path) -> object:
    from lab.production.run_journal import RunJournal, replayed_run
    from lab.production.run_options import RunOptions, gone_on
    from lab.toolbox.index import KnownPolicies

    replayed_run(path.parent, "DIR")
    gone_on(RunOptions(task=""), path.parent, None)
    before = (path.parent / "run.jsonl").read_bytes()
    journal = RunJournal.resume(path.parent)
    try:
        journal.known_at_first(KnownPolicies.of([]))
        journal.stops(), journal.commands(), journal.last_step(), journal.durations()
        for entry in journal.known:
            if hasattr(entry, "row"):
                journal.skill(str(entry.row.get("name")))
        return journal
    finally:
        journal.close()
        (path.parent / "run.jsonl").write_bytes(before)


def _program(path: Path) -> object:
    from lab.export import program_formats
    from lab.export.program import Options, Program

    program = Program.load(path.parent)
    if len(program.carried.actions) > MOST_ACTIONS:
        return program
    options = Options("rectan", "2026/01/01 00:00")
    return [program_formats()[name].write(program, options) for name in ("jbi", "csv", "json")]


def _read_back(path: Path) -> object:
    from lab.export import program_formats

    texts = {file.name: file.read_bytes().decode("utf-8", "replace") for file in path.parent.iterdir()}
    return program_formats()[path.parent.name].read(texts, _up6())


@cache
def _up6() -> Any:
    from lab.sim.arms.arm_models import arm_named

    return arm_named("up6")


def _durations(path: Path) -> object:
    from lab.production.durations import Durations
    from lab.toolbox.registry import Toolbox

    box, skillset = Toolbox(path.parents[2]), _skillset(path.stem, path)
    box.verify()
    record = box.load_record("durations", path.stem)
    return None if record is None else Durations.from_json(record, skillset)


def _reused(path: Path) -> object:
    from lab.toolbox.registry import Toolbox

    box = Toolbox(path.parents[2])
    return [box.load_record("reused", path.stem), box.verify()]


@cache
def _skillset(key: str, path: Path) -> Any:
    """The skills of the run in which the record of durations at `path` was measured."""
    from lab.errors import BadInput
    from lab.production.durations import Durations
    from lab.skills.skillset import SkillSet
    from lab.tasks.task_file import load

    task = load("toast")
    record = json.loads(path.read_text())["record"]
    for count in (1, 3):
        skillset = SkillSet.of(task, task.order(count))
        try:
            Durations.from_json(record, skillset)
            return skillset
        except BadInput:
            continue
    raise AssertionError(f"{key} belongs to no run of `make_sound`")


def _log(path: Path) -> object:
    from lab.toolbox.registry import Toolbox

    box = Toolbox(path.parents[1])
    box.list()
    box.verify()
    return [box.show("mine"), box.log("mine")]


def _index(path: Path) -> object:
    from lab.toolbox.registry import Toolbox

    rows = Toolbox(path.parent).list()
    shown = Toolbox(path.parent).show("mine 3")
    return json.dumps(rows) + json.dumps(shown, default=str)


def _carried_read(path: Path) -> object:
    from lab.tasks.sequencing import read_policy

    return read_policy(path)


def _picture(path: Path) -> object:
    from lab.cli.see import see_picture

    return see_picture(path, None, "toast", None)


def _lens(path: Path) -> object:
    from lab.vision import read_picture
    from lab.vision.calibration import read_calibration

    calibration = read_calibration(path)
    return calibration.lens.straightened(read_picture(path.with_name("00001.png")))


def _scored(path: Path) -> object:
    from lab.skills.scored_pictures import score_pictures
    from lab.vision.calibration import read_calibration

    return score_pictures(path.parent, read_calibration(path.parents[1] / "lens.json"))


def _part(path: Path) -> object:
    from lab.sim.parts.part_shape import shape_of
    from lab.tasks.part_fields import PartFields

    fields = {"name": "thing", "mass_kg": 0.1, "shape": "mesh", "file": path.name}
    return [shape_of(PartFields.model_validate({**fields, "hull": hull}), path.parent) for hull in (True, False)]


def _arm(path: Path) -> object:
    from lab.sim.arms import arm_models
    from lab.tasks.robot_fields import RobotSettings

    arm_models._made.cache_clear()  # its key is the URDF file's date, not its content
    settings = RobotSettings(model="own.urdf", start="here", tool_link="tool0", fingers=("left", "right"), tip_m=0.09)
    return arm_models.arm_of(settings, path.parent)


def _body(path: Path) -> object:
    from lab.sim import urdf_reader

    name = "toaster.urdf" if path.suffix == ".obj" else path.name
    return urdf_reader.bounds(path.with_name(name)), urdf_reader.looks(path.with_name(name))


def _compared(path: Path) -> object:
    from lab.studies.compared import Compared, compared
    from lab.studies.runner import Job

    _compiled()
    before = path.read_bytes()
    try:
        return compared(Compared("world-1"), Job(2, 0, folder=path.parent))
    finally:
        path.write_bytes(before)


@cache
def _compiled() -> None:
    """Compile what sessions need, once, before a file is read."""
    from lab.studies.compared import Compared, compared
    from lab.studies.runner import Job

    compared(Compared("world-1"), Job(2, 0))


_CELLS = ("fms", "hoist-pu", "two-carriers", "two-on-a-track")

KINDS: dict[str, Kind] = {
    "task": Kind("text", sound.with_faults, "*.toml", _any, QUICK),
    "task, checked": Kind("text", sound.tasks("toast", "sorting"), "*.toml", _checked, 60),
    "cell": Kind("text", sound.tasks(*_CELLS), "*.toml", _cell, QUICK),
    "world": Kind("text", sound.tasks("world-1"), "*.toml", _any, QUICK),
    "text grid": Kind("text", sound.texts({"grid.txt": sound.GRID}), "*.txt", _any, QUICK),
    "instance": Kind("text", sound.instances, "*", _instance, QUICK),
    "jobs and layout": Kind(
        "text", sound.texts({"jobs.csv": sound.JOBS, "layout.csv": sound.LAYOUT}), "*.csv", _instance, QUICK
    ),
    "schedule": Kind("text", sound.texts(sound.SCHEDULES), "*", _schedule, QUICK),
    "policy": Kind("tensors", sound.copied("toolbox/mine.safetensors"), "mine.safetensors", _policy, QUICK),
    "archive": Kind("zip", sound.copied("mine.zip"), "mine.zip", _archive, QUICK),
    "folder for the Hub, model": Kind("tensors", sound.hub, "model.safetensors", _hub_read, QUICK),
    "folder for the Hub, metadata": Kind("json", sound.hub, "config.json", _hub_read, QUICK),
    "toolbox's log": Kind("json lines", sound.copied("toolbox"), "toolbox/log/mine.jsonl", _log),
    "toolbox's index": Kind("json", sound.many_policies, "toolbox/index.json", _index, 100),
    "record of durations": Kind("record", sound.copied("toolbox"), "toolbox/records/durations/*", _durations),
    "record of reuse": Kind("record", sound.copied("toolbox"), "toolbox/records/reused/*", _reused),
    "lesson's journal": Kind(
        "json lines", sound.copied("toolbox"), "toolbox/sessions/world-1-*/events.jsonl", _replayed
    ),
    "recorded advice": Kind("json lines", sound.copied("lesson"), "lesson/events.jsonl", _recorded),
    "order's journal": Kind(
        "json lines", sound.copied("toolbox"), "toolbox/sessions/order-of-toast-1/events.jsonl", _order
    ),
    "answers": Kind(
        "json", sound.texts({"answers.json": '{"0": "right", "5": 1, "7": "up"}'}), "answers.json", _answers, QUICK
    ),
    "run's journal": Kind("json lines", sound.copied("run"), "run/run.jsonl", _run),
    "run's known policies": Kind("json", sound.copied("run"), "run/known.json", _run),
    "run's skills": Kind(
        "tensors", sound.copied("run"), "run/skills/*", lambda path: _run(path.parents[1] / "run.jsonl")
    ),
    "run's program": Kind("json", sound.copied("run"), "run/program.json", _program),
    "run's trajectory": Kind("zip", sound.copied("run"), "run/trajectory.npz", _program, 200),
    "exported jobs": Kind("text", sound.exported, "jbi/*", _read_back, QUICK),
    "exported tables": Kind("text", sound.exported, "csv/*", _read_back, 200),
    "exported documents": Kind("json", sound.exported, "json/*", _read_back, 200),
    "carried policy": Kind("json", sound.carried, "carried.json", _carried_read, QUICK),
    "picture": Kind("picture", sound.copied("run/overhead.png"), "overhead.png", _picture, 200),
    "calibration": Kind("json", sound.copied("lens.json", "pictures/00001.png"), "lens.json", _lens, 200),
    "truth of pictures": Kind("json", sound.copied("pictures", "lens.json"), "pictures/[0p]*.json", _scored, 50),
    "mesh of a part": Kind("binary", sound.meshes, "binary.stl", _part),
    "mesh of a part, text": Kind("text", sound.meshes, "t*", _part),
    "arm": Kind("text", sound.own_arm, "own.urdf", _arm, 200),
    "mesh of an arm": Kind("binary", sound.own_arm, "part.stl", _arm, 200),
    "body of a station": Kind("text", sound.bodies, "[ast]*.urdf", _body, QUICK),
    "kept sessions of a study": Kind("json lines", sound.copied("compared"), "compared/sessions.jsonl", _compared, 40),
}
