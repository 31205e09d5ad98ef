"""The lab's problems as registered Gymnasium environments: import this module, or make "lab.gym:TeachingLab/World1-v0"."""

from functools import cached_property
from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from lab.errors import BadInput
from lab.learning.transition_arrays import ArrayEnvironment, river_swim
from lab.mdp import FloatArray, TabularMDP
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.chance import NO_CHANCE, Chance, Episode
from lab.sequencing.cell.objectives import MAKESPAN, stuck_cost
from lab.sequencing.cell.routes import entry
from lab.sequencing.simulate.run import Run
from lab.tasks.cell_file import order_from_word, toast_case
from lab.tasks.task import TAUGHT_WITH
from lab.tasks.task_file import load, load_cell, load_world
from lab.view.value_levels import GridPlanes

ROOM = 10  # the limit of decisions of an episode in a cell, as a multiple of the most that its parts need
MOST_BANKS = 200  # states of RiverSwim
METADATA: dict[str, Any] = {"render_modes": ["ansi"], "render_fps": 4}

Info = dict[str, Any]
Places = NDArray[np.int64]


class TableEnv(gymnasium.Env[Any, Any]):
    """A tabular problem; observed is the number of the state, and info["is_success"] says whether it is a goal.

    P and initial_state_distrib, as in Gymnasium's own toy texts, hold the whole problem. Episodes are truncated after
    `max_episode_steps` moves; None: never.
    """

    metadata = METADATA

    def __init__(self, mdp: TabularMDP, max_episode_steps: int | None = None, render_mode: str | None = None):
        self.mdp, self.max_episode_steps, self.render_mode = mdp, max_episode_steps, render_mode
        self.action_labels, self.shape = mdp.action_labels, mdp.shape
        self.observation_space = spaces.Discrete(mdp.n_states)
        self.action_space = spaces.Discrete(mdp.n_actions)
        self.starts = mdp.starts or (mdp.start,)
        self.s, self._moves = mdp.start, 0

    @cached_property
    def P(self) -> dict[int, dict[int, list[tuple[float, int, float, bool]]]]:
        """The outcomes of each action in each state: (probability, state, reward, whether the episode ends)."""
        mdp = self.mdp
        ends = mdp.terminal[mdp.successor] | mdp.terminal[:, None]
        rows = zip(mdp.successor.tolist(), mdp.reward.tolist(), ends.tolist(), strict=True)
        return {
            state: {action: [(1.0, *outcome)] for action, outcome in enumerate(zip(*row, strict=True))}
            for state, row in enumerate(rows)
        }

    @property
    def initial_state_distrib(self) -> FloatArray:
        """The distribution (S,) of the starts."""
        chances = np.zeros(self.mdp.n_states)
        chances[list(self.starts)] = 1.0 / len(self.starts)
        return chances

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[int, Info]:
        """The start, drawn if there are several, and info."""
        super().reset(seed=seed)
        self.s, self._moves = self.starts[int(self.np_random.integers(len(self.starts)))], 0
        return self.s, {"is_success": False}

    def step(self, action: int) -> tuple[int, float, bool, bool, Info]:
        """The outcome in the table."""
        mdp, left = self.mdp, self.s
        self.s, self._moves = int(mdp.successor[left, action]), self._moves + 1
        terminated = bool(mdp.terminal[self.s])
        truncated = not terminated and self.max_episode_steps is not None and self._moves >= self.max_episode_steps
        return self.s, float(mdp.reward[left, action]), terminated, truncated, {"is_success": bool(mdp.goal[self.s])}

    def render(self) -> str | None:
        """The plane of a grid that the robot is in: R robot, G goal, # obstacle; x to the right and y up on a map."""
        if self.render_mode != "ansi":
            return None
        mdp, cell = self.mdp, self.mdp.state_cell(self.s)
        if len(cell) < 2 or mdp.coverage_shape:
            return f"state {mdp.state_label(self.s)}\n"
        planes = GridPlanes(mdp)
        plane = planes.marks(planes.layer(cell)).copy()
        plane[planes.place(cell)] = "R"
        below = "" if len(cell) == 2 else f"level {cell[2]} of 0..{mdp.shape[2] - 1}\n"
        return "".join(f"{' '.join(row)}\n" for row in plane) + below


class WorldEnv(TableEnv):
    """A grid world: one that ships, a .toml file, a .txt grid, or "random:SHAPE:DENSITY:SEED". Raises BadInput."""

    def __init__(self, world: str, render_mode: str | None = None):
        loaded = load_world(world)
        super().__init__(loaded.check(), loaded.learner.max_steps - loaded.learner.count_start, render_mode)


