"""Where things stand: the spots at each station, the room they take, the layout that a seed draws."""

from collections.abc import Callable
from itertools import combinations
from math import hypot, pi

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lab.errors import BadInput
from lab.sim import models
from lab.sim.parts.kinds import Spot, beside
from lab.sim.scene.places import FREE_M, SLAB, Layout, Rectangle
from lab.sim.scene.scene_check import places_of
from lab.tasks.task import Order, Task
from lab.tasks.task_fields import Obstacle, Place
from lab.tasks.task_file import load

Moved = Callable[..., Task]
QUARTER = pi / 2
seeds = st.integers(0, 2**63)


def slices(number: int) -> Order:
    return ("slice",) * number


def drawn(task: Task, toasts: int, seed: int) -> Layout:
    return places_of(task).draw(slices(toasts), np.random.default_rng(seed))


def at(spot: Spot) -> tuple[float, float, float, float]:
    return (spot.x, spot.y, spot.z, spot.yaw)


@pytest.mark.parametrize("name", ["task", "fms", "breakfast"])
def test_every_station_has_as_many_spots_as_it_holds(name: str, request: pytest.FixtureRequest) -> None:
    task = request.getfixturevalue(name)
    places = places_of(task)
    for station in task.stations:
        found = places.spots(station)
        assert len(found) == station.capacity
        assert all(spot.z == places.floor(station) and spot.yaw == station.pose[2] for spot in found)
        along, across = np.max([kind.footprint_m() for kind in places.kinds_at(station.name)], axis=0)
        for one, other in combinations(found, 2):
            assert abs(one.x - other.x) > 2 * along + 0.01 or abs(one.y - other.y) > 2 * across + 0.03
        if station.spots is None:
            nearest = min(hypot(s.x - station.pose[0], s.y - station.pose[1]) for s in found)
            assert hypot(found[0].x - station.pose[0], found[0].y - station.pose[1]) == pytest.approx(nearest)


def test_spots_turn_with_their_station(task: Task, moved: Moved) -> None:
    turned = moved(task, "plate", pose=(1.0, 2.0, QUARTER), capacity=2)
    first, second = places_of(turned).spots(turned.station("plate"))
    assert at(first) == pytest.approx((1.0, 2.0 - 0.07, SLAB, QUARTER))
    assert at(second) == pytest.approx((1.0, 2.0 + 0.07, SLAB, QUARTER))


def test_a_buffers_spots_are_a_row_the_middle_ones_first(task: Task) -> None:
    """A slice is 15 mm thick, 20 mm are between parts, and 20 mm more where a finger comes between them: 55 mm apart."""
    station = task.station("toaster_buffer")
    x, y, _ = station.pose
    assert [s.x for s in places_of(task).spots(station)] == [x] * 4
    assert [s.y - y for s in places_of(task).spots(station)] == pytest.approx([0.0, -0.055, 0.055, 0.11])


def test_rows_leave_room_for_the_largest_kind_along_each_axis(breakfast: Task, moved: Moved) -> None:
    """A slice is the longer, 120 mm, and a cup, 34 mm across, the wider: 140 mm and 74 mm from spot to spot."""
    rows = moved(breakfast, "tray", spots=None)
    places = places_of(rows)
    assert places.pitch(rows.station("tray")) == pytest.approx((0.120 + 0.020, 0.034 + 0.040))
    assert places.room(rows.station("tray")) == pytest.approx((0.060 + 0.010, 0.017 + 0.0425))
    assert [kind.name for kind in places.kinds_at("tray")] == ["slice", "cup"]


def test_a_machine_may_hold_two_one_behind_the_other(task: Task, moved: Moved) -> None:
    double = moved(task, "toaster", capacity=2)
    x, y, _ = task.station("toaster").pose
    found = places_of(double).spots(double.station("toaster"))
    assert [(s.x, s.y) for s in found] == [(x, y), pytest.approx((x, y + 0.055))]


