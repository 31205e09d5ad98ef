"""Faults of cell files: every slip of the pen is one line that names the file and the line of the fault; no traceback."""

import re
import tomllib
from collections.abc import Callable
from copy import deepcopy
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lab.errors import BadInput
from lab.files import tasks_folder
from lab.sequencing.cell.cell import Cell
from lab.tasks.cell_faults import MAX_STAGES, SHOWN, loc_of
from lab.tasks.cell_file import CellFile
from lab.tasks.toml_text import TomlText

FMS = (tasks_folder() / "fms.toml").read_text(encoding="utf-8")
TOAST = (tasks_folder() / "toast-case-1.toml").read_text(encoding="utf-8")
OVEN = (Path(__file__).parent / "cells" / "oven.toml").read_text(encoding="utf-8")


def cellfile(text: str) -> CellFile:
    return CellFile.checked(TomlText.parsed(Path("mine.toml"), text))


def refusal(check: Callable[[], object]) -> str:
    with pytest.raises(BadInput) as caught:
        check()
    message = str(caught.value)
    assert "\n" not in message
    return message


def refused(text: str) -> tuple[str, str]:
    """The line of the text that the refusal points to, "" for none, and what it says."""
    message = refusal(lambda: cellfile(text)).removeprefix("mine.toml: ")
    if not message.startswith("line "):
        return "", message
    number, _, said = message.removeprefix("line ").partition(": ")
    return text.split("\n")[int(number) - 1], said


def edited(text: str, *edits: str) -> str:
    """The text with one first place changed for each pair of strings, old and new."""
    for old, new in zip(edits[::2], edits[1::2], strict=True):
        assert old in text
        text = text.replace(old, new, 1)
    return text


