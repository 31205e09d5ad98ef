"""A machine that is late, as a file says it: what can be saved meanwhile is fetched first."""

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
