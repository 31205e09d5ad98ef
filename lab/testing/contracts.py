"""What every member of a family is held to, ours and yours: a function for each family, an AssertionError that says why."""

import json
from dataclasses import asdict, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from lab.advice.advisors import ADVISORS, AdvisorName
from lab.advice.table_level import TableLevel
from lab.learning.gates import GATES, Gate
from lab.learning.requests import Advisor, Ask
from lab.learning.session import Session
from lab.learning.session_events import AdviceRequested, EpisodeEnded, Event
from lab.learning.session_result import SessionResult
from lab.learning.settings import GateSettings, LearnerSettings
from lab.learning.updates import UPDATES, Update
from lab.mdp import TabularMDP, greedy_path, grid, optimal_values, shortest_steps
from lab.mentor.doubts import DOUBTS, Doubt
from lab.mentor.mentor import Mentor
from lab.recordings.episode import Episode, Recording
from lab.sequencing import SEQUENCERS, Find, find_sequence
from lab.sequencing.cell.cell import Cell
from lab.sequencing.methods.exact import optimum
from lab.sequencing.search import EpisodeSequenced, Search, SequenceResult
from lab.sequencing.simulate.follow import simulate
from lab.skills import SKILLS, Skill
from lab.studies import STUDIES, Run, Study, carried_out
from lab.studies.runner import Job
from lab.tasks.task_file import load, load_cell
from lab.teaching.lesson_options import LessonOptions
from lab.teaching.skill_subject import SkillSubject
from lab.toolbox.policy import Origin, Policy


def require(holds: bool, otherwise: str) -> None:
    """Raises an AssertionError with the text `otherwise` unless `holds`, also if Python runs without assertions (-O)."""
    if not holds:
        raise AssertionError(otherwise)


# ---- the contracts of gates, learners and advisors --------------------------------------------------------------------


EARLY = GateSettings(first_episode=5, window=2)
SHORT = LearnerSettings(episodes=60, max_steps=30)
SEEDS = 3


def board(size: int) -> TabularMDP:
    """The problem of a square board with obstacles beside the diagonal; 3 x 3 has one in the middle."""
    blocked = np.zeros((size, size), bool)
    blocked[1, 1] = blocked[size - 2, 1] = True
    return grid((size, size), blocked, (0, 0), (size - 1, size - 1), action_labels=("up", "down", "left", "right"))


def session(
    mdp: TabularMDP, advisor: str | Advisor | Ask | type[Advisor] = "expert", seed: int = 0, **changes: Any
) -> tuple[SessionResult, list[Event]]:
    """The result and the events of a session of 60 episodes; changes: settings of learner and gate."""
    learner = replace(SHORT, **{name: value for name, value in changes.items() if hasattr(SHORT, name)})
    gate = replace(EARLY, **{name: value for name, value in changes.items() if hasattr(EARLY, name)})
    events: list[Event] = []
    name = AdvisorName.of(advisor) if isinstance(advisor, str) else AdvisorName.made(advisor)
    adviser = TableLevel(mdp, learner.discount, np.random.default_rng([seed, 1])).advisor(name)
    result = Session(mdp, learner, gate, adviser, np.random.default_rng(seed)).run(events.append)
    return result, events


def check_learner(learner: str | type[Update]) -> None:
    """Tests a learner, given by name or class: with an expert it solves small boards; its results repeat."""
    name = UPDATES.named(learner)
    for size in (3, 4):
        for seed in range(SEEDS):
            result, _ = session(board(size), seed=seed, learner=name, episodes=100)
            what = f"learner '{name}', board {size} x {size}, seed {seed}, with an expert"
            require(result.solved, f"{what}: the shortest path of {2 * (size - 1)} moves is not learned")
            require(result.helped_steps > 0, f"{what}: no advice was taken")
    for gate in ("always", "ccrl"):
        check_session(name, gate)


def check_gate(gate: str | type[Gate]) -> None:
    """Tests a gate, given by name or class: its results are consistent and repeat, without advice, with it, and with memory."""
    name = GATES.named(gate)
    for learner in ("q", "sarsa-lambda"):
        for memory in (False, True):
            check_session(learner, name, memory=memory)
    alone, _ = session(board(3), "none", gate=name)
    require(alone.helped_steps == alone.requests == 0, f"gate '{name}': with nobody to ask something was asked")
    spent, _ = session(board(3), gate=name, budget=3)
    require(spent.helped_steps <= 3, f"gate '{name}': {spent.helped_steps} helped steps, the budget has 3")