ORDER = 'order = ["rook", "sign", "rook"]'
DUE = "due_factor = 2.0"
ROW = "lathe-1-in  = { lathe-1 = 65, "
WRONG: list[tuple[tuple[str, ...], str, str]] = [  # changes of the fms file, a part of the line at fault, what is said
    # stations
    (("{ name = \"mill\",        kind = \"machine\", capacity = 1 }", "{ name = \"mill\", kind = \"machine\", capacity = 0 }"),
     '"mill"', "stations.7.capacity of station 'mill': Input should be greater than or equal to 1 (got 0)"),
    (('"incoming",    kind = "storage", capacity = 1', '"incoming",    kind = "storage", capacity = 1001'),
     '"incoming"', "stations.9.capacity of station 'incoming': Input should be less than or equal to 1000 (got 1001)"),
    (('"incoming",    kind = "storage", capacity = 1', '"incoming",    kind = "storage"'),
     '"incoming"', "stations.9.capacity of station 'incoming': Field required"),
    (('"mill",        kind = "machine"', '"mill",        kind = "machin"'),
     '"mill"', "unknown kind 'machin' (station): did you mean 'machine'? known: buffer, machine, storage"),
    (('"mill",        kind = "machine"', '"mill",        kind = "buffer"'),
     'station = "mill"', "processing_s = 600.0, but 'mill' is a buffer; only a machine has it"),
    (('name = "mill-in"', 'name = "mill"'), '"mill",        kind = "machine"', "station 'mill': the name is used twice"),
    (('name = "mill-in"', 'name = "robot"'), '"robot"', "station 'robot': 'robot' names another row of a schedule"),
    (('  { name = "outgoing"', '  { name = "spare", kind = "buffer", capacity = 1 },\n  { name = "outgoing"'),
     '"spare"', "station 'spare' cannot be reached: it is on no route"),
    (('start = "incoming"', 'start = "incomming"'),
     "start = ", "unknown station 'incomming' (robot.start): did you mean 'incoming'?"),
    # the order
    (("[\"rook\", \"sign\", \"rook\"]", '["rook",\n "sgn"]'),
     '"sgn"', "unknown product 'sgn' (part 2 of the order): did you mean 'sign'? known: rook, sign"),
    ((ORDER, "order = []"), "order = []", "an order of 0 parts: allowed are 1 to 200"),
    ((ORDER, "order = [" + '"rook", ' * 201 + "]"), "order = ", "an order of 201 parts: allowed are 1 to 200"),
    ((ORDER, "parts = 3"), "parts = 3", "parts = 3: with several products an order is wanted, one for each part"),
    ((ORDER, "parts = 3\n" + ORDER), "parts = 3", "order and parts: "),
    ((ORDER, ""), "", "order and parts: "),
    # routes
    (('station = "lathe-2", pallet', 'station = "lathe2", pallet'),
     '"lathe2"', "unknown station 'lathe2' (stage 3 of route 2 of 'rook'): did you mean 'lathe-2'?"),
    (('  "mill-in",\n', '  "mil-in",\n'), '"mil-in"', "unknown station 'mil-in' (stage 2 of the route of 'sign'): did you"),
    (('  "mill-out",\n  "outgoing"', '  "mill-in",\n  "outgoing"'),
     '  "mill-in"', "stage 4 of the route of 'sign': station 'mill-in' is on the route twice, a cycle; once is allowed"),
    (('  "mill-out",\n  "outgoing"', '  "mill-out"'), '  "mill-out"', "'mill-out' is a buffer; a route starts and ends in"),
    (('"lathe-1-in", { station', "{ station"), '"lathe-1"', "pallet = true needs a buffer or storage before and after it"),
    (('["incoming", "lathe-2-in"', '["outgoing", "lathe-2-in"'),
     'name = "rook"', "product 'rook': its routes begin at 'incoming' and 'outgoing'"),
    (('routes = [[\n  "incoming",', 'routes = [["incoming"], ['), '[["incoming"]', "has 1 stages; it needs at least 2"),
    (('routes = [[\n  "incoming",', 'routes = [[], ['), "routes = [[]", "has 0 stages; it needs at least 2"),
    (('station = "mill", pallet', 'station = "mill", palet'), '"mill"',
     "products.1.routes.0.2.palet of product 'sign': there is no such key"),
    (('"mill-out",\n  "outgoing"', '"mill-out",\n  7'), "  7",
     "products.1.routes.0.4 of product 'sign': Input should be a table"),
    (('name = "sign"', 'name = "rook"', ORDER, 'order = ["rook"]'), 'name = "rook"  ', "product 'rook': the name is used twice"),
    # times
    (("processing_s = 600", "processing_s = nan"), "nan",
     "products.1.routes.0.2.processing_s of product 'sign': Input should be a finite"),
    (("processing_s = 600", "processing_s = -1"), "-1", "Input should be greater than or equal to 0 (got -1)"),
    (("processing_s = 600", "processing_s = 1e7"), "1e7", "Input should be less than or equal to 1000000 (got 10000000.0)"),
    (("processing_s = 600, ", ""), '"mill"', "machine 'mill' has no processing_s, and neither has this stage of a route"),
    (("service_s = 240", "service_s = inf"), "inf",
     "products.1.routes.0.2.service_s of product 'sign': Input should be a finite number"),
    ((ROW, "lathe-1-in  = { lathe-1 = -65, "), "-65", "travel.lathe-1-in.lathe-1: Input should be greater than or equal"),
    ((ROW, 'lathe-1-in  = { lathe-1 = "x", '), '"x"', "travel.lathe-1-in.lathe-1: Input should be a valid number (got 'x')"),
    ((ROW, "lathe-1-in  = { lathe-1 = nan, "), "nan", "travel.lathe-1-in.lathe-1: Input should be a finite number"),
    ((ROW, "lathe-1-in  = { lathe1 = 65, "), "lathe1 ", "unknown station 'lathe1' (travel from 'lathe-1-in'): did you"),
    ((ROW, "lathe1-in  = { lathe-1 = 65, "), "lathe1-in ", "unknown station 'lathe1-in' (travel): did you mean 'lathe-1-in'?"),
    ((ROW, ROW + "lathe-1-in = 1, "), "lathe-1-in = 1", "travel 'lathe-1-in' -> 'lathe-1-in' = 1: staying takes 0 s"),
    ((ROW, "lathe-1-in  = { "), "lathe-1-in  =",
     "travel time 'lathe-1-in' -> 'lathe-1' is missing: the robot may have to carry a part there"),
    (("outgoing    = {", "# {"), "[travel]",
     "travel time 'outgoing' -> 'incoming' is missing: the robot may have to go there empty (and 9 more are missing)"),
    (("[travel]", "[loaded]\nmill = { mil = 3 }\n[travel]"), "mil = 3", "unknown station 'mil' (loaded from 'mill'): did"),
    # due times, arrivals and the rest
    ((DUE, "due_s = [\n 300,\n 350, 700]"), "350", "due_s of part 2 = 350 s, but it only arrives at 400 s"),
    ((DUE, "due_s = [300, 500]"), "due_s", "due_s has 2 times; 3 parts need 3"),
    ((DUE, "due_s = [300, 500, -1]"), "due_s", "due_s.2: Input should be greater than or equal to 0 (got -1)"),
    ((DUE, "due_s = [300, 500, nan]"), "due_s", "due_s.2: Input should be a finite number (got nan)"),
    ((DUE, "due_factor = 1\ndue_s = [300, 500, 900]"), "due_factor", "due_s and due_factor: "),
    ((DUE, "due_factor = 0"), "due_factor", "due_factor: Input should be greater than 0 (got 0)"),
    ((DUE, "", 'objective = "makespan"', 'objective = "tardy-parts"'),
     "objective = ", "sequencing.objective 'tardy-parts' needs due times, and there are none"),
    (('objective = "makespan"', 'objective = "makespn"'), "makespn", "unknown objective 'makespn' (sequencing.objective): did"),
    (('method = "srl-time"', 'method = "slr"'), '"slr"', "unknown method 'slr' (sequencing.method): did you mean 'srl'?"),
    (("alpha = 0.05", "alpha = 0"), "alpha = 0", "sequencing.alpha: Input should be greater than 0 (got 0)"),
    (("interval_s = 200", "interval_s = -200"), "-200", "arrivals.interval_s: Input should be greater than or equal to 0"),
    (('after = "pick"', 'after = "pik"'), '"pik"', "arrivals.after: Input should be 'clock' or 'pick' (got 'pik')"),
    (("[arrivals]", "[arivals]"), "[arivals]", "arivals: there is no such key"),
    (('arrivals = "normal"', 'arrivals = "norml"'), '"norml"', "unknown law 'norml' (stochastic): did you mean 'normal'?"),
    (("spread = 0.1", "spread = 1.1"), "spread = 1.1", "stochastic.spread: Input should be less than or equal to 1"),
    (('buffers = "busy"', 'buffers = "bsy"'), "bsy", "buffers: Input should be 'busy' or 'free' (got 'bsy')"),
    (('name = "fms"', 'name = "f/m/s"'), "f/m/s", "name: wanted 1 to 40 letters, digits, spaces, - and _"),
]  # fmt: skip


