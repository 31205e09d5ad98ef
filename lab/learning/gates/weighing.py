"""Gates that record and weigh advice: the lab's own, "earned-trust" (its functions come first), and published ones."""

from collections.abc import Sequence

from lab.learning.gates import heard
from lab.learning.gates.gate import Gate, Steps, Surroundings, Values
from lab.learning.gates.heard import GOAL, NOTHING, NOWHERE, Heard, answers, best_of
from lab.learning.requests import ByChance, Reason, ToldSeldom, Trusted
from lab.learning.selection import COLDEST, temperature
from lab.learning.settings import GateSettings

SURE = 1.0  # it asks until the lead of the most frequent answer exceeds this times the root of the number of answers
ANSWERS = 20  # the most answers that it asks for in a state
OWN = 3.0  # the fewest episodes without advice by which it judges itself
RECENT = 0.3  # the weight of the last episode in a running mean


def rehearsed(heard: Heard, start: int) -> int:
    """The length in moves of the greedy path from a state to the goal in the record of moves, NOTHING if it is unknown."""
    states, actions = len(heard.said), len(heard.led) // len(heard.said)
    state, moves = start, 0
    while moves < states:
        action = heard.greedy[state]
        if action == NOTHING:
            return NOTHING
        moves += 1
        led = heard.led[state * actions + action]
        if led == GOAL:
            return moves
        if led < 0:
            return NOTHING
        state = led
    return NOTHING


def starts(heard: Heard, start: int, u: float) -> None:
    """Begins an episode in a state, and decides with the uniform number u whether it follows advice."""
    now = heard.now
    now.followed = now.moves = now.advised_moves = 0.0
    now.since = now.clock = now.clock + 1.0
    chance = 1.0
    if now.helped > 0.0:
        moves = rehearsed(heard, start)
        known = moves != NOTHING and (now.several > 0.0 or moves <= now.steps)
        better = now.own >= OWN and now.own_rate >= now.rate and now.own_steps <= now.steps
        if now.won == 0.0:
            chance = (now.helped + 1.0) ** -5.0
        elif known or better:
            chance = 0.0
        else:
            chance = now.rate * (0.5 + 0.5 * now.advised_share)
    now.advised = 1.0 if u < chance else 0.0


def favourite(heard: Heard, state: int) -> int:
    """The most frequent answer in a state that is not blamed, NOTHING if there is none; ties: the lowest index."""
    actions = len(heard.led) // len(heard.said)
    best, most = NOTHING, 0
    for action in range(actions):
        number = state * actions + action
        if heard.times[number] > most and heard.blamed[number] == 0:
            best, most = action, heard.times[number]
    return best


def wants(heard: Heard, state: int) -> bool:
    """Whether to ask in a state: the episode follows advice and the answers so far do not agree clearly enough."""
    if heard.now.advised == 0.0:
        return False
    given = answers(heard, state)
    if given >= ANSWERS:
        return False
    actions = len(heard.led) // len(heard.said)
    most = second = 0
    for number in range(state * actions, (state + 1) * actions):
        if heard.blamed[number] == 0:
            times = heard.times[number]
            if times > most:
                most, second = times, most
            elif times > second:
                second = times
    return bool(most - second <= SURE * given**0.5)


def takes(heard: Heard, state: int, own: int) -> int:
    """The most frequent answer in this state if the episode follows advice and there is one, otherwise the learner's own."""
    if heard.now.advised == 0.0:
        return own
    said = favourite(heard, state)
    heard.now.followed = 0.0 if said == NOTHING else 1.0
    return own if said == NOTHING else said


def saw(heard: Heard, number: int, entered: int, over: bool, values: Sequence[float]) -> None:
    """Records a move; values: (A,), of the state that it left, after the learner has learned from it."""
    now, led = heard.now, heard.led
    actions = len(led) // len(heard.said)
    state = number // actions
    now.clock += 1.0
    now.moves += 1.0
    now.advised_moves += now.followed
    now.last = number
    heard.greedy[state] = best_of(values)
    if over:
        now.blame = number if now.followed > 0.0 else NOTHING
        return
    if led[number] == NOTHING:
        led[number] = entered
    elif led[number] != entered:
        led[number] = NOWHERE
        now.uncertain = 1.0
    if now.followed == 0.0:
        now.since = now.clock
        return
    heard.left[state] = int(now.clock)
    heard.said[state] = number - state * actions
    if heard.left[entered] > now.since and now.uncertain == 0.0:
        heard.blamed[entered * actions + heard.said[entered]] = 1


