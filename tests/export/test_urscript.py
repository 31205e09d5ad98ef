"""A run as URScript: the program by hand, and what is said of a line that is wrong."""

import re
from math import pi

import numpy as np
import pytest

from lab.errors import BadInput
from lab.export import urscript
from lab.export.commands import Await, GripperOutput, JointMove, Path, Pause, Payload
from lab.export.program import Options, Program
from lab.sim.arms.arm_models import arm_named
from lab.sim.arms.kinematics import ToolPose

UP6 = arm_named("up6")
TEXT = """\
def run_toast():
  set_tcp(p[0.000000, 0.000000, 0.170000, 0.000000, 0.000000, 0.000000])
  # 1: slice 1: plate to toaster
  movej(p[0.500000, 0.100000, 0.300000, 3.141593, 0.000000, 0.000000], a=1.000, v=0.300)
  movel(p[0.500000, 0.100000, 0.150000, 3.141593, 0.000000, 0.000000], a=2.000, v=0.30000, r=0.0005)
  movel(p[0.500000, 0.100000, 0.150000, 2.221441, 2.221441, 0.000000], a=2.000, v=2.00000, r=0.0000)
  set_digital_out(1, True)
  sleep(0.300)
  set_payload(0.100)
  while (get_digital_in(3) == False):
    sync()
  end
end
run_toast()
"""


def test_a_program_by_hand_is_understood() -> None:
    start, way, *rest = urscript.read({"a": TEXT}, UP6)
    assert rest == [GripperOutput(True), Pause(0.3), Payload(0.1), Await(2)]
    assert isinstance(start, JointMove)
    assert start.joints == pytest.approx(UP6.inverse(ToolPose(0.5, 0.1, 0.3, 0.0)), abs=1e-5)
    assert isinstance(way, Path)
    assert way.points == pytest.approx(np.array([[0.5, 0.1, 0.15, 0.0], [0.5, 0.1, 0.15, pi / 2]]), abs=1e-5)
    assert way.speeds == pytest.approx([0.3, 0.3])
    assert way.roundings == pytest.approx([0.0005, 0.0])


def test_joints_may_stand_for_the_pose_where_a_way_begins() -> None:
    joints = UP6.inverse(ToolPose(0.5, 0.1, 0.3, 0.0))
    assert joints is not None
    listed = f"[{', '.join(f'{joint:.6f}' for joint in joints)}]"
    text = re.sub(r"movej\(p\[.*?\]", f"movej({listed}", TEXT)
    by_pose, by_joints = (urscript.read({"a": one}, UP6)[0] for one in (TEXT, text))
    assert isinstance(by_pose, JointMove)
    assert isinstance(by_joints, JointMove)
    assert by_joints.joints == pytest.approx(by_pose.joints, abs=1e-5)


def test_the_run_as_a_program(up6: Program) -> None:
    ((name, text),) = urscript.write(up6, Options(any_arm=True)).items()
    assert name == "toast.script"
    lines = [line.strip() for line in text.splitlines()]
    assert lines[:3] == ["def run_toast():", TEXT.splitlines()[1].strip(), "set_digital_out(1, False)"]
    assert [line for line in lines if line.startswith("# ")] == [
        "# 1: slice 1: plate to toaster",
        "# start toaster",
        "# 2: slice 1: toaster to butter_applier",
        "# toaster done",
        "# start butter_applier",
    ]
    assert lines.index("while (get_digital_in(2) == False):") > lines.index("# 2: slice 1: toaster to butter_applier")
    assert [line for line in lines if line.startswith(("set_d", "sleep"))] == [
        "set_digital_out(1, False)",
        "set_digital_out(1, True)",
        "sleep(0.300)",
        "set_digital_out(1, False)",
        "sleep(0.300)",
        *("set_digital_out(2, True)", "sleep(0.500)", "set_digital_out(2, False)"),
        "sleep(1.000)",
        "sleep(0.250)",
        *("set_digital_out(4, True)", "sleep(0.500)", "set_digital_out(4, False)"),
    ]
    check = lines.index("if (get_digital_in(1) == False):")
    assert lines[check + 2 : check + 5] == ["halt", "end", "set_payload(0.040)"]
    assert urscript.warnings(up6)[0].startswith("urscript: 'up6' is no arm of Universal Robots")


WRONG = [
    ("def run_toast", "define run_toast", "toast.script: wanted one program, from 'def NAME():'"),
    ("\nrun_toast()", "\nrun_it()", "toast.script: wanted one program"),
    ("movej(", "movec(", "unknown instruction 'movec' (toast.script, line 4): did you mean 'move"),
    ("a=1.000", "a=fast", "line 4: 'movej(p[0.500000, 0.100000, 0.300000, 3.141593, 0.000000, 0.000000], a=fast,"),
    ("movej(p[0.5", "movej(p[5.5", "line 4: out of reach of arm 'up6'"),
    ("  movej(p[", "  # (p[", "line 5: a straight line before any movej"),
    ("2.221441, 0.000000]", "2.221441, 0.500000]", "line 6: the lab's tool points straight down"),
    ("    sync()\n", "    sleep(0.100)\n", "line 11: 'sleep(0.100)' within while: wanted sync() and end"),
    ("  end\nend", "end", "'while' has no end"),
    ("set_digital_out(1,", "set_digital_out(one,", "line 7: 'set_digital_out(one, True)' is not how set_digital_out"),
]


@pytest.mark.parametrize(("right", "wrong", "said"), WRONG)
def test_a_wrong_line_is_named(right: str, wrong: str, said: str) -> None:
    assert right in TEXT
    with pytest.raises(BadInput, match=re.escape(said)):
        urscript.read({"toast.script": TEXT.replace(right, wrong, 1)}, UP6)
