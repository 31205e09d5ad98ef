"""Teaching at a terminal: what the learner sees as text, and the person's answer as an action."""

import sys
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, TextIO, cast

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.text import Text

from lab.advice.advisors import AdviceRequest, AdvisorLeft
from lab.learning.session import AdviceEnded, AdviceRejected, AdviceRequested, EpisodeEnded, Event
from lab.mdp import TabularMDP

if TYPE_CHECKING:
    from prompt_toolkit.input import Input
    from prompt_toolkit.key_binding import KeyBindings, KeyPressEvent
    from prompt_toolkit.output import Output

ReadLine = Callable[[str], str]
Plane = NDArray[np.str_]
DIRECTIONS = ("up", "down", "left", "right")
ARROWS = "↑↓←→"
ASCII_ARROWS = "^v<>"
HELP = """\
The learner is stuck and asks you where to go. It does what you say, and
learns from it as if the move were its own.
  a direction   a word from the list of moves, or its beginning; arrow keys
                follow the picture, and so do up, down, left, right where
                the list has no such words
  enter         agree with the learner: take the move it would make itself
  skip          leave this step to the learner
  auto          no more advice for this skill: the learner goes on alone
  done          no more advice in this whole run, whatever is learned
  Ctrl-C        stop the session; what has been learned is kept
When episodes with your advice are no shorter than those before, the learner
counts that, and after a few of them it asks no more."""


@dataclass(frozen=True)
class _Marks:
    """The characters of a picture, for a console that can or cannot show Unicode."""

    arrows: str
    free: str

    @classmethod
    def of(cls, console: Console) -> "_Marks":
        return cls(ARROWS, "·") if console.encoding.lower().startswith("utf") else cls(ASCII_ARROWS, ".")


def direction_of(mdp: TabularMDP, action: int) -> int | None:
    """Where an action points in the picture, an index into DIRECTIONS; None when it leaves the picture's plane.

    Axis 0 runs down and axis 1 to the right (a grid of one axis runs to the right); on a map, axis 0 runs to the right
    and axis 1 up.
    """
    axes = len(mdp.coverage_shape or mdp.shape)
    if mdp.n_actions != 2 * axes or action >= 4:
        return None
    if is_map(mdp):
        return (2, 3, 1, 0)[action]
    return action + 2 if axes == 1 else action


def is_map(mdp: TabularMDP) -> bool:
    """Whether axes 0 and 1 are the x and y of a map seen from above: the moves along axis 0 are called left and right."""
    return len(mdp.shape) >= 2 and mdp.action_labels[:2] == ("left", "right")


class TeachingPrompt:
    """Asks a person for advice: call it with a request (it is the `ask` of `make_advisor`), pass events to `on_event`.

    console: where everything is written, usually stderr. read_line shows a prompt and returns one line or raises
    EOFError; by default the terminal with arrow keys when stdin is one, else plain lines of stdin. Returns the
    action, None for "skip".
    Raises AdvisorLeft for "auto" and at the end of the input; Ctrl-C is a KeyboardInterrupt. After "done" every
    request raises AdvisorLeft, and nothing more is written.
    """

    def __init__(self, console: Console, read_line: ReadLine | None = None):
        self._console = console
        self._marks = _Marks.of(console)
        self._read_line = read_line
        self._done = False

    def __call__(self, request: AdviceRequest) -> int | None:
        """Shows where the learner is and returns what the person says."""
        if self._done:
            raise AdvisorLeft
        if self._read_line is None:
            self._read_line = default_reader(self._console)
        self._show(request)
        own = self._named(request.mdp, request.learner_action)
        while True:
            try:
                line = self._read_line(f"Which way? [enter = {own}, ? explains] ")
            except EOFError:
                self._say("No more answers: the learner goes on alone.")
                raise AdvisorLeft from None
            answer = understand(line, request.mdp)
            match answer:
                case int():
                    return answer
                case "own":
                    return request.learner_action
                case "skip":
                    return None
                case "auto":
                    raise AdvisorLeft
                case "done":
                    self._say("No more advice in this run: from here on learners go on alone.")
                    self._done = True
                    raise AdvisorLeft
                case "help":
                    self._say(HELP)
                case _:
                    self._say(answer, "yellow")

    def on_event(self, event: Event, skill: str = "") -> None:
        """Tells the person when the learner of `skill` starts asking, what came of it, and why it stops."""
        if self._done:
            return
        match event:
            case AdviceRequested():
                what = f" about '{skill}'" if skill else ""
                self._say(f"Episode {event.episode}: the learner asks for advice{what}.", "bold")
            case EpisodeEnded(guided=True):
                outcome = f"reached the goal in {event.steps} steps" if event.reached else "did not reach the goal"
                self._say(f"Episode {event.episode} {outcome}; moves advised: {event.helped_steps}.")
            case AdviceRejected():
                self._say(
                    f"The learner takes no more advice (episodes misled: {event.misleads}, tolerated: {event.omega}). "
                    f"Episode {event.episode} counted {event.steps} steps, those before it {event.mean_before:.1f}.",
                    "bold red",
                )
            case AdviceEnded(reason="converged"):
                self._say(f"Episode {event.episode}: the same result again and again; the learner asks no more.")
            case AdviceEnded():
                self._say(f"Episode {event.episode}: advice has ended; the learner goes on alone.")

    def _say(self, text: str, style: str = "") -> None:
        self._console.print(Text(text, style))

    def _named(self, mdp: TabularMDP, action: int) -> str:
        direction = direction_of(mdp, action)
        arrow = "" if direction is None else f"{self._marks.arrows[direction]} "
        return f"{arrow}{mdp.action_labels[action]}"

    def _show(self, request: AdviceRequest) -> None:
        mdp = request.mdp
        self._say(f"\nEpisode {request.episode}, step {request.step}: at {mdp.state_label(request.state)}", "bold")
        picture = draw(request, self._marks.arrows, self._marks.free)
        if picture is not None:
            self._console.print(picture, no_wrap=True, crop=False, overflow="ignore")
        for line in other_axes(request):
            self._say(line)
        self._say("Moves: " + "   ".join(self._named(mdp, action) for action in range(mdp.n_actions)))
        self._say(f"The learner itself would go {self._named(mdp, request.learner_action)}{_consequence(request)}.")
        self._say(_progress(request), "dim")
        if request.why:
            self._say(f"It asks because {request.why}.", "dim")


