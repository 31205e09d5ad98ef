"""The greedy policy without advice, as it is measured along the way."""

from lab.learning import splitmix
from lab.learning.chance_table import ChanceTable, keeps_steps
from lab.learning.environment import Environment, TableEnvironment
from lab.learning.physics.cells import CellTable
from lab.learning.selection import Draw
from lab.learning.session import Session
from lab.learning.settings import LearnerSettings
from lab.mdp import FloatArray, TabularMDP

WALKS = 10  # episodes that measure a greedy policy where they differ
GREEDY_EVERY = 10  # episodes between the measurements of studies


def walks_of(place: Environment) -> int:
    """How many episodes of a greedy policy measure it: one where all are the same, WALKS where starts or steps may be drawn."""
    alike = keeps_steps(place) and not isinstance(place, ChanceTable) and not place.mdp.starts
    return 1 if alike else WALKS


def greedy_every(problem: TabularMDP | Environment, learner: LearnerSettings) -> int:
    """The episodes between two measurements of the greedy policy in a study: GREEDY_EVERY, or all if there are fewer.

    0, for no measurement, where steps are in no table or values are in tiles.
    """
    on_table = isinstance(problem, TabularMDP | TableEnvironment) and not isinstance(problem, CellTable)
    return min(GREEDY_EVERY, learner.episodes) if on_table and learner.tilings == 1 else 0


def greedy_steps(place: TableEnvironment, q: FloatArray, learner: LearnerSettings, draw: Draw, walks: int) -> float:
    """The mean steps of that many episodes of the greedy policy of q (S, A), a failed one as max_steps + 1.

    Ties go to the lowest action; starts and steps that are left to chance come from `draw`.
    """
    greedy, total = q.argmax(axis=1).tolist(), 0
    for _ in range(walks):
        state, reached, moves = place.reset(1, draw), False, 0
        while moves < learner.max_steps - learner.count_start and not place.mdp.terminal[state]:
            step = place.step(state, greedy[state], draw)
            state, reached, moves = step.state, step.reached, moves + 1
        total += moves + learner.count_start if reached else learner.max_steps + 1
    return total / walks


def measure_greedy(session: Session, seed: int, every: int, greedy: FloatArray) -> bool:
    """False, as the session goes on: the `enough` of one whose greedy policy is measured after each `every`-th episode.

    greedy: (K,), receives the mean steps that `run_sessions` has in `Batch.greedy`; seed: the session's; every: 0 for never.
    """
    number, left = divmod(session.episode, every) if every else (0, 1)
    if not left and isinstance(session.environment, TableEnvironment):
        draw, place = splitmix.stream(splitmix.apart(seed, number)), session.environment
        greedy[number - 1] = greedy_steps(place, session.update.table(), session.settings, draw, walks_of(place))
    return False
