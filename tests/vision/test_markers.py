"""Pictures to grids: layouts drawn through a known projection, what spoils a picture, and the annotated copy."""

from collections.abc import Sequence
from math import cos, sin

import cv2
import numpy as np
import pytest
from hypothesis import assume, example, given
from hypothesis import strategies as st
from numpy.typing import NDArray

from lab.errors import BadInput
from lab.sim.camera import Camera
from lab.sim.world import World
from lab.vision import MARKERS, GridView, Image, View, draw, find_markers, locate, plain_view, see

HEIGHTS = {"gripper": 0.30, "obstacle": 0.15, "toaster": 0.10}
CELL, SIDE = 0.05, 360
Spot = tuple[str, float, float]  # kind of marker, world x and y [m]


def camera(tilt: float = 0.0, roll: float = 0.0) -> NDArray[np.float64]:
    """Pixel from world (3, 4): 2 m above the grid's middle, right = x, up = y, tipped by `tilt`, turned by `roll`."""
    focal = SIDE * 2.2
    intrinsic = np.array([[focal, 0, SIDE / 2], [0, focal, SIDE / 2], [0, 0, 1.0]])
    down = np.array([[1, 0, 0], [0, -1, 0], [0, 0, -1.0]])
    about_x = np.array([[1, 0, 0], [0, cos(tilt), -sin(tilt)], [0, sin(tilt), cos(tilt)]])
    about_z = np.array([[cos(roll), -sin(roll), 0], [sin(roll), cos(roll), 0], [0, 0, 1]])
    turn = about_x @ down @ about_z
    matrix: NDArray[np.float64] = intrinsic @ np.column_stack([turn, turn @ np.array([-0.3, -0.3, 0.0]) + [0, 0, 2.0]])
    return matrix


def overhead(matrix: NDArray[np.float64], **more: dict[str, float]) -> View:
    return View(matrix, (0.0, 0.0), CELL, (12, 12), HEIGHTS, **more)  # type: ignore[arg-type]


def table(side: int = SIDE, wood: tuple[int, int, int] = (180, 150, 110)) -> Image:
    return np.full((side, side, 3), wood, dtype=np.uint8)


def paint(image: Image, matrix: NDArray[np.float64], spots: Sequence[Spot], radius: float = 0.3 * CELL) -> Image:
    """Discs at their heights, shaded like balls as TinyRenderer does: one side bright, the other dark and pale."""
    v, u = np.mgrid[: image.shape[0], : image.shape[1]]
    for kind, x, y in spots:
        plane = np.column_stack([matrix[:, 0], matrix[:, 1], matrix[:, 2] * HEIGHTS[kind] + matrix[:, 3]])
        point = np.linalg.inv(plane) @ np.stack([u, v, np.ones_like(u)]).reshape(3, -1)
        aside, along = ((point[i] / point[2] - at).reshape(u.shape) / radius for i, at in enumerate((x, y)))
        inside = np.hypot(aside, along) < 1
        light = (0.6 - 0.4 * aside[inside])[:, None]
        image[inside] = np.clip(np.array(MARKERS[kind].rgb) * light + 30 * (1 - light), 0, 255)
    return image


def middle(kind: str, i: int, j: int) -> Spot:
    return kind, (i + 0.5) * CELL, (j + 0.5) * CELL


LAYOUT = [middle("gripper", 1, 1), middle("toaster", 9, 10), middle("obstacle", 4, 3), middle("obstacle", 5, 7)]


def farthest(grid: GridView) -> float:
    """How far a marker's thing is from the middle of its cell at the most [m], along an axis."""
    return max(
        abs(one - other) for m in grid.markers for one, other in zip(m.world_m, grid.view.centre(m.cell), strict=True)
    )


def plain(*spots: tuple[str, int, int], side: int = 240, radius: int = 7, rows: int = 12) -> Image:
    """A picture that is the grid itself, with a disc in the middle of each named cell."""
    image = table(side)
    for kind, i, j in spots:
        centre = round((j + 0.5) * side / rows - 0.5), round((i + 0.5) * side / rows - 0.5)
        cv2.circle(image, centre, radius, MARKERS[kind].rgb, -1)
    return image


