"""What keeps a run from going on as planned, in words that are true."""

from typing import Literal

Kind = Literal["missed", "held", "final", "late", "seen"]


class Trouble(Exception):
    """Something that was noticed: with which part, by its name, and at which station; "" where it is about neither.

    skill: what was being carried out. kind: "held": the operator stopped the arm, so that what was under way is done again, which
    does not count as a try; "final": to try again is no use; "late": a machine takes longer than it should, and may yet get done;
    "seen": something is not where it should be; "missed": anything else.
    """

    def __init__(
        self,
        what: str,
        part: str = "",
        station: str = "",
        *,
        skill: str = "",
        kind: Kind = "missed",
    ) -> None:
        super().__init__(what)
        self.what, self.part, self.station, self.skill, self.kind = what, part, station, skill, kind

    @property
    def key(self) -> tuple[str, str, str]:
        """By what tries are counted: the part, the station and the skill."""
        return self.part, self.station, self.skill

    def __str__(self) -> str:
        where = " at ".join(one for one in (self.part, self.station and f"'{self.station}'") if one)
        return f"{where}: {self.what}" if where else self.what


class RunStopped(Exception):
    """The run stands still safely and cannot go on by itself; the text says why, and what a person must do."""
