"""A rule of doubt of one's own: `lab clone grasp --rule ./own_doubt.py:Hesitation`, or `lab.Mentor.learn(shown, Hesitation)`."""

from collections import deque

import numpy as np

import lab
from lab.mentor.doubts import Step

STEPS = 10


class Hesitation(lab.Doubt):
    """Asks where the last ten actions cancel one another."""

    def begin(self) -> None:
        """No action has been seen."""
        self.last: deque[np.ndarray] = deque(maxlen=STEPS)

    def __call__(self, step: Step) -> float:
        """The share of the way of the last actions that led nowhere: 0 straight ahead, 1 there and back."""
        self.last.append(step.action / self.demonstrated.action_scale)
        if len(self.last) < STEPS:
            return 0.0
        way = sum(np.linalg.norm(action) for action in self.last)
        return float(1.0 - np.linalg.norm(sum(self.last)) / way) if way > 0.0 else 1.0
