"""A schedule in 3D: where its parts, vehicles and the arm are at a time, read back from the page."""

from pathlib import Path

import numpy as np
import pytest

from lab.mdp import FloatArray
from lab.tasks.schedule_table import read_schedule
from lab.view.meshcat import replay_html
from lab.view.replay_file import Replay, read_replay
from lab.view.schedule_floor import CARRIER_M, HIGH_M, PART_M, WORKS
from lab.view.schedule_scene import ScheduleScene, scene_of

SHOP = "job,machine,start,end\nA,saw,0,30\nB,saw,30,50\nA,mill,40,60\n"
AGV = "job,machine,agv,from,to,start,end\nA,,v1,load,saw,0,20\nA,saw,,,,20,50\nA,,v1,saw,out,60,80\n"
TABLE_M = HIGH_M + PART_M / 2


class Shown:
    """A page and the scene that it was written from."""

    def __init__(self, text: str, folder: Path) -> None:
        (folder / "plan.csv").write_text(text)
        self.scene: ScheduleScene = scene_of(read_schedule([folder / "plan.csv"]), "plan")
        page = replay_html(self.scene.recording, folder / "plan.html", story=self.scene.story, tracks=self.scene.tracks)
        self.replay: Replay = read_replay(page)
        self.names = [body.name for body in self.scene.recording.bodies]

    def at(self, body: str, *times_s: float) -> FloatArray:
        """Places (n, 3) [m] of a body."""
        return np.asarray(self.replay.at(times_s).places[:, self.names.index(body)])

    def label(self, station: str) -> FloatArray:
        """Where the station of this name is."""
        body = next(b for b in self.scene.recording.bodies if any(shape.text == station for shape in b.shapes))
        return np.asarray(self.at(body.name, 0.0)[0])


def test_parts_stand_in_the_station_that_works_on_them_and_wait_in_the_next(tmp_path: Path) -> None:
    shown = Shown(SHOP, tmp_path)
    a, b = shown.at("part 1", 15, 35, 39, 50, 70), shown.at("part 2", 15, 40, 70)
    saw, mill = shown.label("saw"), shown.label("mill")
    assert a[0] == pytest.approx([saw[0], saw[1] + 0.02, TABLE_M], abs=1e-5)  # in work
    assert np.linalg.norm(a[1] - mill) < 0.6  # it waits there at once
    assert a[2] == pytest.approx(a[1])
    assert a[3] == pytest.approx([mill[0], mill[1] + 0.02, TABLE_M], abs=1e-5)
    assert np.linalg.norm(a[4] - shown.label("finished")) < 0.4
    assert np.linalg.norm(b[0] - shown.label("start")) < 0.4
    assert b[1] == pytest.approx([saw[0], saw[1] + 0.02, TABLE_M], abs=1e-5)
    assert np.linalg.norm(b[2] - a[4]) > 0.1  # each has a place of its own


def test_a_lamp_is_lit_while_its_machine_works(tmp_path: Path) -> None:
    shown = Shown(SHOP, tmp_path)
    lamp = shown.names.index(shown.names[0].replace("station", "lamp"))
    lit = shown.replay.at([15, 45, 55]).rgba[:, lamp]
    assert lit[0] == pytest.approx(WORKS)
    assert lit[1] == pytest.approx(WORKS)  # without a gap between A and B
    assert lit[2] != pytest.approx(WORKS)


def test_a_part_is_on_its_vehicle_while_it_is_carried(tmp_path: Path) -> None:
    shown = Shown(AGV, tmp_path)
    part, vehicle = shown.at("part 1", 0, 10, 30, 55, 70, 80), shown.at("vehicle 0", 0, 10, 30, 55, 70, 80)
    for moment in (1, 4):
        assert part[moment] == pytest.approx([*vehicle[moment][:2], CARRIER_M + PART_M / 2], abs=1e-4)
    assert part[0][2] == pytest.approx(TABLE_M)
    assert np.linalg.norm(part[0] - shown.label("load")) < 0.6
    assert part[2] == pytest.approx(part[3])  # it stays in the saw until it is fetched
    assert vehicle[3] == pytest.approx(vehicle[2])
    assert np.linalg.norm(part[5] - shown.label("out")) < 0.6
    assert not any("start" in shape.text for body in shown.scene.recording.bodies for shape in body.shapes)


