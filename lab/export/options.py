"""What can be chosen of an export, and how a cell's inputs and outputs are numbered in it."""

import re
from dataclasses import dataclass
from typing import Literal

from lab.errors import BadInput

POSITIONS = ("rectan", "pulse")


@dataclass(frozen=True)
class Options:
    """positions: of job files, rectangular or in pulses. date: that they bear, yyyy/mm/dd hh:mm.

    any_arm: programs are also written for arms of other makers than the controller's.
    """

    positions: Literal["rectan", "pulse"] = "rectan"
    date: str = "2000/01/01 00:00"
    any_arm: bool = False

    def check_arm(self, form: str, maker: str, names: str, arm: str, *, level: bool) -> None:
        """BadInput for an arm that is none of a controller's maker, whose names match `names`, unless any will do; or level."""
        if level:
            raise BadInput(
                f"--format {form}: its poses are of a tool that hangs; this run's is level: csv and json fit any"
            )
        if not self.any_arm and not re.fullmatch(names, arm, re.IGNORECASE):
            raise BadInput(
                f"--format {form}: arm '{arm}' is not made by {maker}; --any-arm writes it all the same, csv and json fit any"
            )


GRIPPER = 1  # its output, and its input that says that it holds something
PULSE_S = 0.5  # of an output that a machine waits for


def done_input(machine: int) -> int:
    """By which a machine, counted from 1, says that it is done."""
    return 1 + machine


def start_output(machine: int) -> int:
    """By which a machine, counted from 1, is told to begin."""
    return 2 * machine


def reset_output(machine: int) -> int:
    """By which a machine, counted from 1, is told that its part was taken out."""
    return 2 * machine + 1
