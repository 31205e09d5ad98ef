"""Calibration: a known lens and place come out of pictures of the mat, and of four corners; files that hold one."""

import json
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from lab.errors import BadInput
from lab.vision import Image, Lens
from lab.vision.calibration import (
    Calibration,
    Mat,
    calibrate,
    drawn,
    from_corners,
    pinhole,
    read_calibration,
    write_calibration,
)

LENS = Lens((480, 480), (1200.0, 1200.0), (243.0, 237.0), (-0.5, 0.1, 0.002, -0.003, 0.0))
MAT = Mat((0.84, 0.0))
DOWN = np.diag([1.0, -1.0, -1.0])
EYE = np.array([0.85, 0.01, 2.4])


def photos(count: int) -> list[tuple[str, Image]]:
    rng, middle, shift = np.random.default_rng(1), np.array([0.84, 0.0, 0.0]), -DOWN @ EYE
    made = [("mat-1", MAT.photographed(LENS, DOWN, shift))]
    for number in range(2, count + 1):
        tilt = Rotation.from_rotvec(rng.uniform(-0.5, 0.5, 3)).as_matrix()
        made.append((f"mat-{number}", MAT.photographed(LENS, DOWN @ tilt, shift + DOWN @ (middle - tilt @ middle))))
    return made


@pytest.fixture(scope="module")
def found() -> Calibration:
    return calibrate(photos(5), MAT)


def test_lens_and_place_come_out_of_pictures_of_the_mat(found: Calibration) -> None:
    assert found.lens.focal[0] == pytest.approx(1200.0, rel=0.005)
    assert found.lens.distortion[0] == pytest.approx(-0.5, abs=0.2)  # k2 makes up for what k1 misses
    assert found.eye_m == pytest.approx(EYE, abs=0.012)
    assert 0 < found.residual_px < 0.5
    points = np.random.default_rng(0).uniform((0.5, -0.3, 0.0), (1.1, 0.3, 0.4), (50, 3))
    truly = LENS.projected(points, DOWN, -DOWN @ EYE)
    seen = found.lens.projected(points, found.turn, found.shift)
    assert np.linalg.norm(seen - truly, axis=1).max() < 1.5  # pixels, that is 3 mm, up to 0.4 m above the table


def test_the_straightened_picture_is_that_of_the_matrix(found: Calibration) -> None:
    points = np.array([(0.6, -0.2, 0.0), (1.0, 0.25, 0.2)])
    bent = found.lens.projected(points, found.turn, found.shift)
    way = np.column_stack([points, np.ones(2)]) @ found.pixel_from_world.T
    assert found.lens.straight_points(bent) == pytest.approx(way[:, :2] / way[:, 2:], abs=1e-3)


def test_one_picture_is_enough_where_the_field_of_view_is_known() -> None:
    angle = 2 * float(np.arctan(240 / 1200))
    one = calibrate(photos(1), MAT, angle)
    assert one.lens.focal[0] == pytest.approx(1200.0, rel=1e-6)
    assert one.lens.distortion[0] == pytest.approx(-0.5, abs=0.25)
    assert one.eye_m[2] == pytest.approx(2.4, abs=0.03)
    with pytest.raises(BadInput, match="1 picture of the mat: wanted 3 or more"):
        calibrate(photos(1), MAT)


def test_a_picture_without_the_mat_is_named() -> None:
    with pytest.raises(BadInput, match=r"^empty.png: 0 ArUco markers of the mat seen \(DICT_4X4_50, 6 x 6\)"):
        calibrate([("empty.png", np.full((90, 90, 3), 200, np.uint8))], MAT, 0.4)


def test_four_corners_place_a_camera_whose_lens_is_known() -> None:
    corners = [(0.5, -0.3), (1.1, -0.3), (1.1, 0.3), (0.5, 0.3)]
    pixels = LENS.projected([(*at, 0.0) for at in corners], DOWN, -DOWN @ EYE)
    placed = from_corners(LENS, [(float(x), float(y)) for x, y in pixels], corners)
    assert placed.eye_m == pytest.approx(EYE, abs=1e-3)
    assert placed.residual_px < 1e-3
    with pytest.raises(BadInput, match="three of them lie on a line"):
        from_corners(LENS, [(0, 0), (100, 0), (200, 0), (100, 100)], corners)
    with pytest.raises(BadInput, match="3 corners: wanted 4"):
        from_corners(LENS, [(0, 0), (100, 0), (200, 100)], corners)


def test_a_file_holds_it_whole(found: Calibration, tmp_path: Path) -> None:
    write_calibration(tmp_path / "camera.json", found)
    again = read_calibration(tmp_path / "camera.json")
    assert again == found
    assert json.loads((tmp_path / "camera.json").read_text())["lens"]["distortion"].keys() == {
        "k1",
        "k2",
        "p1",
        "p2",
        "k3",
    }


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("", "no calibration"),
        ("[]", "no calibration"),
        ("{}", "'lens' is missing"),
        ('{"lens": {"distortion": {}}}', "'size' is missing"),
        (json.dumps({"lens": {"distortion": {}, "size": [1, 1], "focal": [10**400, 1]}}), "too large"),
        ("x" * 100_001, "100001 bytes"),
    ],
)
def test_files_that_hold_none(text: str, reason: str, tmp_path: Path) -> None:
    (tmp_path / "other.json").write_text(text)
    with pytest.raises(BadInput, match=reason) as caught:
        read_calibration(tmp_path / "other.json")
    assert str(caught.value).startswith(f"{tmp_path / 'other.json'}: ")
    assert "\n" not in str(caught.value)


def test_a_turn_that_is_none_is_refused(found: Calibration, tmp_path: Path) -> None:
    record = found.to_json() | {"turn": [[2, 0, 0], [0, 1, 0], [0, 0, 1]]}
    (tmp_path / "camera.json").write_text(json.dumps(record))
    with pytest.raises(BadInput, match="turn is no rotation"):
        read_calibration(tmp_path / "camera.json")


def test_the_drawn_crosses_lie_on_the_markers_corners(found: Calibration) -> None:
    image = photos(1)[0][1]
    canvas = drawn(image, found, MAT)
    x, y = LENS.projected(MAT.world(np.zeros((1, 3))), DOWN, -DOWN @ EYE)[0].round().astype(int)
    near = canvas[y - 2 : y + 3, x - 2 : x + 3].astype(int)
    assert (near[..., 1] - near[..., 0]).max() > 100  # green, at the first marker's first corner
    assert pinhole((480, 480), 2 * float(np.arctan(240 / 1200))).focal[0] == pytest.approx(1200.0)
