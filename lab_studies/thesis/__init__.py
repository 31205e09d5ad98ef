"""The tables and figures of the thesis measured again, by chapter and appendix, and the printed values."""

import csv
from pathlib import Path


def printed_lines(file: str) -> list[dict[str, str]]:
    """The lines of a printed table, each a mapping from column to text."""
    with (Path(__file__).parent / "printed" / file).open(encoding="utf-8") as table:
        return list(csv.DictReader(table))
