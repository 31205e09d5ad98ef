"""The status of a run as lines of a terminal, with lamps in words and colours and a Gantt chart in text; and a plain console.

`PlainConsole` reads commands from a pipe, or for a screen reader, and writes sentences.
"""

from collections.abc import Callable, Iterable, Sequence
from threading import Thread

from rich.text import Text

from lab.production.operation.commands import Done, help_lines
from lab.production.operation.desk import Desk
from lab.production.run_status import MachineStatus, PartStatus, RunStatus
from lab.seat.terminal.screen import folded
from lab.sequencing.cell.schedule import Activity
from lab.sequencing.cell.stations import ROBOT

LIGHTS = {"idle": ("( )", "dim"), "busy": ("(>)", "yellow"), "done": ("(v)", "green"), "failed": ("(!)", "bold red")}
HELDS = {
    "pause": ("PAUSED", "bold yellow"),
    "protective": ("PROTECTIVE STOP", "bold red"),
    "emergency": ("EMERGENCY STOP", "bold white on red"),
}
AFTER = {"pause": "go goes on", "protective": "go goes on", "emergency": "reset, then go"}
SIGNS = {  # character of each kind of activity in the chart
    "carry": "#",
    "pallet": "#",
    "empty": "-",
    "wait": ".",
    "service": "%",
    "process": "=",
    "blocked": ":",
    "store": " ",
}
LEGEND = "# carries  - empty  . waits  = in process  : not fetched"
NOTICE = "Simulated: not a safety function."
WAITS = "nothing is under way"
TROUBLES, LEAST_CHART = 3, 20


def view(status: RunStatus, busy: str, width: int, height: int) -> list[Text]:
    """The panel in `width` columns and `height` lines, the most important first; busy: the command under way, "" for none."""
    lines = [*_head(status), *_robot(status, busy), *_machines(status, width), *_parts(status.parts, width)]
    lines += _troubles(status, width)
    chart = _chart(status, width)
    if len(lines) + len(chart) > height:
        chart = [line for line in chart if line.plain.strip() != LEGEND][: max(height - len(lines), 0)]
    return [_cut(line, width) for line in (lines + chart)[:height]]


def _cut(line: Text, width: int) -> Text:
    line.truncate(width)
    return line


def _head(status: RunStatus) -> list[Text]:
    held = status.held
    if held is None:
        state = Text("running" if status.words else "ready", "bold green")
    else:
        word, style = HELDS[held.kind]
        state = Text.assemble((f" {word} ", style), f" {held.why}".rstrip(), (f" ({AFTER[held.kind]})", "dim"))
    speed = "max" if status.speed is None else f"{status.speed:g}x"
    return [state, Text.assemble(f"{status.now_s:.1f} s, speed {speed}  ", (NOTICE, "dim"))]


def _robot(status: RunStatus, busy: str) -> list[Text]:
    doing = status.words or busy or WAITS
    steps = f"step {status.move} of {status.moves}" if status.move else "no step yet"
    following = f", next station {status.next_station}" if status.next_station else ""
    made = f"{status.finished} of {len(status.parts)} finished"
    return [Text.assemble(("robot ", "bold"), doing), Text(f"      {steps}{following}; {made}")]


def _machines(status: RunStatus, width: int) -> list[Text]:
    lines = [Text.assemble(("machines", "bold"))] if status.machines else []
    for machine in status.machines:
        sign, style = LIGHTS[machine.light]
        lines.append(
            Text.assemble("  ", (f"{sign} {machine.light:6}", style), f" {machine.station}{_with(machine, status)}")
        )
    return lines


def _with(machine: MachineStatus, status: RunStatus) -> str:
    if not machine.part:
        return ""
    until = ""
    if machine.light == "busy" and machine.until_s is not None:
        until = f", until {machine.until_s:.0f} s ({max(machine.until_s - status.now_s, 0.0):.0f} s more)"
    return f": {machine.part}{until}"


def _parts(parts: Sequence[PartStatus], width: int) -> list[Text]:
    said = [f"{part.name} {part.state}{_where(part)}" for part in parts]
    return (
        [Text.assemble(("parts ", "bold"), said[0])]
        if len(said) == 1
        else folded(["parts " + ", ".join(said)], width)[:3]
    )


def _where(part: PartStatus) -> str:
    return f" at {part.station}" if part.state == "waiting" else ""


def _troubles(status: RunStatus, width: int) -> list[Text]:
    rows = [f"{trouble.at_s:7.1f} s {trouble.what}: {trouble.answer}" for trouble in status.trouble[-TROUBLES:]]
    return [Text("trouble", "bold yellow"), *(Text(row, "yellow") for row in rows)] if rows else []


