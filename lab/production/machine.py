"""A machine at work on the part that stands in it: for a time, or with its learned process; it says when it is done."""

from collections.abc import Sequence
from dataclasses import dataclass, field

from lab.skills import Skill
from lab.skills.skill import Bench, Status
from lab.toolbox.policy import Policy

NEVER = float("inf")


@dataclass
class Machine:
    """One machine: idle, busy, done, or failed; what the controller reads is its inputs `done` and `failed`.

    share: of its time that it really takes; fails: it never ends: both are what a fault sets. part: what it works on, or
    has worked on, "" for none. until_s: when it is done with it by the clock [s]; of a learned process, `skill`, the
    motion decides. burns_s: when the part is spoilt that is still in it then [s].
    """

    station: str
    share: float = 1.0
    fails: bool = False
    part: str = ""
    until_s: float = 0.0
    skill: Skill | None = None
    burns_s: float = NEVER
    told: bool = field(default=True, repr=False)  # that it is done
    _due: float = field(default=0.0, repr=False)  # steps of its process

    def begin(self, part: str, now_s: float, seconds: float, skills: Sequence[Skill] = ()) -> None:
        """Begin to work on a part: for `seconds` [s], or with the process, which `start` then carries out."""
        self.part, self.told, self.burns_s = part, False, NEVER
        self.skill = skills[0].aim(part) if skills else None
        self.until_s = NEVER if self.fails else now_s + (0.0 if skills else seconds * self.share)

    def start(self, bench: Bench, policy: Policy) -> None:
        """Carry its process out, from the beginning."""
        assert self.skill is not None
        self.skill.start(bench, policy)

    @property
    def moves(self) -> bool:
        """Whether its head is in motion."""
        return self.skill is not None and self.skill.status is Status.RUNNING

    @property
    def failed(self) -> str:
        """Why its process failed; "" when it did not."""
        return self.skill.reason if self.skill is not None and self.skill.status is Status.FAILURE else ""

    def step(self) -> None:
        """Set what the next physics step needs; a slow machine's process stands still in some of them."""
        if self.skill is None and self.share == 1.0:
            return
        self._due += 1.0 / self.share
        if self.skill is not None and not self.fails and self._due >= 1.0:
            self.skill.step()
        self._due %= 1.0

    def done(self, now_s: float) -> bool:
        """Whether it has finished its part."""
        return bool(self.part) and now_s >= self.until_s and not (self.moves or self.failed)

    def clear(self) -> None:
        """The part has been taken out."""
        self.part, self.told = "", True
        if self.skill is not None:
            self.skill.stop()
            self.skill = None
