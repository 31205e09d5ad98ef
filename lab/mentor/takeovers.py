"""Where each rule would have asked in a recording, against where a person took over."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lab.errors import BadInput
from lab.lazy import scipy
from lab.mentor.conformal import check_share, few_false_alarms
from lab.mentor.demonstrated import Array, Demonstrated, shows_what_to_do
from lab.mentor.doubts import DOUBTS, check_rule, doubts_of, learned_by
from lab.recordings.episode import Episode, Recording

FOLDS = 5  # an episode's doubt is measured by a mentor that learned from the other folds
RULES = ("distance", "discrepancy", "ensemble", "chunk", "progress", "failure", "clock")  # in the order of their table
CURVE = 60  # thresholds on the curve of a rule
Bools = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Rule:
    """What one rule would have done in a recording.

    doubts: for each episode (n,). thresholds: for each episode, calibrated by all others. asked: for each episode the steps at
    which an alarm begins. caught: how many takeovers an alarm preceded, within the window; right: how many alarms preceded one.
    lead_s: for each takeover that was caught, the seconds from its first alarm in the window. chance_precision, chance_recall:
    what as many alarms at random steps reach on average. auroc: the chance that a step within a window before a takeover
    has more doubt than another step; None if there are no such two. curve (c, 2): alarms a minute, and recall.
    """

    name: str
    doubts: Sequence[Array]
    thresholds: Sequence[float]
    asked: Sequence[Sequence[int]]
    alarms: int
    right: int
    caught: int
    lead_s: Sequence[float]
    chance_precision: float
    chance_recall: float
    auroc: float | None
    curve: Array

    @property
    def precision(self) -> float | None:
        """The share of the alarms that a takeover followed within the window."""
        return self.right / self.alarms if self.alarms else None


@dataclass(frozen=True, eq=False)
class RulesCompared:
    """Rules on one recording; notes: sentences on what could not be compared. minutes: of the policy's own steps."""

    recording: Recording
    window_s: float
    false_alarms: float
    takeovers: int
    minutes: float
    rules: Sequence[Rule]
    notes: Sequence[str]


def rules_compared(
    recording: Recording,
    *,
    window_s: float = 3.0,
    false_alarms: float = 0.1,
    rules: Sequence[str] = RULES,
    seed: int = 0,
    progress: Callable[[str], None] = lambda name: None,
) -> RulesCompared:
    """The rules in a recording with takeovers, each measured in episodes that it did not learn from.

    window_s: how long before a takeover an alarm counts as its warning. false_alarms: the share of the stretches without a
    takeover in which a rule may ask; it sets the threshold for an episode by all other episodes (cross-conformal, so that twice
    the share is the guarantee in the worst case; Barber et al. 2021).
    Raises BadInput for an unknown rule, if nobody took over, or if there are too few stretches without a takeover.
    """
    for name in rules:
        check_rule(name, "rules")
    check_share("false_alarms", false_alarms, "compare")
    episodes, window = recording.episodes, max(1, round(window_s * recording.fps))
    takeovers = sum(len(episode.takeovers()) for episode in episodes)
    if not takeovers:
        raise BadInput(
            "recording: no step is marked as corrected: wanted takeovers to compare with (feature 'intervention')"
        )
    if len(episodes) < 2:
        raise BadInput("recording: 1 episode: wanted two or more, since a rule is not measured where it learned")
    alone = sum(int((~episode.corrected).sum()) for episode in episodes)
    notes, done = [], []
    for name in rules:
        progress(name)
        try:
            doubts = _out_of_fold(episodes, name, window, seed)
            thresholds = _thresholds(episodes, doubts, false_alarms)
        except BadInput as error:
            notes.append(str(error))
            continue
        done.append(_measured(name, episodes, doubts, thresholds, window, recording.fps))
    if not done:
        raise BadInput(f"recording: no rule can be compared: {notes[0]}")
    return RulesCompared(recording, window_s, false_alarms, takeovers, alone / recording.fps / 60.0, done, notes)


def stretches(episode: Episode) -> list[tuple[int, int, bool]]:
    """The first step and the one after the last of each stretch of the policy's own steps, and whether it ended well.

    It did if it ended with the episode, and that is not known to have failed; not if somebody took over.
    """
    ends, found = [*episode.takeovers(), (len(episode), len(episode))], []
    start = 0
    for taken, back in ends:
        if taken > start:
            found.append((start, taken, taken == len(episode) and episode.success is not False))
        start = back
    return found


def _out_of_fold(episodes: Sequence[Episode], name: str, window: int, seed: int) -> list[Array]:
    """The doubt (n,) at each step of each episode, by what was learned from the episodes of the other folds."""
    doubts: list[Any] = [None] * len(episodes)
    folds = min(FOLDS, len(episodes))
    order = np.random.default_rng(seed)
    fold_of = order.permutation(len(episodes)) % folds
    for fold in range(folds):
        others = [episode for episode, of in zip(episodes, fold_of, strict=True) if of != fold]
        rng = np.random.default_rng([seed, fold])
        demonstrated = Demonstrated.of(others, rng, lambda episode: _shown(episode, window))
        pieces = [episode.part(*stretch) for episode in others for stretch in stretches(episode)]
        doubt = DOUBTS[name].make(demonstrated, learned_by(name, demonstrated, pieces, rng))
        for number in np.flatnonzero(fold_of == fold).tolist():
            doubts[number] = doubts_of(doubt, demonstrated, episodes[number])
    return doubts


