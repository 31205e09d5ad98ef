"""Gates that look at the values of a state: they ask where these lie close together, or far apart."""

from lab.learning.gates.gate import PerStep, Values
from lab.learning.gates.rules import unsure
from lab.learning.reasons import ValuesAlike, ValuesApart


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