def check_advisor(advisor: str | Advisor | Ask | type[Advisor]) -> None:
    """Tests an advisor, given by name, as a function of a request, or as an object or class with `advise`."""
    if isinstance(advisor, str):
        require(advisor in ADVISORS, f"advisor '{advisor}': it is in no table")
    for size in (3, 4):
        result, events = session(board(size), advisor, gate="always", episodes=20)
        require(result.helped_steps <= int(result.visits.sum()), "more helped steps than steps")
        asked = sum(isinstance(event, AdviceRequested) for event in events)
        require(asked == result.requests, f"{asked} episodes were told to ask, {result.requests} were counted")


def check_doubt(rule: str | type[Doubt]) -> None:
    """Tests a rule of doubt, given by name or class: its numbers repeat, an episode begins it anew, and a file gives it back."""
    name, rng = DOUBTS.named(rule), np.random.default_rng(0)
    what = f"rule '{name}'"
    shown = Recording(10, "cart", ("x", "y"), ("dx", "dy"), [_ride(rng, True) for _ in range(6)])
    rollouts = [_ride(rng, success) for success in (True, False) * 4]
    mentor, again = (Mentor.learn(shown, name, rollouts=rollouts, seed=1) for _ in range(2))
    asked, other = _ride(rng, True), _ride(rng, False)
    doubts = mentor.doubts(asked)
    require(doubts.shape == (len(asked),), f"{what}: {doubts.shape} doubts of {len(asked)} steps")
    require(np.array_equal(doubts, again.doubts(asked)), f"{what}: the same seed gives other doubts")
    for array in mentor.arrays.values():
        require(
            array.dtype == np.float64 and bool(np.isfinite(array).all()),
            f"{what}: {array.dtype}: wanted finite float64",
        )
    if name == "random":  # what it draws goes on from episode to episode
        return
    again.doubts(other)
    require(
        np.array_equal(again.doubts(asked), doubts), f"{what}: it doubts otherwise after another episode: see `begin`"
    )
    with TemporaryDirectory() as folder:
        mentor.save(file := Path(folder, "mentor.safetensors"))
        loaded = Mentor.load(file)
    require(np.array_equal(loaded.doubts(asked), doubts), f"{what}: a file gives other doubts")


def _ride(rng: np.random.Generator, success: bool) -> Episode:
    """A cart that rolls from anywhere near 0 to the right, or fails and rolls back; 20 steps, with plans of two actions."""
    ways = rng.normal(0.1 if success else -0.05, 0.02, (20, 2)).astype(np.float32)
    states = (rng.normal(0.0, 0.1, 2) + np.cumsum(ways, axis=0)).astype(np.float32)
    plans = np.stack([ways, np.roll(ways, -1, axis=0)], axis=1)
    return Episode("go right", states, ways, np.zeros(20, bool), success, extra={"chunk": plans})


def check_session(learner: str, gate: str, memory: bool = False) -> None:
    """Tests that the arrays, counts and events of a session are consistent, and that the same seed repeats them."""
    mdp, what = board(4), f"learner '{learner}', gate '{gate}'{', with memory' if memory else ''}"
    (result, events), (again, events_again) = (
        session(mdp, "limited", 5, learner=learner, gate=gate, memory=memory) for _ in range(2)
    )
    for name, value in asdict(result).items():
        require(np.array_equal(value, getattr(again, name)), f"{what}: the same seed gives another `{name}`")
    require(events == events_again, f"{what}: the same seed tells other events")
    require(result.q.shape == result.visits.shape == mdp.successor.shape, f"{what}: q {result.q.shape}: wanted (S, A)")
    kinds = result.q.dtype.name, result.visits.dtype.name, result.steps.dtype.name
    require(kinds == ("float64", "int64", "int64"), f"{what}: q, visits, steps are {kinds}")
    require(bool(np.isfinite(result.q).all()), f"{what}: an action value is not finite")
    require(not result.q[mdp.terminal].any(), f"{what}: a terminal state has values")
    require(not result.visits[mdp.terminal].any(), f"{what}: a terminal state was left")
    ended = [event for event in events if isinstance(event, EpisodeEnded)]
    require([event.episode for event in ended] == list(range(1, 61)), f"{what}: not every episode was told once")
    require([event.steps for event in ended] == result.steps.tolist(), f"{what}: other steps told than counted")
    require([event.guided for event in ended] == result.guided.tolist(), f"{what}: other guided episodes told")
    helped = sum(event.helped_steps for event in ended)
    require(helped == result.helped_steps, f"{what}: {helped} helped steps told, {result.helped_steps} counted")
    require([event.reached for event in ended] == (result.steps <= 30).tolist(), f"{what}: `reached` does not fit")
    asked = sum(isinstance(event, AdviceRequested) for event in events)
    require(result.requests == asked, f"{what}: {asked} requests told, {result.requests} counted")
    walked = int(result.steps[result.steps <= 30].sum())  # failed episodes walked too
    require(int(result.visits.sum()) >= walked, f"{what}: fewer visits than steps")
    path = greedy_path(result.q, mdp, 30)
    require(
        result.final_steps == (len(path[1]) if path[2] else None), f"{what}: final_steps is not that of the greedy path"
    )


