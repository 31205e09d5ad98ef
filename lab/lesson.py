"""What single commands do: one teaching session, the high level alone, a picture to a grid, a look at a scene."""

import re
import time
from collections.abc import Callable
from dataclasses import replace
from difflib import get_close_matches
from pathlib import Path
from typing import TYPE_CHECKING, Any

from lab.errors import BadInput, LabError, unknown
from lab.listener import Listener
from lab.taskfile import MAX_TOASTS, Task, find, load
from lab.teaching import Teacher, plain_name

if TYPE_CHECKING:
    from lab.skills.skill import Problem, Skill
    from lab.toolbox import Toolbox


def teach_one(
    task: Task,
    subtask: str,
    teacher: Teacher,
    *,
    learner: str | None = None,
    gate: str | None = None,
    episodes: int | None = None,
    name: str | None = None,
    out: Path | None = None,
) -> dict[str, Any]:
    """One session in one sub-task of a task; the policy is kept. Returns the document of `lab teach --json`.

    It goes on from an unfinished policy of the same problem, if there is one. A grasp counts as solved when its slice
    is also lifted in physics; `failure` says why it was not. BadInput when the policy called `name` is of another
    problem.
    """
    from lab.advice.gates import GATES
    from lab.crew import Crew
    from lab.learning.updates import UPDATES
    from lab.line import try_grasp
    from lab.policy import MAX_NAME_LENGTH, is_name
    from lab.report import draw_value_map
    from lab.run import prepare
    from lab.skills import Grasp, Insert
    from lab.view.plots import learning_curves

    if learner is not None and learner not in UPDATES:
        raise unknown("learner", learner, UPDATES, "--learner")
    if gate is not None and gate not in GATES:
        raise unknown("gate", gate, GATES, "--gate")
    if name is not None and not is_name(name):
        raise BadInput(f"policy name '{name}' (--save): wanted 1 to {MAX_NAME_LENGTH} printable characters")
    toasts = fitting(task, 2)
    wanted = find_skill(Crew.of(task, toasts).skills, subtask).name  # before the scene is surveyed
    prepared = prepare(task, toasts, teacher.seed, wanted)
    skill = prepared.crew.skills[wanted]
    problem, settings = prepared.problems[skill.name], task.subtask(skill.subtask)
    if name is not None:
        _check_free(name, problem, teacher.toolbox)
    earlier = teacher.toolbox.find(problem.subtask, problem.mdp.signature, name or plain_name(problem))
    how = replace(
        settings.learner, learner=learner or settings.learner.learner, episodes=episodes or settings.learner.episodes
    )
    lesson = teacher.teach(
        problem,
        how,
        replace(settings.gate, gate=gate or settings.gate.gate),
        task.name,
        unfinished=teacher.unfinished(problem, name),
        name=name,
        sessions=1,
    )
    result, policy, files = lesson.result, lesson.policy, {}
    assert result is not None
    prepared.crew.policies[skill.name] = policy
    failure = try_grasp(prepared.crew, prepared.surveys, skill) if isinstance(skill, Grasp) else None
    if failure is not None and policy.solved:
        policy = teacher.keep_unsolved(policy, earlier)
    if out is not None:
        out.mkdir(parents=True, exist_ok=True)
        files["learning_curve"] = str(out / "learning-curve.png")
        learning_curves({skill.name: policy}, out / "learning-curve.png")
        if isinstance(skill, Insert):
            draw_value_map(skill, policy, out / "insert-value-map.png")
            files["value_map"] = str(out / "insert-value-map.png")
    return {
        "subtask": skill.subtask,
        "skill": skill.name,
        "task": task.name,
        "learner": how.learner,
        "gate": gate or settings.gate.gate,
        "advisor": teacher.advisor,
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
        "solved": result.solved and failure is None,
        "failure": failure,
        "saved_as": policy.name,
        "files": files,
    }


def _check_free(name: str, problem: "Problem", toolbox: "Toolbox") -> None:
    """Raises BadInput when the policy of that name was learned in another problem."""
    for row in toolbox.list():
        if row["name"] == name and (row["subtask"], row["signature"]) != (problem.subtask, problem.mdp.signature):
            raise BadInput(
                f"policy name '{name}' (--save): it is the name of a policy for '{row['subtask']}' in another problem "
                f"({row['signature'][:8]}): choose another name, or remove that policy"
            )


def find_skill(skills: "dict[str, Skill]", name: str) -> "Skill":
    """The skill of that full name, or the first of that sub-task; BadInput lists what there is."""
    if name in skills:
        return skills[name]
    for skill in skills.values():
        if skill.subtask == name:
            return skill
    subtasks = sorted({skill.subtask for skill in skills.values()})
    near = get_close_matches(name, [*subtasks, *skills], n=1)
    hint = f" did you mean '{near[0]}'?" if near else ""
    allowed = f"{', '.join(subtasks)}, or one skill's full name, such as '{next(iter(skills))}'"
    raise BadInput(f"unknown sub-task '{name}' (SUBTASK):{hint} known: {allowed}")


def fitting(task: Task, wanted: int) -> int:
    """As many toasts as wanted, or as both ends of the route hold."""
    return min(wanted, *(task.station(stage.station).capacity for stage in (task.route[0], task.route[-1])))