def _consequence(request: AdviceRequest) -> str:
    entered = int(request.mdp.successor[request.state, request.learner_action])
    if entered == request.state:
        return ", which leads nowhere"
    if request.mdp.goal[entered]:
        return ", to the goal"
    return ", into an obstacle" if request.mdp.terminal[entered] else ""


def _progress(request: AdviceRequest) -> str:
    rate, current, previous = request.improvement_rate, request.current_mean, request.previous_mean
    if rate is None or current is None or previous is None:
        return "Too few episodes so far for moving averages."
    return f"Steps per episode: lately {current:.1f}, before that {previous:.1f}; improvement {rate:+.1%}."


def _nearest_goal(mdp: TabularMDP, cell: tuple[int, ...]) -> tuple[int, ...]:
    goals = [mdp.state_cell(int(state)) for state in np.flatnonzero(mdp.goal)]
    return min(goals, key=lambda goal: sum(abs(a - b) for a, b in zip(goal, cell, strict=True)))


def other_axes(request: AdviceRequest) -> list[str]:
    """One line for each axis that the picture does not show: where the robot is, and which way the goal lies."""
    mdp = request.mdp
    if len(mdp.shape) < 3:
        return []
    cell = mdp.state_cell(request.state)
    goal = _nearest_goal(mdp, cell)
    lines = []
    for axis in range(2, len(mdp.shape)):
        labelled = mdp.n_actions == 2 * len(mdp.shape)
        below, above = mdp.action_labels[2 * axis : 2 * axis + 2] if labelled else ("-", "+")
        away = goal[axis] - cell[axis]
        way = (
            f"{abs(away)} above ({above})" if away > 0 else f"{abs(away)} below ({below})" if away else "level with it"
        )
        lines.append(
            f"Not in the picture: {below} / {above} is at {cell[axis]} of 0..{mdp.shape[axis] - 1}; the goal is {way}."
        )
    return lines


def draw(request: AdviceRequest, arrows: str = ARROWS, free: str = "·") -> Text | None:
    """The plane of axes 0 and 1 through the robot: R robot, G goal, # obstacle, x covered, an arrow.

    A goal in another plane casts a small g into this one. The arrow stands in the cell that the learner itself would
    enter. None when the states are no grid. Rows run down and columns to the right, but a map is shown as from above: x
    to the right, y up.
    """
    mdp = request.mdp
    if not (mdp.shape or mdp.coverage_shape):
        return None
    cell = mdp.state_cell(request.state)
    plane = _plane(mdp, request.state, free)
    entered = mdp.state_cell(int(mdp.successor[request.state, request.learner_action]))
    direction = direction_of(mdp, request.learner_action)
    here, there = (_place(c) for c in (cell, entered))
    if direction is not None and there != here and plane[there] in (free, "x"):
        plane[there] = arrows[direction]
    plane[here] = "R"
    legend = "R head, x covered" if mdp.coverage_shape else "R robot, G goal, # obstacle"
    if "g" in plane:
        legend = legend.replace("G goal", "g goal, in another plane")
    return _coloured(plane.T[::-1] if is_map(mdp) else plane, arrows, legend)


