"""Answers in words: sentences become moves, rules that hold until they are taken back, and times without questions."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from lab.errors import BadInput
from lab.learning.requests import AdviceRequest, Request
from lab.mdp import TabularMDP
from lab.production.operation.order_words import scene_of
from lab.seat import order_text, request_text
from lab.seat.grid_text import DIRECTIONS, StateWords, direction_of, points_by_name
from lab.sequencing.search import SequenceRequest
from lab.view.value_levels import GridPlanes
from lab.words.listen import listen
from lab.words.meaning import ALL, Allow, Avoid, Before, Finish, Go, Intent, Move, Never, Quiet, Refusal, Work, rule_of
from lab.words.said import called, in_words
from lab.words.scene import AllowedMove, OrderScene, Scene
from lab.words.scene_map import SceneMap, obstacles_of
from lab.words.ways import Before as DoneBefore
from lab.words.ways import Motion, NoWay, way

Rule = Avoid | Finish | Never | Before
STUCK_VISITS = 3  # questions in one state and episode, from which on the learner counts as stuck
PLAIN_NAMES = {"lower": "down", "higher": "up"}  # names of moves in and out of a machine


@dataclass(frozen=True)
class Kept:
    """An answer that what was said before gives to a question; None leaves the step to the learner. why: in one line."""

    action: int | None
    why: str = ""


@dataclass
class _Silence:
    """A time without questions: what was said, and where it began."""

    said: Quiet
    episode: int
    left: int
    seen: dict[int, int] = field(default_factory=dict)  # state -> questions in it in this episode


class SpokenAnswers:
    """What a person has said in sentences: understands them, and answers questions by what holds.

    about: describes the lesson's states in words, see `StateWords`; it names the obstacles as well if it can.
    """

    def __init__(self) -> None:
        self.about: StateWords | None = None
        self._rules: list[tuple[Rule, str]] = []  # with the signature of the problem, "" for any
        self._silence: _Silence | None = None
        self._map: tuple[TabularMDP, StateWords | None, SceneMap] | None = None
        self._given: dict[tuple[str, int], tuple[int, ...]] = {}  # problem and state -> the moves last given there
        self._last: tuple[Request, tuple[int, ...]] | None = None  # the last answer

    # ---- what a sentence means

    def heard(self, line: str, request: Request) -> list[Intent] | Refusal:
        """The meaning of a sentence, or its refusal; in a single word no typing error is corrected."""
        return listen(line, self.scene(request), corrects=len(line.split()) > 1)

    def in_words(self, intents: Sequence[Intent], request: Request) -> str:
        """What was understood, as a sentence."""
        return in_words(intents, self.scene(request))

    def scene(self, request: Request) -> Scene:
        """The scene that a question is about."""
        if isinstance(request, AdviceRequest):
            return self.map(request).scene(request.state)
        assert isinstance(request, SequenceRequest)
        return order_scene(request)

    def map(self, request: AdviceRequest) -> SceneMap:
        """The map of a request's problem, made once."""
        if self._map is None or self._map[0] is not request.mdp or self._map[1] is not self.about:
            self._map = (request.mdp, self.about, map_of(request.mdp, self.about))
        return self._map[2]

    def moves(self, intents: Sequence[Intent], request: AdviceRequest) -> tuple[int, ...]:
        """The moves for the motions among intents, () for none. Raises NoWay."""
        motions = [intent for intent in intents if isinstance(intent, Motion)]
        if not motions:
            return ()
        known = self.map(request)
        if not request_text.is_known(request.mdp):
            return _blind(motions, known)
        new = (known.near(intent.thing) for intent in intents if isinstance(intent, Avoid))
        avoided = self._avoided(request).union(*new)
        return way(motions, known, request.state, self._done_before(request), avoided)

    def _done_before(self, request: AdviceRequest) -> DoneBefore:
        """What "the other way" is against, and what "the same" repeats."""
        last = self._last
        given = self._given.get((request.mdp.signature, request.state), ())
        if last is None or not isinstance(last[0], AdviceRequest) or last[0].mdp is not request.mdp:
            return DoneBefore(request.own, given)
        follows = last[0].episode == request.episode and last[0].step == request.step - 1
        return DoneBefore(last[1][-1] if follows else request.own, given or last[1])

    def gave(self, request: Request, moves: tuple[int, ...]) -> None:
        """Remembers an answer, for "the same again" and "the other way"."""
        self._last = (request, moves)
        if isinstance(request, AdviceRequest):
            self._given[request.mdp.signature, request.state] = moves

    # ---- what holds

    def hold(self, intent: Intent, request: Request) -> str:
        """Holds a rule, takes rules back, or begins a time without questions; returns a refusal of one line, "" for none."""
        match intent:
            case Avoid() | Finish() | Never() | Before():
                signature = ""
                if isinstance(request, AdviceRequest) and intent.__class__ is Avoid and intent.thing.startswith("cube"):
                    signature = request.mdp.signature
                if (refusal := self._against(intent, request)) != "":
                    return refusal
                if (intent, signature) not in self._rules:
                    self._rules.append((intent, signature))
            case Allow(id_):
                if id_ == ALL:
                    self._rules.clear()
                self._rules = [
                    rule for rule in self._rules if not (isinstance(rule[0], Avoid) and rule[0].thing == id_)
                ]
            case Quiet(until):
                self._silence = _Silence(intent, request.episode, until if isinstance(until, int) else 0)
        return ""

    def held(self) -> tuple[dict[str, Any], ...]:
        """What holds, as records for a journal: {"rule": its JSON form, "problem": a signature}, or {"quiet": ...}."""
        rules = tuple({"rule": rule.as_json(), "problem": signature} for rule, signature in self._rules)
        quiet = self._silence
        if quiet is None:
            return rules
        until = quiet.left if isinstance(quiet.said.until, int) else quiet.said.until
        return (*rules, {"quiet": until, "episode": quiet.episode})

    def hold_again(self, records: Sequence[Mapping[str, Any]], where: str = "the journal") -> None:
        """Hold what a journal has recorded, and nothing else. Raises BadInput for other records."""
        self._rules, self._silence = [], None
        try:
            for record in records:
                if "quiet" in record:
                    said = rule_of({"quiet": record["quiet"]})
                    assert isinstance(said, Quiet)
                    self._silence = _Silence(said, record["episode"], said.until if isinstance(said.until, int) else 0)
                    continue
                rule = rule_of(record["rule"])
                if isinstance(rule, Quiet):
                    raise ValueError(f"{record!r}: no rule")
                self._rules.append((rule, str(record["problem"])))
        except (KeyError, ValueError) as error:
            raise BadInput(f"{where}: what was said and holds: {error}: it was edited") from None

    def _against(self, rule: Rule, request: Request) -> str:
        """Why a rule cannot be kept, "" if it can."""
        if isinstance(request, AdviceRequest) and isinstance(rule, Avoid):
            known = self.map(request)
            goals = {int(state) for state in np.flatnonzero(request.mdp.goal)}
            if rule.thing == "goal":
                return "keep away from the goal: then it would never arrive"
            if goals and goals <= known.near(rule.thing):
                return f"keep away from {called(known.scene(request.state), rule.thing)}: the goal itself is next to it"
        if isinstance(request, SequenceRequest) and not kept_moves(request, [*self._held(request), rule]):
            return f"{in_words([rule], order_scene(request))}: none of the moves allowed now keeps that"
        return ""

    def _held(self, request: Request) -> list[Rule]:
        """The rules that are about a question's problem."""
        if isinstance(request, SequenceRequest):
            return [rule for rule, _ in self._rules if not isinstance(rule, Avoid)]
        assert isinstance(request, AdviceRequest)
        here = [
            rule
            for rule, signature in self._rules
            if signature in ("", request.mdp.signature) and isinstance(rule, Avoid)
        ]
        return [rule for rule in here if here and rule.thing in self.map(request).spots_of]

    def standing(self, request: Request) -> list[str]:
        """The rules that hold for a question, in words."""
        return [in_words([rule], self.scene(request)) for rule in self._held(request)] if self._rules else []

    def _avoided(self, request: AdviceRequest) -> frozenset[int]:
        known = self.map(request)
        rules = [rule for rule in self._held(request) if isinstance(rule, Avoid)]
        return frozenset().union(*(known.near(rule.thing) for rule in rules))

    def kept(self, request: Request) -> Kept | None:
        """The answer that what holds gives to a question, None if the person is to be asked."""
        if self._rules and (by_rule := self._by_rule(request)) is not None:
            return by_rule
        return self._by_silence(request)

    def _by_rule(self, request: Request) -> Kept | None:
        if isinstance(request, SequenceRequest):
            return self._order_by_rule(request)
        assert isinstance(request, AdviceRequest)
        avoided = self._avoided(request)
        mdp, state = request.mdp, request.state
        if not avoided or state in avoided or int(mdp.successor[state, request.own]) not in avoided:
            return None
        entered = [int(mdp.successor[state, action]) for action in request.allowed]
        good = [
            action
            for action, there in zip(request.allowed, entered, strict=True)
            if there != state and there not in avoided and not (mdp.terminal[there] and not mdp.goal[there])
        ]
        if not good:
            return None
        best = max(good, key=lambda action: (request.q[state][action], -action))
        rules = ", ".join(self.standing(request))
        return Kept(
            best, f"By your rule ({rules}): {mdp.action_labels[best]} instead of {mdp.action_labels[request.own]}."
        )

    def _order_by_rule(self, request: SequenceRequest) -> Kept | None:
        rules = self._held(request)
        good = kept_moves(request, rules)
        if not good or len(good) == len(request.allowed):
            return None
        best = (
            request.own if request.own in good else min(good, key=lambda n: (order_text.move_of(request, n).wait_s, n))
        )
        return Kept(best, f"By your rule ({', '.join(self.standing(request))}): move {best}.")

    def _by_silence(self, request: Request) -> Kept | None:
        quiet = self._silence
        if quiet is None:
            return None
        match quiet.said.until:
            case "always":
                return Kept(None, "always")
            case "episode":
                if request.episode == quiet.episode:
                    return Kept(None)
            case "stuck":
                if request.episode != quiet.episode:
                    quiet.episode, quiet.seen = request.episode, {}
                quiet.seen[request.state] = quiet.seen.get(request.state, 0) + 1
                if quiet.seen[request.state] < STUCK_VISITS:
                    return Kept(None)
            case _:
                if quiet.left > 0:
                    quiet.left -= 1
                    return Kept(None)
        self._silence = None
        return None


