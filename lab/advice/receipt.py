"""The receipt for advice: what it was worth, counted from a session's journal (thesis section 10.2.2)."""

import json
import textwrap
from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

from lab.advice.advisors import MODEL, shown_name
from lab.advice.entries import Answer, Entry, Praise
from lab.advice.trust import Difference, Pair, SkillEstimate, differences, skill_of, worse
from lab.errors import counted
from lab.learning.session_events import (
    AdviceEnded,
    AdviceGiven,
    AdviceRejected,
    AdviceRemembered,
    AdviceRequested,
    AdvisorDropped,
    AdvisorReadmitted,
    AdvisorsDisagreed,
    EpisodeEnded,
    MoveJudged,
)
from lab.learning.settings import GateSettings
from lab.mdp import FloatArray, TabularMDP

Values = FloatArray | None

WIDTH = 80
LISTED = 8  # states in which something else was better
SILENT, OVERRULED, UNHEARD = "nothing was said", "another advisor was followed", "dropped, asked only to be judged"


@dataclass(frozen=True)
class Voice:
    """The count for one of several advisors.

    whole: whether all of its answers are in the journal, as those of people are; of other advisors the journal has only disputed
    answers, from which no skill can be estimated. said: answers, the sum of followed, overruled and unheard.
    against_best: answers that were not the best, None if the optimal values are unknown.
    """

    name: str
    whole: bool
    said: int
    followed: int
    overruled: int
    unheard: int
    against_best: int | None
    skill: SkillEstimate | None


@dataclass(frozen=True)
class Judgements:
    """The count of judgements.

    praised, blamed: their numbers; single: those of one move; against_best: of the single ones those that praise a move that was
    not the best or blame a best one, None if the optimal values are unknown.
    """

    praised: int
    blamed: int
    single: int
    against_best: int | None


@dataclass(frozen=True)
class Receipt:
    """What the advice of a session was worth.

    requests: episodes in which the learner asked; questions: steps about which it asked; taken: advised steps carried out.
    refused: by reason, questions without an answer and answers that were not carried out.
    remembered: steps practised from memory, without asking.
    helped_steps, episodes, guided: counted over finished episodes; guided ones have an advised step.
    better: guided episodes that the gate judged better or, without its judgement, with fewer steps than the mean of the K before;
    best: further ones that were as good as the best so far.
    mean_before, mean_after: the mean steps of the K episodes before the first guided one and after the last, None if there are
    none; change_percent: from the one to the other.
    agreed: taken steps that were also the learner's own choice; into_walls: taken steps that did not change the state;
    into_obstacles: taken steps that ended the episode without reaching the goal; sent_back: states in which advice led back to a
    state asked about before in the episode.
    against_best: taken steps that were not the best; differences: the LISTED most frequent of them; None and () if the optimal
    values are unknown. skill: estimated from the taken steps; voices: by advisor, if there are several.
    score: what the means are of, "steps", or "shortfall of the return" without a goal.
    judged: the count of judgements, None if there were none; then it is not in the JSON document.
    notices: rejections and the like; hints: for better advice next time; yours: whether people gave all of the advice.
    """

    requests: int
    questions: int
    taken: int
    refused: dict[str, int]
    remembered: int
    helped_steps: int
    episodes: int
    guided: int
    better: int
    best: int
    mean_before: float | None
    mean_after: float | None
    change_percent: float | None
    agreed: int
    into_walls: int
    into_obstacles: int
    sent_back: int
    against_best: int | None
    differences: tuple[Difference, ...]
    skill: SkillEstimate | None
    voices: tuple[Voice, ...]
    notices: tuple[str, ...]
    yours: bool = False
    hints: tuple[str, ...] = ()
    score: str = "steps"
    judged: Judgements | None = None

    def to_json(self) -> dict[str, Any]:
        """The receipt as JSON values."""
        document: dict[str, Any] = json.loads(json.dumps(asdict(self), allow_nan=False))
        if self.judged is None:
            del document["judged"]
        return document

    def lines(self) -> list[str]:
        """The receipt as lines of plain text, at most WIDTH characters wide."""
        plain = ("".join(letter if letter.isprintable() else "?" for letter in line) for line in _lines(self))
        return [part for line in plain for part in textwrap.wrap(line, WIDTH, subsequent_indent="    ")]


@dataclass(frozen=True)
class _Question:
    """A question with all answers by advisor; heard: the advisors that counted if they disagreed."""

    given: AdviceGiven
    said: dict[str, int]
    heard: frozenset[str]


