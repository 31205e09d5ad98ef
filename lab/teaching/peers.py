"""Peers: several learners at once, each of which asks the others by its own gate, answers what it knows, and judges who answered.

Peers play in rounds: each plays one episode, in order. A peer answers in a state only if it knows something there: of the actions
that lead nearer to the goal along the moves that it has made itself, it names the one with the highest value in its own table. A
peer that knows nothing says nothing, and its silence is no mislead. The answers are combined by a panel (see `lab.advice.panel`),
which drops peers whose answers mislead; the gate judges the panel as it judges any advisor.
Peers may learn different problems, such as the same sub-task with different arms: the cells of grids then match by their place
relative to the goal, and an answer counts only where the asker's arm can reach all of the peer's known path to the goal.

Sources: Tan, Proc. ICML 1993, 330-337 (cooperating learners that share episodes or policies); da Silva, Glatt and Costa, Proc.
AAMAS 2017, 1100-1108 (learners that ask and answer at once, by visit counts and budgets); thesis, section 10.2.4 iii.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from math import inf
from typing import Any

import numpy as np

from lab.advice.advisors import PEOPLE, AdvisorName
from lab.advice.panel import Panel, PanelSettings
from lab.advice.table_level import SILENT, TableLevel
from lab.advice.trust import Ways, bounds, trust
from lab.errors import BadInput
from lab.learning import splitmix
from lab.learning.environment import TableEnvironment
from lab.learning.problem import Problem
from lab.learning.requests import AdviceRequest, Advisor, Reply, Walked
from lab.learning.session import Session
from lab.learning.session_events import Event
from lab.learning.session_result import SessionResult
from lab.learning.settings import GateSettings, LearnerSettings
from lab.mdp import BoolArray, TabularMDP

FEWEST, MOST = 2, 16  # peers in a group
_SESSIONS, _PANELS, _ROLES = 1_000_001, 1_000_002, 1_000_003  # purposes of streams, see `splitmix.apart`

MakePanel = Callable[..., Panel]  # with the arguments of `Panel`


@dataclass(frozen=True)
class PeerPlan:
    """What one peer learns, and how.

    gate: decides when it asks; role: None if it answers what it has learned, otherwise the name of an advisor that answers in
    its place, such as "wrong" (see `lab.advice.advisors`); reach: (S,) bool, the states that its arm can reach, None for all.
    """

    problem: Problem
    learner: LearnerSettings
    gate: GateSettings
    role: str | None = None
    reach: BoolArray | None = None


@dataclass(frozen=True)
class PeerStanding:
    """What one peer asked another one.

    peer: the number of the other one, from 1; asked, answered: the numbers of questions and of answers; trust: the expected share
    of good answers, with its 95 % interval low to high, from the answers since it was last dropped or readmitted; dropped:
    whether it is no longer followed.
    """

    peer: int
    asked: int
    answered: int
    trust: float
    low: float
    high: float
    dropped: bool


@dataclass(frozen=True)
class PeerResult:
    """The result of one peer: its number, from 1, its problem's name and arm ("" for none), its session, moves and standings."""

    number: int
    problem: str
    arm: str
    session: SessionResult
    moves: int
    others: tuple[PeerStanding, ...]

    def to_json(self) -> dict[str, Any]:
        """A plain dict."""
        session = self.session
        return {
            "peer": self.number,
            "problem": self.problem,
            "arm": self.arm,
            "solved": session.solved,
            "final_steps": session.final_steps,
            "optimal_steps": session.optimal_steps,
            "episodes": len(session.steps),
            "moves": self.moves,
            "requests": session.requests,
            "helped_steps": session.helped_steps,
            "misleads": session.misleads,
            "rejected_at_episode": session.rejected_at_episode,
            "others": [asdict(standing) for standing in self.others],
        }


class PeerAnswers:
    """A peer as the advisor of another one; counts the questions and the answers."""

    def __init__(self, answer: Advisor):
        self._answer = answer
        self.asked = self.answered = 0

    def advise(self, request: AdviceRequest) -> Reply:
        """The peer's answer, None if it knows nothing there."""
        self.asked += 1
        action = self._answer.advise(request)
        self.answered += action is not None
        return action


