"""Chapter 9's printed tables as they were read, and measured again: whose means and scores a reader can redo."""

from collections import Counter
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from lab.statistics import compare, interval, proportion_interval, score
from lab.studies.findings import marked
from lab.studies.runner import Job
from lab_studies.thesis import chapter_9_cells
from lab_studies.thesis.chapter_9_cells import (
    BETAS,
    FILES,
    TABLES,
    TAUS,
    Grid,
    PrintedLine,
    appendix,
    beta_rows,
    describe,
    printed,
    table,
)
from lab_studies.thesis.chapter_9_sessions import AdviceOutcome, AdviceSetting, measured

APPENDIX, BEST = FILES
JOB = Job(sessions=10)
RESULTS = {"measure", "value", "ci95", "thesis", "within"}
TOLD = {"within_errors", "used", "easy"}  # of those beside a printed figure
PARAMETERS = {
    "ccrl": {"lambda_threshold", "omega"},
    "ia": {"psi"},
    "combined": {"lambda_threshold", "omega", "psi"},
}


@pytest.fixture(scope="module")
def grid() -> Grid:
    """Table 9.2's world and view."""
    return Grid(JOB, "world-1", "full", {})


def cell_of(grid: Grid, gate: str, tau: float | None, **parameters: float) -> PrintedLine:
    """The only line of the appendix with these parameters; tau None: that of all advisors."""
    (found,) = (
        cell
        for cell in grid.cells
        if (cell.setting.gate, cell.setting.tau) == (gate, tau)
        and all(getattr(cell.setting, name) == value for name, value in parameters.items())
    )
    return found


# ---- what is printed ----------------------------------------------------------------------------------------------


def test_all_lines_are_read() -> None:
    cells, best = printed(APPENDIX), printed(BEST)
    assert (len(cells), len(best)) == (401, 60)
    assert Counter(cell.setting.gate for cell in cells) == {"ccrl": 160, "ia": 98, "combined": 143}
    places = Counter((cell.setting.world, cell.setting.view) for cell in cells)
    assert places == {
        ("world-1", "full"): 73,
        ("world-1", "limited"): 123,
        ("world-2", "full"): 95,
        ("world-2", "limited"): 110,
    }
    assert Counter((cell.setting.world, cell.setting.view) for cell in best) == dict.fromkeys(TABLES.values(), 15)


@pytest.mark.parametrize("file", FILES)
def test_what_every_line_has(file: str) -> None:
    """The parameters of its method, an advisor or all four, figures in their range, and no line stands twice."""
    cells = printed(file)
    for cell in cells:
        setting, asked = cell.setting, PARAMETERS[cell.setting.gate]
        given = {name for name in ("lambda_threshold", "omega", "psi") if getattr(setting, name) is not None}
        assert given == asked
        assert type(setting.omega) is (int if "omega" in asked else type(None))
        assert setting.tau in ((None,) if cell.average else TAUS)
        assert 0 <= cell.sp <= 100
        assert cell.hs > 0
        assert 0 <= cell.score <= 1
        assert [type(number) for number in (cell.sp, cell.hs, cell.score)] == [float] * 3
        assert (cell.rank in ("1", "2", "3", "1-2")) if file == BEST else (cell.rank is None)
    assert len({(cell.setting, cell.rank is None) for cell in cells}) == len(cells)


