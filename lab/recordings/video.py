"""Video files of a robot's cameras: pictures decoded where they are asked for, and encoded one at a time."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lab.errors import BadInput, WorkFailed
from lab.lazy import av
from lab.optional import require
from lab.recordings.episode import Image

MOST_PIXELS = 1 << 25  # of a picture that is decoded: 8,192 x 4,096
CODEC = "h264"  # every player and decoder of LeRobot takes it; its default, AV1, is missing in many builds of FFmpeg
PIXELS = "yuv420p"  # colours are kept for squares of 2 x 2 pixels
KEYFRAME_EVERY = 2  # frames, as in LeRobot: any picture is decoded from at most one other
QUALITY = 18  # x264's constant rate factor


@contextmanager
def _readable(path: Path) -> Iterator[None]:
    """A block that reads a file; raises BadInput, which names it, if FFmpeg cannot."""
    try:
        yield
    except (av.error.FFmpegError, OSError, ValueError, ArithmeticError) as error:
        why = getattr(error, "strerror", None) or error
        raise BadInput(f"'{path}': cannot be decoded as a video: {why}") from None


def _rgb(frame: "av.VideoFrame", where: str) -> Image:
    """The frame as a picture. Raises BadInput for more than MOST_PIXELS."""
    if frame.width * frame.height > MOST_PIXELS:
        raise BadInput(f"{where}: a picture of {frame.width} x {frame.height}: allowed are {MOST_PIXELS} pixels")
    return np.asarray(frame.to_ndarray(format="rgb24"), np.uint8)


@dataclass(frozen=True, eq=False)
class VideoPictures:
    """The pictures of one episode in a video file that may hold those of several.

    times_s (n,) [s]: when each picture is shown in the file, increasing. within_s: how far a frame's time may be off.
    Reading raises BadInput if the file is missing, damaged or has no frame at such a time.
    """

    path: Path
    times_s: NDArray[np.float64]
    within_s: float

    def __len__(self) -> int:
        return len(self.times_s)

    def __getitem__(self, step: int) -> Image:
        """The picture at a step: the file is opened, and decoded from the keyframe before it."""
        return next(self._decoded(range(len(self))[step]))

    def __iter__(self) -> Iterator[Image]:
        """All pictures in order: each frame is decoded once."""
        return self._decoded(0)

    def _decoded(self, first: int) -> Iterator[Image]:
        """The pictures from a step on."""
        if not len(self):
            return
        require(f"'{self.path}'", av, extra="recordings")
        with _readable(self.path), av.open(str(self.path)) as file:
            if not file.streams.video:
                raise BadInput(f"'{self.path}': there is no video in it")
            stream = file.streams.video[0]
            if stream.codec_context is None:
                raise BadInput(f"'{self.path}': a video of an unknown codec")
            size = stream.codec_context.width * stream.codec_context.height
            if size > MOST_PIXELS:
                raise BadInput(f"'{self.path}': pictures of {size} pixels: allowed are {MOST_PIXELS}")
            tick = float(stream.time_base or 1)
            file.seek(max(0, round(self.times_s[first] / tick) - 1), stream=stream, backward=True)
            step = first
            for frame in file.decode(stream):
                if frame.pts is None or frame.pts * tick < self.times_s[step] - self.within_s:
                    continue
                while step < len(self) and abs(frame.pts * tick - self.times_s[step]) <= self.within_s:
                    yield _rgb(frame, f"'{self.path}'")
                    step += 1
                if step == len(self):
                    return
                if frame.pts * tick > self.times_s[step] + self.within_s:
                    break
        raise BadInput(f"'{self.path}': it has no picture at {self.times_s[step]:.3f} s")


def decoded_picture(content: bytes, where: str) -> Image:
    """The picture (height, width, 3) RGB of a PNG's or JPEG's bytes. BadInput, which begins with `where`, for others."""
    kind = "png" if content.startswith(b"\x89PNG\r\n\x1a\n") else "mjpeg" if content.startswith(b"\xff\xd8") else None
    if kind is None:
        raise BadInput(f"{where}: a picture that is neither PNG nor JPEG")
    require(where, av, extra="recordings")
    try:
        with av.open(BytesIO(content), mode="r", format=f"{kind.removeprefix('m')}_pipe") as file:
            context = file.streams.video[0].codec_context
            if context.width * context.height > MOST_PIXELS:
                raise BadInput(f"{where}: a picture of {context.width} x {context.height}: too large")
            return _rgb(next(file.decode(video=0)), where)
    except (av.error.FFmpegError, OSError, ValueError, StopIteration, IndexError) as error:
        raise BadInput(f"{where}: a damaged picture: {error or 'empty'}") from None


class VideoWriter:
    """A video file that pictures of one size are appended to; frame i is shown at i / fps seconds."""

    def __init__(self, path: Path, fps: int, width: int, height: int) -> None:
        """Creates the file. Raises WorkFailed if it cannot be written."""
        self.path, self.frames, self.bytes = path, 0, 0
        self._size = (height, width, 3)
        require(f"'{path}'", av, extra="recordings")
        options = {"crf": str(QUALITY), "g": str(KEYFRAME_EVERY), "bf": "0", "threads": "1"}
        with self._writing():
            self._file: Any = av.open(str(path), "w", format="mp4")
            stream: Any = self._file.add_stream(CODEC, rate=fps, options=options)
            stream.width, stream.height, stream.pix_fmt = width, height, PIXELS
            self._stream = stream

    @contextmanager
    def _writing(self) -> Iterator[None]:
        try:
            yield
        except (av.error.FFmpegError, OSError) as error:
            raise WorkFailed(f"'{self.path}' cannot be written: {error.strerror or error}") from None

    def add(self, picture: Image) -> None:
        """Appends a picture. Raises BadInput for another size or type."""
        if picture.shape != self._size or picture.dtype != np.uint8:
            raise BadInput(f"a picture {picture.shape} {picture.dtype}: wanted {self._size} uint8, as the first one")
        with self._writing():
            frame = av.VideoFrame.from_ndarray(np.ascontiguousarray(picture), format="rgb24")
            frame.pts = self.frames
            self._put(frame)
        self.frames += 1

    def _put(self, frame: "av.VideoFrame | None") -> None:
        for packet in self._stream.encode(frame):
            self.bytes += packet.size
            self._file.mux(packet)

    def close(self) -> None:
        """Writes what is left and closes the file."""
        with self._writing():
            try:
                self._put(None)
            finally:
                self._file.close()


def features_of_video(fps: int, width: int, height: int) -> dict[str, Any]:
    """What LeRobot's info.json says of a video that `VideoWriter` wrote."""
    return {
        "video.height": height,
        "video.width": width,
        "video.codec": CODEC,
        "video.pix_fmt": PIXELS,
        "video.fps": fps,
        "video.channels": 3,
        "video.g": KEYFRAME_EVERY,
        "video.crf": QUALITY,
        "has_audio": False,
        "is_depth_map": False,
    }
