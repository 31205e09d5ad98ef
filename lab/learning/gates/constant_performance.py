"""The gate that asks until performance is good enough."""

from lab.learning.gates.gate import Gate
from lab.learning.gates.rules import Steps, window_mean
from lab.learning.reasons import TooLong


class ConstantPerformance(Gate):
    """Asks for whole episodes while the mean of the last K is above a constant (CQ(lambda): Kartoun et al. 2006)."""

    def opens(self, episode: int, steps: Steps) -> bool:
        """Whether performance is not good enough yet."""
        settings = self.settings
        if episode < settings.first_episode or len(steps) < settings.window:
            return False
        mean = window_mean(steps, len(steps), settings.window)
        self.why = TooLong(settings.window, mean, settings.enough_steps)
        return mean > settings.enough_steps
