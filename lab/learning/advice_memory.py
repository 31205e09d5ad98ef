"""What a learner remembers: what it was told in each state, how far it trusts that, and the shortest way that it has walked.

The gate decides when the learner would ask; memory decides whether the advisor must be bothered:

1. What is said in a state is kept and done there again without asking, as long as the advisor is trusted. Moves that lead
   round in a loop with no move of the learner's own in it are forgotten along the whole loop, and cost a point of trust; so
   does a crash after an advised move, asked or remembered. A move that was asked for and leads to a new place earns a
   quarter. Trust begins with 1 point and has at most 3; below 0 the advisor is never asked again, and nothing of what it
   said is done step by step.
2. The shortest walk so far that reached the goal, with its loops left out, is the way, whoever led it.
3. When a walk with asked moves has reached the goal (a showing), the learner asks no more, even if the gate is open. If that
   showing had loops of advice, it forgets what was said and asks to be shown again: 3 showings in all, K episodes apart.
4. In the last 15 % of the episodes, whenever its own last result was longer than the way, it practises the way in as many
   episodes as the way has moves, and then tries alone again. It asks nobody there, and learns from each step as always.
   The very last episode is its own: it shows what was learned.

"A loop" is a return onto this episode's way, whose earlier loops are cut out; staying in place is one. What is known of a
way holds for one start and certain steps: with several starts, or steps left to chance, practice may miss the way.
The rule was found by experiment in worlds I and II; the study `advice-budget` measures it. The functions are written in the
Python that numba compiles, too: the session hands them lists, the compiled kernel arrays.
"""

from collections.abc import Iterator, MutableSequence
from dataclasses import dataclass
from typing import NamedTuple

from lab.learning.session_events import AdviceEnded, AdviceRemembered, Event

OWN, REMEMBERED, ASKED, PRACTISED = range(4)  # where a move comes from
START, GAIN, LOSS, MOST = 4, 1, 4, 12  # trust, in quarters of a point
SHOWINGS = 3
LATE_PERCENT = 15  # of the episodes, at their end: when the way is practised
NOTHING = -1
UNKNOWN = 1 << 40  # more moves than any way has

Cells = MutableSequence[int]


@dataclass
class Now:
    """The numbers of a memory; the kernel keeps them in a record of the same names.

    trust: in quarters; best: the moves of the way; practices: episodes of practice that are due, -1 before the first;
    last_alone: the moves of the last episode without advice; showings, looped, shown_at: see rule 3; of the episode under
    way: its number, whether it practises, `at` as in `Memory`, loops of advice, and moves made from memory.
    """

    trust: int = START
    best: int = UNKNOWN
    practices: int = -1
    last_alone: int = UNKNOWN
    showings: int = 0
    looped: int = 0
    shown_at: int = 0
    episode: int = 0
    practises: int = 0
    at: int = 0
    loops: int = 0
    used: int = 0


class Memory(NamedTuple):
    """What a session remembers.

    said, way (S,): the action that was advised in a state, or that the way takes there; -1: none. walk: the states of this
    episode without its loops, `now.at` is the last one's place in it; did: the action taken at each place; own: how many
    of the moves before it were the learner's own; on_walk (S,): the episode in which a state was on it; place (S,): where.
    """

    said: Cells
    way: Cells
    on_walk: Cells
    place: Cells
    walk: Cells
    did: Cells
    own: Cells
    now: Now


class Move(NamedTuple):
    """A move: the state left, the action, where it came from (OWN, REMEMBERED, ASKED or PRACTISED), the state entered.

    over: no step goes on from there; reached: it is the goal.
    """

    state: int
    action: int
    source: int
    entered: int
    over: bool
    reached: bool


def places(states: int, moves: int) -> int:
    """How many places a walk may need that visits no state twice."""
    return min(states, moves + 1) + 1


def blank(states: int, moves: int) -> Memory:
    """The memory of a session that begins; moves: the most that an episode has."""
    said, way, on_walk, place = ([NOTHING] * states for _ in range(4))
    walk, did, own = ([0] * places(states, moves) for _ in range(3))
    memory = Memory(said, way, on_walk, place, walk, did, own, Now())
    clear(memory)
    return memory


def clear(memory: Memory) -> None:
    """Another session begins."""
    for state in range(len(memory.said)):
        memory.said[state] = memory.way[state] = NOTHING
        memory.on_walk[state] = 0
    now = memory.now
    now.trust, now.best, now.practices, now.last_alone = START, UNKNOWN, -1, UNKNOWN
    now.showings, now.looped, now.shown_at = 0, 0, 0