class InsertEnv(TableEnv):
    """The camera's grid around a task's toaster, surveyed in simulation in the scene that a seed lays out. Raises BadInput."""

    def __init__(self, task: str = "toast", layout_seed: int = 0, render_mode: str | None = None):
        from lab.skills.insert import Insert
        from lab.skills.prepared_scene import prepare
        from lab.skills.skillset import SkillSet

        loaded = load(task)
        order = loaded.fitting(TAUGHT_WITH)
        name = next(
            (name for name, skill in SkillSet.of(loaded, order).skills.items() if skill.subtask == Insert.subtask), None
        )
        if name is None:
            raise BadInput(f"task '{loaded.name}': no station is approached through the camera's grid")
        problem = prepare(loaded, order, layout_seed, name).problems[name]  # as for a lesson of this seed
        super().__init__(problem.mdp, loaded.subtask(Insert.subtask).learner.max_steps, render_mode)


class CellEnv(gymnasium.Env[Any, Any]):
    """The decision which part the single robot of a cell moves next, in order to finish all parts early.

    Actions are decisions (see `lab.sequencing.simulate.run.Run`), counted from 0: the part, plus the number of parts for the
    second option of its next transfer. Observed are the position of each part on its route, part 1 first, and the robot's
    station, but not the remaining processing times; info["ready_s"] says when each part can be picked [s].
    The reward is minus the time that passed [s], so the return is minus the makespan. info["action_mask"] says which actions are
    allowed; any other action changes nothing and costs `penalty_s`, the duration of the slowest decision. A deadlock ends the
    episode, whose return, apart from penalties, is then minus `stuck_cost`.
    chance: if given, processing times and arrivals are drawn anew in each episode.
    """

    metadata = METADATA

    def __init__(self, cell: Cell, chance: Chance | None = None, render_mode: str | None = None):
        self.cell, self.chance, self.render_mode = cell, chance or NO_CHANCE, render_mode
        self.penalty_s = _slowest_s(cell)
        ways = 1 + max(option.choice for place in cell.positions for option in place.options)
        self._decisions = [entry(part, way, cell.parts) for way in range(ways) for part in range(1, cell.parts + 1)]
        self.action_labels = tuple(
            cell.part_name(part) if way == 0 else f"{cell.part_name(part)} by way {way + 1}"
            for way in range(ways)
            for part in range(1, cell.parts + 1)
        )
        self.max_episode_steps = ROOM * cell.parts * len(cell.positions)
        self.observation_space = spaces.MultiDiscrete([len(cell.positions)] * cell.parts + [len(cell.stations)])
        self.action_space = spaces.Discrete(len(self._decisions))
        self._begin(Episode(cell, self.chance))

    def _begin(self, times: Episode) -> None:
        self._run, self._steps = Run(self.cell, times), 0
        self._allowed = self._run.allowed()

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Places, Info]:
        """The observation and info with all parts before their first station and the robot at its start."""
        super().reset(seed=seed)
        self._begin(Episode(self.cell, self.chance, int(self.np_random.integers(1 << 63))))
        return self._observed(), self._info()

    def step(self, action: int) -> tuple[Places, float, bool, bool, Info]:
        """The outcome of the decision, when the robot has set the part down."""
        run, decision = self._run, self._decisions[action]
        before_s, self._steps = run.now_s, self._steps + 1
        if decision in self._allowed:
            run.move(decision)
            self._allowed = run.allowed()
            stuck = not (run.done or self._allowed)
            reward = before_s - (stuck_cost(self.cell, MAKESPAN) if stuck else run.now_s)
        else:
            reward = -self.penalty_s
        terminated = not self._allowed
        truncated = not terminated and self._steps >= self.max_episode_steps
        return self._observed(), reward, terminated, truncated, self._info()

    def action_masks(self) -> NDArray[np.int8]:
        """The allowed actions, (A,) int8 of 0 and 1; the name is the one that learners with masks use."""
        return np.array([decision in self._allowed for decision in self._decisions], np.int8)

    def render(self) -> str | None:
        """The positions of robot and parts, and when parts can be picked, as text; None unless the render mode is "ansi"."""
        if self.render_mode != "ansi":
            return None
        run, cell = self._run, self.cell
        lines = [f"{run.now_s:.0f} s: the robot is at '{cell.names[run.robot]}'"]
        for part, (place, ready_s) in enumerate(zip(run.locations, run.ready_s, strict=True), 1):
            waits = f", ready in {ready_s - run.now_s:.0f} s" if ready_s > run.now_s else ""
            finished = ", finished" if run.finished_s[part - 1] is not None else waits
            lines.append(f"{cell.part_name(part)}: '{cell.names[cell.positions[place].station]}'{finished}")
        return "".join(f"{line}\n" for line in lines)

    def _observed(self) -> Places:
        return np.array([*self._run.locations, self._run.robot], np.int64)

    def _info(self) -> Info:
        run = self._run
        times = {"now_s": run.now_s, "ready_s": list(run.ready_s)}
        return {"action_mask": self.action_masks(), "is_success": run.done, **times}