def test_a_plain_picture_is_the_grid_itself_rows_downwards() -> None:
    grid = see(plain(("gripper", 11, 0), ("toaster", 2, 9), ("obstacle", 5, 5), ("obstacle", 0, 11)))
    assert (grid.start, grid.goal, grid.obstacles) == ((11, 0), (2, 9), ((0, 11), (5, 5)))
    assert grid.shape == (12, 12)
    assert farthest(grid) < 0.05


def test_a_plain_picture_may_have_another_grid() -> None:
    grid = see(plain(("gripper", 0, 0), ("toaster", 2, 3), rows=4), shape=(4, 4))
    assert (grid.start, grid.goal, grid.shape) == ((0, 0), (2, 3), (4, 4))


@pytest.mark.parametrize(("tilt", "roll"), [(0.0, 0.0), (0.08, 0.0), (-0.06, 0.3), (0.05, 1.6)])
def test_places_come_out_of_a_tilted_picture(tilt: float, roll: float) -> None:
    matrix = camera(tilt, roll)
    grid = see(paint(table(), matrix, LAYOUT), overhead(matrix))
    assert (grid.start, grid.goal, grid.obstacles) == ((1, 1), (9, 10), ((4, 3), (5, 7)))
    assert farthest(grid) < 0.03 * CELL


def test_a_tall_marker_read_as_a_flat_one_is_found_beside_its_place() -> None:
    matrix = camera()
    image = paint(table(), matrix, LAYOUT)
    flat = View(matrix, (0.0, 0.0), CELL, (12, 12))
    assert locate(image, flat, "gripper").cell == (0, 0)
    assert locate(image, overhead(matrix), "gripper").cell == (1, 1)


def test_the_simulators_own_renderer_is_read_exactly() -> None:
    look = Camera.overhead((0.3, 0.3, 2.0), 0.45, 320)
    heights = {kind: height + 0.002 for kind, height in HEIGHTS.items()}  # a disc's upper face
    with World() as world:
        world.box("table", (1.0, 1.0, 0.02), (0.3, 0.3, -0.01), (0.86, 0.85, 0.83, 1.0))
        for number, (kind, x, y) in enumerate(LAYOUT):
            red, green, blue = (value / 255 for value in MARKERS[kind].rgb)
            world.disc(f"marker {number}", 0.3 * CELL, 0.004, (x, y, HEIGHTS[kind]), (red, green, blue, 1.0))
        image = look.picture(world)
    grid = see(image, View(look.pixel_from_world(), (0.0, 0.0), CELL, (12, 12), heights))
    assert (grid.start, grid.goal, grid.obstacles) == ((1, 1), (9, 10), ((4, 3), (5, 7)))
    assert farthest(grid) < 0.02 * CELL


cells = st.tuples(st.integers(0, 11), st.integers(0, 11))
within = st.floats(-0.3, 0.3)


@example([(0, 0), (11, 11), (0, 11), (11, 0)], [(0.3, 0.3)] * 4, 0.1, 0.1, 0)
@given(
    st.lists(cells, min_size=2, max_size=9, unique=True),
    st.lists(st.tuples(within, within), min_size=9, max_size=9),
    st.floats(-0.1, 0.1),
    st.floats(-0.2, 0.2),
    st.integers(0, 2**32 - 1),
)
def test_any_layout_is_read_exactly(
    places: list[tuple[int, int]], shifts: list[tuple[float, float]], tilt: float, roll: float, seed: int
) -> None:
    kinds = ["gripper", "toaster"] + ["obstacle"] * (len(places) - 2)
    spots = [
        (kind, (i + 0.5 + di) * CELL, (j + 0.5 + dj) * CELL)
        for kind, (i, j), (di, dj) in zip(kinds, places, shifts, strict=False)
    ]
    matrix = camera(tilt, roll)
    view = overhead(matrix)
    pixels = view.pixel([(x, y, HEIGHTS[kind]) for kind, x, y in spots])
    assume(all(np.hypot(*(a - b)) > 18 for n, a in enumerate(pixels) for b in pixels[:n]))  # none hides another
    assume(pixels.min() > 10)
    assume(pixels.max() < SIDE - 11)
    noise = np.random.default_rng(seed).normal(0, 6, (SIDE, SIDE, 3))
    image = np.clip(paint(table(), matrix, spots) + noise, 0, 255).astype(np.uint8)
    grid = see(image, view)
    assert (grid.start, grid.goal) == (places[0], places[1])
    assert grid.obstacles == tuple(sorted(places[2:]))


