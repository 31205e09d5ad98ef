"""A part of two stations and a machine, by frames that a reader can follow: what the audit says of it."""

from collections.abc import Sequence
from math import cos, sin
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lab.audit.audit import audit, schedule_rows
from lab.audit.evidence import Evidence, Struck
from lab.audit.tracks import BodyTracks, packed, read_tracks
from lab.errors import BadInput
from lab.tasks.task import Task
from lab.tasks.task_fields import Process

HALF_M = 0.02  # of a cube's edge
TOPS = {"in": 0.01, "oven": 0.05, "out": 0.01}  # [m]
AT = {"in": (0.4, 0.5), "oven": (0.6, 0.0), "out": (0.4, -0.5)}


def a_task(**oven: Any) -> Task:
    """Cubes go from 'in' through an oven of 20 s to 'out'."""
    robot = {"start": "in", "speed_m_s": 0.5, "acceleration_m_s2": 1.0}
    stations = [
        {"name": "in", "kind": "storage", "pose": [*AT["in"], 0.0], "capacity": 2, "size_m": [0.2, 0.2, TOPS["in"]]},
        {"name": "oven", "kind": "machine", "pose": [*AT["oven"], 0.0], "capacity": 1, "processing_s": 20.0}
        | {"size_m": [0.1, 0.1, TOPS["oven"]]}
        | oven,
        {"name": "out", "kind": "storage", "pose": [*AT["out"], 0.0], "capacity": 2, "size_m": [0.2, 0.2, TOPS["out"]]},
    ]
    part = {"name": "cube", "shape": "box", "size_m": [2 * HALF_M] * 3, "mass_kg": 0.1, "count": 2}
    return Task.model_validate(
        {
            "name": "cubes",
            "robot": robot,
            "workspace": {"lower_m": [-0.2, -0.8, 0.15], "cell_m": [0.1, 0.1, 0.1], "shape": [10, 16, 3]},
            "stations": stations,
            "parts": [part | {"routes": [["in", "oven", "out"]]}],
        }
    )


Way = Sequence[tuple[float, str]]  # from when on it is where; "": in the air
ONE: Way = ((0, "in"), (2, ""), (4, "oven"), (26, ""), (28, "out"))
TWO: Way = ((0, "in"), (32, ""), (34, "oven"), (56, ""), (58, "out"))
END_S = 60.0
RISE_M = 0.2  # of a flight


def tracks_of_ways(ways: Sequence[Way], at_out: Sequence[Any] = ()) -> BodyTracks:
    """Frames every 0.1 s in which cube n goes its way; in the air it goes in an arc, in the robot's hand.

    at_out: where cube n stands at 'out'.
    """
    times_s = np.arange(0.0, END_S + 0.05, 0.1)
    names = (*AT, *(f"cube {n}" for n in range(1, len(ways) + 1)), "robot", "robot hand")
    poses = np.zeros((len(times_s), len(names), 7))
    poses[..., 6] = 1.0

    def stands(station: str, number: int) -> Any:
        return at_out[number] if at_out and station == "out" else _stands(station, number)

    low, high = np.full((len(names), 3), -HALF_M), np.full((len(names), 3), HALF_M)
    for number, station in enumerate(AT):
        poses[:, number, :3] = (*AT[station], TOPS[station] / 2)
        half = (0.05, 0.05, TOPS[station] / 2) if station == "oven" else (0.1, 0.1, TOPS[station] / 2)
        low[number], high[number] = -np.array(half), half
    for number, way in enumerate(ways):
        ends = [*(since_s for since_s, _ in way[1:]), END_S + 1.0]
        for step, ((since_s, station), until_s) in enumerate(zip(way, ends, strict=True)):
            now = (times_s >= since_s - 1e-9) & (times_s < until_s - 1e-9)
            if station:
                poses[now, len(AT) + number, :3] = stands(station, number)
                continue
            before = stands(way[step - 1][1], number)
            after = stands(way[step + 1][1], number) if step + 1 < len(way) else before
            share = (times_s[now, None] - since_s) / (until_s - since_s)
            flight = before + share * (after - before)
            flight[:, 2] += RISE_M * np.sin(np.pi * share[:, 0])
            poses[now, len(AT) + number, :3] = flight
            held = np.flatnonzero(now)
            poses[held, -1, :3] = flight
            poses[max(0, held[0] - 1), -1, :3] = before
            poses[min(len(times_s) - 1, held[-1] + 1), -1, :3] = after
    return BodyTracks(names, times_s, poses, low, high)


