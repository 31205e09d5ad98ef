"""Appendix III again: SRL compared with FIFO in a flexible manufacturing system, and with methods that improve on both."""

from collections.abc import Mapping, Sequence
from functools import partial
from itertools import product
from math import sqrt
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lab.sequencing.cell.chance import LAWS
from lab.studies.charts import bars
from lab.studies.findings import Findings, Row, agreement, mean_row, row, those
from lab.studies.runner import Job
from lab_studies.thesis.appendix_3_fifo import STARTS
from lab_studies.thesis.appendix_3_makespans import (
    ASKED,
    EPISODES,
    FIFO,
    LEARNED_BY,
    REACTIONS,
    REPLICATIONS,
    SLOW_BY,
    Mix,
    OrderMakespans,
    order_makespans,
)

Floats = NDArray[np.float64]

SIZES, MIXES, MEANS_S = (3, 5, 8), 10, (100.0, 200.0)
METHODS = {  # name in rows -> name in pictures
    "srl": "SRL",
    "srl greedy": "SRL, greedy policy at the end",
    "srl pairs": "SRL, values per decision",
    "random": "random search",
    "srl-time": "srl-time",
    "exact": "optimum",
    "reacting": "reacting",
    "rollout": "rollout",
}
BESIDE = ("random", "srl-time", "exact")
FIFO_NAMES = {"listing": "FIFO as listed", "idle-start": "FIFO, idle start"}
PRINTED_IP = {(8, "normal", 100.0): 11.0, (8, "normal", 200.0): 11.0}  # percent
PRINTED_DIFFERENCE = {(3, "normal", 100.0): 211.0, (8, "normal", 200.0): 576.0}  # seconds
EXAMPLES = ("RSR", "SRR", "SSR")  # in place of the three orders of fig. III.4, which cannot be read
Group = tuple[int, str, float]  # parts, law of arrivals, mean interval

SYMBOLS = (
    "IP: (FIFO's makespan - the method's) / FIFO's, the mean over the orders of one size; intervals and p (paired t-test of "
    "the makespans) are over the orders, too. Gap: above the proven optimum, with constant arrivals. A part arrives an interval "
    "after the pick of the part before. Milling takes 600 s, as in the listing."
)
FIFOS = (
    "The thesis's FIFO depends on one detail. As listed, a robot that finds its queue empty sleeps until the last event to "
    "come, even if tasks join the queue; 'idle-start' begins with the first task that joins. Lathes take turns strictly, and "
    "one is loaded only when its out-buffer is empty. Printed values are compared with the FIFO as listed."
)
PRINTED = (
    "The thesis prints 11 to 17 % as the range of IP over order sizes, arrivals and means (not a figure of one cell), 11 % for 8 "
    "parts with normal arrivals and both means, and differences of 211 s (3 parts, mean 100) and 576 s (8 parts, mean 200)."
)
METHODS_NOTE = (
    f"SRL: type B, {EPISODES} episodes, values per next state of the stations as listed; it learns with constant arrivals, and "
    "its best sequence is carried out as a fixed list, like those of random search, srl-time and the proven optimum. "
    "'reacting' (SRL over time) and 'rollout' decide while exponential arrivals become known. 'srl greedy' is SRL's own policy "
    "after the last episode, which the thesis does not use; 'srl pairs' keeps values per state and decision, as in fig. 5.1."
)
HOW_MANY = (
    f"The thesis learns one session for each order. Here one in {LEARNED_BY} of the requested sessions is learned for each order "
    f"(srl-time: one in {SLOW_BY}), and the makespans are averaged. All methods have the same {REPLICATIONS} replications. "
    f"Policies that react have only the first of them, with {ASKED} sessions {REACTIONS[3]} for 3 parts, {REACTIONS[5]} for 5 "
    f"and {REACTIONS[8]} for 8, and are compared with FIFO in the same ones."
)


def appendix_iii(job: Job, reading: Mapping[str, Any]) -> Findings:
    """The results of all orders by all methods; larger orders are drawn with the job's seed, and the reading has no effect."""
    orders = orders_of(job.seed)
    mixes = [Mix(order, mean_s) for parts in reversed(SIZES) for order in orders[parts] for mean_s in MEANS_S]
    makespans = job.each(partial(order_makespans, sessions=job.sessions, seed=job.seed), mixes)
    rows: list[Row] = []
    for group in product(SIZES, LAWS, MEANS_S):
        rows += _rows(group, [makespans[Mix(order, group[2])] for order in orders[group[0]]])
    rows += _example_rows(orders, makespans)
    summary = {
        "proven optima": f"{sum(mix.proven for mix in makespans.values())} of {len(makespans)}",
        **_in_short(rows),
    }
    notes = (SYMBOLS, FIFOS, PRINTED, METHODS_NOTE, HOW_MANY)
    return Findings(rows, summary | agreement(rows), _pictures(rows), notes)


