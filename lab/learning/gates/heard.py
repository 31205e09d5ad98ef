"""The record of gates that weigh advice: answers by state, outcomes of moves, results of advised episodes.

Rules of published gates that work on it follow: policy shaping, CLUE's reliability, and a table of the worth of asking. The
functions are also compiled by numba: gates pass lists, the kernel arrays.
"""

from collections.abc import MutableSequence, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from lab.learning.selection import exp_of
from lab.learning.updates.update import towards

NOTHING = -1
UNKNOWN = 1 << 30  # more moves than any episode has
GOAL, NOWHERE = -2, -3  # outcomes of a move: the goal; another terminal state, or different states

Cells = MutableSequence[int]
Numbers = MutableSequence[float]


@dataclass
class HeardNow:
    """The scalars of the record; the kernel keeps them in a record with the same field names.

    right, wrong: answers that the learner's own values confirm, or contradict.
    helped, won: advised episodes, and those of them that reached the goal; rate, steps, advised_share: their running means of
    success, of steps, and of the share of advised moves; own, own_rate, own_steps: the same for the other episodes.
    stale: advised successes in a row after which no shorter path from their start was known. strikes: loops on advice in the
    current episode, less what amends them.
    several: 1 if episodes begin in different states; uncertain: 1 if a move has led to different states.
    Of the current episode: advised: 1 if it follows advice; moves, advised_moves: all, and those on advice; followed, before:
    1 if the last choice, and the one before it, was on advice; waiting: choices that are not learned from yet; made: 1 if the
    move that is learned from was on advice; blame: the number of an advised move that ended the episode, -1 for none.
    clock: moves of the session; since: the clock at the start of the current run of advised moves.
    """

    right: float = 1.0
    wrong: float = 1.0
    helped: float = 0.0
    won: float = 0.0
    rate: float = 0.0
    steps: float = 0.0
    own: float = 0.0
    own_rate: float = 0.0
    own_steps: float = 0.0
    several: float = 0.0
    uncertain: float = 0.0
    advised: float = 0.0
    moves: float = 0.0
    advised_moves: float = 0.0
    advised_share: float = 0.0
    followed: float = 0.0
    before: float = 0.0
    waiting: float = 0.0
    made: float = 0.0
    blame: float = -1.0
    clock: float = 0.0
    since: float = 0.0
    stale: float = 0.0
    strikes: float = 0.0


class Heard(NamedTuple):
    """The record of the advice in a session.

    said (S,): the last answer in each state, -1 for none; times (S * A,): how often each action was the answer.
    blamed (S * A,): 1 for answers that led into a loop or to a terminal state that is no goal.
    led (S * A,): the state that each move led to, -1 if it was never made, or GOAL or NOWHERE.
    left (S,): the clock when a state was last left on advice. walk (moves,): the numbers of the moves of the current episode.
    fewest, way (S,): the fewest moves in which the goal was reached from a state, and the first of them; UNKNOWN, -1 at first.
    paid (S * A,): the last reward of each move.
    worth (S * 2,): the values of acting alone and of asking.
    """

    said: Cells
    times: Cells
    blamed: Cells
    led: Cells
    left: Cells
    walk: Cells
    fewest: Cells
    way: Cells
    paid: Numbers
    worth: Numbers
    now: HeardNow


def blank(states: int, actions: int, moves: int) -> Heard:
    """An empty record; moves: the limit of an episode."""
    said, way, fewest = [NOTHING] * states, [NOTHING] * states, [UNKNOWN] * states
    times, blamed, led = [0] * (states * actions), [0] * (states * actions), [NOTHING] * (states * actions)
    return Heard(
        said,
        times,
        blamed,
        led,
        [0] * states,
        [0] * moves,
        fewest,
        way,
        [0.0] * len(led),
        [0.0] * (2 * states),
        HeardNow(),
    )


def clear(heard: Heard, several: float) -> None:
    """Resets the record for another session; several: 1 if its episodes begin in different states."""
    for state in range(len(heard.said)):
        heard.said[state] = heard.way[state] = NOTHING
        heard.left[state], heard.fewest[state] = 0, UNKNOWN
        heard.worth[2 * state] = heard.worth[2 * state + 1] = 0.0
    for number in range(len(heard.led)):
        heard.times[number] = heard.blamed[number] = 0
        heard.led[number] = NOTHING
    now = heard.now
    now.right = now.wrong = 1.0
    now.helped = now.won = now.rate = now.steps = now.own = now.own_rate = now.own_steps = 0.0
    now.advised_share = now.advised = now.moves = now.advised_moves = 0.0
    now.stale = now.strikes = now.uncertain = now.followed = now.before = now.waiting = now.made = now.clock = (
        now.since
    ) = 0.0
    now.several, now.blame = several, -1.0


