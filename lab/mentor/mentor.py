"""`lab.Mentor`: decides at each step of a robot's policy whether it should ask, and whether the last help was any."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self

import numpy as np

from lab.errors import BadInput, counted
from lab.files import read_limited, write_whole
from lab.mentor.conformal import Promise, few_false_alarms, many_caught
from lab.mentor.demonstrated import Array, Demonstrated
from lab.mentor.doubts import DOUBTS, UNCALIBRATED, Arrays, Doubt, Step, check_rule, doubted, doubts_of, learned_by
from lab.mentor.judge import Judge
from lab.mentor.mentor_file import Kept, decode, encode
from lab.recordings.episode import Episode, Recording

MOST_BYTES = 200_000_000  # of a mentor's file


@dataclass(frozen=True)
class Question:
    """A mentor's answer for one step: true if the policy should ask; the doubt, the threshold, and why."""

    asks: bool
    doubt: float
    threshold: float
    rule: str
    rejected: bool = False

    def __bool__(self) -> bool:
        return self.asks

    @property
    def why(self) -> str:
        """The reason, as a sentence."""
        if self.rejected:
            return f"{self.rule}: it asks no more, because takeovers have not helped"
        relation = "above" if self.asks else "no more than"
        return f"{self.rule}: its doubt is {self.doubt:.3g}, {relation} {self.threshold:.3g}"


