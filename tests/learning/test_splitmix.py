"""Splitmix is the published stream, found from its beginning or at any place, plain or compiled."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from lab.learning.splitmix import stream, uniform
from lab.sequencing.simulate import room_kernels as kernels

SEEDS = st.integers(0, 2**64 - 1)


def test_it_is_the_published_stream() -> None:
    # the first outputs of the reference program for seed 1234567, as 53-bit fractions
    published = (6457827717110365317, 3203168211198807973, 9817491932198370423)
    draw = stream(1234567)
    assert [draw() for _ in range(3)] == [(number >> 11) * 2.0**-53 for number in published]


@given(seed=SEEDS)
def test_each_number_is_found_by_its_place(seed: int) -> None:
    draw = stream(seed)
    assert [draw() for _ in range(5)] == [uniform(seed, number) for number in range(5)]


@given(seed=SEEDS, number=st.integers(0, 2**40))
@settings(deadline=None)
def test_compiled_it_is_the_same(seed: int, number: int) -> None:
    assert kernels.uniform(np.uint64(seed), number) == uniform(seed, number)
