"""The contracts of learners, gates and advisors, tested in sessions on small boards."""

from collections.abc import Callable
from dataclasses import asdict, replace
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
from lab.mdp import TabularMDP, greedy_path, grid
from lab.testing.requirement import require

EARLY = GateSettings(first_episode=5, window=2)
SHORT = LearnerSettings(episodes=60, max_steps=30)
SEEDS = 3


def board(size: int) -> TabularMDP:
    """The problem of a square board with obstacles beside the diagonal; 3 x 3 has one in the middle."""
    blocked = np.zeros((size, size), bool)
    blocked[1, 1] = blocked[size - 2, 1] = True
    return grid((size, size), blocked, (0, 0), (size - 1, size - 1), action_labels=("up", "down", "left", "right"))


def session(
    mdp: TabularMDP, advisor: str | Advisor | Ask = "expert", seed: int = 0, **changes: Any
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


def check_advisor(advisor: str | Advisor | Ask | Callable[[], Advisor]) -> None:
    """Tests an advisor, given by name, as a function of a request, or as an object or class with `advise`."""
    if isinstance(advisor, str):
        require(advisor in ADVISORS, f"advisor '{advisor}': it is in no table")
    made: Any = advisor() if isinstance(advisor, type) else advisor
    for size in (3, 4):
        result, events = session(board(size), made, gate="always", episodes=20)
        require(result.helped_steps <= int(result.visits.sum()), "more helped steps than steps")
        asked = sum(isinstance(event, AdviceRequested) for event in events)
        require(asked == result.requests, f"{asked} episodes were told to ask, {result.requests} were counted")


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
