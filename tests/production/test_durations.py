"""Durations: what is kept is read back whole or refused in one line, and its key changes with all that decides them."""

import json
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

import lab.files
from lab.errors import BadInput
from lab.production import durations
from lab.production.durations import Durations, TimedMove, cell_of, durations_key, spots_in_use, trials
from lab.sequencing.cell.routes import NeededMoves
from lab.sim.scene.places import Layout
from lab.sim.scene.scene_check import places_of
from lab.skills import Grasp
from lab.skills.prepared_scene import Prepared
from lab.skills.skillset import CarriedPath, SkillSet
from lab.skills.surveys import Surveys
from lab.tasks.task import Order, Task
from lab.tasks.task_file import load
from lab.toolbox.policy import Policy

AB, BC = CarriedPath("a", "b", "nut"), CarriedPath("b", "c", "tray")
ALONE = (Grasp(load("toast"), "slice", "plate"),)  # a skill, whichever
SKILLS = SkillSet(
    load("toast"),
    NeededMoves((("b", "a"),), (("a", "b"), ("b", "c"))),
    legs={AB: ALONE, BC: ALONE},
    travels={("b", "a"): ALONE},
    processes={"a": (), "b": ALONE},
    services={("nut", "b"): ALONE, ("nut", "c"): ()},
)
MEASURED = Durations({("b", "a"): 2.0}, {AB: 20.5, BC: 21.0}, {"b": 30.0}, {("nut", "b"): 7.5}, 99.0)


def test_durations_survive_json_with_kinds_and_services() -> None:
    record = json.loads(json.dumps(MEASURED.to_json()))
    assert record == {
        "empty_s": {"b > a": 2.0},
        "loaded_s": {"a > b with nut": 20.5, "b > c with tray": 21.0},
        "process_s": {"b": 30.0},
        "service_s": {"nut at b": 7.5},
    }
    assert Durations.from_json(record, SKILLS) == replace(
        MEASURED, sim_s=0.0
    )  # nothing is simulated when they are read


def test_what_a_run_took_is_believed_from_then_on() -> None:
    """The way back took 3 s and 4 s instead of 2: 3.5; what was not carried out keeps what its trial took."""
    slower = MEASURED.after([TimedMove(("b", "a"), 3.0), TimedMove(("b", "a"), 4.0)])
    assert slower.empty_s == {("b", "a"): 3.5}
    assert (slower.loaded_s, slower.service_s) == (MEASURED.loaded_s, MEASURED.service_s)
    assert Durations.from_json(json.loads(json.dumps(slower.to_json())), SKILLS) == replace(slower, sim_s=0.0)
    assert slower.after([TimedMove(("b", "a"), 5.0)]).empty_s == {("b", "a"): 5.0}


@pytest.mark.parametrize(
    ("table", "times", "says"),
    [
        ("empty_s", [1, 2], "empty_s: it is no table of times"),
        ("empty_s", {}, "empty_s: the time of 'b > a' is missing"),
        ("empty_s", {"b > a": 1.0, "zzz": 1.0}, "unknown move or station 'zzz' (empty_s): known: b > a"),
        ("loaded_s", {"a > b with nut": 1.0}, "loaded_s: the time of 'b > c with tray' is missing"),
        ("loaded_s", {"a > b with nut": 1.0, "b > c with tray": -1.0}, "loaded_s 'b > c with tray': -1.0: wanted 0 to 86400 s"),
        ("process_s", {"b": "soon"}, "process_s 'b': 'soon': wanted 0 to 86400 s"),
        ("process_s", {"b": True}, "process_s 'b': True: wanted 0 to 86400 s"),
        ("process_s", {"b": float("inf")}, "process_s 'b': inf: wanted 0 to 86400 s"),
        ("process_s", {"b": 1e300}, "process_s 'b': 1e+300: wanted 0 to 86400 s"),
        ("process_s", {"b": 1.0, "d": 1.0}, "unknown move or station 'd' (process_s): known: b"),
        ("loaded_s", {"c > a": 1.0}, "unknown move or station 'c > a' (loaded_s): known: a > b with nut, b > c with tray"),
        ("service_s", {}, "service_s: the time of 'nut at b' is missing"),
        ("service_s", {"nut at b": -2}, "service_s 'nut at b': -2: wanted 0 to 86400 s"),
    ],
)  # fmt: skip
def test_a_damaged_record_is_refused_in_one_line(table: str, times: Any, says: str) -> None:
    with pytest.raises(BadInput) as caught:
        Durations.from_json(MEASURED.to_json() | {table: times}, SKILLS)
    assert str(caught.value) == says


