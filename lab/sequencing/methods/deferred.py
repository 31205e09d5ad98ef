"""Lazy imports of what is compiled or solved with: numba and OR-Tools take their time, and many cells need neither."""

from typing import TYPE_CHECKING

from lab.lazy import loader

if TYPE_CHECKING:
    from lab.sequencing.cyclic.model import CycleModel, Units
    from lab.sequencing.methods import carried_over_kernels, one_robot_kernels
    from lab.sequencing.methods.anneal import Annealing
    from lab.sequencing.methods.cp_sat import TIME_LIMIT_S as CP_SAT_TIME_LIMIT_S
    from lab.sequencing.methods.cp_sat import beside, cp_sat, fits

TABLE = {
    "lab.sequencing.cyclic.model": ("CycleModel", "Units"),
    "lab.sequencing.methods": ("carried_over_kernels", "one_robot_kernels"),
    "lab.sequencing.methods.anneal": ("Annealing",),
    "lab.sequencing.methods.cp_sat": ("TIME_LIMIT_S as CP_SAT_TIME_LIMIT_S", "beside", "cp_sat", "fits"),
}

if not TYPE_CHECKING:  # so that mypy knows the names of the table alone
    __getattr__ = loader(__name__, TABLE)
