"""A task's skills: exactly those that its parts' routes need, and the cell that their measured durations make."""

from dataclasses import replace

import numpy as np
import pytest

from lab.errors import BadInput
from lab.production.durations import Durations, cell_of
from lab.sim.arms.arm_models import arm_named
from lab.sim.parts.kinds import kinds_of
from lab.skills import SKILLS, Insert, PlacePart, Transfer
from lab.skills.cover import CoverPlace
from lab.skills.skillset import CarriedPath, SkillSet, products, stations, ways_of
from lab.skills.surveys import INSERT
from lab.tasks.task import Order, Task
from lab.tasks.task_fields import Stage
from lab.tasks.task_file import load


@pytest.fixture(scope="module")
def task() -> Task:
    return load("toast")


@pytest.fixture(scope="module")
def fms() -> Task:
    return load("fms-arm")


def slices(number: int) -> Order:
    return ("slice",) * number


def durations(skillset: SkillSet) -> Durations:
    """Empty moves take 2, 3, ... s, loaded ones 20, 21, ... s, butter 30 s, and a service 40 s."""
    empty = {pair: 2.0 + n for n, pair in enumerate(skillset.moves.empty)}
    loaded = {way: 20.0 + n for n, way in enumerate(skillset.legs)}
    services = {own: 40.0 for own, skills in skillset.services.items() if skills}
    process = {station: 30.0 for station, skills in skillset.processes.items() if skills}
    return Durations(empty, loaded, process, services, 99.0)


def direct(task: Task) -> Task:
    """The task without buffers."""
    part, (route,) = task.parts[0], task.parts[0].routes
    return task.changed(parts=(part.model_copy(update={"routes": (tuple(Stage(station=s.station) for s in route),)}),))


def test_the_crew_for_one_toast_is_what_its_way_needs(task: Task) -> None:
    assert set(SkillSet.of(direct(task), slices(1)).skills) == {
        "transfer toaster_buffer to plate",
        "grasp at plate",
        "transfer plate to insert with slice",
        "insert at toaster",
        "grasp at toaster",
        "transfer toaster to butter_applier with slice",
        "place at butter_applier",
        "butter at butter_applier",
        "grasp at butter_applier",
        "transfer butter_applier to finished_plate with slice",
        "place at finished_plate",
        "grasp at finished_plate",  # to take up again what was set down badly
    }


@pytest.mark.parametrize("toasts", [1, 2, 50])
def test_every_needed_move_has_its_skills(task: Task, toasts: int) -> None:
    skillset = SkillSet.of(task, slices(toasts))
    assert {skill.subtask for skill in skillset.skills.values()} == set(SKILLS)
    assert set(skillset.legs) == {CarriedPath(*pair, "slice") for pair in skillset.moves.loaded}
    for (origin, target, _), leg in skillset.legs.items():
        grasp, transfer, arrive = leg
        assert grasp.name == f"grasp at {origin}"
        assert skillset.picks["slice", origin] == (grasp,)
        assert isinstance(transfer, Transfer)
        assert (transfer.carries, transfer.kind) == (True, "slice")
        if target == "toaster":
            assert (transfer.target, type(arrive)) == (INSERT, Insert)
        else:
            assert (transfer.target, type(arrive)) == (target, PlacePart)
        assert arrive.name.endswith(f" at {target}")
    for origin, target in skillset.moves.empty:
        assert [skill.name for skill in skillset.travels[origin, target]] == [f"transfer {origin} to {target}"]
    assert skillset.policies == {}


def test_more_toasts_need_more_empty_ways_but_no_other_skills(task: Task) -> None:
    one, two, many = (set(SkillSet.of(task, slices(toasts)).skills) for toasts in (1, 2, 30))
    assert one < two == many
    assert all(name.startswith("transfer ") and "slice" not in name for name in two - one)


# ---- several kinds, routes and pallets -----------------------------------------------------------------------------


