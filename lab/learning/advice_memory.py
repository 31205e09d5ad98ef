"""What a learner with memory keeps: where each of its moves led, and how far it trusts whoever advises.

The gate decides when the learner would ask; memory decides whether the advisor must be bothered, and does again what was
shown without asking:

1. An episode with advice in it is a showing. After one the learner asks no more, even if the gate is open; but if it missed
   the goal or had a loop with advice, the learner asks to be shown again: 3 showings in all, K episodes apart.
2. A loop with an advised move in it costs a point of trust; so does a crash by an advised move. An advised move to a new
   place earns a quarter. Trust begins with 1 point and has at most 3; below 0 the advisor is never asked again.
3. The way is the shortest to the goal by moves that the learner has made, whoever led it, parts of different walks put
   together. A move that has led to different places belongs to no way.
4. In the last 15 % of the episodes nobody is asked and nothing is tried out by chance: each move is the one that the table
   rates best. Whenever its own last result was longer than the way, it practises the way in as many episodes as the way
   has moves, then tries alone again. It learns from each step as always. The very last episode is its own: it shows what
   the table has learned.

"A loop" is a return onto this episode's walk, whose earlier loops are cut out; staying in place is one. The way is planned
from where an episode begins: with several starts, practice may miss it.
The rule was found by experiment in worlds I and II; the study `advice-budget` measures it, there and in random worlds. The
functions are written in the Python that numba compiles, too: the session hands them lists, the compiled kernel arrays.
Source: rule 3 plans in a learned model, as Sutton's Dyna does (Proc. ICML 1990, 216-224).
"""

from collections.abc import Iterator, MutableSequence
from dataclasses import dataclass
from typing import NamedTuple

from lab.learning.session_events import AdviceEnded, AdviceRemembered, Event

OWN, ASKED, PRACTISED = range(3)  # where a move comes from
START, GAIN, LOSS, MOST = 4, 1, 4, 12  # trust, in quarters of a point
SHOWINGS = 3
LATE_PERCENT = 15  # of the episodes, at their end: when the way is practised
NOTHING = -1
GOAL, NOWHERE = -2, -3  # where a move led: to the goal; to another end, or to different places
UNKNOWN = 1 << 40  # more moves than any way has

Cells = MutableSequence[int]


@dataclass
class Now:
    """The numbers of a memory; the kernel keeps them in a record of the same names.

    trust: in quarters; best: the moves of the way; practices: episodes of practice that are due, -1: the way is to be
    planned first; last_alone: the moves of the last episode without advice; showings, again (it wants another), shown_at:
    see rule 1; of the episode under way: its number, whether it is a late one (rule 4), `at` as in `Memory`, loops with
    advice, and moves of practice.
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

    led (S * A,): the state that a move led to, -1: not made yet, or GOAL or NOWHERE. way (S,): the action that the way
    takes in a state, -1: none; came, queue (S,): of `plan`, by which move a state was reached, and in which order. walk:
    the states of this episode without its loops, `now.at` is the last one's place in it; advised: how many of the moves
    before it were; on_walk (S,): the episode in which a state was on it; place (S,): where.
    """

    led: Cells
    way: Cells
    came: Cells
    queue: Cells
    on_walk: Cells
    place: Cells
    walk: Cells
    advised: Cells
    now: Now


class Move(NamedTuple):
    """A move: its place in `led` (state * A + action), OWN, ASKED or PRACTISED, the state entered.

    over: no step goes on from there; reached: it is the goal.
    """

    number: int
    source: int
    entered: int
    over: bool
    reached: bool


def places(states: int, moves: int) -> int:
    """How many places a walk may need that visits no state twice."""
    return min(states, moves + 1) + 1


def blank(states: int, actions: int, moves: int) -> Memory:
    """The memory of a session that begins; moves: the most that an episode has."""
    way, came, queue, on_walk, place = ([NOTHING] * states for _ in range(5))
    walk, advised = ([0] * places(states, moves) for _ in range(2))
    memory = Memory([NOTHING] * (states * actions), way, came, queue, on_walk, place, walk, advised, Now())
    clear(memory)
    return memory


