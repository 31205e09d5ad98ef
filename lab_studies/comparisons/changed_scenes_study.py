"""The worth of skills learned in one scene in changed scenes, compared with learning everything anew there."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

from lab.learning.problem import Problem
from lab.mdp import greedy_path
from lab.skills.prepared_scene import Prepared, prepare
from lab.studies.charts import bars
from lab.studies.findings import Findings, Row, row, share_row, those, varying_row
from lab.studies.runner import Job
from lab.tasks.task_file import load
from lab.teaching.lesson_plan import Lesson
from lab.toolbox.policy import Policy
from lab_studies.comparisons.changed_scenes import KINDS, Scene, survey_of_scene
from lab_studies.comparisons.skills_taught import (
    Known,
    distinct_problems,
    is_failing,
    lesson_cost,
    policy_key,
    reaches_goals,
    taught_skills,
)

TASK, TOASTS = "toast", 3
WAYS = ("the same", "used", "adapted", "refused", "learned")  # what becomes of a skill in a changed scene

ABOUT = (
    f"{{}} changed scenes of the task '{TASK}', equally many of each kind; the skills were learned in the scene of seed 0, all "
    "with the advisor 'expert'. In each scene all skills are reused, fine-tuned or learned, and for comparison all are learned "
    "from scratch. A problem that several skills share counts once. {} scenes could not be surveyed (bodies overlap, or no path "
    "leads to one) and were drawn again."
)
COLUMNS = (
    "The same: exactly the problem that the policy was learned in. Used: another problem, in which its paths are free and "
    "shortest. Adapted: fine-tuned from it. Refused: learned from scratch, though there was a policy with the same states and "
    "moves. Learned: there was none. saved_percent: of the episodes that learning from scratch took for the same skills."
)
CHECKS = (
    "Checks that play no part in the verdict: accepted_failing: policies used as they are that miss the goal from a start "
    "step by step, or fail when they are carried out in physics (all are; grasps also before they are used); "
    "refused_working: skills whose policies were rejected although one of the toolbox leads from all starts to the goal; "
    "longer: skills whose path is longer than the one learned from scratch; success: skills that reach their goals."
)


@dataclass(frozen=True)
class Tally:
    """The results of a scene's skills with the same source; wall_s: time [s] for finding or learning them.

    anew: episodes and helped steps from scratch.
    """

    skills: int
    episodes: int
    helped_steps: int
    wall_s: float
    anew: tuple[int, int]


@dataclass(frozen=True)
class Outcome:
    """The results of one changed scene, by `WAYS`, and the numbers of skills by check (see CHECKS).

    unsolved: skills without a path to the goal, as found or learned here, and as learned from scratch.
    """

    words: str
    refused_draws: int
    tallies: dict[str, Tally]
    accepted_failing: int
    adapted_failing: int
    refused_working: int
    longer: int
    unsolved: tuple[int, int]


def changed_scenes(job: Job, reading: Mapping[str, Any]) -> Findings:
    """The results of changed scenes, equally many of each kind; the reading has no effect."""
    kinds = [*KINDS]
    scenes = [Scene(kinds[number % len(kinds)], number // len(kinds), job.seed) for number in range(job.sessions)]
    outcomes = job.each(scene_outcome, scenes)
    rows = [
        result
        for kind in (None, *KINDS)
        for result in rows_of(kind, [outcomes[s] for s in scenes if kind in (None, s.kind)])
    ]
    rows += [result for order, scene in enumerate(scenes, 1) for result in rows_of_scene(order, scene, outcomes[scene])]
    drawn_again = sum(outcome.refused_draws for outcome in outcomes.values())
    notes = (ABOUT.format(len(scenes), drawn_again), COLUMNS, CHECKS)
    return Findings(rows, in_short(rows), {"What becomes of a skill": _picture(rows)}, notes)


@lru_cache(maxsize=1)
def original_scene() -> tuple[Prepared, Known, Known]:
    """The original scene, the policies that a run learns in it, and those of each problem learned from scratch.

    Both by (sub-task, signature), and the same in each process.
    """
    task = load(TASK)
    prepared = prepare(task, task.order(TOASTS), 0)
    problems = distinct_problems(prepared)
    lessons = [skill.lesson for skill in taught_skills(prepared, {}, problems)]
    anew = {policy_key(problem): _from_scratch(prepared, problem) for problem in problems}
    return prepared, {(skill.policy.subtask, skill.policy.signature): skill.policy for skill in lessons}, anew


def scene_outcome(scene: Scene) -> Outcome:
    """The outcome of one changed scene, with the policies learned before and from scratch."""
    base, known, learned = original_scene()
    prepared, words, refused = survey_of_scene(scene, base.task, base.layout, base.seed, base.order)
    problems = distinct_problems(prepared)
    here = taught_skills(prepared, known, problems)
    anew = [learned.get(policy_key(problem)) or _from_scratch(prepared, problem) for problem in problems]
    ways = [_fate(skill.lesson) for skill in here]
    tallies = {}
    for way in WAYS:
        own = [n for n, met in enumerate(ways) if met == way]
        costs = [lesson_cost(here[n].lesson) for n in own]
        tallies[way] = Tally(
            len(own),
            sum(episodes for episodes, _ in costs),
            sum(helped for _, helped in costs),
            sum(here[n].wall_s for n in own),
            (sum(len(anew[n].curve) for n in own), sum(anew[n].helped_steps for n in own)),
        )
    lessons = [skill.lesson for skill in here]
    failing = [is_failing(prepared, problem, lesson.policy) for problem, lesson in zip(problems, lessons, strict=True)]
    return Outcome(
        words,
        refused,
        tallies,
        accepted_failing=sum(fails for fails, way in zip(failing, ways, strict=True) if way == "used"),
        adapted_failing=sum(fails for fails, way in zip(failing, ways, strict=True) if way == "adapted"),
        refused_working=sum(
            _any_works(known, problem) for problem, way in zip(problems, ways, strict=True) if way == "refused"
        ),
        longer=sum(
            _moves(problem, lesson.policy) > _moves(problem, policy)
            for problem, lesson, policy in zip(problems, lessons, anew, strict=True)
        ),
        unsolved=(
            sum(not reaches_goals(problem, lesson.policy) for problem, lesson in zip(problems, lessons, strict=True)),
            sum(not reaches_goals(problem, policy) for problem, policy in zip(problems, anew, strict=True)),
        ),
    )


def _from_scratch(prepared: Prepared, problem: Problem) -> Policy:
    """The policy that is learned for a problem from scratch."""
    return taught_skills(prepared, {}, [problem])[0].lesson.policy


def _fate(lesson: Lesson) -> str:
    if lesson.source == "reused":
        return "the same" if lesson.fitness is None else "used"
    if lesson.source == "adapted":
        return "adapted"
    return "learned" if lesson.fitness is None else "refused"


def _any_works(known: Known, problem: Problem) -> bool:
    return any(reaches_goals(problem, policy) for (subtask, _), policy in known.items() if subtask == problem.subtask)


def _moves(problem: Problem, policy: Policy) -> int:
    """The moves of the greedy path from the problem's start."""
    return len(greedy_path(policy.q, problem.mdp, problem.mdp.n_states)[1])


