"""Cell files: what ships is the thesis's, fields mean what they say, and orders are asked for in words."""

import math
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from lab.errors import BadInput
from lab.files import tasks_folder
from lab.sequencing.cell.cell import MAX_PARTS
from lab.sequencing.cell.chance import Chance
from lab.sequencing.cell.stations import Arrivals
from lab.sequencing.methods.exact import optimum
from lab.sequencing.search import SrlSettings
from lab.sequencing.simulate.follow import simulate
from lab.tasks.cell_file import TOAST_CASES, CellFile, order_from_word, toast_case, toml_of
from lab.tasks.task_file import load_cell, names_of
from lab.tasks.toml_text import TomlText

FMS = (tasks_folder() / "fms.toml").read_text(encoding="utf-8")
OVEN = (Path(__file__).parent / "cells" / "oven.toml").read_text(encoding="utf-8")
# Thesis table III.2 with the stations numbered as in its listing: lathe 1, lathe 2, mill, incoming, outgoing.
FMS_S = """
   X 65 15 45 45 45 25 25 25 40  X
  25  X 20 45 45 45 25 25 25 40  X
  25 45  X 45 45 45 25 25 25 40 40
  45 45 45  X 65 15 50 50 50 60  X
  45 45 45 25  X 20 50 50 50 60  X
  45 45 45 25 45  X 50 50 50 60 60
  25 25 25 50 50 50  X 50 15 30  X
  25 25 25 50 50 50 25  X 25 30  X
  25 25 25 50 50 50 25 25  X 30 30
  40  X  X 60  X  X 30  X  X  X  X
  40 40 40 60 60 60 30 30 30 20  X
"""


def cellfile(text: str) -> CellFile:
    return CellFile.checked(TomlText.parsed(Path("mine.toml"), text))


def refusal(check: Callable[[], object]) -> str:
    with pytest.raises(BadInput) as caught:
        check()
    message = str(caught.value)
    assert "\n" not in message
    return message


def edited(text: str, *edits: str) -> str:
    """The text with one first place changed for each pair of strings, old and new."""
    for old, new in zip(edits[::2], edits[1::2], strict=True):
        assert old in text
        text = text.replace(old, new, 1)
    return text


# ---- what ships ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", names_of("cell"))
def test_what_ships_loads_by_name_and_by_path(name: str) -> None:
    file = load_cell(name)
    assert file.name == name
    assert file == load_cell(str(tasks_folder() / f"{name}.toml"))
    assert file.cell().parts == (4 if name in ("hoist-pu", "two-carriers", "two-on-a-track") else 3)


@pytest.mark.parametrize(
    ("case", "toasts", "printed_s"),
    [("I", 3, 513), ("I", 4, 663), ("II", 3, 700), ("II", 4, 900), ("III", 3, 995), ("III", 4, 1290)],
)
def test_the_toast_cases_have_the_printed_optima(case: str, toasts: int, printed_s: int) -> None:
    best = optimum(load_cell(toast_case(case)).cell(toasts))
    assert (best.optimal_s, best.proven) == (printed_s, True)


@pytest.mark.parametrize(("case", "process_s"), [("I", 60), ("II", 90), ("III", 120)])
def test_the_toast_cases_are_the_six_stations_of_the_thesis(case: str, process_s: float) -> None:
    file = load_cell(TOAST_CASES[case])
    cell = file.cell()
    wanted = ("plate", "toaster_buffer", "toaster", "butter_buffer", "butter_applier", "finished_plate")
    assert (cell.names, cell.robot_start, cell.arrivals) == (wanted, "toaster_buffer", None)
    assert [station.processing_s for station in cell.stations] == [0, 0, process_s, 0, process_s, 0]
    assert np.array_equal(cell.empty_s, cell.loaded_s, equal_nan=True)
    assert np.count_nonzero(~np.isnan(cell.empty_s)) == 21
    assert file.chance() == Chance("normal", "constant", 0.1)
    assert file.sequencing.settings() == SrlSettings()


def test_the_fms_is_the_thesis_listing() -> None:
    file = load_cell("fms")
    cell = file.cell()
    printed = [[math.nan if word == "X" else float(word) for word in row.split()] for row in FMS_S.split("\n")[1:-1]]
    assert np.array_equal(cell.empty_s, printed, equal_nan=True)
    assert np.array_equal(cell.loaded_s, printed, equal_nan=True)
    assert (cell.order, cell.robot_start) == (("rook", "sign", "rook"), "incoming")
    assert cell.arrivals == Arrivals((200.0, 200.0, 200.0), "pick")
    assert set(cell.capacities) == {1}
    machines = [[s for s in route if s.pallet] for product in cell.products for route in product.routes]
    assert [[(s.station, s.processing_s, s.service_s) for s in stages] for stages in machines] == [
        [("lathe-1", 185, 0)],
        [("lathe-2", 185, 0)],
        [("mill", 600, 240)],
    ]
    assert file.sequencing.settings().state == "stations"


