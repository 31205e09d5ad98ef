"""The rounds of a student with a mentor: clone, roll out, ask where it is in doubt, correct, clone again."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Annotated, Any, Protocol

import numpy as np
from annotated_types import Ge
from numpy.typing import NDArray

from lab.cloning.student import EPOCHS, Student
from lab.errors import BadInput, check_value
from lab.mentor.conformal import Promise, check_share
from lab.mentor.doubts import DOUBTS, UNCALIBRATED, check_rule
from lab.mentor.mentor import Mentor, Question, parted
from lab.recordings.episode import Episode, Recording

Action = NDArray[np.float32]
Policy = Callable[[Any], Action]
Asks = Callable[[Any, Action], bool]
DEMONSTRATING, CALIBRATING, CORRECTING, EVALUATING = range(4)  # what seeds are drawn for: none serves for two


class RollsOut(Protocol):
    """One episode of a policy from the start of a seed; `asks` says before each step whether the teacher takes it over."""

    def __call__(self, policy: Policy, seed: int, *, asks: Asks | None = None) -> Episode:
        """The episode."""


@dataclass(frozen=True)
class CloningOptions:
    """What a student is cloned from and how it may ask.

    demonstrations: episodes of the teacher at the start. rounds: of asking. questions: takeovers in a round, at most.
    takeover_steps: for which the teacher then acts. rule: of the mentor. false_alarms: in which share of the episodes that
    would have succeeded it may ask. calibrated: rollouts without a teacher that set the threshold of a round. episodes: with a
    teacher in a round, at most. every_steps: after so many steps the rule "clock" asks, and "random" on average. evaluated:
    rollouts by which a student is measured, the same after each round. epochs: of each student's learning.
    """

    demonstrations: int = 15
    rounds: int = 4
    questions: int = 10
    takeover_steps: int = 10
    rule: str = "progress"
    false_alarms: float = 0.2
    calibrated: int = 20
    episodes: int = 40
    every_steps: int = 50
    evaluated: int = 30
    epochs: int = EPOCHS
    seed: int = 0

    def __post_init__(self) -> None:
        check_rule(self.rule, "clone")
        check_share("false_alarms", self.false_alarms, "clone")
        check_value("rounds", self.rounds, Annotated[int, Ge(0)], "clone")
        check_value("seed", self.seed, Annotated[int, Ge(0)], "clone")
        for name in (
            "demonstrations",
            "questions",
            "takeover_steps",
            "calibrated",
            "episodes",
            "every_steps",
            "evaluated",
            "epochs",
        ):
            check_value(name, getattr(self, name), Annotated[int, Ge(1)], "clone")


@dataclass(frozen=True)
class Measured:
    """A student after a round, measured in episodes that nothing else has used.

    successes (e,): of the episodes without a teacher. questions, corrected_steps: so far. warned: of the failed episodes, those
    in which the mentor would have asked, and false_alarms: of the others; lead_steps: from the first question to the end of
    each failed episode that was warned of. promise: of the mentor's threshold; None if too few rollouts succeeded to promise it.
    helped, judged: takeovers, by the mentor's judge; rejected: whether it asks no more. rule: of the mentor in this round, which
    is "distance" where the session's rule had nothing to learn from; "" in what was kept before it was noted.
    Raises BadInput for numbers that cannot be.
    """

    round: int
    successes: tuple[bool, ...]
    questions: int
    corrected_steps: int
    warned: int
    false_alarms: int
    lead_steps: tuple[int, ...]
    promise: Promise | None
    helped: int
    judged: int
    rejected: bool
    rule: str = ""

    def __post_init__(self) -> None:
        failures = self.successes.count(False)
        most = {"warned": failures, "false_alarms": len(self.successes) - failures, "helped": self.judged}
        if not self.successes:
            raise BadInput("successes: none: wanted one episode or more")
        for name in ("round", "questions", "corrected_steps", "judged", *most):
            if not 0 <= (value := getattr(self, name)) <= most.get(name, value):
                raise BadInput(f"{name} {value}: wanted 0 {f'to {most[name]}' if name in most else 'or more'}")
        if len(self.lead_steps) != self.warned:
            raise BadInput(f"lead_steps of {len(self.lead_steps)} failures: wanted those of {self.warned}")

    @property
    def success(self) -> float:
        """The share of the episodes that succeeded."""
        return sum(self.successes) / len(self.successes)


@dataclass(frozen=True)
class Corrected:
    """An episode in which somebody took over, or which somebody demonstrated: its place among the seeds, and its questions."""

    place: int
    questions: int
    episode: Episode


@dataclass(frozen=True)
class Hears:
    """Who hears of a session: each question before the teacher takes over, and each episode with takeovers once it has ended."""

    question: Callable[[Question], None] = lambda question: None
    corrected: Callable[[Corrected], None] = lambda corrected: None


@dataclass
class Cloning:
    """The state of a cloning session after its last round: all that the next one goes on from.

    begun: episodes of the next round that was interrupted.
    """

    demonstrations: Recording
    student: Student
    mentor: Mentor
    corrections: list[Episode] = field(default_factory=list)
    measured: list[Measured] = field(default_factory=list)
    questions: int = 0  # so far
    begun: list[Corrected] = field(default_factory=list)


def seeds_for(options: CloningOptions, purpose: int, count: int, in_round: int = 0) -> list[int]:
    """The seeds of the episodes for a purpose; those of different purposes and rounds are drawn apart."""
    rng = np.random.default_rng([options.seed, purpose, in_round])
    return [int(seed) for seed in rng.integers(2**32, size=count)]


def cloned(
    roll_out: RollsOut,
    demonstrations: Recording,
    options: CloningOptions,
    session: Cloning | None = None,
    first: Student | None = None,
    hears: Hears | None = None,
) -> Iterator[Cloning]:
    """The session after each round, the first before any question.

    session: which was interrupted, and goes on; first: the student of the demonstrations alone, if it is there already.
    """
    if session is None:
        student = first or Student.learn(demonstrations, seed=options.seed, epochs=options.epochs)
        session = Cloning(demonstrations, student, _mentor(roll_out, demonstrations, [], student, options, 0))
        session.measured.append(_measure(roll_out, session, options))
        yield session
    while len(session.measured) <= options.rounds:
        number = len(session.measured)
        _correct(roll_out, session, options, number, hears or Hears())
        session.student = Student.learn(
            demonstrations, session.corrections, seed=options.seed + number, epochs=options.epochs
        )
        judge = session.mentor.judge
        session.mentor = _mentor(roll_out, demonstrations, session.corrections, session.student, options, number)
        session.mentor.judge = judge
        session.measured.append(_measure(roll_out, session, options))
        yield session


def _mentor(
    roll_out: RollsOut,
    demonstrations: Recording,
    corrections: Sequence[Episode],
    student: Student,
    options: CloningOptions,
    number: int,
) -> Mentor:
    """A mentor of the student's own data, calibrated by rollouts of this student without a teacher."""
    recording = Recording(
        demonstrations.fps,
        demonstrations.robot,
        demonstrations.state_names,
        demonstrations.action_names,
        [*demonstrations.episodes, *(_corrections_alone(episode) for episode in corrections)],
    )
    if options.rule in UNCALIBRATED:
        return Mentor.learn(recording, options.rule, seed=options.seed)
    if options.rule in ("random", "clock"):
        mentor, often = Mentor.learn(recording, options.rule, seed=options.seed), options.every_steps
        mentor.threshold = 1.0 - 1.0 / often if options.rule == "random" else often - 1.5  # the clock counts from 0
        return mentor
    seeds = seeds_for(options, CALIBRATING, options.calibrated, number)
    rollouts = [student.planned(roll_out(student, seed)) for seed in seeds]
    rule, (learned, others) = options.rule, parted(options.rule, rollouts)
    if DOUBTS[rule].make.learns_from_rollouts and len({episode.success for episode in learned}) < 2:
        rule = "distance"  # all rollouts failed, or none
    mentor = Mentor.learn(recording, rule, rollouts=learned, seed=options.seed)
    well = [episode for episode in others if episode.success]
    if (len(well) + 1) * options.false_alarms >= 1.0:
        return mentor.calibrate(others, false_alarms=options.false_alarms)
    mentor.threshold = max(
        (mentor.peak(episode) for episode in well), default=-np.inf
    )  # a promise takes more successes
    return mentor


