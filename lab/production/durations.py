"""How long a job's moves take: measured once in physics, kept under a key of all that decides it, and the cell they make."""

import hashlib
import json
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from importlib.metadata import packages_distributions, version
from math import isfinite
from typing import Any, NamedTuple

import numpy as np

from lab.errors import BadInput, WorkFailed, unknown
from lab.files import assets_folder
from lab.learning.sources import sources
from lab.production.floor import Floor
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.routes import NeededMoves
from lab.sim.scene import Layout
from lab.sim.world import TIME_STEP, World
from lab.skills import Skill
from lab.skills.prepared_scene import Prepared
from lab.skills.skill import TRIED_WITH, Status
from lab.skills.skillset import route, stations
from lab.tasks.task_file import Task
from lab.toolbox.policy import Policy
from lab.toolbox.registry import Toolbox

RECORDS = "durations"  # the kind of record in the toolbox
LONGEST_S = 86_400.0  # of a move or a process
MEASURED_BY = (__name__,)  # the modules that carry moves out, with all that they import
DECIDED_BY_RESULT = ("lab.sequencing", "lab.learning", "lab.advice", "lab.view")  # moves and policies hold it

Pair = tuple[str, str]


class TimedMove(NamedTuple):
    """How long the robot took in a run [s] from one station to another, with a part or without."""

    pair: Pair
    loaded: bool
    seconds: float


@dataclass(frozen=True)
class Durations:
    """Measured times [s]: the robot's moves by (origin, target), empty and loaded; what each machine takes."""

    empty_s: Mapping[Pair, float]
    loaded_s: Mapping[Pair, float]
    process_s: Mapping[str, float]
    sim_s: float = 0.0

    def to_json(self) -> dict[str, object]:
        """Plain dicts: 'origin > target' -> seconds."""
        return {
            "empty_s": {_word(pair): seconds for pair, seconds in self.empty_s.items()},
            "loaded_s": {_word(pair): seconds for pair, seconds in self.loaded_s.items()},
            "process_s": dict(self.process_s),
        }

    def after(self, timed: Sequence[TimedMove]) -> "Durations":
        """What is believed after a run: each move that it carried out takes what it took there, in the mean.

        Source: thesis, section 10.2.1 (i).
        """
        times: dict[tuple[Pair, bool], list[float]] = {}
        for pair, loaded, seconds in timed:
            times.setdefault((pair, loaded), []).append(seconds)
        means = {move: sum(all_s) / len(all_s) for move, all_s in times.items()}
        return replace(
            self,
            empty_s={pair: means.get((pair, False), seconds) for pair, seconds in self.empty_s.items()},
            loaded_s={pair: means.get((pair, True), seconds) for pair, seconds in self.loaded_s.items()},
        )

    @classmethod
    def from_json(cls, record: Mapping[str, Any], moves: NeededMoves, processes: Sequence[str]) -> "Durations":
        """What `to_json` wrote of these moves and of the stations with a process to learn.

        BadInput for a move or station too many or too few, and for what is no time [s].
        """
        empty, loaded = ({_word(pair): pair for pair in pairs} for pairs in (moves.empty, moves.loaded))
        wanted = {"empty_s": set(empty), "loaded_s": set(loaded), "process_s": set(processes)}
        tables = {name: _times(record, name, names) for name, names in wanted.items()}
        return cls(
            {empty[word]: seconds for word, seconds in tables["empty_s"].items()},
            {loaded[word]: seconds for word, seconds in tables["loaded_s"].items()},
            tables["process_s"],
        )


def _word(pair: Pair) -> str:
    return " > ".join(pair)


def _times(record: Mapping[str, Any], table: str, wanted: set[str]) -> dict[str, float]:
    """One table of a record, with exactly the wanted entries in the order in which they were written."""
    times = record.get(table)
    if not isinstance(times, dict):
        raise BadInput(f"{table}: it is no table of times")
    for name, seconds in times.items():
        if name not in wanted:
            raise unknown("move or station", name, wanted, table)
        if type(seconds) not in (int, float) or not isfinite(seconds) or not 0.0 <= seconds <= LONGEST_S:
            raise BadInput(f"{table} '{name}': {seconds!r}: wanted 0 to {LONGEST_S:g} s")
    if missing := sorted(wanted - times.keys()):
        raise BadInput(f"{table}: the time of '{missing[0]}' is missing")
    return {name: float(seconds) for name, seconds in times.items()}


