"""The memory of advice: a learned model of the moves, from which demonstrated paths are practised, and the trust in the advisor.

The gate decides when the learner would ask; the memory decides whether the advisor has to be asked, or whether the learner can
repeat what was demonstrated:

1. An episode with at least one advised move is a demonstration. After the first one the learner asks no more, even if the gate is
   open, unless that episode missed the goal or contained a loop with an advised move; then it asks for another demonstration,
   at least K episodes later, up to 3 in total.
2. Trust begins at 1 point and is at most 3. A loop with an advised move costs a point, and so does an advised move into an
   obstacle; an advised move to a new place earns a quarter. Below 0 points the advisor is never asked again.
3. The known path is the shortest path to the goal in the learned model: all moves that were made, advised or not, in any
   episode. A move that has led to different states is not used.
4. In the last 15 % of the episodes the learner neither asks nor explores: each move is greedy. Whenever its last own episode was
   longer than the known path, it practises that path in as many episodes as the path has moves, then acts on its own again. It
   learns from every step. The very last episode is greedy, without practice: it shows what the table has learned.

A loop is a return to a state of the current walk, from which earlier loops have been removed; staying in place is a loop. The
path is planned from the state in which an episode begins, so practice may miss it if there are several starts.
The rule was found by experiment in worlds I and II; the study `advice-budget` measures it there and in random worlds. The
functions are also compiled by numba: the session passes lists, the kernel arrays.
Source: rule 3 plans in a learned model, as Sutton's Dyna does (Proc. ICML 1990, 216-224).
"""

from collections.abc import Iterator, MutableSequence
from dataclasses import dataclass
from typing import NamedTuple

from lab.learning.session_events import AdviceEnded, AdviceRemembered, Event

OWN, ASKED, PRACTISED = range(3)  # sources of a move: own choice, advice, practice of the known path
START, GAIN, LOSS, MOST = 4, 1, 4, 12  # trust, in quarters of a point
SHOWINGS = 3
LATE_PERCENT = 15  # the last share of the episodes, in which the known path is practised
NOTHING = -1
GOAL, NOWHERE = -2, -3  # the outcome of a move: the goal; another terminal state, or different states
UNKNOWN = 1 << 40  # more moves than any path has

Cells = MutableSequence[int]


@dataclass
class Now:
    """The scalars of a memory; the kernel keeps them in a record with the same field names.

    trust: in quarters of a point; best: the moves of the known path; practices: the episodes of practice left, -1: the path
    has to be planned first; last_alone: the moves of the last episode without advice; showings, again, shown_at: how many
    demonstrations there were, whether another one is wanted, and the episode of the last one (rule 1).
    Of the current episode: episode: its number; late: whether rule 4 applies; at: see `Memory`; loops: those with advised moves;
    practised: moves of practice.
    """

    trust: int = START
    best: int = UNKNOWN
    practices: int = -1
    last_alone: int = UNKNOWN
    showings: int = 0
    again: int = 0
    shown_at: int = 0
    episode: int = 0
    late: int = 0
    at: int = 0
    loops: int = 0
    practised: int = 0


class Memory(NamedTuple):
    """What a session remembers.

    led (S * A,): the state that each move led to, -1 if it was never made, or GOAL or NOWHERE.
    path (S,): the action that the known path takes in each state, -1 if the state is not on it.
    came, queue (S,): working space of `plan`: the move by which each state was reached, and the order of the states.
    walk: the states of this episode without its loops; `now.at` is the index of the current state.
    advised: for each state of the walk, how many of the moves before it were advised.
    on_walk, place (S,): the last episode in whose walk a state was, and its index there.
    """

    led: Cells
    path: Cells
    came: Cells
    queue: Cells
    on_walk: Cells
    place: Cells
    walk: Cells
    advised: Cells
    now: Now


class RememberedMove(NamedTuple):
    """A move: its number (state * A + action), its source (OWN, ASKED or PRACTISED) and the state entered.

    over: the state entered is terminal; reached: it is a goal.
    """

    number: int
    source: int
    entered: int
    over: bool
    reached: bool


def places(states: int, moves: int) -> int:
    """The length of the array for a walk that visits no state twice."""
    return min(states, moves + 1) + 1


def blank(states: int, actions: int, moves: int) -> Memory:
    """The memory of a new session; moves: the limit of an episode."""
    path, came, queue, on_walk, place = ([NOTHING] * states for _ in range(5))
    walk, advised = ([0] * places(states, moves) for _ in range(2))
    memory = Memory([NOTHING] * (states * actions), path, came, queue, on_walk, place, walk, advised, Now())
    clear(memory)
    return memory


def clear(memory: Memory) -> None:
    """Resets the memory for another session."""
    for state in range(len(memory.path)):
        memory.path[state] = NOTHING
        memory.on_walk[state] = 0
    for number in range(len(memory.led)):
        memory.led[number] = NOTHING
    now = memory.now
    now.trust, now.best, now.practices, now.last_alone = START, UNKNOWN, -1, UNKNOWN
    now.showings, now.again, now.shown_at = 0, 0, 0


def opens(memory: Memory, episode: int, episodes: int, window: int, gate_opens: bool) -> bool:
    """Whether this episode may ask (rules 1, 2 and 4); window: K; gate_opens: what the gate decided."""
    now = memory.now
    now.episode, now.loops, now.practised = episode, 0, 0
    now.late = 1 if episode >= episodes - episodes * LATE_PERCENT // 100 else 0
    if episode == episodes:
        now.practices = 0
    if not gate_opens or now.late == 1 or now.trust < 0:
        return False
    return now.showings == 0 or (now.showings < SHOWINGS and now.again == 1 and episode - now.shown_at >= window)