def test_only_the_kinds_that_are_ordered_need_skills() -> None:
    breakfast = load("breakfast")
    slices_only, cups_only, both = (
        set(SkillSet.of(breakfast, order).skills) for order in (("slice",), ("cup",), ("cup", "slice"))
    )
    assert not any("cup" in name for name in slices_only)
    assert not any("slice" in name for name in cups_only)
    assert slices_only | cups_only <= both
    assert "place cup at coffee_machine" in cups_only  # with several kinds, names say which
    assert "transfer shelf to coffee_machine with cup" in cups_only


def test_two_machines_for_the_same_are_two_ways_through_two_grids() -> None:
    skillset = SkillSet.of(load("two-toasters"), slices(1))
    legs = {way[:2]: [skill.name for skill in leg] for way, leg in skillset.legs.items()}
    for number in (1, 2):
        assert legs["plate", f"toaster-{number}"] == [
            "grasp at plate",
            f"transfer plate to insert at toaster-{number} with slice",
            f"insert at toaster-{number}",
        ]


def test_a_part_with_a_pallet_is_carried_on_it_and_lifted_off_and_its_pallet_is_brought_on(fms: Task) -> None:
    """A sign's route is incoming, mill-in, mill, mill-out, outgoing; at the mill it is lifted off its pallet."""
    assert list(ways_of(fms.part("sign"))) == [
        CarriedPath("incoming", "mill-in", "sign on pallet"),
        CarriedPath("mill-in", "mill", "sign"),
        CarriedPath("mill-in", "mill-out", "pallet"),
        CarriedPath("mill", "mill-out", "sign"),
        CarriedPath("mill-out", "outgoing", "sign on pallet"),
    ]


def test_ways_lead_through_buffers_too(task: Task) -> None:
    assert list(ways_of(task.part("slice")))[:3] == [
        CarriedPath("plate", "toaster", "slice"),
        CarriedPath("plate", "toaster_buffer", "slice"),
        CarriedPath("toaster_buffer", "toaster", "slice"),
    ]


def test_the_crew_of_pallets(fms: Task) -> None:
    order: Order = ("rook", "rook", "sign")
    skillset = SkillSet.of(fms, order)
    ways = {way for kind in ("rook", "sign") for way in ways_of(fms.part(kind))}
    assert set(skillset.legs) == ways
    assert {way[:2] for way in ways} == set(skillset.moves.loaded)
    assert set(skillset.travels) == set(skillset.moves.empty)
    for way, leg in skillset.legs.items():
        assert [skill.name for skill in leg] == [
            f"grasp {way.kind} at {way.origin}",
            f"transfer {way.origin} to {way.target} with {way.kind}",
            f"place {way.kind} at {way.target}",
        ]
    for kind in ("rook on pallet", "sign on pallet"):
        assert [skill.name for skill in skillset.picks[kind, "outgoing"]] == [f"grasp {kind} at outgoing"]
    assert not any(skillset.processes.values())  # turning and milling take their time, nothing is learned


def test_a_service_is_what_the_robot_does_where_the_route_says_so(fms: Task) -> None:
    with_sign, without = (SkillSet.of(fms, order) for order in (("rook", "sign"), ("rook",)))
    (vacuum,) = with_sign.services["sign", "mill"]
    assert isinstance(vacuum, CoverPlace)
    assert (vacuum.name, vacuum.subtask, vacuum.kind) == ("vacuum at mill", "cover", "")
    assert [own for own, skills in with_sign.services.items() if skills] == [("sign", "mill")]
    assert not any(without.services.values())
    assert "vacuum at mill" not in without.skills


def test_a_part_has_one_skill_for_each_kind_and_place_whatever_its_way(fms: Task) -> None:
    skillset = SkillSet.of(fms, ("rook", "rook", "sign"))
    used = [skill for leg in skillset.legs.values() for skill in leg]
    assert len({id(skill) for skill in used}) == len({skill.name for skill in used}) < len(used)


# ---- what the sequencer is told ------------------------------------------------------------------------------------


def test_the_sequencer_is_told_what_the_task_says(task: Task) -> None:
    told = {s.name: s for s in stations(task, {"butter_applier": 42.0})}
    assert [(s.name, s.kind, s.capacity) for s in told.values()] == [
        (s.name, s.kind, s.capacity) for s in task.stations
    ]
    assert told["toaster"].processing_s == 60.0
    assert told["butter_applier"].processing_s == 42.0
    assert told["plate"].processing_s == 0.0
    (product,) = products(task.made)
    assert product.name == "slice"
    assert [[(s.station, s.buffer) for s in route] for route in product.routes] == [
        [(s.station, s.buffer) for s in route] for route in task.part("slice").routes
    ]