def _stands(station: str, number: int) -> Any:
    """Where the middle of cube `number` is, from 0, that stands at a station: beside the others (3,) [m]."""
    beside = 0.045 * (number - 0.5 if station == "oven" else number)
    return np.array([AT[station][0] + beside, AT[station][1], TOPS[station] + HALF_M])


def rows_of_ways(ways: Sequence[Way]) -> list[dict[str, Any]]:
    """What a schedule says of such ways: each flight is a carry, each stay in the oven a process."""
    rows = []
    for number, way in enumerate(ways, start=1):
        for before, air, after in zip(way, way[1:], way[2:], strict=False):
            if not air[1]:
                rows.append(_row(number, "carry", before[1], after[1], air[0], after[0]))
            elif air[1] == "oven":
                rows.append(_row(number, "process", "oven", "oven", air[0], min(air[0] + 20, after[0])))
    return [*rows, *_between(sorted(rows, key=lambda row: row["start_s"]))]


def _between(rows: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """The empty ways and the waits of the robot between carries, and to the first."""
    carries = [row for row in rows if row["operation"] == "carry"]
    ends: list[tuple[float, str]] = [(0.0, "in"), *((row["end_s"], row["target"]) for row in carries)]
    return [
        _row("", "empty", at, row["station"], end_s, row["start_s"])
        for (end_s, at), row in zip(ends, carries, strict=False)
    ]


def _row(part: int | str, operation: str, station: str, target: str, start_s: float, end_s: float) -> dict[str, Any]:
    names = ("part", "operation", "station", "target", "start_s", "end_s", "robot", "when")
    who, robot = f"cube {part}" if part else "", "" if operation == "process" else "robot"
    return dict(zip(names, (who, operation, station, target, start_s, end_s, robot, "measured"), strict=True))


def evidence(ways: Sequence[Way] = (ONE, TWO), struck: Sequence[Struck] = (), **oven: Any) -> Evidence:
    """A run of two cubes that says that both are delivered."""
    claimed = [f"cube {n}" for n in range(1, len(ways) + 1)]
    order = ("cube",) * len(ways)
    return Evidence(a_task(**oven), order, tracks_of_ways(ways), rows_of_ways(ways), claimed, struck)


def found(case: Evidence) -> list[tuple[str, str, str]]:
    """The findings: rule, part, station."""
    return [(one.rule, one.part, one.station) for one in audit(case).findings]


def test_a_run_that_is_right_is_delivered() -> None:
    result = audit(evidence())
    assert result.findings == ()
    assert result.failure is None
    assert result.delivered == result.claimed == ("cube 1", "cube 2")
    stays = [
        (row["station"], row["start_s"], row["end_s"]) for row in result.to_json()["stays"] if row["part"] == "cube 1"
    ]
    assert stays == [("in", 0.0, 2.0), ("oven", 4.0, 26.0), ("out", 28.0, 60.0)]


def test_too_short_in_the_machine() -> None:
    short: Way = ((0, "in"), (2, ""), (4, "oven"), (14, ""), (16, "out"))
    result = audit(evidence((short, TWO)))
    assert found(evidence((short, TWO))) == [("processing", "cube 1", "oven")]
    assert result.delivered == ("cube 2",)
    assert "cube 1" in str(result.failure)
    assert "oven" in str(result.failure)
    assert "20" in str(result.failure)


def test_too_long_in_the_machine() -> None:
    assert found(evidence(at_most_s=8.0)) == []
    late: Way = ((0, "in"), (2, ""), (4, "oven"), (29, ""), (31, "out"))
    assert found(evidence((late, TWO), at_most_s=3.0)) == [("window", "cube 1", "oven")]


def test_a_slow_machine_is_done_when_the_schedule_says() -> None:
    late: Way = ((0, "in"), (2, ""), (4, "oven"), (29, ""), (31, "out"))
    case = evidence((late, TWO), [Struck("machine slow", "", "oven")], at_most_s=3.0)
    for row in case.rows:
        if row["part"] == "cube 1" and row["operation"] == "process":
            row["end_s"] = 28.0
    assert found(case) == []


def test_a_station_left_out_or_in_the_wrong_order() -> None:
    never: Way = ((0, "in"), (2, ""), (4, "out"))
    assert ("route", "cube 1", "oven") in found(evidence((never, TWO)))
    swapped: Way = ((0, "in"), (2, ""), (4, "out"), (6, ""), (8, "oven"), (30, ""), (31, "in"))
    rules = {rule for rule, part, _ in found(evidence((swapped, TWO))) if part == "cube 1"}
    assert {"route", "end"} <= rules
    there_and_back: Way = ((0, "in"), (2, ""), (4, "out"), (6, ""), (8, "oven"), (30, ""), (31, "out"))
    assert ("route", "cube 1", "out") in found(evidence((there_and_back, TWO)))


def test_an_overfull_machine() -> None:
    early: Way = ((0, "in"), (18, ""), (20, "oven"), (56, ""), (58, "out"))
    assert set(found(evidence((ONE, early)))) == {("capacity", "cube 1", "oven"), ("capacity", "cube 2", "oven")}
    assert found(evidence((ONE, early), capacity=2)) == []


def test_two_parts_in_one_gripper() -> None:
    ways: tuple[Way, Way] = (ONE, ((0, "in"), (1, ""), (34, "oven"), (56, ""), (58, "out")))
    assert {("gripper", "cube 1", ""), ("gripper", "cube 2", "")} <= set(found(evidence(ways)))


@pytest.mark.parametrize(("angle", "right"), [(0.05, True), (0.3, False)])
def test_a_part_that_leans_in_the_end(angle: float, right: bool) -> None:
    case = evidence()
    case.tracks.poses[-1, case.tracks.number("cube 2"), 3:] = (sin(angle / 2), 0.0, 0.0, cos(angle / 2))
    case.__post_init__()
    assert (found(case) == []) is right
    assert all(rule == "end" and part == "cube 2" for rule, part, _ in found(case))


def test_a_part_that_is_not_at_the_end_of_its_route() -> None:
    assert ("end", "cube 2", "out") in found(evidence((ONE, TWO[:3])))


def test_a_part_beside_the_spots_of_its_last_station() -> None:
    case = evidence((ONE,))
    stations = [
        station.model_copy(update={"spots": ((0.05, 0.05, 0.0), (-0.05, 0.0, 0.0))})
        if station.name == "out"
        else station
        for station in case.task.stations
    ]
    task = case.task.model_copy(update={"stations": tuple(stations)})
    assert found(Evidence(task, case.order, case.tracks, case.rows, case.claimed)) == [("end", "cube 1", "out")]


def stacked(
    *places: dict[str, Any], upper: Sequence[float] = (0.0, 0.0), height_m: float = 2 * HALF_M, low_m: float = 0.0
) -> list[tuple[str, str]]:
    """What is found (part, words) where cube 1 ends on the pose of 'out', and cube 2 off that by `upper`, so high.

    low_m: how far below its middle the frame of cube 2 is, as that of a mesh whose mass is low.
    """
    ways, spots = (ONE, TWO), ((0.0, 0.0, 0.0), (*upper, height_m))
    foot = np.array([*AT["out"], TOPS["out"] + HALF_M])
    case = evidence()
    case.tracks = tracks_of_ways(ways, [foot + spot for spot in spots])
    two = case.tracks.number("cube 2")
    case.tracks.poses[:, two, 2] -= low_m
    case.tracks.low[two, 2] += low_m
    case.tracks.high[two, 2] += low_m
    document = case.task.model_dump(mode="json", exclude_unset=True)
    document["stations"][2] |= {"places": list(places), "capacity": len(places)}
    document["parts"].append(document["parts"][0] | {"name": "pin", "count": 0})
    task = Task.model_validate(document)
    result = audit(Evidence(task, case.order, case.tracks, case.rows, case.claimed))
    return [(one.part, one.words) for one in result.findings]


FLOOR: dict[str, Any] = {"at": [0.0, 0.0, 0.0]}
LAYER: dict[str, Any] = FLOOR | {"height_m": 2 * HALF_M}


def test_a_part_on_a_part_is_delivered_where_the_file_has_a_place_there() -> None:
    assert stacked(FLOOR, LAYER) == []
    part, words = stacked(FLOOR, {"at": [0.08, 0.0, 0.0]})[0]  # no layer
    assert (part, "did not come to 'out'" in words) == ("cube 2", True)


def test_a_cap_whose_frame_is_low_is_not_in_what_it_stands_on() -> None:
    found_ = stacked(
        FLOOR, LAYER, low_m=HALF_M / 2
    )  # other rules miss it, for the file's cube has its frame in the middle
    assert [words for _, words in found_ if "in one place" in words] == []


def test_a_part_of_a_layer_stands_on_something() -> None:
    beside = {"at": [0.06, 0.0, 0.0], "height_m": 2 * HALF_M}
    ((part, words),) = stacked(FLOOR, LAYER, beside, upper=(0.06, 0.0))
    assert part == "cube 2"
    assert "on nothing" in words
    ((part, words),) = stacked(FLOOR, LAYER, upper=(0.03, 0.0))
    assert (part, "0.030 m off the spots" in words) == ("cube 2", True)


def test_a_part_whose_carrier_is_taken_away_sinks() -> None:
    """Cube 1 begins on 0.04 m, and falls onto the floor before it is taken up."""
    case = evidence()
    frames(case, "cube 1", 0.0, 1.0)[:, 2] += 2 * HALF_M
    document = case.task.model_dump(mode="json", exclude_unset=True)
    document["stations"][0] |= {"places": [FLOOR, LAYER]}
    task = Task.model_validate(document)
    result = audit(Evidence(task, case.order, case.tracks, case.rows, case.claimed))
    words = next(one.words for one in result.findings if (one.rule, one.part) == ("gripper", "cube 1"))
    assert "not by the robot's hand" in words


def test_a_nest_of_another_kind_is_no_place_for_a_part() -> None:
    nest = {"at": [0.06, 0.0, 0.0], "kind": "pin"}
    ((part, words),) = stacked(FLOOR, nest, FLOOR | {"at": [-0.06, 0.0, 0.0]}, upper=(0.06, 0.0), height_m=0.0)
    assert part == "cube 2"
    assert "is for a pin" in words
    own = [FLOOR | {"kind": "cube"}, nest | {"kind": "cube"}]
    assert stacked(*own, upper=(0.06, 0.0), height_m=0.0) == []


def test_a_schedule_that_tells_another_story() -> None:
    case = evidence()
    carry = next(row for row in case.rows if row["part"] == "cube 1")
    carry |= {"start_s": carry["start_s"] + 6, "end_s": carry["end_s"] + 6}
    assert {rule for rule, part, _ in found(case)} == {"schedule"}
    assert {part for _, part, _ in found(case)} == {"", "cube 1"}
    case = evidence()
    case.rows = [row for row in case.rows if row["part"] != "cube 2"]
    assert {(rule, part) for rule, part, _ in found(case)} == {("schedule", "cube 2"), ("schedule", "")}
    case = evidence()
    process = next(row for row in case.rows if row["operation"] == "process")
    process["end_s"] += 5
    assert ("schedule", "cube 1", "oven") in found(case)


def test_what_is_not_claimed_need_not_be_there() -> None:
    case = evidence((ONE, TWO[:1]))
    case.claimed = ["cube 1"]
    assert found(case) == []
    assert audit(case).delivered == ("cube 1",)


def test_a_part_that_was_moved_by_hand_may_stand_elsewhere_meanwhile() -> None:
    astray: Way = ((0, "in"), (2, "out"), (10, ""), (12, "oven"), (33, ""), (35, "out"))
    later: Way = ((0, "in"), (36, ""), (37, "oven"), (58, ""), (59, "out"))
    assert found(evidence((astray, later)))
    case = evidence((astray, later), [Struck("part moved", "cube 1", "in")])
    assert [one for one in found(case) if one[1] == "cube 1"] == []


def test_frames_are_read_back_as_they_were_written(tmp_path: Path) -> None:
    tracks, path = evidence().tracks, tmp_path / "frames.npz"
    path.write_bytes(packed(tracks))
    again = read_tracks(path)
    assert again.names == tracks.names
    for name in ("times_s", "poses", "low", "high"):
        np.testing.assert_allclose(getattr(again, name), getattr(tracks, name), atol=1e-6)


@pytest.mark.parametrize("content", [b"", b"no archive", packed(evidence().tracks)[:-40]])
def test_frames_that_are_damaged_are_refused(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "frames.npz"
    path.write_bytes(content)
    with pytest.raises(BadInput, match=r"frames\.npz"):
        read_tracks(path)
    with pytest.raises(BadInput, match="nowhere"):
        read_tracks(tmp_path / "nowhere.npz")


def test_frames_whose_arrays_do_not_fit_are_refused(tmp_path: Path) -> None:
    tracks = evidence().tracks
    path = tmp_path / "frames.npz"
    for wrong in (
        BodyTracks(tracks.names[:-1], tracks.times_s, tracks.poses, tracks.low, tracks.high),
        BodyTracks(tracks.names, tracks.times_s[::-1].copy(), tracks.poses, tracks.low, tracks.high),
        BodyTracks(tracks.names, tracks.times_s, tracks.poses * np.nan, tracks.low, tracks.high),
    ):
        path.write_bytes(packed(wrong))
        with pytest.raises(BadInput, match="no frames of a run"):
            read_tracks(path)


def test_the_rows_of_a_schedule() -> None:
    header = "part,product,operation,station,target,resource,robot,start_s,end_s,when\n"
    text = (
        header
        + "cube 1,cube,carry,in,oven,robot,robot,1.5,3.0,planned\ncube 1,cube,carry,in,oven,robot,robot,2,4,measured\n"
    )
    rows = schedule_rows(text)
    assert [(row["start_s"], row["end_s"]) for row in rows["measured"]] == [(2.0, 4.0)]
    assert [(row["start_s"], row["end_s"]) for row in rows["planned"]] == [(1.5, 3.0)]
    with pytest.raises((ValueError, KeyError)):
        schedule_rows(header + "cube 1,cube,carry,in,oven,robot,robot,soon,4,measured\n")
    for start, end in (("nan", "4"), ("0", "inf"), ("-1", "4"), ("4", "2")):
        with pytest.raises(ValueError, match=f"a row from {start} to {end} s"):
            schedule_rows(header + f"cube 1,cube,carry,in,oven,robot,robot,{start},{end},measured\n")


def headed(case: Evidence, *low: tuple[float, float]) -> list[tuple[str, str, str]]:
    """What is found where the oven has a head that is 3 cm over it, and 1 cm from one time to the other [s].

    The head has to rest for 3 s before each of two cells, one over the other, of the side of a cube.
    """
    tracks, times_s = case.tracks, case.tracks.times_s
    near = np.logical_or.reduce([(times_s >= from_s) & (times_s < to_s) for from_s, to_s in low or [(0.0, 0.0)]])
    head = np.zeros((len(times_s), 1, 7))
    above = TOPS["oven"] + np.where(near, 0.01, 0.03)
    head[:, 0, :3] = np.stack([np.full(len(times_s), 0.58), np.full(len(times_s), -0.1), above], axis=1)
    head[:, 0, 6] = 1.0
    half = np.full((1, 3), 0.01)
    own = BodyTracks(
        (*tracks.names, "oven head"),
        times_s,
        np.concatenate([tracks.poses, head], axis=1),
        np.concatenate([tracks.low, -half]),
        np.concatenate([tracks.high, half]),
    )
    stations = [
        station.model_copy(update={"process": "glue", "processing_s": None}) if station.name == "oven" else station
        for station in case.task.stations
    ]
    process = Process(grid=(2, 1), dwell_s=3.0)
    task = case.task.model_copy(update={"stations": tuple(stations), "processes": {"glue": process}})
    return found(Evidence(task, case.order, own, case.rows, case.claimed, case.struck))


def test_a_head_that_leaves_cells_out() -> None:
    case = evidence((ONE,))
    assert headed(case, (10, 13.5)) == []
    assert headed(case) == [("process", "cube 1", "oven")]


def test_a_part_that_was_taken_out_is_judged_by_the_stay_in_which_the_head_covered_it() -> None:
    """It stands in the oven from 4 to 14 s, and again from 20 to 40 s; nobody but a fault takes it out."""
    twice: Way = ((0, "in"), (2, ""), (4, "oven"), (14, ""), (20, "oven"), (40, ""), (42, "out"))
    touched = evidence((twice,), [Struck("part moved", "cube 1", "oven")])
    assert headed(touched, (25, 28.5)) == []
    assert headed(touched, (5, 8.5)) == []
    assert headed(touched) == [("process", "cube 1", "oven")]
    assert ("process", "cube 1", "oven") in headed(evidence((twice,)), (25, 28.5))


def test_two_parts_in_one_place() -> None:
    case = evidence()
    case.tracks.poses[-10:, case.tracks.number("cube 2")] = case.tracks.poses[-1, case.tracks.number("cube 1")]
    assert {one for one in found(case) if one[0] == "overlap"} == {("overlap", "cube 1", ""), ("overlap", "cube 2", "")}


def test_a_gripper_that_waits_at_a_part_does_not_stretch_its_window() -> None:
    """It was done at 24 s and is to leave within 3; the carry begins in time, but the part stands there for 9 s more."""
    late: Way = ((0, "in"), (2, ""), (4, "oven"), (33, ""), (35, "out"))
    case = evidence((late,), at_most_s=3.0)
    for row in case.rows:
        if row["station"] == "oven" and row["operation"] == "carry":
            row["start_s"] = 25.0
        if row["target"] == "oven" and row["operation"] == "empty":
            row["end_s"] = 25.0
    assert found(case) == [("window", "cube 1", "oven")]


def frames(case: Evidence, name: str, from_s: float, to_s: float) -> Any:
    """The poses of a body in a span of time, to be written to."""
    first, after = np.searchsorted(case.tracks.times_s, (from_s - 1e-9, to_s - 1e-9))
    return case.tracks.poses[first:after, case.tracks.number(name)]


def test_a_part_that_leans_or_stands_beside_its_spot_on_its_way() -> None:
    case = evidence()
    frames(case, "cube 1", 4.0, 26.0)[:, 3:] = (sin(0.15), 0.0, 0.0, cos(0.15))
    case.__post_init__()
    assert found(case) == [("stood", "cube 1", "oven")]
    case = evidence()
    frames(case, "cube 1", 4.0, 26.0)[:, 0] -= 0.02
    case.__post_init__()
    assert set(found(case)) == {("stood", "cube 1", "oven"), ("gripper", "cube 1", "")}


def test_a_part_that_flies_without_the_robot() -> None:
    case = evidence()
    frames(case, "robot hand", 2.0, 4.0)[:, 1] += 0.2
    assert found(case) == [("gripper", "cube 1", "")]


def test_a_part_that_is_elsewhere_at_once() -> None:
    case = evidence()
    frames(case, "cube 1", 3.0, 3.1)[:, 0] += 0.5
    frames(case, "robot hand", 3.0, 3.1)[:, 0] += 0.5
    assert found(case) == [("gripper", "cube 1", "")]


def test_a_station_that_is_elsewhere_and_a_part_that_nobody_ordered() -> None:
    case = evidence((ONE,))
    everything = case.tracks.poses[:, :, 1]
    everything += 0.2
    assert {rule for rule, _, _ in found(case)} == {"station", "stood"}
    case = evidence((ONE, TWO))
    alone = Evidence(case.task, case.order[:1], case.tracks, rows_of_ways((ONE,)), ["cube 1"])
    assert found(alone) == [("order", "cube 2", "")]


def test_work_that_the_schedule_does_not_have() -> None:
    case = evidence((ONE,))
    case.rows = [row for row in case.rows if row["operation"] != "process"]
    assert found(case) == [("schedule", "cube 1", "oven")]


def test_turns_that_are_none_are_refused(tmp_path: Path) -> None:
    case, path = evidence(), tmp_path / "frames.npz"
    frames(case, "cube 1", 3.0, 4.0)[:, 3:] = 0.0
    path.write_bytes(packed(case.tracks))
    with pytest.raises(BadInput, match="quaternion"):
        read_tracks(path)


def test_a_batch_is_worked_on_together() -> None:
    """Cube 1 comes at 4 s, cube 2 at 10 s: together from 10 to 30 s. Who comes or goes meanwhile is seen, and what differs."""
    one: Way = ((0, "in"), (2, ""), (4, "oven"), (34, ""), (36, "out"))
    two: Way = ((0, "in"), (8, ""), (10, "oven"), (40, ""), (42, "out"))

    def case(ways: Sequence[Way], *spans: tuple[float, float]) -> list[tuple[str, str, str]]:
        seen = evidence(ways, capacity=2, batch=True, size_m=[0.1, 0.1, TOPS["oven"]])
        others = [row for row in seen.rows if row["operation"] != "process"]
        seen.rows = [*others, *(_row(n, "process", "oven", "oven", *span) for n, span in enumerate(spans, 1))]
        return [one for one in found(seen) if one[0] == "batch"]

    assert case((one, two), (10.0, 30.0), (10.0, 30.0)) == []
    assert set(case((one, two), (4.0, 24.0), (10.0, 30.0))) == {("batch", f"cube {n}", "oven") for n in (1, 2)}
    early: Way = ((0, "in"), (2, ""), (4, "oven"), (25, ""), (27, "out"))
    assert ("batch", "cube 1", "oven") in case((early, two), (5.0, 25.0), (10.0, 30.0))


def test_a_part_that_drifts_while_it_is_worked_on() -> None:
    """3 cm from 10 to 20 s, so slowly that no step is seen: in a machine of two, where any place would do."""
    case = evidence(capacity=2)
    oven = frames(case, "cube 1", 10.0, 26.0)
    oven[:, 0] -= np.minimum(np.arange(len(oven)) / 100, 1.0) * 0.03
    assert ("stood", "cube 1", "oven") in found(case)


@pytest.mark.parametrize("off_m", [0.005, -0.003])
def test_a_part_that_hangs_or_has_sunk_in_the_end(off_m: float) -> None:
    case = evidence()
    frames(case, "cube 1", 28.0, 61.0)[:, 2] += off_m
    assert found(case) == [("stood", "cube 1", "out")]


def test_a_part_that_is_carried_beside_the_hand() -> None:
    case = evidence()
    flight = frames(case, "cube 1", 2.0, 4.0)
    flight[:, 1] += 0.15 * np.sin(np.linspace(0.0, np.pi, len(flight)))
    assert set(found(case)) == {("gripper", "cube 1", "")}


@pytest.mark.parametrize(
    ("opens_m", "sinks_m", "right"), [(0.02, 0.0024, True), (0.03, 0.0024, False), (0.02, 0.012, False)]
)
def test_a_part_that_sinks_as_the_fingers_open(opens_m: float, sinks_m: float, right: bool) -> None:
    """From one frame to the next the hand goes off by 20 mm, as fingers do, or by 30, and the cube comes down meanwhile."""
    case = evidence()
    tracks = case.tracks
    cube, hand, lands = tracks.number("cube 1"), tracks.number("robot hand"), int(np.searchsorted(tracks.times_s, 3.99))
    tracks.poses[lands - 1, cube, :3] = tracks.poses[lands, cube, :3] + (0.0, 0.0, sinks_m)
    tracks.poses[lands - 1, hand, :3] = tracks.poses[lands - 1, cube, :3]
    tracks.poses[lands:, hand, 0] = tracks.poses[lands:, cube, 0] + 2 * HALF_M + opens_m
    said = [one.at_s for one in audit(case).findings if one.words.endswith("not by the robot's hand") and one.at_s < 5]
    assert said == ([] if right else [pytest.approx(3.9)])


def test_two_parts_that_change_places_with_nobody_there() -> None:
    case = evidence()
    one, other = (frames(case, f"cube {n}", 59.0, 61.0) for n in (1, 2))
    one[:, :2], other[:, :2] = other[:, :2].copy(), one[:, :2].copy()
    assert {("stood", "cube 1", "out"), ("gripper", "cube 1", ""), ("gripper", "cube 2", "")} <= set(found(case))


def test_a_robot_that_does_not_stand_where_the_task_has_it() -> None:
    case = evidence()
    case.tracks.poses[:, case.tracks.number("robot"), 0] += 0.01
    assert found(case) == [("station", "", "")]


def test_a_robot_that_is_at_two_places_by_its_schedule() -> None:
    case = evidence((ONE,))
    row = next(row for row in case.rows if row["operation"] == "empty" and row["start_s"] > 0)
    row["end_s"] -= 5.0
    assert found(case) == [("schedule", "cube 1", "oven")]
    case = evidence((ONE,))
    next(row for row in case.rows if row["operation"] == "empty" and row["start_s"] > 0)["station"] = "out"
    assert ("schedule", "cube 1", "out") in found(case)


def test_a_plan_that_was_not_the_one() -> None:
    """As many transfers, but those of cube 2 come first; with a fault the plan may be changed."""
    for struck in ((), [Struck("machine slow", "", "oven")]):
        case = evidence(struck=struck)
        case.planned = rows_of_ways((TWO, ONE))
        assert [one[0] for one in found(case)] == ([] if struck else ["schedule"])
    case.planned = rows_of_ways((ONE, TWO))
    assert found(case) == []


def service(*rests: tuple[float, float, float]) -> list[tuple[str, str, str]]:
    """What is found where the robot is to rest over two cells beside the oven for 3 s each, and its hand rests (from s, x, y)."""
    case = evidence((ONE,))
    document = case.task.model_dump(mode="json", exclude_unset=True)
    document["processes"] = {
        "wipe": {"grid": [2, 1], "dwell_s": 3.0, "speed_m_s": 0.1, "by": "robot", "area_m": [0.04, 0.08]}
        | {"off_m": [-0.1, 0.0, 0.1]}
    }
    document["parts"][0]["routes"] = [["in", {"station": "oven", "service": "wipe"}, "out"]]
    for since_s, x, y in rests:
        frames(case, "robot hand", since_s, since_s + 3.3)[:, :3] = (AT["oven"][0] + x, AT["oven"][1] + y, 0.15)
    names = tuple("robot finger" if name == "robot hand" else name for name in case.tracks.names)
    tracks = BodyTracks(names, case.tracks.times_s, case.tracks.poses, case.tracks.low, case.tracks.high)
    return found(Evidence(Task.model_validate(document), case.order, tracks, case.rows, case.claimed))


def test_a_service_that_the_robot_did_not_carry_out() -> None:
    assert service((8.0, -0.1, 0.02), (12.0, -0.1, -0.02)) == []
    assert service((8.0, -0.1, 0.02)) == [("service", "cube 1", "oven")]
    assert service() == [("service", "cube 1", "oven")]
    assert service((8.0, 0.1, 0.02), (12.0, 0.1, -0.02)) == [("service", "cube 1", "oven")]


def test_a_part_that_is_set_down_beside_where_it_was_brought() -> None:
    """By 5 cm, on the slab and with the hand near: by nothing that the hand did."""
    case = evidence()
    frames(case, "cube 1", 28.0, 61.0)[:, 1] -= 0.05
    assert set(found(case)) == {("gripper", "cube 1", "")}
