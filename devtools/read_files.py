"""Every kind of file that the lab reads: sound ones to begin from, and the lab's own reader of each."""

import json
import shutil
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from devtools.commands import environment, lab

INSTANCES = {
    "la": "3 3\n0 3 1 2 2 5\n1 4 0 1 2 2\n2 6 1 3 0 2\n",
    "ta": "2 2\nTimes\n3 2\n4 1\nMachines\n1 2\n2 1\n",
    "mk.fjs": "2 3 1.5\n2 2 1 3 2 5 1 3 4\n1 1 2 7\n",
    "line.dzn": "Ninner = 1;\ntmin = [150];\ntmax = [200];\nf = [31, 30];\ne = [| 11, 0 | 19, 3 |];\n",
    "shop.json": '{"jobs": [{"tasks": [0]}],\n "resources": [{"type": "machine"}],\n "tasks": [{"job": 0}],\n'
    ' "modes": [{"task": 0, "resources": [0], "duration": 3, "demands": [0]}]}\n',
}
LAYOUT = "from,to,time\nLU,M1,6\nLU,M2,8\nM1,LU,12\nM1,M2,6\nM2,LU,10\nM2,M1,6\n"
JOBS = "set,job,operation,machine,time\n7,1,1,M1,8\n7,1,2,M2,16\n"
SCHEDULES = {
    "agvs.csv": "job,machine,agv,from,to,start,end\nA,,v1,load,saw,0,20\nA,saw,,,,20,50\nA,,v1,saw,out,60,80\n",
    "shop.json": '{"tasks": [{"mode": 0, "resources": [0], "start": 0, "end": 3},\n'
    ' {"mode": 1, "resources": [1, 0], "start": 3, "end": 5}]}\n',
}
FAULTS = """
[[faults]]
what = "part moved"
part = "slice 1"
at_s = 20.0
by_m = [0.03, 0.0]

[[faults]]
what = "machine slow"
station = "toaster"
share = 1.5
"""
GRID = "S...#\n.##..\n....G\n"


QUICK = 3000  # tries of a batch where a file is read in a millisecond or two
MOST_ACTIONS = 300  # of a program that is also written


@dataclass(frozen=True)
class Kind:
    """A kind of file.

    content: what its mutations fit, see `mutate.FITTING`; made(folder, sound): puts sound files, and what stands beside them,
    into a folder, from what the room's runs made; which: those of them that are damaged; read(path): the lab reads one;
    tries: of a batch, fewer where reading is real work.
    """

    content: str
    made: Callable[[Path, Path], object]
    which: str
    read: Callable[[Path], object]
    tries: int = 500


def make_sound(room: Path) -> None:
    """Runs of the lab that leave files of the kinds which only runs leave."""
    env = environment(room)
    answers = "1\n" * 400

    def made(*words: str, stdin: str = "", codes: tuple[int, ...] = (0,)) -> None:
        ended = lab(*words, cwd=room, env=env, stdin=stdin, timeout_s=600)
        assert ended.code in codes, f"lab {' '.join(words)}: exit {ended.code}: {ended.stderr[-500:]}"

    made("teach", "world-1", "--advisor", "terminal", "--plain", "--gate", "always", "--episodes", "3",
         "--out", "lesson", "--save", "mine",
         stdin="r\nr\nb\nu\n" * 300, codes=(0, 1))  # fmt: skip
    made("sequence", "toast", "--method", "srl", "--episodes", "20", "--advisor", "terminal", "--gate", "always", "--plain",
         stdin=answers + "quit\n", codes=(0, 1, 130))  # fmt: skip
    made("see", "--make", "2", "--out", "pictures")
    made(
        "see",
        *(f"pictures/mat-{number}.png" for number in (1, 2, 3)),
        "--calibrate",
        "--task",
        "toast",
        "--out",
        "lens.json",
    )
    made("toolbox", "export", "mine", "--out", "mine.zip")
    made("study", "compare", "world-1", "--sessions", "2", "--advisor", "expert", "--out", "compared")
    made("run", "toast", "--toasts", "1", "--out", "run")
    lines = (room / "run" / "run.jsonl").read_text().splitlines(keepends=True)
    (room / "run" / "run.jsonl").write_text("".join(lines[:-1]))  # as of a run that was stopped