@pytest.mark.parametrize("light", [0.3, 0.6, 1.0])
def test_hue_not_brightness_tells_markers(light: float) -> None:
    matrix = camera()
    image = (paint(table(), matrix, LAYOUT) * light).astype(np.uint8)
    assert see(image, overhead(matrix)).obstacles == ((4, 3), (5, 7))


def test_noise_on_black_is_no_marker() -> None:
    noise = np.random.default_rng(0).integers(0, 12, (SIDE, SIDE, 3), dtype=np.uint8)
    assert find_markers(noise, plain_view((SIDE, SIDE), (12, 12))) == ((), 0)


def test_specks_and_dead_pixels_are_no_markers() -> None:
    matrix, rng = camera(), np.random.default_rng(0)
    image = paint(table(), matrix, LAYOUT)
    image[100:103, 30:33] = MARKERS["obstacle"].rgb
    dead = rng.random((SIDE, SIDE)) < 0.03
    image[dead] = rng.integers(0, 256, (dead.sum(), 3), dtype=np.uint8)
    grid = see(image, overhead(matrix))
    assert (grid.start, grid.goal, grid.obstacles) == ((1, 1), (9, 10), ((4, 3), (5, 7)))
    assert find_markers(image, overhead(matrix))[1] == 0


def test_a_highlight_on_the_edge_does_not_shift_a_marker() -> None:
    image = plain(("gripper", 11, 0), ("toaster", 2, 9), side=480, radius=15)
    whole = locate(image, plain_view((480, 480), (12, 12)), "toaster")
    x, y = map(round, whole.pixel)
    cv2.line(image, (x + 6, y), (x + 20, y), (255, 255, 255), 5)
    bitten = locate(image, plain_view((480, 480), (12, 12)), "toaster")
    assert np.hypot(*np.subtract(whole.pixel, bitten.pixel)) < 0.3


def test_a_pale_disc_is_no_marker() -> None:
    image = plain(("gripper", 11, 0), ("toaster", 2, 9))
    cv2.circle(image, (100, 100), 7, (170, 230, 170), -1)
    grid = see(image)
    assert grid.obstacles == ()


def test_what_is_not_round_or_too_large_is_passed_over_and_counted() -> None:
    image = plain(("gripper", 11, 0), ("toaster", 2, 9))
    image[30:34, 20:60] = MARKERS["obstacle"].rgb  # a bar
    image[100:120, 100:120] = MARKERS["obstacle"].rgb  # a square
    cv2.circle(image, (180, 180), 30, MARKERS["obstacle"].rgb, -1)
    assert see(image).obstacles == ()
    assert find_markers(image, plain_view((240, 240), (12, 12)))[1] == 3


def test_an_outrigger_offset_leads_from_the_marker_to_the_thing() -> None:
    matrix = camera()
    view = View(matrix, (0.0, 0.0), CELL, (12, 12), HEIGHTS, {"gripper": (2 * CELL, -1 * CELL)})
    assert see(paint(table(), matrix, LAYOUT), view).start == (3, 0)


G, T, OB = ("gripper", 11, 0), ("toaster", 2, 9), ("obstacle", 5, 5)


@pytest.mark.parametrize(
    ("spots", "message"),
    [
        ([], "no round coloured marker found: wanted gripper (magenta), obstacle (green), toaster (cyan)"),
        ([G, OB], "no toaster marker: wanted exactly one round cyan spot"),
        ([T, OB], "no gripper marker: wanted exactly one round magenta spot"),
        ([G, T, ("toaster", 4, 4)], "2 toaster markers at pixels"),
        ([G, T, ("gripper", 4, 4)], "2 gripper markers at pixels"),
    ],
)
def test_a_picture_with_wrong_markers_is_refused(spots: list[tuple[str, int, int]], message: str) -> None:
    with pytest.raises(BadInput) as caught:
        see(plain(*spots), where="table.png")
    assert str(caught.value).startswith("table.png: ")
    assert message in str(caught.value)