def _slowest_s(cell: Cell) -> float:
    """An upper bound [s] on the duration of a decision, for times that are not drawn."""
    travel_s = sum(float(np.nanmax(table, initial=0.0)) for table in (cell.empty_s, cell.loaded_s))
    service_s = max((option.service_s for place in cell.positions for option in place.options), default=0.0)
    process_s = max(place.processing_s or 0.0 for place in cell.positions)
    return travel_s + service_s + process_s + max(cell.arrivals.interval_s if cell.arrivals else (), default=0.0)


class ToastCellEnv(CellEnv):
    """The thesis's toast cell with the times of its cases I, II and III. Raises BadInput for others."""

    def __init__(self, case: str = "I", toasts: int = 3, stochastic: bool = False, render_mode: str | None = None):
        file = load_cell(toast_case(case))
        super().__init__(file.cell(toasts), file.chance() if stochastic else None, render_mode=render_mode)


class FmsEnv(CellEnv):
    """The thesis's flexible manufacturing system, for an order by the products' initials. Raises BadInput for others."""

    def __init__(self, order: str = "RSR", stochastic: bool = False, render_mode: str | None = None):
        file = load_cell("fms")
        cell = file.cell(order_from_word(file, order))
        super().__init__(cell, file.chance() if stochastic else None, render_mode=render_mode)


class RiverSwimEnv(TableEnv):
    """RiverSwim, a stochastic problem without goals whose episodes have 20 steps; see `transition_arrays.river_swim`."""

    def __init__(self, states: int = 6, max_episode_steps: int | None = 20, render_mode: str | None = None):
        if not isinstance(states, int) or not 3 <= states <= MOST_BANKS:
            raise BadInput(f"states {states!r}: allowed are 3 to {MOST_BANKS}")
        self.river = ArrayEnvironment.of(*river_swim(states), 0, (), (), ("left", "right"))
        super().__init__(self.river.mdp, max_episode_steps, render_mode)

    @cached_property
    def P(self) -> dict[int, dict[int, list[tuple[float, int, float, bool]]]]:
        """The outcomes of each action in each state: (probability, state, reward, whether the episode ends)."""
        chances, gain = self.river.chances, self.mdp.reward.tolist()
        return {
            state: {
                a: [(float(row[to]), int(to), gain[state][a], False) for to in np.flatnonzero(row)]
                for a, row in enumerate(rows)
            }
            for state, rows in enumerate(chances)
        }

    def render(self) -> str | None:
        """The river from bank to bank, with the swimmer as R."""
        if self.render_mode != "ansi":
            return None
        return " ".join("R" if state == self.s else "." for state in range(self.mdp.n_states)) + "\n"

    def step(self, action: int) -> tuple[int, float, bool, bool, Info]:
        """The outcome that a drawn number selects."""
        left = self.s
        self.s, self._moves = (
            int(self.np_random.choice(self.mdp.n_states, p=self.river.chances[left, action])),
            self._moves + 1,
        )
        truncated = self.max_episode_steps is not None and self._moves >= self.max_episode_steps
        return self.s, float(self.mdp.reward[left, action]), False, truncated, {"is_success": False}


ENVIRONMENTS: dict[str, tuple[type[TableEnv] | type[CellEnv], dict[str, Any]]] = {
    "TeachingLab/World1-v0": (WorldEnv, {"world": "world-1"}),
    "TeachingLab/World2-v0": (WorldEnv, {"world": "world-2"}),
    "TeachingLab/World-v0": (WorldEnv, {"world": "random:8x8:0.2:0"}),
    "TeachingLab/Insert-v0": (InsertEnv, {}),
    "TeachingLab/ToastCell-v0": (ToastCellEnv, {}),
    "TeachingLab/FMS-v0": (FmsEnv, {}),
    "TeachingLab/RiverSwim-v0": (RiverSwimEnv, {}),
}


def register() -> None:
    """Registers the environments of ENVIRONMENTS that are not registered yet."""
    for name, (made, keywords) in ENVIRONMENTS.items():
        if name not in gymnasium.registry:
            gymnasium.register(name, f"{__name__}:{made.__name__}", kwargs=keywords)