# ---- what stands in a folder


def _tasks(*names: str) -> Callable[[Path, Path], object]:
    def made(folder: Path, sound: Path) -> None:
        from lab.files import tasks_folder

        for name in names:
            shutil.copy(tasks_folder() / f"{name}.toml", folder)

    return made


def _with_faults(folder: Path, sound: Path) -> None:
    """Tasks, one of them with faults, which also is the form in which they are written to a file."""
    _tasks(*_MADE_BY_HAND)(folder, sound)
    text = (folder / "toast.toml").read_text()
    (folder / "faulty.toml").write_text(f"{text}\n{FAULTS}")


def _texts(texts: dict[str, str]) -> Callable[[Path, Path], object]:
    def made(folder: Path, sound: Path) -> None:
        for name, text in texts.items():
            (folder / name).write_text(text)

    return made


def _copied(*names: str) -> Callable[[Path, Path], object]:
    """Files and folders of the room, as a pattern each."""

    def made(folder: Path, sound: Path) -> None:
        for name in names:
            for path in sorted(sound.glob(name)):
                if path.is_dir():
                    shutil.copytree(path, folder / path.name, ignore=shutil.ignore_patterns("*.html"))
                else:
                    shutil.copy(path, folder)

    return made


def _instances(folder: Path, sound: Path) -> None:
    _texts(INSTANCES)(folder, sound)
    from lab_studies.comparisons.transport_instances import FOLDER

    for name in ("jobshoplab/ft06.yaml", "phillips-unger-tanks.csv", "phillips-unger-empty.csv"):
        shutil.copy(FOLDER / name, folder)


def _link(name: str, size: str = "0.04 0.04 0.04", at: str = "0 0 0", more: str = "") -> str:
    mass = '<inertial><mass value="1"/><inertia ixx=".01" ixy="0" ixz="0" iyy=".01" iyz="0" izz=".01"/></inertial>'
    solid = f'<collision><origin xyz="{at}"/><geometry><box size="{size}"/></geometry></collision>'
    return f'<link name="{name}">{mass}{more}{solid}{solid.replace("collision", "visual")}</link>\n'


def _joint(name: str, ends: tuple[str, str], xyz: str, axis: str, low: float, high: float) -> str:
    kind = "prismatic" if name in ("left", "right") else "revolute"
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{ends[0]}"/><child link="{ends[1]}"/><origin xyz="{xyz}"/>'
        f'<axis xyz="{axis}"/><limit lower="{low}" upper="{high}" velocity="2" effort="100"/></joint>\n'
    )


_MESH = '<visual><geometry><mesh filename="package://mine/part.stl" scale="0.01 0.01 0.01"/></geometry></visual>'
ARM = "".join([
    '<robot name="own"><material name="red"><color rgba="1 0 0 1"/></material>\n',
    _link("foot", more=_MESH), *(_link(f"l{n}") for n in range(1, 6)),
    '<link name="tool0"/><joint name="flange" type="fixed"><parent link="l5"/><child link="tool0"/></joint>\n',
    _link("finger_a", "0.02 0.01 0.06", "0 0.005 0.03"), _link("finger_b", "0.02 0.01 0.06", "0 -0.005 0.03"),
    _joint("j1", ("foot", "l1"), "0 0 0.3", "0 0 1", -2.9, 2.9), _joint("j2", ("l1", "l2"), "0 0 0.1", "0 1 0", -2, 2),
    _joint("j3", ("l2", "l3"), "0 0 0.4", "0 1 0", -0.1, 2.6), _joint("j4", ("l3", "l4"), "0 0 0.4", "0 1 0", -2, 2),
    _joint("j5", ("l4", "l5"), "0 0 0.1", "0 0 1", -3.1, 3.1),
    _joint("left", ("tool0", "finger_a"), "0 0 0.03", "0 1 0", 0, 0.03),
    _joint("right", ("tool0", "finger_b"), "0 0 0.03", "0 -1 0", 0, 0.03), "</robot>\n",
])  # fmt: skip


