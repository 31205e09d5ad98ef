"""Chapter 7's printed tables as they were read, and the sessions and comparisons that measure them again."""

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from lab.errors import BadInput
from lab.sequencing.methods.exact import optimum
from lab.statistics import interval, proportion_interval
from lab.studies.runner import Job
from lab_studies.thesis.chapter_7_cells import (
    AS_PRINTED,
    DECAY_FACTORS,
    READINGS,
    SESSION_LENGTHS,
    Measured,
    PrintedFigure,
    SequencingOutcome,
    SequencingSetting,
    describe,
    epsilons,
    optimum_s,
    printed,
    robot_cell,
    sessions_of,
    short_name,
)
from lab_studies.thesis.chapter_7_listing import LISTING

SRL_B = SequencingSetting("I", 3, "srl", 60, reward_factor="B", beta=1.0)
SRL_A = replace(SRL_B, reward_factor="A")
RANDOM = SequencingSetting("I", 3, "random", 60)
MC = SequencingSetting("I", 3, "mc", 60, beta=1.0)


# ---- what is printed ----------------------------------------------------------------------------------------------


def test_all_figures_are_read() -> None:
    cells = printed(SESSION_LENGTHS)
    assert Counter(short_name(cell.setting) for cell in cells) == dict.fromkeys(("srl A", "srl B", "mc", "random"), 108)
    assert Counter(cell.measure for cell in cells) == {"SP_percent": 216, "BR_s": 216}
    assert len({cell.setting for cell in cells}) == len(cells)
    assert len(printed(DECAY_FACTORS)) == 24


def test_what_every_figure_has() -> None:
    """The lengths of its number of toasts, the parameters of its method, the measure of its environment."""
    lengths: dict[int, Any] = {3: {*range(15, 61, 5)}, 4: {*range(50, 401, 50)}}
    for cell in printed(SESSION_LENGTHS):
        setting = cell.setting
        assert setting.episodes in lengths[setting.toasts]
        assert setting.beta == (None if setting.method == "random" else {3: 1.0, 4: 0.5}[setting.toasts])
        assert (setting.reward_factor is not None) == (setting.method == "srl")
        assert cell.measure == {"deterministic": "SP_percent", "stochastic": "BR_s"}[setting.environment]
        if cell.measure == "SP_percent":
            assert 0 < cell.value <= 100
        else:
            assert 0.95 < cell.value / optimum_s(setting.case, setting.toasts) < 1.15


@pytest.mark.parametrize(
    ("file", "expected"),
    [
        (SESSION_LENGTHS, PrintedFigure(replace(SRL_B, episodes=15), "SP_percent", 29)),
        (SESSION_LENGTHS, PrintedFigure(replace(MC, case="III", episodes=60), "SP_percent", 64)),
        (SESSION_LENGTHS, PrintedFigure(SequencingSetting("II", 4, "random", 400, "stochastic"), "BR_s", 910)),
        (
            SESSION_LENGTHS,
            PrintedFigure(SequencingSetting("III", 3, "srl", 15, "stochastic", "A", 1.0), "BR_s", 1041.8),
        ),
        (
            DECAY_FACTORS,
            PrintedFigure(SequencingSetting("II", 3, "srl", 200, reward_factor="A", beta=1.7), "CE_episode", 72.9),
        ),
        (
            DECAY_FACTORS,
            PrintedFigure(SequencingSetting("III", 3, "srl", 200, reward_factor="A", beta=1.0), "SP_percent", 98),
        ),
    ],
)
def test_printed_figures(file: str, expected: PrintedFigure) -> None:
    assert expected in printed(file)


@pytest.mark.parametrize(("case", "three", "four"), [("I", 513, 663), ("II", 700, 900), ("III", 995, 1290)])
def test_the_printed_optima_are_proven(case: str, three: float, four: float) -> None:
    assert (optimum_s(case, 3), optimum_s(case, 4)) == (three, four)
    for toasts, best_s in ((3, three), (4, four)):
        found = optimum(robot_cell(case, toasts))
        assert found.proven
        assert found.bound_s == pytest.approx(best_s)


# ---- sessions -----------------------------------------------------------------------------------------------------


def test_epsilon_falls_by_beta() -> None:
    assert epsilons(replace(SRL_B, episodes=4, beta=0.5)).tolist() == pytest.approx([1, 0.5**0.5, 3**-0.5, 0.5])
    assert epsilons(replace(RANDOM, episodes=3)).tolist() == [1, 1, 1]


@pytest.mark.parametrize("setting", [SRL_A, SRL_B, MC, RANDOM], ids=short_name)
@pytest.mark.parametrize("reading", READINGS)
def test_sessions_of_every_reading(setting: SequencingSetting, reading: str) -> None:
    """As many as asked for, the same again, others with another seed, and none better than the optimum."""
    asked = replace(setting, reading=reading)
    found, again, other = sessions_of(asked, 20, 1), sessions_of(asked, 20, 1), sessions_of(asked, 20, 2)
    for name in ("best_s", "converged"):
        np.testing.assert_array_equal(getattr(found, name), getattr(again, name))
        assert getattr(found, name).shape == (20,)
    assert found.best_s.tolist() + found.converged.tolist() != other.best_s.tolist() + other.converged.tolist()
    assert found.best_s.min() >= 513
    assert ((found.converged >= 1) & (found.converged <= 60)).all()


def test_chance_is_drawn_where_it_is_asked_for() -> None:
    for reading in ("listing", AS_PRINTED):
        drawn = sessions_of(replace(MC, environment="stochastic", reading=reading), 20, 0).best_s
        assert len({*drawn.tolist()}) == 20
        assert len({*sessions_of(replace(MC, reading=reading), 20, 0).best_s.tolist()}) < 10


