"""A learner's question in lines and in plain sentences: its preferences, its progress, and the standing of advice."""

from collections.abc import Iterable, Sequence

import numpy as np
from rich.text import Text

from lab.errors import counted
from lab.learning.environment import TableEnvironment
from lab.learning.requests import AdviceRequest, Request, Standing, TooSlow
from lab.learning.session_events import EpisodeEnded
from lab.learning.settings import GateSettings
from lab.mdp import TabularMDP
from lab.seat.grid_text import Marks, StateWords, TextPicture, nearest_goal, points_by_name
from lab.view.value_levels import is_map

GOAL, OBSTACLE, DEAD_END, NOWHERE = "to the goal", "into an obstacle", "to an end that is no goal", "nowhere"
ALIKE = 1e-9  # probabilities that differ by less are equal
BAR = 10  # characters of the longest bar


def percent(share: float) -> str:
    """A share in whole percent; only exact 0 and 1 look like 0 % and 100 %."""
    if 0.0 < share < 0.005:
        return "<1%"
    return ">99%" if 0.995 <= share < 1.0 else f"{share:.0%}"


def is_known(mdp: TabularMDP) -> bool:
    """Whether the outcomes of moves are known; an environment without a model has no goal in its table."""
    return bool(mdp.goal.any())


def outcome(request: AdviceRequest, action: int) -> str:
    """The outcome of an action if it is unusual: GOAL, OBSTACLE, DEAD_END or NOWHERE, else ""."""
    mdp, entered = request.mdp, int(request.mdp.successor[request.state, action])
    if not is_known(mdp):
        return ""
    if entered == request.state:
        return NOWHERE
    if mdp.goal[entered]:
        return GOAL
    end = DEAD_END if is_foreign(request) or not mdp.shape else OBSTACLE
    return end if mdp.terminal[entered] else ""


def is_foreign(request: AdviceRequest) -> bool:
    """Whether the learner acts in an environment instead of its table, which then holds only the likeliest step."""
    return request.environment is not None and not isinstance(request.environment, TableEnvironment)


def leads(request: AdviceRequest, action: int) -> str:
    """The outcome in words, such as "leads nowhere" or "most likely leads to the goal"; "" for the usual one."""
    where = outcome(request, action)
    return f"{'most likely ' if is_foreign(request) else ''}leads {where}" if where else ""


def choice(request: AdviceRequest, marks: Marks, brief: bool = False) -> str:
    """The move that the learner drew for this step, and the move that it rates best.

    brief: only an unusual outcome of the drawn move, else ""; the rest is in the list of moves.
    """
    chances, own = request.chances, request.own
    best = max(range(len(chances)), key=chances.__getitem__)
    where = leads(request, own)
    if brief:
        return f"{marks.named(request.mdp, own)} {where}." if where else ""
    does = "The learner now goes" if request.judgement == "only" else "Alone the learner would now go"
    said = f"{does} {marks.named(request.mdp, own)}"
    where = f"; that {where}" if where else ""
    if max(chances) - min(chances) < ALIKE and len(chances) > 1:
        return f"{said}, drawn at random: all moves are alike to it here ({percent(chances[own])} each){where}."
    if chances[best] - chances[own] < ALIKE:
        return f"{said}, the move it rates best ({percent(chances[own])}){where}."
    rated = f"the move it rates best is {marks.named(request.mdp, best)} ({percent(chances[best])})"
    return f"{said}, drawn at random ({percent(chances[own])}){where}; {rated}."


def moves(request: AdviceRequest, marks: Marks) -> list[Text]:
    """Each move with its probability, the learner's own choice in brackets."""
    parts = []
    for action, chance in enumerate(request.chances):
        text = f"{marks.named(request.mdp, action)} {percent(chance)}"
        own = action == request.own
        parts.append(Text(f"[{text}]" if own else text, "bold magenta" if own else ""))
    return parts


def bars(request: AdviceRequest, marks: Marks, sizes: Sequence[str] = ()) -> list[Text]:
    """A line for each move: its probability as a bar and in percent, the learner's choice marked; sizes: lengths of moves."""
    names = [marks.named(request.mdp, action) for action in range(request.mdp.n_actions)]
    names = [f"{name} {size}" for name, size in zip(names, sizes, strict=True)] if sizes else names
    widest = max(map(len, names))
    lines = []
    for action, (name, chance) in enumerate(zip(names, request.chances, strict=True)):
        own = action == request.own
        bar = _bar(chance, marks.bars)
        head = f"{marks.chosen if own else ' '} {name:{widest}}  "
        style = "bold magenta" if own else ""
        lines.append(Text.assemble((head, style), (f"{bar:{BAR}}", style or "dim"), (f" {percent(chance):>4}", style)))
    return lines


