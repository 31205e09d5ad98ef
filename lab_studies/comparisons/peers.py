"""Peers that advise each other, compared with the same learners alone at equal moves; and what a wrong one among them does."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from lab.advice.panel import Panel, PanelSettings
from lab.learning.problem import Problem
from lab.learning.requests import Walked
from lab.learning.settings import GateSettings
from lab.mdp import FloatArray, TabularMDP, shortest_steps
from lab.studies.charts import legend_below
from lab.studies.findings import Findings, Row, mean_row, those
from lab.studies.runner import Job, seeds_of
from lab.teaching.peers import Peer, PeerGroup, PeerPlan
from lab.view.canvas import BLUE, GREEN, INK, RED, picture_bytes
from lab_studies.comparisons.advice_bench.problems import problem

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PEERS = 4
PROBLEMS = {"world-1": 6_000, "insert": 6_000, "four-rooms": 8_000}  # the moves of each learner, in every company
FIRST_EPISODES = {
    "ccrl": 30,
    "ccrl early": 10,
}  # X of the gate ccrl, by the name of the setting: the first that may ask
ALONE, TOGETHER, WRONG, UNJUDGED = "alone", "together", "one wrong", "one wrong, not judged"
COMPANIES = (ALONE, TOGETHER, WRONG, UNJUDGED)
EPISODES = 1_000  # more than anybody plays
NO_REJECTION = 1_000_000  # omega: the gate tolerates every mislead
NEVER = "never"

MEASURES = (
    f"{PEERS} learners, as many moves for each in every company, in rounds of an episode each. Each value of a session is the "
    "mean of its learners. Goal: the greedy path first reaches the goal; solved: it is first a shortest one; both in episodes "
    "and in moves of the learner itself, all that it made if that never happens. Greedy points: 100 x the fewest steps over "
    "those of the greedy path, 0 if that misses the goal, averaged over the moves; return points: the same of the episodes that "
    "it walked. Gain: the difference to the same learners alone, paired by seed, positive if the company is better."
)
COMPANIES_NOTE = (
    "One wrong: peer 4 answers with the worst action by the optimal values, always and everywhere; the other three are compared "
    "with the same three alone. Not judged: nobody is dropped, the majority decides, and the gate rejects nobody."
)


@dataclass(frozen=True)
class Setting:
    """What is learned in which company, and the gate by which learners ask."""

    problem: str
    gate: str
    company: str


class Outcome(NamedTuple):
    """The results of N sessions, (N,) each: the means of their learners, see MEASURES."""

    goal_episodes: FloatArray
    goal_moves: FloatArray
    solved_episodes: FloatArray
    solved_moves: FloatArray
    greedy_points: FloatArray
    return_points: FloatArray
    helped_steps: FloatArray
    wrong_dropped_percent: FloatArray


LOWER_IS_BETTER = ("goal_episodes", "goal_moves", "solved_episodes", "solved_moves")
POINTS = ("greedy_points", "return_points")
COMPARED = (*LOWER_IS_BETTER, *POINTS)


class UnjudgedPanel(Panel):
    """A panel that judges nobody."""

    def followed(self, walked: Walked) -> None:
        """Ignores the episode."""


class Watch:
    """The course of one learner, observed after each of its episodes.

    moves: made after each episode; greedy, walked: the points of each episode, see MEASURES.
    """

    def __init__(self, mdp: TabularMDP, fewest: int, most: int, most_moves: int):
        self._successor, self._terminal, self._goal = (
            part.tolist() for part in (mdp.successor, mdp.terminal, mdp.goal)
        )
        self._start, self._fewest, self._most, self._most_moves = mdp.start, fewest, most, most_moves
        self.moves: list[int] = []
        self.greedy: list[float] = []
        self.walked: list[float] = []

    def look(self, peer: Peer) -> None:
        """Adds an episode."""
        session = peer.session
        self.moves.append(peer.moves)
        steps = session.steps[-1] - session.settings.count_start
        self.walked.append(100.0 * self._fewest / steps if steps <= session.max_moves else 0.0)
        greedy = self._greedy_steps(session.q)
        self.greedy.append(0.0 if greedy is None else 100.0 * self._fewest / greedy)

    def _greedy_steps(self, q: Sequence[Sequence[float]]) -> int | None:
        state, met = self._start, set[int]()
        while state not in met and len(met) < self._most:
            met.add(state)
            values = list(q[state])
            state = self._successor[state][values.index(max(values))]
            if self._terminal[state]:
                return len(met) if self._goal[state] else None
        return None

    def first(self, points: float) -> tuple[int, int]:
        """(episodes, moves) until the greedy path has so many points; all of them if it never has."""
        at = next((n for n, value in enumerate(self.greedy) if value >= points), len(self.greedy) - 1)
        return at + 1, min(self.moves[at], self._most_moves)

    def mean_points(self, points: Sequence[float]) -> float:
        """The mean, over the equal moves, of points that hold during the move."""
        lengths = np.diff(np.minimum(np.array(self.moves), self._most_moves), prepend=0)
        return float((lengths * np.array(points)).sum() / self._most_moves)


def one_session(setting: Setting, seed: int) -> tuple[float, ...]:
    """The values of one session, in the order of `Outcome`."""
    benched = problem(setting.problem)
    mdp, most_moves = benched.mdp, PROBLEMS[setting.problem]
    learner = replace(benched.learner, episodes=EPISODES)
    judged = setting.company != UNJUDGED
    gate = GateSettings(NEVER)
    if setting.company != ALONE:
        gate = GateSettings("ccrl", first_episode=FIRST_EPISODES[setting.gate], spare_best=True)
    if not judged:
        gate = replace(gate, omega=NO_REJECTION)
    made = Problem(setting.problem, "table", mdp)
    roles = ["wrong" if _has_wrong(setting) and n == PEERS - 1 else None for n in range(PEERS)]
    group = PeerGroup(
        [PeerPlan(made, learner, gate, role) for role in roles],
        seed,
        panel=PanelSettings() if judged else PanelSettings(decide="majority"),
        make_panel=Panel if judged else UnjudgedPanel,
    )
    watches = {peer.number: Watch(mdp, shortest_steps(mdp), learner.max_steps, most_moves) for peer in group.peers}
    result = group.run(lambda peer: watches[peer.number].look(peer), most_moves)
    values = []
    for watch, peer in zip(watches.values(), result.peers, strict=True):
        dropped = [other.dropped for other in peer.others if other.peer == PEERS]
        values.append(
            (
                *watch.first(1e-9),
                *watch.first(100.0),
                watch.mean_points([0.0, *watch.greedy[:-1]]),  # those of the table that the episode began with
                watch.mean_points(watch.walked),
                peer.session.helped_steps,
                100.0 * any(dropped),
            )
        )
    return tuple(value for row in values for value in row)


def _has_wrong(setting: Setting) -> bool:
    return setting.company in (WRONG, UNJUDGED)


def outcome(setting: Setting, *, sessions: int, seed: int) -> FloatArray:
    """The values of `sessions` sessions, (sessions, PEERS, measures); every company and gate has the same seeds."""
    seeds = seeds_of(replace(setting, company="", gate=""), sessions, seed)
    width = len(Outcome._fields)
    return np.array([one_session(setting, int(own)) for own in seeds], np.float64).reshape(sessions, PEERS, width)


def mean_of(values: FloatArray, learners: int) -> Outcome:
    """The outcome of the first learners of each session."""
    return Outcome(*values[:, :learners].mean(axis=1).T)


def peers(job: Job, reading: Mapping[str, Any]) -> Findings:
    """The results of every problem, gate and company; the reading has no effect."""
    settings = [Setting(name, NEVER, ALONE) for name in PROBLEMS]
    settings += [
        Setting(name, gate, company) for name in PROBLEMS for gate in FIRST_EPISODES for company in COMPANIES[1:]
    ]
    values = job.each(partial(outcome, sessions=job.sessions, seed=job.seed), settings)
    rows = [row for setting in settings for row in rows_of(setting, values)]
    pictures = {
        "Gain in greedy points at equal moves over the same learners alone": _picture(rows, "greedy_points"),
        "Moves until solved, saved over the same learners alone": _picture(rows, "solved_moves"),
    }
    return Findings(rows, in_short(rows), pictures, (MEASURES, COMPANIES_NOTE))


def rows_of(setting: Setting, values: Mapping[Setting, FloatArray]) -> list[Row]:
    """The measures of a setting, and its gains over the same learners alone."""
    learners = PEERS - _has_wrong(setting)
    here = mean_of(values[setting], learners)
    alone = mean_of(values[Setting(setting.problem, NEVER, ALONE)], learners)
    named: Row = {"problem": setting.problem, "gate": setting.gate, "company": setting.company, "learners": learners}
    rows = [mean_row(named, name, getattr(here, name)) for name in COMPARED]
    if setting.company == ALONE:
        return rows
    rows.append(mean_row(named, "helped_steps", here.helped_steps))
    if _has_wrong(setting):
        rows.append(mean_row(named, "wrong_dropped_percent", here.wrong_dropped_percent))
    for name in COMPARED:
        sign = -1.0 if name in LOWER_IS_BETTER else 1.0
        rows.append(mean_row(named, f"gain_{name}", sign * (getattr(here, name) - getattr(alone, name))))
    return rows


def in_short(rows: Sequence[Row]) -> Row:
    """For each company: the problems and gates in which it is faster, slower or neither, by the intervals of the gains."""
    says: Row = {}
    for company in COMPANIES[1:]:
        for gate in FIRST_EPISODES:
            for measure in ("goal_moves", "solved_moves", *POINTS):
                gains = those(rows, company=company, gate=gate, measure=f"gain_{measure}")
                above = [row["problem"] for row in gains if row["ci95"][0] > 0.0]
                below = [row["problem"] for row in gains if row["ci95"][1] < 0.0]
                says[f"{company}, {gate}: gain in {measure} above 0"] = ", ".join(above) or "none"
                says[f"{company}, {gate}: gain in {measure} below 0"] = ", ".join(below) or "none"
    return says


def _picture(rows: Sequence[Row], measure: str) -> bytes:
    """A picture of gains with intervals: a panel for each gate, a row for each problem, a mark for each company."""
    colours = dict(zip(COMPANIES[1:], (GREEN, BLUE, RED), strict=True))

    def draw(figure: "Figure") -> None:
        plots = figure.subplots(1, len(FIRST_EPISODES), sharex=True, sharey=True, squeeze=False)[0]
        for axes, gate in zip(plots, FIRST_EPISODES, strict=True):
            axes.axvline(0.0, color=INK, linewidth=0.8)
            for shift, (company, colour) in zip((0.2, 0.0, -0.2), colours.items(), strict=True):
                for place, name in enumerate(reversed([*PROBLEMS])):
                    (gain,) = those(rows, problem=name, gate=gate, company=company, measure=f"gain_{measure}")
                    low, high = gain["ci95"]
                    label = company if place == 0 else None
                    axes.plot([low, high], [place + shift] * 2, color=colour, linewidth=1.6)
                    axes.plot([gain["value"]], [place + shift], "o", color=colour, markersize=4.5, label=label)
            axes.set_title(f"gate {gate}", fontsize=10)
            axes.set_yticks(range(len(PROBLEMS)), labels=list(reversed([*PROBLEMS])))
            axes.set_xlabel({"greedy_points": "gain [points]", "solved_moves": "moves saved"}[measure])
            axes.locator_params(axis="x", nbins=5)
            axes.grid(axis="x")
        legend_below(figure)

    return picture_bytes(draw, 7.5, 3.2)
