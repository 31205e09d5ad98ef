"""Appendix III: the FIFO as listed, redone by an independent translation, and rows that agree with one another."""

import json
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import ttest_rel

from lab.sequencing.cell.chance import Chance, Episode
from lab.sequencing.simulate.several import carry_out, replicate
from lab.studies.findings import Findings
from lab.studies.report import write_rows
from lab.studies.runner import Job
from lab_studies.many_sessions import evaluate
from lab_studies.thesis import appendix_3, appendix_3_makespans
from lab_studies.thesis.appendix_3 import METHODS, appendix_iii, orders_of, paired_p
from lab_studies.thesis.appendix_3_fifo import STARTS, queued_fifo
from lab_studies.thesis.appendix_3_makespans import FIFO, Mix, fms, order_makespans, times_seeds

# Makespans [s] by the listing's own code, translated line by line by somebody else: order, arrivals every 100 s as
# listed and with idle start, every 200 s as listed and with idle start.
REFERENCE = [
    ("RRR", 1285, 1285, 1410, 1320),
    ("RRS", 1695, 1695, 1990, 1900),
    ("RSR", 1540, 1335, 1830, 1450),
    ("RSS", 2300, 2300, 2590, 2430),
    ("SRR", 1400, 1400, 2025, 1570),
    ("SRS", 2200, 2070, 2500, 2170),
    ("SSR", 2230, 2070, 2480, 2210),
    ("SSS", 3080, 3080, 3240, 3180),
    ("SSRSR", 3440, 3210, 3675, 3300),
    ("RRSRR", 2160, 2160, 2470, 2380),
    ("RRRRS", 2315, 2315, 2765, 2675),
    ("RSSRR", 2625, 2505, 2915, 2595),
    ("RRSRS", 2730, 2730, 2995, 2905),
    ("SRRSRRSS", 4630, 4630, 5380, 4800),
]
# When the robot sets out, and from where to where it carries: SRR, arrivals every 100 s.
SRR_STARTS = [
    (100, "incoming", "mill-in"),
    (130, "mill-in", "mill"),
    (180, "mill-in", "mill-out"),
    (220, "incoming", "lathe-1-in"),
    (290, "lathe-1-in", "lathe-1"),
    (355, "incoming", "lathe-2-in"),
    (455, "lathe-1-in", "lathe-1-out"),
    (515, "lathe-2-in", "lathe-2"),
    (625, "lathe-1", "lathe-1-out"),
    (690, "lathe-2-in", "lathe-2-out"),
    (750, "lathe-1-out", "outgoing"),
    (835, "mill", "mill-out"),
    (1130, "lathe-2", "lathe-2-out"),
    (1200, "mill-out", "outgoing"),
    (1280, "lathe-2-out", "outgoing"),
]


@pytest.mark.parametrize(("order", "listed_100", "idle_100", "listed_200", "idle_200"), REFERENCE)
def test_fifo_takes_as_long_as_the_listing(
    order: str, listed_100: float, idle_100: float, listed_200: float, idle_200: float
) -> None:
    for mean_s, expected in ((100.0, (listed_100, idle_100)), (200.0, (listed_200, idle_200))):
        runs = [carry_out(fms(order, mean_s), queued_fifo(start)).run for start in STARTS]
        assert tuple(run.now_s for run in runs) == expected


def test_fifo_does_what_the_listing_does_when_it_does() -> None:
    moves = carry_out(fms("SRR", 100.0), queued_fifo("listing")).moves
    assert [(move.leave_s, move.origin, move.target) for move in moves] == SRR_STARTS


def test_a_robot_that_sleeps_leaves_a_finished_lathe_alone() -> None:
    """RSR, every 100 s: idle at 860; lathe 2 has finished at 885, but the mill works until 990."""
    waits = {}
    for start in STARTS:
        moves = carry_out(fms("RSR", 100.0), queued_fifo(start)).moves
        waits[start] = next(move for move in moves if move.origin == "lathe-2" and move.target == "lathe-2-out").leave_s
    assert waits == {"listing": 990.0, "idle-start": 885.0}


