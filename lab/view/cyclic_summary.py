"""The result of `lab sequence --cyclic` as text, and the line on it in `lab run`, from plain data."""

from collections import Counter
from collections.abc import Mapping
from typing import Any

from rich.console import Group, RenderableType
from rich.text import Text

from lab.errors import counted

SAME_S = 0.005  # times that differ by less look the same when printed


def cyclic_summary(document: Mapping[str, Any]) -> RenderableType:
    """The text at the end of `lab sequence --cyclic`, from its JSON document."""
    mix = ", ".join(counted(count, name) for name, count in Counter(document["mix"]).items())
    each = "" if document["parts_a_cycle"] == 1 else f", {document['per_part_s']:.2f} s a part"
    lines = [
        f"every {document['period_s']:.2f} s: {mix}{each}, {document['parts_per_hour']:.1f} parts an hour "
        f"(seed {document['seed']})",
        f"{counted(document['most_in_work'], 'part')} in work at once at the most",
        *_tried(document),
        *(_move(move, document["parts_a_cycle"]) for move in document["moves"]),
        *_finite(document["finite"]),
    ]
    return Group(*map(Text, [*lines, *document["files"].values()]))


def _tried(document: Mapping[str, Any]) -> list[str]:
    """The lines on what is proven about the time per part, and on the result for each number of parts per cycle."""
    of, least_s = document["proven_of"], document["least_per_part_s"]
    lines = [f"proven: of {of} none needs less a part"]
    if not document["proven"]:
        lines = [f"proven: of {of} none needs less than {document['bound_per_part_s']:.2f} s a part"]
    if document["bound_per_part_s"] - least_s > SAME_S:
        lines[0] += f"; of all cycles none less than {least_s:.2f} s"
    if len(document["tried"]) > 1:
        lines.append(f"parts a cycle: {'; '.join(map(_one_tried, document['tried']))}")
    if document["why_no_more"] is not None:
        lines.append(f"more parts a cycle were not tried: {document['why_no_more']}")
    return lines


def _one_tried(tried: Mapping[str, Any]) -> str:
    parts, period_s = tried["parts_a_cycle"], tried["period_s"]
    if period_s is not None:
        return f"{parts}, {period_s / parts:.2f} s a part"
    return f"{parts}, none is better" if tried["proven"] else f"{parts}, none better was found"


def period_in_words(cyclic: Mapping[str, Any]) -> str:
    """The planned and the measured period of a run, in words."""
    planned_s, measured_s = cyclic["period_s"], cyclic["measured_period_s"]
    if measured_s is None:
        return f"{planned_s:.2f} s planned; too few parts were delivered to measure it"
    return f"{planned_s:.2f} s planned, {measured_s:.2f} s measured ({cyclic['period_deviation']:+.2%})"


def _move(move: Mapping[str, Any], parts: int) -> str:
    """One move of the cycle as a line."""
    number = f" {move['part']}" if parts > 1 else ""
    pallet = "'s pallet" if move["carries"] == "pallet" else ""
    entered = "" if not move["periods"] else f"  (entered {counted(move['periods'], 'period')} before)"
    return f"  {move['pick_s']:9.2f} s  {move['product']}{number}{pallet}: {move['origin']} > {move['target']}{entered}"


def _finite(finite: Mapping[str, Any]) -> list[str]:
    """The lines that compare the cycle with the order of a finite number of parts."""
    parts, lines = finite["parts"], list[str]()
    if finite["cyclic_makespan_s"] is not None:
        waits = ", with waits on purpose" if finite["waits_on_purpose"] else ""
        lines.append(f"carried out for {counted(parts, 'part')}: {finite['cyclic_makespan_s']:.2f} s{waits}")
    if finite["best_s"] is not None:
        best = "the best order of as many" if finite["best_proven"] else "the best order found of as many"
        lines.append(f"{best}: {finite['best_s']:.2f} s, {finite['best_per_part_s']:.2f} s a part")
    if finite["why_not"] is not None:
        lines.append(f"of {counted(parts, 'part')}: {finite['why_not']}")
    return lines