def _blind(motions: Sequence[Intent], known: SceneMap) -> tuple[int, ...]:
    """The moves of steps in a problem whose outcomes nobody knows. Raises NoWay for all other motions."""
    legs = [leg for motion in motions if isinstance(motion, Go) for leg in motion.legs]
    if any(leg.steps is None for leg in legs) or not all(isinstance(motion, Go) for motion in motions):
        raise NoWay("nobody knows where moves lead here: say numbers of steps")
    return tuple(known.actions.index(leg.direction) for leg in legs for _ in range(leg.steps or 0))


# ---- scenes of requests ----------------------------------------------------------------------------------------------------


def map_of(mdp: TabularMDP, about: StateWords | None = None) -> SceneMap:
    """The map of a problem: its actions as the picture shows them, its obstacles and its goal by their names."""
    planes = GridPlanes(mdp)
    has_grid = bool(mdp.shape or mdp.coverage_shape)
    names = [PLAIN_NAMES.get(label.lower(), label.lower()) for label in mdp.action_labels]
    if has_grid and not points_by_name(mdp) and not {"left", "right"} <= set(names):
        shown = [direction_of(mdp, action) for action in range(mdp.n_actions)]
        names = [name if way is None else DIRECTIONS[way] for name, way in zip(names, shown, strict=True)]
    aim = getattr(about, "way_in_words", lambda: ("", ""))()[1].removeprefix("the ")
    goal = ("goal", "slot", aim, aim.removeprefix("slot of the ")) if aim.startswith("slot of ") else ("goal",)
    obstacles = obstacles_of(mdp, getattr(about, "blocking", None)) if mdp.shape else ()
    return SceneMap(
        mdp,
        tuple(names),
        planes.place if has_grid else lambda cell: (0, 0),
        obstacles,
        tuple(name for name in goal if all(name not in thing.names for thing in obstacles)),
        _cell_cm(about),
    )