def _shown(episode: Episode, window: int) -> Bools:
    """The steps (n,) that show what to do: not the policy's own within a window before somebody took over."""
    shown = shows_what_to_do(episode).copy()
    for taken, _ in episode.takeovers():
        before = slice(max(0, taken - window), taken)
        shown[before] &= episode.corrected[before]
    return shown


def _thresholds(episodes: Sequence[Episode], doubts: Sequence[Array], false_alarms: float) -> list[float]:
    """The threshold for each episode, by the largest doubts of the stretches of all others that ended well."""
    peaks = [
        (number, float(doubts[number][start:end].max()))
        for number, episode in enumerate(episodes)
        for start, end, well in stretches(episode)
        if well
    ]
    return [
        few_false_alarms([peak for number, peak in peaks if number != own], false_alarms).threshold
        for own in range(len(episodes))
    ]


def _measured(
    name: str,
    episodes: Sequence[Episode],
    doubts: Sequence[Array],
    thresholds: Sequence[float],
    window: int,
    fps: int,
) -> Rule:
    """The rule's alarms against the takeovers."""
    asked = [
        alarms(doubt, threshold, episode, window)
        for doubt, threshold, episode in zip(doubts, thresholds, episodes, strict=True)
    ]
    right, leads = _matched(episodes, asked, window)
    before = [_before_takeovers(episode, window) for episode in episodes]
    alone = [~episode.corrected for episode in episodes]
    steps, positives = int(sum(map(np.sum, alone))), int(sum(map(np.sum, before)))
    count = sum(map(len, asked))
    by_chance = [1.0 - (1.0 - count / steps) ** length for length in _lengths(episodes, window)] if steps else [0.0]
    flat = np.concatenate([doubt[own] for doubt, own in zip(doubts, alone, strict=True)])
    labels = np.concatenate([positive[own] for positive, own in zip(before, alone, strict=True)])
    return Rule(
        name,
        doubts,
        thresholds,
        asked,
        count,
        right,
        len(leads),
        [lead / fps for lead in leads],
        positives / steps if steps else 0.0,
        float(np.mean(by_chance)),
        _auroc(flat, labels),
        _curve(episodes, doubts, flat, window, fps),
    )


def alarms(doubts: Array, threshold: float, episode: Episode, window: int) -> list[int]:
    """The steps at which an alarm begins: the first above the threshold, and no other until a window later or a takeover ends."""
    asked: list[int] = []
    free = 0
    for step, (doubt, corrected) in enumerate(zip(doubts.tolist(), episode.corrected.tolist(), strict=True)):
        if corrected:
            free = step + 1
        elif doubt > threshold and step >= free:
            asked.append(step)
            free = step + window
    return asked


def _matched(episodes: Sequence[Episode], asked: Sequence[Sequence[int]], window: int) -> tuple[int, list[int]]:
    """How many alarms a takeover followed within the window, and the lead [steps] of the first one of each caught takeover."""
    right, leads = 0, []
    for episode, steps in zip(episodes, asked, strict=True):
        starts = [taken for taken, _ in episode.takeovers()]
        right += sum(any(0 <= start - step <= window for start in starts) for step in steps)
        for start in starts:
            early = [start - step for step in steps if 0 <= start - step <= window]
            leads += [max(early)] if early else []
    return right, leads


def _before_takeovers(episode: Episode, window: int) -> Bools:
    """The policy's own steps (n,) from which a takeover is at most a window away."""
    before = np.zeros(len(episode), bool)
    for taken, _ in episode.takeovers():
        before[max(0, taken - window) : taken] = True
    return before & ~episode.corrected


def _lengths(episodes: Sequence[Episode], window: int) -> list[int]:
    """For each takeover, how many of the policy's own steps lie within the window before it."""
    return [
        int((~episode.corrected[max(0, taken - window) : taken]).sum())
        for episode in episodes
        for taken, _ in episode.takeovers()
    ]


def _auroc(doubts: Array, labels: Bools) -> float | None:
    """The area under the ROC curve, from the rank sum; ties count half."""
    positives = int(labels.sum())
    negatives = len(labels) - positives
    if not positives or not negatives:
        return None
    ranks = scipy.stats.rankdata(doubts)
    return float((ranks[labels].sum() - positives * (positives + 1) / 2) / (positives * negatives))


def _curve(episodes: Sequence[Episode], doubts: Sequence[Array], flat: Array, window: int, fps: int) -> Array:
    """Alarms a minute and recall (c, 2) at thresholds from no alarm to many, the same for all episodes."""
    finite = flat[np.isfinite(flat)]
    takeovers, minutes = sum(len(episode.takeovers()) for episode in episodes), len(flat) / fps / 60.0
    points = [(0.0, 0.0)]
    for threshold in np.unique(np.quantile(finite, 1.0 - np.geomspace(1e-4, 1.0, CURVE)))[::-1] if len(finite) else []:
        asked = [
            alarms(doubt, float(threshold), episode, window) for doubt, episode in zip(doubts, episodes, strict=True)
        ]
        points.append((sum(map(len, asked)) / minutes, len(_matched(episodes, asked, window)[1]) / takeovers))
    return np.array(points)