# ---- the spots that are timed ----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("order", "skill", "used"),
    [
        (("slice",) * 3, "grasp at plate", [0, 1, 2]),
        (("slice",) * 3, "place at finished_plate", [0, 1, 2]),
        (("slice",) * 3, "place at toaster_buffer", [0, 1]),  # one is in the toaster when another one waits
        (("slice",) * 3, "insert at toaster", [0]),
        (("slice",), "place at toaster_buffer", [0]),
        (("slice", "cup", "slice"), "grasp slice at plate", [0, 1]),
        (("slice", "cup", "slice"), "place cup at tray", [0, 1, 2]),  # beside whatever stands there
    ],
)
def test_only_spots_that_the_order_uses_are_timed(order: Order, skill: str, used: list[int]) -> None:
    task = load("breakfast" if "cup" in order else "toast")
    skillset = SkillSet.of(task, order)
    layout = Layout(tuple(o.position_m for o in task.obstacles), ())
    prepared = Prepared(task, order, 0, layout, Surveys(task, order, layout), skillset, {})
    own = skillset.skills[skill]
    spots = places_of(task).spots(task.station(own.station))
    assert list(spots_in_use(prepared, own)) == [spots[number] for number in used]
    assert [trial.at == skill for trial in trials(prepared)].count(True) == (used != [0])


def test_kinds_that_share_a_way_share_the_mean_of_its_parts() -> None:
    """Two slices at 10 s and a cup at 16 s make 12 s."""
    task, order = load("breakfast"), ("slice", "cup", "slice")
    skills = SkillSet.of(task, order)
    loaded = {way: 16.0 if way.kind == "cup" else 10.0 for way in skills.legs}
    shared = CarriedPath("plate", "tray", "slice"), CarriedPath("plate", "tray", "cup")
    cell = cell_of(
        task,
        Durations(dict.fromkeys(skills.travels, 1.0), loaded | dict(zip(shared, (10.0, 16.0), strict=True)), {}),
        order,
    )
    assert cell.loaded_s[cell.index("plate"), cell.index("tray")] == pytest.approx(12.0)


# ---- the key ---------------------------------------------------------------------------------------------------------

MakePolicy = Callable[..., Policy]
LAYOUT = Layout(((0.5, 0.1), (0.6, 0.2)), ((0.0, 0.0, 0.0),))


@pytest.fixture(scope="module")
def task() -> Task:
    return load("toast")


