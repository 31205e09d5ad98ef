"""Gantt charts: every activity has its bar and its words, for a few toasts, for many, and for several products."""

import re
from dataclasses import replace
from itertools import combinations
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.figure import Figure

from lab.errors import BadInput
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.schedule import Activity, Schedule
from lab.sequencing.cell.stations import Arrivals, Product, Stage, Station, one_robot
from lab.sequencing.cyclic.cycle import best_cycle
from lab.sequencing.cyclic.unrolled import steady
from lab.sequencing.simulate.follow import simulate
from lab.sequencing.simulate.run import Run
from lab.tasks.task_file import load_cell
from lab.view.canvas import BLUE, GREEN, ORANGE, RED, SKY
from lab.view.gantt import _draw_limits, cycle_gantt, gantt
from lab.view.gantt_bars import WIDEST_INCH, Chart, mixed

SVG = "{http://www.w3.org/2000/svg}"
OFF_DIAGONAL = np.ones((4, 4)) - np.eye(4)


def ovens(parts: int = 2, loaded_s: float = 2.0, room: int = 1) -> Cell:
    """Toasts, in -> buffer or oven (5 s) -> out."""
    stations = (
        Station("in", "storage", 99),
        Station("buffer", "buffer", 2),
        Station("oven", "machine", room, 5.0),
        Station("out", "storage", 99),
    )
    route = (Stage("in"), Stage("oven", "buffer"), Stage("out"))
    return Cell.alike(stations, route, OFF_DIAGONAL, loaded_s * OFF_DIAGONAL, "in", parts)


def schedule(parts: int = 2, loaded_s: float = 2.0, room: int = 1, sequence: tuple[int, ...] = ()) -> Schedule:
    """Of two toasts the second waits in the buffer while the first bakes, or bakes beside it."""
    return simulate(ovens(parts, loaded_s, room), sequence or ([1, 2, 1, 2, 2] if room == 1 else [1, 2, 1, 2]))


def milled() -> Schedule:
    """A sign and a rook that arrive at 3 s and 3 s after the sign is taken; the mill (20 s) is served for 4 s."""
    names = ("in", "mill in", "mill", "mill out", "lathe in", "lathe", "lathe out", "out")
    kinds = {"in": "storage", "mill": "machine", "lathe": "machine", "out": "storage"}
    stations = tuple(
        Station(name, kinds.get(name, "buffer"), 9, 20.0 if name in ("mill", "lathe") else 0.0)  # type: ignore[arg-type]
        for name in names
    )

    def product(name: str, machine: str, service_s: float) -> Product:
        inside = (Stage(f"{machine} in"), Stage(machine, pallet=True, service_s=service_s), Stage(f"{machine} out"))
        return Product(name, ((Stage("in"), *inside, Stage("out")),))

    products = (product("sign", "mill", 4.0), product("rook", "lathe", 0.0))
    table = np.ones((8, 8)) - np.eye(8)
    cell = Cell(stations, products, ("sign", "rook"), table, 2 * table, one_robot("in"), Arrivals((3.0, 3.0), "pick"))
    return simulate(cell, [1, 1, 1, 2, 2, 2, 1, 1, 2, 2])


def words(path: Path) -> tuple[list[str], list[str]]:
    """The texts and the tooltips of an SVG file."""
    root = ElementTree.parse(path).getroot()
    texts = ["".join(text.itertext()) for text in root.iter(f"{SVG}text")]
    return texts, [title.text or "" for title in root.iter(f"{SVG}title")]


def drawn(path: Path, shown: Schedule, predicted: Schedule | None = None) -> tuple[list[str], list[str]]:
    gantt(shown, path / "chart.svg", predicted=predicted)
    return words(path / "chart.svg")


def colours(path: Path) -> set[str]:
    """Every colour that an SVG file fills something with."""
    return set(re.findall(r"fill: (#\w{6})", path.read_text().lower()))


@pytest.mark.parametrize("form", ["png", "svg"])
def test_same_data_same_bytes(tmp_path: Path, form: str) -> None:
    for file in (f"one.{form}", f"two.{form}"):
        gantt(schedule(loaded_s=2.1), tmp_path / file, predicted=schedule())
    assert (tmp_path / f"one.{form}").read_bytes() == (tmp_path / f"two.{form}").read_bytes()


def test_only_pictures_of_what_happened(tmp_path: Path) -> None:
    with pytest.raises(BadInput, match=r"plots are written as \.png or \.svg"):
        gantt(schedule(), tmp_path / "chart.jpeg")
    with pytest.raises(BadInput, match="no activities"):
        gantt(Schedule((), (), (), 0.0, ()), tmp_path / "chart.png")
    assert not list(tmp_path.iterdir())


