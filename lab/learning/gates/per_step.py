"""Gates that decide at each step: by how close together the values of a state lie, how far apart, or by chance."""

from lab.learning.gates.gate import Gate, Values
from lab.learning.gates.gate_rules import Steps, unsure
from lab.learning.reasons import ByChance, ValuesAlike, ValuesApart


class PerStep(Gate):
    """From episode X on, whether to ask is decided at each step."""

    def opens(self, episode: int, steps: Steps) -> bool:
        """Every episode from X on may ask."""
        return episode >= self.settings.first_episode


def width_of(values: Values) -> float:
    return max(values) - min(values)


class Introspection(PerStep):
    """Asks in each state whose values span at most Psi (Clouse 1996; thesis eq. 9.3)."""

    def asks(self, state: int, values: Values) -> bool:
        """Whether the learner is unsure of its choice."""
        self.why = ValuesAlike(width_of(values), self.settings.psi)
        return unsure(width_of(values), self.settings.psi)


class Importance(PerStep):
    """Asks in each state whose values span at least Psi: there a wrong choice costs most (Torrey and Taylor 2013)."""

    def asks(self, state: int, values: Values) -> bool:
        """Whether much depends on the choice."""
        self.why = ValuesApart(width_of(values), self.settings.psi)
        return width_of(values) >= self.settings.psi


class Random(PerStep):
    """Asks in a random share of the steps: what any rule must beat."""

    def asks(self, state: int, values: Values) -> bool:
        """Whether chance says so."""
        assert self.around is not None
        self.why = ByChance(self.settings.rate)
        return self.around.draw() < self.settings.rate
