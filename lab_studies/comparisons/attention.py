"""What costs a person least for the same result: moves, ways, sentences, praise and blame, or a demonstration, all of them typed.

The person knows the best moves. The seconds of attention are those of the keystroke-level model for what is typed at the prompts
of the lab; each line is read by the parser of its prompt before it counts.

Source: Card, Moran and Newell, The keystroke-level model for user performance time with interactive systems, Communications of
the ACM 23 (1980), 396-410.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import groupby
from typing import Any, NamedTuple

import numpy as np

from lab.advice.advisors import RecordedAdvisor
from lab.learning import splitmix
from lab.learning.praise import PRAISE_RULES, Judgement, Judging
from lab.learning.requests import AdviceRequest, Advisor, Reply
from lab.learning.selection import Draw
from lab.learning.session import Session
from lab.learning.settings import GateSettings
from lab.mdp import FloatArray, TabularMDP, greedy_path, shortest_steps
from lab.seat.request_text import PathAhead
from lab.seat.spoken_answers import SpokenAnswers
from lab.seat.terminal.typed_answer import judged, letters, understand
from lab.statistics import interval
from lab.studies.charts import bars
from lab.studies.findings import Findings, Row, mean_row, row, share_row, those
from lab.studies.runner import Job, seeds_of
from lab.words.meaning import Refusal
from lab_studies.comparisons.advice_bench.problems import problem

SKILLS = {"insert": "insert at toaster", "transfer": "transfer plate to insert with slice"}  # by problem
PROBLEMS = tuple(SKILLS)
NOBODY, ACTIONS, WAYS, SENTENCES, DEMONSTRATION = "nobody", "actions", "ways", "sentences", "demonstration"
PRAISE, LATE_PRAISE, CONTRARY_PRAISE = "praise", "late praise", "contrary praise"
LATE = 2  # moves, of late praise
JUDGING = {  # by kind: how a person judges; all rules by which the learner may act on it, the default without its name
    LATE_PRAISE: Judging(only=True, late=LATE),
    **{
        kind if rule == Judging().rule else f"{kind}, {rule}": Judging(only=True, rule=rule)
        for rule in PRAISE_RULES
        for kind in (PRAISE, CONTRARY_PRAISE)
    },
}
KINDS = (NOBODY, ACTIONS, WAYS, SENTENCES, DEMONSTRATION, *JUDGING)
HELPED = (ACTIONS, WAYS, SENTENCES, PRAISE, LATE_PRAISE, DEMONSTRATION)
GATE = GateSettings("ccrl", first_episode=10, by_evidence=True, spare_best=True)
WITHIN = 0.1  # of the fewest moves: the result
KEY_S, MENTAL_S = 0.28, 1.35  # operators K, of an average typist who is no secretary, and M
SHIFTED = "+"  # characters of a US keyboard that take a second key
SAME = 1e-9  # values that differ by less are equally good
CELL_MM = 50  # of the grids of both sub-tasks
JOGS = {"left": "-x", "right": "+x", "backward": "-y", "forward": "+y", "down": "-z", "up": "+z"}
MEASURES = (
    f"A session counts until its greedy policy, which is measured after each episode without help, first takes at most "
    f"{WITHIN:.0%} more moves than the fewest; one that never does counts to its end. helped_steps: moves that were said or "
    "judged. seconds: the keystroke-level model over all that was typed until then, an M for each line and for each further "
    f"straight part of a way, and a K for each key, Enter and Shift included (M {MENTAL_S} s, K {KEY_S} s; the hands stay on the "
    "keys, and the learner answers at once). It leaves out how long a person looks at a question. actions: a letter in answer to "
    "each question; ways: the rest of the way in one line; sentences: the same in words, such as 3 right, then 2 forward, and an "
    f"M and a K to agree to what was understood; praise: + or - of each move; late praise: 0 to {LATE} moves late; "
    "demonstration: `lead`, jogs and `lead end` at the console of lab operate, once, before the session."
)
CONTRARY = (
    "contrary praise: + of the worst moves, - of the others. final_moves and late_steps are those of the whole session: the "
    "greedy policy in the end (the step limit and 1 if it misses the goal), and the mean of the last tenth of the episodes. "
    "praise, sharing and praise, coach: the other rules of lab.learning.praise."
)


def seconds_of(line: str, parts: int = 1) -> float:
    """The seconds that a line takes to think of and to type: an M for each of its parts, a K for each key, Enter included."""
    keys = len(line) + 1 + sum(line.count(character) for character in SHIFTED)
    return parts * MENTAL_S + keys * KEY_S


def way_line(mdp: TabularMDP, moves: Sequence[int]) -> tuple[str, int]:
    """(line, parts): a way as it is typed, such as "8r3f", and the number of its straight parts."""
    letter = {action: key for key, action in letters(mdp).items()}
    runs = [(letter[action], len([*run])) for action, run in groupby(moves)]
    return "".join(f"{count}{key}" if count > 1 else key for key, count in runs), len(runs)


def way_sentence(mdp: TabularMDP, moves: Sequence[int]) -> tuple[str, int]:
    """(sentence, parts): a way in words, such as "8 right, then 3 forward", and the number of its straight parts."""
    runs = [f"{len([*run])} {mdp.action_labels[action]}" for action, run in groupby(moves)]
    return ", then ".join(runs), len(runs)


def demonstrated(mdp: TabularMDP, skill: str, moves: Sequence[int]) -> list[str]:
    """The lines of a demonstration of a skill at the console: a jog for each straight part of the way."""
    runs = [(mdp.action_labels[action], len([*run])) for action, run in groupby(moves)]
    jogs = [f"jog {JOGS[label][0]}{JOGS[label][1]} {count * CELL_MM}" for label, count in runs]
    return [f"lead {skill}", *jogs, "lead end"]


class Typist:
    """A person who knows the optimal values (S, A) and types answers of one kind; counts the seconds that this takes.

    draw: gives how late a judgement is.
    """

    def __init__(self, kind: str, mdp: TabularMDP, values: FloatArray, draw: Draw):
        self._kind, self._mdp, self._values, self._draw = kind, mdp, values, draw
        self._path, self._episode, self._verdicts = PathAhead(), 0, list[str]()
        self._spoken = SpokenAnswers()
        self.seconds = 0.0
        self.judging = JUDGING.get(kind)

    def advise(self, request: AdviceRequest) -> Reply:
        """The answer that the prompt reads from what is typed."""
        if self._kind == ACTIONS:
            return self._moves([int(self._values[request.state].argmax())], 1)
        if self._kind in (WAYS, SENTENCES):
            if not self._path.goes_on(request):
                moves = greedy_path(self._values, self._mdp, self._mdp.n_states, request.state)[1]
                if self._kind == WAYS:
                    self._moves(moves, way_line(self._mdp, moves)[1])
                else:
                    self._sentence(moves, request)
                self._path = PathAhead(request, moves)
            return self._path.step()
        return self._judgement(request)

    def _moves(self, moves: Sequence[int], parts: int) -> int:
        line = way_line(self._mdp, moves)[0]
        meant = understand(line, self._mdp)
        assert meant == (moves[0] if len(moves) == 1 else tuple(moves))
        self.seconds += seconds_of(line, parts)
        return moves[0]

    def _sentence(self, moves: Sequence[int], request: AdviceRequest) -> None:
        sentence, parts = way_sentence(self._mdp, moves)
        meant = self._spoken.heard(sentence, request)
        assert not isinstance(meant, Refusal)
        assert self._spoken.moves(meant, request) == tuple(moves)
        self.seconds += seconds_of(sentence, parts) + seconds_of("")

    def _judgement(self, request: AdviceRequest) -> Judgement | None:
        assert self.judging is not None
        row, contrary = self._values[request.state], self._kind.startswith(CONTRARY_PRAISE)
        is_good = abs(row[request.own] - (row.min() if contrary else row.max())) <= SAME
        if request.episode != self._episode:
            self._episode, self._verdicts = request.episode, []
        self._verdicts.append("+" if is_good else "-")
        late = int(self._draw() * (self.judging.late + 1))
        if late >= len(self._verdicts):
            return None
        line = self._verdicts[-1 - late]
        self.seconds += seconds_of(line)
        return judged(line)


class Attended(NamedTuple):
    """The record of a session until its result: episodes, helped steps, seconds; and of the whole: see `MEASURES`.

    reached: whether the result came; rejected: whether the advice was rejected; final: the moves of the last greedy policy, one
    above the step limit if it misses the goal; late: the mean steps of the last tenth of the episodes.
    """

    reached: bool
    episodes: int
    helped: int
    seconds: float
    rejected: bool
    final: int
    late: float


@dataclass(frozen=True)
class Setting:
    """A problem, and how a person helps in it."""

    problem: str
    kind: str


def attended(setting: Setting, seed: int) -> Attended:
    """The record of a session."""
    place, draw = problem(setting.problem), splitmix.stream(seed)
    mdp, most = place.mdp, place.learner.max_steps
    person = Typist(setting.kind, mdp, place.values, splitmix.stream(splitmix.apart(seed, 1)))
    advisor: Advisor | None = None if setting.kind == NOBODY else person
    if setting.kind == DEMONSTRATION:
        states, moves, _ = greedy_path(place.values, mdp, mdp.n_states)
        advisor = RecordedAdvisor(dict(zip(states, moves, strict=False)))
        person.seconds = sum(map(seconds_of, demonstrated(mdp, SKILLS[setting.problem], moves)))
    session, fewest = Session(mdp, place.learner, GATE, advisor, draw), shortest_steps(mdp)
    until: list[tuple[int, int, float]] = []

    def spent() -> tuple[int, int, float]:
        return session.episode, session.helped_steps, person.seconds

    def watched() -> bool:
        if not until:
            _, moves, reached = greedy_path(session.update.table(), mdp, most)
            if reached and len(moves) <= (1.0 + WITHIN) * fewest:
                until.append(spent())
        return False

    result = session.run(enough=watched)
    final = most + 1 if result.final_steps is None else result.final_steps
    tenth = float(result.steps[-len(result.steps) // 10 :].mean())
    return Attended(bool(until), *(until or [spent()])[0], result.rejected_at_episode is not None, final, tenth)


def sessions_of(setting: Setting, sessions: int, seed: int) -> list[Attended]:
    """The records of `sessions` sessions of a setting; those of the same problem have the same seeds."""
    seeds = seeds_of(Setting(setting.problem, ""), sessions, seed)
    return [attended(setting, int(own)) for own in seeds]


def attention(job: Job, reading: Mapping[str, Any]) -> Findings:
    """The results of every setting; the reading has no effect."""
    settings = [Setting(name, kind) for name in PROBLEMS for kind in KINDS]
    told = job.each(partial(sessions_of, sessions=job.sessions, seed=job.seed), settings)
    rows = [one for setting, records in told.items() for one in rows_of(setting, records, told)]
    shown = {kind: those(rows, kind=kind, measure="seconds") for kind in HELPED}
    pictures = {"Seconds of attention to the same result": bars(PROBLEMS, shown, "seconds", label="")}
    return Findings(rows, in_short(rows), pictures, (MEASURES, CONTRARY))


def rows_of(setting: Setting, records: Sequence[Attended], told: Mapping[Setting, Sequence[Attended]]) -> list[Row]:
    """The measures of a setting."""
    named: Row = dict(vars(setting))
    reached, episodes, helped, seconds, rejected, final, late = (
        np.array(column) for column in zip(*records, strict=True)
    )
    rows = [
        share_row(named, "reached_percent", reached),
        mean_row(named, "episodes", episodes),
        mean_row(named, "helped_steps", helped),
        mean_row(named, "seconds", seconds),
        share_row(named, "rejected_percent", rejected),
        mean_row(named, "final_moves", final),
        mean_row(named, "late_steps", late),
    ]
    if setting.kind != NOBODY:
        alone = told[Setting(setting.problem, NOBODY)]
        for measure, own, other in (
            ("final_moves_over_nobody", final, [one.final for one in alone]),
            ("late_steps_over_nobody", late, [one.late for one in alone]),
        ):
            mean, *ends = interval(own - np.array(other))
            rows.append(row(named, measure, mean, ends))
    return rows


def in_short(rows: Sequence[Row]) -> Row:
    """By problem, the seconds and helped steps of each kind; and what contrary praise does."""
    says: Row = {}
    for name in PROBLEMS:
        for measure in ("seconds", "helped_steps"):
            found = [those(rows, problem=name, kind=kind, measure=measure)[0] for kind in HELPED]
            says[f"{name}: {measure}"] = ", ".join(
                f"{one['kind']} {one['value']:.0f} ({one['ci95'][0]:.0f} to {one['ci95'][1]:.0f})" for one in found
            )
        more = those(rows, problem=name, kind=CONTRARY_PRAISE, measure="final_moves_over_nobody")[0]
        ends = f"{more['value']:+.2f} ({more['ci95'][0]:+.2f} to {more['ci95'][1]:+.2f})"
        says[f"{name}: final moves with contrary praise, over nobody"] = ends
    return says
