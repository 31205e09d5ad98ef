"""Cover: every cell of a surface is met, in the order that was learned: by a head's ray on a part, or by the robot's tool."""

from collections.abc import Callable
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from lab.errors import BadInput
from lab.learning.problem import Problem
from lab.mdp import shortest_steps
from lab.sim.world import TIME_STEP
from lab.skills.cover import REST, CoverPart, CoverPlace
from lab.skills.skill import Bench, Skill, Status
from lab.skills.surveys import Surveys
from lab.tasks.task import Task
from lab.tasks.task_fields import Obstacle
from lab.toolbox.policy import Policy

PolicyOf = Callable[[Problem], Policy]
Run = Callable[[Skill, Bench, Policy], Status]
Stage = Callable[..., Bench]
Surveyed = Callable[..., Surveys]
SLICE = "slice 1"
HEAD = ("head_x", "head_z")
SHAPE = (3, 3)


def butter_of(task: Task) -> CoverPart:
    """The applier's process, told about the first slice."""
    return CoverPart(task, "butter", "butter_applier", "slice").aim(SLICE)


def prepared(surveys: Surveys, stage: Stage, optimal: PolicyOf) -> tuple[CoverPart, Bench, Policy]:
    butter = butter_of(surveys.task)
    policy = optimal(butter.setup(surveys))
    return butter, stage(butter), policy


def test_the_shortest_coverage_is_eight_moves(surveys: Surveys) -> None:
    assert shortest_steps(butter_of(surveys.task).setup(surveys).mdp) == 8


def test_nine_cells_are_met_by_the_ray_one_beside_the_other(
    surveys: Surveys, stage: Stage, optimal: PolicyOf, run: Run
) -> None:
    butter, bench, policy = prepared(surveys, stage, optimal)
    assert run(butter, bench, policy) is Status.SUCCESS, butter.reason
    assert butter.covered[0] == (0, 0)
    assert sorted(butter.covered) == sorted(np.ndindex(*SHAPE))
    assert all(abs(a[0] - b[0]) + abs(a[1] - b[1]) == 1 for a, b in pairwise(butter.covered))
    assert bench.scene.world.joints("butter_applier", HEAD) == pytest.approx(REST, abs=1e-3)
    assert bench.upright(SLICE) > 0.999


def test_a_row_of_cells_behind_the_lip_of_the_machine_is_refused(task: Task, surveyed: Surveyed) -> None:
    """In 12 rows of 1 cm the lowest one's middle is 5 mm up, and the applier's lip is before it."""
    wanted = task.model_copy(
        update={"processes": {"butter": task.processes["butter"].model_copy(update={"grid": (12, 1)})}}
    )
    butter = CoverPart(wanted, "butter", "butter_applier", "slice")
    with pytest.raises(
        BadInput, match=r"misses \d of 12 cells of slice, as row 12 .* before it is 'butter_applier'"
    ) as error:
        butter.setup(surveyed(wanted))
    assert "grid" in str(error.value)


def test_the_time_is_the_way_and_the_rests(surveys: Surveys, task: Task, stage: Stage, optimal: PolicyOf) -> None:
    """Nine rests and, at the head's speed, eight steps of 4 cm, the way there and the way back."""
    butter, bench, policy = prepared(surveys, stage, optimal)
    butter.start(bench, policy)
    steps = 0
    while butter.step() is Status.RUNNING:
        bench.scene.world.step()
        steps += 1
    process = task.processes["butter"]
    there = back = np.hypot(0.04, 0.1)
    at_least = 9 * process.dwell_s + (there + 8 * 0.04) / process.speed_m_s
    assert at_least < steps * TIME_STEP < at_least + (back + 0.04) / process.speed_m_s


def test_without_a_slice_nothing_is_covered(surveys: Surveys, stage: Stage, optimal: PolicyOf, run: Run) -> None:
    butter, bench, policy = prepared(surveys, stage, optimal)
    bench.scene.world.put(SLICE, (0.0, 0.0, -5.0))
    assert run(butter, bench, policy) is Status.FAILURE
    assert butter.reason.startswith("'butter at butter_applier' missed 9 of 9 cells of slice 1: [(0, 0), (0, 1), ")
    assert butter.covered == []


def test_another_slice_does_not_count(surveys: Surveys, stage: Stage, optimal: PolicyOf, run: Run) -> None:
    butter, bench, policy = prepared(surveys, stage, optimal)
    butter.aim("slice 2")
    assert run(butter, bench, policy) is Status.FAILURE
    assert "of slice 2" in butter.reason


