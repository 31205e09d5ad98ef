"""What can be chosen of an export."""

from dataclasses import dataclass
from typing import Literal

POSITIONS = ("rectan", "pulse")


@dataclass(frozen=True)
class Options:
    """positions: of job files, rectangular or in pulses. date: that they bear, yyyy/mm/dd hh:mm."""

    positions: Literal["rectan", "pulse"] = "rectan"
    date: str = "2000/01/01 00:00"
