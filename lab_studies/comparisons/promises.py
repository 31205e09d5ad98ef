"""Whether a mentor keeps its promises: false alarms and failures caught in held-out rollouts of a clone, for each rule."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from lab.cloning.rounds import EVALUATING, CloningOptions, RollsOut, seeds_for
from lab.cloning.skill_problem import SkillProblem
from lab.cloning.student import Student
from lab.errors import BadInput
from lab.mentor.conformal import few_false_alarms, many_caught
from lab.mentor.mentor import Mentor
from lab.recordings.episode import Episode, Recording
from lab.studies.findings import Findings, Row, mean_row, those
from lab.studies.runner import Job, seeds_of
from lab_studies.comparisons.clone import DOUBTING, NOISE

SKILLS = ("grasp", "place")
RULES = (*DOUBTING, "clock", "random")
OPTIONS = CloningOptions()
ROLLOUTS, LEARNED_FROM = 200, 40  # of a student, and of them those from which the rule "failure" learns
CALIBRATED, SPLITS = 19, 200  # episodes of a kind that calibrate, and how often they are drawn
PROMISED = ((0.1, 0.9), (0.2, 0.8))  # false alarms, failures caught
STEP_S = 0.1
MEASURES = (
    "A student that was cloned from {demonstrations} demonstrations acts in {rollouts} episodes without a teacher. A "
    "mentor is calibrated by {calibrated} drawn successes (or failures) and judged by all the other ones of that kind; "
    "{splits} draws. false_alarms_percent: successes with an alarm, where at most so many were promised; caught_percent: "
    "failures with an alarm, where at least so many were; caught_at_percent: failures with an alarm at the threshold of "
    "that share of false alarms, which nobody promised; lead_s: from that alarm to the end of the failed episode, the "
    "median."
)


@dataclass(frozen=True)
class Kept:
    """A student of a skill by its seed."""

    skill: str
    seed: int


@dataclass(frozen=True)
class _Skill:
    """The setting from which the seeds of its students are drawn."""

    skill: str


Measured = dict[tuple[str, float, str], float]  # by rule, promised share and measure


def promises(job: Job, reading: Mapping[str, Any]) -> Findings:
    """The shares of every rule and promise; a session is a student, and the reading has no effect."""
    students = [
        Kept(skill, int(seed % 2**31)) for skill in SKILLS for seed in seeds_of(_Skill(skill), job.sessions, job.seed)
    ]
    found = job.each(partial(student_measured, rollouts=ROLLOUTS), students)
    rows = [row for skill in SKILLS for row in rows_of(skill, [found[one] for one in students if one.skill == skill])]
    says: Row = {}
    for alarms, caught in PROMISED:
        for measure, share in (("false_alarms_percent", alarms), ("caught_percent", caught)):
            shares = [one["value"] for one in those(rows, promised=share, measure=measure)]
            says[f"{measure} where {share:.0%} was promised, over rules and skills"] = (
                f"{min(shares):.1f} to {max(shares):.1f}"
            )
    text = MEASURES.format(
        demonstrations=OPTIONS.demonstrations, rollouts=ROLLOUTS, calibrated=CALIBRATED, splits=SPLITS
    )
    return Findings(rows, says, {}, (text,))


def student_measured(student: Kept, rollouts: int) -> Measured:
    """The shares of every rule for a student in physics."""
    problem, options = SkillProblem("toast", student.skill, NOISE), replace(OPTIONS, seed=student.seed)
    try:
        return kept_by_rules(problem, problem.demonstrated(options), options, rollouts)
    finally:
        problem.close()


def kept_by_rules(roll_out: RollsOut, shown: Recording, options: CloningOptions, rollouts: int) -> Measured:
    """The shares of every rule, in rollouts of a student of `shown`; a rule without enough episodes of a kind has none."""
    student = Student.learn(shown, seed=options.seed, epochs=options.epochs)
    episodes = [student.planned(roll_out(student, seed)) for seed in seeds_for(options, EVALUATING, rollouts)]
    learned, others = episodes[: LEARNED_FROM * rollouts // ROLLOUTS], episodes[LEARNED_FROM * rollouts // ROLLOUTS :]
    measured: Measured = {}
    for rule in RULES:
        try:
            mentor = Mentor.learn(shown, rule, rollouts=learned, seed=options.seed)
        except BadInput:  # the failure predictor, if all have failed or none has
            continue
        measured |= {(rule, *key): value for key, value in shares_of(mentor, others, options.seed).items()}
    return measured


def shares_of(mentor: Mentor, episodes: Sequence[Episode], seed: int) -> dict[tuple[float, str], float]:
    """The measures of a mentor by promised share, over drawn splits of the episodes."""
    doubts = {success: [mentor.doubts(one) for one in episodes if one.success is success] for success in (True, False)}
    well, failed = (np.array([one.max() for one in doubts[success]]) for success in (True, False))
    rng = np.random.default_rng(seed)
    found: dict[tuple[float, str], list[float]] = {}
    for _ in range(SPLITS):
        for alarms, caught in PROMISED:
            if len(well) > CALIBRATED:
                order = rng.permutation(len(well))
                threshold = few_false_alarms(well[order[:CALIBRATED]].tolist(), alarms).threshold
                held_out = well[order[CALIBRATED:]]
                found.setdefault((alarms, "false_alarms_percent"), []).append(
                    100.0 * float((held_out > threshold).mean())
                )
                if len(failed):
                    found.setdefault((alarms, "caught_at_percent"), []).append(
                        100.0 * float((failed > threshold).mean())
                    )
                    leads = [
                        len(one) - int(np.argmax(one > threshold)) for one in doubts[False] if one.max() > threshold
                    ]
                    found.setdefault((alarms, "lead_s"), []).extend([STEP_S * float(np.median(leads))] if leads else [])
            if len(failed) > CALIBRATED:
                order = rng.permutation(len(failed))
                threshold = many_caught(failed[order[:CALIBRATED]].tolist(), caught).threshold
                share = float((failed[order[CALIBRATED:]] > threshold).mean())
                found.setdefault((caught, "caught_percent"), []).append(100.0 * share)
    return {key: float(np.mean(values)) for key, values in found.items() if values}


def rows_of(skill: str, students: Sequence[Measured]) -> list[Row]:
    """A row for each rule, promise and measure: the mean over the students for which it is known."""
    keys = dict.fromkeys(key for student in students for key in student)
    rows = []
    for rule, promised, measure in keys:
        values = [student[rule, promised, measure] for student in students if (rule, promised, measure) in student]
        if len(values) > 1:
            rows.append(mean_row({"skill": skill, "rule": rule, "promised": promised}, measure, values))
    return rows