def test_a_marker_outside_the_grid_is_refused() -> None:
    matrix = camera()
    image = paint(table(), matrix, [*LAYOUT, ("obstacle", 0.62, 0.3)])
    with pytest.raises(BadInput, match=r"obstacle marker at pixel \(.*outside the grid: x 0\.6.* within x 0 to 0\.6"):
        see(image, overhead(matrix))


@pytest.mark.parametrize(("kind", "name"), [("gripper", "start"), ("toaster", "goal")])
def test_start_and_goal_must_be_free(kind: str, name: str) -> None:
    image = table(240)
    for marker, middle in (
        (kind, (5, 225)),
        ("obstacle", (14, 234)),
        (({"gripper", "toaster"} - {kind}).pop(), (190, 50)),
    ):
        cv2.circle(image, middle, 4, MARKERS[marker].rgb, -1)
    with pytest.raises(BadInput, match=rf"the {name} \(11, 0\) .* is on a cell that an obstacle covers"):
        see(image)


@pytest.mark.parametrize(
    "image",
    [np.zeros((9, 9), np.uint8), np.zeros((9, 9, 4), np.uint8), np.zeros((9, 9, 3)), np.zeros((0, 9, 3), np.uint8)],
)
def test_an_array_that_is_no_picture_is_refused(image: Image) -> None:
    for call in (lambda: see(image), lambda: find_markers(image, plain_view((9, 9), (3, 3)))):
        with pytest.raises(BadInput, match=r"wanted \(H, W, 3\), RGB, uint8"):
            call()


@pytest.mark.parametrize("matrix", [np.eye(3), np.zeros((3, 4)), np.full((3, 4), np.nan)])
def test_a_matrix_that_is_no_camera_is_refused(matrix: NDArray[np.float64]) -> None:
    with pytest.raises(BadInput, match=r"wanted \(3, 4\), finite and of rank 3"):
        overhead(matrix)


def test_an_empty_grid_is_refused() -> None:
    with pytest.raises(BadInput, match="a grid of"):
        see(plain(G, T), shape=(0, 12))


def test_json_names_what_the_command_promises() -> None:
    record = see(plain(G, T, OB)).to_json()
    assert record["grid"][2] == ".........G.."
    assert record["grid"][5] == ".....#......"
    assert record["grid"][11] == "S..........."
    assert (record["start"], record["goal"], record["obstacles"]) == ([11, 0], [2, 9], [[5, 5]])
    assert [marker["kind"] for marker in record["markers"]] == ["gripper", "obstacle", "toaster"]


def test_drawing_marks_a_copy() -> None:
    matrix = camera()
    image = paint(table(), matrix, LAYOUT)
    before = image.copy()
    grid = see(image, overhead(matrix))
    drawn = draw(image, grid)
    assert (image == before).all()
    assert drawn.shape == image.shape
    corner_x, corner_y = np.rint(grid.view.pixel((1 * CELL, 1 * CELL, 0.0))).astype(int)
    assert tuple(drawn[corner_y, corner_x]) == MARKERS["gripper"].rgb
    inside_x, inside_y = np.rint(grid.view.pixel((4.9 * CELL, 3.9 * CELL, 0.0))).astype(int)
    assert drawn[inside_y, inside_x, 0] > drawn[inside_y, inside_x, 1] + 30  # an obstacle's cell is tinted red


def test_a_picture_of_nothing_but_spots_is_refused() -> None:
    spots = np.zeros((16 * 101, 16 * 100, 3), dtype=np.uint8)
    for i, j in np.ndindex(101, 100):
        cv2.circle(spots, (16 * j + 8, 16 * i + 8), 6, MARKERS["gripper"].rgb, -1)
    with pytest.raises(BadInput, match="more than 10000 round coloured spots"):
        find_markers(spots, plain_view(spots.shape[:2], (100, 100)))