class Peer:
    """A learner in a group; `follows_all` makes its session report every episode.

    number: from 1; session: its session; panel: combines and judges the others; moves: the number that it has made.
    """

    follows_all = True

    def __init__(self, number: int, plan: PeerPlan, seed: int, tell: Callable[[Event], None]):
        self.number, self.plan, self.seed = number, plan, seed
        self.moves = 0
        self.environment = plan.problem.environment or TableEnvironment(plan.problem.mdp)
        self.panel: Panel | None = None
        self.asks: dict[int, PeerAnswers] = {}  # the others, by number
        self._ways = Ways(plan.problem.mdp.n_states)
        gate = replace(plan.gate, judge_unhelped=False)  # silence is no mislead
        rng = splitmix.stream(splitmix.apart(splitmix.apart(seed, _SESSIONS), number))
        self.session = Session(self.environment, plan.learner, gate, self, rng)
        self.session.tell = tell
        if self.session.longer_is_better or self.session.highest_reward is not None:
            raise BadInput(f"peers learning '{plan.problem.name}': it has no goal to which a peer could know a path")

    def meet(self, others: "Sequence[Peer]", settings: PanelSettings, make_panel: MakePanel) -> None:
        """Makes the panel of the others."""
        self.asks = {other.number: PeerAnswers(other.answers_for(self)) for other in others}
        members = {f"peer {number}": answers for number, answers in self.asks.items()}
        draw = splitmix.stream(splitmix.apart(splitmix.apart(self.seed, _PANELS), self.number))
        states = self.plan.problem.mdp.n_states
        self.panel = make_panel(members, states, settings, draw=draw, tell=self.session.tell)

    def answers_for(self, asker: "Peer") -> Advisor:
        """The advisor that this peer is for another one. Raises BadInput for a role that needs a person or judges moves."""
        role = self.plan.role
        if role is None:
            return _Learned(self, asker)
        if AdvisorName.of(role, "role").judging is not None:
            raise BadInput(f"role '{role}' of peer {self.number}: it judges moves and names none")
        if role in PEOPLE:
            raise BadInput(
                f"role '{role}' of peer {self.number}: only advisors that are no people can answer for a peer"
            )
        learner, environment = asker.plan.learner, asker.environment
        rng = np.random.default_rng([self.seed, _ROLES, self.number, asker.number])
        level = TableLevel(environment.mdp, learner.discount, rng, {}, None, learner.episodes, environment.values)
        made = level.advisor(AdvisorName.of(role, "role"))
        return _Silent() if made is None else made

    def advise(self, request: AdviceRequest) -> int | None:
        """The answer of the others to this peer's question, combined by its panel."""
        return None if self.panel is None else self.panel.advise(request)

    def followed(self, walked: Walked) -> None:
        """Learns from an episode of this peer where moves lead, and judges the others."""
        self.moves += len(walked.trail)
        if walked.trail:
            over = bool(self.plan.problem.mdp.terminal[walked.trail[-1][2]])
            self._ways.walked(walked.trail, walked.reached, over)
        if self.panel is not None:
            self.panel.followed(walked)

    def knows(self, state: int) -> int | None:
        """Its answer in a state, None if it knows nothing there; see the module."""
        nearer = [action for action in self.session.actions if self._ways.verdict(state, action)]
        if len(nearer) < 2:
            return nearer[0] if nearer else None
        values = self.session.q[state]
        return max(nearer, key=lambda action: values[action])

    def path(self, state: int) -> Iterator[int]:
        """The states after `state` on the path to the goal that it knows; none if it knows nothing there."""
        while (action := self.knows(state)) is not None:
            state = self._ways.entered(state, action)
            yield state

    def result(self, interrupted: bool) -> PeerResult:
        """The result so far."""
        session = self.session.result(interrupted)
        standings = {} if self.panel is None else {member.name: member for member in self.panel.standing()}
        others = []
        for number, answers in self.asks.items():
            member = standings.get(f"peer {number}")  # None if it has left
            good, bad = (0, 0) if member is None else (member.good, member.bad)
            dropped = member is None or member.dropped
            judged = trust(good, bad), *bounds(good, bad), dropped
            others.append(PeerStanding(number, answers.asked, answers.answered, *judged))
        problem = self.plan.problem
        return PeerResult(self.number, problem.name, problem.arm, session, self.moves, tuple(others))


class _Silent:
    """An advisor that never answers."""

    def advise(self, request: AdviceRequest) -> int | None:
        return None


