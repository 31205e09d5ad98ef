"""The durations of a job's moves, measured once in physics and kept under a hash of all inputs; and the cell that they make."""

import hashlib
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from lab.errors import BadInput, WorkFailed, unknown
from lab.files import assets_folder, read_limited, source_key
from lab.production.floor import Floor
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.stations import one_robot
from lab.sim import urdf_reader
from lab.sim.parts.kinds import Spot, on_its_pallet
from lab.sim.scene.places import Layout
from lab.sim.scene.scene import ABOVE_FOOT_M
from lab.sim.world import TIME_STEP, World, engine
from lab.skills import Skill
from lab.skills.prepared_scene import Prepared, precedences
from lab.skills.skill import Status, stand_below
from lab.skills.skillset import CarriedPath, Pair, SkillSet, products, stations, ways_of
from lab.tasks.task import Order, Task
from lab.toolbox.policy import Policy
from lab.toolbox.registry import Toolbox
from lab.workers import Workers

RECORDS = "durations"  # the kind of record in the toolbox
LONGEST_S = 86_400.0  # of a move or a process
AWAY_M = 5.0  # distance from its station at which a part blocks nothing

Way = Pair | CarriedPath


class TimedMove(NamedTuple):
    """The duration [s] of one move in a run: an empty one between two stations, or one with a part (`CarriedPath`)."""

    way: Way
    seconds: float


@dataclass(frozen=True)
class Durations:
    """Measured durations [s]: the robot's moves, empty and loaded, its services, and the processes of machines.

    A loaded move has its mean over the spots that the order uses at both ends. more_s (of trials only), by skill: the mean extra
    time over the station's spots in use, compared with the first spot.
    """

    empty_s: dict[Pair, float]
    loaded_s: dict[CarriedPath, float]
    process_s: dict[str, float]
    service_s: dict[Pair, float] = field(default_factory=dict)
    sim_s: float = 0.0
    more_s: dict[str, float] = field(default_factory=dict)

    def to_json(self) -> dict[str, dict[str, float]]:
        """Plain dicts: 'origin > target' or 'origin > target with kind' -> seconds."""
        return {
            "empty_s": {_word(pair): seconds for pair, seconds in self.empty_s.items()},
            "loaded_s": {_word(way): seconds for way, seconds in self.loaded_s.items()},
            "process_s": dict(self.process_s),
            "service_s": {_service(own): seconds for own, seconds in self.service_s.items()},
        }

    def after(self, timed: Sequence[TimedMove]) -> "Durations":
        """The durations after a run: each move that it made has the mean of its times there.

        Source: thesis, section 10.2.1 (i).
        """
        times: dict[Way, list[float]] = {}
        for way, seconds in timed:
            times.setdefault(way, []).append(seconds)
        means = {way: sum(all_s) / len(all_s) for way, all_s in times.items()}
        return replace(
            self,
            empty_s={pair: means.get(pair, seconds) for pair, seconds in self.empty_s.items()},
            loaded_s={way: means.get(way, seconds) for way, seconds in self.loaded_s.items()},
        )

    def joined(self, other: "Durations") -> "Durations":
        """The durations of both; where both have one, that of `other`."""
        return Durations(
            self.empty_s | other.empty_s,
            self.loaded_s | other.loaded_s,
            self.process_s | other.process_s,
            self.service_s | other.service_s,
            self.sim_s + other.sim_s,
            self.more_s | other.more_s,
        )

    @classmethod
    def from_json(cls, record: Mapping[str, Any], skillset: SkillSet) -> "Durations":
        """The durations that `to_json` wrote for the moves, processes and services of these skills.

        Raises BadInput for an unknown or missing move or station, and for a value that is no time [s].
        """
        empty, loaded = {_word(pair): pair for pair in skillset.travels}, {_word(way): way for way in skillset.legs}
        services = {_service(own): own for own, skills in skillset.services.items() if skills}
        processes = [station for station, skills in skillset.processes.items() if skills]
        wanted = {
            "empty_s": set(empty),
            "loaded_s": set(loaded),
            "process_s": set(processes),
            "service_s": set(services),
        }
        tables = {name: _times(record, name, names) for name, names in wanted.items()}
        return cls(
            {empty[word]: seconds for word, seconds in tables["empty_s"].items()},
            {loaded[word]: seconds for word, seconds in tables["loaded_s"].items()},
            tables["process_s"],
            {services[word]: seconds for word, seconds in tables["service_s"].items()},
        )