def ended(heard: Heard, result: float, reached: bool, over: bool) -> None:
    """Ends an episode; result: its step count; over: whether it ended in a terminal state."""
    now = heard.now
    last = int(now.last)
    if reached:
        heard.led[last] = GOAL if heard.led[last] in (NOTHING, GOAL) else NOWHERE
    elif over:
        heard.led[last] = NOWHERE
        if now.blame != NOTHING and now.uncertain == 0.0:
            heard.blamed[int(now.blame)] = 1
    won = 1.0 if reached else 0.0
    if now.advised > 0.0:
        share = now.advised_moves / max(now.moves, 1.0)
        now.rate = won if now.helped == 0.0 else now.rate + RECENT * (won - now.rate)
        now.steps = result if now.helped == 0.0 else now.steps + RECENT * (result - now.steps)
        now.advised_share = share if now.helped == 0.0 else now.advised_share + RECENT * (share - now.advised_share)
        now.helped += 1.0
        now.won += won
    else:
        now.own_rate = won if now.own == 0.0 else now.own_rate + RECENT * (won - now.own_rate)
        now.own_steps = result if now.own == 0.0 else now.own_steps + RECENT * (result - now.own_steps)
        now.own += 1.0


# ---- the gates ------------------------------------------------------------------------------------------------------


class Weighing(Gate):
    """The base class of gates that record answers by state; it asks about every step and follows each answer."""

    watches = weighs = True

    def __init__(self, settings: GateSettings, episodes: int, max_steps: int, around: Surroundings | None = None):
        super().__init__(settings, episodes, max_steps, around)
        self._around = around or Surroundings(lambda: 0.0, lambda count: [], size=(1, 2))
        self.heard = heard.blank(*self._around.size)
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
        self.heard.now.followed = float(said is not None)
        return self.weighed(state, own, said)

    def weighed(self, state: int, own: int, said: int | None) -> int:
        """The action to carry out; said: the answer, which is recorded already, None if there is none."""
        return own if said is None else said

    def saw(self, s_tm1: int, a_tm1: int, r_t: float, discount_t: float, s_t: int, a_t: int) -> None:
        """Passes the step to `learns`; the next step counts as advised only if `takes` says so."""
        self.learns(s_tm1, a_tm1, r_t, discount_t, s_t)
        self.heard.now.followed = 0.0

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
        return heard.shaped(self.heard, state, self._around.values(state), per_tau, odds, self._u)


class Reliability(Weighing):
    """Asks once per state, while it explores, and follows an advisor whose answers its own values confirm.

    Source: CLUE, Love, Ajoodha and Rosman 2022, with one advisor; its choice when it does not explore is the learner's.
    """

    def wants(self, state: int, u: float) -> bool:
        """Whether this step explores and there is no answer for this state yet."""
        return heard.explores(self.episode, self.episodes, u) and self.heard.said[state] == heard.NOTHING

    def weighed(self, state: int, own: int, said: int | None) -> int:
        """The answer for this state, if the step explores and the advisor is reliable, otherwise the learner's own choice."""
        kept = self.heard.said[state]
        explores = heard.explores(self.episode, self.episodes, self._u)
        follows = explores and kept != heard.NOTHING and heard.reliable(self.heard, self._around.size[1])
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
        return heard.asks_by_worth(self.heard, state, u)

    def learns(self, state: int, action: int, reward: float, discount: float, entered: int) -> None:
        """Updates the value of the choice that was made."""
        heard.learn_worth(self.heard, state, reward, discount, entered, self._around.learner.alpha)


class Trust(Weighing):
    """Follows advice while advised episodes do better than the others, remembers it, and drops answers that lead into loops."""

    def __init__(self, settings: GateSettings, episodes: int, max_steps: int, around: Surroundings | None = None):
        super().__init__(settings, episodes, max_steps, around)
        self._over = False

    def begins(self, state: int) -> None:
        """Decides whether this episode follows advice."""
        starts(self.heard, state, self._around.draw())

    def asks(self, state: int, values: Values) -> bool:
        """Whether this episode follows advice and the answers so far leave it unsure."""
        now = self.heard.now
        self.why = Trusted(now.rate) if now.helped else Reason()
        return wants(self.heard, state)

    def weighed(self, state: int, own: int, said: int | None) -> int:
        """The most frequent answer in this state if the episode follows advice and there is one, otherwise the learner's own."""
        return takes(self.heard, state, own)

    def learns(self, state: int, action: int, reward: float, discount: float, entered: int) -> None:
        """Records the outcome of the move, and blames the answer if it led into a loop."""
        self._over = discount == 0.0
        number = state * self._around.size[1] + action
        saw(self.heard, number, entered, self._over, self._around.values(state))

    def judges(self, steps: Steps, opened: bool) -> None:
        """Records the result of the episode."""
        reached = steps[-1] <= self.max_steps
        ended(self.heard, float(steps[-1]), reached, self._over)