@pytest.mark.parametrize(("edits", "line", "said"), WRONG)
def test_what_is_wrong_is_said_with_its_line(edits: tuple[str, ...], line: str, said: str) -> None:
    at, message = refused(edited(FMS, *edits))
    assert line in at
    assert bool(line) == bool(at)
    assert said in message


def test_one_missing_time_to_the_end_is_said_as_such() -> None:
    line, said = refused(edited(TOAST, ", finished_plate = 12", ""))
    assert line.startswith("butter_applier = {")
    assert said == (
        "travel time 'butter_applier' -> 'finished_plate' is missing: the robot may have to carry a part there; "
        "no other time leads to 'finished_plate'"
    )


def test_a_station_that_no_time_leads_to_is_said_with_some_of_the_ways() -> None:
    line, said = refused(re.sub(r", outgoing = [0-9]+", "", FMS))
    assert '"outgoing"' in line
    ways = ", ".join(f"'{origin}' -> 'outgoing'" for origin in ("lathe-1-out", "lathe-2-out", "mill-out"))
    assert said == f"station 'outgoing' cannot be reached: there is no travel time {ways}"


def test_of_many_ways_to_a_station_the_first_are_shown() -> None:
    line, said = refused(re.sub(r" mill = [0-9]+,", "", FMS))
    assert '"mill"' in line
    some = said.removeprefix("station 'mill' cannot be reached: there is no travel time ")
    assert some.count("->") == SHOWN
    assert some.endswith(" more")