def orders_of(seed: int) -> dict[int, list[str]]:
    """The orders by size: all with 3 parts, MIXES different random ones of each larger size."""
    orders: dict[int, list[str]] = {}
    for parts in SIZES:
        every = ["".join(letters) for letters in product("RS", repeat=parts)]
        rng = np.random.default_rng([seed, parts])
        drawn = sorted(rng.choice(len(every), min(MIXES, len(every)), replace=False).tolist())
        orders[parts] = every if len(every) <= MIXES else [every[index] for index in drawn]
    return orders


def _rows(group: Group, made: Sequence[OrderMakespans]) -> list[Row]:
    """The rows of one size, law and mean: makespans, improvements over both FIFOs, gaps."""
    parts, law, mean_s = group
    named: Row = {"table": f"{parts} parts", "parts": parts, "arrivals": law, "interval_s": mean_s}
    rows = []
    for start, method in FIFO.items():
        rows += _makespan_rows({**named, "method": "fifo", "fifo": start}, law, method, made)
    for method in METHODS:
        if (method, law) not in made[0].makespans_s:
            continue
        rows += _makespan_rows({**named, "method": method}, law, method, made)
        for start in STARTS:
            rows += _improvement_rows({**named, "method": method, "fifo": start}, group, made)
    return rows


def _makespan_rows(named: Row, law: str, method: str, made: Sequence[OrderMakespans]) -> list[Row]:
    """The rows of the mean makespan and, with constant arrivals, of the gap to the optimum."""
    rows = [mean_row(named, "makespan_s", [mix.makespans_s[method, law].mean() for mix in made])]
    if law == "constant":
        rows.append(mean_row(named, "gap_percent", [100.0 * mix.gaps[method] for mix in made]))
    return rows


def _improvement_rows(named: Row, group: Group, made: Sequence[OrderMakespans]) -> list[Row]:
    """The rows of IP (III.1) and of the difference to a FIFO's makespan, over the replications that the method has."""
    method, start, law = named["method"], named["fifo"], group[1]
    pairs = [(mix.makespans_s[FIFO[start], law], mix.makespans_s[method, law]) for mix in made]
    fifo_s, own_s = np.array([(other[: len(own)].mean(), own.mean()) for other, own in pairs]).T
    p = float(f"{paired_p(fifo_s - own_s):.2g}")
    printed = method == "srl" and start == "listing"
    shown = [PRINTED_IP.get(group), PRINTED_DIFFERENCE.get(group)] if printed else [None, None]
    return [
        mean_row({**named, "p": p}, "IP_percent", 100.0 * (fifo_s - own_s) / fifo_s, shown[0]),
        mean_row({**named, "p": p}, "difference_s", fifo_s - own_s, shown[1]),
    ]


def paired_p(differences: Floats) -> float:
    """The p value of the paired t-test (Appendix II) of differences (n,)."""
    from scipy.stats import t

    error = float(differences.std(ddof=1)) / sqrt(len(differences))
    if error == 0.0:
        return float(not differences.any())
    return float(2 * t.sf(abs(differences.mean()) / error, len(differences) - 1))


def _example_rows(orders: Mapping[int, Sequence[str]], makespans: Mapping[Mix, OrderMakespans]) -> list[Row]:
    """The rows of every order of 3 parts, with constant arrivals of the shorter mean (fig. III.4)."""
    methods: list[tuple[str, Row]] = [(method, {"method": "fifo", "fifo": start}) for start, method in FIFO.items()]
    methods += [(method, {"method": method}) for method in ("srl", "srl-time", "exact")]
    rows = []
    for order in orders.get(3, ()):
        makespans_s = makespans[Mix(order, MEANS_S[0])].makespans_s
        named: Row = {"table": "Figure III.4", "order": order, "arrivals": "constant", "interval_s": MEANS_S[0]}
        rows += [row(named | own, "makespan_s", float(makespans_s[name, "constant"][0])) for name, own in methods]
    return rows


