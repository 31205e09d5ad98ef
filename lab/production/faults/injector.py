"""The faults of a run, given or drawn; each strikes as soon as it can after its time.

Their bodies are put out of sight before the run.
"""

from collections.abc import Sequence

import numpy as np

from lab.production.faults import FAULTS
from lab.production.faults.fault import GROUND_M, NEVER, Fault, Happened
from lab.production.floor import Floor
from lab.sim.scene.scene import Scene
from lab.tasks.fault_fields import FaultFields
from lab.tasks.task import Order, Task

MOST = 2  # most faults of one run
BETWEEN = (0.02, 0.85)  # range of the time at which a fault is due, as shares of the predicted makespan
_SALT = 14  # separates these draws from others of the same seed
LOOKS_EVERY_S = 0.1  # interval of checks whether a due fault can strike
GROUND_SIZE_M, GROUND_RGBA = (6.0, 6.0, 0.02), (0.55, 0.56, 0.58, 1.0)
GROUND = "ground"


def draw(task: Task, order: Order, seed: int, predicted_makespan_s: float) -> tuple[FaultFields, ...]:
    """One or two faults, each of a kind that can strike in a task, by their times; the same for the same seed."""
    rng = np.random.default_rng([seed, _SALT])
    faults: list[FaultFields] = []
    wanted = int(rng.integers(1, MOST + 1))
    while len(faults) < wanted:
        kinds = list(FAULTS.values())
        kind = kinds[int(rng.integers(len(kinds)))]
        at_s = round(float(rng.uniform(*BETWEEN)) * predicted_makespan_s, 1)
        fields = kind.drawn(task, order, rng)
        if fields is not None and kind.what not in [drawn.what for drawn in faults]:
            faults.append(FaultFields.model_validate({"what": kind.what, "at_s": at_s, **fields}))
    return tuple(sorted(faults, key=lambda fault: fault.at_s))


class Injector:
    """Lets faults strike on a floor, deterministically and in physics alone.

    happened: the faults that struck, in order. next_s: the run's time of the next check [s]; NEVER: all faults are over.
    """

    def __init__(self, faults: Sequence[FaultFields]) -> None:
        self.waiting: list[Fault] = [FAULTS[fault.what](fault, n) for n, fault in enumerate(faults, start=1)]
        self.lasting: list[Fault] = []
        self.happened: list[Happened] = []
        self._look_s = 0.0
        self.next_s = self._next_s()

    def prepare(self, scene: Scene) -> None:
        """Adds the ground below the table and the faults' bodies; to be called before a recorder reads the bodies."""
        if self.waiting:
            scene.world.box(GROUND, GROUND_SIZE_M, (0.35, 0.0, GROUND_M - GROUND_SIZE_M[2] / 2), GROUND_RGBA)
            for fault in self.waiting:
                fault.prepare(scene)

    def tick(self, floor: Floor) -> bool:
        """Lets due faults strike; called before each physics step; returns whether the scene was changed."""
        now_s = floor.now_s
        if now_s < self.next_s:
            return False
        over = [fault for fault in self.lasting if fault.until_s <= now_s]
        for fault in over:
            fault.end(floor)
            self.lasting.remove(fault)
        struck = False
        if now_s >= self._look_s:
            self._look_s = now_s + LOOKS_EVERY_S
            due = [fault for fault in self.waiting if fault.fields.at_s <= now_s]
            struck = sum(self._strikes(fault, floor) for fault in due) > 0
        self.next_s = self._next_s()
        return struck or bool(over)

    def _next_s(self) -> float:
        due = [max(fault.fields.at_s, self._look_s) for fault in self.waiting]
        return min([*due, *(fault.until_s for fault in self.lasting)], default=NEVER)

    def _strikes(self, fault: Fault, floor: Floor) -> bool:
        happened = fault.strikes(floor)
        if happened is None:
            return False
        self.happened.append(happened)
        self.waiting.remove(fault)
        if fault.until_s < NEVER:
            self.lasting.append(fault)
        return True
