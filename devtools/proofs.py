"""Part `proofs`: the lab's proofs and plans for random cells against an oracle that shares no code with it.

The oracle and the random cells are in `tests/sequencing`. An attempt is one cell, with all methods that prove something and
plans of others. A cell with a wrong proof or plan is made smaller while it stays wrong; the smallest one is written into the
part's folder, and its features are the row that counts it.
"""

import sys
from pathlib import Path

from devtools.parts import Outcome, Part

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "tests" / "sequencing"))

from against_oracle.compared import METHODS, Compared, compared, freedom, label, least
from against_oracle.cycles import fits, judged, periods
from against_oracle.drawn import as_toml, drawn

from lab.errors import BadInput

COUNT = 1000


def prepare(room: Path, seed: int) -> None:
    """Do nothing: each attempt draws its own cell."""


def attempt(number: int, seed: int, room: Path) -> Outcome:
    """Compare one cell with the oracle."""
    raw = drawn(seed, number)
    try:
        comparison = compared(raw)
    except BadInput as error:
        return Outcome("refused by the lab", f"cell {seed} {number}: {error}")
    figures = {"oracle_s": round(comparison.seconds["oracle"], 2), "lab_s": round(comparison.seconds["lab"], 2)}
    figures |= {"proven": float(any(claim.proven for claim in comparison.claims))}
    cycles = judged(periods(raw)) if fits(raw) else []
    if not comparison.wrong and cycles:
        file = room / f"{number}.toml"
        file.write_text(as_toml(raw), encoding="utf-8")
        said = "; ".join(words for *_, words in cycles)
        return Outcome(f"{cycles[0][0]}: {label(raw)}", f"cell {seed} {number}: {file.name}", said, figures=figures)
    if not comparison.wrong:
        sure = "agrees" if comparison.oracle.status in ("optimal", "impossible") else "not proven by the oracle"
        return Outcome(sure, f"cell {seed} {number}: {label(raw)}", figures=figures)
    kind = comparison.kinds[0]
    by = dict.fromkeys(method for wrong_kind, method, _ in comparison.wrong if wrong_kind == kind)
    small = least(raw, kind, [name for name in by if name in METHODS])
    small = small if kind in small.kinds else comparison
    file = room / f"{number}.toml"
    file.write_text(as_toml(small.raw), encoding="utf-8")
    return Outcome(
        f"{kind}: {label(small.raw)}", f"cell {seed} {number}: {file.name}", _said(small, kind), figures=figures
    )


def _said(comparison: Compared, kind: str) -> str:
    """What is wrong with a cell, method by method."""
    words = [f"{method}: {said}" for wrong_kind, method, said in comparison.wrong if wrong_kind == kind]
    more = f" ({freedom(comparison)})" if kind == "proven is beaten" else ""
    return "; ".join(dict.fromkeys(words)) + more


PART = Part(
    what="random cells: proofs, bounds and plans against an oracle",
    target="no proof is beaten, no rule broken",
    count=COUNT,
    prepare=prepare,
    attempt=attempt,
)
