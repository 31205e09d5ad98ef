"""Panels of advisors: who is asked, how their votes are combined, who is dropped (thesis section 10.2.4 iii)."""

from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import chain, count
from math import fsum, log

from lab.advice.trust import Pair, Trail, Ways, bounds, circles, is_bad, is_good, trust, trust_there
from lab.errors import BadInput, unknown
from lab.learning.praise import Judgement
from lab.learning.requests import AdviceRequest, Advisor, AdvisorLeft, Walked
from lab.learning.selection import Draw
from lab.learning.session_events import AdvisorDropped, AdvisorReadmitted, AdvisorsDisagreed, Event
from lab.mdp import BoolArray

PROBED = 0.1  # the share of the questions that a dropped advisor is still asked
ASKED = ("together", "in-turn")


def majority(trusts: Sequence[float], chance: float) -> float:
    """The number of advisors that vote for an action."""
    return float(len(trusts))


def best_trusted(trusts: Sequence[float], chance: float) -> float:
    """The trust in the most trusted of the advisors that vote for an action."""
    return max(trusts)


def trust_weighted(trusts: Sequence[float], chance: float) -> float:
    """The sum of the log odds of the advisors that vote for an action, relative to chance; trust below chance counts against it.

    Source: Nitzan and Paroush, Int. Econ. Rev. 23 (1982), 289-297, for two choices; with more choices, a voter that is right in
    fewer than half of the cases is still informative if guessing would be right in fewer.
    """
    return fsum(
        log(trust_in_voter / (1.0 - trust_in_voter)) - log(chance / (1.0 - chance)) for trust_in_voter in trusts
    )


# An action's score, from the trust in each advisor that votes for it and the probability that guessing is right.
Decide = Callable[[Sequence[float], float], float]
DECISIONS: dict[str, Decide] = {"majority": majority, "best-trusted": best_trusted, "trust-weighted": trust_weighted}


def decided(votes: Mapping[str, int], trusts: Mapping[str, float], own: int, decide: Decide, among: int = 2) -> int:
    """The action with the highest score; ties: the most trusted vote, then the learner's own, then the lowest index.

    votes: action by advisor; trusts: by advisor; own: the learner's action; among: the number of allowed actions.
    """
    by_action: dict[int, list[float]] = {}
    for name, action in votes.items():
        by_action.setdefault(action, []).append(trusts[name])
    chance = 1.0 / max(2, among)
    return max(
        by_action,
        key=lambda action: (decide(by_action[action], chance), max(by_action[action]), action == own, -action),
    )


@dataclass(frozen=True)
class PanelSettings:
    """How a panel works: asked "together" or "in-turn"; decide: a key of DECISIONS. Raises BadInput for other values."""

    asked: str = "together"
    decide: str = "trust-weighted"

    def __post_init__(self) -> None:
        if self.asked not in ASKED:
            raise unknown("order of asking", self.asked, ASKED, "--ask")
        if self.decide not in DECISIONS:
            raise unknown("rule of deciding", self.decide, DECISIONS, "--decide")


@dataclass(frozen=True)
class MemberStanding:
    """The standing of an advisor: its trust (expected share of good advice) with the 95 % interval, and its judged answers."""

    name: str
    trust: float
    low: float
    high: float
    dropped: bool
    good: int
    bad: int


class _Member:
    """An advisor with its answers since it joined, or was last dropped or readmitted."""

    def __init__(self, advisor: Advisor):
        self.advisor = advisor
        self.dropped = False
        self.good = self.bad = 0
        self._said: dict[int, Counter[int]] = defaultdict(Counter)
        self._circled: set[Pair] = set()
        self._now: dict[int, Pair] = {}  # in this episode, by step
        self._trusts: dict[int, float] = {}  # cached by state; they change only at the end of an episode

    def begin(self) -> None:
        """Begins an episode."""
        self._now.clear()

    def ask(self, request: AdviceRequest) -> int | None:
        """The answer, recorded for later judgement. Raises AdvisorLeft."""
        action = self.advisor.advise(request)
        assert not isinstance(action, Judgement)  # no request to a panel allows one
        if action is not None:
            self._now[request.step] = request.state, action
        return action

    def judge(self, trail: Trail, ways: Ways) -> None:
        """Adds the answers of an episode and recounts the good and bad ones by the paths known now."""
        for state, action in self._now.values():
            self._said[state][action] += 1
        self._circled |= circles(trail, {step: action for step, (_, action) in self._now.items()})
        self._now.clear()
        self._trusts.clear()
        self.good, self.bad = ways.tally(self._said, self._circled)

    def forget(self) -> None:
        """Clears the record, so that only later answers count."""
        self.good = self.bad = 0
        for record in (self._said, self._circled, self._trusts):
            record.clear()

    def trust_in(self, state: int, ways: Ways) -> float:
        """The trust in the advisor in a state."""
        if state not in self._trusts:
            said = {state: self._said[state]} if state in self._said else {}
            there = ways.tally(said, self._circled)
            self._trusts[state] = trust_there(trust(self.good, self.bad), *there)
        return self._trusts[state]