def test_given_spots_lie_off_the_pose_along_its_axes(fms: Task, moved: Moved) -> None:
    first, *_ = places_of(fms).spots(fms.station("incoming"))
    assert at(first) == pytest.approx((0.02 + 0.08, 0.72, SLAB, 0.0))
    turned = moved(fms, "incoming", pose=(0.02, 0.72, QUARTER), capacity=1, spots=((0.08, 0.01, 0.3),))
    (only,) = places_of(turned).spots(turned.station("incoming"))
    assert at(only) == pytest.approx((0.02 - 0.01, 0.72 + 0.08, SLAB, QUARTER + 0.3))


def test_the_floor_is_the_files_or_the_top_of_the_body(task: Task, fms: Task, moved: Moved) -> None:
    assert places_of(fms).floor(fms.station("lathe-1")) == 0.06
    places = places_of(fms)
    for body, size_m, floor_m, high in (
        ("slab", None, None, SLAB),
        ("slab", (0.3, 0.3, 0.02), None, 0.02),
        ("box", (0.3, 0.3, 0.07), None, 0.07),
        ("box", (0.3, 0.3, 0.07), 0.05, 0.05),  # a hollow in it
    ):
        changed = moved(fms, "lathe-1", body=body, size_m=size_m, floor_m=floor_m)
        assert places.floor(changed.station("lathe-1")) == high
    assert places_of(task).floor(task.station("toaster")) == models.TOASTER_FLOOR


def test_a_part_stands_on_its_pallet_where_it_has_one(fms: Task) -> None:
    places = places_of(fms)
    spot = Spot(0.4, 0.6, 0.012, 0.3)
    buffer, lathe = fms.station("lathe-1-in"), fms.station("lathe-1")
    assert places.raised("rook", buffer, spot) == spot.raised(0.020)
    for kind, station in (("rook", lathe), ("rook on pallet", buffer), ("pallet", buffer)):
        assert places.raised(kind, station, spot) == spot


def test_parts_begin_on_the_first_free_spots_of_where_their_routes_begin(fms: Task, breakfast: Task) -> None:
    incoming = places_of(fms).spots(fms.station("incoming"))
    assert places_of(fms).begins(("rook", "sign", "rook")) == incoming[:3]  # both kinds at one station
    places = places_of(breakfast)
    plate, shelf = (places.spots(breakfast.station(name)) for name in ("plate", "shelf"))
    assert places.begins(("slice", "cup", "slice")) == [plate[0], shelf[0], plate[1]]


def test_places_are_filled_from_the_lowest_on(palletise: Task, moved: Moved) -> None:
    high, low = Place(at=(0.1, 0.0, 0.0), height_m=0.05), Place(at=(0.1, 0.0, QUARTER))
    stacked = moved(palletise, "pallet", pose=(0.4, -0.6, QUARTER), capacity=2, places=(high, low))
    first, second = places_of(stacked).spots(stacked.station("pallet"))
    assert at(first) == pytest.approx((0.4, -0.5, 0.02, 2 * QUARTER))
    assert at(second) == pytest.approx((0.4, -0.5, 0.07, QUARTER))
    assert places_of(stacked).top_m(stacked.station("pallet")) == pytest.approx(0.12)


def test_a_spot_of_a_layer_is_carried_by_the_spots_below(palletise: Task, moved: Moved) -> None:
    places, pallet = places_of(palletise), palletise.station("pallet")
    spots = places.spots(pallet)
    assert [places.carriers(pallet, spot) for spot in spots] == [[]] * 4 + [[spot] for spot in spots[:4]]
    two = (Place(at=(-0.032, 0.0, 0.0)), Place(at=(0.032, 0.0, 0.0)), Place(at=(0.0, 0.0, 0.0), height_m=0.05))
    bonded = moved(palletise, "pallet", capacity=3, places=two)
    left, right, top = places_of(bonded).spots(bonded.station("pallet"))
    assert places_of(bonded).carriers(bonded.station("pallet"), top) == [left, right]