def measure(prepared: Prepared, on_move: Callable[[str, float], None] | None = None) -> Durations:
    """Carry every needed move out once in simulation and time it [s]; WorkFailed when one does not succeed."""
    tell, skillset = on_move or (lambda name, seconds: None), prepared.skillset
    loaded: dict[Pair, float] = {}
    process: dict[str, float] = {}
    steps = 0
    for (origin, target), leg in skillset.legs.items():
        with World() as world:
            floor = Floor(world, skillset, prepared.surveys.layout, 0)
            leg[0].begin(floor.bench)
            loaded[origin, target] = _timed(floor, leg)
            tell(f"{origin} > {target}, loaded", loaded[origin, target])
            for skill in () if target in process else skillset.processes[target]:
                process[target] = _timed(floor, [skill])
                tell(skill.name, process[target])
            steps += world.steps
    empty, more = _measure_empty(prepared, tell)
    return Durations(empty, loaded, process, (steps + more) * TIME_STEP)


def _measure_empty(prepared: Prepared, tell: Callable[[str, float], None]) -> tuple[dict[Pair, float], int]:
    """The times [s] of all ways of the empty gripper, one after the other in one scene, and the physics steps that took."""
    empty: dict[Pair, float] = {}
    with World() as world:
        floor = Floor(world, prepared.skillset, prepared.surveys.layout, 0)
        for (origin, target), way in prepared.skillset.travels.items():
            way[0].begin(floor.bench)
            empty[origin, target] = _timed(floor, way)
            tell(f"{origin} > {target}, empty", empty[origin, target])
        return empty, world.steps


def _timed(floor: Floor, skills: Sequence[Skill]) -> float:
    """How long skills take one after the other with the slice that they are tried with [s]; WorkFailed."""
    start = floor.now_s
    for skill in skills:
        if floor.run(skill.aim(TRIED_WITH)) is not Status.SUCCESS:
            raise WorkFailed(f"measuring '{skill.name}': {skill.reason}")
    return floor.now_s - start


def cell_of(task: Task, durations: Durations, toasts: int) -> Cell:
    """The sequencing problem that the measured durations make."""
    places = stations(task, durations.process_s)
    names = [place.name for place in places]
    tables = []
    for times in (durations.empty_s, durations.loaded_s):
        table = np.full((len(names), len(names)), np.nan)
        for (origin, target), seconds in times.items():
            table[names.index(origin), names.index(target)] = seconds
        tables.append(table)
    return Cell.alike(places, route(task), tables[0], tables[1], task.robot.start, toasts)


def kept_durations(toolbox: Toolbox, key: str, task: Task, moves: NeededMoves) -> Durations | None:
    """The durations kept under a key, None when there are none; BadInput for a record that does not hold them."""
    record = toolbox.load_record(RECORDS, key)
    if record is None:
        return None
    try:
        return Durations.from_json(record, moves, [s.name for s in task.stations if s.process is not None])
    except BadInput as error:
        raise BadInput(f"record '{key}' in toolbox {toolbox.address}: {error}") from None


def durations_key(
    task: Task, layout: Layout, moves: NeededMoves, policies: Mapping[str, Policy], modules: Sequence[str] = MEASURED_BY
) -> str:
    """A hash of all that the durations depend on: task, layout, moves, policies, assets, source and libraries.

    `modules` are the ones that measure. WorkFailed when a source or a library's version cannot be found.
    """
    code = sources(modules, DECIDED_BY_RESULT)
    decides = {
        "task": task.model_dump(mode="json", exclude={"name", "title", "sequencing", "subtasks"}),
        "obstacles": layout.obstacles,
        "moves": asdict(moves),
        "policies": {name: [policy.signature, _hash(policy.q.tobytes())] for name, policy in policies.items()},
        "assets": {path.name: _hash(path.read_bytes()) for path in assets_folder().iterdir() if path.is_file()},
        "source": code.texts,
        "libraries": _versions(code.libraries),
    }
    return _hash(json.dumps(decides, sort_keys=True).encode())[:24]


def _hash(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()


def _versions(libraries: Collection[str]) -> dict[str, str]:
    distributions = packages_distributions()
    for name in libraries:
        if name not in distributions:
            raise WorkFailed(f"the version of the library '{name}' cannot be found")
    return {name: version(distributions[name][0]) for name in libraries}
