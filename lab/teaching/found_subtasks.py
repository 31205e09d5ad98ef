"""Sub-tasks that are found in a problem: bottlenecks in a learner's own moves, and the ways to them, kept in the toolbox."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from lab.errors import BadInput, unknown
from lab.learning import splitmix
from lab.learning.bottlenecks import METHODS, Bottleneck, Experience, RecordedTable, bottlenecks
from lab.learning.environment import TableEnvironment
from lab.learning.problem import Problem
from lab.learning.session import Session
from lab.learning.session_result import SessionResult
from lab.learning.settings import GateSettings, LearnerSettings
from lab.learning.two_levels import Learned, TwoLevels, lesson, optimistic, starts_of, sub_problem
from lab.learning.values import fewest_moves
from lab.mdp import TabularMDP
from lab.teaching.teacher import plain_name
from lab.toolbox.policy import Origin, Policy, is_name
from lab.toolbox.registry import Toolbox

LEARNER = LearnerSettings(
    learner="q", alpha=0.95, beta=1.0, episodes=400
)  # of ways and of the moves in which they are found
ALONE = GateSettings(gate="never")
TASKS = 10  # drawn tasks on which the gain is measured
FAR_APART = 5  # least moves from the start of such a task to its goal
MOST_DRAWS = 1000


@dataclass(frozen=True)
class Proposal:
    """A bottleneck that is proposed as a sub-task: its name, and its states."""

    name: str
    states: Bottleneck


@dataclass(frozen=True, eq=False)
class Finding:
    """What was found in a problem: the moves of a learner, and the proposals, those that matter most first."""

    problem: Problem
    method: str
    seed: int
    learner: LearnerSettings
    experience: Experience
    proposals: tuple[Proposal, ...]


def found(problem: Problem, method: str, episodes: int, seed: int, max_steps: int = 200) -> Finding:
    """The bottlenecks that a method finds in the moves of a learner alone, in so many episodes.

    Raises BadInput for an unknown method, and if the steps of the problem are not all in its table.
    """
    if method not in METHODS:
        raise unknown("method", method, METHODS, "--method")
    if problem.environment is not None and type(problem.environment) is not TableEnvironment:
        raise BadInput(
            f"problem '{problem.name}': sub-tasks are found where steps are certain and in a table: wanted a world"
        )
    mdp, learner = problem.mdp, replace(LEARNER, max_steps=max_steps)
    experience = Experience(mdp.n_states, mdp.n_actions)
    place = RecordedTable(mdp, experience)
    result = Session(place, replace(learner, episodes=episodes), ALONE, None, splitmix.stream(seed)).run()
    if result.interrupted:
        raise KeyboardInterrupt
    proposals = tuple(
        Proposal(f"doorway {n}", states) for n, states in enumerate(bottlenecks(experience, method), start=1)
    )
    return Finding(problem, method, seed, learner, experience, proposals)


def check_names(names: Sequence[str]) -> None:
    """Raises BadInput unless each sub-task may have its name, and all are different."""
    for number, name in enumerate(names):
        if not is_name(name) or len(name) > 40:
            raise BadInput(f"name '{name[:60]}': wanted 1 to 40 printable characters")
        if name in names[:number]:
            raise BadInput(f"name '{name}': another sub-task has it: wanted a new one")


def learned(
    finding: Finding, accepted: Mapping[Bottleneck, str], toolbox: Toolbox
) -> tuple[dict[str, Any], list[Policy]]:
    """(document, ways): the document of `lab find --json`, and the ways to the accepted bottlenecks, now learned and kept.

    accepted: their names by their states. The gain is measured on drawn tasks in the same problem, which are learned twice: with
    the ways, and flat; neither remembers the moves in which the bottlenecks were found.
    """
    check_names(list(accepted.values()))
    toolbox.check()
    problem, experience, draw = finding.problem, finding.experience, splitmix.stream(splitmix.apart(finding.seed, 1))
    found_moves = experience.moves
    levels = TwoLevels(
        problem.mdp, experience.neighbours(), list(accepted), experience, finding.learner, remembers=True
    )
    levels.learn_ways(draw)
    kept, policies = [], list[Policy]()
    for (region, number), way in levels.ways.items():
        name = f"{problem.name} {accepted[levels.groups[number]]} from room {region + 1}"
        policy = _policy(name, way, finding)
        toolbox.put(policy)
        policies.append(policy)
        cost = {"episodes": way.episodes, "moves": way.moves, "longest": _longest(way)}
        kept.append(
            {"to": accepted[levels.groups[number]], "from": f"room {region + 1}"} | cost | {"saved_as": policy.name}
        )
    document = {
        "problem": problem.name,
        "method": finding.method,
        "seed": finding.seed,
        "states_seen": len(levels.near),
        "moves": found_moves,
        "proposed": [
            {
                "name": accepted.get(proposal.states, proposal.name),
                "states": list(proposal.states),
                "labels": [problem.mdp.state_label(state) for state in proposal.states],
                "accepted": proposal.states in accepted,
            }
            for proposal in finding.proposals
        ],
        "rooms": len(levels.borders),
        "ways": kept,
        "gain": None if not kept else gain(finding, levels),
    }
    return document, policies


def gain(finding: Finding, levels: TwoLevels) -> dict[str, Any] | None:
    """The moves and episodes of drawn tasks, learned with the ways and flat; None if too few tasks can be drawn.

    A task counts as solved by paths of at most 1.1 times the fewest moves, see `lesson`.
    """
    mdp, rng = levels.mdp, np.random.default_rng([finding.seed, 1])
    tasks = _tasks(mdp, sorted(levels.near), rng)
    if len(tasks) < TASKS:
        return None
    counts = {
        "tasks": TASKS,
        "moves": 0,
        "episodes": 0,
        "solved": 0,
        "flat_moves": 0,
        "flat_episodes": 0,
        "flat_solved": 0,
    }
    levels = replace(levels, remembers=False)
    draw, flat_draw = (splitmix.stream(splitmix.apart(finding.seed, number)) for number in (2, 3))
    unused = Experience(mdp.n_states, mdp.n_actions)
    for start, goal in tasks:
        whole = sub_problem(mdp, np.ones(mdp.n_states, np.bool_), [goal], [start])
        path, last = levels.solve(start, [goal], draw)
        if last is None or not path:
            last = lesson(whole, finding.learner, unused, draw)
            path = [start] if np.isfinite(last.walk(start)) else []
        flat = lesson(whole, finding.learner, unused, flat_draw)
        for prefix, one, solved in (("", last, bool(path)), ("flat_", flat, bool(np.isfinite(flat.walk(start))))):
            counts[f"{prefix}moves"] += one.moves
            counts[f"{prefix}episodes"] += one.episodes
            counts[f"{prefix}solved"] += solved
    return counts


def _tasks(mdp: TabularMDP, known: Sequence[int], rng: np.random.Generator) -> list[tuple[int, int]]:
    """Drawn pairs of states, (start, goal), at least FAR_APART moves apart; fewer than TASKS if there are hardly any."""
    tasks: list[tuple[int, int]] = []
    free = [state for state in known if not mdp.terminal[state]]
    for _ in range(MOST_DRAWS if len(free) > 1 else 0):
        start, goal = (free[int(n)] for n in rng.choice(len(free), 2, replace=False))
        moves = fewest_moves(sub_problem(mdp, np.ones(mdp.n_states, np.bool_), [goal], [start]).mdp)[start]
        if FAR_APART <= moves < np.inf:
            tasks.append((start, goal))
        if len(tasks) == TASKS:
            break
    return tasks


def _longest(way: Learned) -> int:
    """The moves of a way from the farthest of its starts from which it leads to its end."""
    walks = [way.walk(start) for start in starts_of(way.problem)]
    return int(max((walk for walk in walks if walk < np.inf), default=0))


def _policy(name: str, way: Learned, finding: Finding) -> Policy:
    """A way as a policy; one that needed no episode of its own has an empty learning curve."""
    mdp, result = way.problem, way.result
    if result is None:
        visits = np.where(mdp.terminal[:, None], 0, finding.experience.counts)
        result = SessionResult.of_table(way.q, visits, TableEnvironment(mdp).judge(way.q, finding.learner))
    kept_as = plain_name(Problem(name, "way", mdp))
    origin = Origin(kept_as, "way", finding.problem.name, "nobody", finding.seed)
    return Policy.of(result, mdp, optimistic(finding.learner), ALONE, origin)
