"""Pictures with known truth: from the seed alone, and read back as they were made."""

import json
from pathlib import Path

import pytest

from lab.errors import BadInput
from lab.skills.made_pictures import MATS, make_pictures, mat_of
from lab.skills.scored_pictures import parts_seen, score_pictures
from lab.tasks.task_file import load
from lab.vision import read_picture


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("made") / "pictures"
    make_pictures("toast", 3, folder, 5)
    return folder


def test_pictures_are_read_back_as_they_were_made(made: Path) -> None:
    score = score_pictures(made)
    assert (score["pictures"], score["exact"], score["wrong"]) == (3, 3, [])
    assert 0 < score["marker_mean_m"] < score["marker_max_m"] < 0.004


def test_a_wrong_truth_is_told(made: Path, tmp_path: Path) -> None:
    for path in made.iterdir():
        (tmp_path / path.name).write_bytes(path.read_bytes())
    truth = json.loads((tmp_path / "00002.json").read_text())
    truth["goal"] = [11, 11]
    (tmp_path / "00002.json").write_text(json.dumps(truth))
    score = score_pictures(tmp_path)
    assert score["exact"] == 2
    assert [one["picture"] for one in score["wrong"]] == ["00002.png"]
    assert score["wrong"][0]["reason"].startswith("goal [")


def test_the_same_seed_makes_the_same_pictures(made: Path, tmp_path: Path) -> None:
    make_pictures("toast", 1, tmp_path / "again", 5)
    for name in ("mat-1.png", f"mat-{MATS}.png", "00001.png", "00001.json", "mat.png"):
        assert (made / name).read_bytes() == (tmp_path / "again" / name).read_bytes()


def test_a_folder_that_is_there_a_wrong_count_and_a_task_without_a_camera_are_refused(
    made: Path, tmp_path: Path
) -> None:
    with pytest.raises(BadInput, match="it is there already"):
        make_pictures("toast", 1, made, 0)
    with pytest.raises(BadInput, match=r"0 pictures \(--make\): wanted 1 or more"):
        make_pictures("toast", 0, tmp_path / "none", 0)
    with pytest.raises(BadInput, match="no station of it is approached through the camera's grid"):
        make_pictures("fms-arm", 1, tmp_path / "none", 0)
    with pytest.raises(BadInput, match="wanted what `lab see --make` wrote"):
        score_pictures(tmp_path)


def test_the_mat_fills_most_of_the_picture(made: Path) -> None:
    task = load("toast")
    assert mat_of(task).size_m[0] == pytest.approx(0.85 * 2 * 2.4 * 0.2027, abs=0.01)
    assert read_picture(made / "mat-1.png").shape == (640, 640, 3)


def test_no_parts_are_seen_where_none_stand(made: Path) -> None:
    from lab.skills.camera_grids import camera_view

    task = load("toast")
    assert parts_seen(task, read_picture(made / "00001.png"), camera_view(task, "toaster")) == []


@pytest.mark.parametrize(
    ("file", "change", "said"),
    [
        ("00001.json", {"markers": [{"kind": "gripper"}]}, "markers.0.world_m: Field required"),
        ("00001.json", {"start": "x"}, "start: Input should be a valid"),
        ("pictures.json", {"pictures": 0}, "pictures: Input should be greater than or equal to 1"),
        ("pictures.json", {"station": "plate"}, "station 'plate' of 'toast' has no grid"),
        ("pictures.json", {"more": 1}, "more: Extra inputs are not permitted"),
    ],
)
def test_what_is_told_of_pictures_is_checked(
    made: Path, tmp_path: Path, file: str, change: dict[str, object], said: str
) -> None:
    for path in made.iterdir():
        (tmp_path / path.name).write_bytes(path.read_bytes())
    (tmp_path / file).write_text(json.dumps(json.loads((tmp_path / file).read_text()) | change))
    with pytest.raises(BadInput) as refused:
        score_pictures(tmp_path)
    assert said in str(refused.value)


def test_a_marker_that_nobody_sees_is_told(made: Path, tmp_path: Path) -> None:
    for path in made.iterdir():
        (tmp_path / path.name).write_bytes(path.read_bytes())
    truth = json.loads((tmp_path / "00001.json").read_text())
    truth["markers"][0]["kind"] = "lamp"
    (tmp_path / "00001.json").write_text(json.dumps(truth))
    assert score_pictures(tmp_path)["wrong"][0]["reason"] == "no marker 'lamp' is seen"
