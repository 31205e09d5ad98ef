"""Lessons as commands know them: one teaching session in a sub-task, a world or an environment; one shown again."""

import json
from collections.abc import Callable
from dataclasses import asdict, replace
from difflib import get_close_matches
from functools import partial
from pathlib import Path
from shlex import quote
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

from lab.advice.advising import Advising, Watch
from lab.advice.advisors import PEOPLE
from lab.advice.entries import line_of
from lab.errors import BadInput, unknown
from lab.learning.requests import AdviceRequest, AdvisorLeft
from lab.mdp import greedy_path
from lab.tasks.grid_world import GridWorld
from lab.tasks.record import write_whole
from lab.tasks.task_file import Task, check_toasts, fitting, is_path, load, load_world, names_file, names_of
from lab.teaching.kept_session import KeptSession, NewSession, Words, check_new
from lab.teaching.teacher import Audience, Interrupted, Lesson, Teacher, check_name, world_problem
from lab.toolbox.registry import Toolbox, default_folder

if TYPE_CHECKING:
    from lab.gym import GymWorld
    from lab.learning.problem import Problem
    from lab.skills.skill import Skill
    from lab.toolbox.policy import Policy


GYM = "gym:"


def check(words: Words, out: Path | None = None, kept: KeptSession | None = None) -> None:
    """Raises BadInput for words that ask for nothing that is there, and for an `out` that holds a session already.

    It is called before anybody is asked or shown anything. `kept`: where the words come from, if nobody has typed them.
    """
    Advising.of(words.advisors, asked=words.asked, decide=words.decide)
    if out is not None:
        check_new(out)
    _subject(words, kept)


def outside(kept: KeptSession) -> list[str]:
    """The files outside its own folder that a session names, and that are read when it goes on or is shown again."""
    words = kept.words
    named: list[object] = [words.subtask, words.task]
    if words.subtask.startswith(GYM):
        from lab.gym import parse_name

        named = list(parse_name(words.subtask, kept.where).options.values())
    files = [word for word in named if isinstance(word, str) and is_path(word) and Path(word).is_file()]
    files += [name.removeprefix("recorded:") for name in words.advisors if name.startswith("recorded:")]
    here = kept.read.path.parent.resolve()
    return [name for name in files if not Path(name).resolve().is_relative_to(here)]


def teach(words: Words, teacher: Teacher, out: Path | None, kept: KeptSession | None = None) -> dict[str, Any]:
    """The session that these words ask for, or `kept` gone on with, with its journal; the document of `lab teach --json`.

    Pictures and the receipt go to `out`. Raises BadInput for bad words, WorkFailed, and Interrupted, which says how to go
    on.
    """
    subject = _subject(words, kept)
    if kept is None and out is not None:
        check_new(out)
    session = kept or NewSession(out, teacher.toolbox, words)
    teacher = replace(teacher, keep=session.keep, begun=None if kept is None else kept.begun)
    if out is not None:
        try:
            out.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise BadInput(f"output folder '{out}' (--out): {error.strerror or error}") from error
    try:
        document = subject(
            teacher,
            learner=words.learner,
            gate=words.gate,
            memory=words.memory,
            episodes=words.episodes,
            name=words.save,
            out=out,
        )
    except KeyboardInterrupt as stopped:
        if session.journal is None:
            raise
        what = str(stopped) or "stopped by Ctrl-C; the journal has all that was said"
        raise Interrupted(f"{what}; go on with: {_resume(session, teacher.toolbox)}") from None
    return document | _worth(session)


def _resume(session: NewSession | KeptSession, toolbox: Toolbox) -> str:
    """The command that goes on with a session."""
    box = "" if toolbox.folder == default_folder() else f" --toolbox {quote(str(toolbox.folder))}"
    return f"lab teach --resume {quote(str(session.folder))}{box}"


def replay(kept: KeptSession, audience: Audience, watch: Watch) -> dict[str, Any]:
    """Shows a kept session again, each question with its answer, to `audience` and `watch`; nothing is learned or written.

    Returns the document of `lab replay --json`. Raises BadInput when the session's problem is not there any more, and
    KeyboardInterrupt on Ctrl-C.
    """
    words, read = kept.words, kept.read
    people = dict.fromkeys(PEOPLE, _nobody)  # the journal answers for them
    advising = Advising.of(words.advisors, people, words.asked, words.decide, watch=watch)
    subject = _subject(words, kept)
    with TemporaryDirectory() as folder:
        teacher = Teacher(Toolbox(folder), advising, words.seed, audience, keep=kept.keep, begun=kept.begun)
        options = {name: getattr(words, name) for name in ("learner", "gate", "memory", "episodes")}
        try:
            subject(teacher, **options, name=words.save, out=None)
        except Interrupted:  # by the journal's end, when it was not over, or by Ctrl-C
            if kept.journal is None or kept.journal.folding:
                raise KeyboardInterrupt from None
    worth = kept.receipt()
    return {
        "session": str(kept.folder),
        "problem": read.session.problem,
        "words": read.session.words,
        "seed": words.seed,
        "lab": read.session.lab,
        "closed": None if read.closed is None else asdict(read.closed),
        "cut": read.cut,
        "events": [json.loads(line_of(entry)) for entry in read.entries],
        "receipt": worth.to_json() | {"lines": worth.lines()},
    }


