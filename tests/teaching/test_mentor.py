"""A mentor for policies of any origin: its rules of doubt by hand, and how it is calibrated."""

from math import log

import numpy as np
import pytest

import lab
from lab.errors import BadInput
from lab.teaching.mentor import NAMES, disagreement, entropy, margin


def test_the_rules_by_hand() -> None:
    assert margin([[1.0, 3.0, 2.0]]) == 0.5  # the best is half of the width ahead
    assert margin([[1.0, 1.0]]) == 1.0
    assert margin([[0.0, 4.0, 0.0]]) == 0.0
    assert entropy([[0.5, 0.5]]) == pytest.approx(1.0)
    assert entropy([[1.0, 0.0, 0.0]]) == 0.0
    assert entropy([[log(3.0), 0.0]]) == pytest.approx(-(0.75 * log(0.75) + 0.25 * log(0.25)) / log(2.0))  # softmax
    assert disagreement([[1.0, 0.0], [2.0, 1.0], [0.0, 1.0]]) == pytest.approx(1 / 3)


def test_it_says_what_to_do_whether_to_ask_and_why() -> None:
    watched = lab.watch(lambda observation: [1.0, 3.0, 2.0], threshold=0.4)
    look = watched(np.array([0.0]))
    assert (look.action, look.asks) == (1, True)
    assert look.why == "margin: its doubt is 0.50, above 0.40"
    watched.threshold = 0.5
    assert not watched(np.array([0.0])).asks


def test_policies_that_answer_actions_alone_have_mentors_too() -> None:
    three = lab.watch([lambda o: 1, lambda o: 2, lambda o: 2], "ensemble", threshold=0.3)
    assert (three(0).action, three(0).asks) == (2, True)
    visits = lab.watch(lambda o: 0, "visits", seen=[0.11, 0.12, 0.5])
    assert [round(visits(o).doubt, 2) for o in (0.13, 0.5, 0.9)] == [0.33, 0.5, 1.0]
    circles = lab.watch(lambda o: 0, "circles", threshold=0.4)
    assert [circles(state).asks for state in (1, 2, 1, 3)] == [False, False, True, False]
    circles.begin()
    assert not circles(1).asks


def test_observations_of_gymnasium_may_be_dictionaries() -> None:
    seen = [{"image": np.zeros((2, 2), np.uint8), "direction": 1}]
    visits = lab.watch(lambda o: 0, "visits", seen=seen)
    assert visits(seen[0]).doubt == 0.5
    assert visits({"image": np.zeros((2, 2), np.uint8), "direction": 2}).doubt == 1.0


def test_it_takes_what_predicts_as_stable_baselines_does() -> None:
    class Trained:
        def predict(self, observation: object) -> tuple[np.ndarray, None]:
            return np.array(3), None

    assert lab.watch(Trained(), "circles")(0).action == 3


STEPS = [(0, True), (1, True), (2, False), (3, False)]  # the policy's doubt is the observation's tenth


def test_it_is_calibrated_to_a_share_of_the_steps_or_to_what_is_wrong() -> None:
    watched = lab.watch(lambda o: [0.0, 10.0, float(o)])  # its margin is 1 - (10 - o) / 10
    watched.calibrate([STEPS], share=0.25)
    assert [watched(o).asks for o in range(4)] == [False, False, False, True]
    watched.calibrate([STEPS], caught=1.0)
    assert [watched(o).asks for o in range(4)] == [False, False, True, True]
    watched.calibrate([STEPS[:2], STEPS[2:]], caught=0.5)
    assert [watched(o).asks for o in range(4)] == [False, False, False, True]


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (lambda: lab.watch(lambda o: 0, "marge"), "unknown rule 'marge'.*margin"),
        (lambda: lab.watch(3), "policy 3.*wanted a function"),  # type: ignore[arg-type]
        (lambda: lab.watch(lambda o: 0, "ensemble"), "one policy: wanted a list of two or more"),
        (lambda: lab.watch(lambda o: 0, "visits"), "nothing was seen"),
        (lambda: lab.watch(lambda o: 0)(1), "answers 0: wanted a value for each action"),
        (lambda: lab.watch(lambda o: [0.0, 1.0]).calibrate([]), "no steps"),
        (lambda: lab.watch(lambda o: [0.0, 1.0]).calibrate([[(0, True)]]), "right in every step"),
    ],
)
def test_what_cannot_be_is_refused(make: object, says: str) -> None:
    with pytest.raises(BadInput, match=says):
        make()  # type: ignore[operator]


def test_the_rules_have_names() -> None:
    assert NAMES == ("margin", "entropy", "ensemble", "visits", "circles")
