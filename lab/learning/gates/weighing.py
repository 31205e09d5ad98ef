"""Gates that keep what they are told and weigh it: the field's rules, and the lab's own, "earned-trust"."""

from collections.abc import Sequence

from lab.learning.gates import heard
from lab.learning.gates.gate import Gate, Steps, Surroundings, Values
from lab.learning.gates.heard import GOAL, NOTHING, NOWHERE, Heard, answers, best_of
from lab.learning.requests import ByChance, Reason, ToldSeldom, Trusted
from lab.learning.selection import COLDEST, temperature
from lab.learning.settings import GateSettings

SURE = 1.0
ANSWERS = 20  # in a state
OWN = 3.0  # episodes of its own that it has judged itself by
RECENT = 0.3  # the weight of the last episode in a running mean


def rehearsed(heard: Heard, start: int) -> int:
    """The moves of the greedy way from a state to the goal by moves that were made, NOTHING where it is not known."""
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
    """An episode begins: whether it follows advice (rules 3 and 4)."""
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
    """The answer that was given most often and is not blamed, NOTHING where there is none; ties: the lowest index."""
    actions = len(heard.led) // len(heard.said)
    found, most = NOTHING, 0
    for action in range(actions):
        number = state * actions + action
        if heard.times[number] > most and heard.blamed[number] == 0:
            found, most = action, heard.times[number]
    return found


def wants(heard: Heard, state: int) -> bool:
    """Whether to ask (rule 1)."""
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
    """What is known of this state, or the learner's own choice."""
    if heard.now.advised == 0.0:
        return own
    said = favourite(heard, state)
    heard.now.followed = 0.0 if said == NOTHING else 1.0
    return own if said == NOTHING else said


def saw(heard: Heard, number: int, entered: int, over: bool, values: Sequence[float]) -> None:
    """Takes in a move; values: of the state that it left, after it was learned from."""
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
    """An episode is over; result: its steps; over: it ended in a terminal state."""
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


# ---- weighing ---------------------------------------------------------------------------------------------------------


class Weighing(Gate):
    """Keeps what it is told by state; asks about every step and follows what is said."""

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
        """Whether to ask about this step, as `wants` has it; each step draws one uniform number."""
        self._u = self._around.draw()
        return self.wants(state, self._u)

    def wants(self, state: int, u: float) -> bool:
        """Whether to ask; u: a uniform number."""
        return True

    def takes(self, state: int, own: int, said: int | None) -> int:
        """What is said is kept, and followed or not, as `weighed` has it."""
        if said is not None:
            heard.hear(self.heard, state, said)
        self.heard.now.followed = float(said is not None)
        return self.weighed(state, own, said)

    def weighed(self, state: int, own: int, said: int | None) -> int:
        """The action, once what was said is kept."""
        return own if said is None else said

    def saw(self, s_tm1: int, a_tm1: int, r_t: float, discount_t: float, s_t: int, a_t: int) -> None:
        """A step was made and learned from; the next one follows advice only if `takes` says so."""
        self.learns(s_tm1, a_tm1, r_t, discount_t, s_t)
        self.heard.now.followed = 0.0

    def learns(self, state: int, action: int, reward: float, discount: float, entered: int) -> None:
        """What is made of a step; discount: 0 when it ended the episode."""


class Novelty(Weighing):
    """Asks in each state until it has been answered there once (advice novelty: Ilhan et al. 2021, for tables)."""

    def wants(self, state: int, u: float) -> bool:
        """Whether nothing was said here yet."""
        told = heard.answers(self.heard, state)
        self.why = ToldSeldom(told)
        return told == 0


class Fading(Weighing):
    """Asks about a share of the steps that fades from 1 by a factor each episode.

    Source: probabilistic policy reuse, Fernandez and Veloso 2006, whose factor is within an episode; over the session:
    the confidence decay of Taylor, Suay and Chernova 2011.
    """

    def wants(self, state: int, u: float) -> bool:
        """Whether chance says so."""
        share = self.settings.fading ** (self.episode - 1)
        self.why = ByChance(share)
        return u < share


class Shaping(Weighing):
    """Asks about every step and draws from the learner's chances times what was said (Griffith et al. 2013, eq. 3)."""

    def weighed(self, state: int, own: int, said: int | None) -> int:
        """An action by both."""
        learner = self._around.learner
        per_tau = 1.0 / max(COLDEST, temperature(self.episode, learner.beta, learner.exploration))
        odds = self.settings.consistency / (1.0 - self.settings.consistency)
        return heard.shaped(self.heard, state, self._around.values(state), per_tau, odds, self._u)


class Reliability(Weighing):
    """Asks where it explores, once a state, and follows an advisor whose answers its own values bear out.

    Source: CLUE, Love, Ajoodha and Rosman 2022, with one advisor; its choice when it does not explore is the learner's.
    """

    def wants(self, state: int, u: float) -> bool:
        """Whether it explores where nothing was said yet."""
        return heard.explores(self.episode, self.episodes, u) and self.heard.said[state] == heard.NOTHING

    def weighed(self, state: int, own: int, said: int | None) -> int:
        """What was said here, now or before, where it explores and the advisor is reliable."""
        kept = self.heard.said[state]
        explores = heard.explores(self.episode, self.episodes, self._u)
        follows = explores and kept != heard.NOTHING and heard.reliable(self.heard, self._around.size[1])
        return kept if follows else own

    def learns(self, state: int, action: int, reward: float, discount: float, entered: int) -> None:
        """Whether the learner's values bear out what was said where it was."""
        heard.borne_out(self.heard, state, self._around.values(state))


class TwoLevels(Weighing):
    """Learns by Q-learning in each state whether asking or going on alone is worth more.

    Source: two-level Q-learning, Subramanian et al. 2023 (after ADMIRAL, 2022), with one learner and one advisor.
    """

    def wants(self, state: int, u: float) -> bool:
        """Whether asking is worth as much here."""
        return heard.asks_by_worth(self.heard, state, u)

    def learns(self, state: int, action: int, reward: float, discount: float, entered: int) -> None:
        """What the way that was gone is worth."""
        heard.learn_worth(self.heard, state, reward, discount, entered, self._around.learner.alpha)


class Trust(Weighing):
    """Follows advice while it does better than going alone, and remembers it (see lab/learning/gates/py)."""

    def __init__(self, settings: GateSettings, episodes: int, max_steps: int, around: Surroundings | None = None):
        super().__init__(settings, episodes, max_steps, around)
        self._over = False

    def begins(self, state: int) -> None:
        """Whether this episode follows advice."""
        starts(self.heard, state, self._around.draw())

    def asks(self, state: int, values: Values) -> bool:
        """Whether this episode follows advice and the answers so far leave it unsure."""
        now = self.heard.now
        self.why = Trusted(now.rate) if now.helped else Reason()
        return wants(self.heard, state)

    def weighed(self, state: int, own: int, said: int | None) -> int:
        """What is known of this state, or the learner's own choice."""
        return takes(self.heard, state, own)

    def learns(self, state: int, action: int, reward: float, discount: float, entered: int) -> None:
        """Where the move led, and whether it led round."""
        self._over = discount == 0.0
        number = state * self._around.size[1] + action
        saw(self.heard, number, entered, self._over, self._around.values(state))

    def judges(self, steps: Steps, opened: bool) -> None:
        """How the episode went."""
        reached = steps[-1] <= self.max_steps
        ended(self.heard, float(steps[-1]), reached, self._over)