def test_work_is_what_a_part_takes_alone_on_its_quickest_route() -> None:
    file = load_cell("fms")
    # incoming to in-buffer, material to the lathe, pallet to the out-buffer, part there, both to outgoing; turning
    assert file.work_s("rook") == 40 + 65 + 15 + 20 + 40 + 185
    assert file.work_s("sign") == 30 + 50 + 15 + 25 + 30 + 600 + 240
    assert load_cell("toast-case-1").work_s("toast") == 36 + 60 + 28 + 60 + 12
    assert "unknown product 'sgn' (cell 'fms'): did you mean 'sign'?" in refusal(lambda: file.work_s("sgn"))
    # While the lathe works the robot fetches the pallet, so that its move costs no time.
    alone = simulate(file.cell(["rook"]), [1, 1, 1, 1, 1])
    assert alone.makespan_s == 200 + 40 + 65 + 185 + 20 + 40


# ---- the fields ---------------------------------------------------------------------------------------------------


def test_a_small_file_is_the_cell_it_says() -> None:
    cell = cellfile(OVEN).cell()
    assert (cell.names, cell.order, cell.due_s, cell.buffers) == (("in", "oven", "out"), ("bun", "bun"), None, "busy")
    x = math.nan
    assert np.array_equal(cell.empty_s, [[x, 2, x], [1, x, 3], [1, 1, x]], equal_nan=True)
    # in > oven 2, ready 12, out 15; back 16, oven 18, ready 28, out 31
    assert simulate(cell, [1, 1, 2, 2]).makespan_s == 31


def test_parts_that_spoil_have_a_window() -> None:
    """The shipped one: 20 s at both machines, 67 s more than without for three and for four toasts."""
    cells = [load_cell("toast-case-1-window").cell(toasts) for toasts in (3, 4)]
    assert [station.at_most_s for station in cells[0].stations] == [None, None, 20.0, None, 20.0, None]
    assert [optimum(cell).cost for cell in cells] == [580.0, 730.0]


def test_tables_may_be_written_long() -> None:
    long = OVEN.replace("in = { oven = 2 }\n", "") + "[travel.in]\noven = 2\n"
    long = edited(long, '"in", "oven", "out"', '{ station = "in" }, { station = "oven" }, "out"')
    long = re.sub(r"stations = \[.*?\n\]\n", "", long, flags=re.DOTALL)
    for name, kind, more in (("in", "storage", ""), ("oven", "machine", "processing_s = 10\n"), ("out", "storage", "")):
        room = 1 if kind == "machine" else 9
        long += f'[[stations]]\nname = "{name}"\nkind = "{kind}"\ncapacity = {room}\n{more}'
    assert cellfile(long) == cellfile(OVEN)


def test_loaded_times_differ_only_where_they_are_given() -> None:
    cell = cellfile(OVEN + "[loaded]\nin = { oven = 0 }\nout = { in = 9 }").cell()
    x = math.nan
    assert np.array_equal(cell.empty_s, [[x, 2, x], [1, x, 3], [1, 1, x]], equal_nan=True)
    assert np.array_equal(cell.loaded_s, [[x, 0, x], [1, x, 3], [9, 1, x]], equal_nan=True)
    assert cellfile(OVEN + "[loaded]\nin = { oven = 0 }").work_s("bun") == 0 + 10 + 3


def test_a_move_that_is_only_made_loaded_needs_no_other_time() -> None:
    text = edited(OVEN, "in = { oven = 2 }\n", "")
    assert cellfile(text + "[loaded]\nin = { oven = 4 }").cell(1).loaded_s[0, 1] == 4


def test_due_times_are_given_or_follow_the_work() -> None:
    given = cellfile(edited(OVEN, "parts = 2", "parts = 2\ndue_s = [20, 40.5]")).cell()
    assert list(given.due_s or ()) == [20, 40.5]
    assert cellfile(edited(OVEN, "parts = 2", "parts = 2\ndue_factor = 2")).cell().due_s == (30.0, 30.0)
    arriving = edited(OVEN, "parts = 2", "parts = 3\ndue_factor = 0.5") + "[arrivals]\ninterval_s = 100"
    cell = cellfile(arriving).cell()
    assert cell.due_s == (107.5, 207.5, 307.5)
    assert cell.arrivals == Arrivals((100, 100, 100), "clock")


def test_chance_and_settings_are_as_they_stand() -> None:
    text = (
        '[stochastic]\nprocessing = "exponential"\narrivals = "normal"\nspread = 0\n[sequencing]\nmethod = "random"\n'
    )
    text += 'alpha = 0.5\ndiscount = 1\nbeta = 2\nreward_factor = "A"\nvalues = "states"\nstate = "stations"'
    file = cellfile(OVEN + text)
    assert file.chance() == Chance("exponential", "normal", 0.0)
    assert file.sequencing.settings() == SrlSettings(0.5, 1.0, 2.0, "A", "states", "stations")
    assert (file.sequencing.method, file.sequencing.objective) == ("random", "makespan")
    assert cellfile(OVEN).chance() == Chance("normal", "constant", 0.1)