def _nobody(request: AdviceRequest) -> int | None:
    raise AdvisorLeft


def _worth(session: NewSession | KeptSession) -> dict[str, Any]:
    """Where the session is kept, and what its advice was worth; the receipt is written beside the journal."""
    assert session.folder is not None
    worth = session.receipt()
    path = session.folder / "receipt.json"
    write_whole(path, json.dumps(worth.to_json(), indent=1, allow_nan=False) + "\n")
    return {"session": str(session.folder), "receipt": worth.to_json() | {"lines": worth.lines()}}


def _subject(words: Words, kept: KeptSession | None) -> Callable[..., dict[str, Any]]:
    """What the words ask for: one of the functions below with its first argument. BadInput for bad ones.

    A module whose name comes out of a file, `kept`, is imported only when the user has said that it is trusted.
    """
    if words.subtask.startswith(GYM):
        from lab.gym import gym_world, parse_name

        module = "" if kept is None else parse_name(words.subtask, kept.where).module
        if kept is not None and module and module not in kept.trusted:
            raise BadInput(
                f"journal '{kept.read.path}' ({kept.where}): it names the module '{module}', whose code would run: if you "
                f"trust whoever made it, say --trust-module {quote(module)}"
            )
        for option, value in (("--task", words.task), ("--sight", words.view)):
            if value is not None:
                raise BadInput(f"{option} {value}: a Gymnasium environment, '{words.subtask}', has none: leave it away")
        return partial(teach_gym, gym_world(words.subtask))
    if not names_file(words.subtask):
        if words.view is not None:
            raise BadInput(f"sight '{words.view}' (--sight): only a world has one, '{words.subtask}' is none")
        task = load(words.task or "toast")
        return partial(teach_one, task, words.subtask, toasts=words.toasts, sessions=words.sessions)
    world = load_world(words.subtask)
    if words.task is not None:
        raise BadInput(
            f"task '{words.task}' (--task): the world '{words.subtask}' belongs to no task: leave --task away"
        )
    return partial(teach_world, world, view=words.view or "full")


def teach_one(
    task: Task,
    subtask: str,
    teacher: Teacher,
    *,
    learner: str | None = None,
    gate: str | None = None,
    memory: bool | None = None,
    episodes: int | None = None,
    name: str | None = None,
    out: Path | None = None,
    toasts: int | None = None,
    sessions: int | None = None,
) -> dict[str, Any]:
    """One session in one sub-task of a task; the policy is kept. Returns the document of `lab teach --json`.

    It goes on from an unfinished policy of the same problem, if there is one. A skill that is tried in physics counts as
    solved when that succeeds, too; `failure` says why it did not. `toasts` and `sessions`: those of the run that the lesson
    belongs to. BadInput when the policy called `name` is of another problem.
    """
    from lab.skills.prepared_scene import prepare
    from lab.skills.skillset import SkillSet
    from lab.skills.trial import trial_of
    from lab.view.plots import values_seen

    toasts = fitting(task, 2) if toasts is None else toasts
    check_toasts(toasts, task)
    wanted = find_skill(SkillSet.of(task, toasts).skills, subtask)  # before the scene is surveyed
    settings = task.subtask(wanted.subtask).changed(learner, gate, episodes, memory)
    check_name(name)
    prepared = prepare(task, toasts, teacher.seed, wanted.name)
    skill, problem = prepared.skillset.skills[wanted.name], prepared.problems[wanted.name]
    teacher.audience.stands(prepared, problem)
    teacher = replace(teacher, trial=trial_of(prepared))
    lesson = teacher.one_session(problem, settings, task.name, name, sessions=sessions or 1)
    document = _document(problem, lesson, teacher)
    if out is not None:
        document["files"] = _draw_curve(problem.name, lesson.policy, out)
        photo, map_path = skill.photo(), out / f"{skill.subtask}-value-map.png"
        if photo is not None:
            values_seen(lesson.policy.q, problem.mdp, photo.picture, photo.seen, map_path)
            document["files"]["value_map"] = str(map_path)
    return document


