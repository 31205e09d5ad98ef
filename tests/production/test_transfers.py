"""Two parts in one machine, as a file says it: each stands there for its own time, and the plan holds."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

Lab = Callable[..., Any]
PROCESS_S = 60.0


@pytest.mark.slow
def test_each_of_two_parts_stands_in_the_machine_for_its_own_time(lab: Lab, folder: Path) -> None:
    """The first box left after 13 of 60 seconds, as long as the machine's clock was that of the second."""
    assert lab("new", "pair", "--part", "box:0.05x0.03x0.04:2", "--machine", f"oven:{PROCESS_S:g}").code == 0
    file = folder / "pair.toml"
    text = file.read_text()
    small = "capacity = 1\nprocessing_s = 60.0"
    file.write_text(text.replace(small, small.replace("1", "2", 1)))
    checked = lab("task", "check", str(file))
    assert checked.code == 2
    assert "'oven': size_m = [0.11, 0.09, 0.05]: its 2 spots reach beyond it" in checked.err
    file.write_text(file.read_text().replace("size_m = [0.11, 0.09, 0.05]", "size_m = [0.11, 0.2, 0.05]"))
    ran = lab("run", str(file), "--json", "--out", "out")
    assert ran.code == 0
    document = json.loads(ran.out)
    assert document["delivered"] == 2
    assert document["sequence"] == [1, 2, 1, 2]  # both are in it at once
    rows = json.loads((folder / "out" / "schedule.json").read_text())["schedule"]
    carried = {(r["part"], r["target"]): r for r in rows if (r["when"], r["operation"]) == ("measured", "carry")}
    came_s = [carried[part, "oven"]["end_s"] for part in ("box 1", "box 2")]
    fetched_s = [carried[part, "output"]["start_s"] for part in ("box 1", "box 2")]
    assert came_s[1] < fetched_s[0]
    assert all(fetched - came > PROCESS_S - 1e-6 for came, fetched in zip(came_s, fetched_s, strict=True))
    assert document["measured_makespan_s"] == pytest.approx(document["predicted_makespan_s"], rel=0.03)


def test_a_part_is_put_on_a_part_and_the_next_one_beside(lab: Lab, folder: Path) -> None:
    """Two boxes one on the other, the file's upper place first: the lower one is filled before."""
    assert lab("new", "pile", "--part", "box:0.06x0.03x0.04:2", "--machine", "oven:2").code == 0
    file = folder / "pile.toml"
    at = 'name = "output"\nkind = "storage"\n'
    before, after = file.read_text().split(at)
    places = "places = [{ at = [0.0, 0.0, 0.0], height_m = 0.04 }, { at = [0.0, 0.0, 0.0] }]\n"
    file.write_text(before + at + places + after)
    ran = lab("run", str(file), "--json", "--out", "out")
    assert (ran.code, json.loads(ran.out)["delivered"]) == (0, 2)
    assert lab("replay", "out", "--audit").code == 0