@pytest.fixture
def own_assets(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A checkout whose assets are copies, so that they can be changed."""
    shutil.copytree(lab.files.assets_folder(), tmp_path / "assets", ignore=shutil.ignore_patterns("pictures"))
    (tmp_path / "pyproject.toml").touch()
    monkeypatch.setattr(lab.files, "PACKAGE", tmp_path / "lab")
    return tmp_path / "assets"


Change = Callable[[dict[str, Any]], None]


def edit(name: str, change: Callable[[Any], Any]) -> Change:
    """Another value of one argument of the key."""

    def apply(given: dict[str, Any]) -> None:
        given[name] = change(given[name])

    return apply


def write(old: str, new: str, *where: str) -> Change:
    """Another text in a file of the checkout."""

    def apply(given: dict[str, Any]) -> None:
        path = next(given["folder"].glob("/".join(where)))
        assert old in path.read_text()
        path.write_text(path.read_text().replace(old, new))

    return apply


def slower(task: Task) -> Task:
    return task.model_copy(update={"robot": task.robot.model_copy(update={"speed_m_s": 0.4})})


def shifted(task: Task) -> Task:
    first, *rest = task.stations
    x, y, yaw = first.pose
    return task.model_copy(update={"stations": (first.model_copy(update={"pose": (x + 0.001, y, yaw)}), *rest)})


CHANGES: dict[str, Change] = {
    "a robot's speed": edit("task", slower),
    "a station's place": edit("task", shifted),
    "an order": edit("order", lambda order: (*order, "slice")),
    "an obstacle's place": edit("layout", lambda layout: replace(layout, obstacles=((0.5, 0.1), (0.6, 0.201)))),
    "a move": edit("skillset", lambda skills: replace(skills, moves=replace(skills.moves, empty=()))),
    "what is carried": edit(
        "skillset", lambda skills: replace(skills, legs={AB._replace(kind="bolt"): ALONE, BC: ALONE})
    ),
    "a policy's table": edit("policies", lambda known: {"grasp": replace(known["grasp"], q=known["grasp"].q + 0.5)}),
    "a policy's problem": edit("policies", lambda known: {"grasp": replace(known["grasp"], signature="b" * 16)}),
    "whose policy it is": edit("policies", lambda known: {"place": known["grasp"]}),
    "a URDF": write('name="robot"', 'name="arm"', "assets", "robot.urdf"),
    "a mesh": write("v ", "v  ", "assets", "robot_tool_0.obj"),
    "the lab's own source": edit("source", lambda source: "another"),
    "the physics engine": edit("engine", lambda engine: "pybullet 4.0"),
}


@pytest.mark.parametrize("what", CHANGES)
def test_the_key_changes_with_whatever_decides(
    make_policy: MakePolicy, task: Task, own_assets: Path, monkeypatch: pytest.MonkeyPatch, what: str
) -> None:
    given: dict[str, Any] = {"task": task, "layout": LAYOUT, "skillset": SKILLS, "policies": {"grasp": make_policy()}}
    given |= {"order": ("slice",), "folder": own_assets.parent, "source": "the source", "engine": "pybullet 3.2.7"}

    def key() -> str:
        monkeypatch.setattr(durations, "source_key", lambda module: given["source"])
        monkeypatch.setattr(durations, "engine", lambda: given["engine"])
        return durations_key(given["task"], given["layout"], given["skillset"], given["policies"], given["order"])

    before = key()
    assert key() == before
    CHANGES[what](given)
    assert key() != before


def test_what_decides_nothing_leaves_the_key(make_policy: MakePolicy, task: Task) -> None:
    other = task.model_copy(update={"title": "another", "subtasks": {}})
    moved = replace(LAYOUT, parts=((0.1, 0.0, 0.0),))  # a move is measured with a part on its spot
    key = durations_key(task, LAYOUT, SKILLS, {"grasp": make_policy()}, ("slice",))
    assert durations_key(other, moved, SKILLS, {"grasp": make_policy()}, ("slice",)) == key


def test_the_key_looks_for_no_library_but_the_engine(task: Task, monkeypatch: pytest.MonkeyPatch) -> None:
    """An optional library that is missing cannot change it."""
    monkeypatch.setattr("importlib.metadata.version", lambda name: pytest.fail(f"{name} was looked for"))
    monkeypatch.setattr("importlib.metadata.packages_distributions", lambda: pytest.fail("libraries were looked for"))
    monkeypatch.setattr(durations, "engine", lambda: "pybullet 3.2.7")
    durations_key(task, LAYOUT, SKILLS, {}, ("slice",))


def test_the_key_holds_the_source_of_every_package_that_skills_come_from(
    task: Task, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked = set[str]()
    monkeypatch.setattr(durations, "source_key", lambda module: asked.add(module) or "a")  # type: ignore[func-returns-value]
    durations_key(task, LAYOUT, replace(SKILLS, skills={"grasp": ALONE[0]}), {}, ("slice",))
    assert asked == {"lab.production.durations", "lab.skills.grasp"}