class _Learned:
    """The advisor that answers what a peer has learned, in its own problem or in another one whose states match."""

    def __init__(self, peer: Peer, asker: Peer):
        own, theirs, reach = peer.environment.mdp, asker.environment.mdp, asker.plan.reach
        self._peer = peer
        self._states = matched_states(own, theirs)
        labels = {label: action for action, label in enumerate(theirs.action_labels)}
        self._actions = [labels.get(label) for label in own.action_labels]
        self._within: list[bool] | None = (
            None  # by state of the peer: whether the asker's arm reaches the cell that matches
        )
        if reach is not None:
            self._within = [state != SILENT and bool(reach[state]) for state in matched_states(theirs, own)]

    def advise(self, request: AdviceRequest) -> int | None:
        """What the peer knows in the state that matches, None if the asker's arm cannot reach all of the path from there."""
        state = self._states[request.state]
        known = None if state == SILENT else self._peer.knows(state)
        if known is None or not self._is_feasible(state):
            return None
        return self._actions[known]

    def _is_feasible(self, state: int) -> bool:
        """Whether the asker's arm can reach the peer's known path from a state to the goal."""
        return self._within is None or all(self._within[passed] for passed in self._peer.path(state))


def matched_states(own: TabularMDP, theirs: TabularMDP) -> list[int]:
    """The state of a problem for each state of another one, SILENT where none matches.

    They are the same in the same problem. Otherwise the cells of grids match by their place relative to the first goal, and
    nothing matches where the problems are no grids or have different numbers of axes.
    """
    if own.signature == theirs.signature:
        return [*range(theirs.n_states)]
    matched = np.full(theirs.n_states, SILENT)
    if own.shape and len(own.shape) == len(theirs.shape) and not (own.coverage_shape or theirs.coverage_shape):
        goal, their_goal = (mdp.state_cell(int(mdp.goal.argmax())) for mdp in (own, theirs))
        cells = np.indices(theirs.shape).reshape(len(theirs.shape), -1).T + np.subtract(goal, their_goal)
        inside = ((cells >= 0) & (cells < own.shape)).all(axis=1)
        matched[inside] = np.ravel_multi_index(tuple(cells[inside].T), own.shape)
    states: list[int] = matched.tolist()
    return states


class PeerGroup:
    """Peers that learn at once, deterministic for a seed. With the gate "never" they learn alone, from the same random numbers.

    plans: FEWEST to MOST peers; seed: of all randomness, each peer has a stream of its own; panel: how each combines the others;
    tell: receives (number of a peer, event); make_panel: a class with the interface of `Panel`.
    Raises BadInput for a group that is too small or too large, and for a problem without a goal.
    """

    def __init__(
        self,
        plans: Sequence[PeerPlan],
        seed: int,
        *,
        panel: PanelSettings | None = None,
        tell: Callable[[int, Event], None] = lambda number, event: None,
        make_panel: MakePanel = Panel,
    ):
        check_peers(len(plans))
        self.peers = [
            Peer(number, plan, seed, lambda event, number=number: tell(number, event))  # type: ignore[misc]
            for number, plan in enumerate(plans, start=1)
        ]
        for peer in self.peers:
            others = [other for other in self.peers if other is not peer]
            peer.meet(others, panel or PanelSettings(), make_panel)

    def run(self, after_episode: Callable[[Peer], None] = lambda peer: None, most_moves: float = inf) -> "GroupResult":
        """The results after all rounds, or after Ctrl-C.

        after_episode: called with each peer after each of its episodes; most_moves: a peer that has made so many plays no more.
        """
        interrupted = False
        try:
            for episode in range(1, max(peer.plan.learner.episodes for peer in self.peers) + 1):
                for peer in self.peers:
                    if episode <= peer.plan.learner.episodes and peer.moves < most_moves:
                        peer.session.play(episode)
                        after_episode(peer)
        except KeyboardInterrupt:
            interrupted = True
        return GroupResult(tuple(peer.result(interrupted) for peer in self.peers))


@dataclass(frozen=True)
class GroupResult:
    """The results of the peers, in order."""

    peers: tuple[PeerResult, ...]

    @property
    def best(self) -> PeerResult:
        """The peer that has learned best: solved, then the fewest steps of the greedy path, then the fewest moves made."""

        def merit(peer: PeerResult) -> tuple[bool, float, int]:
            steps = peer.session.final_steps
            return not peer.session.solved, inf if steps is None else steps, peer.moves

        return min(self.peers, key=merit)


def check_peers(count: int) -> None:
    """Raises BadInput unless a group may have so many peers."""
    if not FEWEST <= count <= MOST:
        raise BadInput(f"peers {count} (--peers): allowed {FEWEST} to {MOST}")