class Panel:
    """Several advisors as one, trusted by what their advice led to (see trust.py).

    "together" asks all of them about each step; "in-turn" asks one per episode, and the next if it is silent. An advisor
    whose advice is significantly bad is dropped: it is still asked about one question in ten, but not followed, and is readmitted
    when these answers are significantly good; then only they count. All randomness comes from `draw`.
    Raises BadInput if there are no members.
    """

    def __init__(
        self,
        members: Mapping[str, Advisor],
        states: int,
        settings: PanelSettings,
        *,
        draw: Draw,
        tell: Callable[[Event], None],
    ):
        if not members:
            raise BadInput("a panel of advisors: it has no member")
        self._members = {name: _Member(advisor) for name, advisor in members.items()}
        self._decide, self._in_turn = DECISIONS[settings.decide], settings.asked == "in-turn"
        self._draw, self._tell = draw, tell
        self._ways = Ways(states)
        self._terminal: BoolArray | None = None
        self._episode = 0
        self._turn = -1

    def advise(self, request: AdviceRequest) -> int | None:
        """The panel's decision, None if no member that counts has answered. Raises AdvisorLeft if all have left."""
        self._terminal = request.mdp.terminal
        if request.episode != self._episode:
            self._episode, self._turn = request.episode, self._turn + 1
            for member in self._members.values():
                member.begin()
        votes = self._votes(request)
        self._probe(request)
        if not self._members:
            raise AdvisorLeft
        if not votes:
            return None
        trusts = {
            name: member.trust_in(request.state, self._ways) for name, member in self._members.items() if name in votes
        }
        action = decided(votes, trusts, request.own, self._decide, len(request.allowed))
        if len({*votes.values()}) > 1:
            self._tell(
                AdvisorsDisagreed(request.episode, request.step, request.state, tuple(votes.items()), followed=action)
            )
        return action

    def _votes(self, request: AdviceRequest) -> dict[str, int]:
        """The answers of the members that are not dropped, by name."""
        heard = [name for name, member in self._members.items() if not member.dropped]
        if self._in_turn and heard:
            first = self._turn % len(heard)
            heard = heard[first:] + heard[:first]
        votes: dict[str, int] = {}
        for name in heard:
            action = self._ask(name, request)
            if action is not None:
                votes[name] = action
                if self._in_turn:
                    break
        return {name: votes[name] for name in self._members if name in votes}

    def _probe(self, request: AdviceRequest) -> None:
        """Asks dropped members about a random share of the questions, to judge their answers later."""
        for name in [name for name, member in self._members.items() if member.dropped]:
            if self._draw() < PROBED:
                self._ask(name, request)

    def _ask(self, name: str, request: AdviceRequest) -> int | None:
        try:
            return self._members[name].ask(request)
        except AdvisorLeft:
            del self._members[name]
            return None

    def followed(self, walked: Walked) -> None:
        """Learns from an episode where actions lead, judges all answers anew, and drops or readmits members."""
        if not walked.trail:
            return
        over = self._terminal is not None and bool(self._terminal[walked.trail[-1][2]])
        self._ways.walked(walked.trail, walked.reached, over)
        for name, member in self._members.items():
            member.judge(walked.trail, self._ways)
            if (is_good if member.dropped else is_bad)(member.good, member.bad):
                self._switch(name, walked.episode)

    def _switch(self, name: str, episode: int) -> None:
        """Drops a member, or readmits one that was dropped."""
        member = self._members[name]
        answers, now = f"{member.good} of its {member.good + member.bad} answers", trust(member.good, member.bad)
        if member.dropped:
            why = f"asked now and then, {answers} led nearer to the goal"
            self._tell(AdvisorReadmitted(episode, name, now, why))
        else:
            self._tell(AdvisorDropped(episode, name, now, f"{answers} that could be judged led nearer to the goal"))
            member.forget()
        member.dropped = not member.dropped

    def heard(self) -> list[str]:
        """The names of the members to whom the next question goes for sure: of those asked in turn, none."""
        return [] if self._in_turn else [name for name, member in self._members.items() if not member.dropped]

    def standing(self) -> list[MemberStanding]:
        """The standing of the members that have not left, in their original order."""
        return [
            MemberStanding(
                name,
                trust(member.good, member.bad),
                *bounds(member.good, member.bad),
                member.dropped,
                member.good,
                member.bad,
            )
            for name, member in self._members.items()
        ]


def members_of(names: Iterable[str], advisors: Iterable[Advisor | None]) -> dict[str, Advisor]:
    """The members of a panel by name, without those that are None; a second "expert" becomes "expert 2"."""
    members: dict[str, Advisor] = {}
    for name, advisor in zip(names, advisors, strict=True):
        if advisor is not None:
            free = chain([name], (f"{name} {number}" for number in count(2)))
            members[next(one for one in free if one not in members)] = advisor
    return members
