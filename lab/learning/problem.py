"""The problem of one lesson: its name, its table, and the environment in which steps are made."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

from numpy.typing import ArrayLike

from lab.learning.environment import Environment
from lab.learning.settings import GateSettings, LearnerSettings
from lab.mdp import TabularMDP


@dataclass(frozen=True)
class Problem:
    """The problem of one lesson.

    name: of the problem; subtask: of the skill that it belongs to; mdp: its table.
    environment: where steps are made, an object with the methods of `Environment`; None for the table itself.
    scene: the place in words, if the name does not say it; arm: the arm that carries the sub-task out, "" for none.
    learner, gate: settings that suit it, which `lab.teach` uses where it is given no others; None: the defaults.

        >>> import lab
        >>> lab.Problem("board", "push", lab.grid((1, 3), [[0, 0, 0]], (0, 0), (0, 2))).mdp.n_states
        3
    """

    name: str
    subtask: str
    mdp: TabularMDP
    environment: Environment | None = None
    scene: str = ""
    arm: str = ""
    learner: LearnerSettings | None = None
    gate: GateSettings | None = None

    @classmethod
    def from_arrays(
        cls,
        P: ArrayLike,
        R: ArrayLike,
        *,
        start: int | ArrayLike = 0,
        terminal: ArrayLike = (),
        goal: ArrayLike = (),
        discount: float = 0.99,
        horizon: int = 200,
        action_labels: Sequence[str] | None = None,
        name: str = "arrays",
    ) -> Self:
        """The problem of a Markov decision process with S states and A actions that is given as arrays.

        P: (S, A, S), the probability that an action leads from a state to another one; the rows of terminal states do not count.
        R: the rewards, (S, A), or (S, A, S) if they depend on the state entered.
        start: the state in which episodes begin, or its distribution (S,).
        terminal: the states that end an episode, as numbers or as a bool mask (S,); goal: those of them that are goals.
        discount, horizon: defaults of the settings `discount` and `max_steps`, the most steps of an episode.
        action_labels: A names.

        With a goal, episodes are scored by their steps to it. Without one, an episode has `horizon` steps unless it ends in a
        terminal state, and its score is the return, the undiscounted sum of its rewards; gates compare the shortfall of returns,
        see `lab.learning.session`.
        Raises BadInput for other shapes, values that are not finite, negative probabilities, and rows that do not sum to 1.

            >>> import lab
            >>> P = [[[0.9, 0.1], [0.1, 0.9]], [[0.9, 0.1], [0.1, 0.9]]]  # two actions that mostly lead to states 0 and 1
            >>> problem = lab.Problem.from_arrays(P, R=[[0, 0], [1, 1]], horizon=10, action_labels=("left", "right"))
            >>> lesson = lab.teach(problem, seed=1, episodes=200)
            >>> lesson.act(0), lesson.solved, round(lesson.session.final_return, 2)
            (1, True, 8.01)
        """
        from lab.learning.transition_arrays import ArrayEnvironment, fitting

        environment = ArrayEnvironment.of(P, R, start, terminal, goal, action_labels)
        return cls(name, "table", environment.mdp, environment, "", "", *fitting(environment, discount, horizon))
