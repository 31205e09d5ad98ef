"""`lab find`: doorways are proposed, accepted, renamed or refused, and the ways to them kept."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

Lab = Callable[..., Any]  # the fixture of tests/conftest.py; it returns a Ran
TWO_ROOMS = "S..#...\n...#...\n.......\n...#...\n...#..G\n"


@pytest.fixture
def rooms(folder: Path) -> str:
    (folder / "rooms.txt").write_text(TWO_ROOMS, encoding="utf-8")
    return "rooms.txt"


def test_the_doorway_is_found_and_the_ways_to_it_kept(lab: Lab, rooms: str) -> None:
    ran = lab("find", rooms, "--json")
    assert (ran.code, ran.err) == (0, "")
    found = ran.json
    assert [(one["name"], one["labels"], one["accepted"]) for one in found["proposed"]] == [
        ("doorway 1", ["(2, 3)"], True)
    ]
    assert [(way["to"], way["from"]) for way in found["ways"]] == [("doorway 1", "room 1"), ("doorway 1", "room 2")]
    assert (found["states_seen"], found["rooms"], found["gain"]["tasks"]) == (31, 2, 10)
    kept = lab("toolbox", "list", "--subtask", "way", "--solved", "--json").json
    assert sorted(row["name"] for row in kept["policies"]) == sorted(way["saved_as"] for way in found["ways"])
    again = lab("find", rooms, "--json").json
    assert again == found


def test_the_map_and_the_gain_are_shown(lab: Lab, rooms: str) -> None:
    ran = lab("find", rooms, "--yes")
    assert ran.err == "S.. ...\n... ...\n...1...\n... ...\n... ..G\n1 doorway 1: (2, 3)\n"
    assert ran.out.startswith("1 of 1 proposed sub-task accepted, found in ")
    assert "gain: 10 drawn tasks in the same rooms took " in ran.out


def test_a_single_room_has_nothing_to_propose(lab: Lab, folder: Path) -> None:
    (folder / "room.txt").write_text("S...\n....\n...G\n", encoding="utf-8")
    ran = lab("find", "room.txt")
    assert (ran.code, ran.err) == (0, "")
    assert ran.out.startswith("no bottleneck in ")
    assert lab("find", "room.txt", "--json").json["proposed"] == []


@pytest.mark.parametrize(
    ("words", "error"),
    [
        (("--yes", "--page"), "lab: --yes beside --page: with --yes nothing is asked: leave one of them away\n"),
        (("--method", "hexq"), "lab: unknown method 'hexq' (--method): known: betweenness, paths, spectral\n"),
        (("--episodes", "0"), None),
    ],
)
def test_bad_options_end_in_one_line(lab: Lab, rooms: str, words: tuple[str, ...], error: str | None) -> None:
    ran = lab("find", rooms, *words)
    assert (ran.code, ran.err.count("\n")) == (2, 1)
    assert error is None or ran.err == error


def test_steps_by_chance_are_refused(lab: Lab) -> None:
    ran = lab("find", "queues:1")
    assert (ran.code, ran.err.count("\n")) == (2, 1)
    assert "sub-tasks are found where steps are certain and in a table" in ran.err
