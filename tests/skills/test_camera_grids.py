"""The grids that the overhead camera looks at: what it sees in them, and what else stands in the way there."""

from math import hypot
from pathlib import Path

import numpy as np
import pytest

from lab.errors import BadInput
from lab.files import tasks_folder
from lab.mdp import greedy_path, optimal_values
from lab.sim.camera import Camera
from lab.sim.scene.places import Layout
from lab.skills import Insert
from lab.skills.camera_grids import OUT_OF_SIGHT, camera_view, overhead_camera, settings_of
from lab.skills.surveys import Surveys
from lab.tasks.task import Task
from lab.tasks.task_fields import Obstacle
from lab.tasks.task_file import load
from lab.vision import Lens, see
from lab.vision.calibration import Calibration, write_calibration

ORDER = ("slice", "slice")


def with_start_at(task: Task, start_m: tuple[float, float]) -> Task:
    far = settings_of(task.station("toaster")).model_copy(update={"start_m": start_m})
    return task.changed(
        stations=tuple(s.model_copy(update={"grid": far}) if s.name == "toaster" else s for s in task.stations)
    )


def test_what_the_camera_sees_is_where_it_stands(surveys: Surveys, task: Task) -> None:
    assert task.camera is not None
    grid = surveys.camera_grid("toaster", "slice")
    seen = see(grid.picture(), grid.view())
    kinds = [m.kind for m in seen.markers]
    assert kinds.count("obstacle") == 3
    for marker in seen.markers:
        if marker.kind == "gripper":
            at = grid.settings.start_m
        elif marker.kind == "toaster":
            at = task.station("toaster").pose[:2]
        else:
            at = min(surveys.layout.obstacles, key=lambda p: np.hypot(*np.subtract(p, marker.world_m)))
        assert np.hypot(*np.subtract(at, marker.world_m)) < 2e-3
    assert grid.picture().shape == (task.camera.pixels, task.camera.pixels, 3)
    assert overhead_camera(task, 100).width == grid.camera(100).width == 100


def test_a_turned_toaster_is_seen_in_its_place_too(task: Task) -> None:
    stations = tuple(
        s.model_copy(update={"pose": (0.9, 0.1, 0.7)}) if s.name == "toaster" else s for s in task.stations
    )
    bare = task.changed(stations=stations, obstacles=())
    grid = Surveys(bare, ORDER, Layout((), ())).camera_grid("toaster", "slice")
    seen = see(grid.picture(), grid.view())
    toaster = next(m for m in seen.markers if m.kind == "toaster")
    assert toaster.world_m == pytest.approx((0.9, 0.1), abs=2e-3)


def test_cubes_of_several_heights_in_the_picture_are_refused(task: Task) -> None:
    made = (
        Obstacle(name="low", position_m=(0.725, -0.075), cubes=2),
        Obstacle(name="high", position_m=(0.775, 0.075), cubes=3),
        Obstacle(name="far", position_m=(0.2, 0.9), cubes=9),
    )
    with pytest.raises(
        BadInput, match=r"obstacles in the camera's grid must be equally high, got \[0\.122, 0\.182\] m"
    ):
        camera_view(task.changed(obstacles=made), "toaster")
    camera_view(task.changed(obstacles=made[1:]), "toaster")


def test_a_start_out_of_reach_is_refused(task: Task, layout: Layout) -> None:
    far = with_start_at(task, (1.6, 0.0))
    with pytest.raises(BadInput, match=r"station 'toaster': grid\.start_m \[1\.6, 0\.0\]: out of the arm's reach"):
        Surveys(far, ORDER, layout).camera_grid("toaster", "slice").picture()


def test_a_start_with_a_cube_in_the_way_of_the_slice_is_refused(task: Task) -> None:
    x, y = settings_of(task.station("toaster")).start_m
    near = Obstacle(name="cube", position_m=(x + 0.08, y), cubes=3)
    beside = Surveys(task.changed(obstacles=(near,)), ORDER, Layout((near.position_m,), ()))
    with pytest.raises(
        BadInput, match=r"grid\.start_m \[0\.\d+, -0\.\d+\]: cube is in the way of a carried slice there"
    ):
        beside.camera_grid("toaster", "slice").picture()


def with_buffer_at(task: Task, pose: tuple[float, float, float]) -> Task:
    stations = tuple(s.model_copy(update={"pose": pose}) if s.name == "butter_buffer" else s for s in task.stations)
    return task.changed(stations=stations, obstacles=())


def test_waiting_slices_block_the_grid_where_a_carried_one_would_hit_them(task: Task) -> None:
    """The buffer itself is low; the slices that wait in it reach 7 mm above the foot of a carried one."""
    surveys = Surveys(with_buffer_at(task, (0.60, -0.02, 0.0)), ORDER, Layout((), ()))
    grid = surveys.camera_grid("toaster", "slice")
    causes = grid.survey(frozenset()).causes
    for spot in surveys.places.spots(surveys.task.station("butter_buffer")):
        steps = zip((spot.x, spot.y), grid.settings.origin_m, strict=True)
        cell = tuple(int((at - low) / grid.settings.cell_m) for at, low in steps)
        assert causes[cell].startswith("slice ")
        assert causes[cell].endswith(" at butter_buffer")
    problem = Insert(surveys.task, "slice", "toaster").setup(surveys)
    crossed = {problem.mdp.state_cell(s) for s in greedy_path(optimal_values(problem.mdp, 0.99), problem.mdp, 99)[0]}
    assert not any(causes[cell] for cell in crossed)