def hear(heard: Heard, state: int, action: int) -> None:
    """Records an answer."""
    heard.said[state] = action
    heard.times[state * (len(heard.led) // len(heard.said)) + action] += 1


def chose(heard: Heard, on_advice: bool) -> None:
    """Records that an action was chosen, on advice or not; learners that look ahead choose the next one before they learn."""
    now = heard.now
    now.before, now.followed = now.followed, 1.0 if on_advice else 0.0
    now.waiting += 1.0


def made_move(heard: Heard) -> None:
    """Sets `now.made` for the move that is learned from: the first of those that were chosen and not yet learned from."""
    now = heard.now
    now.made = 0.0 if now.waiting == 0.0 else now.followed if now.waiting == 1.0 else now.before
    now.waiting = max(0.0, now.waiting - 1.0)


def answers(heard: Heard, state: int) -> int:
    """The number of answers recorded in a state."""
    actions = len(heard.led) // len(heard.said)
    total = 0
    for number in range(state * actions, (state + 1) * actions):
        total += heard.times[number]
    return total


def best_of(values: Sequence[float]) -> int:
    """The best action; ties: the lowest index."""
    best = 0
    for action in range(1, len(values)):
        if values[action] > values[best]:
            best = action
    return best


# ---- policy shaping -------------------------------------------------------------------------------------------------


def shaped(heard: Heard, state: int, values: Numbers, per_tau: float, odds: float, u: float) -> int:
    """The action that u selects from softmax probability times odds ** (how often the action was the answer in this state).

    values (A,): overwritten by the cumulative weights.
    Source: Griffith et al. 2013, eq. 3, where an answer counts as a "right" for its action.
    """
    actions, top, most = len(values), values[0], 0
    for action in range(actions):
        top, most = max(top, values[action]), max(most, heard.times[state * actions + action])
    total = 0.0
    for action in range(actions):
        weight, less = exp_of((values[action] - top) * per_tau), heard.times[state * actions + action] - most
        total += weight * odds**less if less else weight
        values[action] = total
    mark = u * total
    for action in range(actions - 1):
        if mark < values[action]:
            return action
    return actions - 1


# ---- reliability, as in CLUE ----------------------------------------------------------------------------------------


def explores(episode: int, episodes: int, exploring: float, u: float) -> bool:
    """Whether a step explores: with a probability that falls linearly from 1 to 0 in the share `exploring` of the episodes."""
    return u < 1.0 - (episode - 1) / (exploring * episodes)


def reliable(heard: Heard, actions: int, least: float) -> bool:
    """Whether the answer is the most probable right action, with a probability of at least `least`."""
    now = heard.now
    trust = now.right / (now.right + now.wrong)
    return trust >= least and trust > (1.0 - trust) / (actions - 1)


def borne_out(heard: Heard, state: int, values: Sequence[float]) -> None:
    """Counts whether the learner's values in a state confirm the answer there."""
    said = heard.said[state]
    if said != NOTHING:
        if values[said] >= values[best_of(values)]:
            heard.now.right += 1.0
        else:
            heard.now.wrong += 1.0


# ---- two levels: acting alone or asking, by their values ------------------------------------------------------------


def asks_by_worth(heard: Heard, state: int, wandering: float, u: float) -> bool:
    """Whether to ask: if that is worth at least as much as acting alone, and the other way round in a share of the steps."""
    asking = heard.worth[2 * state + 1] >= heard.worth[2 * state]
    return asking if u >= wandering else not asking


def learn_worth(heard: Heard, state: int, reward: float, discount: float, entered: int, alpha: float) -> None:
    """One Q-learning update of the value of the choice made in a state: acting alone (0) or on advice (1)."""
    at = 2 * state + (1 if heard.now.made > 0.0 else 0)
    best = max(heard.worth[2 * entered], heard.worth[2 * entered + 1])
    heard.worth[at] = towards(heard.worth[at], reward + discount * best, alpha)
