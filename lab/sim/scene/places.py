"""The places in a task's cell: the spots for parts at each station, the room that they need, and the layout of a seed."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import permutations, product
from math import ceil, cos, hypot, pi, sin

import numpy as np

from lab.errors import BadInput, counted
from lab.sim.frames import Vector
from lab.sim.parts.kinds import Kind, Spot, beside, comes_as, on_its_pallet
from lab.sim.scene import station_bodies
from lab.tasks.task import Order, Task
from lab.tasks.task_fields import Obstacle, Station

SLAB = 0.012  # [m] default thickness of the slabs of plates and buffers
COLUMNS = 4  # most columns of a storage
BETWEEN_M, FINGERS_M = 0.02, 0.02  # [m] gap between parts at a station, and extra gap for fingers
AROUND_M, OPEN_M = 0.01, 0.0325  # [m] room around a part, and extra room for open fingers beside it
SLAB_M, CLOSING_M = (
    0.06,
    0.025,
)  # [m] margin of a slab around its parts, and extra margin where fingers close
APART_M = 0.002  # [m] least gap between parts at the start
FREE_M = 0.0125  # [m] least clearance between an open finger and a body beside it
UNDER_M = 0.005  # [m] least height of the palm above a body beside the part
MAX_DRAWS = 100  # draws of an obstacle's place before it counts as impossible
ON_TOP_M = 0.002  # [m] largest gap between the top of a part and the foot of the part on it
SPARE_SPOTS = 4  # spots of a station that are always considered, even with fewer parts


@dataclass(frozen=True)
class Layout:
    """The layout drawn from a seed: obstacle centres, and each part's offset from its spot (x, y [m], yaw [rad])."""

    obstacles: tuple[tuple[float, float], ...]
    parts: tuple[tuple[float, float, float], ...]


@dataclass(frozen=True)
class Rectangle:
    """A turned rectangle on the table: its middle, half its length and half its width [m], and yaw [rad]."""

    x: float
    y: float
    half_along: float
    half_across: float
    yaw: float

    def meets(self, other: "Rectangle") -> bool:
        """Whether the two overlap, by the separating axes of their sides."""
        dx, dy = other.x - self.x, other.y - self.y
        for yaw in (self.yaw, self.yaw + pi / 2, other.yaw, other.yaw + pi / 2):
            apart = abs(cos(yaw) * dx + sin(yaw) * dy)
            if apart >= self._reach(yaw) + other._reach(yaw):
                return False
        return True

    def corners(self) -> list[tuple[float, float]]:
        """Its corners (x, y) [m], in their order around it."""
        signs = ((1, 1), (-1, 1), (-1, -1), (1, -1))
        return [beside((self.x, self.y), self.yaw, (a * self.half_along, b * self.half_across)) for a, b in signs]

    def _reach(self, yaw: float) -> float:
        turn = yaw - self.yaw
        return abs(cos(turn)) * self.half_along + abs(sin(turn)) * self.half_across