def _own_arm(folder: Path, sound: Path) -> None:
    from trimesh.creation import box

    (folder / "own.urdf").write_text(ARM)
    box((1, 1, 1)).export(folder / "part.stl", file_type="stl")


def _bodies(folder: Path, sound: Path) -> None:
    from lab.files import assets_folder

    for path in assets_folder().iterdir():
        shutil.copy(path, folder)


def _meshes(folder: Path, sound: Path) -> None:
    from trimesh.creation import box

    made = box((0.02, 0.03, 0.04))
    for name, kind in (("text.stl", "stl_ascii"), ("binary.stl", "stl"), ("thing.obj", "obj")):
        made.export(folder / name, file_type=kind)


def _exported(folder: Path, sound: Path) -> None:
    from lab.export import FORMATS
    from lab.export.program import Options, Program

    program = Program.load(sound / "run")
    for name, form in FORMATS.items():
        try:
            texts = form.write(program, Options("rectan", "2026/01/01 00:00"))
        except Exception:  # a format that this arm does not have
            continue
        (folder / name).mkdir()
        for file, text in texts.items():
            (folder / name / file).write_text(text)
    shutil.copytree(sound / "run", folder / "run", ignore=shutil.ignore_patterns("*.html", "*.png"))


def _hub(folder: Path, sound: Path) -> None:
    from lab.toolbox.hub_folder import hub_files
    from lab.toolbox.registry import Toolbox

    for name, content in hub_files(Toolbox(sound / "toolbox").load(sound / "toolbox" / "mine.safetensors")).items():
        (folder / name).write_bytes(content)


def _many_policies(folder: Path, sound: Path) -> None:
    """So many that there is an index."""
    from dataclasses import replace

    from lab.toolbox.registry import Toolbox

    box = Toolbox(folder / "toolbox")
    mine = Toolbox(sound / "toolbox").load(sound / "toolbox" / "mine.safetensors")
    for number in range(60):
        box.save(replace(mine, name=f"mine {number}"))
    assert box.list()


def _carried(folder: Path, sound: Path) -> None:
    from lab.sequencing.methods.carried_over_policy import DEFAULT
    from lab.tasks.sequencing import write_policy

    write_policy(folder / "carried.json", DEFAULT)


# ---- how the lab reads them


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
        raise BadInput("left out: a lesson of more episodes, or of code from elsewhere, is work of its own")
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
    from lab.export import FORMATS
    from lab.export.program import Options, Program

    program = Program.load(path.parent)
    if len(program.carried.actions) > MOST_ACTIONS:  # to write them is real work
        return program
    options = Options("rectan", "2026/01/01 00:00")
    return [FORMATS[name].write(program, options) for name in ("jbi", "csv", "json")]


def _read_back(path: Path) -> object:
    from lab.export import FORMATS

    texts = {file.name: file.read_bytes().decode("utf-8", "replace") for file in path.parent.iterdir()}
    return FORMATS[path.parent.name].read(texts, _up6())


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
    """The skills that a sound record was measured with."""
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
    raise AssertionError(f"{key} is of no run that was made")


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

    arm_models._made.cache_clear()  # it knows an arm by its URDF's date alone
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
    """What sessions need is compiled before a file is read."""
    from lab.studies.compared import Compared, compared
    from lab.studies.runner import Job

    compared(Compared("world-1"), Job(2, 0))


_CELLS = ("fms", "hoist-pu", "two-carriers", "two-on-a-track")
_MADE_BY_HAND = ("toast", "breakfast", "sorting", "toast-window", "two-toasters", "toast-case-1", "fms-arm")

