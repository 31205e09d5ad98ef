"""Trouble: a noticed event that keeps a run from continuing as planned."""

from typing import Literal

Kind = Literal["missed", "held", "final", "late", "seen"]


class Trouble(Exception):
    """A noticed problem with a part, by its name, and a station; "" for neither.

    skill: the current skill. kind: "held": the operator stopped the arm, so the skill is repeated without counting as a try;
    "final": a retry is useless; "late": a machine takes longer than expected, and may still finish; "seen": a body is not where
    it is believed to be; "missed": anything else.
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
        """The key by which tries are counted: part, station and skill."""
        return self.part, self.station, self.skill

    def __str__(self) -> str:
        where = " at ".join(word for word in (self.part, self.station and f"'{self.station}'") if word)
        return f"{where}: {self.what}" if where else self.what


class RunStopped(Exception):
    """Raised when a run stands still safely and cannot continue by itself; the text says why, and what a person must do."""
