"""MiniGrid's worlds by a symbolic view: position, direction, doors and what is carried, instead of a picture."""

from collections import deque
from copy import deepcopy
from typing import Any

import gymnasium
import numpy as np

from lab.errors import BadInput
from lab.gym.our_environments import TableEnv
from lab.mdp import TabularMDP

PREFIX = "MiniGrid-"
MOST_STATES = 3000  # finding them takes about half a minute
_MARKS = (
    "?.#_DKBXGL?"  # of objects by their numbers: unseen, empty, wall, floor, door, key, ball, box, goal, lava, agent
)
_DOORS = "/D+"  # open, closed, locked
_AGENTS = ">v<^"

Key = tuple[bytes, int, int, int, str]


def is_minigrid(env: Any) -> bool:
    """Whether an environment is one of MiniGrid's."""
    return any(
        (kind.__module__, kind.__name__) == ("minigrid.minigrid_env", "MiniGridEnv") for kind in type(env).__mro__
    )


class SymbolicEnv(TableEnv):
    """A world of MiniGrid as a table: all states that can be reached in the layout that `seed` draws, found by exploring copies.

    A state is the grid with its objects, the agent's position and direction, and what it carries. Reaching the goal gives 1;
    MiniGrid's own reward shrinks with the steps taken, which no table of states can hold, and the discount does the same.
    Raises BadInput for a seed that is none, for steps that are drawn at random, and for more than MOST_STATES states.
    """

    def __init__(self, env: Any, seed: object, which: str, render_mode: str | None = None):
        if not isinstance(seed, int) or isinstance(seed, bool) or seed < 0:
            raise BadInput(f"{which}: seed {seed!r}: wanted a whole number of at least 0, which draws the layout")
        env.reset(seed=seed)
        self.keys: list[Key] = []
        self.size = int(env.width), int(env.height)
        super().__init__(self._explored(env, which), int(env.max_steps), render_mode)

    def _explored(self, env: Any, which: str) -> TabularMDP:
        """The table of all states that can be reached, breadth-first."""
        shared = {
            id(part): part for part in vars(env).values() if isinstance(part, gymnasium.Space | np.random.Generator)
        }
        shared |= {
            id(cell): cell
            for cell in env.grid.grid
            if cell is not None and cell.type in ("wall", "goal", "lava", "floor")
        }
        env.gen_obs = _no_picture
        labels = tuple(action.name for action in env.actions)
        numbers: dict[tuple[Key, bool, bool], int] = {}
        rows: list[list[tuple[int, float]]] = []
        ahead: deque[Any] = deque()
        before = repr(env.np_random.bit_generator.state)

        def number(world: Any, over: bool, won: bool) -> int:
            state = _key(world), over, won
            if state not in numbers:
                if len(numbers) == MOST_STATES:
                    raise BadInput(f"{which}: more than {MOST_STATES} symbolic states: wanted a smaller world")
                numbers[state] = len(numbers)
                ahead.append(None if over else world)
            return numbers[state]

        number(env, False, False)
        while ahead:
            world, row = ahead.popleft(), []
            for action in range(len(labels)) if world is not None else ():
                other = deepcopy(world, dict(shared))
                other.step_count = 0
                _, reward, over, _, _ = other.step(action)
                if repr(env.np_random.bit_generator.state) != before:
                    raise BadInput(
                        f"{which}: its steps are drawn at random: a symbolic view is of worlds with certain steps"
                    )
                row.append((number(other, over, over and reward > 0), float(np.sign(reward))))
            rows.append(row or [(len(rows), 0.0)] * len(labels))
        self.keys = [key for key, _, _ in numbers]
        successor, reward = (np.array([[step[n] for step in row] for row in rows]) for n in range(2))
        terminal, goal = (np.array([state[n] for state in numbers]) for n in (1, 2))
        return TabularMDP(successor, reward, terminal, goal, 0, labels)

    def render(self) -> str | None:
        """The grid with the agent (> v < ^): # wall, / open, D closed and + locked door, K key, B ball, X box, G goal, L lava."""
        if self.render_mode != "ansi":
            return None
        cells, x, y, direction, carried = self.keys[self.s]
        width, height = self.size
        grid = np.frombuffer(cells, np.uint8).reshape(width, height, 3)
        marks = [
            [_MARKS[kind] if kind != 4 else _DOORS[state] for kind, _, state in grid[:, j].tolist()]
            for j in range(height)
        ]
        marks[y][x] = _AGENTS[direction]
        return "".join(f"{' '.join(row)}\n" for row in marks) + (f"carries a {carried}\n" if carried else "")


def _key(env: Any) -> Key:
    held = "" if env.carrying is None else f"{env.carrying.color} {env.carrying.type}"
    x, y = (int(n) for n in env.agent_pos)
    return env.grid.encode().astype(np.uint8).tobytes(), x, y, int(env.agent_dir), held


def _no_picture() -> dict[str, Any]:
    """No observation, because drawing one takes most of the time of a step."""
    return {}