class Mentor:
    """A mentor for any policy of one robot; a call with an observation and an action returns a `Question`.

    rule: the measure of doubt; `lab.mentor.doubts.DOUBTS` lists them. threshold: it asks if the doubt is above it;
    `calibrate` sets it. promise: what that promises. judge: counts the takeovers that helped, once `corrected` is told.

        >>> import lab, numpy as np
        >>> def right(start):
        ...     places = np.linspace(start, start + 1, 21, dtype=np.float32)[:, None]
        ...     return lab.Episode("go right", places, np.ones_like(places), np.zeros(21, bool), success=True)
        >>> shown, alone = [right(0.0), right(0.1)], [right(0.01 * number) for number in range(1, 10)]
        >>> mentor = lab.Mentor.learn(lab.Recording(10, "cart", ("x",), ("speed",), shown), "distance")
        >>> mentor.calibrate(alone, false_alarms=0.1).promise.kind
        'false alarms'
        >>> bool(mentor([0.5], [1.0])), bool(mentor([3.0], [1.0]))
        (False, True)
    """

    def __init__(
        self,
        rule: str,
        demonstrated: Demonstrated,
        arrays: Arrays,
        state_names: Sequence[str],
        action_names: Sequence[str],
        threshold: float = float("inf"),
        promise: Promise | None = None,
    ) -> None:
        check_rule(rule, "mentor")
        self.rule, self.demonstrated, self.arrays = rule, demonstrated, arrays
        self.state_names, self.action_names = tuple(state_names), tuple(action_names)
        self.threshold, self.promise, self.judge = threshold, promise, Judge()
        self._learned: set[bytes] = set()  # the states of episodes that calibrate nothing: in them it doubts less
        self._doubt: Doubt = DOUBTS[rule].make(demonstrated, arrays)
        self.begin()

    # ---- learned, and calibrated ---------------------------------------------------------------------------------

    @classmethod
    def learn(
        cls,
        recording: Recording,
        rule: str | type[Doubt] = "distance",
        *,
        rollouts: Iterable[Episode] = (),
        seed: int = 0,
    ) -> Self:
        """A mentor for policies that were cloned from a recording; it never asks until `calibrate` sets its threshold.

        rule: a name, or a subclass of `lab.Doubt`.
        rollouts: of the policy, with known success: what the rule "failure" learns from; other ones calibrate it. seed: of all
        draws.
        Raises BadInput for an unknown rule, and if nothing was demonstrated.
        """
        rule = DOUBTS.named(rule)
        check_rule(rule, "mentor")
        rng, seen = np.random.default_rng(seed), tuple(rollouts)
        demonstrated = Demonstrated.of(recording.episodes, rng)
        threshold = 0.0 if rule in UNCALIBRATED else float("inf")
        for number, episode in enumerate(seen):
            _check_widths(episode, number, recording.state_names, recording.action_names)
        arrays = learned_by(rule, demonstrated, seen, rng)
        mentor = cls(rule, demonstrated, arrays, recording.state_names, recording.action_names, threshold)
        learned = (*recording.episodes, *(seen if DOUBTS[rule].make.learns_from_rollouts else ()))
        mentor._learned = {episode.states.tobytes() for episode in learned}
        return mentor

    def calibrate(
        self,
        rollouts: Iterable[Episode],
        *,
        false_alarms: float | None = None,
        caught: float | None = None,
        lead: int = 0,
    ) -> Self:
        """This mentor, after rollouts of the policy without a teacher have set its threshold.

        false_alarms: the share of the successful episodes in which it may ask; or caught: the share of the failed ones in which
        it has to, `lead` steps before their ends or sooner. The promise holds for episodes that are exchangeable with these.
        Raises BadInput unless one of the two is given, if there are too few episodes for it, and for an episode from which the
        mentor has learned.
        """
        if (false_alarms is None) == (caught is None):
            raise BadInput("calibrate: wanted false_alarms= or caught=, one of the two")
        if self.rule in UNCALIBRATED:
            raise BadInput(f"rule '{self.rule}' (calibrate): it asks {self.rule}: there is no threshold to set")
        given = [*rollouts]
        for number, episode in enumerate(given):
            _check_widths(episode, number, self.state_names, self.action_names)
            if episode.states.tobytes() in self._learned:
                raise BadInput(f"rollout {number} (calibrate): the mentor has learned from it: wanted other ones")
        if given and all(episode.success is None for episode in given):
            raise BadInput(
                "rollouts (calibrate): of none is it known whether it succeeded: wanted a success for each, in a dataset by its "
                "feature 'next.success'; lab mentor takes --failed, too"
            )
        chosen = [e for e in given if not e.corrected.any() and e.success is (caught is None)]
        if false_alarms is not None:
            self.promise = few_false_alarms([self.peak(episode) for episode in chosen], false_alarms)
        elif caught is not None:
            self.promise = many_caught([self.peak(episode, lead) for episode in chosen], caught)
        assert self.promise is not None
        self.threshold = self.promise.threshold
        return self

    def doubts(self, episode: Episode) -> Array:
        """The doubt (n,) at each step of a recorded episode; after each takeover the measure begins anew."""
        doubts = doubts_of(self._doubt, self.demonstrated, episode)
        self._doubt.begin()
        return doubts

    def peak(self, episode: Episode, lead: int = 0) -> float:
        """The largest doubt of an episode, its last `lead` steps left out; -inf if it has no others."""
        return float(max(self.doubts(episode)[: len(episode) - lead], default=-np.inf))

    # ---- in a rollout --------------------------------------------------------------------------------------------

    def begin(self) -> None:
        """Begins an episode."""
        self._doubt.begin()
        self.judge.begin()
        self._number = 0

    def __call__(
        self, observation: Any, action: Any, *, chunk: Any = None, members: Any = None, corrected: bool = False
    ) -> Question:
        """Whether the policy should ask at this step.

        observation, action: numbers (d,) and (k,), tensors, or mappings by the names of the recording, such as LeRobot's.
        chunk (h, k): the actions that the policy plans from here on; members (m, k): those of the members of an ensemble.
        corrected: whether a teacher gave the action of the step before; the judge needs to know.
        Raises BadInput for other widths.
        """
        state = self.demonstrated.standardized(
            _numbers(observation, self.state_names, "observation", "observation.state")
        )
        step = Step(
            self.demonstrated,
            state,
            _numbers(action, self.action_names, "action", "action"),
            self._number,
            _rows(chunk, len(self.action_names), "chunk"),
            _rows(members, len(self.action_names), "members"),
        )
        self._number += 1
        self.judge.saw(step.left, corrected)
        if corrected:
            self._doubt.begin()
        doubt = doubted(self._doubt, step)
        rejected = self.judge.rejects
        return Question(doubt > self.threshold and not rejected, doubt, self.threshold, self.rule, rejected)

    # ---- kept ----------------------------------------------------------------------------------------------------

    def save(self, path: Path | str) -> None:
        """Writes the mentor to a safetensors file, whole or not at all. Raises BadInput if it cannot be written."""
        kept = Kept(self.rule, self.state_names, self.action_names, self.threshold, self.promise)
        try:
            write_whole(Path(path), encode(kept, self.demonstrated, self.arrays))
        except OSError as error:
            raise BadInput(f"mentor file '{path}' cannot be written: {error.strerror or error}") from error

    @classmethod
    def load(cls, path: Path | str, rule: type[Doubt] | None = None) -> Self:
        """The mentor in a file; rule: the class of its rule, if that does not ship.

        Raises BadInput, which names the file, if it cannot be read, holds anything else, or is of a rule that is not known here.
        """
        try:
            content = read_limited(Path(path), MOST_BYTES)
        except OSError as error:
            raise BadInput(f"mentor file '{path}': {error.strerror or error}: wanted one that `save` wrote") from error
        kept, demonstrated, arrays = decode(content, str(path), rule)
        try:
            mentor = cls(
                kept.rule, demonstrated, arrays, kept.state_names, kept.action_names, kept.threshold, kept.promise
            )
            still = np.zeros(len(kept.action_names))
            mentor(demonstrated.middle, still, chunk=[still, still])
        except (
            ArithmeticError,
            LookupError,
            TypeError,
            ValueError,
        ) as error:  # of arrays that its rule does not use so
            raise BadInput(f"mentor file '{path}': the arrays do not fit its rule '{kept.rule}'") from error
        mentor.begin()
        return mentor


