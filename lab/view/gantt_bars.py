"""The content of a Gantt chart: rows, bars, their texts and colours. `lab/view/gantt.py` draws it."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

from lab.errors import counted
from lab.sequencing.cell.schedule import Activity, Schedule
from lab.sequencing.cyclic.unrolled import Steady
from lab.view.canvas import BLUE, GREEN, INK, ORANGE, PALE_GREY, PURPLE, RED, SKY, YELLOW, seconds

TOUCHING_S = 1e-3  # measured activities that overlap by less are consecutive
PRODUCTS = (ORANGE, GREEN, PURPLE, YELLOW, RED)  # one colour per product; the sixth product has the first again
DARK_GREY = "#5F5F5F"
NARROWEST_INCH, WIDEST_INCH, MOVE_INCH = 12.0, 60.0, 0.36


@dataclass(frozen=True)
class ActivityStyle:
    """The look of a kind of activity: text in the legend, colour (None: the product's, mixed with white), hatch, text colour."""

    says: str
    colour: str | None
    hatch: str | None = None
    strength: float = 1.0
    ink: str = INK


# in the legend's order
LOOKS: dict[str, ActivityStyle] = {
    "carry": ActivityStyle("carried by the robot", BLUE, ink="white"),
    "process": ActivityStyle("in process", None),
    "blocked": ActivityStyle("processed, not fetched yet", None, "...", 0.45),
    "store": ActivityStyle("in a buffer", None, None, 0.22),
    "outside": ActivityStyle("not begun, or finished", "#C9C9C9"),
    "pallet": ActivityStyle("robot carries an empty pallet", "#A68CC9", "////"),
    "empty": ActivityStyle("robot moves empty", SKY),
    "service": ActivityStyle("robot serves a machine", DARK_GREY, ink="white"),
    "wait": ActivityStyle("robot idle", PALE_GREY, "////"),
}


@dataclass(frozen=True)
class Bar:
    """An activity and its place: the row's number from the top, and the share of the row's height."""

    activity: Activity
    look: str
    row: int
    top: float
    height: float

    @property
    def middle(self) -> float:
        """The height of its middle, in rows from the top."""
        return self.top + self.height / 2


@dataclass(frozen=True)
class Chart:
    """The chart of a schedule: its rows, and the names and colours of its parts."""

    schedule: Schedule

    @cached_property
    def rows(self) -> tuple[str, ...]:
        """The names of the rows from the top: parts by number, machines by first use, robots."""
        parts = sorted((activity.part or 0, activity.resource) for activity in self.schedule.parts)
        names = [name for _, name in parts] + [activity.resource for activity in self.schedule.machines]
        return tuple(dict.fromkeys([*names, *(activity.resource for activity in self.schedule.robot)]))

    @cached_property
    def robots(self) -> frozenset[str]:
        """The names of the robots."""
        return frozenset(activity.resource for activity in self.schedule.robot)

    @cached_property
    def names(self) -> dict[int, str]:
        """What each part is called, by its number."""
        return {activity.part: activity.resource for activity in self.schedule.parts if activity.part is not None}

    @cached_property
    def begins_s(self) -> dict[str, float]:
        """When each part is first carried or worked on [s], by the row's name."""
        return {a.resource: a.start_s for a in reversed(self.schedule.parts) if a.kind in ("carry", "process")}

    @cached_property
    def finished_s(self) -> dict[str, float]:
        """When each part is finished [s], by the row's name."""
        ends, finished = _ends(self.schedule.parts), dict[str, float]()
        for activity in self.schedule.parts:
            if activity not in ends:
                finished[activity.resource] = max(activity.end_s, finished.get(activity.resource, 0.0))
        return finished

    @cached_property
    def products(self) -> dict[str, str]:
        """The colour of each product, by its name."""
        products = dict.fromkeys(self.product(part) for part in sorted(self.names)) or {"": None}
        return {name: PRODUCTS[number % len(PRODUCTS)] for number, name in enumerate(products)}

    @property
    def steps(self) -> tuple[int, str]:
        """The number of transports by robots (without robots: of operations by machines), and their name."""
        if self.schedule.robot:
            return sum(activity.kind in ("carry", "pallet") for activity in self.schedule.robot), "move"
        return sum(activity.kind == "process" for activity in self.schedule.machines), "operation"

    def product(self, part: int | None) -> str:
        """The name of a part's product: the part's name without its number."""
        return self.name(part).rpartition(" ")[0]

    def name(self, part: int | None) -> str:
        """The name of a part."""
        return self.names.get(part or 0, f"part {part}")

    def title(self) -> str:
        """The title: the number of each product, and the makespan."""
        products = [self.product(part) for part in self.names]
        counts = [f"{products.count(name)} × {name}" for name in self.products if name]
        return f"{', '.join([*counts, counted(*self.steps)])}: {seconds(self.schedule.makespan_s)}"

    def page_inch(self, strips: bool) -> tuple[float, float]:
        """The width and height of the page [inch]; rows are lower when there are many."""
        row_inch = max(0.25, 0.42 - 0.17 * max(0, len(self.rows) - 8) / 16) * (1.2 if strips else 1.0)
        return min(max(NARROWEST_INCH, MOVE_INCH * self.steps[0]), WIDEST_INCH), 1.5 + row_inch * len(self.rows)

    def bars(self, schedule: Schedule, top: float, height: float) -> list[Bar]:
        """The bars of a schedule in this chart's rows; `top`: offset from each row's middle, `height`: both in rows."""
        ends = _ends(schedule.parts)
        rows: dict[str, list[Activity]] = {}
        for activity in (*schedule.parts, *schedule.machines, *schedule.robot):
            rows.setdefault(activity.resource, []).append(activity)
        bars = []
        for number, name in enumerate(self.rows):
            lanes = _lanes(rows.get(name, ()))
            lane_height = height / (1 + max((lane for _, lane in lanes), default=0))
            for activity, lane in lanes:
                low, tall = number + top + lane * lane_height, lane_height
                look = "outside" if activity in ends else activity.kind
                if look == "outside":
                    low, tall = low + 0.44 * tall, 0.12 * tall
                bars.append(Bar(activity, look, number, low, tall))
        return bars

    def colour(self, bar: Bar) -> str:
        """The colour of a bar."""
        look = LOOKS[bar.look]
        return look.colour or mixed(self.products.get(self.product(bar.activity.part), ORANGE), look.strength)

    def texts(self, bar: Bar) -> tuple[str, ...]:
        """The texts that may be written on a bar, the longest first."""
        activity, name = bar.activity, self.name(bar.activity.part)
        number, to = f"{activity.part}", f"\N{RIGHTWARDS ARROW} {activity.target}"
        if bar.look == "outside":
            begins = activity.end_s <= self.begins_s.get(activity.resource, activity.end_s)
            return (name,) if begins else (f"finished at {seconds(activity.start_s)}", "finished")
        if activity.resource in self.robots:
            return {
                "carry": (f"{name} {to}", f"{number} {to}", number),
                "pallet": (f"pallet {to}", "pallet"),
                "empty": (f"to {activity.target}",),
                "service": (f"service at {activity.target}", "service"),
                "wait": (f"waits for {name}", "idle"),
            }.get(activity.kind, ())
        if activity.resource in self.names.values():
            return (to,) if activity.kind == "carry" else (activity.target,)
        return (name, number)

    def tip(self, activity: Activity) -> str:
        """The text of a bar's tooltip."""
        span = f"{activity.start_s:g} to {activity.end_s:g} s ({activity.end_s - activity.start_s:g} s)"
        name, moves = self.name(activity.part), f"from {activity.origin} to {activity.target}"
        own = "" if activity.resource in (name, *self.robots) else f" {name}"
        does = {
            "carry": f"carries {name} {moves}" if activity.resource in self.robots else f"carried {moves}",
            "pallet": f"carries the pallet of {name} {moves}",
            "empty": f"moves empty {moves}",
            "wait": f"waits at {activity.target} for {name}",
            "service": f"serves {activity.target} for {name}",
            "process": f"{own} in process at {activity.target}",
            "blocked": f"{own} processed, waits in {activity.target}",
            "store": f"at {activity.target}",
        }[activity.kind]
        return f"{activity.resource}: {does.strip()}, {span}"


@dataclass(frozen=True)
class CycleChart(Chart):
    """The chart of a few periods of a cycle, without rows for parts."""

    shown: Steady

    @cached_property
    def names(self) -> dict[int, str]:
        """What each part is called, by its number."""
        return self.shown.names

    def title(self) -> str:
        """The title: what the cycle makes, and its period."""
        cycle = self.shown.cycle
        mix = [cycle.product(move) for move in {move.slot: move for move in cycle.line.moves}.values()]
        counts = [f"{mix.count(name)} × {name}" for name in dict.fromkeys(mix)]
        what = f"{', '.join(counts)} in a period of {seconds(cycle.period_s)}"
        return f"{what}, {counted(self.shown.periods, 'period')} of what repeats for ever"

    def page_inch(self, strips: bool) -> tuple[float, float]:
        """The width and height of the page [inch]."""
        return super().page_inch(strips)[0], 1.7 + 0.42 * len(self.rows)


def _ends(parts: Sequence[Activity]) -> set[Activity]:
    """The stays of parts before their first move and after their last, where no part stays in between."""
    rows: dict[str, list[Activity]] = {}
    for activity in parts:
        rows.setdefault(activity.resource, []).append(activity)
    inside = {activity.target for row in rows.values() for activity in row[1:-1] if activity.kind != "carry"}
    ends = {end for row in rows.values() for end in (row[0], row[-1])}
    return {end for end in ends if end.kind == "store" and end.target not in inside}


def _lanes(row: Sequence[Activity]) -> list[tuple[Activity, int]]:
    """The activities of a row with the lane of each; parts that a machine holds at the same time have their own lanes.

    A part keeps its lane of a machine until it is fetched.
    """
    fetched_s = {activity.part: activity.end_s for activity in row if activity.kind == "blocked"}
    lanes: list[float] = []
    placed: list[tuple[Activity, int]] = []
    holds: dict[int | None, int] = {}
    for activity in row:
        follows = activity.kind == "blocked" and activity.part in holds
        free = [lane for lane, end_s in enumerate(lanes) if end_s <= activity.start_s + TOUCHING_S]
        lane = holds[activity.part] if follows else free[0] if free else len(lanes)
        stays = activity.kind == "process" and activity.resource == activity.origin
        lanes[lane : lane + 1] = [fetched_s.get(activity.part, activity.end_s) if stays else activity.end_s]
        holds[activity.part] = lane
        placed.append((activity, lane))
    return placed


def mixed(colour: str, strength: float) -> str:
    """The colour mixed with white; `strength` 1 is the pure colour."""
    parts = [int(colour[start : start + 2], 16) for start in (1, 3, 5)]
    return "#" + "".join(f"{round(255 + strength * (part - 255)):02X}" for part in parts)