@pytest.mark.parametrize(
    ("file", "number", "expected"),
    [
        (APPENDIX, 1, PrintedLine(AdviceSetting("world-1", "full", "ia", 0.01, psi=0.1), False, 67, 479.36, 0.77)),
        (APPENDIX, 19, PrintedLine(AdviceSetting("world-1", "full", "ia", psi=0.1), True, 65, 699.6, 0.73)),
        (APPENDIX, 99, PrintedLine(AdviceSetting("world-1", "full", "ccrl", 0.01, 0.05, 1), False, 99, 292.2, 0.96)),
        (
            APPENDIX,
            260,
            PrintedLine(AdviceSetting("world-1", "full", "combined", 0.01, 0.05, 1, 0.3), False, 94, 120.51, 0.96),
        ),
        (
            APPENDIX,
            401,
            PrintedLine(AdviceSetting("world-2", "limited", "combined", None, 0.5, 1, 0.3), True, 35, 10.33, 0.71),
        ),
        (BEST, 1, PrintedLine(AdviceSetting("world-1", "full", "ccrl", 0.01, 0.05, 1), False, 99, 292.2, 0.96, "2")),
        (
            BEST,
            12,
            PrintedLine(AdviceSetting("world-1", "full", "combined", 1.0, 0.05, 1, 0.3), False, 61, 308.8, 0.77, "1"),
        ),
        (BEST, 32, PrintedLine(AdviceSetting("world-2", "full", "ia", 0.01, psi=0.7), False, 98, 522.1, 0.96, "2")),
    ],
)
def test_printed_figures(file: str, number: int, expected: PrintedLine) -> None:
    """A few lines, by their number in the file."""
    assert printed(file)[number - 1] == expected


# ---- a world and view measured ------------------------------------------------------------------------------------


def test_every_setting_is_measured_once(grid: Grid) -> None:
    assert (len(grid.cells), len(grid.best)) == (73, 15)
    asked = {setting for cell in (*grid.cells, *grid.best) for setting in grid.settings_of(cell)}
    assert grid.outcomes.keys() == asked
    assert {len(outcome.success) for outcome in grid.outcomes.values()} == {10}
    assert {(s.world, s.view, s.advisor_table) for s in asked} == {("world-1", "full", "learned")}


def test_the_ranges_are_those_of_all_combinations(grid: Grid) -> None:
    percents = [100 * outcome.success.mean() for outcome in grid.outcomes.values()]
    helped = [outcome.helped_steps.mean() for outcome in grid.outcomes.values()]
    assert grid.sp_range == (min(percents), max(percents))
    assert grid.hs_range == (min(helped), max(helped))


def replicated(grid: Grid, outcome: AdviceOutcome) -> list[float]:
    """Eq. 9.4 in each of five parts of two sessions."""
    parts = [slice(2 * n, 2 * n + 2) for n in range(5)]
    return [
        float(
            score(
                100 * float(outcome.success[part].mean()),
                float(outcome.helped_steps[part].mean()),
                grid.sp_range,
                grid.hs_range,
            )
        )
        for part in parts
    ]


def test_the_rows_of_a_cell(grid: Grid) -> None:
    cell = cell_of(grid, "combined", 0.1, lambda_threshold=0.3, psi=1.0)
    (setting,) = grid.settings_of(cell)
    outcome = grid.outcomes[setting]
    sp, hs, points = grid.rows(cell)
    named = {"world": "world-1", "view": "full", "gate": "combined", "tau": 0.1}
    named |= {"lambda_threshold": 0.3, "omega": 1, "psi": 1.0, "beta": 1.3, "advisor_table": "learned"}
    for one in (sp, hs, points):
        assert {name: value for name, value in one.items() if name not in RESULTS | TOLD} == named
    assert [one["measure"] for one in (sp, hs, points)] == ["SP_percent", "HS_steps", "score"]
    assert [one["thesis"] for one in (sp, hs, points)] == [cell.sp, cell.hs, cell.score]
    assert (sp["value"], *sp["ci95"]) == proportion_interval(int(outcome.success.sum()), 10)
    assert (hs["value"], *hs["ci95"]) == interval(outcome.helped_steps)
    assert (points["value"], *points["ci95"]) == pytest.approx(interval(replicated(grid, outcome)))


