"""Outcomes as lines of a file, and the table that sums them up."""

import json
from collections.abc import Iterable, Iterator
from dataclasses import asdict
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

from devtools.parts import Outcome, Part

SHOWN = 12  # broken attempts that are printed below the table; the files hold all of them


def read_outcomes(file: Path) -> dict[int, Outcome]:
    """The outcomes in a file, by number, without a last line that was cut short."""
    outcomes = {}
    for line in file.read_text(encoding="utf-8").splitlines() if file.exists() else ():
        try:
            row = json.loads(line)
        except json.JSONDecodeError:
            continue
        number = row.pop("number")
        outcomes[number] = Outcome(**row)
    return outcomes


def outcome_line(number: int, outcome: Outcome) -> str:
    """The line of an outcome in the file."""
    return json.dumps({"number": number, **asdict(outcome)}) + "\n"


def rows(outcomes: Iterable[Outcome]) -> Iterator[dict[str, Any]]:
    """A row for each group: its tries, the number and the cases of broken attempts, the largest value of each figure."""
    groups: dict[str, list[Outcome]] = {}
    for outcome in outcomes:
        groups.setdefault(outcome.group, []).append(outcome)
    for group, members in sorted(groups.items()):
        broken = [member for member in members if member.broke]
        figures: dict[str, float] = {}
        for member in members:
            for name, value in (member.figures or {}).items():
                figures[name] = max(value, figures.get(name, value))
        tries = sum(member.tries for member in members)
        yield {"group": group, "tries": tries, "broke": len(broken), "most": figures,
               "broken": [{"case": member.case, "broke": member.broke} for member in broken]}  # fmt: skip


def show(parts: dict[str, Part], folder: Path, console: Console) -> bool:
    """Print the table of the folder's outcomes, and write it to `scoreboard.json`; return whether all held."""
    table = Table("part", "what", "tries", "broke", "most")
    document, broken = {}, []
    for name, part in parts.items():
        counted = list(rows(read_outcomes(folder / f"{name}.jsonl").values()))
        document[name] = {"target": part.target, "rows": counted}
        for n, row in enumerate(counted):
            most = ", ".join(f"{figure} {value:.4g}" for figure, value in row["most"].items())
            table.add_row("" if n else name, row["group"], str(row["tries"]), str(row["broke"]), most)
            broken += [f"{name}: {attempt['case']}: {attempt['broke']}" for attempt in row["broken"]]
        if counted:
            total, lost = (sum(row[key] for row in counted) for key in ("tries", "broke"))
            table.add_row(
                "",
                f"[bold]all[/] (target: {part.target})",
                f"[bold]{total}[/]",
                f"[bold]{lost}[/]",
                "",
                end_section=True,
            )
    console.print(table)
    for text in broken[:SHOWN]:
        console.print(text, markup=False, highlight=False)
    if len(broken) > SHOWN:
        console.print(f"... and {len(broken) - SHOWN} more in {folder}")
    (folder / "scoreboard.json").write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")
    return not broken
