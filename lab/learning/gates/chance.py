"""The gate that asks by chance."""

from lab.learning.gates.gate import PerStep, Values
from lab.learning.reasons import ByChance


class Random(PerStep):
    """Asks in a random share of the steps: what any rule must beat."""

    def asks(self, state: int, values: Values) -> bool:
        """Whether chance says so."""
        assert self.around is not None
        self.why = ByChance(self.settings.rate)
        return self.around.draw() < self.settings.rate