def test_the_rows_of_all_advisors_are_their_means(grid: Grid) -> None:
    cell = cell_of(grid, "ia", None, psi=0.7)
    outcomes = [grid.outcomes[replace(cell.setting, tau=tau)] for tau in (0.01, 0.1, 0.3, 1.0)]
    sp, hs, points = grid.rows(cell)
    assert (sp["tau"], hs["tau"], points["tau"]) == ("all",) * 3
    assert sp["value"] == pytest.approx(100 * np.mean([outcome.success for outcome in outcomes]))
    assert hs["value"] == pytest.approx(np.mean([outcome.helped_steps for outcome in outcomes]))
    scores = np.mean([replicated(grid, outcome) for outcome in outcomes], axis=0)
    assert grid.scores(cell) == pytest.approx(scores)
    assert (points["value"], *points["ci95"]) == pytest.approx(interval(scores))


class MadeUp(Job):
    """Sessions of which the expert's all succeed with 100 helped steps, the moderate one's never with 300, the others'
    in the first half of ten, with 200."""

    def computed(self, work: Any, items: list[Any], most: int = 4) -> Iterator[tuple[Any, Any]]:
        first = {0.01: 10, 0.1: 0}
        return ((s, made(first.get(s.tau or 0, 5), {0.01: 100, 0.1: 300}.get(s.tau or 0, 200))) for s in items)