def _word(way: Way) -> str:
    return f"{way[0]} > {way[1]}" + (f" with {way.kind}" if isinstance(way, CarriedPath) else "")


def _service(own: Pair) -> str:
    return f"{own[0]} at {own[1]}"


def _times(record: Mapping[str, Any], table: str, wanted: set[str]) -> dict[str, float]:
    """One table of a record, with exactly the wanted entries, in the order in which they were written."""
    times = record.get(table)
    if not isinstance(times, dict):
        raise BadInput(f"{table}: it is no table of times")
    for name, seconds in times.items():
        if name not in wanted:
            raise unknown("move or station", name, wanted, table)
        if type(seconds) not in (int, float) or not 0.0 <= seconds <= LONGEST_S:
            raise BadInput(f"{table} '{name}': {repr(seconds)[:40]}: wanted 0 to {LONGEST_S:g} s")
    if missing := sorted(wanted - times.keys()):
        raise BadInput(f"{table}: the time of '{missing[0]}' is missing")
    return {name: float(seconds) for name, seconds in times.items()}


@dataclass(frozen=True)
class TimingTrial:
    """A trial in its own world: a loaded path and the process after it, empty paths, or a service.

    at: a skill that takes parts up or sets them down, on the spots of its station that the order uses, or None.
    """

    loaded: CarriedPath | None = None
    process: bool = False
    empty: tuple[Pair, ...] = ()
    service: Pair | None = None
    at: str = ""
    spots: tuple[Spot, ...] = ()


def trials(prepared: Prepared) -> list[TimingTrial]:
    """The trials that time every move once, and its ends on every spot that the order uses; they are independent."""
    skillset, timed = prepared.skillset, set[str]()
    ends = dict.fromkeys(skill for leg in skillset.legs.values() for skill in leg if skill.station and skill.kind)
    used = ((skill, spots_in_use(prepared, skill)) for skill in ends)
    made = [
        TimingTrial(at=skill.name, spots=spots)
        for skill, spots in used
        if {*spots} != {prepared.surveys.places.spots(prepared.task.station(skill.station), skill.kind)[0]}
    ]
    for way in skillset.legs:
        made.append(TimingTrial(loaded=way, process=bool(skillset.processes[way.target]) and way.target not in timed))
        timed.add(way.target)
    made += [TimingTrial(service=own) for own, skills in skillset.services.items() if skills]
    origins = dict.fromkeys(origin for origin, _ in skillset.travels)
    return made + [
        TimingTrial(empty=tuple(pair for pair in skillset.travels if pair[0] == origin)) for origin in origins
    ]


def spots_in_use(prepared: Prepared, skill: Skill) -> tuple[Spot, ...]:
    """The spots on which a skill takes up or sets down the parts of an order."""
    return prepared.surveys.spots_in_use(prepared.task.station(skill.station), skill.kind, skill.carries)


def measure(
    prepared: Prepared, on_move: Callable[[str, float], None] | None = None, workers: Workers | None = None
) -> Durations:
    """The durations [s] of all needed moves, carried out in simulation; WorkFailed if a move fails.

    A loaded path leads from the tool's rest over one station to that over the other. Its duration between other spots is
    that between the first ones plus the extra times of taking up and setting down, which are timed once for all paths
    with the same end. Each trial has its own world, so that durations do not depend on the number of processes.
    """
    tell, skillset, timed = on_move or (lambda name, seconds: None), prepared.skillset, trials(prepared)
    whole = Durations({}, {}, {})
    for timed_now in (workers or Workers()).each(partial(carried_out, prepared), timed):
        for carried in timed_now.loaded_s:
            timed_now.loaded_s[carried] += sum(whole.more_s.get(skill.name, 0.0) for skill in skillset.legs[carried])
        for way, seconds in (timed_now.loaded_s | timed_now.empty_s).items():
            tell(f"{_word(way)}, {'loaded' if isinstance(way, CarriedPath) else 'empty'}", seconds)
        for station, seconds in timed_now.process_s.items():
            tell(skillset.processes[station][-1].name, seconds)
        for own, seconds in timed_now.service_s.items():
            tell(_service(own), seconds)
        whole = whole.joined(timed_now)
    return replace(whole, more_s={})


