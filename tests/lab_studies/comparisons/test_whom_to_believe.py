"""Whom to believe: advisors of known reliability, and a panel that ranks them."""

import numpy as np

from lab_studies.comparisons import whom_to_believe
from lab_studies.comparisons.whom_to_believe import (
    RANKED,
    RELIABILITIES,
    Setting,
    reliable_chances,
    rows_of,
    sessions_of,
)


def test_an_advisor_is_right_as_often_as_is_said() -> None:
    values = np.array([[1.0, 1.0, 0.0, 0.5], [0.0, 2.0, 1.0, 1.0], [3.0, 3.0, 3.0, 3.0]])
    chances = reliable_chances(values, 0.9)
    assert np.allclose(chances[0], [0.45, 0.45, 0.05, 0.05])
    assert np.allclose(chances[1], [0.1 / 3, 0.9, 0.1 / 3, 0.1 / 3])
    assert np.allclose(chances[2], 0.25)  # nothing is wrong there


def test_seven_are_ranked_by_a_panel_that_is_asked_about_every_step() -> None:
    setting = Setting("insert", RANKED, "always", len(RELIABILITIES))
    told = sessions_of(setting, 2, 0)
    nobody = Setting("insert", whom_to_believe.LIMITED, "never", 0)
    rows = rows_of(setting, told, {setting: told, nobody: sessions_of(nobody, 2, 0)})
    trusts = [one["value"] for one in rows if one["measure"] == "trust"]
    assert trusts == sorted(trusts)
    right = next(one for one in rows if one["measure"] == "ranking_right_percent")
    assert right["value"] == 100.0
    assert next(one for one in rows if one["measure"] == "gain_points")["value"] > 0.0
