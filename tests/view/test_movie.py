"""A replay as a moving picture."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any
from weakref import ReferenceType, ref

import numpy as np
import pytest
from PIL import Image

from lab.errors import BadInput
from lab.sequencing.cell.schedule import Schedule
from lab.sim.frames import Body, Frame, Recording, Shape
from lab.view import movie
from lab.view.meshcat import replay_html
from lab.view.movie import FRAMES_PER_S, readable, write_movie
from lab.view.replay_file import read_replay
from lab.view.scene_data import Story


@pytest.fixture
def page(tmp_path: Path) -> Path:
    """A red ball that rolls from left to right of a table in 100 s."""
    table = Body("table", (Shape("box", (3.0, 3.0, 0.1)),))
    ball = Body("ball", (Shape("sphere", (0.2,), rgba=(0.9, 0.1, 0.1, 1.0)),))
    frames = [
        Frame(t, {"table": (0, 0, 0, 0, 0, 0, 1), "ball": (0, y, 0.3, 0, 0, 0, 1)}) for t, y in ((0, -1), (100, 1))
    ]
    captions = ((0.0, "It begins"), (0.0, "It is begun"), (2.0, "A step"), (4.0, "It rolls"), (99.0, "It stops"))
    story = Story(Schedule((), (), (), 0.0, ()), captions=captions, begins_s=(0.0,))
    return replay_html(Recording((table, ball), frames), tmp_path / "replay.html", story=story)


@pytest.mark.parametrize("form", ["gif", "webp"])
def test_it_moves_for_as_long_as_was_asked_for(page: Path, tmp_path: Path, form: str) -> None:
    told: list[tuple[int, int]] = []
    out = tmp_path / "new" / f"ball.{form}"
    document = write_movie(page, out, 1.0, lambda done, total: told.append((done, total)))
    assert told == [(number + 1, FRAMES_PER_S) for number in range(FRAMES_PER_S)]
    assert document["bytes"] == out.stat().st_size
    assert (document["frames"], document["speed"]) == (FRAMES_PER_S, 100.0)
    with Image.open(out) as film:
        assert getattr(film, "n_frames", 1) == FRAMES_PER_S
        columns = []
        for number in (0, FRAMES_PER_S - 1):
            film.seek(number)
            pixels = np.asarray(film.convert("RGB"), dtype=float)
            assert pixels.shape == (document["height"], document["width"], 3)
            red = pixels[..., 0] - pixels[..., 1:].max(axis=2) > 60
            columns.append(np.argwhere(red)[:, 1].mean())
        assert columns[1] - columns[0] > document["width"] / 4
    assert [path.name for path in out.parent.iterdir()] == [out.name]


@pytest.mark.parametrize("form", ["gif", "webp"])
def test_few_pictures_are_held_at_a_time(
    page: Path, tmp_path: Path, form: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of 40; of a GIF 8 stay, whose colours its palette has."""
    drawn, held, draw = list[ReferenceType[Image.Image]](), list[int](), movie._pictures

    def counted(*given: Any) -> Iterator[Image.Image]:
        for picture in draw(*given):
            drawn.append(ref(picture))
            held.append(sum(one() is not None for one in drawn))
            yield picture

    monkeypatch.setattr(movie, "_pictures", counted)
    assert write_movie(page, tmp_path / f"ball.{form}", 4.0)["frames"] == 40
    assert max(held) <= 12


def test_words_that_stay_too_short_give_way_to_those_of_the_move(page: Path) -> None:
    shown = readable(read_replay(page), 10.0)
    assert [(at_s, words) for at_s, words in shown if words != "It begins"] == [(4.0, "It rolls")]
    assert shown[-1] == (99.0, "It begins")
    assert [words for _, words in readable(read_replay(page), 1.0)][1:] == [
        "It is begun",
        "A step",
        "It rolls",
        "It stops",
    ]


def test_a_name_or_a_folder_that_cannot_be_is_refused_before_a_picture_is_drawn(page: Path, tmp_path: Path) -> None:
    def never(done: int, total: int) -> None:
        raise AssertionError

    (tmp_path / "folder.gif").mkdir()
    for name in ("ball.mp4", "folder.gif", "replay.html/ball.gif"):
        with pytest.raises(BadInput, match=name):
            write_movie(page, tmp_path / name, 1.0, never)


def test_a_replay_in_which_nothing_moves_is_refused(tmp_path: Path) -> None:
    ball = Body("ball", (Shape("sphere", (0.2,)),))
    page = replay_html(Recording((ball,), [Frame(0.0, {"ball": (0, 0, 0, 0, 0, 0, 1)})]), tmp_path / "replay.html")
    with pytest.raises(BadInput, match="nothing moves"):
        write_movie(page, tmp_path / "ball.gif", 1.0)
