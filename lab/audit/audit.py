"""The audit of a run: which parts were delivered according to frames and task file, and every finding against it."""

from csv import DictReader
from dataclasses import asdict, dataclass
from io import StringIO
from math import inf
from pathlib import Path
from typing import Any

from lab.audit.evidence import Evidence, Finding, Struck
from lab.audit.rules import findings
from lab.audit.tracks import FILE, read_tracks
from lab.errors import BadInput, shortened
from lab.files import json_of, read_limited
from lab.tasks.task import Order, Task


@dataclass(frozen=True)
class Audit:
    """The result of an audit: the evidence, and the findings against it, by time."""

    evidence: Evidence
    findings: tuple[Finding, ...]

    @property
    def claimed(self) -> tuple[str, ...]:
        """The names of the parts that the run claims to have delivered, part 1 first."""
        return tuple(seen.name for seen in self.evidence.parts if seen.name in self.evidence.claimed)

    @property
    def delivered(self) -> tuple[str, ...]:
        """The claimed parts that no finding names."""
        guilty = {finding.part for finding in self.findings}
        return tuple(name for name in self.claimed if name not in guilty)

    @property
    def failure(self) -> str | None:
        """The first finding and the number of the others, in one line; None when there are none."""
        if not self.findings:
            return None
        first, more = self.findings[0], len(self.findings) - 1
        about = first.words if first.part in first.words else f"{first.part} {first.words}"
        return f"audit: {about}{f' (and {more} more)' if more else ''}"

    def to_json(self) -> dict[str, Any]:
        """The audit as a JSON document.

        `claimed` and `delivered`: names. `struck`: the faults, each with what, part, station. `plan_kept`: whether the run
        had a plan that was not changed. `findings`: rule, part, station, at_s, words. `stays`: part, station, start and
        end [s].
        """
        stays = [{"part": seen.name} | asdict(stay) for seen in self.evidence.parts for stay in seen.stays]
        return {
            "claimed": list(self.claimed),
            "delivered": list(self.delivered),
            "struck": [asdict(fault) for fault in self.evidence.struck],
            "plan_kept": bool(self.evidence.planned),
            "findings": [asdict(finding) for finding in self.findings],
            "stays": [{k: round(v, 3) if isinstance(v, float) else v for k, v in row.items()} for row in stays],
        }


def audit(evidence: Evidence) -> Audit:
    """The audit of a run's evidence. A part counts as delivered when the run claims so and no finding names it."""
    return Audit(evidence, tuple(findings(evidence)))


def kept_evidence(folder: Path, task: Task, order: Order) -> Evidence:
    """The evidence in a run's folder: its frames, the measured rows of `schedule.csv`, and what `run.json` claims of them.

    Raises BadInput for a file that is missing or damaged.
    """
    where = f"run '{folder}'"
    try:
        run = json_of(read_limited(folder / "run.json"))
        claimed = run["audit"]["claimed"]
        if not isinstance(claimed, list) or not all(isinstance(name, str) for name in claimed):
            raise ValueError(f"claimed parts {shortened(repr(claimed))}: wanted a list of names")
        kept = run["audit"].get("plan_kept") is True
        struck = [
            Struck(str(fault["what"]), str(fault["part"]), str(fault["station"])) for fault in run["audit"]["struck"]
        ]
        rows = schedule_rows(read_limited(folder / "schedule.csv").decode())
    except OSError as error:
        raise BadInput(f"{where}: '{error.filename}' cannot be read: {error.strerror or error}") from None
    except (ValueError, KeyError, TypeError) as error:
        why = f"no {error}" if isinstance(error, KeyError) else " ".join(str(error).split())[:120]
        raise BadInput(f"{where}: its run.json or schedule.csv is damaged, or of an older lab: {why}") from None
    tracks = read_tracks(folder / FILE)
    return Evidence(task, order, tracks, rows["measured"], claimed, struck, rows["planned"] if kept else ())


def schedule_rows(text: str) -> dict[str, list[dict[str, Any]]]:
    """The rows of a `schedule.csv`, by "planned" and "measured", with times as numbers [s].

    Raises ValueError and KeyError for another file.
    """
    rows: dict[str, list[dict[str, Any]]] = {"planned": [], "measured": []}
    for row in DictReader(StringIO(text)):
        if not {"part", "operation", "station", "target", "robot"} <= row.keys():
            raise ValueError("schedule.csv lacks a column")
        own: dict[str, Any] = row | {"start_s": float(row["start_s"]), "end_s": float(row["end_s"])}
        if not 0.0 <= own["start_s"] <= own["end_s"] < inf:
            raise ValueError(f"schedule.csv has a row from {row['start_s']} to {row['end_s']} s")
        rows[row["when"]].append(own)
    return rows
