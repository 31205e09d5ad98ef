"""Single commands: a teaching session in a sub-task or a world."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lab.advice.advising import Advising
from lab.advice.entries import read_journal
from lab.errors import BadInput
from lab.learning.requests import AdviceRequest
from lab.learning.settings import GateSettings, LearnerSettings
from lab.skills import Skill
from lab.skills.skillset import SkillSet
from lab.tasks.grid_world import AdvisorView, GridWorld
from lab.tasks.task import Task
from lab.tasks.task_file import load
from lab.teaching.lesson import one_lesson, teach
from lab.teaching.lesson_options import LessonOptions
from lab.teaching.lesson_plan import Interrupted
from lab.teaching.skill_subject import SkillSubject, find_skill
from lab.teaching.teacher import Teacher
from lab.teaching.world_subject import WorldSubject
from lab.toolbox.registry import Toolbox
from lab.vision import read_picture


@pytest.fixture(scope="module")
def task() -> Task:
    return load("toast")


@pytest.fixture
def teacher(tmp_path: Path) -> Teacher:
    return Teacher(Toolbox(tmp_path / "toolbox"))


def teach_skill(
    task: Task, subtask: str, teacher: Teacher, name: str | None = None, out: Path | None = None, **changes: Any
) -> dict[str, Any]:
    return one_lesson(SkillSubject.of(LessonOptions(subtask, **changes), task), teacher, name, out)


# ---- teach --------------------------------------------------------------------------------------------------------

TEACH_FIELDS = (
    *("subtask", "skill", "task", "learner", "gate", "advisor", "memory", "seed", "episodes", "steps_per_episode"),
    *("guided_episodes", "requests", "helped_steps", "misleads", "rejected_at_episode", "optimal_steps"),
    *("final_steps", "steps_are_means", "solved", "failure", "source", "saved_as", "files"),
)


def test_one_session_with_pictures(task: Task, teacher: Teacher, tmp_path: Path) -> None:
    document = teach_skill(task, "insert", teacher, out=tmp_path / "out")
    assert tuple(document) == TEACH_FIELDS
    assert (document["skill"], document["episodes"], len(document["steps_per_episode"])) == (
        "insert at toaster",
        200,
        200,
    )
    assert (document["solved"], document["final_steps"]) == (True, document["optimal_steps"])
    assert document["guided_episodes"][0] == 11
    assert document["helped_steps"] > 0
    assert document["files"].keys() == {"learning_curve", "value_map"}
    assert all(min(read_picture(Path(path)).shape[:2]) > 200 for path in document["files"].values())
    (row,) = teacher.toolbox.list()
    assert (row["name"], row["solved"], row["episodes"]) == (document["saved_as"], True, 200)


def test_options_change_the_session(task: Task, teacher: Teacher) -> None:
    document = teach_skill(
        task, "butter at butter_applier", teacher, learner="sarsa", gate="never", episodes=7, name="mine"
    )
    assert {name: document[name] for name in ("learner", "gate", "episodes", "requests", "saved_as", "files")} == {
        "learner": "sarsa",
        "gate": "never",
        "episodes": 7,
        "requests": 0,
        "saved_as": "mine",
        "files": {},
    }
    assert teacher.toolbox.show("mine")["learner"]["learner"] == "sarsa"


def test_a_taught_grasp_is_tried_in_physics(task: Task, teacher: Teacher) -> None:
    good = teach_skill(task, "grasp", teacher)
    assert (good["solved"], good["failure"]) == (True, None)
    bad = teach_skill(task, "grasp", teacher, episodes=1)
    assert bad["solved"] is False
    assert "does not reach its goal" in bad["failure"]
    assert bad["saved_as"] == f"{good['saved_as']} unfinished"


def test_ctrl_c_keeps_the_session(task: Task, tmp_path: Path) -> None:
    def ask(_: object) -> int:
        raise KeyboardInterrupt

    teacher = Teacher(Toolbox(tmp_path), Advising.of(("terminal",), {"terminal": ask}))
    with pytest.raises(Interrupted, match="stopped by Ctrl-C after 10 episodes of 'insert at toaster'"):
        teach_skill(task, "insert", teacher, out=tmp_path / "out")
    (row,) = teacher.toolbox.list()
    assert (row["episodes"], row["solved"]) == (10, False)
    assert not (tmp_path / "out").exists()


def test_an_interrupted_session_is_gone_on_with(task: Task, tmp_path: Path) -> None:
    def ask(_: object) -> int:
        raise KeyboardInterrupt

    toolbox = Toolbox(tmp_path)
    with pytest.raises(Interrupted):
        teach_skill(task, "insert", Teacher(toolbox, Advising.of(("terminal",), {"terminal": ask})))
    again = teach_skill(task, "insert", Teacher(toolbox))
    assert again["episodes"] == 200
    (row,) = toolbox.list()
    assert (row["name"], row["episodes"], row["solved"]) == (again["saved_as"], 10 + 200, again["solved"])


def test_a_name_of_another_problem_is_refused(task: Task, teacher: Teacher) -> None:
    for _ in range(2):  # its own name may be used again
        teach_skill(task, "butter", teacher, episodes=1, name="mine")
    with pytest.raises(BadInput, match=r"policy name 'mine' .--save.: it is the name of a policy for 'cover'"):
        teach_skill(task, "insert", teacher, name="mine")
    (row,) = teacher.toolbox.list()
    assert (row["subtask"], row["episodes"]) == ("cover", 2)


def test_a_grasp_that_lifts_nothing_is_not_kept_as_solved(
    task: Task, teacher: Teacher, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("lab.skills.trial.try_out", lambda *_: "slice 1 is not in the gripper")
    bad = teach_skill(task, "grasp", teacher)
    assert (bad["solved"], bad["failure"]) == (False, "slice 1 is not in the gripper")
    assert [(row["name"], row["solved"]) for row in teacher.toolbox.list()] == [(bad["saved_as"], False)]
    monkeypatch.undo()
    good = teach_skill(task, "grasp", teacher)
    assert [(row["name"], row["solved"]) for row in teacher.toolbox.list()] == [(good["saved_as"], True)]
    monkeypatch.setattr("lab.skills.trial.try_out", lambda *_: "slice 1 is not in the gripper")
    worse = teach_skill(task, "grasp", teacher)
    assert worse["saved_as"] == f"{good['saved_as']} unfinished"
    assert {row["name"]: row["solved"] for row in teacher.toolbox.list()} == {
        good["saved_as"]: True,
        worse["saved_as"]: False,
    }


def test_a_journal_says_solved_only_after_the_trial_in_physics(
    task: Task, teacher: Teacher, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The grasp of a slice as slippery as wet ice, which nobody refuses, lifts nothing: journal and toolbox say the same."""
    monkeypatch.setattr("lab.sim.scene.scene_check.held", lambda robot, *_: robot)
    ice = task.changed(parts=(task.parts[0].model_copy(update={"friction": 0.001}),))
    options = LessonOptions("grasp", advisors=("expert",))
    document = teach(SkillSubject.of(options, ice), options, teacher, tmp_path / "lesson")
    assert (document["solved"], document["final_steps"]) == (False, document["optimal_steps"])
    assert document["failure"] is not None
    closed = read_journal(tmp_path / "lesson", "DIR").closed
    (row,) = teacher.toolbox.list()
    assert closed is not None
    assert (closed.solved, closed.saved_as) == (row["solved"], row["name"]) == (False, document["saved_as"])