def teach_world(
    world: GridWorld,
    teacher: Teacher,
    *,
    view: str = "full",
    learner: str | None = None,
    gate: str | None = None,
    memory: bool | None = None,
    episodes: int | None = None,
    name: str | None = None,
    out: Path | None = None,
) -> dict[str, Any]:
    """One session in a grid world, as `teach_one`; nothing is simulated. With view "limited" advice comes from the region only.

    Draws the value map of a world with two axes. BadInput for an unknown view, and when the world has no limited one.
    """
    if view not in ("full", "limited"):
        raise unknown("sight", view, ("full", "limited"), "--sight")
    if view == "limited" and world.view is None:
        raise BadInput(f"sight 'limited' (--sight): the file of world '{world.name}' has no [view]")
    settings, problem = world.changed(learner, gate, episodes, memory), world_problem(world)
    check_name(name)
    region = world.region() if view == "limited" else None
    teacher = replace(teacher, advising=replace(teacher.advising, region=region))
    teacher.audience.stands(world, problem)
    lesson = teacher.one_session(problem, settings, world.name, name)
    document = _document(problem, lesson, teacher) | {"view": view}
    if out is not None:
        document["files"] = _draw_curve(world.name, lesson.policy, out)
        if len(world.shape) == 2:
            document["files"]["value_map"] = _draw_world(world, lesson.policy, out / "value-map.png")
    return document


def teach_gym(
    world: "GymWorld",
    teacher: Teacher,
    *,
    learner: str | None = None,
    gate: str | None = None,
    memory: bool | None = None,
    episodes: int | None = None,
    name: str | None = None,
    out: Path | None = None,
) -> dict[str, Any]:
    """One session in a Gymnasium environment with discrete states and actions, as `teach_world`."""
    settings, problem = world.changed(learner, gate, episodes, memory), world.problem()
    check_name(name)
    lesson = teacher.one_session(problem, settings, world.name, name)
    document = _document(problem, lesson, teacher)
    if out is not None:
        document["files"] = _draw_curve(world.name, lesson.policy, out)
    return document


def _document(problem: "Problem", lesson: Lesson, teacher: Teacher) -> dict[str, Any]:
    """The document of `lab teach --json`, before any file is written."""
    policy, result = lesson.policy, lesson.result
    assert result is not None
    return {
        "subtask": problem.subtask,
        "skill": problem.name,
        "task": policy.task,
        "learner": policy.learner["learner"],
        "gate": policy.gate["gate"],
        "advisor": teacher.advisor,
        "memory": policy.gate["memory"],
        "seed": teacher.seed,
        "episodes": len(result.steps),
        "steps_per_episode": result.steps.tolist(),
        "guided_episodes": [n for n, guided in enumerate(result.guided.tolist(), start=1) if guided],
        "requests": result.requests,
        "helped_steps": result.helped_steps,
        "misleads": result.misleads,
        "rejected_at_episode": result.rejected_at_episode,
        "optimal_steps": result.optimal_steps,
        "final_steps": result.final_steps,
        "steps_are_means": problem.environment is not None,  # both are means over drawn starts and steps
        "solved": result.solved and lesson.failure is None,
        "failure": lesson.failure,
        "source": lesson.source,
        "saved_as": policy.name,
        "files": {},
    }


def _draw_curve(name: str, policy: "Policy", out: Path) -> dict[str, str]:
    from lab.view.plots import learning_curves

    out.mkdir(parents=True, exist_ok=True)
    learning_curves({name: policy}, out / "learning-curve.png")
    return {"learning_curve": str(out / "learning-curve.png")}


def _draw_world(world: GridWorld, policy: "Policy", path: Path) -> str:
    """The values of a world with two axes, and the learned way through it."""
    from lab.view.plots import Places, value_map

    mdp = world.mdp()
    states, _, _ = greedy_path(policy.q, mdp, mdp.n_states)
    value_map(
        policy.q.max(axis=1).reshape(world.shape),
        None,
        path,
        places=Places(
            route=[(row, column) for row, column in map(mdp.state_cell, states)],
            blocked=world.blocked(),
            start=(world.start[0], world.start[1]),
            goal=(world.goal[0], world.goal[1]),
        ),
    )
    return str(path)


def find_skill(skills: "dict[str, Skill]", name: str) -> "Skill":
    """The skill of that full name, or the first of that sub-task; BadInput lists what there is."""
    if name in skills:
        return skills[name]
    for skill in skills.values():
        if skill.subtask == name:
            return skill
    subtasks = sorted({skill.subtask for skill in skills.values()})
    worlds = names_of("world")
    near = get_close_matches(name, [*subtasks, *worlds, *skills], n=1)
    hint = f" did you mean '{near[0]}'?" if near else ""
    allowed = f"{', '.join(subtasks)}, or one skill's full name, such as '{next(iter(skills))}'"
    allowed += f", or a world: {', '.join(worlds)}"
    raise BadInput(f"unknown sub-task '{name}' (SUBTASK):{hint} known: {allowed}")