KINDS: dict[str, Kind] = {
    "task": Kind("text", _with_faults, "*.toml", _any, QUICK),
    "task, checked": Kind("text", _tasks("toast", "sorting"), "*.toml", _checked, 60),
    "cell": Kind("text", _tasks(*_CELLS), "*.toml", _cell, QUICK),
    "world": Kind("text", _tasks("world-1"), "*.toml", _any, QUICK),
    "text grid": Kind("text", _texts({"grid.txt": GRID}), "*.txt", _any, QUICK),
    "instance": Kind("text", _instances, "*", _instance, QUICK),
    "jobs and layout": Kind("text", _texts({"jobs.csv": JOBS, "layout.csv": LAYOUT}), "*.csv", _instance, QUICK),
    "schedule": Kind("text", _texts(SCHEDULES), "*", _schedule, QUICK),
    "policy": Kind("tensors", _copied("toolbox/mine.safetensors"), "mine.safetensors", _policy, QUICK),
    "archive": Kind("zip", _copied("mine.zip"), "mine.zip", _archive, QUICK),
    "folder for the Hub, model": Kind("tensors", _hub, "model.safetensors", _hub_read, QUICK),
    "folder for the Hub, metadata": Kind("json", _hub, "config.json", _hub_read, QUICK),
    "toolbox's log": Kind("json lines", _copied("toolbox"), "toolbox/log/mine.jsonl", _log),
    "toolbox's index": Kind("json", _many_policies, "toolbox/index.json", _index, 100),
    "record of durations": Kind("record", _copied("toolbox"), "toolbox/records/durations/*", _durations),
    "record of reuse": Kind("record", _copied("toolbox"), "toolbox/records/reused/*", _reused),
    "lesson's journal": Kind("json lines", _copied("toolbox"), "toolbox/sessions/world-1-*/events.jsonl", _replayed),
    "recorded advice": Kind("json lines", _copied("lesson"), "lesson/events.jsonl", _recorded),
    "order's journal": Kind("json lines", _copied("toolbox"), "toolbox/sessions/order-of-toast-1/events.jsonl", _order),
    "answers": Kind(
        "json", _texts({"answers.json": '{"0": "right", "5": 1, "7": "up"}'}), "answers.json", _answers, QUICK
    ),
    "run's journal": Kind("json lines", _copied("run"), "run/run.jsonl", _run),
    "run's known policies": Kind("json", _copied("run"), "run/known.json", _run),
    "run's skills": Kind("tensors", _copied("run"), "run/skills/*", lambda path: _run(path.parents[1] / "run.jsonl")),
    "run's program": Kind("json", _copied("run"), "run/program.json", _program),
    "run's trajectory": Kind("zip", _copied("run"), "run/trajectory.npz", _program, 200),
    "exported jobs": Kind("text", _exported, "jbi/*", _read_back, QUICK),
    "exported tables": Kind("text", _exported, "csv/*", _read_back, 200),
    "exported documents": Kind("json", _exported, "json/*", _read_back, 200),
    "carried policy": Kind("json", _carried, "carried.json", _carried_read, QUICK),
    "picture": Kind("picture", _copied("run/overhead.png"), "overhead.png", _picture, 200),
    "calibration": Kind("json", _copied("lens.json", "pictures/00001.png"), "lens.json", _lens, 200),
    "truth of pictures": Kind("json", _copied("pictures", "lens.json"), "pictures/[0p]*.json", _scored, 50),
    "mesh of a part": Kind("binary", _meshes, "binary.stl", _part),
    "mesh of a part, text": Kind("text", _meshes, "t*", _part),
    "arm": Kind("text", _own_arm, "own.urdf", _arm, 200),
    "mesh of an arm": Kind("binary", _own_arm, "part.stl", _arm, 200),
    "body of a station": Kind("text", _bodies, "[ast]*.urdf", _body, QUICK),
    "kept sessions of a study": Kind("json lines", _copied("compared"), "compared/sessions.jsonl", _compared, 40),
}
