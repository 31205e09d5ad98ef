"""Leading the arm by hand: what was led as moves of a grid, taught, judged, kept, and done again."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from lab.advice.table_level import answers_of
from lab.errors import BadInput
from lab.learning.problem import Problem
from lab.mdp import grid
from lab.production.operation.lead import OUTSIDE, Lead, Seen
from lab.production.operation.operation import Operation
from lab.production.run_journal import Led, read_run
from lab.sim.arms.kinematics import ToolPose
from lab.skills import Skill
from lab.toolbox.registry import Toolbox

Made = Callable[..., Operation]
CELL_M = 0.1
WAY = "transfer plate to insert with slice"


class Flat(Skill):
    """Four columns by three rows of cells in a plane: "S" the start, "G" the goal, "#" blocked.

    S . # .
    . . . .
    . . . G
    """

    def __init__(self) -> None:
        super().__init__("across the table")
        blocked = np.zeros((4, 3), bool)
        blocked[2, 0] = True
        self.problem = Problem(self.name, "transfer", grid((4, 3), blocked, (0, 0), (3, 2)))

    def pose(self, state: int) -> ToolPose:
        i, j = self.problem.mdp.state_cell(state)
        return ToolPose(CELL_M * i, CELL_M * j, 0.2, 0.0)


def led(*cells: tuple[float, float]) -> Lead:
    """A lead in which the tool was seen in the middle of these cells."""
    lead = Lead.of(Flat(), "lead")
    for i, j in cells:
        lead.see(ToolPose(CELL_M * i, CELL_M * j, 0.2, 0.3))
    return lead


def test_the_tool_is_in_the_cell_whose_middle_is_nearest() -> None:
    flat = Flat()
    assert Seen.of(flat, ToolPose(0.14, 0.06, 0.2, 0.0)).state == 1 * 3 + 1
    assert Seen.of(flat, ToolPose(0.36, 0.06, 0.2, 0.0))[:2] == (OUTSIDE, (4, 1))
    assert Seen.of(flat, ToolPose(0.14, 0.06, 0.31, 0.0)).state == OUTSIDE


def test_cells_between_are_filled_in_by_free_neighbours_and_it_ends_at_the_goal() -> None:
    shown = led((0, 0), (1, 1), (3, 2), (3, 1)).demonstration()
    assert (shown.first, shown.last, len(shown.moves)) == (0, 3 * 3 + 2, 5)
    assert (shown.left, shown.blocked) == (0, ())


def test_a_loop_is_cut_out() -> None:
    shown = led((0, 0), (1, 0), (1, 1), (0, 1), (0, 0), (0, 1), (0, 2)).demonstration()
    assert shown.said == {"(0, 0)": "+axis1", "(0, 1)": "+axis1"}


def test_blocked_cells_and_what_lies_outside_are_said_and_gone_round() -> None:
    shown = led((0, 0), (1, 0), (2, 0), (3, 0), (5, 0), (3, 1), (3, 2)).demonstration()
    assert (shown.blocked, shown.left) == (("(2, 0)",), 1)
    mdp, state = shown.skill.problem.mdp, shown.first
    for at, action in shown.moves.items():
        assert at == state
        state = int(mdp.successor[state, action])
        assert mdp.goal[state] or not mdp.terminal[state]
    assert state == shown.last == 3 * 3 + 2


def test_what_begins_and_ends_near_start_and_goal_begins_and_ends_there() -> None:
    shown = led((1, 2), (1, 1), (2, 2)).demonstration()
    assert (shown.first, shown.last, len(shown.moves)) == (0, 3 * 3 + 2, 5)
    assert led((0, 1), (0, 2)).demonstration().last == 2


def test_to_come_from_outside_and_to_end_there_is_not_to_leave() -> None:
    assert led((-2, 0), (0, 0), (0, 1), (-2, 1)).demonstration().left == 0


@pytest.mark.parametrize("cells", [[(0.0, 0.0)], [(9.0, 9.0)], [(2.0, 0.0), (0.0, 0.0), (0.2, 0.0)]])
def test_what_is_no_move_is_refused(cells: list[tuple[float, float]]) -> None:
    with pytest.raises(BadInput, match="fewer than two free cells"):
        led(*cells).demonstration()


# ---- in physics ------------------------------------------------------------------------------------------------------


def show(operation: Operation, *by_hand: str) -> None:
    operation.open()
    for line in (f"lead {WAY}", *by_hand):
        done = operation.do(line)
        assert done.well, done
        assert "the end of its path" in done.said


def test_a_good_lead_is_learned_from_kept_and_carried_out(made: Made, tmp_path: Path) -> None:
    box = Toolbox(tmp_path / "box")
    operation = made(box=box)
    show(operation, "move plate", "move insert")
    assert operation.do("lead end").well
    row = operation.scene.demonstrations[0]
    assert (row["reached"], row["verdict"], row["rejected_at_episode"]) == (True, "believed", None)
    assert row["helped_steps"] > 0
    assert row["learned_moves"] == row["fewest_moves"] <= row["led_moves"]
    kept = box.find("transfer", operation.scene.prepared.problems[WAY].mdp.signature)
    assert kept is not None
    assert (kept.name, kept.advisor, kept.solved) == (row["policy"], "led by operator", True)
    (entry,) = (entry for entry in read_run(tmp_path / "run", "test")[1] if isinstance(entry, Led))
    (file,) = (tmp_path / "run" / "led").iterdir()
    mdp = operation.scene.prepared.problems[WAY].mdp
    assert len(answers_of(file, mdp)) == len(entry.said) == row["led_moves"]
    assert operation.do("learn grasp at plate").well
    assert operation.do("grasp").well
    assert operation.do(f"execute {WAY}").well


def test_a_detour_is_dropped_and_a_shorter_way_is_learned(made: Made, tmp_path: Path) -> None:
    operation = made(box=Toolbox(tmp_path / "box"))
    show(operation, "move plate", "jog +z 250", "jog -y 400", "jog +y 400", "jog +x 100", "move insert")
    done = operation.do("lead end")
    row = operation.scene.demonstrations[0]
    assert row["learned_moves"] < row["led_moves"], done
    assert row["verdict"] == "dropped", done
    assert f"dropped in episode {row['rejected_at_episode']}" in done.said


def test_what_was_led_is_led_again_from_the_journal(made: Made, tmp_path: Path) -> None:
    operation = made(box=Toolbox(tmp_path / "box"))
    show(operation, "move plate", "move insert")
    assert operation.do("lead end").well
    again = made(folder="again", box=Toolbox(tmp_path / "other"))
    again.repeat(read_run(tmp_path / "run", "test")[1])
    assert again.scene.demonstrations == operation.scene.demonstrations
    policy = operation.scene.prepared.skillset.policies[WAY]
    assert (again.scene.prepared.skillset.policies[WAY].q == policy.q).all()


def test_one_lead_at_a_time_and_a_new_scene_forgets_it(made: Made) -> None:
    operation = made()
    operation.open()
    assert "nothing is led: lead NAME begins" in operation.do("lead end").refused
    assert "cannot be led" in operation.do("lead butter at butter_applier").refused
    assert operation.do("lead insert at toaster").said.startswith("Outside the grid: ")
    assert "fewer than two free cells" in operation.do("lead end").refused
    assert "'insert at toaster' is led" in operation.do(f"lead {WAY}").refused
    assert operation.do("parts slice=1").well
    assert "nothing is led" in operation.do("lead drop").refused
    assert operation.do(f"lead {WAY}").well
    assert operation.do("lead drop").said == "forgotten"
    assert operation.do("jog +z 10").said == ""


def test_the_tool_is_moved_over_a_place_and_to_a_point(made: Made) -> None:
    operation = made()
    operation.open()
    robot = operation.scene.floor.scene.robot
    assert operation.do("move toaster_buffer").well
    at = operation.scene.prepared.surveys.approach("toaster_buffer")
    assert (robot.tool().x, robot.tool().y) == pytest.approx((at.x, at.y), abs=0.003)
    x, y, z = at.x, at.y, at.z + 0.05
    assert operation.do(f"move {1000 * x:.1f} {1000 * y:.1f} {1000 * z:.1f}").well
    assert robot.tool().z == pytest.approx(z, abs=0.003)
    assert "did you mean 'toaster'?" in operation.do("move toster").refused
    assert "is no number of mm" in operation.do("move 1 2 x").refused