def test_beside_a_spot_stand_no_lower_layers_and_none_above_that_come_later(palletise: Task) -> None:
    """Of 2 x 2 places others are -1, 0, 1 columns and rows away: 3 * 3 - 1, in either layer the same."""
    here = Spot(0.0, 0.0, 0.02, 0.0)
    found = [spot for _, spot in places_of(palletise).neighbours(palletise.station("pallet"), here).values()]
    assert len(found) == 8
    assert {spot.z for spot in found} == {0.02}


def test_what_stands_below_a_place_is_of_the_kind_that_carries_it() -> None:
    kit = load("kit")
    places, tray = places_of(kit), kit.station("tray")
    boxes, lids = (places.spots(tray, kind) for kind in ("box", "lid"))
    assert [places.below(tray, spot) for spot in lids] == [[("box", spot)] for spot in boxes]
    above = [spot for kind, spot in places.neighbours(tray, boxes[1]).values() if kind == "lid"]
    assert all(spot.y != pytest.approx(boxes[1].y) for spot in above)  # its own lid comes later, or is gone


def test_parts_begin_on_what_carries_them() -> None:
    kit = load("kit")
    turned = [part.model_copy(update={"routes": (part.routes[0][::-1],)}) for part in kit.parts]
    places = places_of(kit.changed(parts=tuple(turned)))
    assert [round(spot.z, 3) for spot in places.begins(("box", "box", "lid"))] == [0.02, 0.02, 0.07]
    with pytest.raises(BadInput, match="part 'lid': count: at 'tray' 2 lids would stand on more than 1 box"):
        places.begins(("box", "lid", "lid"))


def test_a_nest_takes_its_kind_alone(breakfast: Task, moved: Moved) -> None:
    """Cups have places of their own on the tray, so that slices have the others."""
    given = tuple(Place(at=(0.0, 0.1 * n, 0.0), kind="cup" if n == 1 else None) for n in (-1, 0, 1))
    tray = moved(breakfast, "tray", capacity=3, spots=None, places=given)
    places, station = places_of(tray), tray.station("tray")
    left, middle, right = places.spots(station)
    assert places.spots(station, "cup") == [right]
    assert places.spots(station, "slice") == [left, middle]
    beside = [places.neighbours(station, spot).values() for spot in (left, right)]
    assert {kind for found in beside for kind, _ in found} == {"slice", "cup"}
    assert tray.share_places("tray", "slice", "cup") is False
    with pytest.raises(BadInput, match="places for them in the task file is 1"):
        tray.order(counts={"cup": 2})


def test_at_machines_there_are_no_pallets(fms: Task) -> None:
    places = places_of(fms)
    assert [kind.name for kind in places.kinds_at("mill")] == ["sign"]
    assert [kind.name for kind in places.kinds_at("mill-in")] == ["sign on pallet"]
    assert [kind.name for kind in places.kinds_at("outgoing")] == ["rook on pallet", "sign on pallet"]


def test_in_rows_there_are_neighbours_on_all_sides_of_a_storage_and_on_two_of_a_buffer(task: Task) -> None:
    places, here = places_of(task), Spot(0.5, 0.2, 0.012, QUARTER)
    found = places.neighbours(task.station("plate"), here)
    assert {kind for kind, _ in found.values()} == {"slice"}
    assert {name: (spot.x - 0.5, spot.y - 0.2) for name, (_, spot) in found.items()} == {
        "slice in front": pytest.approx((0.055, 0.0)),  # a quarter to the left, in front is to the right
        "slice behind": pytest.approx((-0.055, 0.0)),
        "slice to the left": pytest.approx((0.0, -0.14)),
        "slice to the right": pytest.approx((0.0, 0.14)),
    }
    assert set(places.neighbours(task.station("toaster_buffer"), here)) == {"slice in front", "slice behind"}
    assert places.neighbours(task.station("toaster"), here) == {}  # one place only


