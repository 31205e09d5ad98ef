"""Faults of a run, simulated in physics: a moved, dropped or missing part, a failing machine, an obstacle, a blind camera.

A fault is a class in a file of this room and a row in FAULTS. The composer does not know them.
"""

from lab.production.faults.fault import Fault
from lab.production.faults.on_parts import PartDropped, PartFallen, PartGone, PartMoved, PartSlips
from lab.production.faults.on_scene import (
    CameraBlind,
    MachineFails,
    MachineSlow,
    ObstacleGone,
    ObstacleMoved,
    ObstaclePut,
    StationFull,
    StationMoved,
)

FAULTS: dict[str, type[Fault]] = {
    kind.what: kind
    for kind in (
        PartMoved,
        PartGone,
        PartFallen,
        PartSlips,
        PartDropped,
        MachineSlow,
        MachineFails,
        ObstaclePut,
        ObstacleMoved,
        ObstacleGone,
        StationMoved,
        StationFull,
        CameraBlind,
    )
}
