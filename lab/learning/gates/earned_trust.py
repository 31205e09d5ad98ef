"""The lab's own gate, "earned-trust": it follows advice while that does better than acting alone, and hands it to the table.

1. An episode follows advice or none. The first one does. As long as no advised episode has reached the goal, the n-th one comes
   with the chance n ** -retry; what was said in a failed one is forgotten, and an episode is given up after `strikes` loops.
2. In an advised episode the most frequent answer in a state is carried out; it asks until the lead of that answer exceeds
   `agreement` times the root of the number of answers. An answer that led into a loop or to failure is dropped, where a move
   always leads to the same state.
3. Advice ends where acting alone has done as well, where the learner's own greedy path is known to reach the goal, and, if all
   episodes begin in one state, after STALE advised successes in a row without a shorter path.
4. The shortest known path, from advice or not, is handed over to the learner's table after each episode: its moves are learned
   from again, the last one first, and where another action still looks better it is valued a little lower. With one
   start and certain moves the greedy policy of a table is then never worse than the best episode so far; what is tried later can
   correct it. Where moves lead to different states, the answers of a successful advised episode are handed over in the same way.

The functions are also compiled by numba: `around` is then (work, lane), and the first four are those of the kernel.
Source: rule 4 replays backwards as Lin 1992, and lowers other actions as the margin of Hester et al. 2018 (DQfD) does.
"""

from typing import Any

from lab.learning.gates.gate import Steps, Surroundings, Values
from lab.learning.gates.heard import GOAL, NOTHING, NOWHERE, UNKNOWN, Heard, answers, best_of
from lab.learning.gates.weighing import Weighing
from lab.learning.requests import Reason, Trusted
from lab.learning.selection import COLDEST, temperature
from lab.learning.settings import GateSettings

AMENDS = 0.25  # the part of a loop that an advised move to a new state amends
CREDIT = 0.25  # the least share of advised moves with which a success is the advisor's
STALE = 2.0  # advised successes in a row without a shorter path, after which it acts alone
ANSWERS = 20  # the most answers that it asks for in a state
OWN = 3.0  # the fewest episodes without advice by which it judges itself
RECENT = 0.3  # the weight of the last episode in a running mean
GIVEN_UP = -1.0  # `HeardNow.advised` of an episode that began to follow advice and does so no more


def best_action(around: Any, state: int) -> int:
    """The learner's greedy action in a state."""
    return best_of(around.values(state))


def prefer(around: Any, state: int, action: int, margin: float) -> None:
    """Lowers the learner's values of the other actions in a state, see `Update.prefer`."""
    around.update.prefer(state, action, margin)


def replay(around: Any, state: int, action: int, reward: float, entered: int) -> None:
    """Lets the learner learn again from a known move, see `Update.replay`."""
    around.update.replay(state, action, reward, around.learner.discount, entered)


