"""The page of `lab clone --teacher page`: the arm in 3D, why its mentor asks, and a person's commands for the takeover."""

import time
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from lab.cloning.person import Situation
from lab.cloning.takeover_command import TakeoverCommand, command_of
from lab.control import ControlEnv
from lab.control.control_env import CONTROL_S
from lab.errors import BadInput
from lab.seat.page.answer_panel import NO_MESSAGE, AnswerPanel
from lab.sim.frames import Frame, Viewpoint
from lab.view.meshcat import LiveView

TITLE = "Teaching lab: a clone is taught"


class TakeoverPanel(AnswerPanel[TakeoverCommand]):
    """The situation of each question, and the command that one of the pages sends."""

    files: Sequence[Path] = tuple(Path(__file__).with_name(f"takeover.{kind}") for kind in ("html", "css", "js"))
    most_chars = 1 << 12
    closed = "Nothing is asked now: wait for the next question."

    def __init__(self) -> None:
        super().__init__({"question": None, "asked": 0})

    def ask(self, situation: Situation) -> None:
        """Show a situation, and ask for a command from now on."""
        self.open()
        self.tell(question=asdict(situation), asked=self._known["asked"] + (not situation.demonstration))

    def command(self) -> TakeoverCommand:
        """The command that a page sends; waits for it."""
        command = self.answer()
        self.tell(question=None)
        return command

    def read(self, message: Any) -> TakeoverCommand:
        """The command in a message. Raises BadInput."""
        words = message.get("command") if isinstance(message, dict) else None
        if not isinstance(words, str):
            raise BadInput(NO_MESSAGE)
        return command_of(words)


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
