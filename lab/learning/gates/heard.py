"""What gates keep that weigh what they are told: answers by state, where moves led, how advised episodes went.

The functions are written in the Python that numba compiles, too: gates hand them lists, the compiled kernel arrays.
"""

from collections.abc import MutableSequence, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from lab.learning.selection import exp_of
from lab.learning.updates.update import towards

NOTHING = -1
GOAL, NOWHERE = -2, -3  # where a move led: to the goal; to another end, or to different places

Cells = MutableSequence[int]
Numbers = MutableSequence[float]


@dataclass
class HeardNow:
    """The numbers of what was heard; the kernel keeps them in a record of the same names.

    right, wrong: answers that the learner's own values bore out, or not. helped, won: episodes that followed advice, and those
    of them that reached the goal; rate, steps, advised_share: running means of whether they did, how long they took, and the
    share of their moves that were advised; own, own_rate, own_steps: of the others. several: episodes begin in different
    states; uncertain: a move has led to different places. Of the episode under way: advised: it follows advice; moves,
    advised_moves: all, and those on advice; followed: the last one was; last: its place in `led`; blame: that of a followed
    move that ended the episode, -1: none; clock: moves of the session; since: when the moves that were all followed began.
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
    last: float = 0.0
    blame: float = -1.0
    clock: float = 0.0
    since: float = 0.0


class Heard(NamedTuple):
    """What a session was told.

    said (S,): the last answer in a state, -1 none; times (S * A,): how often each was given; blamed (S * A,): 1 where an answer
    led round or to an end that is no goal; led (S * A,): the state that a move led to, -1 not made yet, GOAL or NOWHERE;
    greedy (S,): the best action by the learner's values, -1 where it has not been; left (S,): when a state was left last
    on advice; worth (S * 2,): what going on alone and asking are worth.
    """

    said: Cells
    times: Cells
    blamed: Cells
    led: Cells
    greedy: Cells
    left: Cells
    worth: Numbers
    now: HeardNow


def blank(states: int, actions: int) -> Heard:
    """The record of a session in which nothing was heard yet."""
    said, greedy = [NOTHING] * states, [NOTHING] * states
    times, blamed, led = [0] * (states * actions), [0] * (states * actions), [NOTHING] * (states * actions)
    return Heard(said, times, blamed, led, greedy, [0] * states, [0.0] * (2 * states), HeardNow())


def clear(heard: Heard, several: float) -> None:
    """Another session begins."""
    for state in range(len(heard.said)):
        heard.said[state] = heard.greedy[state] = NOTHING
        heard.left[state] = 0
        heard.worth[2 * state] = heard.worth[2 * state + 1] = 0.0
    for number in range(len(heard.led)):
        heard.times[number] = heard.blamed[number] = 0
        heard.led[number] = NOTHING
    now = heard.now
    now.right = now.wrong = 1.0
    now.helped = now.won = now.rate = now.steps = now.own = now.own_rate = now.own_steps = 0.0
    now.advised_share = now.advised = now.moves = now.advised_moves = 0.0
    now.uncertain = now.followed = now.last = now.clock = now.since = 0.0
    now.several, now.blame = several, -1.0


def hear(heard: Heard, state: int, action: int) -> None:
    """An answer is kept."""
    heard.said[state] = action
    heard.times[state * (len(heard.led) // len(heard.said)) + action] += 1


def answers(heard: Heard, state: int) -> int:
    """How many answers were given in a state."""
    actions = len(heard.led) // len(heard.said)
    found = 0
    for number in range(state * actions, (state + 1) * actions):
        found += heard.times[number]
    return found


def best_of(values: Sequence[float]) -> int:
    """The best action; ties: the lowest index."""
    best = 0
    for action in range(1, len(values)):
        if values[action] > values[best]:
            best = action
    return best


# Policy shaping


def shaped(heard: Heard, state: int, values: Sequence[float], per_tau: float, odds: float, u: float) -> int:
    """The action that u draws from the softmax of the values times odds ** (how often it was said in this state).

    Source: Griffith et al. 2013, eq. 3, an answer being a "right" for its action.
    """
    actions, top, most = len(values), values[0], 0
    for action in range(actions):
        top, most = max(top, values[action]), max(most, heard.times[state * actions + action])
    total = 0.0
    for action in range(actions):
        total += exp_of((values[action] - top) * per_tau) * odds ** (heard.times[state * actions + action] - most)
    mark, below, found = u * total, 0.0, actions - 1
    for action in range(actions - 1):
        below += exp_of((values[action] - top) * per_tau) * odds ** (heard.times[state * actions + action] - most)
        if mark < below:
            found = action
            break
    return found


# Reliability, as CLUE estimates it

EXPLORING, FOLLOWED_FROM = (
    0.8,
    0.25,
)  # share of the episodes in which it explores; the least chance that an answer is right


def explores(episode: int, episodes: int, u: float) -> bool:
    """Whether a step explores: with a chance that falls from 1 to 0 in the first 80 % of the episodes."""
    return u < 1.0 - (episode - 1) / (EXPLORING * episodes)


def reliable(heard: Heard, actions: int) -> bool:
    """Whether the answer is the likeliest action to be right, and likely enough."""
    now = heard.now
    trust = now.right / (now.right + now.wrong)
    return trust >= FOLLOWED_FROM and trust > (1.0 - trust) / (actions - 1)


def borne_out(heard: Heard, state: int, values: Sequence[float]) -> None:
    """The values of a state that was left: do they bear out what was said there?"""
    said = heard.said[state]
    if said != NOTHING:
        if values[said] >= values[best_of(values)]:
            heard.now.right += 1.0
        else:
            heard.now.wrong += 1.0


# Two levels: own choice or advice, by a table of their worth

WANDERS = 0.05  # the share of the steps in which it tries the one that is worth less


def asks_by_worth(heard: Heard, state: int, u: float) -> bool:
    """Whether asking is worth as much here as going on alone, or chance tries the other."""
    asking = heard.worth[2 * state + 1] >= heard.worth[2 * state]
    return asking if u >= WANDERS else not asking


def learn_worth(heard: Heard, state: int, reward: float, discount: float, entered: int, alpha: float) -> None:
    """Q-learning of the worth of the way that was gone: 0 alone, 1 on advice."""
    at = 2 * state + (1 if heard.now.followed > 0.0 else 0)
    best = max(heard.worth[2 * entered], heard.worth[2 * entered + 1])
    heard.worth[at] = towards(heard.worth[at], reward + discount * best, alpha)