def receipt(
    entries: Sequence[Entry],
    mdp: TabularMDP | None,
    values: Values,
    window: int = GateSettings.window,
    *,
    certain: bool = True,
) -> Receipt:
    """The receipt for the entries of a journal that count.

    mdp: None for advice on the order, whose steps are costs; values: (S, A), the optimal ones, None if unknown; window: K of the
    moving averages; certain: whether the table's steps are deterministic, so that walls, obstacles and loops are the advisor's
    responsibility. Entries with states or actions that the problem does not have count as answers only.
    """
    questions = list(_questions(entries))
    taken = [
        (question.given.state, question.given.action) for question in questions if question.given.action is not None
    ]
    there = _existing(taken, mdp)
    led = [int(mdp.successor[pair]) for pair in there] if certain and mdp else []
    voices = _voices(questions, {entry.by for entry in entries if isinstance(entry, Answer)}, mdp, values)
    wrong = None if values is None else worse(there, values)
    by_return = mdp is not None and any(isinstance(e, EpisodeEnded) and isinstance(e.steps, float) for e in entries)
    counted = Receipt(
        score="shortfall of the return" if by_return else "steps",
        requests=sum(isinstance(entry, AdviceRequested) for entry in entries),
        questions=len(questions) + _judged_only(entries),
        taken=len(taken),
        refused=_refused(questions, voices),
        remembered=sum(entry.steps for entry in entries if isinstance(entry, AdviceRemembered)),
        agreed=sum(question.given.action == question.given.own for question in questions),
        into_walls=sum(entered == state for (state, _), entered in zip(there, led, strict=False)),
        into_obstacles=sum(bool(mdp.terminal[entered] and not mdp.goal[entered]) for entered in led) if mdp else 0,
        sent_back=len(_sent_back(questions, mdp)) if certain and mdp else 0,
        against_best=None if wrong is None else sum(wrong.values()),
        differences=() if wrong is None or values is None or mdp is None else differences(wrong, mdp, values, LISTED),
        skill=None if values is None else skill_of(there, values),
        voices=voices if len(voices) > 1 else (),
        notices=tuple(_notices(entries)),
        yours=_is_yours(entries) and all(voice.whole for voice in voices),
        judged=_judgements(entries, mdp, values),
        **_episodes([entry for entry in entries if isinstance(entry, EpisodeEnded)], window),
    )
    return replace(counted, hints=tuple(_hints(counted, entries, window)))


def _is_yours(entries: Sequence[Entry]) -> bool:
    """Whether people were asked, and no language model."""
    said_by = {entry.by for entry in entries if isinstance(entry, Answer | Praise)}
    return bool(said_by) and not any(name.startswith(MODEL) for name in said_by)


def _judgements(entries: Iterable[Entry], mdp: TabularMDP | None, values: Values) -> Judgements | None:
    said = [entry for entry in entries if isinstance(entry, MoveJudged)]
    if not said:
        return None
    praised, blamed = sum(one.value > 0 for one in said), sum(one.value < 0 for one in said)
    single = [one for one in said if one.moves == 1 and _existing([(one.state, one.action)], mdp)]
    against = None
    if values is not None:
        against = sum((one.value > 0) == bool(worse([(one.state, one.action)], values)) for one in single)
    return Judgements(praised, blamed, len(single), against)


def _judged_only(entries: Iterable[Entry]) -> int:
    """The number of questions that were answered with a judgement and nothing else."""
    told = [entry for entry in entries if isinstance(entry, MoveJudged | AdviceGiven | EpisodeEnded)]
    asked = [(entry.episode, 0 if isinstance(entry, EpisodeEnded) else entry.step) for entry in told]
    followed = zip(told, asked, [*asked, None][1:], strict=True)
    return sum(isinstance(entry, MoveJudged) and step != after for entry, step, after in followed)


def _questions(entries: Iterable[Entry]) -> Iterator[_Question]:
    """The questions, each with all recorded answers."""
    said: dict[str, int] = {}
    heard: frozenset[str] = frozenset()
    for entry in entries:
        if isinstance(entry, Answer) and entry.action is not None:
            said[entry.by] = entry.action
        elif isinstance(entry, AdvisorsDisagreed):
            said |= dict(entry.said)
            heard = frozenset(name for name, _ in entry.said)
        elif isinstance(entry, AdviceGiven | EpisodeEnded):
            if isinstance(entry, AdviceGiven):
                yield _Question(entry, said, heard)
            said, heard = {}, frozenset()


def _existing(pairs: Iterable[Pair], mdp: TabularMDP | None) -> list[Pair]:
    """The (state, action) pairs that exist in the problem."""
    return [] if mdp is None else [(s, a) for s, a in pairs if 0 <= s < mdp.n_states and 0 <= a < mdp.n_actions]


