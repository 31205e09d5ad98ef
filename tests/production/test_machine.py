"""A machine's life by the clock: idle, busy, done; slow, and one that never ends."""

import pytest

from lab.production.machine import NEVER, Machine


def test_it_is_done_after_its_time() -> None:
    oven = Machine("oven")
    assert not oven.done(5.0)  # with nothing
    oven.begin("toast 1", 10.0, 60.0)
    assert (oven.part, oven.until_s, oven.moves, oven.failed) == ("toast 1", 70.0, False, "")
    assert [oven.done(at_s) for at_s in (69.9, 70.0)] == [False, True]
    oven.clear()
    assert (oven.part, oven.done(80.0)) == ("", False)


@pytest.mark.parametrize(("share", "fails", "until_s"), [(1.5, False, 100.0), (1.0, True, NEVER)])
def test_a_slow_one_takes_longer_and_one_that_fails_never_ends(share: float, fails: bool, until_s: float) -> None:
    oven = Machine("oven", share, fails)
    oven.begin("toast 1", 10.0, 60.0)
    assert oven.until_s == until_s
    assert not oven.done(99.0)
    assert oven.done(101.0) is not fails
