"""Each kind of fault strikes for real: physics then shows what it says that it did, and the same again for the same seed."""

from collections.abc import Callable
from math import hypot
from typing import Any, get_args

import numpy as np
import pytest

from lab.production.faults import FAULTS
from lab.production.faults.injector import Injector, draw
from lab.production.faults.where import whereabouts
from lab.production.floor import Floor
from lab.sim.arms.kinematics import ToolPose
from lab.sim.world import TIME_STEP
from lab.skills.prepared_scene import Prepared, prepare
from lab.skills.skill import UPRIGHT
from lab.tasks.fault_fields import NEEDS, TAKES, FaultKind
from lab.tasks.task_file import load, names_of

Struck = Callable[..., tuple[Floor, Injector]]
SLICE = "slice 1"
TRAVEL_M = 0.30  # the tool's height between stations


@pytest.fixture(scope="module")
def prepared() -> Prepared:
    task = load("toast")
    return prepare(task, task.order(2), 0, "grasp at plate")


@pytest.fixture
def struck(prepared: Prepared, floor_with: Callable[..., tuple[Floor, Injector]]) -> Struck:
    """A floor on which one fault has struck, and a while has passed: struck({"what": ...}, carried=True)."""

    def make(
        fields: dict[str, Any], carried: bool = False, put: str = "", seconds: float = 0.5
    ) -> tuple[Floor, Injector]:
        floor, injector = floor_with(prepared, [fields])
        if carried:
            hold(floor)
        if put:
            place = floor.scene.places.spots(floor.scene.task.station(put))[0]
            floor.world.put(SLICE, (place.x, place.y, place.z + 0.061))
        let_pass(floor, seconds)
        return floor, injector

    return make


def let_pass(floor: Floor, seconds: float) -> None:
    for _ in range(round(seconds / TIME_STEP)):
        floor.tick()


def hold(floor: Floor) -> None:
    """Slice 1 hangs in the gripper, between two stations."""
    scene, pose = floor.scene, ToolPose(0.5, 0.3, TRAVEL_M, 0.0)
    scene.robot.stand(pose)
    scene.robot.open_at_once(scene.kinds["slice"].grip.width_m / 2 + 0.0005)
    scene.put(SLICE, "slice", pose)
    floor.bench.held = SLICE
    for _ in scene.robot.grip():
        floor.tick()


def place_of(floor: Floor, body: str) -> tuple[float, float]:
    x, y, _ = floor.world.pose(body)[0]
    return float(x), float(y)


def test_every_kind_of_a_task_file_is_in_the_table_and_the_other_way_round() -> None:
    assert set(FAULTS) == set(get_args(FaultKind)) == set(TAKES)
    assert set(NEEDS) <= set(FAULTS)
    assert all(kind.help and kind.what == name for name, kind in FAULTS.items())


def test_a_part_is_moved_and_stands(struck: Struck, prepared: Prepared) -> None:
    calm, _ = struck({"what": "camera blind", "at_s": 100})
    floor, injector = struck({"what": "part moved", "by_m": [0.0, 0.06], "turn_rad": 0.3})
    before, after = place_of(calm, SLICE), place_of(floor, SLICE)
    assert hypot(after[0] - before[0], after[1] - before[1]) == pytest.approx(0.06, abs=0.001)
    assert floor.bench.upright(SLICE) > 0.999
    assert whereabouts(floor, SLICE).how == "standing"
    (happened,) = injector.happened
    assert happened.words == "slice 1 was moved by 0.06 m from 'plate'"
    assert happened.explains("slice 1 is not at the plate: seen 0.06 m away")
    assert not happened.explains("slice 2 has fallen over")


def test_where_another_part_stands_nothing_is_put(struck: Struck) -> None:
    """Slice 2's own place is taken: another direction, as far away, is found for slice 1, and the two do not touch."""
    calm, _ = struck({"what": "camera blind", "at_s": 100})
    (x, y), (i, j) = place_of(calm, SLICE), place_of(calm, "slice 2")
    floor, _ = struck({"what": "part moved", "part": SLICE, "by_m": [i - x, j - y]})
    assert place_of(floor, "slice 2") == pytest.approx((i, j), abs=1e-4)
    assert floor.world.nearest(SLICE, "slice 2", 0.1) > 0.01
    assert place_of(floor, SLICE) != pytest.approx((x, y), abs=0.01)


def test_a_part_is_taken_out_of_a_machine(struck: Struck) -> None:
    floor, injector = struck({"what": "part moved", "when": "in machine"}, put="toaster")
    assert whereabouts(floor, SLICE).how == "standing"
    assert injector.happened[0].station == "toaster"
    assert hypot(*np.subtract(place_of(floor, SLICE), (0.975, 0.175))) >= 0.199


def test_a_part_is_gone(struck: Struck) -> None:
    floor, injector = struck({"what": "part gone", "part": "slice 2"}, seconds=2.0)
    assert whereabouts(floor, "slice 2").how == "gone"
    assert floor.world.pose("slice 2")[0][2] == pytest.approx(-0.75 + 0.06, abs=0.002)  # stands on the ground
    assert injector.happened[0].words == "slice 2 was taken away from 'plate'"


def test_a_part_falls_over(struck: Struck) -> None:
    floor, _ = struck({"what": "part fallen"})
    assert floor.bench.upright(SLICE) < 0.05
    assert whereabouts(floor, SLICE).how == "lying"