def _chart(status: RunStatus, width: int) -> list[Text]:
    """The planned and the measured schedule: a row of signs each, for the robot and every machine."""
    planned = [] if status.plan is None else status.plan.rows
    measured = status.so_far()
    end_s = max((a.end_s for a in (*planned, *measured)), default=0.0)
    names = dict.fromkeys([ROBOT, *(machine.station for machine in status.machines)])
    label = max(map(len, names), default=0) + 9
    room = width - label
    if not end_s or room < LEAST_CHART:
        return []
    until = f"0 s to {end_s:.0f} s"
    if status.plan is not None:
        gap, plan = status.plan.gap, status.plan
        against = "" if gap is None else f", {100 * gap:.1f} % above the {'optimum' if plan.proven else 'bound'}"
        until += f"; plan{plan.method and f' by {plan.method}'} {plan.makespan_s:.1f} s{against}" + (
            f" ({plan.why})" if plan.why else ""
        )
    lines = [Text.assemble(("plan and measured ", "bold"), until)]
    for name in names:
        for kind, rows, style in (("plan", planned, "dim"), ("real", measured, "")):
            signs = row_of((a for a in rows if a.resource == name), room, end_s)
            head = f"{name if kind == 'plan' else '':{label - 6}} {kind} "
            lines.append(Text.assemble(head, (signs, style)))
    return [*lines, Text(f"{'':{label}}{LEGEND}", "dim")]


def row_of(activities: Iterable[Activity], room: int, end_s: float) -> str:
    """Activities as signs in `room` columns, which represent `end_s` [s]; with a part's number if there is room for it."""
    row = [" "] * room
    for activity in activities:
        first = min(int(activity.start_s / end_s * room), room - 1)
        last = max(first, min(round(activity.end_s / end_s * room), room) - 1)
        row[first : last + 1] = SIGNS[activity.kind] * (last + 1 - first)
        if activity.part is not None and activity.kind in ("carry", "process"):
            number = str(activity.part)
            if last + 1 - first >= len(number):
                row[first : first + len(number)] = number
    return "".join(row)


def plain_lines(status: RunStatus) -> list[str]:
    """The status of a run in sentences, for a pipe and for screen readers."""
    lines = [*(line.plain.strip() for line in _head(status)), *(line.plain.strip() for line in _robot(status, ""))]
    lines += [f"machine {m.station}: {m.light}{_with(m, status)}" for m in status.machines]
    lines += [f"part {part.name}: {part.state}{_where(part)}" for part in status.parts]
    return lines + [line.plain.strip() for line in _troubles(status, 200)[1:]]


# ---- the console without a screen ---------------------------------------------------------------------------------------


Write = Callable[[str], None]


def told(done: Done) -> str:
    """The result of a command in one line."""
    if done.refused:
        return f"{done.words}: refused: {done.refused}"
    return f"{done.words}: {done.failed or done.said or 'done'}"


class PlainConsole:
    """Reads a line when the command before is done or waits in a pause. It continues after a refusal, and ends at a failure.

    It ends there because the cell is not in the state that the next line assumes. Beside a page, on which further commands
    may be given, only `quit` ends it.

    write: called with the lines on results.
    """

    def __init__(self, desk: Desk, write: Write) -> None:
        self._desk, self._write = desk, write
        self._bad: Done | None = None
        self._stays = False
        self._error: Exception | None = None
        desk.operation.on_done.append(self._done)

    def run(self, lines: Iterable[str], *, stay: bool = False) -> Done | None:
        """The command that failed, else the first that was refused; None when all succeeded. Raises the simulation's error.

        stay: whether it runs until somebody leaves, whatever the results of the lines.
        """
        self._stays = stay
        worker = Thread(target=self._simulate, name="simulation", daemon=True)
        worker.start()
        try:
            if stay:
                Thread(target=self._read, args=(lines,), name="commands", daemon=True).start()
                self._desk.stay()
            else:
                self._read(lines)
        finally:
            self._desk.leave()
            worker.join()
        if self._error is not None:
            raise self._error
        return self._bad

    def _read(self, lines: Iterable[str]) -> None:
        self._desk.settle()
        for line in lines:
            if self._error is not None or not self._said(line.strip()):
                self._desk.leave()
                break
            self._desk.settle()
            if self._bad is not None and self._bad.failed:
                break

    def _simulate(self) -> None:
        try:
            self._desk.serve()
        except Exception as error:  # it is raised again in the thread of the console
            self._error = error

    def _said(self, line: str) -> bool:
        """Carry out a line; returns whether to read the next one."""
        match line.split()[0].lower() if line else "":
            case "quit":
                return False
            case "":
                pass
            case "help":
                for text in help_lines():
                    self._write(text)
            case "status":
                for text in plain_lines(self._desk.now()):
                    self._write(text)
            case _:
                self._desk.say(line)
        return True

    def _done(self, done: Done) -> None:
        self._write(told(done))
        if not done.well and not self._stays and (self._bad is None or done.failed):
            self._bad = done
