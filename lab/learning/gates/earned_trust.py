"""The rule of the gate "earned-trust": follow advice while it does better than going alone, remember it, drop what leads round.

1. Answers are counted, state by state, and the one that was given most often is followed, also without asking. The learner asks
   while none leads clearly: by SURE times the root of how many there were, ANSWERS at the most.
2. An answer is blamed, and followed there no more, once it led back to where it was given by advised moves alone, or into an
   end that is no goal. Where moves are seen to be left to chance, nothing is blamed.
3. An episode follows advice or none. The first does. While no advised one has reached the goal, the (n+1)th does with
   chance 1/(n+1)**5; then with the share of the recent ones that did, up to half of it the less, the fewer of their moves
   were advised.
4. It goes alone where its own greedy way, walked in thought by the moves it has made, reaches the goal in no more steps
   than the recent advised episodes took, or where its own recent episodes did better.

As in `heard`, numba compiles these functions, too.
"""

from collections.abc import Sequence

from lab.learning.gates.heard import GOAL, NOTHING, NOWHERE, Heard, answers, best_of

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