def test_a_vehicle_goes_to_the_next_part_before_it_carries_it(tmp_path: Path) -> None:
    shown = Shown("job,agv,from,to,start,end\nA,v,one,two,0,10\nB,v,one,two,30,40\nC,v,one,two,40,70\n", tmp_path)
    at = shown.at("vehicle 0", 0, 10, 30, 40, 50)
    assert at[2] == pytest.approx(at[0])  # back in time
    assert at[1] == pytest.approx(at[3])
    assert at[4] == pytest.approx(at[0], abs=1e-4)  # without time between: a third of the carry
    assert shown.at("part 3", 50)[0][2] == pytest.approx(TABLE_M)


def test_one_robot_is_an_arm_whose_tool_is_above_the_part(tmp_path: Path) -> None:
    rows = "A,carry,plate,oven,robot,0,20\nA,process,oven,oven,,20,60\nA,carry,oven,dish,robot,60,80\n"
    shown = Shown("part,operation,station,target,robot,start_s,end_s\n" + rows, tmp_path)
    times = (0, 5, 10, 15, 20, 70, 80)
    part, tool = shown.at("part 1", *times), shown.at("tool", *times)
    assert part == pytest.approx(tool, abs=2e-3)
    assert np.linalg.norm(part[4][:2] - shown.label("oven")[:2]) < 0.05
    upper, fore = (shown.replay.at(times).turns[:, shown.names.index(name)] for name in ("upper link", "fore link"))
    elbow, link = shown.at("fore link", *times), np.linalg.norm(shown.at("fore link", 0.0)[0][:2])
    assert elbow[:, :2] == pytest.approx(link * upper[:, :2, 0], abs=2e-3)  # the links hang together,
    assert elbow[:, :2] + link * fore[:, :2, 0] == pytest.approx(tool[:, :2], abs=5e-3)  # and hold the tool


def test_stations_stand_where_the_file_says(tmp_path: Path) -> None:
    text = "part,station,start,end,x,y\nA,saw,0,3,0,0\nA,mill,4,6,200,0\nA,drill,7,8,200,100\n"
    shown = Shown(text, tmp_path)
    saw, mill, drill = (shown.label(name) for name in ("saw", "mill", "drill"))
    assert mill - saw == pytest.approx([2.2, 0.0, 0.0], abs=1e-6)  # as near as tables may stand
    assert drill - mill == pytest.approx([0.0, 1.1, 0.0], abs=1e-6)


def test_what_is_told_beside_it(tmp_path: Path) -> None:
    scene = Shown(SHOP + ",saw,60,65\n", tmp_path).scene
    assert scene.title == "plan: 2 parts, 2 stations, 65 s"
    assert scene.speed == 2.0
    assert scene.story.begins_s == (0.0, 30.0, 40.0)
    assert scene.story.captions == ((0.0, "A begins in saw"), (30.0, "B begins in saw"), (40.0, "A begins in mill"))
    told = scene.story.to_json()["measured"]
    assert [(one["resource"], one.get("name"), one["kind"]) for one in told] == [
        ("saw", "A", "process"),
        ("saw", "B", "process"),
        ("mill", "A", "process"),
        ("saw", None, "service"),
    ]
    assert told[0]["color"] == told[2]["color"] != told[1]["color"]


def test_a_part_that_is_in_two_places_at_once_goes_where_it_is_begun_last(tmp_path: Path) -> None:
    shown = Shown("job,machine,start,end\nA,saw,0,30\nA,mill,10,20\n", tmp_path)
    assert np.linalg.norm(shown.at("part 1", 15)[0] - shown.label("mill")) < 0.6


def test_many_parts_and_times_that_cannot_be_told_apart(tmp_path: Path) -> None:
    rows = "".join(f"p{k},m{k % 7},{1e7 + k * 1e-3},{1e7 + k * 1e-3}\n" for k in range(60))
    shown = Shown("part,station,start,end\n" + rows, tmp_path)
    finished = shown.label("finished")
    ends = np.array([shown.at(f"part {k}", 2e7)[0] for k in range(1, 61)])
    assert np.abs(ends - finished).max() < 1.0
    assert len({tuple(place) for place in ends.round(3)}) == 60