# ---- several grids in one picture ----------------------------------------------------------------------------------

TWO = [middle("gripper", 1, 1), middle("toaster", 9, 10), middle("toaster", 2, 8), middle("obstacle", 4, 3)]


@pytest.mark.parametrize(("near", "goal"), [((9, 10), (9, 10)), ((8, 9), (9, 10)), ((2, 8), (2, 8)), ((4, 9), (2, 8))])
def test_of_several_machines_the_nearest_to_where_the_goals_is_counts(
    near: tuple[int, int], goal: tuple[int, int]
) -> None:
    matrix = camera()
    image, view = paint(table(), matrix, TWO), overhead(matrix)
    grid = see(image, view, goal_near_m=view.centre(near))
    assert (grid.start, grid.goal, grid.obstacles) == ((1, 1), goal, ((4, 3),))
    assert [m.cell for m in grid.markers if m.kind == "toaster"] == [goal]
    assert grid.goal_marker.cell == goal
    with pytest.raises(BadInput, match="2 toaster markers"):  # without a word where it is
        see(image, view)


def test_another_grids_markers_are_left_to_it() -> None:
    """The picture shows 12 x 12 cells: the first grid has the left 12 x 6 of them, the other the right ones."""
    matrix = camera()
    other = [middle("toaster", 5, 2), middle("obstacle", 7, 1)]
    image = paint(table(), matrix, [*LAYOUT, *other])
    left = View(matrix, (0.0, 0.0), CELL, (12, 6), HEIGHTS)
    right = View(matrix, (0.0, 6 * CELL), CELL, (12, 6), HEIGHTS)
    seen = see(image, left, goal_near_m=left.centre((5, 2)))
    assert (seen.start, seen.goal, seen.obstacles) == ((1, 1), (5, 2), ((4, 3), (7, 1)))
    with pytest.raises(BadInput, match=r"the gripper marker at pixel .* lies outside the grid"):
        see(image, right, goal_near_m=right.centre((9, 4)))  # the gripper belongs to every grid: it is at the wrong one
    moved = paint(table(), matrix, [middle("gripper", 1, 7), *LAYOUT[1:], *other])
    seen = see(moved, right, goal_near_m=right.centre((9, 4)))
    assert (seen.start, seen.goal, seen.obstacles) == ((1, 1), (9, 4), ((5, 1),))


def test_a_grid_whose_machine_is_not_in_it_has_no_goal() -> None:
    matrix = camera()
    right = View(matrix, (0.0, 6 * CELL), CELL, (12, 4), HEIGHTS)
    image = paint(table(), matrix, [middle("gripper", 1, 7), middle("toaster", 9, 10)])
    with pytest.raises(BadInput, match="no toaster marker: wanted exactly one round cyan spot"):
        see(image, right, goal_near_m=(0.5, 0.5))


def test_a_marker_is_found_in_the_window_where_it_must_be() -> None:
    """In a picture of 100 pixels a metre, a thing that is 2 m off at the most, its marker 1 m beside it and 0.3 m in radius."""
    matrix = np.array([[100.0, 0, 0, 0], [0, 100.0, 0, 0], [0, 0, 0, 1.0]])
    view = View(matrix, (0.0, 0.0), 1.0, (8, 8), {}, {"gripper": (-1.0, 0.0)}, 0.3)
    left, top, side = view.window((3.0, 4.0), "gripper", 2.0)
    assert (left, top) == (169, 169)  # a pixel beyond 4 - 2.3 m and 4 - 2.3 m
    assert 462 <= side <= 466
    image = np.full((800, 800, 3), 255, np.uint8)
    cv2.circle(image, (520, 310), 30, (255, 0, 255), -1)
    whole = locate(image, view, "gripper")
    part = locate(image[top : top + side, left : left + side], view.within((left, top, side)), "gripper")
    assert part.world_m == pytest.approx(whole.world_m)
    assert part.pixel == pytest.approx((whole.pixel[0] - left, whole.pixel[1] - top))