def test_what_another_order_needs_is_asked_for_then() -> None:
    text = edited(OVEN, "parts = 2", "parts = 1", "out = { in = 1, oven = 1 }", "out = { oven = 1 }")
    file = cellfile(text)
    assert file.cell().parts == 1
    said = "travel time 'out' -> 'in' is missing: the robot may have to go there empty; no other time leads to 'in'"
    line = text.split("\n").index("out = { oven = 1 }") + 1
    assert refusal(lambda: file.cell(2)) == f"mine.toml: line {line}: {said}"
    assert refusal(lambda: cellfile(OVEN).cell(10)).startswith("mine.toml: line 5: station 'in': capacity 9 cannot")


# ---- orders -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("word", "order"),
    [
        ("RSR", ("rook", "sign", "rook")),
        (" rs ", ("rook", "sign")),
        ("S", ("sign",)),
        ("sign", ("sign",)),
        ("rook, sign,rook", ("rook", "sign", "rook")),
    ],
)
def test_an_order_is_written_in_initials_or_names(word: str, order: tuple[str, ...]) -> None:
    file = load_cell("fms")
    assert order_from_word(file, word) == order
    assert file.cell(order_from_word(file, word)).order == order


@pytest.mark.parametrize(
    ("word", "said"),
    [
        (
            "RXR",
            "order 'RXR' (--case) for cell 'fms': letter 2, 'X', means no product: known: R (rook), S (sign); or names",
        ),
        ("R S", "letter 2, ' ', means no product"),
        ("", "an order of 0 parts: allowed are 1 to 200"),
        ("R" * 201, "an order of 201 parts: allowed are 1 to 200"),
        ("rook,sgn", "unknown product 'sgn' (order for cell 'fms'): did you mean 'sign'? known: rook, sign"),
        (",", "unknown product ''"),
    ],
)
def test_an_order_that_is_none_is_said(word: str, said: str) -> None:
    assert said in refusal(lambda: order_from_word(load_cell("fms"), word))


def test_initials_that_two_products_have_are_refused() -> None:
    file = cellfile(edited(FMS, '["rook", "sign", "rook"]', '["ring", "rook"]', 'name = "sign"', 'name = "ring"'))
    assert "letter 1, 'R', means more than one product: known: R (rook or ring); or names with commas" in refusal(
        lambda: order_from_word(file, "RR")
    )
    assert "several products: give their order with --case, such as rook,ring,rook" in refusal(lambda: file.cell(3))


@pytest.mark.parametrize("count", [0, -1, MAX_PARTS + 1, 10**30])
def test_no_or_too_many_parts_are_refused(count: int) -> None:
    assert refusal(lambda: cellfile(OVEN).cell(count)) == f"an order of {count} parts: allowed are 1 to {MAX_PARTS}"


def test_a_number_of_parts_is_for_one_product() -> None:
    assert load_cell("toast-case-2").cell(5).order == ("toast",) * 5
    said = "3 parts (--toasts): cell 'fms' makes several products: give their order with --case, such as RSR"
    assert refusal(lambda: load_cell("fms").cell(3)) == said


@pytest.mark.parametrize("word", ["II", "ii", "2", " 2 "])
def test_a_case_of_the_toast_cell_is_a_file(word: str) -> None:
    assert toast_case(word) == "toast-case-2"


@pytest.mark.parametrize("word", ["", "IIII", "0", "4", "RSR"])
def test_another_case_lists_the_three(word: str) -> None:
    assert refusal(lambda: toast_case(word)).endswith("known: I, II, III")


# ---- cell toml --------------------------------------------------------------------------------------------------------


def again(file: CellFile) -> CellFile:
    return CellFile.checked(TomlText.parsed(Path("mine.toml"), toml_of(file)))


@pytest.mark.parametrize("name", names_of("cell"))
def test_what_ships_reads_as_the_same(name: str) -> None:
    file = load_cell(name)
    assert again(file).model_dump() == file.model_dump()


def test_names_with_spaces_setups_and_no_robot() -> None:
    raw = {
        "name": "no robot",
        "title": 'a "title" \\ of one',
        "order": ["red part", "blue part"],
        "robots": [],
        "release_s": [0.5, 1e-7],
        "stations": [
            {"name": "in", "kind": "storage", "capacity": "unlimited"},
            {"name": "the saw", "kind": "machine", "capacity": "unlimited", "servers": 1, "processing_s": 3,
             "setup_s": {"red part": {"blue part": 2.25}}},
        ],
        "products": [{"name": name, "routes": [["in", "the saw"]]} for name in ("red part", "blue part")],
    }  # fmt: skip
    file = CellFile.model_validate(raw)
    assert again(file).model_dump() == file.model_dump()
    assert again(file).cell().setups[1] == {("red part", "blue part"): 2.25}
