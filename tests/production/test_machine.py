"""A machine's life by the clock: busy with each part and done with it by itself; slow, and one that never ends."""

import pytest

from lab.production.machine import NEVER, Machine


def test_it_is_done_after_its_time() -> None:
    oven = Machine("oven")
    work = oven.begin("toast 1", 10.0, 60.0)
    assert (work.station, work.begun_s, work.expected_s, work.until_s) == ("oven", 10.0, 70.0, 70.0)
    assert (work.moves, work.failed, oven.moves) == (False, "", False)
    assert [work.done(at_s) for at_s in (69.9, 70.0)] == [False, True]
    oven.clear("toast 1")
    assert oven.works == {}


@pytest.mark.parametrize(("share", "fails", "until_s"), [(1.5, False, 100.0), (1.0, True, NEVER)])
def test_a_slow_one_takes_longer_and_one_that_fails_never_ends(share: float, fails: bool, until_s: float) -> None:
    work = Machine("oven", share, fails).begin("toast 1", 10.0, 60.0)
    assert (work.until_s, work.expected_s) == (until_s, 70.0)
    assert not work.done(99.0)
    assert work.done(101.0) is not fails


def test_each_part_has_a_clock_of_its_own() -> None:
    """One that is taken out changes nothing for the other, and one that is put in again begins anew."""
    oven = Machine("oven")
    first, second = oven.begin("toast 1", 10.0, 60.0), oven.begin("toast 2", 25.0, 30.0)
    assert [first.until_s, second.until_s] == [70.0, 55.0]
    assert [first.done(60.0), second.done(60.0)] == [False, True]
    oven.clear("toast 2")
    assert [*oven.works] == ["toast 1"]
    assert oven.begin("toast 1", 100.0, 60.0).until_s == 160.0
    oven.clear("toast 3")  # which was never in it
    assert [*oven.works] == ["toast 1"]


def test_a_fault_meets_every_part_that_is_not_done() -> None:
    """From 40 s on half as long again: what is left of the second, 30 s, takes 45; the first is done and stays so."""
    oven = Machine("oven")
    first, second = oven.begin("toast 1", 0.0, 30.0), oven.begin("toast 2", 10.0, 60.0)
    oven.slow_down(1.5, 40.0)
    assert [first.until_s, second.until_s] == [30.0, 85.0]
    oven.fail(40.0)
    assert [first.until_s, second.until_s] == [30.0, NEVER]
    oven.slow_down(1.5, 41.0)
    assert second.until_s == NEVER