def test_beside_a_spot_stands_the_widest_kind_and_a_higher_one(breakfast: Task, moved: Moved) -> None:
    """A thin cup, lower than a slice, reaches nowhere beyond one; a cup of 20 cm does above it."""
    slices, cups = breakfast.parts
    for high, kinds in ((0.05, {"slice"}), (0.2, {"slice", "cup"})):
        cup = cups.model_copy(update={"size_m": (0.012, high), "look": None, "grip": None})
        task = moved(breakfast.changed(parts=(slices, cup)), "tray", spots=None)
        found = places_of(task).neighbours(task.station("tray"), Spot(0.0, 0.0, 0.0, 0.0)).values()
        assert {kind for kind, _ in found} == kinds


def test_rows_are_so_far_apart_that_the_hand_goes_down_beside_a_part_above_its_palm() -> None:
    """The Panda's hand is 20 cm wide along the way its fingers close, its palm 48 mm above their tips."""
    panda = load("toast-panda")
    (slices,) = panda.parts
    low = slices.model_copy(update={"name": "low", "size_m": (0.06, 0.02, 0.02), "look": None, "grip": None})
    for high, apart in ((0.03, 0.0), (0.09, 0.102 + 0.005 + FREE_M)):
        post = low.model_copy(update={"name": "post", "size_m": (0.01, 0.01, high)})
        task = panda.changed(parts=(low, post))
        station = next(one for one in task.stations if one.name == task.starts("low"))
        pitch = places_of(task).pitch(station)[1]
        assert pitch >= apart - 1e-3
        assert (pitch > 0.1) is (apart > 0.0)


def test_by_given_spots_neighbours_are_wherever_one_lies_as_seen_from_another(fms: Task) -> None:
    """Of 2 x 3 places, 16 cm and 8.5 cm apart, others are -1, 0, 1 columns and -2, ..., 2 rows away: 3 * 5 - 1."""
    places, here = places_of(fms), Spot(0.0, 0.0, 0.012, 0.0)
    found = [spot for _, spot in places.neighbours(fms.station("incoming"), here).values()]
    wanted = {(column, row) for column in (-1, 0, 1) for row in (-2, -1, 0, 1, 2)} - {(0, 0)}
    assert len(found) == 14
    assert {(round(s.x / 0.16), round(s.y / 0.085)) for s in found} == wanted
    assert all(s.x / 0.16 == pytest.approx(round(s.x / 0.16)) for s in found)
    kinds = {kind for kind, _ in places.neighbours(fms.station("incoming"), here).values()}
    assert kinds <= {"rook on pallet", "sign on pallet"}


def test_neighbours_on_turned_spots_are_turned_so(fms: Task, moved: Moved) -> None:
    """The second spot lies 20 cm to the right of the first and is turned left: from it, the first lies to its left."""
    two = moved(fms, "incoming", pose=(0.3, 0.3, 0.0), capacity=2, spots=((0.0, 0.0, 0.0), (0.2, 0.0, QUARTER)))
    found = places_of(two).neighbours(two.station("incoming"), Spot(0.0, 0.0, 0.012, 0.0))
    assert sorted(at(spot) for _, spot in found.values()) == [
        pytest.approx((0.0, 0.2, 0.012, -QUARTER)),
        pytest.approx((0.2, 0.0, 0.012, QUARTER)),
    ]


