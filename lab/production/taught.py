"""What a run knows how to do: its skills, found or learned, and how long moves take; and both again when the scene changes.

`teach_all` is called before a run. `Relearner` is called in the middle of one: it surveys a scene that has changed, and
fine-tunes the skills whose problem has changed from their old tables.
"""

from collections.abc import Callable, MutableMapping
from dataclasses import asdict, dataclass, replace
from typing import Any

from lab.errors import BadInput, LabError
from lab.learning.problem import Problem
from lab.production.durations import RECORDS, Durations, cell_of, durations_key, kept_durations, measure
from lab.production.floor import Floor
from lab.production.run_journal import DurationsKept, RunJournal
from lab.sequencing.cell.cell import Cell
from lab.sim.parts.kinds import Spot
from lab.sim.scene.places import Layout, Places
from lab.sim.scene.scene_check import check_scene
from lab.skills.prepared_scene import Prepared, scene_in_words
from lab.skills.skillset import SkillSet
from lab.skills.surveys import Surveys
from lab.skills.trial import trial_of
from lab.tasks.task import Task
from lab.teaching.events import MoveTimed, PhaseBegan, RecordSkipped, ScenePrepared, SkillReady
from lab.teaching.lesson_plan import Lesson, LessonPlan
from lab.teaching.teacher import Teacher
from lab.toolbox.index import KnownPolicies
from lab.workers import Workers

SAME_SPOT_M = 0.001


@dataclass
class Taught:
    """A prepared task whose skills are all there, with the durations of its moves and the cell that they make.

    rows: each skill as `lab run --json` shows it. durations_key: under which they are kept; "": they are not.
    """

    lessons: dict[str, Lesson]
    rows: dict[str, dict[str, Any]]
    durations: Durations
    cell: Cell
    durations_key: str = ""


def skill_row(name: str, lesson: Lesson) -> dict[str, Any]:
    """What the document says of a skill: where it came from, why, and what it took."""
    policy, result = lesson.policy, lesson.result
    return {
        "name": name,
        "subtask": policy.subtask,
        "source": lesson.source,
        "from_task": lesson.from_task or None,
        "reason": lesson.reason,
        "policy": policy.name,
        "parent": policy.parent,
        "saved_episodes": lesson.saved[0],
        "saved_helped_steps": lesson.saved[1],
        "fitness": None if lesson.fitness is None else asdict(lesson.fitness),
        "episodes": 0 if result is None else len(result.steps),
        "moves": 0 if result is None else int(result.visits.sum()),
        "requests": 0 if result is None else result.requests,
        "helped_steps": 0 if result is None else result.helped_steps,
        "rejected_at_episode": None if result is None else result.rejected_at_episode,
        "optimal_steps": lesson.steps[1],
        "final_steps": lesson.steps[0],
        "solved": policy.solved,
    }


def teach_all(
    prepared: Prepared,
    teacher: Teacher,
    journal: RunJournal | None = None,
    again: Callable[[LessonPlan], object] | None = None,
    workers: Workers | None = None,
) -> Taught:
    """Every skill of a prepared task, found or learned, and the durations of every move, found or measured.

    journal: of a run that is resumed; the skills and durations that it holds are taken from it. again: called for each lesson
    of that run that is over; BadInput where its own journal cannot be read. workers: who shares in the timing; None: nobody.
    """
    task, skillset, journal = prepared.task, prepared.skillset, journal or RunJournal()
    teacher = replace(teacher, trial=trial_of(prepared))
    known, damaged = teacher.toolbox.index()
    known = journal.known_at_first(known)
    for what in damaged:
        teacher.tell(RecordSkipped(what))
    teacher.tell(ScenePrepared(prepared))
    teacher.tell(PhaseBegan("learn", len(prepared.problems)))
    lessons, rows = dict[str, Lesson](), dict[str, dict[str, Any]]()
    first = dict[str, str]()  # by sub-task and signature, the skill that it was first found or learned for
    for name, problem in prepared.problems.items():
        kept, same = journal.skill(name), first.setdefault(f"{problem.subtask} {problem.mdp.signature}", name)
        settings = task.subtask(problem.subtask)
        plan = LessonPlan(problem, settings.learner, settings.gate, task.name)
        if kept is not None:
            if again is not None and kept.row["source"] != "reused":
                try:
                    again(plan)
                except BadInput as error:  # the policy is there: only what it was worth is not known
                    teacher.tell(RecordSkipped(f"what was said about '{name}': {error}"))
            lesson, row = Lesson(kept.policy, "reused", reason="it was there before this run was stopped"), kept.row
        else:
            lesson = teacher.find_or_teach(plan, known)
            if same != name and lesson.source == "reused":  # it would have been learned only once
                lesson = replace(lesson, reason=f"it is the same problem as '{same}'", saved=(0, 0))
            row = skill_row(name, lesson)
            journal.keep_skill(row, lesson.policy)
        known[problem.subtask, lesson.policy.signature] = lesson.policy
        skillset.policies[name] = lesson.policy
        lessons[name], rows[name] = lesson, row
        teacher.tell(SkillReady(name, lesson))
    durations, key = _durations(prepared, teacher, journal, workers)
    return Taught(lessons, rows, durations, cell_of(task, durations, prepared.order), key)


