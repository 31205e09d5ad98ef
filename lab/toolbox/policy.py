"""A learned policy: its table, and the provenance that is needed to trust, reuse and explain it."""

import platform
import re
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from math import prod
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple, Self

import numpy as np
from annotated_types import Ge
from numpy.typing import NDArray

from lab.errors import BadInput
from lab.mdp import FloatArray, TabularMDP
from lab.version import __version__

if TYPE_CHECKING:
    from lab.learning.session_result import CountArray, SessionResult
    from lab.learning.settings import GateSettings, LearnerSettings

MAX_NAME_LENGTH = 100
Count = Annotated[int, Ge(0)]
ON, GOAL, OUT = range(3)  # kinds of states: not terminal, goal, another terminal state
_SIGNATURE = re.compile(r"[0-9a-f]{16}")


class Origin(NamedTuple):
    """The name of a policy, its sub-task and task, its advisor and its seed."""

    name: str
    subtask: str
    task: str
    advisor: str
    seed: int


@dataclass(frozen=True, eq=False)
class Policy:
    """A learned table with its provenance.

    name: 1 to 100 printable characters; subtask, task: what it was learned for.
    q: (S, A) float64, the action values; visits: (S, A) int64.
    action_labels, shape, start, signature: those of its problem, see `TabularMDP`.
    learner, gate: the settings by name; advisor: its name; seed: of the session.
    curve: the steps of each episode, max_steps + 1 if it failed; guided: whether each had advice.
    helped_steps, requests, optimal_steps, final_steps, solved: see `SessionResult`.
    created: ISO 8601 in UTC; versions: by package.
    ends: (S,) uint8, the kind of each state: 0 not terminal, 1 goal, 2 another terminal state.
    parent: the policy that it was warm-started from, as "name@hash"; scene: where it was learned, in words; arm: the arm it was
    learned with; each of these is "" if there is none.

    Raises BadInput if these do not fit together.

        >>> import lab
        >>> policy = lab.teach("world-1", seed=1, episodes=60).policy
        >>> policy.task, policy.q.shape, policy.seed, len(policy.curve)
        ('world-1', (1000, 6), 1, 60)
    """

    name: str
    subtask: str
    task: str
    q: FloatArray
    visits: "CountArray"
    action_labels: tuple[str, ...]
    shape: tuple[Count, ...]
    start: Count
    signature: str
    learner: dict[str, Any]
    gate: dict[str, Any]
    advisor: str
    seed: int
    curve: list[Count]
    guided: list[bool]
    helped_steps: Count
    requests: Count
    optimal_steps: Count | None
    final_steps: Count | None
    solved: bool
    created: str
    versions: dict[str, str]
    ends: NDArray[np.uint8]
    parent: str = ""
    scene: str = ""
    arm: str = ""

    def __post_init__(self) -> None:
        reason = self._what_does_not_fit()
        if reason:
            raise BadInput(f"policy '{str(self.name)[:MAX_NAME_LENGTH]}': {reason}")

    def _what_does_not_fit(self) -> str | None:
        if not is_name(self.name):
            return f"its name must have 1 to {MAX_NAME_LENGTH} printable characters"
        if self.q.ndim != 2 or 0 in self.q.shape:
            return f"table q has shape {self.q.shape}, allowed (states, actions)"
        if self.q.dtype != np.float64 or self.visits.dtype != np.int64:
            return f"q is {self.q.dtype} and visits {self.visits.dtype}, allowed float64 and int64"
        states, actions = self.q.shape
        if self.visits.shape != self.q.shape:
            return f"visits have shape {self.visits.shape}, q has {self.q.shape}"
        if not np.isfinite(self.q).all():
            return f"{int((~np.isfinite(self.q)).sum())} values of q are not finite"
        if self.ends.shape != (states,) or self.ends.max() > OUT:
            return f"ends have shape {self.ends.shape} up to {self.ends.max()}, allowed ({states},) up to {OUT}"
        if self.visits.min() < 0:
            return "a visit count is negative"
        if len(self.action_labels) != actions:
            return f"{len(self.action_labels)} action labels for {actions} actions"
        if self.shape and prod(self.shape) != states:
            return f"shape {self.shape} does not hold {states} states"
        if not 0 <= self.start < states:
            return f"start {self.start} is outside 0..{states - 1}"
        if not _SIGNATURE.fullmatch(self.signature):
            return f"signature '{self.signature[:40]}' is not 16 hex digits"
        if len(self.curve) != len(self.guided):
            return f"{len(self.curve)} episodes in the curve, {len(self.guided)} in guided"
        return None

    @classmethod
    def of(
        cls, result: "SessionResult", mdp: TabularMDP, learner: "LearnerSettings", gate: "GateSettings", origin: Origin
    ) -> Self:
        """The policy that a session learned in a problem, with the current time and versions."""
        return cls(
            **origin._asdict(),
            q=result.q,
            visits=result.visits,
            action_labels=mdp.action_labels,
            shape=mdp.shape,
            start=mdp.start,
            signature=mdp.signature,
            learner=asdict(learner),
            gate=asdict(gate),
            curve=result.steps.tolist(),
            guided=result.guided.tolist(),
            helped_steps=result.helped_steps,
            requests=result.requests,
            optimal_steps=result.optimal_steps,
            final_steps=result.final_steps,
            solved=result.solved,
            created=datetime.now(UTC).isoformat(timespec="microseconds"),
            ends=np.where(mdp.goal, GOAL, np.where(mdp.terminal, OUT, ON)).astype(np.uint8),
            versions={"teaching-lab": __version__, "python": platform.python_version(), "numpy": np.__version__},
        )


def is_name(name: str) -> bool:
    """Whether a policy may have this name: 1 to 100 printable characters, not all of them blanks."""
    return bool(name.strip()) and len(name) <= MAX_NAME_LENGTH and name.isprintable()