def test_a_slab_is_under_all_spots_in_use(task: Task, moved: Moved) -> None:
    """Four spots from -55 to 110 mm: 165 mm, a slice's 15 mm and 85 mm more are 265; along, 120 and 60 more are 180."""
    x, y, _ = task.station("toaster_buffer").pose
    size, middle = places_of(task).slab(task.station("toaster_buffer"), 2)
    assert size == pytest.approx((0.180, 0.265, SLAB))
    assert middle == pytest.approx((x, y + 0.0275, SLAB / 2))
    turned = moved(task, "toaster_buffer", pose=(x, y, QUARTER))
    size, middle = places_of(turned).slab(turned.station("toaster_buffer"), 2)
    assert size == pytest.approx((0.180, 0.265, SLAB))
    assert middle == pytest.approx((x - 0.0275, y, SLAB / 2))


def test_a_slab_grows_with_the_parts(task: Task) -> None:
    places, plate = places_of(task), task.station("plate")
    lengths = [places.slab(plate, parts)[0][1] for parts in (1, 4, 9, 50)]
    assert lengths[0] == lengths[1] < lengths[2] < lengths[3]


def test_a_body_of_a_given_size_is_just_so(fms: Task, moved: Moved) -> None:
    turned = moved(fms, "mill", pose=(0.9, 0.0, QUARTER))
    assert places_of(turned).body(turned.station("mill"), 3) == Rectangle(0.9, 0.0, 0.13, 0.13, QUARTER)
    size, middle = places_of(fms).slab(fms.station("lathe-1"), 3)
    assert (size, middle) == ((0.22, 0.14, 0.06), (0.7, 0.58, 0.03))


def test_a_body_from_a_file_is_measured_and_turned(task: Task, moved: Moved) -> None:
    """The applier's base reaches farther before its groove, where the head moves, than behind it."""
    x, y, _ = task.station("butter_applier").pose
    straight = places_of(task).body(task.station("butter_applier"), 1)
    assert (straight.half_along, straight.half_across) == pytest.approx((0.09, 0.17))
    assert (straight.x, straight.y) == pytest.approx((x, y - 0.07))
    turned = moved(task, "butter_applier", pose=(x, y, QUARTER))
    body = places_of(turned).body(turned.station("butter_applier"), 1)
    assert (body.x, body.y, body.half_along, body.yaw) == pytest.approx((x + 0.07, y, 0.09, QUARTER))
    toaster = places_of(task).body(task.station("toaster"), 1)
    assert (2 * toaster.half_along, 2 * toaster.half_across) == pytest.approx(models.TOASTER[:2])


@given(seeds, st.integers(0, 50))
def test_a_layout_stays_within_its_areas(task: Task, seed: int, toasts: int) -> None:
    layout = drawn(task, toasts, seed)
    assert len(layout.obstacles) == len(task.obstacles)
    assert len(layout.parts) == toasts
    for obstacle, place in zip(task.obstacles, layout.obstacles, strict=True):
        off = np.abs(np.subtract(place, obstacle.position_m))
        assert np.all(off <= np.array(obstacle.area) + 1e-12)
    assert np.all(np.abs(np.array(layout.parts).reshape(-1, 3)) <= task.parts[0].area)


def test_each_part_is_drawn_within_its_own_kinds_area(breakfast: Task) -> None:
    order = ("slice", "cup") * 3
    layout = places_of(breakfast).draw(order, np.random.default_rng(7))
    for kind, off in zip(order, layout.parts, strict=True):
        assert np.all(np.abs(off) <= breakfast.part(kind).area)
    assert all(yaw == 0.0 for _, _, yaw in layout.parts[1::2])  # a cup's area has none
    assert all(yaw != 0.0 for _, _, yaw in layout.parts[::2])


def test_a_layout_is_the_seeds_and_fills_its_areas(task: Task) -> None:
    assert drawn(task, 3, 5) == drawn(task, 3, 5)
    assert drawn(task, 3, 5) != drawn(task, 3, 6)
    offs = np.array([drawn(task, 1, seed).parts[0] for seed in range(200)])
    assert np.all(offs.max(axis=0) > 0.9 * np.array(task.parts[0].area))
    assert np.all(offs.min(axis=0) < -0.9 * np.array(task.parts[0].area))


