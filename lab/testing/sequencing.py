"""The contract of sequencing methods: the order is feasible, has the stated cost, and beats no proven bound."""

from lab.sequencing import SEQUENCERS, Find, find_sequence
from lab.sequencing.cell.cell import Cell
from lab.sequencing.methods.exact import optimum
from lab.sequencing.search import EpisodeSequenced, Search, SequenceResult
from lab.sequencing.simulate.follow import simulate
from lab.tasks.task_file import load_cell
from lab.testing.requirement import require

NEAR_S = 1e-5
SMALL = ("toast-case-1", "toast-case-2", "toast-case-3")


def check_sequencer(method: str | Find) -> None:
    """Tests a method, given by name or as a function of cell, search and generator, on two toasts in each cell of the thesis."""
    name = method if isinstance(method, str) else SEQUENCERS.use(method.__name__, method)
    for cell in SMALL:
        check_order(name, load_cell(cell).cell(2), seed=1)


def check_order(name: str, cell: Cell, seed: int) -> SequenceResult:
    """The result of a method for a cell, tested: feasible, consistent with its events, and not below the optimum."""
    seen: list[EpisodeSequenced] = []
    result = find_sequence(cell, name, Search(20, on_episode=seen.append), seed)
    cost, what = simulate(cell, result.sequence).makespan_s, f"method '{name}', seed {seed}"
    require(abs(cost - result.cost) <= NEAR_S, f"{what}: its order takes {cost} s, it says {result.cost}")
    best = optimum(cell).cost
    require(result.cost >= best - NEAR_S, f"{what}: {result.cost} s is below the proven optimum, {best} s")
    require(result.cost == min(result.episode_costs), f"{what}: its cost is not that of its best episode")
    told = tuple(event.cost for event in seen)
    require(told == result.episode_costs, f"{what}: {len(told)} episodes told, {len(result.episode_costs)} counted")
    return result