def made(successes: int, helped: int) -> AdviceOutcome:
    return AdviceOutcome(np.arange(10) < successes, np.full(10, helped), np.full(10, helped // 100))


def test_scores_of_made_up_sessions() -> None:
    """In pairs, half of ten succeed in 100, 100, 50, 0, 0 %: with middling help, scores .75, .75, .5, .25, .25.

    The mean with the scores of the expert, all 1, and of the moderate one, all 0: .625, .625, .5, .375, .375.
    """
    grid = Grid(MadeUp(), "world-1", "full", {})
    assert (grid.sp_range, grid.hs_range) == ((0, 100), (100, 300))
    lines = [cell_of(grid, "ccrl", tau, lambda_threshold=0.3, omega=1) for tau in (0.01, 0.1, 0.3, 1.0, None)]
    assert [grid.scores(cell).tolist() for cell in lines[:2]] == [[1.0] * 5, [0.0] * 5]
    for cell in lines[2:4]:
        assert grid.scores(cell) == pytest.approx([0.75, 0.75, 0.5, 0.25, 0.25])
    assert grid.scores(lines[4]) == pytest.approx([0.625, 0.625, 0.5, 0.375, 0.375])
    values = [[one["value"] for one in grid.rows(cell)] for cell in lines]
    assert values == [[100, 100, 1, 1], [0, 300, 0, 3], [50, 200, 0.5, 2], [50, 200, 0.5, 2], [50, 200, 0.5, 2]]
    assert grid.rows(lines[4])[1]["ci95"] == [200, 200]


def test_requests_of_ccrl_come_beside(grid: Grid) -> None:
    cell = cell_of(grid, "ccrl", 0.01, lambda_threshold=0.05)
    (setting,) = grid.settings_of(cell)
    *_, asked = grid.rows(cell)
    assert (asked["measure"], asked["thesis"], asked["within"]) == ("AR_requests", None, None)
    assert asked["value"] == pytest.approx(grid.outcomes[setting].requests.mean())
    assert [len(grid.rows(one)) for one in grid.cells] == [4 if c.setting.gate == "ccrl" else 3 for c in grid.cells]


def test_a_reading_changes_all_settings() -> None:
    grid = Grid(JOB, "world-1", "full", {"advisor_table": "exact"})
    assert {setting.advisor_table for setting in grid.outcomes} == {"exact"}
    for cell in grid.cells[:20]:
        assert {one["advisor_table"] for one in grid.rows(cell)} == {"exact"}


def test_the_appendix_has_the_rows_of_its_grids(grid: Grid) -> None:
    rows = appendix(JOB, [TABLES["table-9.2"]], {})
    assert rows == marked(one for cell in grid.cells for one in grid.rows(cell))
    assert all(one.keys() >= TOLD for one in rows if one["thesis"] is not None)
    printed_here = [
        cell for cell in printed(APPENDIX) if (cell.setting.world, cell.setting.view) == ("world-1", "full")
    ]
    assert [one["thesis"] for one in rows if one["measure"] == "SP_percent"] == [cell.sp for cell in printed_here]
    assert appendix(JOB, [], {}) == []


# ---- the four tables ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", TABLES)
def test_a_table_has_fifteen_ranked_scores(name: str) -> None:
    place, view = TABLES[name]
    rows = table(JOB, name, {})
    scores = [one for one in rows if one["measure"] == "score"]
    lines = [c for c in printed(BEST) if (c.setting.world, c.setting.view) == (place, view)]
    expected = {(c.setting.gate, "all" if c.average else c.setting.tau): (c.score, c.rank) for c in lines}
    assert {(one["gate"], one["tau"]): (one["thesis"], one["thesis_rank"]) for one in scores} == expected
    assert len(scores) == len(expected) == 15
    assert {(one["world"], one["view"]) for one in rows} == {(place, view)}
    best = {tau: [one["rank"] for one in scores if one["tau"] == tau] for tau in (*TAUS, "all")}
    assert all(len(ranks) == 3 and "1" in {rank[0] for rank in ranks} for ranks in best.values())


def test_ranks_are_those_of_the_scores(grid: Grid) -> None:
    rows = table(JOB, "table-9.2", {})
    for tau in (0.1, None):
        groups = {cell.setting.gate: grid.scores(cell) for cell in grid.best if cell.setting.tau == tau}
        found, said = compare(groups), "all" if tau is None else tau
        assert found.ranks == {o["gate"]: o["rank"] for o in rows if (o["measure"], o["tau"]) == ("score", said)}
        tests = {(o["measure"], o.get("gate")): o["value"] for o in rows if o.get("table") and o["tau"] == said}
        expected: dict[tuple[str, Any], float | None] = {("ANOVA_p", None): found.p, ("Levene_p", None): found.levene}
        expected |= {("Tukey_p", f"{one} - {other}"): p for (one, other), p in found.tukey.items()}
        expected |= {("KS_p", gate): p for gate, p in found.normality.items() if p is not None}
        assert tests == expected


# ---- learning alone -----------------------------------------------------------------------------------------------


def test_the_printed_success_stands_at_the_best_beta(monkeypatch: pytest.MonkeyPatch) -> None:
    assert {0.7, 1.3} < {*BETAS}
    monkeypatch.setattr(chapter_9_cells, "BETAS", (0.5, 0.7, 1.3))
    rows = beta_rows(JOB)
    assert [(one["world"], one["beta"], one["thesis"]) for one in rows] == [
        *(("world-1", 0.5, None), ("world-1", 0.7, None), ("world-1", 1.3, 63.0)),
        *(("world-2", 0.5, None), ("world-2", 0.7, 37.0), ("world-2", 1.3, None)),
    ]
    outcomes = measured(JOB, [AdviceSetting(one["world"], beta=one["beta"]) for one in rows])
    for one, outcome in zip(rows, outcomes.values(), strict=True):
        assert (one["value"], *one["ci95"]) == proportion_interval(int(outcome.success.sum()), 10)
        assert one.keys() >= {"world", "view", "gate", "beta"} | RESULTS
        assert (one["view"], one["gate"]) == ("full", "never")


# ---- rows ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("setting", "said"),
    [
        (AdviceSetting("world-1"), {"gate": "never", "beta": 1.3}),
        (AdviceSetting("world-2", beta=0.5), {"gate": "never", "beta": 0.5}),
        (
            AdviceSetting("world-1", "limited", "ccrl", 0.01, 0.0, 0),  # zeros are settings, too
            {"gate": "ccrl", "tau": 0.01, "lambda_threshold": 0.0, "omega": 0, "beta": 1.3, "advisor_table": "learned"},
        ),
    ],
)
def test_a_setting_is_described_by_what_applies(setting: AdviceSetting, said: dict[str, Any]) -> None:
    assert describe(setting) == {"world": setting.world, "view": setting.view} | said
