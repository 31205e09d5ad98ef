"""Part `physics`: random cells with every feature of a task file; all parts are delivered and audited, or the task is refused.

Some are copies of the tasks that ship with other masses, frictions, grips, speeds and layouts. A refusal counts as held if the
task's check says the same; a run that stops later, or leaves a part undelivered, counts as broken.
"""

import json
import re
from collections.abc import Callable
from pathlib import Path
from shutil import copytree, rmtree

import numpy as np

from devtools.commands import Ended, environment, lab
from devtools.drawn_cells import drawn_cell
from devtools.drawn_features import evenly
from devtools.parts import Outcome, Part
from lab.files import write_whole
from lab.tasks.task_file import find

TASKS = (
    "toast", "toast-panda", "toast-iiwa", "toast-xarm6", "two-toasters", "breakfast", "sorting", "fms-arm", "palletise",
    "furnace", "kit",
)  # fmt: skip
SHIPPED = 4  # one attempt in so many varies a task that ships
PARTS = 2  # the most of a kind
MASS_KG, FRICTION, FORCE_N = (0.002, 3.0), (0.1, 1.5), (1.0, 150.0)  # drawn log-uniformly
SPEED_M_S, ACCELERATION_M_S2 = (0.1, 1.5), (0.3, 8.0)
MOVED_M, TURNED_RAD = 0.02, 0.1  # how far a station is moved and turned at most
RUN_S = 600.0
MASS, FRICTION_LINE, SPEED, ACCELERATION, POSE = (
    re.compile(rf"^({field} = )([^#\n]+)", re.MULTILINE)
    for field in ("mass_kg", "friction", "speed_m_s", "acceleration_m_s2", "pose")
)
COUNT = re.compile(r"^count = (\d+)", re.MULTILINE)
FORCE = re.compile(r"^grip_force_n = [^#\n]+", re.MULTILINE)


def varied_task(text: str, rng: np.random.Generator) -> str:
    """A task file with other masses, frictions, grip force and speeds, and with stations moved a little."""

    def moved(match: re.Match[str]) -> str:
        x, y, yaw = json.loads(match[2])
        dx, dy, turn = rng.uniform(-1, 1, 3) * (MOVED_M, MOVED_M, TURNED_RAD)
        return f"{match[1]}[{x + dx:.4f}, {y + dy:.4f}, {yaw + turn:.4f}] "

    for line, ends in (
        (MASS, MASS_KG),
        (FRICTION_LINE, FRICTION),
        (SPEED, SPEED_M_S),
        (ACCELERATION, ACCELERATION_M_S2),
    ):
        text = line.sub(lambda match, ends=ends: f"{match[1]}{evenly(rng, ends):.3g} ", text)  # type: ignore[misc]
    most = int(rng.integers(1, PARTS + 1))
    text = COUNT.sub(lambda match: f"count = {min(int(match[1]), most)}", text)
    force = f"grip_force_n = {evenly(rng, FORCE_N):.3g}" if rng.random() < 0.5 else ""
    text = FORCE.sub(force, text)
    return POSE.sub(moved, text) if rng.random() < 0.5 else text


def prepare(room: Path, seed: int) -> int | None:
    """Do nothing: each attempt learns all that it needs."""
    return None


def attempt(number: int, seed: int, room: Path) -> Outcome:
    """Run one drawn task, and check it if it is refused: one in SHIPPED varies a task that ships, the others are new cells."""
    rng = np.random.default_rng([seed, number])
    folder = room / str(number)
    rmtree(folder, ignore_errors=True)
    if number % SHIPPED == 0:
        name = TASKS[number // SHIPPED % len(TASKS)]
        copytree(find(name).parent, folder, ignore=lambda _, names: [name for name in names if name.endswith(".toml")])
        text = varied_task(find(name).read_text(encoding="utf-8"), rng)
    else:
        folder.mkdir(parents=True)
        text, name = drawn_cell(rng, folder)
    task = folder / "drawn.toml"
    write_whole(task, text.encode())
    env = environment(folder)
    seeded = ("--seed", str(int(rng.integers(1000))))
    ran = lab("run", task, "--json", *seeded, cwd=folder, env=env, timeout_s=RUN_S)
    group, broke = verdict(ran, lambda: lab("task", "check", task, *seeded, cwd=folder, env=env, timeout_s=RUN_S))
    if not broke:
        rmtree(folder)
    said = f": {ran.stderr.strip().splitlines()[-1][:300]}" if group == "refused" else ""
    return Outcome(group, f"number {number}, {name}{said}", broke, figures={"seconds": ran.seconds})


def verdict(ran: Ended, check: Callable[[], Ended]) -> tuple[str, str]:
    """The group that a run counts in, and what is wrong with it ("": nothing); check: called if the run was refused."""
    if fault := ran.fault():
        return "broke", fault
    if ran.code == 2:
        checked = check()
        same = checked.code == 2 and checked.stderr.endswith(ran.stderr)
        return "refused", "" if same else f"refused, but the check said otherwise: {ran.stderr.strip()[:200]}"
    document = json.loads(ran.stdout)
    if "error" in document:
        return "broke", document["error"][:250]
    wanted = sum(document["parts"].values())
    if ran.code == 0 and document["delivered"] == wanted:
        return "delivered", ""
    return "broke", f"{document['delivered']} of {wanted} delivered: {document['failure']}"[:250]


PART = Part("random cells with every feature of a task file", "99.5 % delivered or refused before work", 400,
            prepare, attempt)  # fmt: skip