def test_ctrl_c_while_a_grasp_is_tried_keeps_it_unsolved(
    task: Task, teacher: Teacher, monkeypatch: pytest.MonkeyPatch
) -> None:
    def stop(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("lab.skills.trial.try_out", stop)
    with pytest.raises(KeyboardInterrupt):
        teach_skill(task, "grasp", teacher)
    (row,) = teacher.toolbox.list()
    assert (row["solved"], row["final_steps"]) == (False, row["optimal_steps"])


@pytest.mark.parametrize(
    ("subtask", "options", "reason"),
    [
        ("inser", {}, "unknown sub-task 'inser' .SUBTASK.: did you mean 'insert'. known: cover, grasp, insert, place"),
        (
            "grasp at plat",
            {},
            "did you mean 'grasp at plate'. .* or one skill's full name, such as 'grasp at plate', or",
        ),
        ("wrld-1", {}, "did you mean 'world-1'. .*, or a world: class-hurry, .*world-1"),
        ("insert", {"learner": "x"}, "unknown learner 'x' .--learner."),
        ("insert", {"gate": "x"}, "unknown gate 'x' .--gate."),
        ("insert", {"name": " "}, "policy name ' ' .--save.: wanted 1 to 100 printable characters"),
    ],
)
def test_bad_words_are_refused_before_the_scene_is_surveyed(
    task: Task, teacher: Teacher, monkeypatch: pytest.MonkeyPatch, subtask: str, options: dict[str, Any], reason: str
) -> None:
    monkeypatch.setattr("lab.teaching.skill_subject.prepare", lambda *_: pytest.fail("surveyed"))
    with pytest.raises(BadInput, match=reason):
        teach_skill(task, subtask, teacher, **options)
    assert not teacher.toolbox.folder.exists()


# ---- teach a world ------------------------------------------------------------------------------------------------


@pytest.fixture
def world() -> GridWorld:
    """Five by four cells; the limited view are the two lower rows, with the goal."""
    return GridWorld(
        name="small",
        shape=(5, 4),
        start=(0, 0),
        goal=(4, 3),
        obstacles=((1, 1), (3, 2)),
        view=AdvisorView(lower=(3, 0), upper=(4, 3)),
        learner=LearnerSettings(learner="q", episodes=60, max_steps=60),
        gate=GateSettings(gate="always"),
    )


def test_a_world_is_learned_and_drawn(world: GridWorld, teacher: Teacher, tmp_path: Path) -> None:
    document = one_lesson(WorldSubject(world), teacher, out=tmp_path / "out")
    assert tuple(document) == (*TEACH_FIELDS, "view")
    names = ("subtask", "skill", "task", "view", "learner", "gate")
    assert [document[name] for name in names] == ["world", "small", "small", "full", "q", "always"]
    assert (document["solved"], document["final_steps"], document["failure"]) == (True, 7, None)
    assert document["files"].keys() == {"learning_curve", "value_map"}
    assert all(min(read_picture(Path(path)).shape[:2]) > 200 for path in document["files"].values())
    (row,) = teacher.toolbox.list()
    assert (row["name"], row["subtask"], row["solved"]) == (document["saved_as"], "world", True)


def test_options_change_how_a_world_is_learned(world: GridWorld, teacher: Teacher) -> None:
    changed = world.changed(learner="sarsa", gate="never", episodes=7)
    document = one_lesson(WorldSubject(changed), teacher, "mine")
    told = [document[name] for name in ("learner", "gate", "episodes", "requests", "saved_as", "files")]
    assert told == ["sarsa", "never", 7, 0, "mine", {}]
    with pytest.raises(BadInput, match=r"policy name 'mine' .--save.: it is the name of a policy for 'world'"):
        one_lesson(WorldSubject(world.model_copy(update={"goal": (4, 0)})), teacher, "mine")


def test_with_a_limited_view_a_person_is_asked_inside_it_only(world: GridWorld, tmp_path: Path) -> None:
    asked: dict[str, set[int]] = {"full": set(), "limited": set()}
    for view, states in asked.items():

        def ask(request: AdviceRequest, states: set[int] = states) -> int | None:
            states.add(request.state)
            return request.own

        teacher = Teacher(Toolbox(tmp_path / view), Advising.of(("terminal",), {"terminal": ask}))
        one_lesson(WorldSubject(world, view), teacher)
    region = set(np.flatnonzero(world.region()).tolist())
    assert world.mdp().start in asked["full"]
    assert asked["limited"] & region == asked["limited"] != set()


def test_with_a_limited_view_simulated_advice_helps_less(world: GridWorld, teacher: Teacher) -> None:
    once = world.changed(episodes=1)
    full = one_lesson(WorldSubject(once), teacher)
    limited = one_lesson(WorldSubject(once, "limited"), teacher, "limited")
    assert (full["view"], full["helped_steps"]) == ("full", 7)  # the expert leads all the way
    assert (limited["view"], limited["helped_steps"] < 7) == ("limited", True)


def test_a_view_that_is_none(world: GridWorld) -> None:
    with pytest.raises(BadInput, match=r"^unknown sight 'part' .--sight.: known: full, limited$"):
        WorldSubject(world, "part")
    with pytest.raises(BadInput, match=r"^sight 'limited' .--sight.: the file of world 'small' has no \[view\]$"):
        WorldSubject(world.model_copy(update={"view": None}), "limited")


@pytest.mark.parametrize(
    ("word", "name"),
    [
        ("grasp", "grasp at plate"),
        ("grasp at toaster", "grasp at toaster"),
        ("cover", "butter at butter_applier"),
        ("butter", "butter at butter_applier"),
        ("butter at butter_applier", "butter at butter_applier"),
    ],
)
def test_a_skill_by_its_name_the_first_of_a_sub_task_or_by_its_process(task: Task, word: str, name: str) -> None:
    skills: dict[str, Skill] = SkillSet.of(task, ("slice",)).skills
    assert find_skill(skills, word).name == name


def test_of_several_kinds_a_skill_is_named_with_its_own() -> None:
    breakfast = load("breakfast")
    skills = SkillSet.of(breakfast, breakfast.order()).skills
    assert find_skill(skills, "grasp").name == "grasp slice at plate"
    assert find_skill(skills, "grasp cup at shelf").name == "grasp cup at shelf"
    with pytest.raises(BadInput, match="did you mean 'grasp cup at shelf'"):
        find_skill(skills, "grasp cup at shef")


def test_as_many_parts_as_both_ends_hold(task: Task) -> None:
    few = tuple(s.model_copy(update={"capacity": 2}) if s.name == "finished_plate" else s for s in task.stations)
    small = task.changed(stations=few)
    breakfast = load("breakfast")  # its tray holds eight, one of them a cup
    assert breakfast.fitting(9) == (*["slice"] * 7, "cup")
    assert [task.fitting(3), small.fitting(3), small.fitting(1)] == [("slice",) * n for n in (3, 2, 1)]
