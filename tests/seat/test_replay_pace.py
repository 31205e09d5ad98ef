"""The pace of a replay: how long it waits between two answers, and what keys make of that."""

import threading
import time
from typing import Any

from hypothesis import given
from hypothesis import strategies as st

from lab.seat.replay_pace import FASTEST, SLOWEST, WORDS, ReplayPace


def waited(pace: ReplayPace) -> threading.Thread:
    """A thread that waits for the next answer."""
    thread = threading.Thread(target=pace.wait, daemon=True)
    thread.start()
    return thread


def test_it_goes_on_by_itself_after_the_pause_over_the_speed() -> None:
    pace = ReplayPace(0.2)
    pace.do("slower")
    began_s = time.monotonic()
    pace.wait()
    assert time.monotonic() - began_s >= 0.4
    ReplayPace(0.0).wait()  # at once


def test_a_paused_one_waits_for_a_step_or_to_go_on() -> None:
    pace = ReplayPace(0.0)
    pace.do("pause")
    thread = waited(pace)
    thread.join(0.5)
    assert thread.is_alive()
    pace.do("step")
    thread.join(5)
    assert not thread.is_alive()
    assert pace.now()["paused"]
    thread = waited(pace)
    thread.join(0.5)
    assert thread.is_alive()
    pace.do("pause")  # the same key goes on
    thread.join(5)
    assert not thread.is_alive()


def test_a_step_of_a_running_one_pauses_it_at_the_next_answer() -> None:
    pace = ReplayPace(3600.0)
    thread = waited(pace)
    pace.do("step")
    thread.join(5)
    assert not thread.is_alive()
    assert pace.now() == {"paused": True, "speed": 1.0}


@given(st.lists(st.sampled_from(WORDS), max_size=30))
def test_who_listens_knows_pause_and_speed(words: list[str]) -> None:
    heard = list[dict[str, Any]]()
    pace = ReplayPace(1.0, heard.append)
    for word in words:
        pace.do(word)
    assert [{"paused": False, "speed": 1.0}, *heard][-1] == pace.now()
    assert SLOWEST <= pace.now()["speed"] <= FASTEST
