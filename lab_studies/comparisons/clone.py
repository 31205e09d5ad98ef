"""When a clone should ask: rules of doubt against asking at random, at fixed times, always and never, at equal questions."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from pydantic import TypeAdapter

from lab.cloning.rounds import Asks, CloningOptions, Measured, Policy, RollsOut, cloned
from lab.cloning.skill_problem import SkillProblem
from lab.cloning.student import Student
from lab.recordings.episode import Episode, Recording
from lab.studies.charts import legend_below
from lab.studies.findings import Findings, Row, mean_row, row, share_row, those
from lab.studies.runner import Job, seeds_of
from lab.view.canvas import BLUE, GREEN, GREY, INK, ORANGE, PURPLE, RED, SKY, picture_bytes

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SKILLS = {
    "grasp": 6.0,
    "place": 6.0,
    "transfer": 14.0,
}  # the seconds until an episode is cut; the teacher takes about half
DOUBTING = ("distance", "discrepancy", "ensemble", "chunk", "progress", "failure")
RIVALS = ("random", "clock", "always", "never")
OPTIONS = CloningOptions(rounds=2, questions=10, calibrated=12, evaluated=30, false_alarms=0.2)
NOISE = 0.1  # of each action, as a share of the commanded velocity
ALL = "all"  # the sessions of every skill
GOAL = 0.9  # the share of successes whose questions are counted
MOST = OPTIONS.rounds * OPTIONS.questions  # questions
MEASURES = (
    "A student is cloned from {demonstrations} demonstrations of a skill, whose episodes are cut after {seconds}. In "
    "each of {rounds} rounds it may ask {questions} times; the scripted teacher then takes over for {takeover_steps} "
    "steps of 0.1 s, and the student learns the corrections. The clock asks every {every_steps} steps. "
    "success_percent: of {evaluated} episodes without a "
    "teacher, the same after each round and in nothing else used. questions: so far. gain_percent: success_percent "
    "above what a rival reaches in the same session with as many questions (interpolated linearly; after the same round "
    "if the rival asked fewer). "
    "warned_percent: failures in which the rule would have asked; false_alarms_percent: successes in which it would "
    "have asked, of which {false_alarms:.0%} were allowed, where the threshold was promised. lead_s: from the first "
    "question to the end of a failed episode. questions_to_90: until 90 % are reached for good, that is in this round and all "
    "that follow; a session in which they are not counts with one question more than all rounds allow. "
    "reached_90_percent: sessions in which they are."
)


@dataclass(frozen=True)
class Session:
    """One session of every rule, which all begin with the same student."""

    skill: str
    seed: int


Results = dict[str, list[Measured]]  # by rule: after each round
_RESULTS = TypeAdapter(dict[str, list[Measured]])


def clone(job: Job, reading: Mapping[str, Any]) -> Findings:
    """The results of every rule and skill; a session is a seed, and the reading has no effect."""
    sessions = [
        Session(skill, int(seed % 2**31))
        for skill in SKILLS
        for seed in seeds_of(_Skill(skill), job.sessions, job.seed)
    ]
    done: dict[Session, Results] = job.kept_as(_kept)
    missing = [session for session in sessions if session not in done]
    job.progress(len(sessions) - len(missing), len(sessions))
    for session, results in job.computed(results_of, missing, most=1):
        done[session] = results
        job.keep(asdict(session) | {"results": _RESULTS.dump_python(results, mode="json")})
        job.progress(len(done), len(sessions))
    of_skill = {skill: [done[session] for session in sessions if session.skill == skill] for skill in SKILLS}
    of_skill[ALL] = [results for several in [*of_skill.values()] for results in several]
    rows = [one for skill, results in of_skill.items() for one in rows_of(skill, results)]
    says: Row = {}
    for skill in of_skill:
        for rule in (*DOUBTING, "clock"):
            gains = those(rows, skill=skill, rule=rule, round=OPTIONS.rounds, measure="gain_percent")
            says[f"{skill}: {rule} at equal questions [points of success]"] = ", ".join(
                "{value:.1f} ({ci95[0]:.1f} to {ci95[1]:.1f}) over {against}".format_map(gain) for gain in gains
            )
    limits = ", ".join(f"{seconds:g} s ({skill})" for skill, seconds in SKILLS.items())
    pictures = {f"Success against questions, {skill}": _picture(those(rows, skill=skill)) for skill in SKILLS}
    return Findings(rows, says, pictures, (MEASURES.format(**asdict(OPTIONS), seconds=limits),))


@dataclass(frozen=True)
class _Skill:
    """The setting from which the seeds of its sessions are drawn."""

    skill: str


def _kept(record: Any) -> tuple[Session, Results]:
    results = _RESULTS.validate_python(record.pop("results"), strict=False)
    return Session(**record), results


def results_of(session: Session) -> Results:
    """The measurements of every rule in a session in physics."""
    problem = SkillProblem("toast", session.skill, NOISE, SKILLS[session.skill])
    options = replace(OPTIONS, seed=session.seed)
    try:
        return rules_tried(problem, problem.demonstrated(options), options)
    finally:
        problem.close()


def rules_tried(roll_out: RollsOut, demonstrations: Recording, options: CloningOptions) -> Results:
    """The measurements of every rule, each of which begins with the same student."""
    alone = _Remembered(roll_out)
    first = Student.learn(demonstrations, seed=options.seed, epochs=options.epochs)
    results = {}
    for rule in (*DOUBTING, *RIVALS):
        *_, last = cloned(alone, demonstrations, replace(options, rule=rule), first=first)
        results[rule] = last.measured
    return results


class _Remembered:
    """Rollouts without a teacher, made once for each student and seed."""

    def __init__(self, roll_out: RollsOut) -> None:
        self.roll_out = roll_out
        self._known: dict[tuple[int, int], tuple[Policy, Episode]] = {}  # the policy stays, and so does its id

    def __call__(self, policy: Policy, seed: int, *, asks: Asks | None = None) -> Episode:
        if asks is not None:
            return self.roll_out(policy, seed, asks=asks)
        key = id(policy), seed
        if key not in self._known:
            self._known[key] = policy, self.roll_out(policy, seed)
        return self._known[key][1]


def rows_of(skill: str, sessions: Sequence[Results]) -> list[Row]:
    """The measures of every rule after every round, over the sessions of a skill."""
    rows = []
    for rule in (*DOUBTING, *RIVALS):
        for number in range(len(sessions[0][rule])):
            named: Row = {"skill": skill, "rule": rule, "round": number}
            measured = [results[rule][number] for results in sessions]
            rows.append(mean_row(named, "success_percent", [100.0 * one.success for one in measured]))
            rows.append(row(named, "questions", float(np.mean([one.questions for one in measured]))))
            for rival in RIVALS:
                if rival != rule:
                    gains = [100.0 * _gain(results[rule][number], results[rival]) for results in sessions]
                    rows.append(mean_row(named | {"against": rival}, "gain_percent", gains))
            rows += _of_mentor(named, measured)
        overall: Row = {"skill": skill, "rule": rule, "round": None}
        reached = [_questions_to(results[rule]) for results in sessions]
        rows.append(mean_row(overall, "questions_to_90", [MOST + 1 if one is None else one for one in reached]))
        rows.append(share_row(overall, "reached_90_percent", [one is not None for one in reached]))
    return rows


def _gain(mine: Measured, rival: Sequence[Measured]) -> float:
    """The success above that of a rival in the same session, with as many questions or after the same round."""
    if rival[mine.round].questions <= mine.questions:
        return mine.success - rival[mine.round].success
    asked, reached = [one.questions for one in rival], [one.success for one in rival]
    return mine.success - float(np.interp(mine.questions, asked, reached))


def _of_mentor(named: Row, measured: Iterable[Measured]) -> list[Row]:
    """What the mentors would have asked in all episodes of a round, and how long before failures."""
    measured = [*measured]
    failures = sum(one.successes.count(False) for one in measured)
    promised = [one for one in measured if one.promise is not None]
    successes = sum(one.successes.count(True) for one in promised)
    leads = [0.1 * steps for one in measured for steps in one.lead_steps]
    rows = []
    if failures:
        rows.append(row(named, "warned_percent", 100.0 * sum(one.warned for one in measured) / failures))
    if successes:
        rows.append(row(named, "false_alarms_percent", 100.0 * sum(one.false_alarms for one in promised) / successes))
    if leads:
        rows.append(row(named, "lead_s", float(np.median(leads))))
    return rows


def _questions_to(measured: Sequence[Measured]) -> int | None:
    """The questions until GOAL was reached for good; None if it was not."""
    missed = [one.round for one in measured if one.success < GOAL]
    first = missed[-1] + 1 if missed else 0
    return measured[first].questions if first < len(measured) else None


def _picture(rows: Sequence[Row]) -> bytes:
    """A picture of success against questions, a line for each rule but "always", whose questions are those of every step."""
    colours = (BLUE, ORANGE, GREEN, PURPLE, RED, SKY)
    looks = dict(zip(DOUBTING, colours, strict=True)) | {"random": INK, "clock": GREY}

    def draw(figure: "Figure") -> None:
        axes = figure.add_subplot()
        for rule, colour in looks.items():
            at = [
                (asked["value"], success["value"])
                for asked, success in zip(
                    those(rows, rule=rule, measure="questions"),
                    those(rows, rule=rule, measure="success_percent"),
                    strict=True,
                )
            ]
            line = "o--" if rule in RIVALS else "o-"
            axes.plot(*zip(*at, strict=True), line, color=colour, label=rule, markersize=4, linewidth=1.3)
        never = those(rows, rule="never", round=OPTIONS.rounds, measure="success_percent")[0]["value"]
        axes.axhline(never, color=GREY, linestyle=":", linewidth=1.3, label="never, at the end")
        axes.set(xlabel="questions", ylabel="successful episodes [%]", xlim=(0, None), ylim=(0, 102))
        axes.grid()
        legend_below(figure)

    return picture_bytes(draw, 7.0, 4.2)