def _voices(
    of: Sequence[_Question], people: Collection[str], mdp: TabularMDP | None, values: Values
) -> tuple[Voice, ...]:
    voices = []
    for name in dict.fromkeys(name for question in of for name in question.said):
        own = [question for question in of if name in question.said]
        followed = sum(question.said[name] == question.given.action for question in own)
        overruled = sum(question.said[name] != question.given.action and name in question.heard for question in own)
        answers = _existing([(question.given.state, question.said[name]) for question in own], mdp)
        against = None if values is None else sum(worse(answers, values).values())
        skill = skill_of(answers, values) if values is not None and name in people else None
        unheard = len(own) - followed - overruled
        voices.append(Voice(name, name in people, len(own), followed, overruled, unheard, against, skill))
    return tuple(voices)


def _refused(questions: Sequence[_Question], voices: Sequence[Voice]) -> dict[str, int]:
    counts = {
        SILENT: sum(question.given.action is None for question in questions),
        OVERRULED: sum(voice.overruled for voice in voices),
        UNHEARD: sum(voice.unheard for voice in voices),
    }
    return {reason: count for reason, count in counts.items() if count}


def _sent_back(questions: Iterable[_Question], mdp: TabularMDP) -> set[int]:
    """The states from which advice led back to a state that was asked about before in the same episode."""
    sent_from: set[int] = set()
    seen: set[int] = set()
    episode, last = None, 0
    for given in (question.given for question in questions):
        if given.episode != episode or given.step <= last:
            seen.clear()
        episode, last = given.episode, given.step
        for state, action in _existing([] if given.action is None else [(given.state, given.action)], mdp):
            entered = int(mdp.successor[state, action])
            if entered in seen and entered != state:
                sent_from.add(state)
        seen.add(given.state)
    return sent_from


def _mean(episodes: Sequence[EpisodeEnded]) -> float | None:
    return sum(episode.steps for episode in episodes) / len(episodes) if episodes else None


def _judged(ended: Sequence[EpisodeEnded], window: int) -> list[bool]:
    """For each guided episode, whether it was good: better than the mean of the K before it, or as good as the best."""
    means = [_mean(ended[max(0, n - window) : n]) for n in range(len(ended))]
    return [
        episode.verdict != "misled" if episode.verdict else mean is not None and episode.steps < mean
        for episode, mean in zip(ended, means, strict=True)
        if episode.guided
    ]


def _episodes(ended: Sequence[EpisodeEnded], window: int) -> dict[str, Any]:
    guided = [n for n, episode in enumerate(ended) if episode.guided]
    best = sum(ended[n].verdict == "best" for n in guided)
    before = _mean(ended[max(0, guided[0] - window) : guided[0]]) if guided else None
    after = _mean(ended[guided[-1] + 1 : guided[-1] + 1 + window]) if guided else None
    return {
        "helped_steps": sum(episode.helped_steps for episode in ended),
        "episodes": len(ended),
        "guided": len(guided),
        "better": sum(_judged(ended, window)) - best,
        "best": best,
        "mean_before": before,
        "mean_after": after,
        "change_percent": 100.0 * (after / before - 1.0) if before and after is not None else None,
    }


def _notices(entries: Sequence[Entry]) -> Iterator[str]:
    """Rejections, the end of advice, and dropped or readmitted advisors, in words."""
    for n, entry in enumerate(entries):
        if isinstance(entry, AdviceRejected):
            left = sum(isinstance(later, EpisodeEnded) for later in entries[n:])
            why = f"{counted(entry.misleads, 'episode')} no better than before, {entry.omega} tolerated"
            if entry.misleads <= entry.omega:  # `GateSettings.by_evidence`
                why = f"{counted(entry.misleads, 'episode')} much longer than its own"
            yield f"episode {entry.episode}: advice rejected ({why}); alone for the {counted(left, 'episode')} after it"
        elif isinstance(entry, AdviceEnded):
            yield f"episode {entry.episode}: no more advice: {entry.reason}"
        elif isinstance(entry, Answer) and entry.left and entry.by.startswith(MODEL):
            yield f"episode {entry.episode}: {entry.by} left: {entry.why}"
        elif isinstance(entry, AdvisorDropped | AdvisorReadmitted):
            what = "dropped" if isinstance(entry, AdvisorDropped) else "heard again"
            yield f"episode {entry.episode}: {shown_name(entry.advisor)} {what}: {entry.why}"