def test_each_bar_says_what_it_is(tmp_path: Path) -> None:
    """in -> oven at 0 to 2 s, done at 7 s; toast 2 to the buffer at 3 to 5 s; the robot is back at the oven at 6 s."""
    shown = schedule()
    texts, tips = drawn(tmp_path, shown)
    assert len(tips) == len((*shown.robot, *shown.machines, *shown.parts))
    assert "robot: carries toast 1 from in to oven, 0 to 2 s (2 s)" in tips
    assert "robot: moves empty from oven to in, 2 to 3 s (1 s)" in tips
    assert "robot: waits at oven for toast 1, 6 to 7 s (1 s)" in tips
    assert "toast 2: carried from in to buffer, 3 to 5 s (2 s)" in tips
    assert "oven: toast 1 in process at oven, 2 to 7 s (5 s)" in tips
    assert "toast 1: in process at oven, 2 to 7 s (5 s)" in tips
    assert any(tip.startswith("toast 2: at buffer, 5 to ") for tip in tips)
    assert {"toast 1", "toast 2", "oven", "robot", "buffer", "finished at 9 s"} <= set(texts)
    assert f"2 × toast, 5 moves: {shown.makespan_s:g} s" in texts


def test_rows_from_parts_to_robot() -> None:
    assert Chart(schedule(12, sequence=tuple(part for part in range(12, 0, -1) for _ in (1, 2)))).rows == (
        *(f"toast {number}" for number in range(1, 13)),
        "oven",
        "robot",
    )


def test_colours_of_one_product(tmp_path: Path) -> None:
    gantt(schedule(), tmp_path / "chart.svg")
    inside = colours(tmp_path / "chart.svg")
    assert {colour.lower() for colour in (BLUE, SKY, ORANGE, mixed(ORANGE, 0.22))} <= inside
    assert RED.lower() in (tmp_path / "chart.svg").read_text().lower()
    assert GREEN.lower() not in inside


def test_several_products(tmp_path: Path) -> None:
    texts, tips = drawn(tmp_path, milled())
    assert {ORANGE.lower(), GREEN.lower()} <= colours(tmp_path / "chart.svg")
    assert {"sign 1", "rook 2", "in process (sign, rook)", "arrives", "robot carries an empty pallet"} <= set(texts)
    assert "robot: waits at in for sign 1, 0 to 3 s (3 s)" in tips
    assert any(tip.startswith("robot: carries the pallet of rook 2 from lathe in to lathe out") for tip in tips)
    assert any(tip.startswith("robot: serves mill for sign 1") and tip.endswith("(4 s)") for tip in tips)
    assert any(tip.startswith("mill: sign 1 processed, waits in mill") for tip in tips)


def test_all_there_from_the_start_do_not_arrive(tmp_path: Path) -> None:
    texts, _ = drawn(tmp_path, schedule())
    assert "arrives" not in texts
    assert "robot carries an empty pallet" not in texts


def test_until_when_toast_is_to_be_fetched_is_marked(tmp_path: Path) -> None:
    """Only where there is such a limit: two toasts, a mark each, on the row of the oven."""
    cell = ovens()
    stations = tuple(replace(one, at_most_s=4.0 if one.name == "oven" else None) for one in cell.stations)
    limited = simulate(replace(cell, stations=stations), [1, 2, 1, 2, 2])
    assert "to be fetched until then" in drawn(tmp_path, limited)[0]
    assert "to be fetched until then" not in drawn(tmp_path, schedule())[0]
    figure = Figure()
    axes = figure.add_subplot()
    (marks,) = _draw_limits(axes, Chart(limited))
    assert np.array(marks.get_xydata()).tolist() == [[limit.until_s, 2.0] for limit in limited.fetch_by]


def test_many_parts_get_a_wider_page_with_names_and_times_on_both_sides(tmp_path: Path) -> None:
    """Thirty toasts one by one: 8 s each and 1 s to walk back, 60 moves."""
    many = schedule(30, sequence=tuple(part for part in range(1, 31) for _ in (1, 2)))
    texts, tips = drawn(tmp_path, many)
    few, _ = Chart(schedule()).page_inch(strips=False)
    assert Chart(many).page_inch(strips=False)[0] == pytest.approx(60 * 0.36) != few
    assert len(tips) == len((*many.robot, *many.machines, *many.parts))
    assert texts.count("robot") == 2
    assert texts.count("100") == 2
    assert texts.count("toast 17") >= 3  # both sides, and where it begins
    assert "finished at 19 s" in texts


def test_a_page_never_grows_beyond_what_can_be_drawn() -> None:
    many = schedule(99, sequence=tuple(part for part in range(1, 100) for _ in (1, 2)))
    assert Chart(many).page_inch(strips=True)[0] == WIDEST_INCH


def test_words_are_left_out_where_they_do_not_fit(tmp_path: Path) -> None:
    """Carrying takes a hundredth of the time: not even a number fits on it, and all words fit on the rest."""
    short = [
        Activity("robot", "carry", 1, "in", "oven", 0.0, 1.0),
        Activity("robot", "wait", 1, "oven", "oven", 1.0, 1000.0),
    ]
    texts, _ = drawn(tmp_path, Schedule(tuple(short), (), (), 1000.0, (1,)))
    assert "waits for part 1" in texts
    assert not {"1", "1 → oven", "part 1 → oven"} & set(texts)