class Places:
    """The spots at the stations of a task for parts of its kinds."""

    def __init__(self, task: Task, kinds: Mapping[str, Kind]) -> None:
        self.task, self.kinds = task, kinds

    def kinds_at(self, station: str) -> list[Kind]:
        """The kinds that may stand at a station, with their pallets where they come on one."""
        kinds = []
        for part in self.task.kinds_at(station):
            kinds.append(self.kinds[part.name if self.task.station(station).kind == "machine" else comes_as(part)])
        return kinds

    def floor(self, station: Station) -> float:
        """The height of a part's foot above the table at this station [m]."""
        if station.floor_m is not None:
            return station.floor_m
        if station.stands_on == "box" and station.size_m is not None:
            return station.size_m[2]
        return SLAB if station.size_m is None else station.size_m[2]

    def spots(self, station: Station, kind: str = "") -> list[Spot]:
        """The places for parts at a station, the middle or lowest ones first; as many as its capacity.

        kind: only those for parts of this kind, by its own name or by that on its pallet.
        """
        at, yaw, high = station.pose[:2], station.pose[2], self.floor(station)
        if given := station.own_places:
            nest = station.nests(self.task.made_as(kind).name) if kind else None
            return [
                Spot(*beside(at, yaw, place.at[:2]), high + place.height_m, yaw + place.at[2])
                for place in given
                if not kind or place.kind == nest
            ]
        if station.kind == "machine":
            offsets: list[tuple[float, float]] = [(0.0, 0.0)]
            if station.capacity > 1:
                offsets = self._rows(station, 1)
        else:
            offsets = self._rows(station, min(COLUMNS, station.capacity) if self._has_columns(station) else 1)
        return [Spot(*beside(at, yaw, off), high, yaw) for off in offsets[: station.capacity]]

    def _has_columns(self, station: Station) -> bool:
        """Whether parts also stand behind one another there; the palm of a level tool, which is behind its part, forbids it."""
        return station.kind == "storage" and self.task.robot.tool != "level"

    def raised(self, kind: str, station: Station, spot: Spot) -> Spot:
        """Where a part of a kind stands on a spot: on the floor, or on its pallet that stands there."""
        if not on_its_pallet(self.task, kind, station.name):
            return spot
        pallet = self.kinds[str(self.task.part(kind).pallet)]
        return spot.raised(pallet.shape.height_m)

    def _rows(self, station: Station, columns: int) -> list[tuple[float, float]]:
        rows = ceil(station.capacity / columns)
        column_m, row_m = self.pitch(station)
        grid = product(range(columns), range(rows))
        offsets = [((c - (columns - 1) / 2) * column_m, (r - (rows - 1) // 2) * row_m) for c, r in grid]
        return sorted(offsets, key=lambda at: (round(hypot(*at), 6), at))

    def pitch(self, station: Station) -> tuple[float, float]:
        """The distances from spot to spot, along and across [m], with room for fingers and hand between parts."""
        pitch_m = self._largest(
            station, BETWEEN_M, lambda kind: max(FINGERS_M, kind.finger_m - BETWEEN_M + FREE_M), 2.0
        )
        for kind, other in permutations(self.kinds_at(station.name), 2):
            if not kind.gripper.level and other.height_m > kind.palm_up_m - UNDER_M:
                past_m = np.add(kind.hand_half_m(), other.footprint_m()) + FREE_M
                pitch_m = max(pitch_m[0], float(past_m[0])), max(pitch_m[1], float(past_m[1]))
        return pitch_m

    def room(self, station: Station) -> tuple[float, float]:
        """The extent of a part and the gripper around it from a spot, along and across [m]."""
        return self._largest(station, AROUND_M, lambda kind: max(OPEN_M, kind.finger_m - AROUND_M + FREE_M), 1.0)

    def _largest(
        self, station: Station, beside_m: float, closing_m: Callable[[Kind], float], times: float
    ) -> tuple[float, float]:
        """`times` the largest extent of the kinds at a station, plus margins, larger where their fingers close [m]."""
        sizes = []
        for kind in self.kinds_at(station.name):
            reach, margins = kind.footprint_m(), kind.margins_m(beside_m, closing_m(kind))
            sizes.append([times * reach[0] + margins[0], times * reach[1] + margins[1]])
        x, y = np.max(sizes, axis=0) if sizes else (BETWEEN_M, BETWEEN_M)
        return float(x), float(y)

    def used_spots(self, station: Station, parts: int, kind: str = "") -> list[Spot]:
        """The spots that so many parts can need, and a few more for a plate; all nests, because each takes only its kind."""
        usable = self.spots(station, kind)
        return usable if station.places is not None else usable[: max(parts, SPARE_SPOTS)]

    def top_m(self, station: Station) -> float:
        """The largest height above the table of the parts at a station [m]."""
        tops = [
            spot.z + kind.height_m for kind in self.kinds_at(station.name) for spot in self.spots(station, kind.name)
        ]
        return max(tops, default=self.floor(station))

    def carriers(self, station: Station, spot: Spot) -> list[Spot]:
        """The spots whose parts carry a part that stands on a spot of a layer; none for one on the floor or on the body."""
        if not station.is_layered:
            return []
        own = self.grounds(station, spot)
        return [
            other
            for other in self.spots(station)
            for kind, ground in self.grounds(station, other)
            if abs(other.z + kind.height_m - spot.z) <= ON_TOP_M and any(ground.meets(mine) for _, mine in own)
        ]

    def below(self, station: Station, spot: Spot) -> list[tuple[str, Spot]]:
        """The kinds and spots of the parts that must stand below a spot, the lowest first."""
        by_spot = dict[Spot, str]()
        for under in self.carriers(station, spot):
            by_spot |= {other: kind for kind, other in self.below(station, under)}
            by_spot[under] = next(
                kind.name
                for kind, _ in self.grounds(station, under)
                if abs(under.z + kind.height_m - spot.z) <= ON_TOP_M
            )
        return [(kind, other) for other, kind in by_spot.items()]

    def grounds(self, station: Station, spot: Spot) -> list[tuple[Kind, Rectangle]]:
        """The kinds that may stand on a spot, with the ground that a part of each covers there."""
        covered = []
        for kind in self.kinds_at(station.name):
            if spot in self.spots(station, kind.name):
                covered.append((kind, Rectangle(spot.x, spot.y, *kind.footprint_m(), spot.yaw)))
        return covered

    def slab(self, station: Station, parts: int) -> tuple[Vector, Vector]:
        """Size and centre [m] of the slab under the spots that so many parts can need, turned as the station is."""
        x, y, yaw = station.pose
        if station.size_m is not None:
            return station.size_m, (x, y, station.size_m[2] / 2)
        feet = [beside((0.0, 0.0), -yaw, (f.x - x, f.y - y)) for f in self.used_spots(station, parts)]
        low, high = np.min(feet, axis=0), np.max(feet, axis=0)  # (2,) [m] along and across
        reach = self._largest(station, SLAB_M, lambda kind: CLOSING_M, 2.0)
        middle = beside((x, y), yaw, ((high + low) / 2).tolist())
        length, width = (high - low + np.array(reach)).tolist()
        return (length, width, self.floor(station)), (*middle, self.floor(station) / 2)

    def body(self, station: Station, parts: int) -> Rectangle:
        """The ground that a station's body covers."""
        x, y, yaw = station.pose
        if station.stands_on in ("slab", "box"):
            size, middle = self.slab(station, parts)
            return Rectangle(middle[0], middle[1], size[0] / 2, size[1] / 2, yaw)
        low, high = station_bodies.bounds(station, self.task.folder)
        at = beside((x, y), yaw, ((low[0] + high[0]) / 2, (low[1] + high[1]) / 2))
        return Rectangle(*at, (high[0] - low[0]) / 2, (high[1] - low[1]) / 2, yaw)

    def kept_free(self, parts: int) -> list[tuple[str, Rectangle]]:
        """The areas without obstacles, by station: machines' bodies, and a part with the gripper around each spot in use."""
        kept = []
        for station in self.task.stations:
            if station.kind == "machine":
                kept.append((station.name, self.body(station, parts)))
                continue
            # parts stand off their spots only where they start, since the robot sets them down on the spots
            areas = [part.area[:2] for part in self.task.made if self.task.starts(part.name) == station.name]
            off_x, off_y = np.max(areas, axis=0).tolist() if areas else (0.0, 0.0)
            along, across = self.room(station)
            spots = self.used_spots(station, parts)
            kept += [(station.name, Rectangle(s.x, s.y, along + off_x, across + off_y, s.yaw)) for s in spots]
        return kept

    def draw(self, order: Order, rng: np.random.Generator) -> Layout:
        """A layout drawn uniformly within the areas that the task gives its obstacles and parts.

        An obstacle that overlaps a station, or a part that overlaps another one, is drawn again; BadInput names one for which
        its area leaves no room.
        """
        kept = self.kept_free(len(order))
        places = [_draw_place(obstacle, kept, rng) for obstacle in self.task.obstacles]
        stand: list[tuple[float, Rectangle]] = []
        offsets = [self._draw_off(*placed, stand, rng) for placed in zip(order, self.begins(order), strict=True)]
        return Layout(tuple(places), tuple(offsets))

    def _draw_off(
        self, kind: str, spot: Spot, stand: list[tuple[float, Rectangle]], rng: np.random.Generator
    ) -> tuple[float, float, float]:
        """A drawn offset of a part from its spot, clear of the parts in `stand` at its height [m]; the part is added to them."""
        part = self.task.part(kind)
        along, across = (reach + APART_M / 2 for reach in self.kinds[comes_as(part)].footprint_m())
        for _ in range(MAX_DRAWS):
            dx, dy, turn = (float(value) for value in rng.uniform(-1, 1, 3) * part.area)
            ground = Rectangle(*beside((spot.x, spot.y), spot.yaw, (dx, dy)), along, across, spot.yaw + turn)
            if not any(z == spot.z and other.meets(ground) for z, other in stand):
                stand.append((spot.z, ground))
                return dx, dy, turn
        raise BadInput(
            f"part '{kind}': area = {list(part.area)}: parts would stand in one another at '{self.task.starts(kind)}'; "
            "wanted a smaller one, or spots that are farther apart"
        )

    def begins(self, order: Order) -> list[Spot]:
        """The spot on which each part of an order stands at the start, part 1 first: the stations' first ones.

        BadInput for a part that no other part carries.
        """
        first_spots: list[Spot] = []
        for kind in order:
            own = self.spots(self.task.station(self.task.starts(kind)), kind)
            first_spots.append(next(spot for spot in own if spot not in first_spots))
        for kind, spot in zip(order, first_spots, strict=True):
            station = self.task.station(self.task.starts(kind))
            if lacks := [name for name, under in self.below(station, spot) if under not in first_spots]:
                raise BadInput(
                    f"part '{kind}': count: at '{station.name}' {counted(order.count(kind), kind)} would stand on more than "
                    f"{counted(order.count(lacks[0]), lacks[0])}: wanted more of '{lacks[0]}', or fewer of '{kind}'"
                )
        return first_spots

    def neighbours(self, station: Station, spot: Spot) -> dict[str, tuple[str, Spot]]:
        """Parts that may stand beside one spot, their kind and spots by name; empty at a station with one place."""
        kinds = outermost(self.kinds_at(station.name))
        if not kinds or station.capacity == 1:
            return {}
        if station.own_places:
            seen = enumerate(self._seen_from(station, spot), 1)
            return {f"{kind} {n} beside": (kind, other) for n, (kind, other) in seen}
        column_m, row_m = self.pitch(station)
        steps = {"in front": (0.0, -row_m), "behind": (0.0, row_m)}
        if self._has_columns(station):
            steps |= {"to the left": (-column_m, 0.0), "to the right": (column_m, 0.0)}
        return {
            f"{kind.name} {where}": (kind.name, Spot(*beside((spot.x, spot.y), spot.yaw, off), spot.z, spot.yaw))
            for kind in kinds
            for where, off in steps.items()
        }

    def _seen_from(self, station: Station, spot: Spot) -> list[tuple[str, Spot]]:
        """The outermost kinds on each other spot of the station, with the position of that spot relative to this one.

        Lower layers are left out, because they are no higher than the support of this spot, and so are parts on top of this one.
        """
        seen_once: dict[tuple[str | float, ...], tuple[str, Spot]] = {}
        stand = {
            other_spot: [kind for kind, _ in self.grounds(station, other_spot)] for other_spot in self.spots(station)
        }
        for spot_there, own in stand.items():
            for other, kinds in stand.items():
                # the places of a kind are filled from the lowest on, so none of its own stands above it yet
                up = other.z - spot_there.z
                if other == spot_there or not own or not kinds or up < 0.0 or (up > 0.0 and own == kinds):
                    continue
                if up > 0.0 and spot_there in [under for _, under in self.below(station, other)]:
                    continue
                along, across = beside((0.0, 0.0), -spot_there.yaw, (other.x - spot_there.x, other.y - spot_there.y))
                x, y = beside((spot.x, spot.y), spot.yaw, (along, across))
                seen = Spot(x, y, spot.z + up, spot.yaw + other.yaw - spot_there.yaw)
                key = round(along, 4), round(across, 4), round(up, 4), round(other.yaw - spot_there.yaw, 4)
                seen_once |= {(kind.name, *key): (kind.name, seen) for kind in outermost(kinds)}
        return list(seen_once.values())


def outermost(kinds: Sequence[Kind]) -> list[Kind]:
    """The kinds that no other kind exceeds in all directions; clearance of them is clearance of all kinds."""
    sizes = [(*kind.footprint_m(), kind.height_m) for kind in kinds]
    return [
        kind
        for n, (kind, own) in enumerate(zip(kinds, sizes, strict=True))
        if not any(
            all(a >= b for a, b in zip(other, own, strict=True)) and (other != own or m < n)
            for m, other in enumerate(sizes)
        )
    ]


def _draw_place(
    obstacle: Obstacle, kept: Sequence[tuple[str, Rectangle]], rng: np.random.Generator
) -> tuple[float, float]:
    length, width, _ = obstacle.size
    for _ in range(MAX_DRAWS):
        dx, dy = rng.uniform(-1, 1, 2) * obstacle.area
        x, y = obstacle.position_m[0] + float(dx), obstacle.position_m[1] + float(dy)
        ground = Rectangle(x, y, length / 2, width / 2, obstacle.yaw)
        hit = next((station for station, taken in kept if taken.meets(ground)), None)
        if hit is None:
            return x, y
    raise BadInput(
        f"obstacle '{obstacle.name}' stands on station '{hit}' or too near for the gripper: at ({x:.2f}, {y:.2f}) m "
        f"its {length:g} x {width:g} m meet where parts are set down; change position_m or area, or move the station"
    )
