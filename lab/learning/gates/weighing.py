"""Published gates that record and weigh advice, and their base class; the lab's own is in `earned_trust`."""

from lab.learning.gates import heard
from lab.learning.gates.gate import Gate, Steps, Surroundings, Values
from lab.learning.requests import ByChance, ToldSeldom
from lab.learning.selection import COLDEST, temperature
from lab.learning.settings import GateSettings


class Weighing(Gate):
    """The base class of gates that record answers by state; it asks about every step and follows each answer."""

    watches = weighs = True

    def __init__(self, settings: GateSettings, episodes: int, max_steps: int, around: Surroundings | None = None):
        super().__init__(settings, episodes, max_steps, around)
        self._around = around or Surroundings(lambda: 0.0, lambda count: [], size=(1, 2))
        self.heard = heard.blank(*self._around.size, self._around.learner.max_steps)
        heard.clear(self.heard, float(self._around.several_starts))
        self.episode = 0
        self._u = 0.0

    def opens(self, episode: int, steps: Steps) -> bool:
        """Every episode may ask."""
        self.episode = episode
        return True

    def asks(self, state: int, values: Values) -> bool:
        """Whether to ask about this step, as `wants` decides with one uniform number."""
        self._u = self._around.draw()
        return self.wants(state, self._u)

    def wants(self, state: int, u: float) -> bool:
        """Whether to ask in a state; u: a uniform number in [0, 1)."""
        return True

    def takes(self, state: int, own: int, said: int | None) -> int:
        """The action that `weighed` decides on, after the answer is recorded."""
        if said is not None:
            heard.hear(self.heard, state, said)
        heard.chose(self.heard, said is not None)
        return self.weighed(state, own, said)

    def weighed(self, state: int, own: int, said: int | None) -> int:
        """The action to carry out; said: the answer, which is recorded already, None if there is none."""
        return own if said is None else said

    def saw(self, s_tm1: int, a_tm1: int, r_t: float, discount_t: float, s_t: int, a_t: int) -> None:
        """Passes the step to `learns`."""
        heard.made_move(self.heard)
        self.learns(s_tm1, a_tm1, r_t, discount_t, s_t)

    def learns(self, state: int, action: int, reward: float, discount: float, entered: int) -> None:
        """Receives a step; discount: 0 if it ended the episode."""


class Novelty(Weighing):
    """Asks in each state until it has been answered there once (advice novelty: Ilhan et al. 2021, for tables)."""

    def wants(self, state: int, u: float) -> bool:
        """Whether there is no answer for this state yet."""
        told = heard.answers(self.heard, state)
        self.why = ToldSeldom(told)
        return told == 0


class Fading(Weighing):
    """Asks about a share of the steps that fades from 1 by a factor each episode.

    Source: probabilistic policy reuse, Fernandez and Veloso 2006, whose factor is within an episode; over the session:
    the confidence decay of Taylor, Suay and Chernova 2011.
    """

    def wants(self, state: int, u: float) -> bool:
        """Whether this step is in the random share."""
        share = self.settings.fading ** (self.episode - 1)
        self.why = ByChance(share)
        return u < share


class Shaping(Weighing):
    """Asks about every step and draws from the product of the learner's probabilities and those of the advice.

    Source: Griffith et al. 2013, eq. 3.
    """

    def weighed(self, state: int, own: int, said: int | None) -> int:
        """An action drawn from both."""
        learner = self._around.learner
        per_tau = 1.0 / max(COLDEST, temperature(self.episode, learner.beta, learner.exploration))
        odds = self.settings.consistency / (1.0 - self.settings.consistency)
        return heard.shaped(self.heard, state, [*self._around.values(state)], per_tau, odds, self._u)


class Reliability(Weighing):
    """Asks once per state, while it explores, and follows an advisor whose answers its own values confirm.

    Source: CLUE, Love, Ajoodha and Rosman 2022, with one advisor; its choice when it does not explore is the learner's.
    """

    def wants(self, state: int, u: float) -> bool:
        """Whether this step explores and there is no answer for this state yet."""
        return (
            heard.explores(self.episode, self.episodes, self.settings.exploring, u)
            and self.heard.said[state] == heard.NOTHING
        )

    def weighed(self, state: int, own: int, said: int | None) -> int:
        """The answer for this state, if the step explores and the advisor is reliable, otherwise the learner's own choice."""
        kept = self.heard.said[state]
        settings = self.settings
        explores = heard.explores(self.episode, self.episodes, settings.exploring, self._u)
        follows = (
            explores and kept != heard.NOTHING and heard.reliable(self.heard, self._around.size[1], settings.trust)
        )
        return kept if follows else own

    def learns(self, state: int, action: int, reward: float, discount: float, entered: int) -> None:
        """Counts whether the learner's values confirm the answer for the state that it left."""
        heard.borne_out(self.heard, state, self._around.values(state))


class TwoLevels(Weighing):
    """Learns by Q-learning in each state whether asking or acting alone is worth more.

    Source: two-level Q-learning, Subramanian et al. 2023 (after ADMIRAL, 2022), with one learner and one advisor.
    """

    def wants(self, state: int, u: float) -> bool:
        """Whether asking is worth at least as much here, or exploration decides to ask."""
        return heard.asks_by_worth(self.heard, state, self.settings.wandering, u)

    def learns(self, state: int, action: int, reward: float, discount: float, entered: int) -> None:
        """Updates the value of the choice that was made."""
        heard.learn_worth(self.heard, state, reward, discount, entered, self._around.learner.alpha)