def _durations(
    prepared: Prepared, teacher: Teacher, journal: RunJournal, workers: Workers | None
) -> tuple[Durations, str]:
    """The durations measured earlier for exactly these policies in exactly this scene, or measured now and kept; their key.

    The key is "" where they cannot be kept.
    """
    skillset, key, kept = prepared.skillset, "", None
    try:
        key = durations_key(prepared.task, prepared.layout, skillset, skillset.policies, prepared.order)
        record = journal.durations()
        if record is not None:
            return replace(Durations.from_json(record.times, skillset), sim_s=record.sim_s), key
        kept = kept_durations(teacher.toolbox, key, skillset)
    except LabError as error:  # then they are measured: nothing is lost but time
        teacher.tell(RecordSkipped(f"durations measured earlier: {error}"))
    if kept is None:
        works = sum(bool(skills) for skills in (*skillset.processes.values(), *skillset.services.values()))
        teacher.tell(PhaseBegan("measure", len(skillset.legs) + len(skillset.travels) + works))
        kept = measure(prepared, lambda name, seconds: teacher.tell(MoveTimed(name, seconds)), workers)
        if key:
            try:
                teacher.toolbox.save_record(RECORDS, key, kept.to_json())
            except LabError as error:  # they are measured again: nothing is lost but time
                teacher.tell(RecordSkipped(f"the durations: {error}"))
    journal.write(DurationsKept(kept.to_json(), kept.sim_s))
    return kept, key


@dataclass(frozen=True)
class Relearned:
    """What is prepared and taught in the changed scene, and the skills whose problem is another there."""

    prepared: Prepared
    taught: Taught
    again: tuple[str, ...]


@dataclass
class Relearner:
    """Learns in the middle of a run what changed in its scene.

    prepared, taught: the scene and what is taught in it, as they are after the last change.
    """

    prepared: Prepared
    taught: Taught
    teacher: Teacher

    def learn(self, scene: tuple[Task, Layout]) -> Cell:
        """The cell of the changed scene, once its skills are learned. Raises BadInput as `relearned` does."""
        learned = relearned(self.prepared, self.taught, scene, self.teacher)
        self.prepared, self.taught = learned.prepared, learned.taught
        return learned.taught.cell


