"""The deep student: a double DQN as a learner of the lab, which any gate advises and any session runs; it needs PyTorch.

Source: Mnih et al. 2015; van Hasselt, Guez and Silver 2016; the margin of `prefer` is that of Hester et al. 2018 (DQfD).
"""

from collections.abc import Callable
from itertools import pairwise
from typing import Any, ClassVar, NamedTuple

import numpy as np

from lab.lazy import torch
from lab.learning.settings import LearnerSettings
from lab.learning.updates.update import ComputedRows, Row, Update
from lab.mdp import FloatArray, TabularMDP
from lab.optional import require

HIDDEN, RATE = (64, 64), 2e-3  # units of each layer; the learning rate of Adam
CAPACITY, BATCH = 20_000, 128  # steps that are remembered; those of a gradient step
LEARN_EVERY = 6  # steps for each gradient step; those of an episode are made as it ends
FEWEST, MOST = 16, 32  # gradient steps of an episode
COPY_EVERY = 30  # gradient steps between two copies of the network
SHOWN_BATCH = 16  # preferred actions of a gradient step


class Sight(NamedTuple):
    """What a student sees by a state's number.

    width: of an observation; now: the observation of a state, exact where the world is now; left: that of the state which the
    last step left.
    """

    width: int
    now: Callable[[int], FloatArray]
    left: Callable[[int], FloatArray]


class Outputs(ComputedRows):
    """The network's outputs as a table (S, A), whose rows are computed on lookup."""

    def __init__(self, shape: tuple[int, ...], values: Callable[[int], Row]):
        self.shape, self._values = shape, values

    def __len__(self) -> int:
        return self.shape[0]

    def row(self, state: int) -> Row:
        """The network's values (A,) of a state."""
        return self._values(state)


class DeepStudent(Update):
    """Double DQN: two hidden layers, a replay memory, a target network, and Huber's loss; the session explores.

    `seeing` makes the class for a world. q: only its shape counts; rng: draws the first weights and what is replayed.
    A network has no entry to lower: a preferred action (`prefer`, as earned-trust hands it over) is kept by state, and each
    later gradient step also raises its value above the others' by the margin.
    Raises BadInput if PyTorch is not installed.
    """

    sight: ClassVar[Sight]

    def __init__(self, q: list[Row], settings: LearnerSettings, mdp: TabularMDP, rng: np.random.Generator):
        require("the deep student", torch)
        torch.set_num_threads(1)  # the sums of a product depend on how many threads share it
        torch.use_deterministic_algorithms(True)
        self.rng = rng
        self._shape = mdp.n_states, mdp.n_actions
        self.q = Outputs(self._shape, self._values)
        self._net = [self._layer(*ends) for ends in pairwise((self.sight.width, *HIDDEN, mdp.n_actions))]
        self._copy()
        self._adam = torch.optim.Adam([array for layer in self._net for array in layer], RATE, fused=True)
        self._memory = np.zeros((CAPACITY, 2 * self.sight.width + 3), np.float32)
        self._kept = self._learned = self._descents = 0
        self._shown: dict[int, tuple[FloatArray, int, float]] = {}

    def _layer(self, entering: int, leaving: int) -> tuple[Any, Any]:
        """The weights and biases of a layer, drawn as PyTorch draws those of a linear one."""
        bound = entering**-0.5
        drawn = [self.rng.uniform(-bound, bound, shape).astype(np.float32) for shape in ((leaving, entering), leaving)]
        weights, biases = (torch.tensor(array, requires_grad=True) for array in drawn)
        return weights, biases

    def _copy(self) -> None:
        self._target = [(weights.detach().clone(), biases.detach().clone()) for weights, biases in self._net]

    def _values(self, state: int) -> Row:
        """The values (A,) of a state; in NumPy, which shares the network's memory and is quicker for one observation."""
        x: Any = self.sight.now(state)
        for number, (weights, biases) in enumerate(self._net):
            x = weights.detach().numpy() @ (np.maximum(x, 0.0) if number else x) + biases.detach().numpy()
        row: Row = x.tolist()
        return row

    def learn(self, s_tm1: int, a_tm1: int, r_t: float, discount_t: float, s_t: int, a_t: int) -> None:
        """Remembers the step."""
        self._remember(self.sight.left(s_tm1), a_tm1, r_t, discount_t, self.sight.now(s_t))

    def end(self) -> None:
        """Makes the episode's gradient steps."""
        for _ in range(min(max((self._kept - self._learned) // LEARN_EVERY, FEWEST), MOST)):
            self._descend()
            self._descents += 1
            if self._descents % COPY_EVERY == 0:
                self._copy()
        self._learned = self._kept

    def replay(self, s_tm1: int, a_tm1: int, r_t: float, discount_t: float, s_t: int) -> None:
        """Remembers a known step once more."""
        self._remember(self.sight.now(s_tm1), a_tm1, r_t, discount_t, self.sight.now(s_t))

    def prefer(self, state: int, action: int, margin: float) -> None:
        """Keeps an action of a state to be valued above the others, until another one is preferred there."""
        self._shown[state] = self.sight.now(state), action, margin

    def table(self) -> FloatArray:
        """Zeros (S, A): a network has no table, and its greedy policy is measured where it acts."""
        return np.zeros(self._shape)

    def _remember(self, left: FloatArray, action: int, reward: float, discount: float, entered: FloatArray) -> None:
        self._memory[self._kept % CAPACITY] = (*left, action, reward, discount, *entered)
        self._kept += 1

    def _descend(self) -> None:
        """Makes a gradient step on remembered steps and on preferred actions."""
        width = self.sight.width
        drawn = torch.from_numpy(self._memory[self.rng.integers(min(self._kept, CAPACITY), size=BATCH)])
        left, action, reward, discount, entered = drawn.split((width, 1, 1, 1, width), dim=1)
        values, following = _outputs(self._net, torch.cat((left, entered))).split(BATCH)
        with torch.no_grad():
            best = following.argmax(dim=1, keepdim=True)
            target = reward + discount * _outputs(self._target, entered).gather(1, best)
        loss = torch.nn.functional.smooth_l1_loss(values.gather(1, action.long()), target)
        if self._shown:
            loss = loss + self._shortfall()
        self._adam.zero_grad()
        loss.backward()
        self._adam.step()

    def _shortfall(self) -> Any:
        """The mean of what some preferred actions lack to be valued above all others by their margins."""
        shown = list(self._shown.values())
        seen, actions, margins = zip(*(shown[n] for n in self.rng.integers(len(shown), size=SHOWN_BATCH)), strict=True)
        chosen, margin = torch.tensor(actions)[:, None], torch.tensor(margins, dtype=torch.float32)[:, None]
        values = _outputs(self._net, torch.from_numpy(np.array(seen, np.float32)))
        own = values.gather(1, chosen)
        return ((values + margin).scatter(1, chosen, own).max(dim=1, keepdim=True).values - own).mean()


def _outputs(net: Any, x: Any) -> Any:
    """The values (N, A) of observations (N, D)."""
    for number, (weights, biases) in enumerate(net):
        x = biases.addmm(x.relu() if number else x, weights.T)
    return x


def seeing(sight: Sight) -> type[DeepStudent]:
    """The deep student of a world, as a class that a session can make."""

    class Seeing(DeepStudent):
        """A deep student of one world."""

    Seeing.sight = sight
    return Seeing
