"""A machine and its parts, on each of which it works for a separate time or by its learned process."""

from dataclasses import dataclass, field

from lab.skills import Skill
from lab.skills.skill import Bench, Status
from lab.toolbox.policy import Policy

NEVER = float("inf")
PATIENCE, PATIENCE_S = 1.0, 10.0  # the tolerated delay of a machine, as a share of its time, and its least value [s]


@dataclass
class MachineWork:
    """The work of a machine, `station`, on one part.

    begun_s: its start [s]; expected_s: its expected end [s]; until_s: its end by the clock [s]; a learned process, `skill`,
    ends with its motion. burns_s: the time at which a part that is still in the machine is spoilt [s].
    """

    station: str
    part: str
    begun_s: float
    expected_s: float
    until_s: float
    skill: Skill | None = None
    burns_s: float = NEVER
    told: bool = field(default=False, repr=False)  # whether it was told that it is done
    late: bool = field(default=False, repr=False)  # whether it was noticed that it is late

    def start(self, bench: Bench, policy: Policy) -> None:
        """Starts its process from the beginning."""
        assert self.skill is not None
        self.skill.start(bench, policy)

    @property
    def moves(self) -> bool:
        """Whether the machine's head is in motion."""
        return self.skill is not None and self.skill.status is Status.RUNNING

    @property
    def failed(self) -> str:
        """The reason why its process failed, or ""."""
        return self.skill.reason if self.skill is not None and self.skill.status is Status.FAILURE else ""

    @property
    def given_up_s(self) -> float:
        """The time at which a machine that is still not done counts as out of order [s]."""
        return self.expected_s + max(PATIENCE_S, PATIENCE * (self.expected_s - self.begun_s))

    def done(self, now_s: float) -> bool:
        """Whether the machine has finished the part."""
        return now_s >= self.until_s and not (self.moves or self.failed)


@dataclass
class Machine:
    """One machine, with a clock for each part in it; the controller reads its signals `done` and `failed`.

    share: the factor on its time; fails: whether it never ends; both are set by faults. works: its work on each part in it, by
    the part's name, in the order of arrival.
    """

    station: str
    share: float = 1.0
    fails: bool = False
    works: dict[str, MachineWork] = field(default_factory=dict)
    _due: float = field(default=0.0, repr=False)  # physics steps of its process that are due

    def begin(self, part: str, now_s: float, seconds: float, skill: Skill | None = None) -> MachineWork:
        """Begins work on a part for `seconds` [s], or with the process, which `MachineWork.start` then starts."""
        own = None if skill is None else skill.aim(part)
        until_s = NEVER if self.fails else now_s + (seconds * self.share if skill is None else 0.0)
        self.works[part] = MachineWork(self.station, part, now_s, now_s + seconds, until_s, own)
        return self.works[part]

    @property
    def moves(self) -> bool:
        """Whether its head is in motion."""
        return any(work.moves for work in self.works.values())

    def slow_down(self, share: float, now_s: float) -> None:
        """Multiplies the machine's times by `share` from now on, also for the rest of the work on its parts."""
        for work in self.works.values():
            if work.until_s > now_s:
                work.until_s = now_s + (work.until_s - now_s) * share / self.share
        self.share = share

    def fail(self, now_s: float) -> None:
        """Lets the machine never finish a part from now on; finished parts stay finished."""
        self.fails = True
        for work in self.works.values():
            if not work.done(now_s):
                work.until_s = NEVER

    def step(self) -> None:
        """Commands the machine's head for the next physics step; the process of a slow machine pauses in some steps."""
        skills = [work.skill for work in self.works.values() if work.skill is not None]
        if not skills and self.share == 1.0:
            return
        self._due += 1.0 / self.share
        if self._due >= 1.0 and not self.fails:
            for skill in skills:
                skill.step()
        self._due %= 1.0

    def clear(self, part: str) -> None:
        """Notes that a part has been taken out."""
        work = self.works.pop(part, None)
        if work is not None and work.skill is not None:
            work.skill.stop()