def clear(memory: Memory) -> None:
    """Another session begins."""
    for state in range(len(memory.way)):
        memory.way[state] = NOTHING
        memory.on_walk[state] = 0
    for number in range(len(memory.led)):
        memory.led[number] = NOTHING
    now = memory.now
    now.trust, now.best, now.practices, now.last_alone = START, UNKNOWN, -1, UNKNOWN
    now.showings, now.again, now.shown_at = 0, 0, 0


def opens(memory: Memory, episode: int, episodes: int, window: int, gate_opens: bool) -> bool:
    """Whether episode n of so many may ask (rules 1, 2 and 4)."""
    now = memory.now
    now.episode, now.loops, now.practised = episode, 0, 0
    now.late = 1 if episode >= episodes - episodes * LATE_PERCENT // 100 else 0
    if episode == episodes:
        now.practices = 0
    if not gate_opens or now.late == 1 or now.trust < 0:
        return False
    return now.showings == 0 or (now.showings < SHOWINGS and now.again == 1 and episode - now.shown_at >= window)


def starts(memory: Memory, state: int) -> bool:
    """The episode begins in a state; whether the way is to be planned from there."""
    now = memory.now
    now.at = 0
    memory.walk[0] = state
    memory.on_walk[state] = now.episode
    memory.place[state] = 0
    return now.late == 1 and now.practices < 0


def plan(memory: Memory, start: int) -> None:
    """The way from a state becomes the shortest that is known (rule 3), breadth first; decides whether it is practised."""
    now, led, way, came, queue = memory.now, memory.led, memory.way, memory.came, memory.queue
    actions = len(led) // len(way)
    for state in range(len(way)):
        way[state] = came[state] = NOTHING
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
    way[state] = reaching - state * actions
    now.best = 1
    while state != start:
        number = came[state]
        state = number // actions
        way[state] = number - state * actions
        now.best += 1
    if now.last_alone > now.best:
        now.practices = now.best


def moved(memory: Memory, move: Move) -> None:
    """Takes in a move (rules 2 and 3)."""
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
    """An episode is over (rules 1 and 4); helped: moves that were asked for; moves: one above the most when it failed."""
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
    """A session's memory between the gate and the advisor: when it asks, what it practises, and what is to be told of it."""

    def __init__(self, states: int, actions: int, moves: int, episodes: int, window: int):
        self.memory = blank(states, actions, moves)
        self._actions, self._moves, self._episodes, self._window = actions, moves, episodes, window
        self._source = OWN
        self._distrust_told = False

    @property
    def late(self) -> bool:
        """Whether the episode under way is one of the last, in which nothing is tried out by chance."""
        return self.memory.now.late == 1

    @property
    def trusts(self) -> bool:
        """Whether the advisor may still be asked."""
        return self.memory.now.trust >= 0

    def opens(self, episode: int, gate_opens: bool) -> bool:
        """`opens` of this session."""
        return opens(self.memory, episode, self._episodes, self._window, gate_opens)

    def starts(self, state: int) -> None:
        """`starts`, and `plan` where it is due."""
        if starts(self.memory, state):
            plan(self.memory, state)

    def chosen(self, state: int, own: int) -> int:
        """The known way's action in an episode of practice; off it, and else, the learner's own."""
        way = self.memory.way[state]
        if self.memory.now.practices <= 0 or way == NOTHING:
            return own
        self._source = PRACTISED
        return way

    def asked(self) -> None:
        """The next move is an advised one."""
        self._source = ASKED

    def moved(self, state: int, action: int, entered: int, over: bool, reached: bool) -> None:
        """`moved`, of the move that was chosen last: the learner's own, unless `chosen` or `asked` said otherwise."""
        moved(self.memory, Move(state * self._actions + action, self._source, entered, over, reached))
        self._source = OWN

    def ended(self, moves: int | None, helped: int) -> Iterator[Event]:
        """`ended`, with what is told: moves of practice, and, once, that the trust in the advisor is lost."""
        ended(self.memory, self._moves + 1 if moves is None else moves, moves is not None, helped)
        now = self.memory.now
        if now.practised:
            yield AdviceRemembered(now.episode, now.practised)
        if not self.trusts and not self._distrust_told:
            self._distrust_told = True
            yield AdviceEnded(now.episode, "misled by what was remembered")
