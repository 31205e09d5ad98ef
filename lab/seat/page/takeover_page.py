"""The page of `lab clone --teacher page`: the arm in 3D, why its mentor asks, and a person's commands for the takeover."""

import json
import threading
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from lab.cloning.person import Situation
from lab.cloning.takeover_command import TakeoverCommand, command_of
from lab.control import ControlEnv
from lab.control.control_env import CONTROL_S
from lab.errors import BadInput
from lab.sim.frames import Frame, Viewpoint
from lab.view.meshcat import LiveView

TITLE = "Teaching lab: a clone asks"
MAX_CHARS = 1 << 12
LISTEN_S = 0.2  # longest uninterrupted wait, so that Ctrl-C is noticed
Json = dict[str, Any]


class TakeoverPanel:
    """The content of the page, and the command that one of the pages sends; `lock` guards all of it."""

    files: Sequence[Path] = tuple(Path(__file__).with_name(f"takeover.{kind}") for kind in ("html", "css", "js"))

    def __init__(self) -> None:
        self.lock = threading.Condition()
        self._known: Json = {"question": None, "asked": 0}
        self._pages: dict[int, str] = {}  # page -> refusal that is still to be sent
        self._due: set[int] = set()
        self._command: TakeoverCommand | None = None

    def ask(self, situation: Situation) -> None:
        """Show a situation, and wait for a command from now on."""
        with self.lock:
            told = {"why": situation.why, "where": situation.where, "fingers": situation.fingers}
            self._command = None
            self._tell(question=told, asked=self._known["asked"] + 1)

    def command(self) -> TakeoverCommand:
        """The command that a page sends; waits for it."""
        with self.lock:
            while self._command is None:
                self.lock.wait(LISTEN_S)
            self._tell(question=None)
            return self._command

    def _tell(self, **news: Any) -> None:
        self._known |= news
        self._due |= {*self._pages}

    # ---- called by the server's thread

    def joined(self, page: int, watches: bool = False) -> None:
        """A browser has opened the page."""
        with self.lock:
            self._pages[page] = ""
            self._due.add(page)

    def left(self, page: int) -> None:
        """A browser has left; the command is still waited for."""
        with self.lock:
            self._pages.pop(page, None)
            self._due.discard(page)

    def said(self, page: int, message: str | bytes) -> None:
        """Take the command, or refuse it with a line on that page."""
        with self.lock:
            try:
                if self._known["question"] is None:
                    raise BadInput("Nothing is asked now: wait until the mentor asks.")
                self._command = command_of(_words(message))
                self.lock.notify_all()
            except BadInput as reason:
                self._pages[page] = str(reason)

    def stirred(self) -> bool:
        """Whether there is news for a page."""
        with self.lock:
            return bool(self._due or any(self._pages.values()))

    def news(self, page: int) -> str:
        """The JSON members that this page has not received yet; "" for none."""
        with self.lock:
            members = [f'"seat": {json.dumps(self._known)}'] * (page in self._due)
            if refusal := self._pages.get(page, ""):
                members.append(f'"refusal": {json.dumps(refusal)}')
                self._pages[page] = ""
            self._due.discard(page)
            return ", ".join(members)


def _words(message: str | bytes) -> str:
    try:
        words = json.loads(message)["command"] if len(message) <= MAX_CHARS else None
    except (ValueError, RecursionError, TypeError, KeyError):
        words = None
    if not isinstance(words, str):
        raise BadInput("That was no message of this page: it is ignored.")
    return words


class TakeoverPage(LiveView):
    """The live page of a cloning session; a context manager. Entering raises BadInput for a port that is taken or not allowed."""

    _panel: TakeoverPanel

    def __init__(self, port: int = 0) -> None:
        super().__init__(port, title=TITLE)
        self._panel = TakeoverPanel()
        self._world: Any = None

    def ask(self, situation: Situation) -> TakeoverCommand:
        """The command of a person who looks at the page."""
        self._panel.ask(situation)
        self._wake()
        command = self._panel.command()
        self._wake()
        return command

    def step(self, env: ControlEnv) -> None:
        """Shows an environment as it is, at the pace of the arm."""
        world = env.scene.world
        bodies = world.bodies()
        if self._world != (world, tuple(body.name for body in bodies)):
            self._world = world, tuple(body.name for body in bodies)
            low, high = env.skill.box
            x, y, z = (float(value) for value in (low + high)[:3] / 2)
            self.show(bodies, Viewpoint((x + 0.9, y - 0.7, z + 0.7), (x, y, z)))
        self.update(Frame(world.time_s, world.poses()))
        time.sleep(CONTROL_S)

    def _wake(self) -> None:
        if self._server is not None:
            self._server.wake()