@pytest.mark.parametrize(("seconds", "low", "high"), [(0.04, 0.002, 0.03), (0.4, 0.2, 0.4)])
def test_a_part_slips_and_sags_or_is_lost(struck: Struck, seconds: float, low: float, high: float) -> None:
    """Falling freely for 0.04 s is 8 mm; for 0.4 s it is off."""
    floor, injector = struck({"what": "part slips", "seconds": seconds}, carried=True, seconds=1.0)
    hangs = TRAVEL_M - 0.03 - float(floor.world.pose(SLICE)[0][2])  # its middle is 3 cm below the finger tips
    assert low < hangs < high
    assert floor.bench.holds(SLICE) == (seconds < 0.1)
    assert not injector.lasting


@pytest.mark.parametrize("to", [{}, {"by_m": [0.1, 0.0]}, {"at_m": [1.36, 1.34]}, {"at_m": [1.8, 0.3]}])
def test_a_part_is_dropped(struck: Struck, to: dict[str, Any]) -> None:
    floor, injector = struck({"what": "part dropped", **to}, carried=True, seconds=2.0)
    assert not floor.bench.holds(SLICE)
    x, y, z = floor.world.pose(SLICE)[0]
    assert z < (0.07 if to.get("at_m") != [1.8, 0.3] else -0.6)
    if "by_m" in to:
        assert (x, y) == pytest.approx((0.6, 0.3), abs=0.01)
        assert floor.bench.upright(SLICE) > UPRIGHT
    assert injector.happened[0].part == SLICE


def test_nothing_is_dropped_that_is_not_carried(struck: Struck) -> None:
    floor, injector = struck({"what": "part dropped"})
    assert injector.happened == []
    assert injector.next_s <= floor.now_s + 0.1


def test_a_box_is_put_on_the_table(struck: Struck) -> None:
    floor, injector = struck({"what": "obstacle put", "at_m": [0.4, -0.1]})
    assert floor.world.pose("strange box 1")[0] == pytest.approx([0.4, -0.1, 0.17])
    assert floor.world.ray((0.4, -0.1, 1.0), (0.4, -0.1, 0.0))[0] == "strange box 1"  # type: ignore[index]
    assert injector.happened[0].obstacle == "strange box 1"


def test_an_obstacle_is_moved_with_its_marker_and_another_is_gone(struck: Struck) -> None:
    floor, _ = struck({"what": "obstacle moved", "obstacle": "cubes A", "by_m": [0.0, -0.06]})
    at = floor.scene.layout.obstacles[0]
    assert place_of(floor, "cubes A") == pytest.approx((at[0], at[1] - 0.06))
    assert place_of(floor, "cubes A marker") == place_of(floor, "cubes A")
    floor, _ = struck({"what": "obstacle gone", "obstacle": "cubes A"})
    assert floor.world.pose("cubes A")[0][2] < -0.5
    assert floor.world.pose("cubes A marker")[0][2] < -0.5


def test_a_station_is_pushed_with_what_stands_in_it(struck: Struck) -> None:
    floor, injector = struck({"what": "station moved", "station": "toaster", "by_m": [0.02, 0.0]}, put="toaster")
    assert place_of(floor, "toaster") == pytest.approx((0.995, 0.175))
    assert place_of(floor, SLICE) == pytest.approx((0.995, 0.175), abs=0.003)
    assert floor.bench.upright(SLICE) > 0.99
    assert injector.happened[0].words == "'toaster' was moved by 0.020 m"


def test_a_strange_part_stands_on_a_free_spot(struck: Struck) -> None:
    floor, injector = struck({"what": "station full", "station": "toaster_buffer"})
    assert place_of(floor, "strange part 1") == pytest.approx(place_of_spot(floor, "toaster_buffer"), abs=0.002)
    assert floor.bench.upright("strange part 1") > 0.999
    assert injector.happened[0].station == "toaster_buffer"


def place_of_spot(floor: Floor, station: str) -> tuple[float, float]:
    spot = floor.scene.places.spots(floor.scene.task.station(station))[0]
    return spot.x, spot.y


@pytest.mark.parametrize(("what", "done_s"), [("machine slow", 4.0), ("machine fails", float("inf"))])
def test_a_machine_at_work_takes_longer_or_never_gets_done(
    prepared: Prepared, floor_with: Any, what: str, done_s: float
) -> None:
    """It began at 0 s for 3 s; from 1 s on it takes half as long again: 1 + 2 * 1.5 s."""
    floor, _ = floor_with(prepared, [{"what": what, "station": "toaster", "at_s": 1.0}])
    machine = floor.begin("toaster", SLICE, 3.0)
    let_pass(floor, 1.5)
    assert machine.until_s == pytest.approx(done_s, abs=0.01)
    assert floor.begin("toaster", SLICE, 3.0).until_s == pytest.approx(1.5 + 4.5 if done_s < 9 else done_s, abs=0.01)


def test_the_camera_is_blind_for_a_while(struck: Struck) -> None:
    floor, injector = struck({"what": "camera blind", "at_s": 0.1, "seconds": 0.3}, seconds=0.3)
    dark = [floor.world.dark]
    let_pass(floor, 0.25)
    assert [*dark, floor.world.dark] == [True, False]
    assert injector.next_s == float("inf")


@pytest.mark.parametrize(
    "name", [name for name in names_of("task") if name != "so101"]
)  # its arm is in another package
def test_drawn_faults_are_valid_in_every_task_and_the_same_again(name: str) -> None:
    task = load(name)
    order, kinds = task.order(), set[str]()
    for seed in range(60):
        faults = draw(task, order, seed, 200.0)
        assert faults == draw(task, order, seed, 200.0)
        assert 1 <= len(faults) <= 2
        assert task.changed(faults=faults).faults == faults
        kinds |= {one.what for one in faults}
    lacking = {"camera blind"} if task.camera is None else set()
    lacking |= {"obstacle moved", "obstacle gone"} if not any(max(one.area) for one in task.obstacles) else set()
    assert kinds == set(FAULTS) - lacking