def _in_short(rows: Sequence[Row]) -> Row:
    """The range of IP over the cells, for SRL with both FIFOs, and for other methods with the FIFO as listed."""
    says: Row = {}
    for method, start in (("srl", "listing"), ("srl", "idle-start"), *((m, "listing") for m in BESIDE)):
        improvements = [result["value"] for result in those(rows, method=method, fifo=start, measure="IP_percent")]
        says[f"IP of {method} over {FIFO_NAMES[start]} [%]"] = f"{min(improvements):.1f} to {max(improvements):.1f}"
    return says


def _pictures(rows: Sequence[Row]) -> dict[str, bytes]:
    """The pictures of figs. III.4 to III.9, and two of our own, by caption."""
    pictures = {}
    if 3 in SIZES:
        pictures["Figure III.4: makespans of three orders, arrivals every 100 s"] = _examples(rows)
    if 5 in SIZES:
        pictures["Figure III.5: makespan differences over FIFO, SRL, orders of 5 parts"] = _differences(rows)
    for caption, law, measure in (
        ("Figure III.6: makespan differences over FIFO, SRL, normal arrivals", "normal", "difference_s"),
        ("Figure III.7: improvement over FIFO, SRL, normal arrivals", "normal", "IP_percent"),
        ("Figure III.8: improvement over FIFO, SRL, constant arrivals", "constant", "IP_percent"),
        ("Figure III.9: improvement over FIFO, SRL, exponential arrivals", "exponential", "IP_percent"),
    ):
        pictures[caption] = _by_size(rows, law, measure)
    pictures["Gap to the proven optimum by method, constant arrivals every 200 s"] = _gaps(rows)
    pictures["Improvement over FIFO as listed by method, exponential arrivals, mean 200 s"] = _by_method(rows)
    return pictures


def _series(*methods: str) -> list[tuple[str, Row]]:
    """The series of FIFO and some methods: their names, and the settings of their rows."""
    fifos: list[tuple[str, Row]] = [(name, {"method": "fifo", "fifo": start}) for start, name in FIFO_NAMES.items()]
    return fifos + [(METHODS[method], {"method": method}) for method in methods]


def _by_parts(rows: Sequence[Row], series: Sequence[tuple[str, Row]], ylabel: str, **wanted: Any) -> bytes:
    """A picture with bars by the number of parts."""
    lines = {name: [those(rows, parts=parts, **(wanted | own))[0] for parts in SIZES] for name, own in series}
    return bars([f"{parts} parts" for parts in SIZES], lines, ylabel)


def _examples(rows: Sequence[Row]) -> bytes:
    shown = those(rows, table="Figure III.4")
    series = _series("srl", "srl-time", "exact")
    lines = {name: [those(shown, order=order, **own)[0] for order in EXAMPLES] for name, own in series}
    return bars(EXAMPLES, lines, "makespan [s]", xlabel="order of arrival: R a rook, S a sign")


def _differences(rows: Sequence[Row]) -> bytes:
    groups = [*product(LAWS, MEANS_S)]
    lines = {}
    for start, name in FIFO_NAMES.items():
        differences = those(rows, parts=5, method="srl", fifo=start, measure="difference_s")
        lines[f"over {name}"] = [those(differences, arrivals=law, interval_s=mean)[0] for law, mean in groups]
    return bars([f"{law}\n{mean:g} s" for law, mean in groups], lines, "makespan difference [s]")


def _by_size(rows: Sequence[Row], law: str, measure: str) -> bytes:
    series = [
        (f"over {FIFO_NAMES[start]}, mean {mean:g} s", {"interval_s": mean, "fifo": start})
        for start, mean in product(STARTS, MEANS_S)
    ]
    ylabel = "makespan difference [s]" if measure == "difference_s" else "improvement IP [%]"
    return _by_parts(rows, series, ylabel, arrivals=law, method="srl", measure=measure)


def _gaps(rows: Sequence[Row]) -> bytes:
    series = _series("srl", "srl pairs", "random", "srl-time")
    wanted = {"arrivals": "constant", "interval_s": MEANS_S[-1], "measure": "gap_percent"}
    return _by_parts(rows, series, "above the proven optimum [%]", **wanted)


def _by_method(rows: Sequence[Row]) -> bytes:
    names = {"srl": "SRL, fixed list", "srl-time": "srl-time, fixed list", "exact": "optimum, fixed list"}
    series = [
        (names.get(method, METHODS[method]), {"method": method})
        for method in ("srl", "srl-time", "exact", "reacting", "rollout")
    ]
    wanted = {"arrivals": "exponential", "interval_s": MEANS_S[-1], "measure": "IP_percent", "fifo": "listing"}
    return _by_parts(rows, series, "improvement IP [%]", **wanted)
