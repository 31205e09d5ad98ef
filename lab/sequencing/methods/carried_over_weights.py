"""The carried-over policy that ships: what `lab study run carried-over --seed 0` learns on small cells of all families."""

from collections.abc import Mapping

SHIPPED: Mapping[str, float] = {"delay": -1.0}
