"""What a study comes to."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any


@dataclass(frozen=True)
class Findings:
    """Rows as `lab study run --json` gives them, a summary, pictures (SVG) by caption, remarks."""

    rows: list[dict[str, Any]]
    summary: dict[str, Any]
    figures: Mapping[str, bytes] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
