"""The cell in meshcat's viewer: a live page on this computer, and a replay in one HTML file that needs no network.

Only meshcat's viewer script for browsers is used. Scene and frames reach it as plain JSON (page.js), because meshcat's own
server listens on every interface and sends every transform as a message of its own.
"""

import html
import json
import math
import re
from collections.abc import Mapping, Sequence
from getpass import getuser
from importlib.util import find_spec
from pathlib import Path
from secrets import token_urlsafe
from socket import gethostname
from types import TracebackType
from typing import Any, Self

from lab import files
from lab.errors import BadInput, WorkFailed, unknown
from lab.sim.frames import Body, Frame, Recording, Viewpoint
from lab.view import deferred
from lab.view.framing import NOWHERE, POLLING_SCRIPT, Framing
from lab.view.keyframes import BodyMotion, KeyframeTrack, motions
from lab.view.scene_data import Json, Story, describe, pack

HERE = Path(__file__).parent
GANTT_SCRIPT = HERE / "gantt.js"
# meshcat's viewer, and dat.gui in it, insert style elements; nothing else may be inline when served
SERVED = (
    "default-src 'none'; script-src 'self'; style-src 'self' 'unsafe-inline'; img-src data: blob:; "
    f"connect-src 'self' ws://127.0.0.1:* ws://localhost:*; base-uri 'none'; form-action 'none'; {NOWHERE}"
)
RULES = "default-src 'none'; img-src data: blob:; script-src 'unsafe-inline'; style-src 'unsafe-inline'"
OFFLINE = f'<meta http-equiv="Content-Security-Policy" content="{RULES}">'


class LiveView:
    """A page on 127.0.0.1 that shows the scene live; a context manager.

    `port` 0 takes any free one. `replay`: serve this file of `replay_html` instead of a live page. Entering raises
    BadInput for a port that is taken or not allowed, and for a replay that cannot be read. The page is served only to
    requests with the token in `url`. `framing`: the pages that may show it in a frame, by default none. A page cannot
    slow the run down: a slow page skips frames, messages from it are dropped unless there is a panel, and leaving the
    context never takes longer than about 3 s.
    """

    _panel: "deferred.ScenePanel | None" = None

    def __init__(
        self,
        port: int = 0,
        *,
        title: str = "Teaching lab, live",
        replay: Path | None = None,
        framing: Framing | None = None,
    ) -> None:
        self._wanted, self._title, self._replay, self._framing = port, title, replay, framing
        self._server: deferred.Server | None = None
        self._token = ""
        self._shown: dict[str, tuple[float, ...] | None] = {}

    def __enter__(self) -> Self:
        self._token = token_urlsafe(16)
        if self._replay is None:
            served = self._files()
        else:
            served = {"": deferred.File(_read(self._replay).encode(), "text/html", f"{RULES}; {NOWHERE}")}
        self._server = deferred.Server(self._wanted, served, self._token, self._panel, self._framing)
        self._server.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _files(self) -> "dict[str, deferred.File]":
        brought = [] if self._panel is None else [*self._panel.files]
        if self._framing is not None and self._framing.polls:
            brought.append(POLLING_SCRIPT)
        return page_files(self._title, brought, f"?token={self._token}")

    @property
    def port(self) -> int:
        """The port on which the server listens."""
        return self._running().port

    @property
    def url(self) -> str:
        """The page's address on this computer, including the token."""
        return f"http://127.0.0.1:{self.port}/?token={self._token}"

    @property
    def token(self) -> str:
        """The token that every request has to contain."""
        return self._token

    @property
    def hint(self) -> str:
        """The command (one line) that makes `url` work on another computer."""
        try:
            user = getuser()
        except (ImportError, KeyError, OSError):  # an account without a name, as in some containers
            user = "user"
        return f"ssh -L {self.port}:127.0.0.1:{self.port} {user}@{gethostname()}"

    def show(self, bodies: Sequence[Body], camera: Viewpoint | None = None) -> None:
        """Show these bodies in place of the earlier ones; they are at the origin until a frame places them.

        Raises BadInput for a mesh that cannot be read and for two bodies of one name.
        """
        scene = describe(bodies, camera or Viewpoint())
        self._shown = {body.name: None for body in bodies}
        self._running().send(deferred.News(scene=scene))

    def update(self, frame: Frame) -> None:
        """Show a frame; everything that moved since the last one is sent as one message.

        Returns at once, and does nothing after `close`. Raises BadInput when the frame names a body that is not shown.
        """
        for name in (*frame.poses, *frame.colors, *frame.visible):
            if name not in self._shown:
                raise unknown("body", name, self._shown, f"frame at {frame.time_s} s")
        if self._server is None:
            return
        poses = {name: tuple(round(float(value), 6) for value in pose) for name, pose in frame.poses.items()}
        moved = {name: pose for name, pose in poses.items() if pose != self._shown[name]}
        self._shown.update(moved)
        colors = {name: tuple(float(part) for part in rgba) for name, rgba in frame.colors.items()}
        visible = {name: bool(shown) for name, shown in frame.visible.items()}
        self._server.send(deferred.News(None, float(frame.time_s), moved, colors, visible))

    def wait_for_page(self, timeout_s: float) -> bool:
        """Whether a browser has opened the page; waits for one up to `timeout_s` [s]."""
        return self._running().connected.wait(timeout_s)

    def close(self) -> None:
        """Stop serving; open pages keep the last picture. Safe to call again."""
        if self._server is not None:
            self._server.stop()
            self._server = None

    def _running(self) -> "deferred.Server":
        if self._server is None:
            raise WorkFailed("live view: not running (use it as a context manager: with LiveView() as view)")
        return self._server


