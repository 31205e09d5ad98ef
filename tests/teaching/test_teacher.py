"""Teaching a skill: found, learned, continued; what was learned is kept whatever happens."""

from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lab.advice.advising import Advising
from lab.errors import BadInput, WorkFailed
from lab.learning.problem import Problem
from lab.learning.requests import AdviceRequest, AdvisorLeft
from lab.learning.session import Session
from lab.learning.session_events import AdviceRejected, EpisodeEnded, Event
from lab.learning.session_result import SessionResult
from lab.learning.settings import GateSettings, LearnerSettings
from lab.mdp import TabularMDP, greedy_path, grid
from lab.teaching.events import AdvisorGathered, LessonEvent, RecordSkipped
from lab.teaching.events import Event as LessonsEvent
from lab.teaching.lesson_plan import MAX_SESSIONS, Interrupted, LessonPlan
from lab.teaching.lesson_sessions import MORE_SESSIONS, WARM_EPISODES, fits, optimistic
from lab.teaching.teacher import Teacher, candidates
from lab.toolbox.fitness import reference
from lab.toolbox.index import KnownPolicies
from lab.toolbox.policy import Policy
from lab.toolbox.registry import Toolbox

QUICK = LearnerSettings(episodes=60, max_steps=40)
HOPELESS = LearnerSettings(episodes=1, max_steps=1)
GATE = GateSettings(first_episode=12)


def problem(name: str = "insert at toaster", columns: int = 4) -> Problem:
    """From one corner of a small board to the other, 1 + columns moves."""
    blocked = np.zeros((3, columns), bool)
    blocked[1, 1] = True
    return Problem(name, "insert", grid(blocked.shape, blocked, (0, 0), (2, columns - 1)))


@pytest.fixture
def teacher(tmp_path: Path) -> Teacher:
    return Teacher(Toolbox(tmp_path / "toolbox"))


def plan(
    learner: LearnerSettings = QUICK, gate: GateSettings = GATE, about: Problem | None = None, **more: Any
) -> LessonPlan:
    return LessonPlan(about or problem(), learner, gate, "toast", **more)


def known(*policies: Policy) -> KnownPolicies:
    return KnownPolicies.of(policies)


def test_a_new_problem_is_learned_kept_and_then_found(teacher: Teacher) -> None:
    lesson = teacher.find_or_teach(plan(), known())
    assert (lesson.source, lesson.policy.solved, lesson.policy.final_steps) == ("learned", True, 5)
    assert lesson.policy.name == f"insert at toaster {problem().mdp.signature[:8]}"
    index, damaged = teacher.toolbox.index()
    assert (len(index), damaged) == (1, [])
    again = teacher.find_or_teach(plan(HOPELESS, about=problem("insert elsewhere")), index)
    assert (again.source, again.result, again.policy.name) == ("reused", None, lesson.policy.name)
    assert np.array_equal(again.policy.q, lesson.policy.q)


def test_a_toolbox_that_may_only_be_read_is_enough_to_learn_nothing(
    teacher: Teacher, monkeypatch: pytest.MonkeyPatch
) -> None:
    teacher.find_or_teach(plan(), known())
    index, _ = teacher.toolbox.index()

    def refused(*_: object, **__: object) -> None:
        raise BadInput("toolbox: cannot be written")

    for method in ("check", "put", "save_record"):
        monkeypatch.setattr(teacher.toolbox, method, refused)
    heard: list[LessonsEvent] = []
    again = replace(teacher, tell=heard.append).find_or_teach(plan(about=problem(columns=4)), index)
    assert (again.source, heard) == ("reused", [])
    elsewhere = problem("insert elsewhere")
    elsewhere = replace(elsewhere, mdp=replace(elsewhere.mdp, reward=elsewhere.mdp.reward * 2))
    other = replace(teacher, tell=heard.append).find_or_teach(plan(about=elsewhere), index)
    (skipped,) = [event for event in heard if isinstance(event, RecordSkipped)]
    assert (other.source, skipped.why) == (
        "reused",
        "what is used for 'insert elsewhere': toolbox: cannot be written",
    )
    with pytest.raises(BadInput, match="cannot be written"):
        teacher.find_or_teach(plan(about=problem(columns=5)), index)


