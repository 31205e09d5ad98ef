"""A run as INFORM II jobs: positions by hand, the order of calls, and jobs that cannot be followed."""

import re
from dataclasses import replace
from math import pi

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lab.errors import BadInput
from lab.export import jbi
from lab.export.commands import Await, GripperOutput, JointMove, Path, Pause, TransferJob, jobs_of
from lab.export.inform import (
    Call,
    Comment,
    Dout,
    InformJob,
    InformPosition,
    InformWait,
    MoveJ,
    MoveL,
    PauseIfOff,
    Pulse,
    Timer,
    read_job,
)
from lab.export.program import Options, Program
from lab.sim.arms.arm_models import arm_named
from lab.sim.arms.kinematics import ToolPose
from tests.export.conftest import carried_out

UP6 = arm_named("up6")
DATE = "2026/11/22 21:00"


def read_back(files: dict[str, str]) -> dict[str, InformJob]:
    return {name: read_job(text, name) for name, text in files.items()}


def test_the_master_opens_the_gripper_and_calls_the_transfers_in_order(up6: Program) -> None:
    files = jbi.write(up6, Options(date=DATE))
    assert list(files) == ["TOAST.JBI", "OPEN.JBI", "CLOSE.JBI", "M001.JBI", "M002.JBI"]
    jobs = read_back(files)
    assert jobs["TOAST.JBI"].instructions == (Call("OPEN"), Call("M001"), Call("M002"))
    assert {job.date for job in jobs.values()} == {DATE}
    assert [jobs[name].comment for name in ("M001.JBI", "M002.JBI")] == [
        "slice 1: plate to toaster",
        "slice 1: toaster to butter_appli",  # a comment has 32 characters
    ]


def test_the_grip_and_the_way_down_by_hand(up6: Program) -> None:
    """From (0.5, 0.1, 0.3) m down by 0.15 m at 60 % of 0.5 m/s; then the gripper closes."""
    job = read_back(jbi.write(up6, Options()))["M001.JBI"]
    assert job.positions[0].numbers == pytest.approx((500.0, 100.0, 300.0, 180.0, 0.0, 0.0), abs=0.01)
    assert job.positions[1].numbers == pytest.approx((500.0, 100.0, 150.0, 180.0, 0.0, 0.0), abs=0.01)
    assert job.instructions[:2] == (MoveJ(0, 10.0), MoveL(1, "V", 300.0, 0))
    assert job.instructions[2:5] == (Call("CLOSE"), PauseIfOff(1), Comment("TOOL 1: 0.040 KG"))
    assert {position.tool for position in job.positions[:2]} == {0}
    assert {position.tool for position in job.positions[2:]} == {1}
    start = (Comment("start toaster"), Pulse(2, 0.5), InformWait(2, on=False))
    assert job.instructions[-5:] == (Call("OPEN"), Comment("TOOL 0: 0.000 KG"), *start)


def test_a_wait_comes_before_what_is_done_at_the_machine_and_a_turn_is_timed_in_degrees(up6: Program) -> None:
    """A quarter turn; the wait; a rest of 1 s that stands for it in the run; another quarter turn; a rest of 0.25 s."""
    job = read_back(jbi.write(up6, Options()))["M002.JBI"]
    moves = [step for step in job.instructions if isinstance(step, MoveL)]
    at = job.instructions.index(InformWait(2))
    assert job.instructions[at - 1 : at + 2] == (Comment("toaster done"), InformWait(2), Timer(1.0))
    assert job.instructions[-4:] == (
        Timer(0.25),
        Comment("start butter_applier"),
        Pulse(4, 0.5),
        InformWait(3, on=False),
    )
    assert [(move.unit, move.level) for move in moves[-1:]] == [("VR", 0)]
    assert job.positions[moves[-1].c].numbers[5] == pytest.approx(-180.0, abs=0.02)


poses = st.builds(ToolPose, st.floats(0.45, 0.9), st.floats(-0.5, 0.5), st.floats(0.05, 0.4), st.floats(-3.1, 3.1))