def test_too_many_stages_are_refused() -> None:
    routes = ", ".join(50 * ['["in", "oven", "out"]'])
    product = '[[products]]\nname = "{}"\nroutes = [{}]\n'
    last = product.format("bun", '["in", "oven", "out"]')
    more = "".join(product.format(name, routes) for name in "abcdefgh"[: MAX_STAGES // 150])
    assert cellfile(edited(OVEN, "parts = 2", 'order = ["bun"]', last, last + more)).cell().parts == 1
    more += product.format("z", routes)
    line, said = refused(edited(OVEN, "parts = 2", 'order = ["bun"]', last, last + more))
    assert line == "[[products]]"
    assert said == f"{3 + 150 * (1 + MAX_STAGES // 150)} stages on all routes together: allowed are up to {MAX_STAGES}"


def test_what_is_no_toml_is_said_with_its_line() -> None:
    assert refusal(lambda: cellfile(edited(FMS, "service_s = 240", "service_s = = 240"))) == (
        "mine.toml: not valid TOML: Invalid value (at line 66, column 70)"
    )


def test_a_complaint_about_nothing_in_particular_has_no_line() -> None:
    file = cellfile(OVEN)
    assert loc_of(file, "a cell needs at least one product") == ()
    assert loc_of(file, "station 'oven' is an end") == ("stations", 1, "name")


def test_a_cell_without_a_file_says_what_is_wrong_without_a_line() -> None:
    raw = TomlText.parsed(Path("mine.toml"), OVEN).raw
    assert CellFile.model_validate(raw).cell().order == ("bun", "bun")
    raw["robot"]["start"] = "on"
    message = refusal(lambda: CellFile.model_validate(raw).cell())
    assert message == "unknown station 'on' (robot.start): did you mean 'oven'? known: in, out, oven"


# ---- any file -----------------------------------------------------------------------------------------------------

Way = tuple[str | int, ...]


def ways(value: Any, way: Way = ()) -> list[Way]:
    """The way to every table, key and element of a document."""
    inner = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    return [*([way] if way else []), *(found for key, one in inner for found in ways(one, (*way, key)))]


def loads_or_is_bad_input(text: str, raw: dict[str, Any] | None = None) -> None:
    """Either there is a cell, or one line that names the file and a line in it."""
    message = ""
    try:
        toml = TomlText.parsed(Path("mine.toml"), text)
        found = CellFile.checked(toml if raw is None else TomlText(toml.path, text, raw))
        assert isinstance(found.cell(), Cell)
    except BadInput as error:
        message = str(error)
    assert "\n" not in message
    assert message.startswith("mine.toml: ") or not message
    if message.startswith("mine.toml: line "):
        number = int(message.removeprefix("mine.toml: line ").partition(":")[0])
        assert 1 <= number <= text.count("\n") + 1


SHAPES: list[Any] = [None, [], {}, [[]], "", "incoming", "mill", "sign", 0, 1, 2, True, {"incoming": 1}, [1, 2, 3]]
VALUES = st.one_of(
    st.sampled_from(SHAPES), st.floats(), st.integers(-(10**40), 10**40), st.just(10**400), st.text(max_size=3)
)


@settings(max_examples=200)
@given(st.data())
def test_any_value_anywhere_loads_or_is_bad_input(data: st.DataObject) -> None:
    raw = tomllib.loads(FMS)
    for _ in range(data.draw(st.integers(1, 3))):
        *outer, key = data.draw(st.sampled_from(ways(raw)))
        inner: Any = raw
        for part in outer:
            inner = inner[part]
        if data.draw(st.booleans()):
            del inner[key]
        else:
            inner[key] = deepcopy(data.draw(VALUES))  # a shape that is in it twice could come to hold itself
        if not raw:
            break
    loads_or_is_bad_input(FMS, raw)


ROWS = FMS.split("\n")
BITS = st.sampled_from([*"[]{},.=#\"'", "\n", " ", "-", "0", "nan", "inf", "9" * 400, "mill", "true", '"mill"', "]]"])


@settings(max_examples=200)
@given(st.data())
def test_any_edit_of_the_text_loads_or_is_bad_input(data: st.DataObject) -> None:
    rows = list(ROWS)
    places = st.integers(0, len(rows) - 1)
    for _ in range(data.draw(st.integers(1, 3))):
        one, other = data.draw(places), data.draw(places)
        how = data.draw(st.sampled_from(["swap", "copy", "empty", "put", "cut"]))
        if how == "swap":
            rows[one], rows[other] = rows[other], rows[one]
        elif how in ("copy", "empty"):
            rows[one] = rows[other] if how == "copy" else ""
        else:
            place = data.draw(st.integers(0, len(rows[one])))
            gone = 0 if how == "put" else data.draw(st.integers(1, 20))
            rows[one] = rows[one][:place] + data.draw(BITS) + rows[one][place + gone :]
    loads_or_is_bad_input("\n".join(rows))