def _hints(of: Receipt, entries: Sequence[Entry], window: int) -> Iterator[str]:
    """Suggestions for better advice, each based on a count."""
    ended = [entry for entry in entries if isinstance(entry, EpisodeEnded)]
    if not of.taken:
        if of.questions and of.judged is None:
            yield f"it asked about {counted(of.questions, 'step')} and was never advised: an answer would show it a path at once"
        return
    if 2 * of.agreed > of.taken:
        help_was = f"{of.agreed} of {counted(of.taken, 'step')}, was what it would have done by itself"
        yield f"most of {'your help' if of.yours else 'the advice'}, {help_was}: help elsewhere"
    if of.sent_back:
        whose = "your" if of.yours else "the"
        yield f"in {counted(of.sent_back, 'state')} {whose} advice sent it back to where it had been in that episode"
    for steps, what in ((of.into_walls, "against a wall"), (of.into_obstacles, "into an obstacle")):
        if steps:
            yield f"{counted(steps, 'step' if of.yours else 'advised step')}{' of yours' * of.yours} went {what}"
    if of.against_best is not None and 4 * of.against_best > of.taken:
        yield f"in {of.against_best} of {counted(of.taken, 'step')} another action was better: see the list"
    if 2 * of.refused.get(SILENT, 0) > of.questions:
        left = f"{of.refused[SILENT]} of {counted(of.questions, 'question')}"
        yield (f"you left {left} to it" if of.yours else f"{left} had no answer") + ": answer more of them"
    first = next((episode.episode for episode in ended if episode.guided), 0)
    late = sum(isinstance(entry, AdviceRequested) and entry.episode < first for entry in entries)
    if late:
        who = "you helped" if of.yours else "it was helped"
        yield f"earlier: it had asked in {counted(late, 'episode')} before {who} for the first time"
    judged = _judged(ended, window)
    half = len(judged) // 2
    if half >= 2 and 2 * sum(judged[-half:]) < sum(judged[:half]):
        early, later = sum(judged[:half]), sum(judged[-half:])
        yield f"shorter: {early} of the first {half} guided episodes were better than before, {later} of the last {half}"


def _lines(of: Receipt) -> Iterator[str]:
    if not of.requests and not of.questions:
        yield "advice: it asked nobody"
    else:
        about = f" about {counted(of.questions, 'step')}" if of.questions else ", but about no step"
        helped = f"; {of.taken} of them with {'your help' if of.yours else 'advice'}" if of.questions else ""
        helped = helped if of.taken or of.judged is None else ""
        yield f"advice: it asked in {counted(of.requests, 'episode')}{about}{helped}"
    if of.judged is not None:
        wrong, single = of.judged.against_best, of.judged.single
        against = f"; {wrong} of {single} against what was best" if wrong is not None and single else ""
        good, bad = counted(of.judged.praised, "time"), counted(of.judged.blamed, "time")
        yield f"  judged: {good} good, {bad} bad{against}"
    if of.refused:
        yield "  not followed: " + ", ".join(f"{count} ({reason})" for reason, count in of.refused.items())
    if of.guided:
        guided = f"{counted(of.guided, 'guided episode')}, {of.better} of them better than before"
        guided += f", {of.best} as good as the best" if of.best else ""
        yield f"  {counted(of.helped_steps, 'helped step')} in {guided}"
    if of.remembered:
        yield f"  {counted(of.remembered, 'step')} more from memory, without asking"
    if of.change_percent is not None:
        yield (
            f"  mean {of.score} {of.mean_before:.1f} before the first of them, {of.mean_after:.1f} after the last "
            f"({of.change_percent:+.0f} %; what it learned by itself is in it)"
        )
    if of.taken:
        yield f"  {of.agreed} of {of.taken} {'was' if of.taken == 1 else 'were'} its own choice, too"
    if of.skill is not None:
        yield f"  skill {of.skill}"
    if of.against_best:
        yield f"  another action was better in {counted(of.against_best, 'step')}:"
        for difference in of.differences:
            yield f"    {difference.label}: said {difference.said}, best {' or '.join(difference.best)} ({difference.times} x)"
    for voice in of.voices:
        against = "" if voice.against_best is None else f", {counted(voice.against_best, 'time')} not the best"
        skill = "" if voice.skill is None else f"; skill {voice.skill}"
        record = "answer" if voice.whole else "disputed answer"
        yield f"  {shown_name(voice.name)}: {counted(voice.said, record)}, {voice.followed} followed{against}{skill}"
    yield from (f"  {notice}" for notice in of.notices)
    yield from (f"  next time: {hint}" for hint in of.hints)