def test_the_obstacles_do_not_depend_on_how_many_toasts(task: Task) -> None:
    assert drawn(task, 1, 9).obstacles == drawn(task, 4, 9).obstacles


def test_without_areas_everything_stands_where_the_file_says(task: Task) -> None:
    still = tuple(o.model_copy(update={"area": (0.0, 0.0)}) for o in task.obstacles)
    parts = tuple(part.model_copy(update={"area": (0.0, 0.0, 0.0)}) for part in task.parts)
    layout = drawn(task.changed(obstacles=still, parts=parts), 2, 1)
    assert layout.obstacles == tuple(o.position_m for o in task.obstacles)
    assert layout.parts == ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))


def with_obstacle(task: Task, place: tuple[float, float], area: tuple[float, float] = (0.0, 0.0)) -> Task:
    """The task with one obstacle only, 6 cm a side."""
    return task.changed(obstacles=(Obstacle(name="brick", position_m=place, area=area),))


@pytest.mark.parametrize(
    ("station", "place"),
    [
        ("plate", (0.07, 0.80)),
        ("plate", (0.0, 0.80)),
        ("finished_plate", (-0.07, -0.80)),
        ("toaster_buffer", (0.42, 0.66)),  # its fourth spot
        ("butter_buffer", (0.32, -0.56)),  # beside the slice, in the gripper's way
        ("toaster", (0.975, 0.175)),
        ("toaster", (1.09, 0.175)),
        ("butter_applier", (0.80, -0.66)),
    ],
)
def test_an_obstacle_on_a_station_is_refused_by_both_names(
    task: Task, station: str, place: tuple[float, float]
) -> None:
    with pytest.raises(BadInput, match=rf"obstacle 'brick' stands on station '{station}' or too near .* at \("):
        drawn(with_obstacle(task, place), 1, 3)


@pytest.mark.parametrize("place", [(0.42, 0.76), (0.31, -0.56), (1.11, 0.175), (0.80, -0.80), (0.60, 0.0), (0.0, 0.6)])
def test_an_obstacle_beside_a_station_is_not(task: Task, place: tuple[float, float]) -> None:
    assert drawn(with_obstacle(task, place), 1, 3).obstacles == (place,)


def test_only_spots_that_the_toasts_need_are_kept_free(task: Task) -> None:
    far = with_obstacle(task, (0.0, 0.6))
    drawn(far, 4, 3)
    with pytest.raises(BadInput, match="obstacle 'brick' stands on station 'plate'"):
        drawn(far, 50, 3)


def test_a_machine_is_kept_free_as_it_is_turned(task: Task, moved: Moved) -> None:
    """Turned by 90 degrees, the applier's long base lies along +x of its groove instead of along -y."""
    x, y, _ = task.station("butter_applier").pose
    turned = moved(task, "butter_applier", pose=(x, y, QUARTER))
    out = 0.07 + 0.17
    drawn(with_obstacle(turned, (x, y - 0.2)), 1, 3)
    drawn(with_obstacle(turned, (x + out + 0.031, y)), 1, 3)
    with pytest.raises(BadInput, match="obstacle 'brick' stands on station 'butter_applier'"):
        drawn(with_obstacle(turned, (x + out + 0.029, y)), 1, 3)


def test_a_long_obstacle_is_kept_off_as_it_is_turned(task: Task) -> None:
    """A wall of 40 x 2 cm before the toaster, whose front is at x = 0.875 m: along it there is room, across it none."""
    _, y, _ = task.station("toaster").pose
    for yaw, room in ((QUARTER, True), (0.0, False)):
        wall = Obstacle(name="wall", position_m=(0.84, y), size_m=(0.4, 0.02, 0.2), yaw=yaw)
        if room:
            assert drawn(task.changed(obstacles=(wall,)), 1, 3).obstacles == ((0.84, y),)
        else:
            with pytest.raises(BadInput, match=r"'wall' stands on station 'toaster' .* its 0\.4 x 0\.02 m meet"):
                drawn(task.changed(obstacles=(wall,)), 1, 3)