def starts(memory: Memory, state: int) -> bool:
    """Begins an episode in a state; returns whether the path has to be planned from there."""
    now = memory.now
    now.at = 0
    memory.walk[0] = state
    memory.on_walk[state] = now.episode
    memory.place[state] = 0
    return now.late == 1 and now.practices < 0


def plan(memory: Memory, start: int) -> None:
    """Plans the known path from a state by breadth-first search (rule 3), and decides whether it is practised."""
    now, led, path, came, queue = memory.now, memory.led, memory.path, memory.came, memory.queue
    actions = len(led) // len(path)
    for state in range(len(path)):
        path[state] = came[state] = NOTHING
    now.best, now.practices = UNKNOWN, 0
    came[start] = queue[0] = start
    first, last, reaching = 0, 1, NOTHING
    while first < last and reaching == NOTHING:
        state = queue[first]
        first += 1
        for number in range(state * actions, (state + 1) * actions):
            entered = led[number]
            if entered == GOAL:
                reaching = number
                break
            if entered >= 0 and came[entered] == NOTHING:
                came[entered] = number
                queue[last] = entered
                last += 1
    if reaching == NOTHING:
        return
    state = reaching // actions
    path[state] = reaching - state * actions
    now.best = 1
    while state != start:
        number = came[state]
        state = number // actions
        path[state] = number - state * actions
        now.best += 1
    if now.last_alone > now.best:
        now.practices = now.best


def moved(memory: Memory, move: RememberedMove) -> None:
    """Updates model, walk and trust after a move (rules 2 and 3)."""
    now, at, led = memory.now, memory.now.at, memory.led
    number, source, entered, over, reached = move
    leads = entered if not over else GOAL if reached else NOWHERE
    if led[number] != leads:
        led[number] = leads if led[number] == NOTHING else NOWHERE
    memory.advised[at + 1] = memory.advised[at] + (1 if source == ASKED else 0)
    if source == PRACTISED:
        now.practised += 1
    if over or memory.on_walk[entered] != now.episode:
        if over and not reached and source == ASKED:
            now.trust -= LOSS
        elif not over and source == ASKED:
            now.trust = min(now.trust + GAIN, MOST)
        now.at = at + 1
        memory.walk[at + 1] = entered
        memory.on_walk[entered] = now.episode
        memory.place[entered] = at + 1
        return
    back = memory.place[entered]
    if memory.advised[at + 1] > memory.advised[back]:
        now.trust -= LOSS
        now.loops += 1
    for k in range(back + 1, at + 1):
        memory.on_walk[memory.walk[k]] = 0
    now.at = back


def ended(memory: Memory, moves: int, reached: bool, helped: int) -> None:
    """Ends an episode (rules 1 and 4); moves: one above the limit if it failed; helped: its advised moves."""
    now = memory.now
    if now.practices > 0:
        now.practices -= 1
    elif helped > 0:
        now.showings += 1
        now.again = 1 if now.loops > 0 or not reached else 0
        now.shown_at = now.episode
    else:
        now.last_alone = moves
        if now.late == 1:
            now.practices = 0 if moves == now.best else -1


class Recall:
    """The memory as the session uses it, between gate and advisor: when to ask, what to practise, which events to report."""

    def __init__(self, states: int, actions: int, moves: int, episodes: int, window: int):
        self.memory = blank(states, actions, moves)
        self._actions, self._moves, self._episodes, self._window = actions, moves, episodes, window
        self._source = OWN
        self._distrust_told = False

    @property
    def late(self) -> bool:
        """Whether the current episode is one of the last, which do not explore (rule 4)."""
        return self.memory.now.late == 1

    @property
    def trusts(self) -> bool:
        """Whether the advisor may still be asked."""
        return self.memory.now.trust >= 0

    def opens(self, episode: int, gate_opens: bool) -> bool:
        """Whether this episode may ask: see the function `opens`."""
        return opens(self.memory, episode, self._episodes, self._window, gate_opens)

    def starts(self, state: int) -> None:
        """Begins an episode, and plans the known path if necessary."""
        if starts(self.memory, state):
            plan(self.memory, state)

    def chosen(self, state: int, own: int) -> int:
        """The action of the known path in an episode of practice; off the path, and in other episodes, the learner's own."""
        known_action = self.memory.path[state]
        if self.memory.now.practices <= 0 or known_action == NOTHING:
            return own
        self._source = PRACTISED
        return known_action

    def asked(self) -> None:
        """Marks the next move as advised."""
        self._source = ASKED

    def moved(self, state: int, action: int, entered: int, over: bool, reached: bool) -> None:
        """Records the last chosen move, which counts as the learner's own unless `chosen` or `asked` marked it otherwise."""
        moved(self.memory, RememberedMove(state * self._actions + action, self._source, entered, over, reached))
        self._source = OWN

    def ended(self, moves: int | None, helped: int) -> Iterator[Event]:
        """Ends an episode; yields its moves of practice as an event, and, once, that the trust in the advisor is lost."""
        ended(self.memory, self._moves + 1 if moves is None else moves, moves is not None, helped)
        now = self.memory.now
        if now.practised:
            yield AdviceRemembered(now.episode, now.practised)
        if not self.trusts and not self._distrust_told:
            self._distrust_told = True
            yield AdviceEnded(now.episode, "misled by what was remembered")