def relearned(prepared: Prepared, taught: Taught, scene: tuple[Task, Layout], teacher: Teacher) -> Relearned:
    """What is prepared and taught once the scene, as it is now seen, was surveyed and the problems that changed were learned.

    A problem that has not changed keeps its policy; another one is fine-tuned from this run's own policies alone, so that the
    result does not depend on what else a toolbox holds. A skill without a solution is blocked (`SkillSet.blocked`); paths in
    which it has a share keep the times that they had. Raises BadInput for a scene in which no task can be done.
    """
    task, layout = scene
    fresh = _surveyed(prepared, check_scene(task), layout)
    teacher = replace(teacher, trial=trial_of(fresh))
    known = KnownPolicies.of(lesson.policy for lesson in taught.lessons.values())
    lessons: dict[str, Lesson] = {}
    rows: dict[str, dict[str, Any]] = {}
    again = []
    for name, problem in fresh.problems.items():
        if name in taught.lessons and problem.mdp.signature == prepared.problems[name].mdp.signature:
            lessons[name] = taught.lessons[name]
        else:
            settings = task.subtask(problem.subtask)
            plan = LessonPlan(problem, settings.learner, settings.gate, task.name)
            lessons[name] = teacher.find_or_teach(plan, known)
            known[problem.subtask, lessons[name].policy.signature] = lessons[name].policy
            teacher.tell(SkillReady(name, lessons[name]))
            again.append(name)
        rows[name] = skill_row(name, lessons[name])
        fresh.skillset.policies[name] = lessons[name].policy
    others = {name for name in again if name not in taught.lessons or not _same(lessons[name], taught.lessons[name])}
    durations = _timed(fresh, taught.durations, others, teacher)
    cell = cell_of(task, durations, prepared.order)
    return Relearned(fresh, Taught(lessons, rows, durations, cell), tuple(again))


def _same(lesson: Lesson, before: Lesson) -> bool:
    """Whether a lesson has the same table as before, and so leads along the same path."""
    return lesson.policy.q.tobytes() == before.policy.q.tobytes()


def _surveyed(prepared: Prepared, task: Task, layout: Layout) -> Prepared:
    """The prepared scene with all of its problems; a skill for which there is no problem is blocked."""
    order = prepared.order
    skillset, surveys = SkillSet.of(task, order), Surveys(task, order, layout)
    words = scene_in_words(task, order, layout)
    problems: dict[str, Problem] = {}
    for name, skill in skillset.skills.items():
        skill.surveys = surveys
        try:
            problems[name] = replace(skill.setup(surveys), scene=words, arm=task.robot.model)
        except BadInput as error:
            skillset.blocked[name] = str(error)
    return Prepared(task, order, prepared.seed, layout, surveys, skillset, problems)


def _timed(fresh: Prepared, before: Durations, others: set[str], teacher: Teacher) -> Durations:
    """The durations as before, except those of paths in which a skill with a new table has a share: these are measured again."""
    skills = fresh.skillset

    def changed(names: set[str]) -> bool:
        return bool(names & others) and not names & skills.blocked.keys()

    legs = {way: leg for way, leg in skills.legs.items() if changed({skill.name for skill in leg})}
    travels = {pair: way for pair, way in skills.travels.items() if changed({skill.name for skill in way})}
    durations = before
    for way, leg in legs.items():
        durations = _with(durations, fresh, SkillSet(skills.task, skills.moves, legs={way: leg}), teacher)
    if travels:
        durations = _with(durations, fresh, SkillSet(skills.task, skills.moves, travels=travels), teacher)
    return durations


def _with(before: Durations, fresh: Prepared, ways: SkillSet, teacher: Teacher) -> Durations:
    """The durations with these paths measured again.

    They stay as before where one of the paths fails: the run notices that when it takes that path.
    """
    ways.skills, ways.policies = fresh.skillset.skills, fresh.skillset.policies
    ways.processes = {station.name: () for station in fresh.task.stations}
    try:
        return before.joined(measure(replace(fresh, skillset=ways)))
    except LabError as error:
        teacher.tell(RecordSkipped(f"a path in the changed scene: {error}"))
        return before


def adopt(floor: Floor, prepared: Prepared, spot_of: MutableMapping[str, Spot]) -> None:
    """Use on a floor what was learned in its changed scene; the spots of stations that moved are moved with them."""
    old, new = floor.scene.places, prepared.surveys.places
    for body, spot in spot_of.items():
        spot_of[body] = _moved_along(spot, old, new)
    scene = floor.scene
    scene.task, scene.layout, scene.places = prepared.task, prepared.layout, new
    floor.skillset = prepared.skillset


def _moved_along(spot: Spot, old: Places, new: Places) -> Spot:
    """The spot, moved with its station; a spot that belongs to no station stays where it is."""
    for station in old.task.stations:
        for before, after in zip(old.spots(station), new.spots(new.task.station(station.name)), strict=True):
            if abs(spot.x - before.x) < SAME_SPOT_M and abs(spot.y - before.y) < SAME_SPOT_M:
                return replace(after, z=spot.z)
    return spot