def test_what_another_arm_learned_is_used_but_not_in_silence(teacher: Teacher) -> None:
    first = teacher.find_or_teach(plan(about=replace(problem(), arm="panda")), known())
    assert (first.policy.arm, first.other_arm) == ("panda", "")
    index, _ = teacher.toolbox.index()
    same = teacher.find_or_teach(plan(HOPELESS, about=replace(problem(), arm="panda")), index)
    other = teacher.find_or_teach(plan(HOPELESS, about=replace(problem(), arm="xarm6")), index)
    assert (same.other_arm, same.reason) == ("", "it was learned in exactly this problem")
    assert other.other_arm == "panda"
    assert other.reason == "learned with the arm panda; it was learned in exactly this problem"


def test_another_scene_is_learned_anew(teacher: Teacher) -> None:
    first = teacher.find_or_teach(plan(), known())
    other = teacher.find_or_teach(plan(about=problem(columns=5)), known(first.policy))
    assert other.source == "learned"
    assert len(teacher.toolbox.index()[0]) == 2


def test_an_unfinished_policy_is_learned_on(teacher: Teacher) -> None:
    why = f"'insert at toaster' was not learned in {MAX_SESSIONS} episodes.*what was learned is kept"
    with pytest.raises(WorkFailed, match=why):
        teacher.find_or_teach(plan(HOPELESS), known())
    index, _ = teacher.toolbox.index()
    (unfinished,) = index.values()
    assert (unfinished.solved, len(unfinished.curve), unfinished.visits.sum()) == (False, MAX_SESSIONS, MAX_SESSIONS)
    lesson = teacher.find_or_teach(plan(), index)
    assert (lesson.source, lesson.policy.solved) == ("continued", True)
    assert teacher.toolbox.index()[0].keys() == index.keys()


def test_a_policy_of_another_size_or_with_other_actions_is_not_taken(teacher: Teacher) -> None:
    sound = teacher.find_or_teach(plan(), known()).policy
    q, visits = np.zeros((7, 4)), np.zeros((7, 4), np.int64)
    for wrong in (
        replace(sound, q=q, visits=visits, ends=np.zeros(7, np.uint8), shape=(7,), start=0),
        replace(sound, action_labels=("n", "s", "w", "e")),
    ):
        assert teacher.find_or_teach(plan(), known(wrong)).source == "learned"


# ---- in another scene: the board has an obstacle at (1, 1), others are added ---------------------------------------


def elsewhere(*more: tuple[int, int], name: str = "insert at toaster") -> Problem:
    """The same board with more obstacles."""
    blocked = np.zeros((3, 4), bool)
    for cell in ((1, 1), *more):
        blocked[cell] = True
    return Problem(name, "insert", grid(blocked.shape, blocked, (0, 0), (2, 3)))


def way(policy: Policy) -> list[tuple[int, int]]:
    """The cells of its greedy way."""
    return [divmod(state, 4) for state in greedy_path(policy.q, problem().mdp, 12)[0]]


def test_a_way_that_is_free_in_another_scene_is_used_as_it_is(teacher: Teacher) -> None:
    first = teacher.find_or_teach(plan(), known()).policy
    beside = next((r, c) for r in range(3) for c in range(4) if (r, c) not in {*way(first), (1, 1)})
    about = elsewhere(beside, name="insert elsewhere")
    lesson = teacher.find_or_teach(plan(HOPELESS, about=about), known(first))
    assert (lesson.source, lesson.result, lesson.policy) == ("reused", None, first)
    assert lesson.reason == f"'{first.name}': its path is free and shortest"
    assert (lesson.saved, lesson.parent) == ((60, first.helped_steps), None)
    assert len(teacher.toolbox.list()) == 1  # it is not kept twice


def test_what_was_used_for_a_problem_is_used_for_it_again(teacher: Teacher) -> None:
    first = teacher.find_or_teach(plan(), known()).policy
    beside = next((r, c) for r in range(3) for c in range(4) if (r, c) not in {*way(first), (1, 1)})
    newer = replace(first, name="insert at toaster newer", created="2099-01-01T00:00:00+00:00", signature="0" * 16)
    about = plan(HOPELESS, about=elsewhere(beside))
    assert teacher.find_or_teach(about, known(first)).policy is first
    assert teacher.find_or_teach(about, known(newer, first)).policy is first
    assert Teacher(Toolbox(teacher.toolbox.folder / "other")).find_or_teach(about, known(newer, first)).policy is newer