def _bar(share: float, parts: str) -> str:
    """A bar for a share; it is visible for any share above 0."""
    length = max(round(share * BAR * len(parts)), share > 0.0)
    return parts[-1] * (length // len(parts)) + (parts[length % len(parts) - 1] if length % len(parts) else "")


def progress(request: AdviceRequest, brief: bool = False) -> list[str]:
    """The reason for the question, the moving averages and the threshold; brief: the averages alone, in one line."""
    known = request.improvement
    least = request.standing.lambda_threshold
    reason = [f"It asks because {request.reason}."] if request.reason and not brief else []
    if known is None:
        return [*reason, "Too few episodes for averages." if brief else "Too few episodes so far for moving averages."]
    rate, current, previous = known.rate, known.current_mean, known.previous_mean
    if brief:
        sign = "<" if rate < least else ">="
        return [f"Steps {previous:.1f}, now {current:.1f}: {rate:+.1%} {sign} {least:.0%}"]
    if isinstance(request.reason, TooSlow):  # that is its rate and the threshold
        return [
            f"It asks because {request.reason}: lately {current:.1f} steps per episode, before that {previous:.1f}."
        ]
    means = f"lately {current:.1f}, before that {previous:.1f}; improvement {rate:+.1%}, threshold {least:.0%}"
    return [*reason, f"Steps per episode: {means}."]


def standing(request: AdviceRequest, brief: bool = False) -> str:
    """The advice used and the budget; the episodes misled and the number tolerated."""
    now = request.standing
    allowed = f" of {now.budget}" if now.budget < GateSettings.budget else ""
    said = f"{now.helped_steps}{allowed} moves" if allowed else counted(now.helped_steps, "move")
    done = "Judged" if request.judgement == "only" else "Advised"
    if brief:
        limit = "" if now.by_evidence else f" of {now.omega}" if now.omega else ", none allowed"
        return f"{done} {said}; misled {now.misleads}{limit}."
    limit = "" if now.by_evidence else f", tolerated: {now.omega}"
    return f"{done} so far: {said}; episodes misled: {now.misleads}{limit}."


# ---- axes, goal and hidden cells in words ---------------------------------------------------------------------------


def axis_name(mdp: TabularMDP, axis: int) -> str:
    """The name of the cells along an axis."""
    if axis == 2:
        return "level"
    if axis > 2:
        return " / ".join(_ways(mdp, axis))
    if len(mdp.coverage_shape or mdp.shape) == 1:
        return "cell"
    return ("x", "y")[axis] if is_map(mdp) else ("row", "column")[axis]


def _ways(mdp: TabularMDP, axis: int) -> tuple[str, str]:
    """The names of the moves down and up an axis."""
    axes = len(mdp.coverage_shape or mdp.shape)
    if points_by_name(mdp):
        return (("up", "down"), ("left", "right"))[axis + 2 - axes]
    if mdp.n_actions == 2 * axes:
        return mdp.action_labels[2 * axis], mdp.action_labels[2 * axis + 1]
    return f"-{axis_name(mdp, axis)}" if axis < 3 else "-", f"+{axis_name(mdp, axis)}" if axis < 3 else "+"


def way_to_goal(request: AdviceRequest) -> str:
    """The moves to the nearest goal, such as "8 right, 2 backward and 2 up"; "" when there is none on a grid."""
    mdp = request.mdp
    cell = mdp.state_cell(request.state)
    goal = nearest_goal(mdp, cell) if mdp.shape and not mdp.coverage_shape else None
    if goal is None:
        return ""
    away = [(axis, there - here) for axis, (here, there) in enumerate(zip(cell, goal, strict=True)) if there != here]
    parts = [f"{abs(by)} {_ways(mdp, axis)[by > 0]}" for axis, by in away]
    return _listed(parts) if parts else "here"


def _listed(parts: Sequence[str]) -> str:
    return f"{', '.join(parts[:-1])} and {parts[-1]}" if len(parts) > 1 else parts[0]


def beyond(request: AdviceRequest, picture: TextPicture, brief: bool = False) -> str:
    """What the picture does not show: cells outside it, axes that are not drawn, and the direction of a hidden goal."""
    mdp = request.mdp
    cell = mdp.state_cell(request.state)
    shown = shown_in_words(request, picture, brief)
    parts = [shown] if shown else []
    parts += [f"{axis_name(mdp, a)}: {cell[a]} {_of(mdp, a, brief)}" for a in range(3, len(mdp.shape))]
    if picture.hides_goal or len(mdp.shape) > 2:
        parts.append(f"{'' if brief else 'the '}goal {'' if brief else 'is '}{way_to_goal(request)}")
    text = "; ".join(parts)
    return f"{text[:1].upper()}{text[1:]}." if text else ""


def shown_in_words(request: AdviceRequest, picture: TextPicture, brief: bool = False) -> str:
    """The ranges of cells that the picture shows; "" when it shows all."""
    mdp = request.mdp
    said = [f"{_range(axis_name(mdp, a), low, high)} {_of(mdp, a, brief)}" for a, low, high in picture.shown]
    return f"{'' if brief else 'Shown: '}{', '.join(said)}" if said else ""


def _of(mdp: TabularMDP, axis: int, brief: bool) -> str:
    return f"of {mdp.shape[axis]}" if brief else f"of 0..{mdp.shape[axis] - 1}"


def _range(name: str, low: int, high: int) -> str:
    return f"{name} {low}" if low == high else f"{name}{'s' * (len(name) > 1)} {low}..{high}"


# ---- in plain sentences ---------------------------------------------------------------------------------------------


def sentences(request: AdviceRequest, known: StateWords | None = None) -> list[str]:
    """The content of picture and numbers as sentences, one fact per line; known: describes states in words."""
    mdp = request.mdp
    cell = mdp.state_cell(request.state)
    lines = [f"Episode {request.episode}, step {request.step}."]
    if known is not None:
        lines.append(known.in_words(request.state))
    elif cell:
        named = [f"{axis_name(mdp, axis)} {at}" for axis, at in enumerate(cell)]
        lines.append(f"The robot is at {', '.join(named)}.")
    else:
        lines.append(f"The learner is in state {mdp.state_label(request.state)}.")
    if mdp.coverage_shape and known is None:
        covered = mdp.covered(request.state)
        lines.append(f"Covered: {int(covered.sum())} of {covered.size} cells.")
    way = way_to_goal(request)
    lines += [f"The goal lies {way}."] if way else []
    sizes = [""] * mdp.n_actions if known is None else [f", {size}" for size in known.moves_in_words()]
    lines += [f"{label}{sizes[action]}: {_next(request, action)}." for action, label in enumerate(mdp.action_labels)]
    chances = [f"{mdp.action_labels[action]} {percent(chance)}" for action, chance in enumerate(request.chances)]
    lines += [choice(request, WORDS_ONLY), f"Its chances: {', '.join(chances)}."]
    return [*lines, *progress(request), standing(request)]


class _WordsOnly(Marks):
    """No arrows: a screen reader speaks the labels."""

    def named(self, mdp: TabularMDP, action: int) -> str:
        """An action by its label alone."""
        return mdp.action_labels[action]


WORDS_ONLY = _WordsOnly()


def _next(request: AdviceRequest, action: int) -> str:
    """The content of the cell to which an action leads."""
    mdp, entered = request.mdp, int(request.mdp.successor[request.state, action])
    on_grid = bool(mdp.shape or mdp.coverage_shape) and not is_foreign(request)
    if not is_known(mdp):
        return "nobody knows where it leads"
    where = outcome(request, action)
    if where == NOWHERE:
        return "border" if on_grid else leads(request, action)
    if where:
        return {GOAL: "goal", OBSTACLE: "obstacle", DEAD_END: "an end that is no goal"}[where]
    if mdp.coverage_shape:
        return "free, covered" if (mdp.covered(entered) == mdp.covered(request.state)).all() else "free, not covered"
    likely = "most likely " if is_foreign(request) else ""
    return "free" if on_grid else f"{likely}leads to {mdp.state_label(entered)}"


# ---- why it asks, and how an episode with advice is judged ----------------------------------------------------------


def reasons(request: AdviceRequest, marks: Marks, guided: int) -> list[str]:
    """The reason for the question with all its numbers, in plain words; guided: the number of episodes with advice so far."""
    mdp, now = request.mdp, request.standing
    lines = [f"It asks because {request.reason}." if request.reason else "It asks about every step."]
    known = request.improvement
    if known is not None:
        lines.append(
            f"Its last episodes took {known.current_mean:.1f} steps on average, those before them "
            f"{known.previous_mean:.1f}: an improvement of {known.rate:+.1%}; a good one is "
            f"{now.lambda_threshold:.0%} or more."
        )
    else:
        lines.append("There are too few episodes so far for moving averages.")
    values = np.asarray(request.q[request.state], float)
    worth = ", ".join(f"{marks.named(mdp, action)} {value:+.2f}" for action, value in enumerate(values))
    lines.append(f"What it thinks each move is worth here: {worth}; they span {float(np.ptp(values)):.2f}.")
    lines.append(_certainty(request, marks))
    allowed = f" of {now.budget} that it may use" if now.budget < GateSettings.budget else ""
    lines.append(f"Advice so far: {counted(now.helped_steps, 'move')}{allowed}. {_verdict(now, guided)}")
    return lines


def _certainty(request: AdviceRequest, marks: Marks) -> str:
    chances = request.chances
    best = max(range(len(chances)), key=chances.__getitem__)
    how = {"softmax": f", temperature {request.temperature:.2g}", "epsilon-greedy": f", {request.temperature:.2g}"}
    by = f"chosen by {request.selection}{how.get(request.selection, '')}"
    if max(chances) - min(chances) < ALIKE:
        return f"Left to itself it may go anywhere, {percent(chances[best])} each: {by}."
    return f"Left to itself it would most likely go {marks.named(request.mdp, best)} ({percent(chances[best])}): {by}."


def _verdict(now: Standing, guided: int) -> str:
    spent = ", or when what it may use is spent" if now.budget < GateSettings.budget else ""
    if now.by_evidence:
        said = misled(now.misleads, guided, "It") if now.misleads else "No episode with advice has misled it so far"
        return f"{said}; it asks no more when advised episodes are clearly worse than its own{spent}."
    if not now.misleads:
        return f"It tolerates {counted(now.omega, 'episode')} with advice that are no shorter than those before."
    return f"{misled(now.misleads, guided, 'It')}; the learner tolerates {now.omega}, and then asks no more{spent}."


VERDICTS = {"better": "better than before", "best": "as good as the best so far", "misled": "no better than before"}


def verdict(event: EpisodeEnded, mean_before: float | None) -> tuple[bool | None, str]:
    """Whether an episode with advice was good, and the judgement in words; mean_before: mean steps of episodes before it.

    The gate's verdict counts; without one, the mean decides. (None, "") when there is nothing to compare it with.
    """
    if mean_before is None:
        return (None, "") if not event.verdict else (event.verdict != "misled", VERDICTS[event.verdict])
    shorter = event.steps < mean_before
    good = event.verdict != "misled" if event.verdict else shorter
    if event.verdict == "best" or good != shorter:  # the mean does not show it, because other episodes began elsewhere
        return good, VERDICTS[event.verdict]
    return good, f"{'better' if good else 'no better'} than the {mean_before:.1f} before"


def misled(misleads: int, guided: int, whose: str = "Your advice") -> str:
    """A sentence such as "Your advice did not help in 3 of 4 episodes"; the total is left out if it is not known."""
    of = f"{misleads} of {counted(guided, 'episode')}" if guided >= misleads else counted(misleads, "episode")
    return f"{whose} did not help in {of}"


# ---- a path that answers several questions ------------------------------------------------------------------------------


class PathAhead:
    """A path that was typed or drawn at once; its moves answer the next questions of the episode, along the path."""

    def __init__(self, request: AdviceRequest | None = None, moves: Iterable[int] = ()) -> None:
        self.request, self.left = request, list(moves)
        self._state, self._step = (-1, 0) if request is None else (request.state, request.step)

    def goes_on(self, request: Request) -> bool:
        """Whether this question is in the state to which the path leads; without a model, whether it is the next question."""
        begun = self.request
        if not self.left or begun is None or not isinstance(request, AdviceRequest):
            return False
        if begun.mdp is not request.mdp or begun.episode != request.episode:
            return False
        return request.state == self._state if is_known(request.mdp) else request.step == self._step

    def step(self) -> int:
        """The next move."""
        assert self.request is not None
        action = self.left.pop(0)
        self._state, self._step = int(self.request.mdp.successor[self._state, action]), self._step + 1
        return action
