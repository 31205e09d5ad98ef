"""Evaluators: their names, whom they judge by, and how late they are."""

from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from lab.advice.advising import Advising
from lab.advice.advisors import AdvisorName, is_external, make_advisor, split_praise
from lab.advice.evaluator import Evaluator
from lab.advice.order_level import OrderLevel
from lab.advice.table_level import TableLevel
from lab.errors import BadInput
from lab.learning.praise import Judgement, Judging
from lab.learning.requests import AdviceRequest, Reply
from lab.mdp import TabularMDP, grid, optimal_values
from lab.tasks.task_file import load_cell
from lab.teaching.lesson_options import recorded_whole


def board() -> TabularMDP:
    """Two ways are equally short from the start: down and right."""
    return grid((3, 3), np.zeros((3, 3), bool), (0, 0), (2, 2), action_labels=("up", "down", "left", "right"))


def request(own: int, step: int = 1, episode: int = 1, state: int = 0) -> AdviceRequest:
    mdp = board()
    q = [[0.0] * 4] * 9
    return AdviceRequest(
        mdp=mdp, q=q, state=state, episode=episode, step=step, own=own, allowed=range(4), judgement="only"
    )


def verdicts(name: str, own: int, times: int = 200, state: int = 0) -> Counter[Reply]:
    advisor = TableLevel(board(), 0.99, np.random.default_rng(0)).advisor(AdvisorName.of(name))
    assert advisor is not None
    return Counter(advisor.advise(request(own, state=state)) for _ in range(times))


GOOD, BAD = Judgement(1), Judgement(-1)


@pytest.mark.parametrize(("own", "said"), [(0, BAD), (1, GOOD), (2, BAD), (3, GOOD)])
def test_an_expert_praises_every_best_move(own: int, said: Judgement) -> None:
    assert verdicts("praise:expert", own) == {said: 200}


def test_a_contrary_evaluator_praises_the_worst() -> None:
    values = optimal_values(board(), 0.99)[4]
    best, worst = int(values.argmax()), int(values.argmin())
    assert verdicts("praise:wrong", best, state=4) == {BAD: 200}
    assert verdicts("praise:wrong", worst, state=4) == {GOOD: 200}


def test_the_accuracy_is_that_with_which_it_praises_the_best() -> None:
    told = verdicts("praise:accuracy=0.8", 1, 3000)
    assert 0.7 < told[GOOD] / 3000 < 0.9


def test_answers_in_a_file_judge_where_they_are(tmp_path: Path) -> None:
    (tmp_path / "mine.json").write_text('{"(0, 0)": "down"}')
    name = f"praise:late=0:answers:{tmp_path / 'mine.json'}"
    assert verdicts(name, 1, 3) == {GOOD: 3}
    assert verdicts(name, 3, 3) == {BAD: 3}  # as good, but not what was said
    assert verdicts(name, 3, 3, state=4) == {None: 3}


class Says:
    """Names an action by the step."""

    def __init__(self, *actions: int):
        self.actions = actions

    def advise(self, asked: AdviceRequest) -> int:
        return self.actions[asked.step - 1]


def test_late_judgements_by_hand() -> None:
    """Drawn: 0, 1 and 2 moves late; then 1 move late in the first step of an episode, when there is nothing to judge."""
    drawn = iter([0.0, 0.4, 0.9, 0.4])
    late = Evaluator(Says(1, 2, 3), Judging(True, 2), lambda: next(drawn))
    said = [late.advise(request(1, step)) for step in (1, 2, 3)]
    assert said == [GOOD, GOOD, GOOD]
    assert late.advise(request(1, 1, episode=2)) is None


def test_a_person_judges_himself() -> None:
    level = TableLevel(board(), 0.99, np.random.default_rng(0), {"terminal": lambda asked: Judgement(-2, 3)})
    advisor = level.advisor(AdvisorName.of("praise:late=4:terminal"))
    assert isinstance(advisor, Evaluator)
    assert advisor.judging == Judging(True, 4)
    assert advisor.advise(request(1)) == Judgement(-2, 3)


def test_in_a_region_only() -> None:
    region = np.zeros(9, bool)
    level = TableLevel(board(), 0.99, np.random.default_rng(0), {"web": lambda asked: GOOD}, region)
    advisor = level.advisor(AdvisorName.of("praise:web"))
    assert advisor is not None
    assert advisor.advise(request(1)) is None
    assert getattr(advisor, "judging", None) == Judging(True)


# ---- names ----------------------------------------------------------------------------------------------------------


def test_a_name_has_the_parameters_of_whom_it_names() -> None:
    name = AdvisorName.of("praise:late=3:rule=coach:tau=0.2")
    assert (str(name), name.row, name.taus) == ("praise:late=3:rule=coach:tau=0.2", "praise:WHO", (0.2,))
    assert name.inner == AdvisorName.of("tau=0.2")
    assert name.judging == Judging(True, 3, "coach")
    assert Advising.of(["praise:recorded:here"]).records


def test_the_parts_of_a_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert split_praise("praise:late=2:terminal") == ("terminal", "late=2:")
    assert split_praise("terminal") == ("terminal", "")
    assert is_external("praise:web")
    assert not is_external("praise:expert")
    monkeypatch.chdir(tmp_path)
    assert recorded_whole("praise:late=1:recorded:a,b") == f"praise:late=1:recorded:{tmp_path / 'a,b'}"
    assert recorded_whole("praise:expert") == "praise:expert"


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("praise:", "it names nobody who judges: wanted praise:WHO"),
        ("praise:none", "'none' judges no moves"),
        ("praise:praise:expert", "'praise:expert' judges no moves"),
        ("praise:llm:http://127.0.0.1/v1#m", "judges no moves"),
        ("praise:exprt", "unknown advisor 'exprt'"),
        ("praise:late=x:expert", "late=x: allowed are 0 to 99 moves"),
        ("praise:late=100:expert", "late=100: allowed are 0 to 99 moves"),
        ("praise:lat=1:expert", "unknown advisor 'lat=1:expert'"),
    ],
)
def test_bad_names(name: str, message: str) -> None:
    with pytest.raises(BadInput) as error:
        AdvisorName.of(name, "--advisor")
    assert str(error.value).startswith("advisor 'praise:...' (--advisor): ")
    assert message in str(error.value)
    assert "\n" not in str(error.value)


def test_an_evaluator_is_named_alone() -> None:
    with pytest.raises(BadInput, match=r"'praise:expert' \(--advisor\) beside 1 more: it judges moves"):
        Advising.of(["praise:expert", "expert"])


def test_an_order_is_not_judged() -> None:
    level = OrderLevel(load_cell("toast-case-1").cell(1), np.random.default_rng(0), {"terminal": lambda asked: None})
    with pytest.raises(BadInput, match="'praise:terminal': it judges the steps of a sub-task, not the order"):
        make_advisor(AdvisorName.of("praise:terminal"), level)
