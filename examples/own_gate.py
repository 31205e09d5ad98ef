"""A gate of one's own: `lab teach world-1 --gate ./own_gate.py:WhileLost`, or `lab.teach("world-1", gate=WhileLost)`."""

import lab


class WhileLost(lab.Gate):
    """Asks while the last five episodes together took more than twice the steps of the best one so far."""

    def opens(self, episode: int, steps: lab.Steps) -> bool:
        """Whether the learner is lost: nothing is known of the shortest way, only of its own best."""
        return len(steps) >= 5 and sum(steps[-5:]) / 5 > 2 * min(steps)
