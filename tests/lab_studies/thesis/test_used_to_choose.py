"""What was used to choose: the predicate beside the code that chooses."""

import pytest

from lab_studies.thesis.chapter_7_cells import SESSION_LENGTHS
from lab_studies.thesis.chapter_7_cells import printed as printed_7
from lab_studies.thesis.chapter_9_cells import FILES, printed
from lab_studies.thesis.used_to_choose import ALL_ADVISORS, DECAY_TABLE, is_used, is_used_7
from lab_studies.thesis.world_2 import is_compared


@pytest.mark.parametrize(
    ("world", "tau", "used"),
    [
        ("world-1", None, False),  # 63 % of nobody's advice: no table had a part in it
        ("world-1", 0.1, True),
        ("world-1", ALL_ADVISORS, True),
        ("world-2", None, True),  # 37 %
        ("world-2", 0.01, True),
        ("world-2", 0.1, False),
        ("world-2", 0.3, False),
        ("world-2", 1.0, True),
        ("world-2", ALL_ADVISORS, True),
    ],
)
def test_cells_of_chapter_9(world: str, tau: float | str | None, used: bool) -> None:
    assert is_used(world, tau) is used


def test_what_the_reconstruction_compares_is_used() -> None:
    """Of single lines of Appendix V's world II exactly those; one of tables 9.4 and 9.5 is not there."""
    appendix, best = map(printed, FILES)
    for line in appendix:
        if line.setting.world == "world-2" and not line.average:
            assert is_used("world-2", line.setting.tau) == is_compared(line, line.setting.view)
    settings = {line.setting for line in appendix}
    (other,) = (line.setting for line in best if line.setting.world == "world-2" and line.setting not in settings)
    assert (other.tau, other.lambda_threshold) == (1.0, 0.9)


def test_cells_of_chapter_7() -> None:
    assert is_used_7(DECAY_TABLE, "A", 3)
    assert is_used_7("Table IV.2", "A", 4)
    assert not is_used_7("Table IV.2", "A", 3)
    settings = [cell.setting for cell in printed_7(SESSION_LENGTHS)]
    used = {
        (one.method, one.reward_factor, one.toasts) for one in settings if is_used_7("", one.reward_factor, one.toasts)
    }
    assert used == {("srl", "A", 4)}
