"""Faults that strike a part: a hand moves it, takes it away or lays it down; the fingers let it slip or drop it."""

from math import hypot, pi

import numpy as np

from lab.production.faults.fault import GROUND_M, Fault, Happened, out_of_sight
from lab.production.faults.where import (
    IN_MACHINE_M,
    LYING,
    LYING_ACROSS,
    UP,
    Foot,
    around,
    is_robot_away,
    is_undone,
    put_down,
    stack_of,
    stand,
    yaw_of,
)
from lab.production.floor import Floor
from lab.sim.world import PART_SPINNING
from lab.tasks.task import Order, Task

MOVED_M, OUT_OF_MACHINE_M, TURNED_RAD = (0.03, 0.08), 0.20, pi / 6
LAID_M = 0.06  # distance from where it stood, if it has no room to lie there
SLIPS_S = (0.03, 0.10)  # a part that falls for this time sags by 0.4 to 5 cm
FAR_M = (
    (1.36, 1.34),
    (1.36, -1.34),
    (-0.6, 0.0),
    (1.8, 0.3),
)  # three places on the table that no arm reaches; beside it


class PartMoved(Fault):
    """A hand puts a standing part elsewhere, upright, or takes it out of a machine."""

    what = "part moved"
    help = "a standing part is put elsewhere by hand, also one that stands in a machine"

    @classmethod
    def drawn(cls, task: Task, order: Order, rng: np.random.Generator) -> dict[str, object]:
        """A displacement of 3 to 8 cm with a turn of up to 30 degrees, or of 20 cm out of a machine."""
        way, turn = rng.uniform(0, 2 * pi), rng.uniform(-TURNED_RAD, TURNED_RAD)
        in_machine = bool(rng.random() < 0.4)
        far = OUT_OF_MACHINE_M if in_machine else rng.uniform(*MOVED_M)
        by_m = (round(far * np.cos(way), 3), round(far * np.sin(way), 3))
        return {"when": "in machine" if in_machine else "standing", "by_m": by_m, "turn_rad": round(turn, 3)}

    def strikes(self, floor: Floor) -> Happened | None:
        """The fault on the first part that has room."""
        for name, where in self.parts(floor, self.fields.when or "standing"):
            bodies = stack_of(floor, name)
            x, y, _ = floor.world.pose(bodies[0])[0]
            if not is_robot_away(floor, bodies):
                continue
            off = self.fields.by_m or (OUT_OF_MACHINE_M if where.how == "in machine" else MOVED_M[1], 0.0)
            wanted = [self.fields.at_m] if self.fields.at_m else [(x + dx, y + dy) for dx, dy in around(off)]
            yaw = yaw_of(floor, bodies[0]) + self.fields.turn_rad
            for at in wanted:
                if put_down(floor, bodies, (float(at[0]), float(at[1])), yaw):
                    far = hypot(at[0] - x, at[1] - y)
                    words = f"{name} was moved by {far:.2f} m from '{where.station}'"
                    undone = is_undone(floor, name)
                    return Happened(self.what, words, floor.now_s, name, where.station, undone=undone)
        return None


class PartGone(Fault):
    """A hand takes a part away."""

    what = "part gone"
    help = "a standing part is taken off the table"

    def strikes(self, floor: Floor) -> Happened | None:
        """The fault on the first standing part; its pallet stays."""
        how = ("standing", "in machine") if self.fields.when is None else (self.fields.when,)
        for name, where in self.parts(floor, *how):
            if is_robot_away(floor, [name]):
                undone = is_undone(floor, name)
                stand(floor, [name], (*out_of_sight(self.number), GROUND_M), 0.0)
                words = f"{name} was taken away from '{where.station}'"
                return Happened(self.what, words, floor.now_s, name, where.station, undone=undone)
        return None


class PartFallen(Fault):
    """A part that stands falls over."""

    what = "part fallen"
    help = "a standing part falls over"

    def strikes(self, floor: Floor) -> Happened | None:
        """The fault on the first part that has room to lie where it stands, or beside it."""
        for name, where in self.parts(floor, "standing"):
            if not is_robot_away(floor, [name]):
                continue
            (x, y, _), yaw, kind = floor.world.pose(name)[0], yaw_of(floor, name), floor.scene.kind_of[name]
            foot = Foot.of(kind, UP)
            flat = foot.high[1] - foot.low[1] <= foot.high[0] - foot.low[0]
            for dx, dy in ((0.0, 0.0), *around((LAID_M, 0.0))):
                for tilt in LYING if flat else LYING_ACROSS:
                    if put_down(floor, [name], (x + dx, y + dy), yaw, tilt):
                        words = f"{name} fell over at '{where.station}'"
                        return Happened(self.what, words, floor.now_s, name, where.station)
        return None


class PartSlips(Fault):
    """The fingers lose their friction for a moment."""

    what = "part slips"
    help = "the part in the gripper slips for a moment, and sags or is lost"

    @classmethod
    def drawn(cls, task: Task, order: Order, rng: np.random.Generator) -> dict[str, object]:
        """A duration of 0.03 to 0.1 s."""
        return {"seconds": round(float(rng.uniform(*SLIPS_S)), 3)}

    def strikes(self, floor: Floor) -> Happened | None:
        """The fault on the carried part."""
        for name, where in self.parts(floor, "carried"):
            self._body = floor.bench.held or name
            self._friction(floor, self.fields.share or 0.0)
            self.until_s = floor.now_s + (self.fields.seconds or SLIPS_S[1])
            return Happened(self.what, f"{name} slipped in the gripper", floor.now_s, name, where.station)
        return None

    def end(self, floor: Floor) -> None:
        """Restores the fingers' friction."""
        self._friction(floor, 1.0)

    def _friction(self, floor: Floor, share: float) -> None:
        own = floor.scene.kind_of[self._body].part.friction
        floor.world.friction(self._body, share * own, spinning=share * PART_SPINNING)


class PartDropped(Fault):
    """The fingers open by themselves."""

    what = "part dropped"
    help = "the fingers open while they carry a part, which falls where it is, or somewhere else"

    @classmethod
    def drawn(cls, task: Task, order: Order, rng: np.random.Generator) -> dict[str, object]:
        """The part falls where it is, or ends 6 to 12 cm away or out of reach."""
        chance, way, far = rng.random(), rng.uniform(0, 2 * pi), rng.uniform(0.06, 0.12)
        if chance < 0.4:
            return {}
        if chance < 0.7:
            return {"by_m": (round(far * np.cos(way), 3), round(far * np.sin(way), 3))}
        return {"at_m": FAR_M[int(rng.integers(len(FAR_M)))]}

    def strikes(self, floor: Floor) -> Happened | None:
        """The fault on the carried part, which falls if there is no room where it should stand."""
        for name, where in self.parts(floor, "carried"):
            body = floor.bench.held or name
            bodies = [body, name] if body != name else [name]
            if body != name and name not in stack_of(floor, name)[1:]:
                bodies = [body]
            x, y, _ = floor.world.pose(body)[0]
            floor.scene.robot.lose()
            if self.fields.at_m is not None:
                i, j = self.fields.at_m
                stand(floor, bodies, (i, j, ABOVE_TABLE_M), 0.0)
            elif self.fields.by_m is not None:
                yaw = yaw_of(floor, body)
                any(put_down(floor, bodies, (x + dx, y + dy), yaw) for dx, dy in around(self.fields.by_m))
            return Happened(self.what, f"{name} fell out of the gripper", floor.now_s, name, where.station)
        return None


ABOVE_TABLE_M = IN_MACHINE_M / 2  # height of the fall of a part that ends out of reach