def _corrections_alone(episode: Episode) -> Episode:
    """An episode of which only the corrected steps count as demonstrated, whether or not it succeeded."""
    return episode.part(0, len(episode), success=False)


def _correct(roll_out: RollsOut, session: Cloning, options: CloningOptions, number: int, hears: Hears) -> None:
    """Adds the episodes of a round in which the teacher took over; no more episodes once all questions are asked."""
    begun, session.begun = session.begun, []
    left = options.questions if options.rule != "never" else 0
    for place, seed in enumerate(seeds_for(options, CORRECTING, options.episodes, number)):
        if left <= 0 or session.mentor.judge.rejects:
            return
        if begun and place <= begun[-1].place:  # before the interruption
            corrected = next((one for one in begun if one.place == place), None)
        else:
            asks = Asking(session.mentor, session.student, left, options.takeover_steps, hears.question)
            episode = roll_out(session.student, seed, asks=asks)
            corrected = Corrected(place, asks.questions, episode) if asks.questions else None
            if corrected is not None:
                hears.corrected(corrected)
        if corrected is not None:
            left -= corrected.questions
            session.questions += corrected.questions
            session.corrections.append(corrected.episode)


class Asking:
    """The teacher takes over for some steps when the mentor asks, as long as questions are left."""

    def __init__(
        self,
        mentor: Mentor,
        student: Student,
        questions_left: int,
        takeover_steps: int,
        on_question: Callable[[Question], None] = lambda question: None,
    ) -> None:
        self.mentor, self.student, self.on_question = mentor, student, on_question
        self.questions, self.questions_left, self.takeover_steps = 0, questions_left, takeover_steps
        self._taken = 0  # steps that are left of the takeover
        self._gave_last = False
        mentor.begin()

    def __call__(self, observation: Any, action: Action) -> bool:
        asks = self.mentor(observation, action, chunk=self.student.plan(observation), corrected=self._gave_last)
        if self._taken == 0 and asks and self.questions < self.questions_left:
            self.questions += 1
            self._taken = self.takeover_steps
            self.on_question(asks)
        self._gave_last = self._taken > 0
        self._taken -= self._gave_last
        return self._gave_last


def _measure(roll_out: RollsOut, session: Cloning, options: CloningOptions) -> Measured:
    """The student in the episodes that are kept for this, and what its mentor would have asked in them."""
    mentor, judge = session.mentor, session.mentor.judge
    seeds = seeds_for(options, EVALUATING, options.evaluated)
    episodes = [session.student.planned(roll_out(session.student, seed)) for seed in seeds]
    asked = [np.flatnonzero(mentor.doubts(episode) > mentor.threshold) for episode in episodes]
    warned = [
        len(episode) - int(steps[0])
        for episode, steps in zip(episodes, asked, strict=True)
        if len(steps) and not episode.success
    ]
    return Measured(
        len(session.measured),
        tuple(bool(episode.success) for episode in episodes),
        session.questions,
        int(sum(episode.corrected.sum() for episode in session.corrections)),
        len(warned),
        sum(bool(episode.success and len(steps)) for episode, steps in zip(episodes, asked, strict=True)),
        tuple(warned),
        mentor.promise,
        judge.helped,
        judge.judged,
        judge.rejects,
        mentor.rule,
    )