def carried_out(prepared: Prepared, trial: TimingTrial) -> Durations:
    """The durations [s] of one trial; WorkFailed if a move fails."""
    skillset = prepared.skillset
    with World() as world:
        floor = Floor(world, skillset, prepared.surveys.layout, parts=len(prepared.order))
        durations = Durations({}, {}, {})
        if trial.loaded is not None:
            leg = skillset.legs[trial.loaded]
            for skill in leg:
                skill.furnish(floor.bench)
            leg[0].begin(floor.bench)
            part = leg[0].part
            durations.loaded_s[trial.loaded] = _timed(floor, leg, part)
            for skill in skillset.processes[trial.loaded.target] if trial.process else ():
                durations.process_s[trial.loaded.target] = _timed(floor, [skill], part)
        for pair in trial.empty:
            way = skillset.travels[pair]
            way[0].begin(floor.bench)
            durations.empty_s[pair] = _timed(floor, way)
        if trial.service is not None:
            skills = skillset.services[trial.service]
            skills[0].begin(floor.bench)
            durations.service_s[trial.service] = _timed(floor, skills)
        if trial.at:
            durations.more_s[trial.at] = _more_s(floor, skillset.skills[trial.at], trial.spots)
        return replace(durations, sim_s=world.steps * TIME_STEP)


def _more_s(floor: Floor, skill: Skill, spots: Sequence[Spot]) -> float:
    """The mean extra time [s] of a skill over spots of its station, compared with the first one; WorkFailed if it fails.

    There is one part for each spot; they are taken up one after the other and put back at once, or set down. The lowest layer
    is filled first and emptied last: parts that are taken up from layers are not put back.
    """
    scene, bench, pose, times = floor.scene, floor.bench, skill.begins_at(), dict[Spot, float]()
    task, own = scene.task, scene.task.made_as(skill.kind)
    first = scene.places.spots(task.station(skill.station), skill.kind)[0]
    feet = {
        f"{own.name} {n}": (spot, scene.places.raised(skill.kind, task.station(skill.station), spot))
        for n, spot in enumerate(dict.fromkeys((first, *spots)), start=1)
    }
    station, layered = task.station(skill.station), task.station(skill.station).is_layered
    standing = {spot for spot, _ in feet.values()}
    carriers = {
        spot: [carrier for carrier in scene.places.below(station, spot) if carrier[1] not in standing]
        for spot in standing
    }
    for spot in () if skill.carries else standing:
        stand_below(scene, station.name, carriers[spot])
    assert pose is not None
    for name, (spot, foot) in feet.items():
        if on_its_pallet(task, skill.kind, skill.station):
            scene.add(name, str(own.pallet), spot)
        if not skill.carries:
            scene.add(name, skill.kind, foot)
            if bench.sight is not None:
                bench.sight.where[scene.body_of(name, skill.kind)] = foot
    for name, (spot, foot) in sorted(feet.items(), key=lambda item: item[1][0].z if skill.carries else -item[1][0].z):
        if skill.carries:  # other parts of its kind may have to stand below its support
            stand_below(scene, station.name, carriers[spot])
        floor.stand(pose)
        if skill.carries:
            bench.hold(name, skill.kind, pose)
        times[spot] = _timed(floor, [skill], name, spot)
        if not skill.carries:
            bench.held = None
            at = replace(foot, x=foot.x + AWAY_M) if layered else foot
            scene.put(name, skill.kind, scene.kinds[skill.kind].held_at(at.raised(ABOVE_FOOT_M)))
    return sum(times[spot] for spot in spots) / len(spots) - times[first]