@pytest.mark.parametrize("toasts", [1, 4, 12, 50])
def test_the_shipped_task_can_always_be_laid_out(task: Task, toasts: int) -> None:
    for seed in range(20):
        drawn(task, toasts, seed)


def test_an_obstacle_drawn_onto_a_station_is_drawn_again(task: Task) -> None:
    """About a third of these places are too near to the buffer's fourth spot, at y = 0.67 m."""
    wide = with_obstacle(task, (0.42, 0.76), (0.0, 0.1))
    ys = [drawn(wide, 1, seed).obstacles[0][1] for seed in range(50)]
    assert min(ys) >= 0.56 + 0.11 + 0.05 + 0.03
    assert max(ys) > 0.84


def test_rectangles_meet_by_hand() -> None:
    """A square of side 2 reaches 1 along its axes and sqrt(2) along its diagonal."""
    square = Rectangle(0.0, 0.0, 1.0, 1.0, 0.0)
    assert square.meets(Rectangle(1.9, 0.0, 1.0, 1.0, 0.0))
    assert not square.meets(Rectangle(2.1, 0.0, 1.0, 1.0, 0.0))
    assert square.meets(Rectangle(2.3, 0.0, 1.0, 1.0, np.pi / 4))
    assert not square.meets(Rectangle(2.5, 0.0, 1.0, 1.0, np.pi / 4))
    assert not square.meets(Rectangle(1.8, 1.8, 1.0, 1.0, np.pi / 4))  # boxes around both would overlap
    assert square.meets(Rectangle(0.0, 0.0, 5.0, 0.1, 1.0))


def test_a_rectangles_corners_go_around_it() -> None:
    corners = Rectangle(1.0, 2.0, 0.3, 0.1, QUARTER).corners()
    assert corners == [pytest.approx(place) for place in ((0.9, 2.3), (0.9, 1.7), (1.1, 1.7), (1.1, 2.3))]


@given(*[st.floats(-3, 3)] * 3, *[st.floats(0.01, 2)] * 4, *[st.floats(-7, 7)] * 2)
def test_meeting_is_mutual(
    x: float, y: float, z: float, a: float, b: float, c: float, d: float, e: float, f: float
) -> None:
    one, other = Rectangle(0.0, z, a, b, e), Rectangle(x, y, c, d, f)
    assert one.meets(other) == other.meets(one)
    assert one.meets(Rectangle(0.0, z, c, d, f))


def test_parts_do_not_begin_in_one_another(task: Task) -> None:
    """Two slices 14 cm apart, each up to 2 cm off along its 12 cm: some draws would have them overlap."""
    places, order = places_of(task), ("slice",) * 2
    for seed in range(60):
        ground = []
        for spot, (dx, dy, turn) in zip(
            places.begins(order), places.draw(order, np.random.default_rng(seed)).parts, strict=True
        ):
            ground.append(Rectangle(*beside((spot.x, spot.y), spot.yaw, (dx, dy)), 0.06, 0.0075, spot.yaw + turn))
        assert not ground[0].meets(ground[1])


def test_an_area_that_leaves_no_room_is_refused(task: Task) -> None:
    slices = task.parts[0].model_copy(update={"area": (0.0, 0.0, 0.0)})
    plate = task.station("plate").model_copy(update={"spots": ((0.0, 0.0, 0.0), (0.05, 0.0, 0.0)), "capacity": 2})
    near = task.changed(parts=(slices,), stations=tuple(plate if s.name == "plate" else s for s in task.stations))
    with pytest.raises(BadInput, match="parts would stand in one another at 'plate'"):
        places_of(near).draw(("slice",) * 2, np.random.default_rng(0))