def page_files(title: str, brought: Sequence[Path], asked: str = "") -> "dict[str, deferred.File]":
    """The live page ("") and the files that it loads, by name.

    brought: HTML, style sheets and scripts of the panel; asked: what the addresses of the page's files end with.
    """
    styles = [HERE / "page.css", *(path for path in brought if path.suffix == ".css")]
    scripts = [viewer_script(), *(path for path in brought if path.suffix == ".js"), HERE / "page.js"]
    page = _page(
        title,
        {},
        styles="\n".join(f'<link rel="stylesheet" href="{path.name}{asked}">' for path in styles),
        scripts="\n".join(f'<script src="{path.name}{asked}"></script>' for path in scripts),
        panel="".join(path.read_text(encoding="utf-8") for path in brought if path.suffix == ".html"),
    )
    served = {"": deferred.File(page.encode(), "text/html", SERVED)}
    for kind, paths in (("text/css", styles), ("text/javascript", scripts)):
        served |= {path.name: deferred.File(path.read_bytes(), kind) for path in paths}
    return served


def replay_html(
    recording: Recording,
    path: Path,
    speed: float = 4.0,
    title: str = "Teaching lab",
    story: "Story | None" = None,
    scene: "Json | None" = None,
    tracks: "Mapping[str, BodyMotion] | None" = None,
) -> Path:
    """Write the recording as one HTML file, a player that needs no network; returns `path`.

    speed: of playback at the beginning, relative to real time. story: the schedule and captions beside the picture. scene:
    the result of `describe` for this recording; None: computed here. tracks: the motion of each body; None: computed from
    the frames. The file is written atomically, and its folder is created if missing. Raises BadInput for a speed that is
    not above 0, an inconsistent recording, an unreadable mesh, and a path that cannot be written.
    """

    if not (math.isfinite(speed) and speed > 0):
        raise BadInput(f"replay speed {speed}: must be finite and above 0 (1 is real time)")
    recording.check()
    scene = scene or describe(recording.bodies, recording.camera)
    tracks = motions(recording) if tracks is None else tracks
    for body in scene["bodies"]:
        body["motion"] = _motion(tracks[body["name"]])
    start_s = recording.frames[0].time_s if recording.frames else 0.0
    data = {"scene": scene, "speed": speed, "start_s": start_s, "duration_s": recording.duration_s}
    data["story"] = None if story is None else story.to_json()
    script = viewer_script()
    scripts = "\n".join(
        f"<script>{part.read_text(encoding='utf-8')}</script>"
        for part in (script, GANTT_SCRIPT, HERE / "replay.js", HERE / "page.js")
    )
    styles = f"<style>{(HERE / 'page.css').read_text(encoding='utf-8')}</style>"
    notice = script.with_name(f"{script.name}.LICENSE.txt")
    licences = notice.read_text(encoding="utf-8").replace("--", "- -") if notice.is_file() else ""
    if licences:
        licences = f"<!-- meshcat, (c) 2018 Robin Deits, MIT licence, with:\n{licences}\n-->"
    text = _page(title, data, styles=styles, scripts=scripts, policy=OFFLINE, licences=licences)
    _write(Path(path), text)
    return Path(path)


def _motion(motion: "BodyMotion") -> dict[str, Any]:

    def packed(track: "KeyframeTrack | None") -> dict[str, str] | None:
        return None if track is None else {"times": pack(track.times_s), "values": pack(track.values)}

    return {
        "start": [round(value, 6) for value in motion.start],
        "position": packed(motion.position),
        "quaternion": packed(motion.quaternion),
        "colors": motion.colors,
        "visible": motion.visible,
    }


def viewer_script() -> Path:
    """meshcat's viewer for browsers, found without importing meshcat. Raises WorkFailed when it is not installed."""
    spec = find_spec("meshcat")
    for folder in (spec.submodule_search_locations or []) if spec else []:
        script = Path(folder) / "viewer" / "dist" / "main.min.js"
        if script.is_file():
            return script
    raise WorkFailed(
        "meshcat's viewer (viewer/dist/main.min.js) is not installed: reinstall the package 'meshcat' (0.3.2 or later)"
    )


def _page(title: str, data: Mapping[str, Any], **parts: str) -> str:
    """The text of page.html with its placeholders filled: styles, scripts, panel, policy, licences (empty if not given).

    The title is escaped as text, and data cannot close the script element that holds it.
    """
    parts |= {"title": html.escape(title), "data": json.dumps(data, allow_nan=False).replace("<", "\\u003c")}
    text = (HERE / "page.html").read_text(encoding="utf-8")
    return re.sub(r"\{\{(\w+)\}\}", lambda place: parts.get(place[1], ""), text)


def _read(path: Path) -> str:
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as reason:
        raise BadInput(f"cannot read the replay '{path}': {getattr(reason, 'strerror', None) or reason}") from None
    if 'id="lab-data"' not in text:
        raise BadInput(f"'{path}' is no replay: a replay.html that the lab wrote is wanted")
    return text


def _write(path: Path, text: str) -> None:
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        files.write_whole(path, text.encode())
    except OSError as reason:
        raise BadInput(f"cannot write the replay '{path}': {reason.strerror or reason}") from None