@settings(max_examples=40, deadline=None)
@given(
    order=st.text("RS", min_size=1, max_size=6),
    mean_s=st.sampled_from([20.0, 100.0, 400.0]),
    law=st.sampled_from(["constant", "normal", "exponential"]),
    seed=st.integers(0, 2**63 - 1),
    start=st.sampled_from(STARTS),
)
def test_fifo_ends_and_never_waits_at_a_station(order: str, mean_s: float, law: str, seed: int, start: str) -> None:
    cell = fms(order, mean_s)
    done = carry_out(cell, queued_fifo(start), Episode(cell, Chance("constant", law), seed))
    assert done.run.done
    lathes = [move.target for move in done.moves if move.origin == "incoming" and move.target != "mill-in"]
    assert lathes == [f"lathe-{1 + n % 2}-in" for n in range(order.count("R"))]
    for move in done.moves:
        assert move.pick_s == pytest.approx(move.reach_s + move.service_s)
        assert move.service_s == (240.0 if (move.origin, move.target) == ("mill", "mill-out") else 0.0)


def test_lists_and_policies_meet_the_same_times() -> None:
    cell, chance = fms("RSR", 100.0), Chance("constant", "exponential")
    sequence = tuple(carry_out(cell, queued_fifo("listing")).sequence)
    one = evaluate(cell, [sequence], times_seeds(5, 6), chance)[0]
    assert one.tolist() == pytest.approx(replicate(cell, sequence, chance, 6, 5).tolist())
    assert len(set(one.tolist())) == 6


def test_orders() -> None:
    orders = orders_of(0)
    assert orders[3] == ["RRR", "RRS", "RSR", "RSS", "SRR", "SRS", "SSR", "SSS"]
    for parts in (5, 8):
        assert len({*orders[parts]}) == 10
        assert all(len(order) == parts and {*order} <= {"R", "S"} for order in orders[parts])
    assert orders_of(0) == orders
    assert orders_of(1)[3] == orders[3]
    assert orders_of(1)[8] != orders[8]


def test_p_is_that_of_the_paired_test() -> None:
    rng = np.random.default_rng(0)
    one, other = rng.normal(3, 1, 9), rng.normal(2, 1, 9)
    assert paired_p(one - other) == pytest.approx(ttest_rel(one, other).pvalue)
    assert paired_p(np.zeros(4)) == 1.0
    assert paired_p(np.full(4, 2.5)) == 0.0


@pytest.fixture(scope="module")
def one() -> appendix_3_makespans.OrderMakespans:
    return order_makespans(Mix("RSR", 100.0), sessions=10, seed=3)


def test_what_is_made_of_an_order(one: appendix_3_makespans.OrderMakespans) -> None:
    """1205 s is the proven optimum, 1540 s and 1335 s are FIFO's; the sessions are those of the seed."""
    of = one.makespans_s
    assert one.proven
    assert of["exact", "constant"].tolist() == [1205.0]
    assert of["fifo listing", "constant"].tolist() == [1540.0]
    assert one.gaps["exact"] == 0.0
    assert one.gaps["fifo idle-start"] == pytest.approx(1335 / 1205 - 1)
    assert min(one.gaps.values()) == 0.0
    lists = ("srl", "srl pairs", "random", "srl-time", "exact")
    for law, replications in (("constant", 1), ("normal", 50), ("exponential", 50)):
        assert {len(of[method, law]) for method in (*lists, *FIFO.values())} == {replications}
    assert len(of["reacting", "exponential"]) == len(of["rollout", "exponential"]) == 1
    assert not {("srl greedy", "normal"), ("reacting", "normal"), ("rollout", "constant")} & {*of}
    again = order_makespans(Mix("RSR", 100.0), sessions=10, seed=3)
    assert {key: costs.tolist() for key, costs in again.makespans_s.items()} == {
        key: costs.tolist() for key, costs in of.items()
    }


