"""The best order of an episode with times known in advance, which bounds every policy."""

from dataclasses import dataclass, replace

from lab.errors import WorkFailed
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.chance import Episode
from lab.sequencing.cell.stations import Begins, Product, Stage
from lab.sequencing.methods.cp_sat import cp_sat
from lab.sequencing.methods.exact import optimum

SECONDS = 10.0  # CP-SAT's for an episode; small cells need less


@dataclass(frozen=True)
class Hindsight:
    """The cost of the best order of an episode, or a lower bound if that order is not proven."""

    cost: float
    proven: bool


def in_hindsight(cell: Cell, times: Episode, max_expanded: int = 20_000) -> Hindsight:
    """The shortest makespan of a cell in an episode, or a bound: by A* for one robot (`optimum`), else by CP-SAT.

    Breakdowns of robots are left out, so that the makespan is then a bound. Raises WorkFailed if there is none.
    """
    known, whole = known_cell(cell, times), not times.chance.robot_breaks_every_s
    if cell.serial:
        proof = optimum(known, max_expanded)
        return Hindsight(proof.bound_s, proof.proven and whole)
    best = cp_sat(known, time_limit_s=SECONDS)
    rounding_s = 2.0 * known.possible_moves * best.rounded_s  # the bound is one of rounded times
    return Hindsight(max(0.0, best.bound - rounding_s), best.status == "optimal" and whole)


def known_cell(cell: Cell, times: Episode) -> Cell:
    """The cell of an episode: each part is a product of its own with its times, and arrives when it does in the episode.

    Raises WorkFailed for a cell whose parts are already under way.
    """
    if cell.begin_at != cell.starts:
        raise WorkFailed("hindsight: some parts are under way")
    numbers = range(1, cell.parts + 1)
    products = tuple(_as_drawn(cell, times, part) for part in numbers)
    arrivals = cell.arrivals
    if arrivals is not None:
        arrivals = replace(arrivals, interval_s=tuple(times.interval_s(part) for part in numbers))
    order = tuple(product.name for product in products)
    known = replace(cell, products=products, order=order, arrivals=arrivals, begins=None)
    come_s = [seconds + times.late_s(part) for part, seconds in zip(numbers, cell.begin_s, strict=True)]
    if arrivals is not None or not any(come_s):
        return known
    return replace(known, begins=tuple(map(Begins, known.starts, come_s)))


def _as_drawn(cell: Cell, times: Episode, part: int) -> Product:
    product = next(known for known in cell.products if known.name == cell.order[part - 1])
    number = cell.positions[cell.starts[part - 1]].product
    working = {station.name for station in cell.stations if station.kind == "machine"}
    # The positions in which work begins stand in the order of the routes and their stages.
    drawn = iter(
        (cell.names[at.holds[0]], times.processing_s(part, place))
        for place, at in enumerate(cell.positions)
        if at.product == number and at.processing_s is not None and at.holds and cell.names[at.holds[0]] in working
    )

    def timed(stage: Stage) -> Stage:
        if stage.station not in working:
            return stage
        station, processing_s = next(drawn)
        assert station == stage.station
        return replace(stage, processing_s=processing_s)

    routes = tuple(tuple(stage.each(timed) for stage in route) for route in product.routes)
    return Product(f"{product.name} {part}", routes)