def test_the_sequencer_is_told_of_services_and_of_where_pallets_stay(fms: Task) -> None:
    rook, sign = products(fms.made, {("sign", "mill"): 240.0})
    assert (rook.name, sign.name) == ("rook", "sign")
    assert [route[2].station for route in rook.routes] == ["lathe-1", "lathe-2"]
    assert [(s.station, s.processing_s, s.service_s, s.pallet) for s in sign.routes[0] if s.pallet] == [
        ("mill", 600.0, 240.0, True)
    ]
    assert all(stage.service_s == 0.0 for route in rook.routes for stage in route)


def test_the_cell_holds_the_measured_times_and_nothing_else(task: Task) -> None:
    skillset = SkillSet.of(task, slices(2))
    measured = durations(skillset)
    cell = cell_of(task, measured, slices(2))
    assert cell.order == ("slice", "slice")
    assert cell.robot_start == task.robot.start
    carried = {way[:2]: seconds for way, seconds in measured.loaded_s.items()}
    for table, times in ((cell.empty_s, measured.empty_s), (cell.loaded_s, carried)):
        found = {
            (cell.names[i], cell.names[j]): float(table[i, j]) for i, j in np.argwhere(np.isfinite(table)) if i != j
        }
        assert found == dict(times)


def test_a_move_that_was_not_measured_is_missed(task: Task) -> None:
    skillset = SkillSet.of(task, slices(2))
    measured = durations(skillset)
    less = Durations(measured.empty_s, {}, measured.process_s)
    with pytest.raises(BadInput, match="loaded_s 'plate' -> 'toaster' is missing"):
        cell_of(task, less, slices(2))


def test_an_unknown_sub_task_is_refused(task: Task) -> None:
    typo = task.changed(subtasks={"insrt": task.subtask("insert")})
    with pytest.raises(BadInput, match=r"unknown sub-task 'insrt' .task 'toast': subtasks.: did you mean 'insert'"):
        SkillSet.of(typo, slices(1))


def test_a_machine_whose_process_nobody_knows_is_refused(task: Task) -> None:
    jam = tuple(s.model_copy(update={"process": "jam"}) if s.process else s for s in task.stations)
    with pytest.raises(BadInput, match=r"unknown process 'jam' \(station 'butter_applier'.*\): known: butter"):
        task.changed(stations=jam)


def test_what_skills_make_keeps_its_names(task: Task) -> None:
    """The patches on a part are bodies, too: nothing else in the cell is called so."""
    kind = kinds_of(task, arm_named("up6").gripper)["slice"]
    made = SkillSet.of(task, slices(2)).processes["butter_applier"]
    names = [body.name for skill in made for number in (1, 2) for body in skill.on_part(f"slice {number}", kind)]
    assert len(set(names)) == len(names) == 18
    first, *rest = task.obstacles
    for name in names:
        with pytest.raises(ValueError, match=rf"obstacle '{name}' has the name of something else in the cell"):
            task.changed(obstacles=(first.model_copy(update={"name": name}), *rest))


def test_windows_are_the_sequencers(task: Task) -> None:
    """The station's, and what a kind of part says of its own stage, each less a margin of a second."""
    window = load("toast-window")
    assert {s.name: s.at_most_s for s in stations(window, {}) if s.at_most_s is not None} == {"toaster": 3.0}
    assert stations(task, {}) == tuple(
        replace(s, processing_s=60.0, at_most_s=None) if s.name == "toaster" else s for s in stations(window, {})
    )
    part = window.made[0]
    stages = (part.routes[0][0], part.routes[0][1].model_copy(update={"at_most_s": 9.0}), *part.routes[0][2:])
    (product,) = products([part.model_copy(update={"routes": (stages,)})])
    assert [stage.at_most_s for stage in product.routes[0]] == [None, 8.0, None, None]