def test_more_sessions_react_more_often(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(appendix_3_makespans, "REPLICATIONS", 8)
    of = order_makespans(Mix("RS", 100.0), sessions=3000, seed=0).makespans_s
    assert len(of["reacting", "exponential"]) == 6  # one for 500 sessions, with a size that the thesis does not have
    assert len(of["srl", "normal"]) == 8


@pytest.fixture(scope="module")
def found() -> Findings:
    """The orders of 3 parts only, with few replications."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(appendix_3, "SIZES", (3,))
        patch.setattr(appendix_3_makespans, "REPLICATIONS", 6)
        return appendix_iii(Job(sessions=10, seed=1), {})


def _value(found: Findings, **wanted: Any) -> float:
    (one,) = [one for one in found.rows if all(one.get(name) == value for name, value in wanted.items())]
    return float(one["value"])


def test_rows_agree_with_one_another(found: Findings) -> None:
    for law, mean_s in (("constant", 100.0), ("normal", 200.0), ("exponential", 100.0)):
        cell = {"parts": 3, "arrivals": law, "interval_s": mean_s}
        for start in STARTS:
            fifo_s = _value(found, **cell, method="fifo", fifo=start, measure="makespan_s")
            for method in ("srl", "random", "exact"):
                own_s = _value(found, **cell, method=method, measure="makespan_s")
                difference_s = _value(found, **cell, method=method, fifo=start, measure="difference_s")
                assert difference_s == pytest.approx(fifo_s - own_s)
        assert _value(found, **cell, method="exact", fifo="listing", measure="IP_percent") > 0
    assert _value(found, parts=3, interval_s=100.0, method="exact", measure="gap_percent") == 0.0
    assert _value(found, parts=3, interval_s=200.0, method="fifo", fifo="listing", measure="gap_percent") > 10.0


def test_every_method_has_its_rows(found: Findings) -> None:
    shown = {(one["arrivals"], one["method"]) for one in found.rows if one["measure"] == "IP_percent"}
    missing = {
        "constant": {"reacting", "rollout"},
        "normal": {"reacting", "rollout", "srl greedy"},
        "exponential": {"srl greedy"},
    }
    for law, methods in missing.items():
        assert {method for other, method in shown if other == law} == {*METHODS} - methods
    examples = [one for one in found.rows if one["table"] == "Figure III.4"]
    assert len(examples) == 8 * 5
    assert _value(found, table="Figure III.4", order="SRR", method="exact") == 1160.0
    assert found.summary["proven optima"] == "16 of 16"


def test_what_is_printed_stands_beside_srl_and_the_fifo_as_listed(found: Findings) -> None:
    (one,) = [one for one in found.rows if one["thesis"] is not None]
    assert (one["method"], one["fifo"], one["arrivals"], one["interval_s"]) == ("srl", "listing", "normal", 100.0)
    assert (one["measure"], one["thesis"]) == ("difference_s", 211.0)
    assert found.summary["cells"] == 1
    assert appendix_3.PRINTED_DIFFERENCE[8, "normal", 200.0] == 576.0
    assert {*appendix_3.PRINTED_IP.values()} == {11.0}


def test_rows_can_be_written_and_pictures_be_read(found: Findings, tmp_path: Path) -> None:
    json.dumps(found.rows, allow_nan=False)
    write_rows(tmp_path / "rows.csv", found.rows)
    assert len((tmp_path / "rows.csv").read_text(encoding="utf-8").splitlines()) == len(found.rows) + 1
    captions = [caption.split(":")[0] for caption in found.figures]
    assert captions[:5] == ["Figure III.4", "Figure III.6", "Figure III.7", "Figure III.8", "Figure III.9"]
    for picture in found.figures.values():
        assert ElementTree.fromstring(picture).tag.endswith("svg")