def rows_of(kind: str | None, outcomes: Sequence[Outcome]) -> list[Row]:
    """The measures of the scenes of one kind; None: of all kinds."""
    if not outcomes:
        return []
    named: Row = {"kind": kind or "all", "scenes": len(outcomes)}
    skills = sum(_sum(outcomes, way) for way in WAYS)
    rows = [_share(named | {"source": way}, "skills_percent", _sum(outcomes, way), skills) for way in WAYS]
    for measure, ways in (("saved", WAYS), ("saved_in_changed_problems", WAYS[1:])):
        for number, what in enumerate(("episodes", "helped_steps")):
            spent = [sum(getattr(outcome.tallies[way], what) for way in ways) for outcome in outcomes]
            anew = [sum(outcome.tallies[way].anew[number] for way in ways) for outcome in outcomes]
            shares = [100.0 * (1 - now / then) for now, then in zip(spent, anew, strict=True) if then]
            rows += _mean(named, f"{measure}_{what}_percent", shares)
    rows += [
        _share(named, f"{what}_percent", sum(getattr(outcome, what) for outcome in outcomes), _sum(outcomes, way))
        for what, way in (("accepted_failing", "used"), ("adapted_failing", "adapted"), ("refused_working", "refused"))
    ]
    return [
        *rows,
        _share(named, "longer_percent", sum(outcome.longer for outcome in outcomes), skills),
        _share(named, "success_percent", skills - sum(outcome.unsolved[0] for outcome in outcomes), skills),
        _share(
            named | {"source": "all anew"}, "success_percent", skills - sum(o.unsolved[1] for o in outcomes), skills
        ),
    ]


def rows_of_scene(order: int, scene: Scene, outcome: Outcome) -> list[Row]:
    """The results of one scene, a row for each of WAYS that a skill took in it."""
    return [
        row(
            {
                "order": order,
                "kind": scene.kind,
                "task": f"{TASK}: {outcome.words}",
                "source": way,
                "episodes": tally.episodes,
                "helped_steps": tally.helped_steps,
                "wall_s": round(tally.wall_s, 3),
                "saved_percent": 100.0 * (1 - tally.episodes / tally.anew[0]),
                "episodes_anew": tally.anew[0],
                "helped_steps_anew": tally.anew[1],
            },
            "skills",
            tally.skills,
        )
        for way, tally in outcome.tallies.items()
        if tally.skills
    ]


def _sum(outcomes: Sequence[Outcome], way: str) -> int:
    return sum(outcome.tallies[way].skills for outcome in outcomes)


def _share(named: Row, measure: str, count: int, of: int) -> Row:
    """`count` of `of` in percent, with an interval; 0 without one if there are none."""
    return (
        share_row(named | {"of": of}, measure, [True] * count + [False] * (of - count))
        if of
        else row(named, measure, 0)
    )


def _mean(named: Row, measure: str, values: Sequence[float]) -> list[Row]:
    if len(values) < 2:
        return [row(named, measure, value) for value in values]
    return [varying_row(named, measure, values)]


def in_short(rows: Sequence[Row]) -> Row:
    """The figures over all scenes."""
    says = {}
    for result in those(rows, kind="all"):
        name = " ".join(filter(None, (result.get("source", ""), result["measure"])))
        says[name] = round(result["value"], 2)
    return says


def _picture(rows: Sequence[Row]) -> bytes:
    """A picture with bars by kind, a bar for each of WAYS."""
    kinds = [kind for kind in KINDS if those(rows, kind=kind, measure="skills_percent")]
    lines = {way: [those(rows, kind=kind, source=way, measure="skills_percent")[0] for kind in kinds] for way in WAYS}
    return bars(kinds, lines, "skills [%]")