def sequence_task(
    task: Task,
    toasts: int,
    teacher: Teacher,
    *,
    method: str | None,
    episodes: int | None,
    sessions: int,
    plot: Path | None,
    listener: Listener,
) -> dict[str, Any]:
    """The order of a task's transfers over the durations measured in simulation; the document of `lab sequence --json`."""
    from lab.run import prepare, sequence, teach_all
    from lab.sequencing import SEQUENCERS
    from lab.sequencing.exact import optimum
    from lab.sequencing.srl import SrlResult
    from lab.view.canvas import check_png
    from lab.view.plots import sequence_plot

    name = method or task.sequencing.method
    if name not in SEQUENCERS:
        raise unknown("method", name, SEQUENCERS, "--method")
    if plot is not None:
        check_png(plot)
    cell = teach_all(prepare(task, toasts, teacher.seed), teacher, listener).cell
    listener.phase("sequence", sessions)
    proven, found = optimum(cell), []
    for session in range(sessions):
        found.append(sequence(task, cell, teacher.seed + session, method=name, episodes=episodes))
        listener.sequenced(found[-1], proven)
    best = min(found, key=lambda result: result.makespan_s)
    hits = [result.makespan_s <= proven.bound_s + 1e-6 for result in found]
    settled = [result.final_makespan_s <= proven.bound_s + 1e-6 for result in found if isinstance(result, SrlResult)]
    if plot is not None:
        sequence_plot(found[0].episode_makespans_s, proven.optimal_s, plot)
    return {
        "task": task.name,
        "toasts": toasts,
        "seed": teacher.seed,
        "method": name,
        "sessions": sessions,
        "makespan_s": best.makespan_s,
        "sequence": list(best.sequence),
        "episode_makespans_s": list(found[0].episode_makespans_s),
        "optimal_s": proven.optimal_s,
        "optimum_proven": proven.proven,
        "bound_s": proven.bound_s,
        "gap": proven.gap(best.makespan_s),
        "success_percent": 100.0 * sum(hits) / sessions,
        "final_success_percent": 100.0 * sum(settled) / sessions if settled else None,
        "mean_best_s": sum(result.makespan_s for result in found) / sessions,
        "files": {} if plot is None else {"plot": str(plot)},
    }


def see_picture(image: Path, grid: str | None, task: str | None, out: Path | None) -> dict[str, Any]:
    """A picture's markers as a grid, the document of `lab see --json`: '.' free, 'S' start, 'G' goal, '#' an obstacle's marker.

    With a task the grid is the one of its overhead camera; without, the frame is the grid, 12 x 12 unless `grid` says so.
    """
    from lab.vision import draw, read_picture, see, write_picture

    match = re.fullmatch(r"([1-9]\d{0,2})x([1-9]\d{0,2})", "12x12" if grid is None else grid)
    if match is None:
        raise BadInput(f"grid '{grid}' (--grid): wanted ROWSxCOLUMNS, each 1 to 999, such as 12x12")
    shape = (int(match[1]), int(match[2]))
    picture = read_picture(image)
    camera = None
    if task is not None:
        from lab.skills.surveys import camera_view

        height, width = picture.shape[:2]
        if height != width:
            raise BadInput(f"{image}: {width} x {height} pixels: the task's camera takes square pictures")
        camera = camera_view(load(task), height)
        if grid is not None and shape != camera.shape:
            own = f"{camera.shape[0]}x{camera.shape[1]}"
            raise BadInput(f"grid '{grid}' (--grid): the grid of the task's camera is {own}; leave --grid away")
        shape = camera.shape
    seen = see(picture, camera, shape=shape, where=str(image))
    cells = [["." for _ in range(shape[1])] for _ in range(shape[0])]
    for i, j in seen.obstacles:
        cells[i][j] = "#"
    cells[seen.start[0]][seen.start[1]], cells[seen.goal[0]][seen.goal[1]] = "S", "G"
    if out is not None:
        write_picture(out, draw(picture, seen))
    return {
        "grid": ["".join(row) for row in cells],
        "start": list(seen.start),
        "goal": list(seen.goal),
        "obstacles": [list(cell) for cell in seen.obstacles],
        "markers": [
            {
                "kind": m.kind,
                "pixel": [float(v) for v in m.pixel],
                "world_m": [float(v) for v in m.world_m],
                "cell": list(m.cell),
            }
            for m in seen.markers
        ],
        "files": {} if out is None else {"picture": str(out)},
    }


def show(what: str, toasts: int, seed: int, port: int, tell: Callable[[str, str], None]) -> None:
    """Serve a run's replay, or a task's scene, on 127.0.0.1 until interrupted; `tell(url, hint)` once it is there."""
    from lab.view.meshcat import LiveView

    folder = Path(what)
    if folder.is_dir():
        replay = folder / "replay.html"
        if not replay.is_file():
            raise BadInput(f"'{what}' holds no replay.html: give the folder of a run (--out of lab run) or a task")
        with LiveView(port, replay=replay) as page:
            tell(page.url, page.hint)
            _wait()
    _check_number(toasts)
    task = load(what)
    import numpy as np

    from lab.recorder import show_scene
    from lab.sim.scene import check_scene, draw_layout

    check_scene(task)
    with LiveView(port) as live:
        show_scene(task, toasts, draw_layout(task, toasts, np.random.default_rng([seed, 1])), live)
        tell(live.url, live.hint)
        _wait()


def _check_number(toasts: int) -> None:
    if not 1 <= toasts <= MAX_TOASTS:
        raise BadInput(f"{toasts} toasts (--toasts): allowed are 1 to {MAX_TOASTS}")


def _wait() -> None:
    while True:
        time.sleep(3600)


def check_task(file: str, toasts: int | None, seed: int) -> list[str]:
    """What is wrong with a task file, its scene and its problems for so many toasts; empty when nothing is.

    Without a number: for 3 toasts, or as many as there is room for.
    """
    from lab.run import prepare

    find(file)
    if toasts is not None:
        _check_number(toasts)
    try:
        task = load(file)
        prepare(task, fitting(task, 3) if toasts is None else toasts, seed)
    except LabError as error:
        return [str(error)]
    return []