def parted(rule: str, rollouts: Sequence[Episode]) -> tuple[Sequence[Episode], Sequence[Episode]]:
    """The rollouts from which a rule learns, none for most, and those that calibrate it: every second one, in turn.

    Raises BadInput for an unknown rule.
    """
    check_rule(rule, "mentor")
    return (rollouts[::2], rollouts[1::2]) if DOUBTS[rule].make.learns_from_rollouts else ((), rollouts)


def _numbers(given: Any, names: Sequence[str], what: str, feature: str) -> Array:
    """The numbers (n,) of an observation or an action, in the order of the recording's names."""
    if isinstance(given, Mapping):
        if feature in given:
            given = given[feature]
        else:
            missing = next((name for name in names if name not in given), None)
            if missing is not None:
                raise BadInput(f"{what} (mentor): it lacks '{missing}', which the recording has, and '{feature}'")
            given = [given[name] for name in names]
    numbers = np.asarray(given, np.float64).reshape(-1)
    if len(numbers) != len(names) or not np.isfinite(numbers).all():
        raise BadInput(
            f"{what} (mentor): {counted(len(numbers), 'number')}: wanted {len(names)} finite ones, as the recording has"
        )
    return numbers


def _check_widths(episode: Episode, number: int, state_names: Sequence[str], action_names: Sequence[str]) -> None:
    widths, wanted = (episode.states.shape[1], episode.actions.shape[1]), (len(state_names), len(action_names))
    if widths != wanted:
        raise BadInput(
            f"rollout {number} (mentor): {widths[0]} states and {widths[1]} actions: wanted {wanted[0]} and {wanted[1]}, as "
            "the demonstrations have"
        )


def _rows(given: Any, width: int, what: str) -> Array | None:
    if given is None:
        return None
    rows = np.asarray(given, np.float64)
    if rows.ndim != 2 or rows.shape[1] != width or not np.isfinite(rows).all():
        raise BadInput(f"{what} (mentor): shape {rows.shape}: wanted rows of {width} finite numbers")
    return rows