@given(poses, poses, st.floats(0.05, 0.5), st.sampled_from(["rectan", "pulse"]))
def test_a_way_comes_back_within_what_is_written(begin: ToolPose, end: ToolPose, speed: float, positions: str) -> None:
    joints = UP6.inverse(begin)
    assert joints is not None
    turn = (end.yaw - begin.yaw + pi / 2) % pi - pi / 2
    points = np.array([[end.x, end.y, end.z, begin.yaw + turn]])
    commands = (
        JointMove(tuple(joints.tolist())),
        Path(points, np.zeros(1), np.full(1, speed)),
        GripperOutput(True),
        Pause(0.3),
        Await(2, "mill"),
    )
    options = Options("pulse" if positions == "pulse" else "rectan", DATE)
    close = InformJob("CLOSE", "", DATE, (), (Dout(1, True), Timer(0.3)))
    job = jbi._Writer(UP6, options).job("M001", TransferJob("one", commands))
    start, way, *rest = jbi.read({"a": job.text(), "b": close.text()}, UP6)
    assert rest == [GripperOutput(True), Pause(0.3), Await(2)]
    assert isinstance(start, JointMove)
    assert isinstance(way, Path)
    there = UP6.forward(np.array(start.joints))
    assert (there.x, there.y, there.z) == pytest.approx((begin.x, begin.y, begin.z), abs=2e-5)
    assert np.cos(there.yaw - begin.yaw) == pytest.approx(1.0, abs=1e-6)
    assert way.points[:, :3] == pytest.approx(points[:, :3], abs=2e-5)
    assert np.cos(way.points[:, 3] - points[:, 3]) == pytest.approx(1.0, abs=1e-6)
    if np.linalg.norm(points[0, :3] - [begin.x, begin.y, begin.z]) > 0.01:
        assert way.speeds[0] == pytest.approx(speed, rel=0.02)


def test_a_tool_that_is_wound_up_stays_so() -> None:
    """T at 200 degrees shows the same tool as T at -160; the manipulator's type tells them apart."""
    joints = UP6.inverse(ToolPose(0.6, 0.0, 0.2, 0.0))
    assert joints is not None
    for turn in (-160.0, 200.0, -200.0, 160.0):
        joints[-1] = np.radians(turn)
        written = jbi._Writer(UP6, Options(date=DATE)).job(
            "M001", TransferJob("", (JointMove(tuple(joints.tolist())),))
        )
        assert written.positions[0].configuration == (0, 0, 0, 0, int(abs(turn) > 180), 0, 0, 0)
        (read,) = jbi.read({"a": written.text()}, UP6)
        assert isinstance(read, JointMove)
        assert read.joints == pytest.approx(joints, abs=2e-4)


def test_what_the_robot_did_after_its_last_transfer_is_a_job_of_its_own(up6: Program) -> None:
    """As where a run failed: the second transfer was begun, but not made."""
    begun = replace(up6, carried=up6.carried.model_copy(update={"transfers": up6.carried.transfers[:1]}))
    assert [job.words for job in jobs_of(begun)] == ["slice 1: plate to toaster", "not finished"]
    assert read_back(jbi.write(begun, Options()))["M002.JBI"].comment == "not finished"


def test_arms_of_other_makers_are_refused_unless_any_will_do() -> None:
    panda = carried_out("panda")
    with pytest.raises(BadInput, match=r"^--format jbi: arm 'panda' is not made by Yaskawa; --any-arm"):
        jbi.write(panda, Options())
    assert jbi.write(panda, Options(any_arm=True))


def job_of(name: str, *steps: object, positions: tuple[InformPosition, ...] = ()) -> str:
    return InformJob(name, "", DATE, positions, steps).text()  # type: ignore[arg-type]


FLAT = (0, 0, 0, 0, 0, 0, 0, 0)
NEAR = InformPosition((500.0, 0.0, 300.0, 180.0, 0.0, 0.0), FLAT)
FAR = InformPosition((5000.0, 0.0, 300.0, 180.0, 0.0, 0.0), FLAT)
LEANING = InformPosition((500.0, 0.0, 300.0, 170.0, 0.0, 0.0), FLAT)
WRONG = [
    ([job_of("A", Call("B"))], "job 'B' is called, but is in none of the files"),
    ([job_of("A"), job_of("B")], "wanted one job that no other calls, found A, B"),
    ([job_of("A"), job_of("A")], "there are two jobs 'A'"),
    (
        [job_of("A", Call("B")), job_of("B", Call("C")), job_of("C", Call("B"))],
        "job 'B' calls itself, by way of A and B",
    ),
    ([job_of("A", MoveL(0, "V", 100.0, 0), positions=(NEAR,))], "job A, C00000: a straight line before any MOVJ"),
    ([job_of("A", MoveJ(0, 10.0), positions=(FAR,))], "job A, C00000: out of reach of arm 'up6'"),
    ([job_of("A", MoveJ(0, 10.0), positions=(LEANING,))], "Rx = 170.0, Ry = 0.0: the lab's tool points straight down"),
]


@pytest.mark.parametrize(("texts", "said"), WRONG)
def test_jobs_that_cannot_be_followed_say_why(texts: list[str], said: str) -> None:
    with pytest.raises(BadInput, match=re.escape(said)):
        jbi.read({f"{number}.JBI": text for number, text in enumerate(texts)}, UP6)