def _cell_cm(about: StateWords | None) -> float | None:
    """The size of a cell along the first axes [cm], None if it is unknown or differs."""
    steps = getattr(about, "cell_steps", None)
    sizes = (
        {round(100.0 * step, 3) for step in steps()[:2]}
        if steps is not None and getattr(about, "moves_arm", False)
        else set()
    )
    return sizes.pop() if len(sizes) == 1 else None


def order_scene(request: SequenceRequest) -> OrderScene:
    """The parts, stations and allowed moves of a question on the order, with spaces for underscores."""
    return scene_of(request.run, request.allowed)


def _plain(name: str) -> str:
    return name.replace("_", " ").lower()


def kept_moves(request: SequenceRequest, rules: Sequence[Rule]) -> list[int]:
    """The allowed decisions that keep all rules, ascending."""
    moves = list(order_scene(request).moves)
    for rule in rules:
        match rule:
            case Finish(part):
                moves = [move for move in moves if move.part == part] or moves
            case Never(part, station):
                out = [
                    move
                    for move in moves
                    if move.origin == station and part in (None, move.part) and _is_out(request, move)
                ]
                moves = out or moves
            case Before(first, second):
                if _is_pending(request, first):
                    moves = [move for move in moves if not _is_work(move, second)]
    return sorted(move.number for move in moves)


def _is_out(request: SequenceRequest, move: AllowedMove) -> bool:
    """Whether a part that waits has been in work: it has left the station at which it began."""
    part = {_plain(request.run.cell.part_name(n)): n for n in range(1, request.run.cell.parts + 1)}[move.part]
    return request.run.locations[part - 1] != request.run.cell.starts[part - 1]


def _is_work(move: AllowedMove, work: Work) -> bool:
    return work.part in (None, move.part) and work.station in (None, move.target)


def _is_pending(request: SequenceRequest, work: Work) -> bool:
    """Whether work is still to be done: a part that is not finished, or a move to the station that is allowed now."""
    cell, run = request.run.cell, request.run
    if work.part is not None and work.station is None:
        parts = [n for n in range(1, cell.parts + 1) if _plain(cell.part_name(n)) == work.part]
        return any(run.finished_s[n - 1] is None for n in parts)
    return any(_is_work(move, work) for move in order_scene(request).moves)


def decision_of(intents: Sequence[Intent]) -> int | None:
    """The move that intents name, None for none."""
    return next((intent.number for intent in intents if isinstance(intent, Move)), None)