def _timed(floor: Floor, skills: Sequence[Skill], part: str = "", spot: Spot | None = None) -> float:
    """The duration [s] of skills in sequence with a part that is set down on a spot, by default the first; or WorkFailed."""
    start = floor.now_s
    for skill in skills:
        if floor.run(skill.aim(part, spot)) is not Status.SUCCESS:
            raise WorkFailed(f"measuring '{skill.name}': {skill.reason}")
    return floor.now_s - start


def cell_of(task: Task, durations: Durations, order: Order) -> Cell:
    """The sequencing problem with the measured durations; kinds that share a path share its mean time."""
    places = stations(task, durations.process_s)
    names = [place.name for place in places]
    wanted = [part for part in task.made if part.name in order]
    shared: dict[Pair, list[float]] = {}
    for way, seconds in durations.loaded_s.items():
        carried = sum(any(own.kind == way.kind for own in ways_of(task.part(name))) for name in order)
        shared.setdefault(way[:2], []).extend([seconds] * carried)
    tables = []
    for times in (durations.empty_s, {pair: sum(all_s) / len(all_s) for pair, all_s in shared.items()}):
        table = np.full((len(names), len(names)), np.nan)
        for (origin, target), seconds in times.items():
            table[names.index(origin), names.index(target)] = seconds
        tables.append(table)
    return Cell(
        places,
        products(wanted, durations.service_s),
        order,
        tables[0],
        tables[1],
        one_robot(task.robot.start),
        precedences=precedences(task, order),
    )


def untimed(task: Task, order: Order) -> Cell:
    """The sequencing problem before anything is timed: every move takes 1 s, and there are no windows.

    With one robot it suffices to check whether an order is allowed, because that does not depend on times.
    Raises BadInput, with its place in the file, for a task that has no sequencing problem.
    """
    with task.in_its_file():
        skillset = SkillSet.of(task, order)
        once = Durations(dict.fromkeys(skillset.travels, 1.0), dict.fromkeys(skillset.legs, 1.0), {})
        return cell_of(task, once, order).without_windows


def kept_durations(toolbox: Toolbox, key: str, skillset: SkillSet) -> Durations | None:
    """The durations kept under a key, or None; BadInput for a record that does not contain them."""
    record = toolbox.load_record(RECORDS, key)
    if record is None:
        return None
    try:
        return Durations.from_json(record, skillset)
    except BadInput as error:
        raise BadInput(f"record '{key}' in toolbox {toolbox.address}: {error}") from None


def durations_key(task: Task, layout: Layout, skillset: SkillSet, policies: Mapping[str, Policy], order: Order) -> str:
    """A hash (24 hex digits) of all inputs of the durations.

    These are the task and its files, the order, which determines the spots in use, the layout, the moves, the policies, the
    assets, all source of the lab and of the packages of its skills, and the physics engine. Raises WorkFailed if the
    engine or a source is not found.
    """
    decides = {
        "task": task.model_dump(mode="json", exclude={"name", "title", "sequencing", "subtasks", "faults"}),
        "order": order,
        "obstacles": layout.obstacles,
        "moves": [asdict(skillset.moves), [*skillset.legs]],
        "policies": {name: [policy.signature, _hash(policy.q.tobytes())] for name, policy in policies.items()},
        "assets": {path.name: _hash(read_limited(path)) for path in files_of(task)},
        "source": sorted(
            {source_key(type(skill).__module__) for skill in skillset.skills.values()} | {source_key(__name__)}
        ),
        "engine": engine(),
    }
    return _hash(json.dumps(decides, sort_keys=True).encode())[:24]


def files_of(task: Task) -> list[Path]:
    """The lab's assets, and the meshes and URDFs that the task file names, with the meshes of these."""
    named = [station.stands_on for station in task.stations] + [task.robot.model]
    named += [name for part in task.parts for name in (part.file, part.look) if name is not None]
    own = [path for path in (task.folder / name for name in named) if path.is_file()]
    meshes = [path.parent / mesh for path in own if path.suffix == ".urdf" for mesh in urdf_reader.meshes(path)]
    return sorted({path for path in (*assets_folder().iterdir(), *own, *meshes) if path.is_file()})


def _hash(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()
