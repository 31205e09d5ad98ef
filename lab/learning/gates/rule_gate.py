"""`RuleGate`, the base class of gates whose decisions are two plain functions, which the kernel compiles for many sessions."""

from typing import Any, NamedTuple

import numpy as np

from lab.errors import BadInput, shortened
from lab.learning.gates.gate import ASKS_BY_RULE, OPENS_BY_RULE, CompiledGate, Gate, Steps, Surroundings, Values
from lab.learning.selection import Draw
from lab.learning.settings import GateSettings


class GateNow(NamedTuple):
    """The numbers that the rules of a gate may read besides the episodes' steps and the values of a state.

    episode: the current one, from 1; episodes, max_steps: of the session, as in `LearnerSettings`; helped_steps: the answers of
    the session so far; u: a uniform number in [0, 1), which is drawn for each call.
    """

    episode: int
    episodes: int
    max_steps: int
    helped_steps: int
    u: float


class RuleGate(Gate):
    """The base class of gates that decide by `opens_rule` and `asks_rule`, which the kernel compiles for many sessions at once.

    opens_rule: a static method, called as opens_rule(episode, steps, now, settings) before each episode, which returns whether
    that may ask; steps: as in `Gate.opens`. asks_rule: a static method, called as asks_rule(state, values, now, settings) in each
    step of an open episode, which returns whether the learner asks; values: (A,), as in `Gate.asks`.
    now: a `GateNow`; settings: the numbers of `GateSettings`, by name. A rule that is left out returns True. Both are written in
    the Python that numba compiles, make no list and no array, change nothing, and return True or False.
    A subclass that overrides another method runs in the session only. Raises BadInput, which names the rule, for another answer.

        >>> import lab
        >>> class Unsure(lab.RuleGate):
        ...     '''Asks where the values lie within psi of each other, in the first half of the session.'''
        ...     @staticmethod
        ...     def opens_rule(episode, steps, now, settings):
        ...         return 2 * episode <= now.episodes
        ...     @staticmethod
        ...     def asks_rule(state, values, now, settings):
        ...         return max(values) - min(values) <= settings.psi
        >>> from lab.testing import check_gate
        >>> check_gate(Unsure)
    """

    def __init__(self, settings: GateSettings, episodes: int, max_steps: int, around: Surroundings | None = None):
        super().__init__(settings, episodes, max_steps, around)
        self._draw: Draw = around.draw if around is not None else float  # outside sessions it returns 0.0
        self._rules = plain_rules(type(self))
        self._episode = self._helped_steps = 0

    @staticmethod
    def opens_rule(episode: int, steps: Steps, now: GateNow, settings: GateSettings) -> bool:
        """Whether an episode may ask; by default every episode may."""
        return True

    @staticmethod
    def asks_rule(state: int, values: Values, now: GateNow, settings: GateSettings) -> bool:
        """Whether the learner asks in a state; by default it does in each."""
        return True

    def opens(self, episode: int, steps: Steps) -> bool:
        """Applies `opens_rule`."""
        self._episode = episode
        return self._answer("opens_rule", episode, steps)

    def asks(self, state: int, values: Values) -> bool:
        """Applies `asks_rule`."""
        return self._answer("asks_rule", state, tuple(values))

    def takes(self, state: int, own: int, said: int | None) -> int:
        """The answer, which is counted; the learner's own choice if there is none."""
        self._helped_steps += said is not None
        return super().takes(state, own, said)

    def _answer(self, name: str, *given: Any) -> bool:
        now = GateNow(self._episode, self.episodes, self.max_steps, self._helped_steps, self._draw())
        answer = self._rules[name](*given, now, self.settings)
        if isinstance(answer, bool | np.bool_):
            return bool(answer)
        raise BadInput(
            f"gate '{self.settings.gate}': its {name} returned {shortened(repr(answer))}: wanted True or False"
        )


RULES = ("opens_rule", "asks_rule")


def plain_rules(gate: type[RuleGate]) -> dict[str, Any]:
    """The rules of a class by name, as plain functions, also if they are decorated with `numba.njit`."""
    rules = {name: getattr(gate, name) for name in RULES}
    return {name: getattr(rule, "py_func", rule) for name, rule in rules.items()}


def compiled_form(gate: Any) -> CompiledGate | None:
    """The form in the kernel of a gate of other code: that of a `RuleGate` that adds nothing but its rules, otherwise None."""
    if not (isinstance(gate, type) and issubclass(gate, RuleGate)):
        return None
    methods = ("__init__", "opens", "begins", "asks", "takes", "saw", "judges", "_answer")
    if gate.watches or gate.weighs or any(getattr(gate, name) is not getattr(RuleGate, name) for name in methods):
        return None
    return CompiledGate(OPENS_BY_RULE, ASKS_BY_RULE)