def test_a_shifted_slice_is_missed_in_part(surveys: Surveys, stage: Stage, optimal: PolicyOf, run: Run) -> None:
    butter, bench, policy = prepared(surveys, stage, optimal)
    position, turn = bench.scene.world.pose(SLICE)
    bench.scene.world.put(SLICE, position + np.array([0.05, 0.0, 0.0]), turn)  # more than one cell to the right
    assert run(butter, bench, policy) is Status.FAILURE
    assert butter.reason.startswith(
        "'butter at butter_applier' missed 3 of 9 cells of slice 1: [(0, 2), (1, 2), (2, 2)]"
    )


def test_a_second_slice_is_buttered_afresh(surveys: Surveys, stage: Stage, optimal: PolicyOf, run: Run) -> None:
    butter, bench, policy = prepared(surveys, stage, optimal)
    assert run(butter, bench, policy) is Status.SUCCESS
    bench.scene.world.put(SLICE, (0.0, 0.0, -5.0))
    assert run(butter, bench, policy) is Status.FAILURE
    assert butter.covered == []


# ---- other parts, other grids --------------------------------------------------------------------------------------


def with_blocks(task: Task) -> Task:
    """The cell with a second kind, a block 6 cm wide and 5 cm high, and a butter applier for four cells."""
    block = {"size_m": (0.060, 0.015, 0.050), "look": None, "name": "block", "grip": None, "count": 1}
    coarse = task.processes["butter"].model_copy(update={"grid": (2, 2)})
    kinds = (task.parts[0], task.parts[0].model_copy(update=block))
    return task.changed(parts=kinds, processes={"butter": coarse}, obstacles=())


def test_four_cells_of_another_part_are_met(
    task: Task, surveyed: Surveyed, stage: Stage, optimal: PolicyOf, run: Run
) -> None:
    """Of 6 x 5 cm, the cells' middles are 1.5 cm to the left and right of the middle, and 1.25 and 3.75 cm up."""
    blocks = with_blocks(task)
    surveys = surveyed(blocks)
    cover = CoverPart(blocks, "butter", "butter_applier", "block")
    policy = optimal(cover.setup(surveys))
    assert shortest_steps(cover.problem.mdp) == 3
    assert cover.cell_m() == pytest.approx((0.025, 0.030))
    upper_left, lower_right = (
        next(s for s in range(cover.problem.mdp.n_states) if cover.problem.mdp.state_cell(s) == cell)
        for cell in ((0, 0), (1, 1))
    )
    assert cover.head(upper_left) == pytest.approx((-0.015, 0.0375))
    assert cover.head(lower_right) == pytest.approx((0.015, 0.0125))
    bench = stage(cover)
    assert run(cover, bench, policy) is Status.SUCCESS, cover.reason
    assert sorted(cover.covered) == [(0, 0), (0, 1), (1, 0), (1, 1)]
    assert len(set(cover.shown())) == 4


def test_whichever_kind_stands_in_the_machine_is_covered_as_large_as_it_is(
    task: Task, surveyed: Surveyed, stage: Stage, optimal: PolicyOf, run: Run
) -> None:
    """What was learned for slices serves for blocks: the order of the cells is the same, and the head knows the part."""
    blocks = with_blocks(task)
    surveys = surveyed(blocks)
    cover = CoverPart(blocks, "butter", "butter_applier", "slice")
    policy = optimal(cover.setup(surveys))
    bench = stage(cover)
    assert run(cover, bench, policy) is Status.SUCCESS, cover.reason
    bench.scene.world.put("slice 1", (0.0, 0.0, -5.0))
    bench.scene.add("block 2", "block", surveys.places.spots(blocks.station("butter_applier"))[0])
    for _ in range(30):
        bench.scene.world.step()
    assert run(cover.aim("block 2"), bench, policy) is Status.SUCCESS, cover.reason
    assert sorted(cover.covered) == [(0, 0), (0, 1), (1, 0), (1, 1)]


def test_the_patches_lie_on_the_cells_and_are_named_by_their_part(surveys: Surveys) -> None:
    """Nine patches, 4 cm apart, on the side of the slice's negative y axis."""
    butter = butter_of(surveys.task)
    butter.setup(surveys)
    bodies = {body.name: body.shapes[0].position for body in butter.on_part("slice 4", butter.own_kind)}
    assert set(bodies) == {f"butter on slice 4 {row}{column}" for row, column in np.ndindex(3, 3)}
    x, y, z = bodies["butter on slice 4 11"]
    assert (x, z) == pytest.approx((0.0, 0.0), abs=1e-9)
    assert y < -0.0075
    assert bodies["butter on slice 4 00"] == pytest.approx((-0.9 * 0.04, y, 0.9 * 0.04))