# ---- the contract of sequencing methods -------------------------------------------------------------------------------


NEAR_S = 1e-5
SMALL = ("toast-case-1", "toast-case-2", "toast-case-3")


def check_sequencer(method: str | Find) -> None:
    """Tests a method, given by name or as a function of cell, search and generator, on two toasts in each cell of the thesis."""
    name = method if isinstance(method, str) else SEQUENCERS.use(method.__name__, method)
    for cell in SMALL:
        check_order(name, load_cell(cell).cell(2), seed=1)


def check_order(name: str, cell: Cell, seed: int) -> SequenceResult:
    """The result of a method for a cell, tested: feasible, consistent with its events, and not below the optimum."""
    seen: list[EpisodeSequenced] = []
    result = find_sequence(cell, name, Search(20, on_episode=seen.append), seed)
    cost, what = simulate(cell, result.sequence).makespan_s, f"method '{name}', seed {seed}"
    require(abs(cost - result.cost) <= NEAR_S, f"{what}: its order takes {cost} s, it says {result.cost}")
    best = optimum(cell).cost
    require(result.cost >= best - NEAR_S, f"{what}: {result.cost} s is below the proven optimum, {best} s")
    require(result.cost == min(result.episode_costs), f"{what}: its cost is not that of its best episode")
    told = tuple(event.cost for event in seen)
    require(told == result.episode_costs, f"{what}: {len(told)} episodes told, {len(result.episode_costs)} counted")
    return result


# ---- the contract of skills -------------------------------------------------------------------------------------------


def check_skill(skill: str | type[Skill], task: str = "toast") -> None:
    """Tests a skill, given by sub-task or class, in a task that needs it: PyBullet carries it out with the optimal table."""
    subtask = skill if isinstance(skill, str) else skill.subtask
    if not isinstance(skill, str) and subtask not in SKILLS:
        SKILLS.adopted(subtask, skill, "check_skill")
        try:
            check_skill(subtask, task)
        finally:
            del SKILLS[subtask]
        return
    require(bool(SKILLS[subtask].help), f"skill '{subtask}': it has no `help`")
    subject, again = (SkillSubject.of(LessonOptions(subtask), load(task)) for _ in range(2))
    problem = subject.prepare(0)
    mdp, what = problem.mdp, f"skill '{problem.name}' of '{task}'"
    require(problem.subtask == subtask, f"{what}: its problem is of '{problem.subtask}'")
    require(again.prepare(0).mdp.signature == mdp.signature, f"{what}: the same scene gives another problem")
    require(shortest_steps(mdp) > 0, f"{what}: it begins at its goal")
    q = optimal_values(mdp, 0.99)
    for start in (mdp.start, *mdp.starts):
        require(
            greedy_path(q, mdp, mdp.n_states, start)[2],
            f"{what}: no path to the goal leads from {mdp.state_label(start)}",
        )
    learner, gate = LearnerSettings(episodes=1, max_steps=1), GateSettings("never")
    result = Session(problem.environment or mdp, learner, gate, None, np.random.default_rng(0)).run()
    policy = Policy.of(result, mdp, learner, gate, Origin("best", subtask, task, "none", 0))
    failure = subject.tried(problem, replace(policy, q=q, solved=True))
    require(failure is None, f"{what}: in physics: {failure}")


# ---- the contract of studies ------------------------------------------------------------------------------------------


def check_study(study: str | Study | Run) -> None:
    """Tests a study, given by name, as a `Study`, or as a function of a job and a reading, with its fewest sessions."""
    if isinstance(study, str):
        tested, name = STUDIES[study], study
    else:
        tested = study if isinstance(study, Study) else Study(study.__name__, study, least=2)
        name = tested.title
    first, again = (tested.run(Job(tested.least, seed=1), {}) for _ in range(2))
    require(bool(first.rows), f"study '{name}': it has no rows")
    for row in first.rows:
        require({"measure", "value"} <= {*row}, f"study '{name}': a row has no measure or value: {row}")
        json.dumps(row, allow_nan=False)
    require(first.rows == again.rows, f"study '{name}': the same seed gives other rows")
    with TemporaryDirectory() as folder:
        document = carried_out(tested, "study", Job(tested.least, seed=1), Path(folder) / "out")
        require(all(Path(file).is_file() for file in document["files"].values()), f"study '{name}': a file is missing")
