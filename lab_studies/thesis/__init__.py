"""The tables and figures of the thesis measured again: a file a chapter or appendix, and what is printed beside them."""

import csv
from pathlib import Path


def printed_lines(file: str) -> list[dict[str, str]]:
    """The lines of a printed table, column -> text."""
    with (Path(__file__).parent / "printed" / file).open(encoding="utf-8") as table:
        return list(csv.DictReader(table))