def test_slices_that_wait_far_from_the_grid_change_nothing(task: Task, surveys: Surveys) -> None:
    """The shipped stations stand clear of it: the nearest block no cell, and the plates are not even looked at."""
    grid = surveys.camera_grid("toaster", "slice")
    assert {str(name) for name in np.unique(grid.survey(frozenset()).causes)} <= {
        "",
        "out of reach",
        "cubes A",
        "cubes B",
        "cubes C",
    }
    assert not any("plate" in name for name in grid._waiting())


def test_a_slice_waits_on_every_spot_that_the_toasts_need(task: Task) -> None:
    roomy = with_buffer_at(task, (0.60, -0.02, 0.0))
    stations = tuple(s.model_copy(update={"capacity": 6}) if s.name == "butter_buffer" else s for s in roomy.stations)
    roomy = roomy.changed(stations=stations)
    for toasts, waiting in ((0, 4), (5, 5), (9, 6)):
        names = Surveys(roomy, ("slice",) * toasts, Layout((), ())).camera_grid("toaster", "slice")._waiting()
        assert sum(name.endswith(" at butter_buffer") for name in names) == waiting
        assert sum(name.endswith(" at butter_applier") for name in names) == 1


# ---- two grids, one camera -----------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def twice() -> Surveys:
    """Two toasters with a grid each; everything where the file says."""
    task = load("two-toasters")
    return Surveys(task, ORDER, Layout(tuple(o.position_m for o in task.obstacles), ()))


@pytest.mark.parametrize(("station", "cubes"), [("toaster-1", {"cubes A"}), ("toaster-2", {"cubes B", "cubes C"})])
def test_each_grid_is_read_with_its_own_machine_and_cubes(twice: Surveys, station: str, cubes: set[str]) -> None:
    insert = Insert(twice.task, "slice", station)
    mdp = insert.setup(twice).mdp
    place, settings = twice.task.station(station), settings_of(twice.task.station(station))
    marker = insert.seen.goal_marker
    assert marker.world_m == pytest.approx(place.pose[:2], abs=2e-3)
    assert insert.seen.view.centre(insert.seen.start) == pytest.approx(settings.start_m, abs=1e-9)
    kinds = [m.kind for m in insert.seen.markers]
    assert (kinds.count("toaster"), kinds.count("obstacle")) == (1, len(cubes))
    for seen in (m for m in insert.seen.markers if m.kind == "obstacle"):
        at = {o.name: hypot(*np.subtract(o.position_m, seen.world_m)) for o in twice.task.obstacles}
        assert min(at, key=lambda name: at[name]) in cubes
        assert mdp.terminal[int(np.ravel_multi_index(seen.cell, mdp.shape))]
    assert mdp.shape == settings.shape


def test_a_station_without_a_grid_has_none(task: Task) -> None:
    with pytest.raises(BadInput, match="station 'plate' is approached from above, not through the camera's grid"):
        settings_of(task.station("plate"))


def test_without_a_camera_there_is_no_picture(fms: Task) -> None:
    with pytest.raises(BadInput, match=r"task 'fms-arm' has no \[camera\]"):
        overhead_camera(fms)


def test_where_the_camera_would_not_see_the_gripper_it_may_not_go(task: Task) -> None:
    """Half as wide a view, still over the grid's middle: its border is out of sight, its middle is not."""
    assert task.camera is not None
    narrow = task.camera.model_copy(update={"field_of_view_rad": 0.25})
    bare = task.changed(obstacles=(), camera=narrow)
    causes = Surveys(bare, ORDER, Layout((), ())).camera_grid("toaster", "slice").survey(frozenset()).causes
    assert causes[0, 0] == OUT_OF_SIGHT
    assert causes[6, 6] == ""
    wide = Surveys(task.changed(obstacles=()), ORDER, Layout((), ())).camera_grid("toaster", "slice")
    assert OUT_OF_SIGHT not in wide.survey(frozenset()).causes


def test_a_calibrated_camera_with_a_bent_lens_shows_the_same_grid(tmp_path: Path) -> None:
    hung = Camera((0.85, 0.01, 2.41), (0.84, 0.02, 0.0), (0.01, 1.0, 0.0), 0.4, 640, 640)
    turn, shift = hung.turn_and_shift()
    lens = Lens((640, 640), hung.lens().focal, (324.0, 317.0), (-0.5, 0.1, 0.003, -0.002, 0.0))
    rows = tuple(tuple(row) for row in turn.tolist())
    write_calibration(tmp_path / "camera.json", Calibration(lens, rows, tuple(shift.tolist()), 0.0, 0, "by hand"))
    text = (tasks_folder() / "toast.toml").read_text()
    (tmp_path / "mine.toml").write_text(text.replace("pixels = 640\n", 'pixels = 640\ncalibration = "camera.json"\n'))
    mine, plain = load(str(tmp_path / "mine.toml")), load("toast")
    layout = Layout(tuple(one.position_m for one in plain.obstacles), ())
    grids = [Surveys(task, ("slice",), layout).camera_grid("toaster", "slice") for task in (mine, plain)]
    seen, wanted = (see(grid.picture(), grid.view()) for grid in grids)
    assert (seen.start, seen.goal, seen.obstacles) == (wanted.start, wanted.goal, wanted.obstacles)
    assert all(
        np.hypot(a.world_m[0] - b.world_m[0], a.world_m[1] - b.world_m[1]) < 0.002
        for a, b in zip(seen.markers, wanted.markers, strict=True)
    )
    assert plain.camera is not None
    with pytest.raises(BadInput, match=r"calibration.*no such file"):
        camera_view(plain.changed(camera=plain.camera.model_copy(update={"calibration": "none.json"})), "toaster")
