"""What can be a carried-over policy."""

import numpy as np
import pytest

from lab.errors import BadInput
from lab.sequencing.methods.carried_over_policy import CarriedPolicy


def test_what_is_no_policy() -> None:
    with pytest.raises(BadInput, match=r"^unknown feature 'dely' \(policy\): did you mean 'delay'\?"):
        CarriedPolicy({"dely": 1.0})
    with pytest.raises(BadInput, match=r"^weight of 'delay' = nan: allowed are finite numbers"):
        CarriedPolicy({"delay": float("nan")})
    with pytest.raises(BadInput, match=r"^unknown objective 'makespam' \(policy\): did you mean 'makespan'\?"):
        CarriedPolicy({}, "makespam")
    assert not np.any(CarriedPolicy({}).vector)