def test_what_is_in_the_way_is_learned_around(teacher: Teacher) -> None:
    first = teacher.find_or_teach(plan(), known()).policy
    about = elsewhere(way(first)[3])
    lesson = teacher.find_or_teach(plan(about=about), known(first))
    assert (lesson.source, lesson.policy.solved, lesson.policy.final_steps) == ("adapted", True, 5)
    assert lesson.reason.startswith(f"'{first.name}': its path meets what is in the way at {way(first)[3]}; 1 of 12")
    assert lesson.result is not None
    assert (len(lesson.result.steps), lesson.result.helped_steps) == (WARM_EPISODES, 0)  # alone, and no longer
    assert lesson.saved == (60 - WARM_EPISODES, first.helped_steps)
    kept = teacher.toolbox.find("insert", about.mdp.signature)
    assert kept is not None
    assert (kept.parent, len(kept.curve), kept.helped_steps) == (
        reference(first),
        WARM_EPISODES,
        0,
    )  # its history is its own
    assert not fits(first.q, about, QUICK)
    assert fits(kept.q, about, QUICK)


def test_who_does_not_get_there_alone_goes_on_as_any_learner(teacher: Teacher, monkeypatch: pytest.MonkeyPatch) -> None:
    first = teacher.find_or_teach(plan(), known()).policy
    about = elsewhere(way(first)[3])
    monkeypatch.setattr("lab.teaching.lesson_sessions.warm_start", lambda *_: np.zeros((12, 4)))
    short = LearnerSettings(episodes=3, max_steps=6)
    lesson = teacher.find_or_teach(plan(short, about=about), known(first))
    assert lesson.result is not None
    assert (lesson.source, len(lesson.result.steps) > 3) == ("adapted", True)
    assert fits(lesson.policy.q, about, QUICK)


def test_a_warm_table_is_never_given_up_for_a_worse_one(teacher: Teacher, monkeypatch: pytest.MonkeyPatch) -> None:
    first = teacher.find_or_teach(plan(), known()).policy
    about = elsewhere(way(first)[3])
    scripted(monkeypatch, [np.zeros((12, 4))])
    policy = teacher.find_or_teach(plan(about=about), known(first)).policy
    assert (policy.solved, policy.final_steps) == (True, 5)
    assert fits(policy.q, about, QUICK)


def test_what_fails_in_physics_is_refused_and_learned(teacher: Teacher) -> None:
    first = teacher.find_or_teach(plan(), known()).policy
    beside = next((r, c) for r in range(3) for c in range(4) if (r, c) not in {*way(first), (1, 1)})
    tried: list[str] = []

    def trial(problem: Problem, policy: Policy) -> str | None:
        tried.append(policy.name)
        return "it slipped" if policy is first else None

    lesson = replace(teacher, trial=trial).find_or_teach(plan(about=elsewhere(beside)), known(first))
    assert tried == [first.name, lesson.policy.name]
    assert (lesson.source, lesson.failure) == ("learned", None)
    assert lesson.reason == f"'{first.name}': in physics, it slipped"


def test_what_another_task_left_is_named_by_it(teacher: Teacher) -> None:
    """Learned for toast; found for breakfast in the same board, with an obstacle beside its way, and with one on it."""
    first = teacher.find_or_teach(plan(), known())
    assert first.from_task == ""
    for_breakfast, found = partial(replace, task="breakfast"), known(first.policy)
    beside = next((r, c) for r in range(3) for c in range(4) if (r, c) not in {*way(first.policy), (1, 1)})
    lessons = [
        teacher.find_or_teach(for_breakfast(plan(about=about)), found)
        for about in (problem(), elsewhere(beside), elsewhere(way(first.policy)[3]))
    ]
    assert [(one.source, one.from_task) for one in lessons] == [
        ("reused", "toast"),
        ("reused", "toast"),
        ("adapted", "toast"),
    ]
    assert lessons[0].reason == "it was learned in exactly this problem of task 'toast'"
    assert all(one.reason.startswith(f"'{first.policy.name}' of task 'toast': its path ") for one in lessons[1:])
    assert lessons[2].policy.task == "breakfast"


