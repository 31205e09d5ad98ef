"""A machine and the parts that stand in it, on each of which it works for a time of its own or by its learned process."""

from dataclasses import dataclass, field

from lab.skills import Skill
from lab.skills.skill import Bench, Status
from lab.toolbox.policy import Policy

NEVER = float("inf")
PATIENCE, PATIENCE_S = 1.0, 10.0  # a machine may be late by this share of its time, and by at least so much [s]


@dataclass
class MachineWork:
    """What a machine, `station`, does with one part.

    begun_s: since when [s]; expected_s: when it should be done [s]; until_s: when it is done by the clock [s]; of a learned
    process, `skill`, the motion decides. burns_s: when the part is spoilt if it is still in the machine then [s].
    """

    station: str
    part: str
    begun_s: float
    expected_s: float
    until_s: float
    skill: Skill | None = None
    burns_s: float = NEVER
    told: bool = field(default=False, repr=False)  # that it is done
    late: bool = field(default=False, repr=False)  # whether it was noticed that it is not done when it should be

    def start(self, bench: Bench, policy: Policy) -> None:
        """Carry its process out, from the beginning."""
        assert self.skill is not None
        self.skill.start(bench, policy)

    @property
    def moves(self) -> bool:
        """Whether the machine's head is in motion."""
        return self.skill is not None and self.skill.status is Status.RUNNING

    @property
    def failed(self) -> str:
        """Why its process failed; "" when it did not."""
        return self.skill.reason if self.skill is not None and self.skill.status is Status.FAILURE else ""

    @property
    def given_up_s(self) -> float:
        """When the machine counts as out of order if it is still not done [s]."""
        return self.expected_s + max(PATIENCE_S, PATIENCE * (self.expected_s - self.begun_s))

    def done(self, now_s: float) -> bool:
        """Whether the machine has finished the part."""
        return now_s >= self.until_s and not (self.moves or self.failed)


@dataclass
class Machine:
    """One machine, with a clock for each part in it; what the controller reads are its inputs `done` and `failed`.

    share: of its time that it really takes; fails: it never ends: both are what a fault sets. works: what it does with each
    part that stands in it, by the part's name, in the order in which they were brought.
    """

    station: str
    share: float = 1.0
    fails: bool = False
    works: dict[str, MachineWork] = field(default_factory=dict)
    _due: float = field(default=0.0, repr=False)  # steps of its process

    def begin(self, part: str, now_s: float, seconds: float, skill: Skill | None = None) -> MachineWork:
        """Begin to work on a part: for `seconds` [s], or with the process, which `MachineWork.start` then carries out."""
        own = None if skill is None else skill.aim(part)
        until_s = NEVER if self.fails else now_s + (seconds * self.share if skill is None else 0.0)
        self.works[part] = MachineWork(self.station, part, now_s, now_s + seconds, until_s, own)
        return self.works[part]

    @property
    def moves(self) -> bool:
        """Whether its head is in motion."""
        return any(work.moves for work in self.works.values())

    def slow_down(self, share: float, now_s: float) -> None:
        """Take `share` times as long from now on, also for the rest of the work on the parts in it."""
        for work in self.works.values():
            if work.until_s > now_s:
                work.until_s = now_s + (work.until_s - now_s) * share / self.share
        self.share = share

    def fail(self, now_s: float) -> None:
        """Never finish a part from now on; parts that are done stay done."""
        self.fails = True
        for work in self.works.values():
            if not work.done(now_s):
                work.until_s = NEVER

    def step(self) -> None:
        """Command the machine's head for the next physics step; the process of a slow machine pauses in some of the steps."""
        skills = [work.skill for work in self.works.values() if work.skill is not None]
        if not skills and self.share == 1.0:
            return
        self._due += 1.0 / self.share
        if self._due >= 1.0 and not self.fails:
            for skill in skills:
                skill.step()
        self._due %= 1.0

    def clear(self, part: str) -> None:
        """A part has been taken out."""
        work = self.works.pop(part, None)
        if work is not None and work.skill is not None:
            work.skill.stop()