def opens(memory: Memory, episode: int, episodes: int, window: int, gate_opens: bool) -> bool:
    """Whether episode n of so many may ask or do what was said (rules 1, 3, 4); decides whether it practises instead."""
    now = memory.now
    now.episode, now.practises, now.loops, now.used = episode, 0, 0, 0
    if episodes - episodes * LATE_PERCENT // 100 <= episode < episodes and now.best < UNKNOWN:
        if now.practices < 0:
            now.practices = now.best if now.last_alone > now.best else 0
        if now.practices > 0:
            now.practises = 1
            now.practices -= 1
    if not gate_opens or now.practises == 1 or now.trust < 0 or episode == episodes:
        return False
    if now.showings == 0:
        return True
    again = now.showings < SHOWINGS and now.looped == 1 and episode - now.shown_at >= window
    if again:
        for state in range(len(memory.said)):
            memory.said[state] = NOTHING
    return again


def starts(memory: Memory, state: int) -> None:
    """The episode begins in a state."""
    memory.now.at = 0
    memory.walk[0] = state
    memory.on_walk[state] = memory.now.episode
    memory.place[state] = 0


def moved(memory: Memory, move: Move) -> None:
    """Takes in a move (rule 1)."""
    now, at = memory.now, memory.now.at
    state, action, source, entered, over, reached = move
    memory.did[at] = action
    memory.own[at + 1] = memory.own[at] + (1 if source == OWN else 0)
    if source in (REMEMBERED, PRACTISED):
        now.used += 1
    if over or memory.on_walk[entered] != now.episode:
        if over and not reached and source in (REMEMBERED, ASKED):
            memory.said[state] = NOTHING
            now.trust -= LOSS
        elif not over and source == ASKED:
            now.trust = min(now.trust + GAIN, MOST)
        now.at = at + 1
        memory.walk[at + 1] = entered
        memory.on_walk[entered] = now.episode
        memory.place[entered] = at + 1
        return
    back = memory.place[entered]
    if now.practises == 0 and memory.own[at + 1] == memory.own[back]:
        now.trust -= LOSS
        now.loops += 1
        for k in range(back, at + 1):
            memory.said[memory.walk[k]] = NOTHING
    for k in range(back + 1, at + 1):
        memory.on_walk[memory.walk[k]] = 0
    now.at = back


def ended(memory: Memory, episodes: int, moves: int, reached: bool, helped: int) -> None:
    """An episode is over (rules 2-4); helped: how many moves of it were asked for; moves: one above the most when it failed."""
    now = memory.now
    if now.practises == 1:
        return
    if reached and helped > 0 and now.trust >= 0:
        now.showings += 1
        now.looped = 1 if now.loops > 0 else 0
        now.shown_at = now.episode
    if reached and now.at < now.best:
        now.best = now.at
        for state in range(len(memory.way)):
            memory.way[state] = NOTHING
        for k in range(now.at):
            memory.way[memory.walk[k]] = memory.did[k]
    if helped + now.used == 0:
        now.last_alone = moves
        if now.episode >= episodes - episodes * LATE_PERCENT // 100:
            now.practices = now.best if moves > now.best else 0


class Recall:
    """A session's memory between the gate and the advisor: what is done from memory, and what is to be told of it."""

    def __init__(self, states: int, moves: int, episodes: int, window: int):
        self.memory = blank(states, moves)
        self._moves, self._episodes, self._window = moves, episodes, window
        self._source = OWN
        self._distrust_told = False

    @property
    def practises(self) -> bool:
        """Whether the episode under way practises the known way."""
        return self.memory.now.practises == 1

    @property
    def trusts(self) -> bool:
        """Whether the advisor may still be asked."""
        return self.memory.now.trust >= 0

    def opens(self, episode: int, gate_opens: bool) -> bool:
        """`opens` of this session."""
        return opens(self.memory, episode, self._episodes, self._window, gate_opens)

    def starts(self, state: int) -> None:
        """`starts`; until something else is chosen, moves are the learner's own."""
        self._source = OWN
        starts(self.memory, state)

    def chosen(self, state: int, own: int) -> int:
        """The known way's action in an episode of practice; off it the learner's own."""
        way = self.memory.way[state]
        self._source = OWN if way == NOTHING else PRACTISED
        return own if way == NOTHING else way

    def said(self, state: int) -> int | None:
        """What was said in a state, None where nothing was; the learner's own move follows unless one of these is called."""
        self._source = OWN
        said = self.memory.said[state]
        return None if said == NOTHING else said

    def does(self) -> None:
        """What was said is done again."""
        self._source = REMEMBERED

    def keeps(self, state: int, action: int) -> None:
        """An action was advised, and is done."""
        self._source = ASKED
        self.memory.said[state] = action

    def moved(self, state: int, action: int, entered: int, over: bool, reached: bool) -> None:
        """`moved`, of the move that was chosen last."""
        moved(self.memory, Move(state, action, self._source, entered, over, reached))

    def ended(self, moves: int | None, helped: int) -> Iterator[Event]:
        """`ended`, with what is told: moves made from memory, and, once, that the trust in the advisor is lost."""
        went = self._moves + 1 if moves is None else moves
        ended(self.memory, self._episodes, went, moves is not None, helped)
        now = self.memory.now
        if now.used:
            yield AdviceRemembered(now.episode, now.used)
        if not self.trusts and not self._distrust_told:
            self._distrust_told = True
            yield AdviceEnded(now.episode, "misled by what was remembered")
