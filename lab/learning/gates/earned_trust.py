"""The rule of the gate "trust": follow advice while it does better than going alone, remember it, drop what leads round.

1. An answer is remembered: in that state it is followed again without asking. It is blamed, and followed there no more,
   once it led back to where it was given by advised moves alone, or into an end that is no goal; the learner then asks
   again, three times a state in all. Where moves are seen to be left to chance, nothing is blamed.
2. An episode follows advice or none. The first does. While no advised one has reached the goal, the (n+1)th does with
   chance 1/(n+1)**4; then with the share of the recent ones that did.
3. It goes alone where its own greedy way, walked in thought by the moves it has made, reaches the goal in no more steps
   than the recent advised episodes took, or where its own recent episodes did better.

As in `heard`, numba compiles these functions, too.
"""

from collections.abc import Sequence

from lab.learning.gates.heard import GOAL, NOTHING, NOWHERE, Heard, answers, best_of

ANSWERS = 3  # in a state
RECENT = 0.3  # the weight of the last episode in a running mean


def rehearsed(heard: Heard, start: int) -> int:
    """The moves of the greedy way from a state to the goal by moves that were made, NOTHING where it is not known to get there."""
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
    """An episode begins: whether it follows advice (rules 2 and 3)."""
    now = heard.now
    now.followed = 0.0
    now.since = now.clock = now.clock + 1.0
    chance = 1.0
    if now.helped > 0.0:
        moves = rehearsed(heard, start)
        if now.won == 0.0:
            chance = (now.helped + 1.0) ** -4.0
        elif moves != NOTHING and (now.several > 0.0 or moves <= now.steps):
            chance = 0.0
        elif now.own >= 3.0 and now.own_rate >= now.rate and now.own_steps <= now.steps:
            chance = 0.0
        else:
            chance = now.rate
    now.mode = 1.0 if u < chance else 0.0


def remembers(heard: Heard, state: int) -> bool:
    """Whether an answer is known here that nothing speaks against."""
    said = heard.said[state]
    return said != NOTHING and heard.blamed[state * (len(heard.led) // len(heard.said)) + said] == 0


def wants(heard: Heard, state: int) -> bool:
    """Whether to ask (rule 1)."""
    return heard.now.mode > 0.0 and not remembers(heard, state) and answers(heard, state) < ANSWERS


def takes(heard: Heard, state: int, own: int) -> int:
    """What is known of this state, or the learner's own choice."""
    if heard.now.mode > 0.0 and remembers(heard, state):
        return heard.said[state]
    return own


def saw(heard: Heard, number: int, entered: int, over: bool, values: Sequence[float]) -> None:
    """Takes in a move; values: of the state that it left, after it was learned from."""
    now, led = heard.now, heard.led
    actions = len(led) // len(heard.said)
    state = number // actions
    now.clock += 1.0
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
    if heard.left[entered] > now.since:
        said = heard.said[entered]
        if said != NOTHING and now.uncertain == 0.0:
            heard.blamed[entered * actions + said] = 1


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
    if now.mode > 0.0:
        now.rate = won if now.helped == 0.0 else now.rate + RECENT * (won - now.rate)
        now.steps = result if now.helped == 0.0 else now.steps + RECENT * (result - now.steps)
        now.helped += 1.0
        now.won += won
    else:
        now.own_rate = won if now.own == 0.0 else now.own_rate + RECENT * (won - now.own_rate)
        now.own_steps = result if now.own == 0.0 else now.own_steps + RECENT * (result - now.own_steps)
        now.own += 1.0
