"""Published gates that follow earlier advice again: by state, by episode, as a policy of their library, and as a bonus on values.

The functions are also compiled by numba.
"""

from collections.abc import Sequence
from math import exp

from lab.learning.gates import heard
from lab.learning.gates.gate import Steps
from lab.learning.gates.heard import NOTHING, Heard
from lab.learning.gates.weighing import Weighing
from lab.learning.requests import ByChance, ToldSeldom
from lab.learning.selection import COLDEST, exp_of, temperature


def reused(uses: Sequence[int], state: int, factor: float, u: float) -> bool:
    """Whether the answer of a state is followed again: with the chance factor ** (how often it was before)."""
    return bool(u < factor ** uses[state])


def begins_reuse(told: Heard, chance: float, u: float) -> None:
    """Begins an episode, which follows earlier answers with that chance."""
    told.now.advised, told.now.moves = (1.0 if u < chance else 0.0), 0.0


def advised_chance(told: Heard, episode: int, warming: float) -> float:
    """The chance that an episode follows the advisor: softmax over the mean gains of both, ever colder."""
    colder = warming * (episode - 1)
    return 1.0 / (1.0 + exp(colder * (told.now.own_rate - told.now.rate)))


def gained(told: Heard, gain: float) -> None:
    """Adds an episode's gain to the mean of the policy that it followed."""
    now = told.now
    if now.advised > 0.0:
        now.helped += 1.0
        now.rate += (gain - now.rate) / now.helped
    else:
        now.own += 1.0
        now.own_rate += (gain - now.own_rate) / now.own


def with_bonus(values: Sequence[float], said: int, bonus: float, per_tau: float, u: float) -> int:
    """The action that u selects by softmax from the values, that of the answer raised by a bonus."""
    actions = len(values)
    top = values[said] + bonus
    for action in range(actions):
        top = max(top, values[action])
    total = 0.0
    for action in range(actions):
        total += exp_of((values[action] + (bonus if action == said else 0.0) - top) * per_tau)
    mark, below = u * total, 0.0
    for action in range(actions - 1):
        below += exp_of((values[action] + (bonus if action == said else 0.0) - top) * per_tau)
        if mark < below:
            return action
    return actions - 1


# ---- the gates ------------------------------------------------------------------------------------------------------


class AdviceReuse(Weighing):
    """Asks once in a state, and follows the answer again with a chance that shrinks with each use.

    Source: Zhu, Cai, Leung and Hu 2020, "decay reusing probability"; that the states are told apart exactly is the table's.
    """

    def wants(self, state: int, u: float) -> bool:
        """Whether there is no answer for this state yet."""
        self.why = ToldSeldom(heard.answers(self.heard, state))
        return self.heard.said[state] == NOTHING

    def weighed(self, state: int, own: int, said: int | None) -> int:
        """The answer, also an earlier one if it is reused, otherwise the learner's own choice."""
        kept = self.heard.said[state]
        if kept == NOTHING or not reused(self.heard.left, state, self.settings.reuse, self._u):
            return own
        self.heard.left[state] += 1
        return kept


class AdviceImitation(Weighing):
    """Asks once in a state; an episode imitates the answers so far, or does not, with a chance that shrinks over the episodes.

    Source: Ilhan, Gow and Perez-Liebana 2021, whose model of the advice is a network; here it is the table of answers.
    """

    def begins(self, state: int) -> None:
        """Decides whether this episode imitates."""
        begins_reuse(self.heard, self.settings.reuse ** (self.episode - 1), self._around.draw())

    def wants(self, state: int, u: float) -> bool:
        """Whether there is no answer for this state yet."""
        self.why = ToldSeldom(heard.answers(self.heard, state))
        return self.heard.said[state] == NOTHING

    def weighed(self, state: int, own: int, said: int | None) -> int:
        """The new answer, or the earlier one in an episode that imitates, otherwise the learner's own choice."""
        kept = self.heard.said[state]
        return kept if kept != NOTHING and (said is not None or self.heard.now.advised > 0.0) else own


class PolicyReuse(Weighing):
    """Chooses for each episode between the advisor and itself by their mean gains, and asks ever less within an episode.

    Source: PRQ-learning, Fernandez and Veloso 2006, with the advisor as the only other policy of the library. The gain of
    an episode is gamma ** steps, and 0 if it failed.
    """

    def begins(self, state: int) -> None:
        """Decides whether this episode reuses the advisor's policy."""
        begins_reuse(self.heard, advised_chance(self.heard, self.episode, self.settings.warming), self._around.draw())

    def wants(self, state: int, u: float) -> bool:
        """Whether this step of an episode with the advisor asks."""
        share = self.settings.reuse**self.heard.now.moves if self.heard.now.advised > 0.0 else 0.0
        self.heard.now.moves += 1.0
        self.why = ByChance(share)
        return u < share

    def judges(self, steps: Steps, opened: bool) -> None:
        """Records the episode's gain."""
        result = steps[-1]
        gained(self.heard, self._around.learner.discount**result if result <= self.max_steps else 0.0)


class ValueReuse(Weighing):
    """Asks once in a state, and raises the value of the answer there by a bonus that shrinks over the episodes.

    Source: Q-value reuse, Taylor, Stone and Liu 2007, which adds the values of another table, in the form of Knox and Stone 2012
    ("action biasing") for advice without values.
    """

    def wants(self, state: int, u: float) -> bool:
        """Whether there is no answer for this state yet."""
        self.why = ToldSeldom(heard.answers(self.heard, state))
        return self.heard.said[state] == NOTHING

    def weighed(self, state: int, own: int, said: int | None) -> int:
        """An action drawn by softmax from the values with the bonus; the learner's own choice where there is no answer."""
        kept = self.heard.said[state]
        if kept == NOTHING:
            return own
        learner = self._around.learner
        per_tau = 1.0 / max(COLDEST, temperature(self.episode, learner.beta, learner.exploration))
        bonus = self.settings.bonus * self.settings.reuse ** (self.episode - 1)
        return with_bonus(self._around.values(state), kept, bonus, per_tau, self._u)