def test_candidates_are_solved_and_those_of_the_same_skill_come_first(teacher: Teacher) -> None:
    first = teacher.find_or_teach(plan(), known()).policy
    stamp = "2026-01-0{}T00:00:00+00:00".format
    made = [
        replace(first, name=name, created=stamp(day), solved=solved, signature=f"{day}" * 16)
        for day, (name, solved) in enumerate(
            [("insert at toaster old", True), ("other old", True), ("other new", True), ("insert at toaster", False)], 1
        )
    ]
    found = known(*made, replace(first, subtask="grasp", signature="f" * 16))
    names = [one.name for one in candidates(found, problem())]
    assert names == ["insert at toaster old", "other new", "other old"]
    assert next(candidates(found, problem(), first="other old")).name == "other old"


def detour(teacher: Teacher) -> Policy:
    """A policy that reaches the goal, in 7 moves instead of 5."""
    board = problem().mdp
    q = np.zeros((board.n_states, board.n_actions))
    state = board.start
    for action in (3, 3, 3, 1, 2, 1, 3):
        q[state, action] = 1.0
        state = int(board.successor[state, action])
    assert board.goal[state]
    half = teacher.teach(plan(HOPELESS, sessions=1)).policy
    longer = replace(half, q=q, final_steps=7)
    teacher.toolbox.save(longer)
    return longer


def test_a_way_that_is_not_the_shortest_is_learned_on_until_it_is(teacher: Teacher) -> None:
    longer = detour(teacher)
    lesson = teacher.find_or_teach(plan(), known(longer))
    assert (lesson.source, lesson.policy.solved, lesson.policy.final_steps) == ("continued", True, 5)
    index, _ = teacher.toolbox.index()
    assert teacher.find_or_teach(plan(), index).source == "reused"


def test_the_longer_way_is_followed_when_no_shorter_one_is_found(teacher: Teacher) -> None:
    longer = detour(teacher)
    for tries in (1, 2):
        (kept,) = teacher.toolbox.index()[0].values()
        lesson = teacher.find_or_teach(plan(HOPELESS), known(kept))
        assert lesson.result is not None
        assert (lesson.source, len(lesson.result.steps), lesson.policy.final_steps) == ("continued", MORE_SESSIONS, 7)
        assert (lesson.policy.solved, len(lesson.policy.curve)) == (False, 1 + tries * MORE_SESSIONS)
        assert np.array_equal(lesson.policy.q, longer.q)  # what was measured with it still holds


def scripted(monkeypatch: pytest.MonkeyPatch, tables: "list[np.ndarray[Any, Any]]", solved: bool = False) -> list[Any]:
    """Sessions that end with these tables; returns the start tables that they were given."""
    began: list[Any] = []

    class Scripted(Session):
        def __init__(self, mdp: TabularMDP, *args: Any):
            super().__init__(mdp, HOPELESS, GATE, None, np.random.default_rng(0))
            began.append(args[-1])

        def run(self, on_event: Any = None, enough: Any = None) -> SessionResult:
            q = tables[len(began) - 1]
            moves = greedy_path(q, self.mdp, 40)
            return replace(super().run(), q=q, final_steps=len(moves[1]) if moves[2] else None, solved=solved)

    monkeypatch.setattr("lab.teaching.lesson_sessions.Session", Scripted)
    return began


def test_a_worse_table_never_replaces_a_better_one(teacher: Teacher, monkeypatch: pytest.MonkeyPatch) -> None:
    longer = detour(teacher)
    lost = np.zeros_like(longer.q)
    scripted(monkeypatch, [lost, longer.q, *[lost] * MORE_SESSIONS])
    policy = teacher.teach(plan()).policy
    assert (policy.final_steps, policy.solved, policy.q is longer.q) == (7, False, True)
    scripted(monkeypatch, [lost])
    policy = teacher.teach(plan(unfinished=longer, sessions=1)).policy
    assert (policy.final_steps, policy.q is longer.q) == (7, True)


