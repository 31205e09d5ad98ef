"""Troubles as a file says them: what would spoil is fetched first, what nobody saw done is done again, and rows are true."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

Lab = Callable[..., Any]
OWN = 'routes = [["input", "{}", "output"]]'


@pytest.fixture
def mill_and_washer(lab: Lab, folder: Path) -> Path:
    """One part for a mill, and one for a washer, in which it is spoilt 20 s after it was done."""
    kinds = ("--part", "plate=box:0.05x0.03x0.04:1", "--part", "cup=box:0.05x0.03x0.04:1")
    assert lab("new", "cell", *kinds, "--machine", "mill:60", "--machine", "washer:75").code == 0
    file = folder / "cell.toml"
    before, *routes = file.read_text().split("routes = [[\n")
    own = [OWN.format(name) + route.split("]]", 1)[1] for name, route in zip(("mill", "washer"), routes, strict=True)]
    text = before + "".join(own)
    file.write_text(text.replace("processing_s = 75.0", "processing_s = 75.0\nat_most_s = 20.0"))
    return file


@pytest.mark.slow
@pytest.mark.parametrize(
    ("fault", "code", "delivered"),
    [('"machine slow"\nshare = 1.9', 0, ["plate 1", "cup 2"]), ('"machine fails"', 1, ["cup 2"])],
    ids=["the mill is slow", "the mill fails"],
)
def test_what_would_spoil_is_fetched_while_a_machine_is_late(
    lab: Lab, mill_and_washer: Path, fault: str, code: int, delivered: list[str]
) -> None:
    with mill_and_washer.open("a") as file:
        file.write(f'\n[[faults]]\nwhat = {fault}\nstation = "mill"\nat_s = 5.0\n')
    ran = lab("run", str(mill_and_washer), "--json", "--out", "out")
    assert ran.code == code
    document = json.loads(ran.out)
    assert document["delivered"] == len(delivered)
    rows = json.loads((mill_and_washer.parent / "out" / "schedule.json").read_text())["schedule"]
    brought = [r["part"] for r in rows if (r["when"], r["operation"], r["target"]) == ("measured", "carry", "output")]
    assert sorted(brought) == sorted(delivered)


WIPED = """
[processes.wipe]
grid = [2, 1]
dwell_s = 4.0
by = "robot"
area_m = [0.06, 0.06]
off_m = [0.0, 0.0, 0.16]

[subtasks.cover]
learner = { learner = "dyna-q", alpha = 0.95, discount = 0.99, beta = 1.3, episodes = 200, max_steps = 200 }

[[faults]]
what = "part moved"
part = "plate 1"
when = "in machine"
at_s = 17.7
by_m = [-0.05, 0.15]
"""


def test_a_part_that_was_moved_while_the_robot_served_it_is_served_again(lab: Lab, folder: Path) -> None:
    """The mill is done after 17.5 s; the plate is moved before the hand has come to its first cell."""
    assert lab("new", "cell", "--part", "plate=box:0.05x0.03x0.04:1", "--machine", "mill:10").code == 0
    file = folder / "cell.toml"
    file.write_text(file.read_text().replace('  "mill",\n', '  { station = "mill", service = "wipe" },\n') + WIPED)
    ran = lab("run", str(file), "--json", "--out", "out")
    assert ran.code == 0
    (fault,) = json.loads(ran.out)["faults"]
    assert fault["at_s"] == pytest.approx(17.7, abs=0.1)
    assert fault["answer"] == "puts it back"


@pytest.mark.slow
def test_a_part_that_gets_another_target_on_the_way_left_when_it_was_taken_up(lab: Lab, folder: Path) -> None:
    """Plate 2 is on its way to the buffer when plate 1 is taken out of the mill: now it can go there at once."""
    kinds = ("--part", "plate=box:0.05x0.03x0.04:2", "--machine", "mill:40", "--buffer")
    assert lab("new", "cell", *kinds).code == 0
    file = folder / "cell.toml"
    with file.open("a") as text:
        text.write('\n[[faults]]\nwhat = "part gone"\npart = "plate 1"\nwhen = "in machine"\nat_s = 15.0\n')
    ran = lab("run", str(file), "--json", "--out", "out")
    document = json.loads(ran.out)
    assert (ran.code, document["delivered"]) == (1, 1)
    assert document["failure"].startswith("plate 1 is nowhere on the table")
    rows = json.loads((folder / "out" / "schedule.json").read_text())["schedule"]
    carried = [r for r in rows if (r["when"], r["operation"], r["part"]) == ("measured", "carry", "plate 2")]
    assert [(r["station"], r["target"]) for r in carried] == [("input", "mill"), ("mill", "output")]
    assert carried[0]["start_s"] < 15.0


def test_a_window_of_no_time_is_kept_where_the_robot_waits_at_the_machine(lab: Lab, folder: Path) -> None:
    """The robot notices that the oven is done in the physics step after that."""
    assert lab("new", "cell", "--part", "plate=box:0.05x0.03x0.04:1", "--machine", "oven:10").code == 0
    file = folder / "cell.toml"
    file.write_text(file.read_text().replace("processing_s = 10.0", "processing_s = 10.0\nat_most_s = 0"))
    ran = lab("run", str(file), "--json")
    assert (ran.code, json.loads(ran.out)["delivered"]) == (0, 1)