def test_what_is_covered_in_a_state_is_what_is_seen(surveys: Surveys) -> None:
    butter = butter_of(surveys.task)
    mdp = butter.setup(surveys).mdp
    seen = butter.shown_in(mdp.start, "slice 1")
    assert len(seen) == 9
    assert [name for name, on in seen.items() if on] == ["butter on slice 1 00"]


# ---- by the robot --------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def mill(cells: dict[str, Any]) -> Surveys:
    found: Surveys = cells["fms-arm"].surveys
    return found


def vacuum_of(task: Task) -> CoverPlace:
    return CoverPlace(task, "vacuum", "mill", "")


def test_the_robots_tool_goes_over_all_cells_before_the_part(
    fms: Task, mill: Surveys, stage: Stage, optimal: PolicyOf, run: Run
) -> None:
    vacuum = vacuum_of(fms)
    policy = optimal(vacuum.setup(mill))
    assert shortest_steps(vacuum.problem.mdp) == 7
    bench = stage(vacuum)
    bench.scene.add("sign 1", "sign", mill.places.spots(fms.station("mill"))[0])
    assert run(vacuum, bench, policy) is Status.SUCCESS, vacuum.reason
    assert vacuum.covered[0] == (0, 0)
    assert sorted(vacuum.covered) == sorted(np.ndindex(4, 2))
    assert all(abs(a[0] - b[0]) + abs(a[1] - b[1]) == 1 for a, b in pairwise(vacuum.covered))
    tool, end = bench.scene.robot.tool(), mill.approach("mill")
    assert (tool.x, tool.y, tool.z) == pytest.approx((end.x, end.y, end.z), abs=2e-3)
    assert bench.stands("sign 1", mill.places.spots(fms.station("mill"))[0], 0.003)  # nothing has touched it


def test_the_cells_lie_off_the_station_as_it_is_turned(fms: Task, mill: Surveys, surveyed: Surveyed) -> None:
    """10 x 22 cm in 4 rows of 2, their middle 7 cm before the mill's: the first cell is 2.5 cm before that, 8.25 cm aside."""
    vacuum = vacuum_of(fms)
    vacuum.setup(mill)
    first, last = vacuum.over((0, 0)), vacuum.over((3, 1))
    assert (first.x, first.y, first.z) == pytest.approx((0.9 - 0.07 - 0.025, 0.0825, 0.08))
    assert (last.x, last.y) == pytest.approx((0.9 - 0.07 + 0.025, -0.0825))
    stations = tuple(
        s.model_copy(update={"pose": (0.9, 0.0, np.pi / 2)}) if s.name == "mill" else s for s in fms.stations
    )
    turned = vacuum_of(fms)
    turned.surveys = surveyed(fms.changed(stations=stations), ("sign",))
    first = turned.over((0, 0))
    assert (first.x, first.y, first.yaw) == pytest.approx((0.9 - 0.0825, -0.07 - 0.025, np.pi / 2))


def test_a_cell_that_was_not_reached_is_missed(fms: Task, mill: Surveys, stage: Stage, optimal: PolicyOf) -> None:
    vacuum = vacuum_of(fms)
    policy = optimal(vacuum.setup(mill))
    bench = stage(vacuum)
    over = vacuum.over
    vacuum.start(bench, policy)
    while vacuum.step() is Status.RUNNING:
        bench.scene.world.step()
        if len(vacuum.covered) == 7:  # the last cell is 1 cm elsewhere than the tool is on its way to
            vacuum.over = lambda cell: over(cell).shifted(dx=0.01)  # type: ignore[method-assign]
    assert vacuum.status is Status.FAILURE
    assert vacuum.reason.startswith("'vacuum at mill' missed 1 of 8 cells of mill: [(")


def test_a_surface_with_something_on_it_is_bad_input_that_names_it(fms: Task, surveyed: Surveyed) -> None:
    post = Obstacle(name="post", position_m=(0.80, 0.08), size_m=(0.02, 0.02, 0.2))
    crowded = fms.changed(obstacles=(post,))
    with pytest.raises(
        BadInput, match=r"^processes\.vacuum\..* at 'mill': at \(0\.81, 0\.08, 0\.08\) m in the way: post$"
    ):
        vacuum_of(crowded).setup(surveyed(crowded, ("sign",)))
