"""A movie of a replay as GIF or WebP, drawn from a run's replay page without a display or a browser."""

import os
from collections.abc import Callable, Iterator
from io import BytesIO
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import get_data_path  # it ships a font with the letters of many languages
from PIL import Image, ImageDraw, ImageFont

from lab.errors import BadInput
from lab.files import nearest, write_whole
from lab.view.rasterizer import BACKGROUND, Floats, Rasterizer
from lab.view.replay_file import Moments, Replay, read_replay

FORMATS = {".gif": "GIF", ".webp": "WEBP"}
WIDTH, HEIGHT, STRIP = 560, 350, 34  # pixels: size of the picture, and height of the strip with text below it
FRAMES_PER_S = 10
STAYS_S = 1.0  # [s] of the movie for which the last picture stays
READABLE_S = 0.8  # [s] of the movie; captions shown for less are dropped
SAME_S = 0.01  # times that differ by less are the same
COLOURS = 256  # of a GIF
PAPER, INK, PALE, ACCENT = (255, 255, 255), (38, 50, 66), (120, 132, 146), (31, 97, 141)


def write_movie(
    page: Path, out: Path, seconds: float = 15.0, tell: Callable[[int, int], None] = lambda done, total: None
) -> dict[str, Any]:
    """Write the replay in `page` as a movie of `seconds` [s]; returns its file, number of frames, size and speed.

    `tell(done, total)` is called after each frame. The file is written atomically. Raises BadInput for a page that is not
    a replay, a name that ends neither in .gif nor in .webp, and a path that cannot be written.
    """
    if out.suffix.lower() not in FORMATS:
        raise BadInput(f"movie '{out}': its name must end in {' or '.join(FORMATS)}")
    try:
        fits = not out.is_dir() and os.access(nearest(out.parent), os.W_OK | os.X_OK)
    except OSError:  # an impossible name
        fits = False
    if not fits:
        raise BadInput(f"movie '{str(out)[:100]}' cannot be written: it is a folder, or its folder is not writable")
    replay = read_replay(page)
    if replay.duration_s <= 0.0:
        raise BadInput(f"'{page}' has a single picture: nothing moves in it")
    count = max(2, round(seconds * FRAMES_PER_S))
    times_s = np.linspace(0.0, replay.duration_s, count)
    form, speed = FORMATS[out.suffix.lower()], replay.duration_s / seconds
    samples = list(_pictures(replay, times_s[:: max(1, count // 8)], speed)) if form == "GIF" else []
    content = _encoded(_told(_pictures(replay, times_s, speed), tell, count), count, form, samples)
    try:
        out.parent.mkdir(parents=True, exist_ok=True)
        write_whole(out, content)
    except OSError as reason:
        raise BadInput(f"movie '{out}' cannot be written: {reason.strerror or reason}") from None
    size = {"width": WIDTH, "height": HEIGHT + STRIP, "bytes": len(content)}
    return {"file": str(out), "frames": count, "speed": speed} | size


def _pictures(replay: Replay, times_s: Floats, speed: float) -> Iterator[Image.Image]:
    moments = replay.at(times_s)
    around = _around(replay, moments)
    rasterizer = Rasterizer(replay.bodies, replay.camera, WIDTH, HEIGHT, around)
    captions = readable(replay, speed)
    font = Path(get_data_path(), "fonts", "ttf", "DejaVuSans.ttf")
    words_font, title_font = ImageFont.truetype(font, 14), ImageFont.truetype(font, 12)
    paper = tuple(round(255 * part) for part in BACKGROUND)
    for number, time_s in enumerate(times_s):
        drawn = rasterizer.picture(
            moments.places[number], moments.turns[number], moments.shown[number], moments.rgba[number]
        )
        picture = Image.new("RGB", (WIDTH, HEIGHT + STRIP), PAPER)
        picture.paste(Image.fromarray(drawn))
        pen = ImageDraw.Draw(picture)
        pen.text((10, 8), replay.title, PALE, title_font)
        told = [words for at_s, words in captions if at_s <= time_s]
        middle = HEIGHT + STRIP / 2 + 1
        clock = f"{int(time_s) // 60}:{int(time_s) % 60:02d}   {speed:.0f} ×"
        pen.text((10, middle), told[-1] if told else "", INK, words_font, anchor="lm")
        free = WIDTH - 20 - pen.textlength(clock, words_font)  # text that is too long is cut off
        pen.rectangle((free, HEIGHT, WIDTH, HEIGHT + STRIP), PAPER)
        pen.text((WIDTH - 10, middle), clock, PALE, words_font, anchor="rm")
        pen.rectangle((0, HEIGHT, WIDTH, HEIGHT + 2), paper)
        pen.rectangle((0, HEIGHT, round(WIDTH * time_s / max(replay.duration_s, 1e-9)), HEIGHT + 2), ACCENT)
        yield picture


def _around(replay: Replay, moments: Moments) -> Floats:
    """The corners (n, 3) [m] of the boxes around all bodies at all times, except the largest, which is the ground."""
    boxes = []
    for meshes in replay.bodies:
        corners = np.concatenate([mesh.positions for mesh in meshes]) if meshes else np.zeros((1, 3))
        boxes.append(np.array(list(product(*zip(corners.min(axis=0), corners.max(axis=0), strict=True)))))
    sides = [float(np.ptp(box, axis=0).max()) for box in boxes]
    several = [number for number in range(len(boxes)) if len(boxes) == 1 or number != int(np.argmax(sides))]
    turned = np.einsum("tbij,bkj->tbki", moments.turns[:, several], np.stack([boxes[number] for number in several]))
    return np.asarray((turned + moments.places[:, several, None]).reshape(-1, 3))


def readable(replay: Replay, speed: float) -> list[tuple[float, str]]:
    """The captions (start [s], text) shown long enough to be read at this speed; in between, that of the current move."""
    ends = [at_s for at_s, _ in replay.captions[1:]] + [replay.duration_s]
    begun, move = -1.0, ""
    kept = []
    for (at_s, words), end_s in zip(replay.captions, ends, strict=True):
        if at_s > begun and any(abs(at_s - begin_s) < SAME_S for begin_s in replay.begins_s):
            begun, move = at_s, words
        long = (end_s - at_s) / speed >= READABLE_S
        if long or move:
            kept.append((at_s, words if long else move))
    return kept


def _told(pictures: Iterator[Image.Image], tell: Callable[[int, int], None], count: int) -> Iterator[Image.Image]:
    for number, picture in enumerate(pictures, 1):
        tell(number, count)
        yield picture


class _Film:
    """A lazy sequence of pictures as one image with frames: Pillow would put several images in a list, but seeks in one."""

    def __init__(self, pictures: Iterator[Image.Image], count: int) -> None:
        self._pictures, self.n_frames = pictures, count

    def seek(self, frame: int) -> None:
        self._picture = next(self._pictures)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._picture, name)


def _encoded(pictures: Iterator[Image.Image], count: int, form: str, samples: list[Image.Image]) -> bytes:
    """The pictures as a file in this format; only one is held in memory. samples: pictures from which a GIF's palette is made."""
    buffer = BytesIO()
    durations = [round(1000 / FRAMES_PER_S)] * (count - 1) + [round(1000 * STAYS_S)]
    how: dict[str, Any] = {"save_all": True, "duration": durations, "loop": 0}
    if form == "GIF":  # one palette for all, without dithering, so that unchanged areas cost nothing
        together = Image.new("RGB", (samples[0].width, sum(sample.height for sample in samples)))
        for row, sample in enumerate(samples):
            together.paste(sample, (0, row * sample.height))
        palette = together.quantize(COLOURS, Image.Quantize.MAXCOVERAGE)
        pictures = (picture.quantize(palette=palette, dither=Image.Dither.NONE) for picture in pictures)
        how |= {"optimize": False, "disposal": 1}
        how["append_images"] = pictures
    else:
        how |= {"quality": 80, "method": 4, "append_images": [_Film(pictures, count - 1)]}
    next(pictures).save(buffer, form, **how)
    return buffer.getvalue()