def test_what_is_read_otherwise() -> None:
    """One setting of the listing each, but for the library's own SRL; they do not share sessions."""
    others = {name: reading for name, reading in READINGS.items() if reading not in (None, LISTING)}
    for reading in others.values():
        assert reading is not None
        assert sum(getattr(reading, name) != getattr(LISTING, name) for name in vars(LISTING)) == 1
    assert (READINGS["listing"], READINGS[AS_PRINTED]) == (LISTING, None)
    with pytest.raises(BadInput, match=r"^unknown reading 'figure 5' \(chapter 7\): did you mean 'figure 5\.1'\?"):
        SequencingSetting("I", 3, "mc", 15, reading="figure 5")


# ---- measured -----------------------------------------------------------------------------------------------------

MADE = {
    SRL_B: SequencingOutcome(
        np.array([513.0] * 15 + [520.0] * 5), np.array([513.0] * 4 + [600.0] * 16), np.arange(1, 21)
    ),
    MC: SequencingOutcome(np.array([513.0, 520.0] * 10), np.full(20, 600.0), np.arange(1, 21)),
    RANDOM: SequencingOutcome(np.array([513.0, 520.0, 530.0, 540.0] * 5), np.full(20, 600.0), np.arange(1, 21)),
}
DRAWN = {replace(setting, environment="stochastic"): outcome for setting, outcome in MADE.items()}


class MadeUp(Job):
    """Sessions that came to what stands in MADE."""

    def each(self, work: Callable[[Any], Any], items: Sequence[Any]) -> dict[Any, Any]:
        return {item: (MADE | DRAWN)[item] for item in items}


@pytest.fixture
def measured() -> Measured:
    return Measured(MadeUp(20), [*MADE, *DRAWN])


def test_values_and_intervals(measured: Measured) -> None:
    assert measured.sessions == 20
    best_s = MADE[SRL_B].best_s
    expected = {
        "SP_percent": proportion_interval(15, 20),
        "final_percent": proportion_interval(4, 20),
        "BR_s": interval(best_s),
        "CE_episode": interval(np.arange(1, 21)),
    }
    rows = {measure: measured.row("Table 7.4", SRL_B, measure, None) for measure in expected}
    assert {measure: (one["value"], *one["ci95"]) for measure, one in rows.items()} == expected
    assert [one["value"] for one in rows.values()] == [75, 20, 514.75, 10.5]


def test_ten_replications(measured: Measured) -> None:
    """Two sessions each: SP where times are fixed, else the mean best time."""
    assert measured.replicated(SRL_B).tolist() == [100] * 7 + [50] + [0] * 2
    assert measured.replicated(MC).tolist() == [50] * 10
    drawn = replace(SRL_B, environment="stochastic")
    assert measured.replicated(drawn).tolist() == [513] * 7 + [516.5] + [520] * 2


def test_methods_are_compared(measured: Measured) -> None:
    """The highest percentage is best, and the lowest time."""
    found = measured.compared([SRL_B, MC, RANDOM])
    assert found.means == {"srl B": 75, "mc": 50, "random": 25}
    assert found.ranks["srl B"][0] == "1"
    assert found.ranks["random"][-1] == "2"
    drawn = measured.compared(list(DRAWN))
    assert sorted(drawn.means, key=lambda name: drawn.means[name]) == ["srl B", "mc", "random"]
    assert drawn.ranks["srl B"] == "1"
    assert drawn.ranks["random"] == "2"


def test_a_row_has_what_applies(measured: Measured) -> None:
    found = measured.row("Table 7.4", SRL_B, "SP_percent", 73, rank="1")
    share, low, high = proportion_interval(15, 20)
    assert found == {
        "table": "Table 7.4",
        "environment": "deterministic",
        "case": "I",
        "toasts": 3,
        "method": "srl",
        "reward_factor": "B",
        "beta": 1.0,
        "episodes": 60,
        "reading": "listing",
        "rank": "1",
        "measure": "SP_percent",
        "value": share,
        "ci95": [low, high],
        "thesis": 73,
        "within": True,
        "within_errors": True,
        "used": False,
    }
    assert describe(RANDOM).keys() == {"environment", "case", "toasts", "method", "episodes", "reading"}


def test_settings_are_measured_once_and_the_same_everywhere() -> None:
    settings = [replace(setting, episodes=10) for setting in (SRL_B, MC, SRL_B, RANDOM)]
    told: list[tuple[int, int]] = []
    one = Measured(Job(10, progress=lambda *both: told.append(both)), settings).outcomes
    two = Measured(Job(10, workers=2), settings).outcomes
    assert [*one] == [*two] == [settings[0], settings[1], settings[3]]
    assert told == [(0, 3), (1, 3), (2, 3), (3, 3)]
    for setting, outcome in one.items():
        np.testing.assert_array_equal(outcome.best_s, two[setting].best_s)
        np.testing.assert_array_equal(outcome.best_s, sessions_of(setting, 10, 0).best_s)


def test_the_reading_comes_out() -> None:
    """A few printed figures, with 400 sessions: within four standard errors of both (the thesis ran 1000)."""
    wanted = [cell for cell in printed(SESSION_LENGTHS) if cell.setting.case == "II" and cell.setting.episodes == 30]
    assert len(wanted) == 8
    found = Measured(Job(400), [cell.setting for cell in wanted])
    for cell in wanted:
        one = found.row("Table 7.5", cell.setting, cell.measure, cell.value)
        error = (one["ci95"][1] - one["ci95"][0]) / 2 / 1.96
        assert abs(one["value"] - cell.value) < 4 * error * (1 + 400 / 1000) ** 0.5 + 0.5, cell