def _place(cell: tuple[int, ...]) -> tuple[int, int]:
    return (0, cell[0]) if len(cell) == 1 else (cell[0], cell[1])


def _plane(mdp: TabularMDP, state: int, free: str) -> Plane:
    if mdp.coverage_shape:
        return np.where(mdp.covered(state), "x", free)
    marks = np.where(mdp.goal, "G", np.where(mdp.terminal, "#", free))
    if len(mdp.shape) == 1:
        return marks.reshape(1, -1)
    rest = mdp.state_cell(state)[2:]
    layer = int(np.ravel_multi_index(rest, mdp.shape[2:])) if rest else 0
    plane: Plane = marks.reshape(*mdp.shape[:2], -1)[:, :, layer]
    goal = _place(_nearest_goal(mdp, mdp.state_cell(state)))
    if plane[goal] == free:
        plane[goal] = "g"
    return plane


def _coloured(plane: Plane, arrows: str, legend: str) -> Text:
    styles = {
        "R": "bold cyan",
        "G": "bold green",
        "g": "green",
        "#": "red",
        "x": "green",
        **dict.fromkeys(arrows, "bold magenta"),
    }
    text = Text()
    for row in plane:
        for mark in row:
            text.append(f" {mark}", styles.get(str(mark), "dim"))
        text.append("\n")
    return text.append(f"{legend}, arrow: the learner's own choice")


def understand(line: str, mdp: TabularMDP) -> int | str:
    """The action that a typed line names, or "own", "skip", "auto", "done", "help", or else a hint of one line.

    An exact label comes first, then the beginning of exactly one label, then an arrow or the (beginning of the)
    word for a direction in the picture.
    """
    word = line.strip().lower()
    if word in ("", "skip", "auto", "done", "?", "help"):
        return {"": "own", "?": "help"}.get(word, word)
    labels = [label.lower() for label in mdp.action_labels]
    if word in labels:
        return labels.index(word)
    begun = [action for action, label in enumerate(labels) if label.startswith(word)]
    if len(begun) == 1:
        return begun[0]
    pointing = {direction_of(mdp, action): action for action in range(mdp.n_actions)}
    for direction, name in enumerate(DIRECTIONS):
        meant = name.startswith(word) or word in (ARROWS[direction], ASCII_ARROWS[direction])
        if meant and direction in pointing:
            return pointing[direction]
    if begun:
        return f"'{word[:20]}' could be {' or '.join(mdp.action_labels[a] for a in begun)}: type more of it"
    return f"'{word[:20]}' is no direction: type {', '.join(mdp.action_labels)}, skip, auto, done or ?"


def default_reader(console: Console, stdin: TextIO | None = None) -> ReadLine:
    """Reads from the terminal when stdin is one, else plain lines from it."""
    stream = stdin or sys.stdin
    return terminal_reader(console) if stream.isatty() else plain_reader(console, stream)


def plain_reader(console: Console, stream: TextIO) -> ReadLine:
    """Shows the prompt on the console and reads one line of the stream; raises EOFError at its end."""

    def read_line(prompt: str) -> str:
        try:
            console.print(Text(prompt), end="")
            line = stream.readline()
        except KeyboardInterrupt:
            console.print()  # what comes next begins a line
            raise
        console.print(Text(line.rstrip("\r\n")))  # piped answers are not echoed by a terminal
        if not line:
            raise EOFError
        return line

    return read_line


def terminal_reader(console: Console, keys: "Input | None" = None, screen: "Output | None" = None) -> ReadLine:
    """Line editing with history; an arrow key on an empty line answers at once."""
    from prompt_toolkit import PromptSession
    from prompt_toolkit.output import create_output
    from prompt_toolkit.output.vt100 import Vt100_Output

    output = screen or create_output(stdout=cast(TextIO, console.file))
    if isinstance(output, Vt100_Output):
        output.enable_cpr = False  # one line needs no cursor position, and a slow link would answer too late
    session: PromptSession[str] = PromptSession(input=keys, output=output, key_bindings=_arrow_keys())
    return lambda prompt: session.prompt(prompt)


def _arrow_keys() -> "KeyBindings":
    from prompt_toolkit.application import get_app
    from prompt_toolkit.filters import Condition
    from prompt_toolkit.key_binding import KeyBindings

    bindings = KeyBindings()
    is_empty = Condition(lambda: not get_app().current_buffer.text)

    def bind(key: str, arrow: str) -> None:
        @bindings.add(key, filter=is_empty)
        def _answer(event: "KeyPressEvent") -> None:
            event.app.exit(result=arrow)

    for key, arrow in zip(DIRECTIONS, ARROWS, strict=True):
        bind(key, arrow)
    return bindings
