"""AdviceBench's problems, which `lab teach` knows by name: its own layouts, and the instances of its drawn families.

They come in by the entry point "teaching_lab.problems". The tables themselves are made when a lesson needs one.
"""

from collections.abc import Callable
from dataclasses import replace
from functools import partial

from lab.learning.problem import Problem
from lab.learning.settings import LearnerSettings
from lab.teaching.named_problems import NamedProblem
from lab_studies.comparisons.advice_bench.common_learner import COMMON


def _made(name: str) -> Callable[..., Problem]:
    return partial(_problem, name)


def _problem(name: str, number: int | None = None) -> Problem:
    from lab_studies.comparisons.advice_bench.problems import to_teach

    return to_teach(name, number)


def _layout(name: str, meaning: str, learner: LearnerSettings = COMMON) -> NamedProblem:
    return NamedProblem(meaning, _made(name), learner=learner)


def _family(name: str, meaning: str) -> NamedProblem:
    return NamedProblem(meaning, _made(name), numbered=True, learner=COMMON)


PROBLEMS = {
    "empty": _layout("empty", "MiniGrid's empty room"),
    "door-key": _layout("door-key", "MiniGrid's locked door and its key"),
    "lava": _layout("lava", "MiniGrid's gap in a strip of lava", replace(COMMON, beta=0.7)),
    "far-door": _layout("far-door", "a larger room with a locked door"),
    "four-rooms": _layout("four-rooms", "four rooms and their doors, with MiniGrid's moves"),
    "crossing": _layout("crossing", "MiniGrid's crossing of lava"),
    "toast-order": _layout("toast-order", "the order in which three toasts are moved", replace(COMMON, max_steps=100)),
    "rooms": _family("rooms", "drawn rooms and doors"),
    "hanoi": _family("hanoi", "the towers of Hanoi between two drawn states"),
    "one-way-towns": _family("one-way-towns", "one-way streets with several starts"),
    "windy-grids": _family("windy-grids", "grids with a stochastic wind"),
    "long-mazes": _family("long-mazes", "perfect mazes of about 40 moves"),
    "traps": _family("traps", "deadly cells beside a shortest path"),
    "inventory": _family("inventory", "orders of a shop until enough is sold"),
    "queues": _family("queues", "one server for several queues"),
}