def leads(heard: Heard, around: Any, number: int) -> int:
    """The state that a move leads to, as recorded or as the learner knows it, or GOAL, NOWHERE or NOTHING."""
    led, actions = heard.led[number], len(heard.led) // len(heard.said)
    return around.update.leads_to(number // actions, number % actions) if led == NOTHING else led


def planned(heard: Heard, around: Any, start: int) -> int:
    """The length in moves of the learner's greedy path from a state to the goal, NOTHING if it is not known."""
    states, actions = len(heard.said), len(heard.led) // len(heard.said)
    state, moves = start, 0
    while moves < states:
        led = leads(heard, around, state * actions + best_action(around, state))
        moves += 1
        if led == GOAL:
            return moves
        if led < 0 or heard.fewest[led] == UNKNOWN:
            return NOTHING
        state = led
    return NOTHING


# ---- an episode -----------------------------------------------------------------------------------------------------


def starts(heard: Heard, around: Any, start: int, retry: float, u: float) -> None:
    """Begins an episode in a state, and decides with the uniform number u whether it follows advice (rules 1 and 3)."""
    now = heard.now
    now.moves = now.advised_moves = now.strikes = 0.0
    now.since = now.clock = now.clock + 1.0
    chance = now.rate * (0.5 + 0.5 * now.advised_share)
    if now.won == 0.0:
        chance = (now.helped + 1.0) ** -retry
    elif now.own >= OWN and now.own_rate >= now.rate and now.own_steps <= now.steps:
        chance = 0.0
    elif now.uncertain == 0.0:
        known = planned(heard, around, start) != NOTHING if now.several > 0.0 else now.stale >= STALE
        chance = 0.0 if known else chance
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


def wants(heard: Heard, state: int, agreement: float) -> bool:
    """Whether to ask in a state: the episode follows advice and the answers so far do not agree clearly enough."""
    if heard.now.advised <= 0.0:
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
    return bool(most - second <= agreement * given**0.5)


def takes(heard: Heard, state: int, own: int) -> int:
    """The most frequent answer in this state if the episode follows advice and there is one, otherwise the learner's own."""
    if heard.now.advised <= 0.0:
        return own
    said = favourite(heard, state)
    heard.now.followed = 0.0 if said == NOTHING else 1.0
    return own if said == NOTHING else said


def saw(heard: Heard, number: int, entered: int, over: bool, reward: float, strikes: float) -> None:
    """Records a move (rule 2); strikes: loops on advice, less what amends them, after which an episode is given up."""
    now, led = heard.now, heard.led
    actions = len(led) // len(heard.said)
    state = number // actions
    heard.walk[int(now.moves)], heard.paid[number] = number, reward
    now.clock += 1.0
    now.moves += 1.0
    now.advised_moves += now.made
    if over:
        now.blame = number if now.made > 0.0 else NOTHING
        return
    if led[number] == NOTHING:
        led[number] = entered
    elif led[number] != entered:
        led[number] = NOWHERE
        now.uncertain = 1.0
    if now.made == 0.0:
        now.since = now.clock
        return
    heard.left[state] = int(now.clock)
    heard.said[state] = number - state * actions
    if heard.left[entered] > now.since and now.uncertain == 0.0:
        heard.blamed[entered * actions + heard.said[entered]] = 1
        now.strikes += 1.0
        if now.won == 0.0 and now.strikes >= strikes:
            now.advised = GIVEN_UP
    else:
        now.strikes = max(0.0, now.strikes - AMENDS)


def ended(heard: Heard, around: Any, result: float, reached: bool, over: bool, margin: float) -> None:
    """Ends an episode; result: its step count; over: whether its last state was terminal; margin: see `prefer`."""
    now, actions = heard.now, len(heard.led) // len(heard.said)
    start, last = heard.walk[0] // actions, heard.walk[int(now.moves) - 1]
    fewest = heard.fewest[start]
    if reached and over:
        heard.led[last] = GOAL if heard.led[last] in (NOTHING, GOAL) else NOWHERE
        knows(heard, around)
    elif over:
        heard.led[last] = NOWHERE
        if now.blame != NOTHING and now.uncertain == 0.0:
            heard.blamed[int(now.blame)] = 1
    succeeded = reached and now.advised > 0.0
    judges(heard, result, reached)
    if succeeded:
        now.stale = 0.0 if heard.fewest[start] < fewest else now.stale + 1.0
    if now.won > 0.0 and now.uncertain == 0.0 and heard.fewest[start] < UNKNOWN:
        hand_over_path(heard, around, start, margin)
    elif succeeded:
        hand_over_answers(heard, around, margin)


def judges(heard: Heard, result: float, reached: bool) -> None:
    """Records the result of the episode as the advisor's or as the learner's own."""
    now = heard.now
    share = now.advised_moves / max(now.moves, 1.0)
    if now.advised == 0.0 or (reached and share < CREDIT):
        won = 1.0 if reached else 0.0
        now.own_rate = won if now.own == 0.0 else now.own_rate + RECENT * (won - now.own_rate)
        now.own_steps = result if now.own == 0.0 else now.own_steps + RECENT * (result - now.own_steps)
        now.own += 1.0
        return
    won = 1.0 if reached and now.advised != GIVEN_UP else 0.0
    now.rate = won if now.helped == 0.0 else now.rate + RECENT * (won - now.rate)
    now.steps = result if now.helped == 0.0 else now.steps + RECENT * (result - now.steps)
    now.advised_share = share if now.helped == 0.0 else now.advised_share + RECENT * (share - now.advised_share)
    now.helped += 1.0
    now.won += won
    if now.won == 0.0:
        for state in range(len(heard.said)):
            heard.said[state], heard.left[state] = NOTHING, 0
        for number in range(len(heard.led)):
            heard.times[number] = heard.blamed[number] = 0


# ---- what is handed over to the table -------------------------------------------------------------------------------


def knows(heard: Heard, around: Any) -> None:
    """Records the shortest known way to the goal from each state of an episode that reached it."""
    actions, left = len(heard.led) // len(heard.said), 0
    for k in range(int(heard.now.moves) - 1, -1, -1):
        state = heard.walk[k] // actions
        left += 1
        if left < heard.fewest[state]:
            heard.fewest[state], heard.way[state] = left, heard.walk[k] - state * actions
        for action in range(actions):
            led = leads(heard, around, state * actions + action)
            if led >= 0 and heard.fewest[led] + 1 < heard.fewest[state]:
                heard.fewest[state], heard.way[state] = heard.fewest[led] + 1, action
        left = heard.fewest[state]


def hand_over_path(heard: Heard, around: Any, start: int, margin: float) -> None:
    """Makes the shortest known path from a state the greedy one, unless the greedy one is known to be as short (rule 4)."""
    moves = planned(heard, around, start)
    if moves != NOTHING and moves <= heard.fewest[start]:
        return
    actions, state, length = len(heard.led) // len(heard.said), start, 0
    while state >= 0 and length < len(heard.walk):
        heard.walk[length] = state * actions + heard.way[state]
        state = leads(heard, around, heard.walk[length])
        length += 1
    for k in range(length - 1, -1, -1):
        state, action = heard.walk[k] // actions, heard.walk[k] % actions
        entered = leads(heard, around, heard.walk[k])
        if entered >= 0:
            replay(around, state, action, heard.paid[heard.walk[k]], entered)
        if best_action(around, state) != action:
            prefer(around, state, action, margin)


def hand_over_answers(heard: Heard, around: Any, margin: float) -> None:
    """Makes the answers that were followed the greedy actions, if advised episodes do better than the others (rule 4)."""
    now, actions = heard.now, len(heard.led) // len(heard.said)
    if now.own > 0.0 and (now.rate < now.own_rate or now.steps > now.own_steps):
        return
    for k in range(int(now.moves)):
        state, action = heard.walk[k] // actions, heard.walk[k] % actions
        if favourite(heard, state) == action and best_action(around, state) != action:
            prefer(around, state, action, margin)


# ---- the gate -------------------------------------------------------------------------------------------------------


class EarnedTrust(Weighing):
    """Follows advice while advised episodes do better than the others, and hands what it remembers over to the learner."""

    def __init__(self, settings: GateSettings, episodes: int, max_steps: int, around: Surroundings | None = None):
        super().__init__(settings, episodes, max_steps, around)
        self._over = False

    def begins(self, state: int) -> None:
        """Decides whether this episode follows advice."""
        starts(self.heard, self._around, state, self.settings.retry, self._around.draw())

    def asks(self, state: int, values: Values) -> bool:
        """Whether this episode follows advice and the answers so far leave it unsure."""
        now = self.heard.now
        self.why = Trusted(now.rate) if now.helped else Reason()
        return wants(self.heard, state, self.settings.agreement)

    def weighed(self, state: int, own: int, said: int | None) -> int:
        """The most frequent answer in this state if the episode follows advice and there is one, otherwise the learner's own."""
        return takes(self.heard, state, own)

    def learns(self, state: int, action: int, reward: float, discount: float, entered: int) -> None:
        """Records the outcome of the move, and blames the answer if it led into a loop."""
        self._over = discount == 0.0
        number = state * self._around.size[1] + action
        saw(self.heard, number, entered, self._over, reward, self.settings.strikes)

    def judges(self, steps: Steps, opened: bool) -> None:
        """Records the result of the episode, and hands over what is known."""
        learner = self._around.learner
        tau = max(COLDEST, temperature(self.episode, learner.beta, learner.exploration))
        ended(
            self.heard,
            self._around,
            float(steps[-1]),
            steps[-1] <= self.max_steps,
            self._over,
            self.settings.margin * tau,
        )