def test_what_was_planned_is_drawn_beside_what_was_measured(tmp_path: Path) -> None:
    measured, planned = schedule(loaded_s=2.5), schedule()
    texts, tips = drawn(tmp_path, measured, planned)
    assert f"makespan, measured: {measured.makespan_s:g} s" in texts
    assert f"makespan, predicted (thin strips): {planned.makespan_s:g} s" in texts
    assert "robot: carries toast 1 from in to oven, 0 to 2.5 s (2.5 s)" in tips
    assert "robot: carries toast 1 from in to oven, 0 to 2 s (2 s)" in tips


def test_a_machine_with_two_toasts_gets_two_lanes() -> None:
    chart = Chart(schedule(room=2))
    oven = [bar for bar in chart.bars(chart.schedule, 0.0, 1.0) if bar.activity.resource == "oven"]
    row = chart.rows.index("oven")
    assert {(bar.activity.part, bar.top - row, bar.height) for bar in oven} == {(1, 0.0, 0.5), (2, 0.5, 0.5)}


@given(st.integers(1, 5), st.integers(1, 3), st.data())
def test_no_bar_covers_another(parts: int, room: int, data: st.DataObject) -> None:
    run, sequence = Run(ovens(parts, room=room)), []
    while allowed := run.allowed():
        sequence.append(data.draw(st.sampled_from(allowed)))
        run.move(sequence[-1])
    chart = Chart(simulate(run.cell, sequence))
    bars = chart.bars(chart.schedule, -0.5, 1.0)
    for one, other in combinations(bars, 2):
        apart_s = max(one.activity.start_s, other.activity.start_s) >= min(one.activity.end_s, other.activity.end_s)
        apart = max(one.top, other.top) >= min(one.top + one.height, other.top + other.height) - 1e-9
        assert apart_s or apart
    assert all(bar.row - 0.5 <= bar.top and bar.top + bar.height <= bar.row + 0.5 + 1e-9 for bar in bars)


@pytest.mark.parametrize("overlap_s", [0.0, 1e-4])
def test_one_after_the_other_stays_in_one_lane(overlap_s: float) -> None:
    robot = (
        Activity("robot", "empty", None, "in", "oven", 0.0, 1.0 + overlap_s),
        Activity("robot", "carry", 1, "oven", "out", 1.0, 2.0),
    )
    shown = Schedule(robot, (), (), 2.0, (1,))
    assert {(bar.top, bar.height) for bar in Chart(shown).bars(shown, 0.0, 1.0)} == {(0.0, 1.0)}


def test_a_run_that_failed_before_its_first_carry(tmp_path: Path) -> None:
    robot = (Activity("robot", "empty", None, "in", "oven", 0.0, 3.0),)
    parts = (Activity("toast 1", "store", 1, "in", "in", 0.0, 3.0),)
    texts, tips = drawn(tmp_path, Schedule(robot, (), parts, 0.0, ()))
    assert tips == ["toast 1: at in, 0 to 3 s (3 s)", "robot: moves empty from in to oven, 0 to 3 s (3 s)"]
    assert not [text for text in texts if text.startswith("finished")]


def test_a_part_that_is_stuck_in_a_buffer_is_not_finished() -> None:
    """As after a failed run: toast 3 is still in the buffer that toast 2 has left."""
    whole = schedule(3, sequence=(1, 2, 1, 2, 3, 2, 3, 3))
    stuck = tuple(a for a in whole.parts if a.part != 3 or (a.kind == "store" and a.target in ("in", "buffer")))
    chart = Chart(Schedule(whole.robot, whole.machines, stuck, whole.makespan_s, whole.sequence))
    looks = {bar.activity.target: bar.look for bar in chart.bars(chart.schedule, 0, 1) if bar.row == 2}
    assert looks["in"] == "outside"
    assert looks["buffer"] == "store"


def test_mixed_with_white() -> None:
    assert [mixed("#0072B2", strength) for strength in (1, 0.5, 0)] == ["#0072B2", "#80B8D8", "#FFFFFF"]


def test_the_cycle_of_a_mix_is_drawn_with_its_period(tmp_path: Path) -> None:
    """Two products in two colours, no rows for parts, and a line at the end of each period."""
    cell = load_cell("fms").cell(("rook", "sign"))
    cycle = best_cycle(replace(cell, arrivals=None, due_s=None, stations=_roomy(cell)), ("rook", "sign"))
    cycle_gantt(steady(cycle, 2), tmp_path / "cycle.svg")
    text = (tmp_path / "cycle.svg").read_text(encoding="utf-8")
    assert f"the period: {cycle.period_s:g} s" in text
    assert f"1 × rook, 1 × sign in a period of {cycle.period_s:g} s, 2 periods of what repeats for ever" in text
    assert re.search(r"in process \((rook, sign|sign, rook)\)", text)
    assert ">robot<" in text
    assert text.count(f"stroke: {RED.lower()}") >= 2


def _roomy(cell: Cell) -> tuple[Station, ...]:
    return tuple(replace(one, capacity=9) if one.kind == "storage" else one for one in cell.stations)