def test_once_it_fits_shorter_ways_are_looked_for_alone_from_optimistic_values(
    teacher: Teacher, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The one move that each scripted session makes is known by then; any other may be as good as the goal."""
    longer = detour(teacher)
    began = scripted(monkeypatch, [longer.q] * (1 + MORE_SESSIONS))
    heard: list[Any] = []
    result = replace(teacher, tell=heard.append).teach(plan()).result
    assert result is not None
    assert sum(isinstance(event, AdvisorGathered) for event in heard) == 1  # nobody is asked again
    assert (began[0], len(began)) == (None, 1 + MORE_SESSIONS)
    tried = result.visits > 0
    assert (began[-1][~tried & ~problem().mdp.terminal[:, None]] == 1.5).all()
    assert (began[-1][tried] < 1.5).all()


def test_optimistic_values_by_hand() -> None:
    """In a corridor of 4 cells the first move was made: it is worth a step and then, discounted, the best that can be."""
    corridor = grid((1, 4), np.zeros((1, 4), bool), (0, 0), (0, 3))  # -0, +0, left, right
    nothing = np.zeros((4, 4), bool)
    assert (optimistic(corridor, nothing, 0.5) == 1.5).all()
    tried = nothing.copy()
    tried[0, 3] = tried[2, 3] = True
    values = optimistic(corridor, tried, 0.5)
    assert values[0].tolist() == [1.5, 1.5, 1.5, -0.1 + 0.5 * 1.5]
    assert values[2].tolist() == [1.5, 1.5, 1.5, 1.5]  # it entered the goal
    tried[0] = tried[1] = True  # all around the start is known: the first three moves stay there or in cell 1
    values = optimistic(corridor, tried, 0.5)
    assert values[1, 3] == pytest.approx(-0.1 + 0.5 * 1.5)
    assert values[0, 3] == pytest.approx(-0.1 + 0.5 * 0.65)


def test_going_on_keeps_the_history(teacher: Teacher) -> None:
    half = teacher.teach(plan(HOPELESS, GateSettings("always"), sessions=1)).policy
    assert (half.curve, half.guided, half.helped_steps, half.requests) == ([2], [True], 1, 1)
    lesson = teacher.teach(plan(QUICK, GateSettings("always"), unfinished=half, sessions=1))
    policy, now = lesson.policy, lesson.result
    assert now is not None
    assert policy.curve == [2, *now.steps.tolist()]
    assert policy.guided == [True, *now.guided.tolist()]
    assert (policy.helped_steps, policy.requests) == (1 + now.helped_steps, 1 + now.requests)
    assert np.array_equal(policy.visits, half.visits + now.visits)
    assert lesson.source == "continued"


def test_the_unfinished_one_is_found_also_beside_a_finished_one(teacher: Teacher) -> None:
    assert teacher.unfinished(problem()) is None
    half = teacher.teach(plan(HOPELESS, sessions=1)).policy
    found = teacher.unfinished(problem())
    assert found is not None
    assert found.name == half.name
    teacher.teach(plan())
    assert teacher.unfinished(problem()) is None
    beside = teacher.teach(plan(HOPELESS, sessions=1)).policy
    found = teacher.unfinished(problem())
    assert found is not None
    assert found.name == beside.name == f"{half.name} unfinished"
    done = teacher.teach(plan(unfinished=found)).policy
    assert (done.solved, done.curve[0]) == (True, 2)
    assert [row["name"] for row in teacher.toolbox.list()] == [half.name]


def test_who_left_or_was_rejected_is_not_asked_in_further_sessions(tmp_path: Path) -> None:
    asked: list[AdviceRequest] = []

    def leave(request: AdviceRequest) -> int:
        asked.append(request)
        raise AdvisorLeft

    teacher = Teacher(Toolbox(tmp_path), Advising.of(("terminal",), {"terminal": leave}))
    for times in (1, 2):  # each skill asks once
        with pytest.raises(WorkFailed):
            teacher.find_or_teach(plan(HOPELESS, GateSettings("always"), problem(columns=3 + times)), known())
        assert len(asked) == times

    def stay(request: AdviceRequest) -> int:
        asked.append(request)
        return 0  # into the wall

    heard: list[LessonsEvent] = []
    wary = GateSettings(first_episode=5, window=2, omega=0, lambda_threshold=1.0)
    short = LearnerSettings(episodes=8, max_steps=2)
    asked.clear()
    teacher = Teacher(Toolbox(tmp_path), Advising.of(("terminal",), {"terminal": stay}), tell=heard.append)
    with pytest.raises(WorkFailed):
        teacher.find_or_teach(plan(short, wary, problem(columns=6)), known())
    assert sum(isinstance(event, AdviceRejected) for _, event in told(heard)) == 1
    assert {request.episode for request in asked} == {5}


def told(heard: list[LessonsEvent]) -> list[tuple[str, Event]]:
    """What sessions told, and of which lesson."""
    return [(event.lesson, event.event) for event in heard if isinstance(event, LessonEvent)]


class Person:
    """Answers like the learner itself and presses Ctrl-C at the given question."""

    def __init__(self, patience: int) -> None:
        self.left = patience

    def __call__(self, request: AdviceRequest) -> int:
        self.left -= 1
        if self.left < 0:
            raise KeyboardInterrupt
        return request.own


def test_ctrl_c_keeps_what_was_learned_and_the_next_run_goes_on(tmp_path: Path) -> None:
    toolbox = Toolbox(tmp_path)
    with pytest.raises(Interrupted) as stopped:
        Teacher(toolbox, Advising.of(("terminal",), {"terminal": Person(50)})).teach(plan(gate=GateSettings("always")))
    assert isinstance(stopped.value, KeyboardInterrupt)
    index, _ = toolbox.index()
    (kept,) = index.values()
    assert 0 < len(kept.curve) < 50
    # advice counts once its episode is over; what was learned is all kept
    assert (0 < kept.helped_steps < 50, kept.requests) == (True, len(kept.curve))
    assert (kept.visits.sum(), kept.advisor) == (50, "terminal")
    after = f"after {len(kept.curve)} episodes of 'insert at toaster'"
    assert str(stopped.value) == f"stopped by Ctrl-C {after}; what was learned is kept"
    on = Teacher(toolbox).find_or_teach(plan(), index)
    assert on.source in ("continued", "reused")
    assert fits(on.policy.q, problem(), QUICK)


def test_the_unfinished_never_replaces_the_finished(teacher: Teacher) -> None:
    done = teacher.teach(plan()).policy
    half = teacher.teach(plan(HOPELESS, sessions=1)).policy
    assert (done.solved, half.solved, half.name) == (True, False, f"{done.name} unfinished")
    assert [row["name"] for row in teacher.toolbox.list()] == [done.name, half.name]
    found = teacher.toolbox.find("insert", done.signature)
    assert found is not None
    assert found.name == done.name
    again = teacher.teach(plan()).policy
    assert again.name == done.name


def test_a_name_of_ones_own_is_used_as_it_is(teacher: Teacher) -> None:
    assert teacher.teach(plan(HOPELESS, name="mine", sessions=1)).policy.name == "mine"
    assert teacher.teach(plan(name="mine")).policy.name == "mine"
    assert [row["solved"] for row in teacher.toolbox.list()] == [True]


def test_a_long_skill_name_fits(teacher: Teacher) -> None:
    long = problem(f"transfer {'a' * 40} to {'b' * 40} with slice")
    teacher.teach(plan(about=long))
    name = teacher.teach(plan(HOPELESS, about=long, sessions=1)).policy.name
    assert name.endswith(f"{long.mdp.signature[:8]} unfinished")


def test_several_sessions_are_one_lesson(teacher: Teacher) -> None:
    slow = LearnerSettings(episodes=2, max_steps=8)
    heard: list[LessonsEvent] = []
    lesson = replace(teacher, tell=heard.append).teach(plan(slow))
    assert lesson.result is not None
    episodes = len(lesson.result.steps)
    assert episodes in (4, 6, 8, 10, 12)
    assert lesson.policy.curve == lesson.result.steps.tolist()
    assert len(lesson.policy.guided) == episodes
    ended = [(name, event.episode) for name, event in told(heard) if isinstance(event, EpisodeEnded)]
    assert ended == [("insert at toaster", n % 2 + 1) for n in range(episodes)]
    assert lesson.policy.visits.sum() >= episodes


def test_the_seed_and_the_skill_decide_what_is_learned(tmp_path: Path) -> None:
    def table(seed: int, name: str = "insert at toaster") -> list[float]:
        teacher = Teacher(Toolbox(tmp_path), seed=seed)
        q: list[float] = teacher.teach(plan(about=problem(name))).policy.q.ravel().tolist()
        return q

    assert table(1) == table(1)
    assert table(1) != table(2)
    assert table(1) != table(1, "insert at oven")
