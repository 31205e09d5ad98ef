"""What an audit asks of machines that work on several parts together."""

from collections.abc import Iterator
from itertools import permutations

from lab.audit.evidence import SLACK_S, Evidence, Finding


def batches(evidence: Evidence) -> Iterator[Finding]:
    """A machine with batches works on all parts in it together: none comes or goes meanwhile, and their rows are alike."""
    own = [seen for seen in evidence.parts if evidence.undisturbed(seen.name)]
    for name in [station.name for station in evidence.task.stations if station.batch]:
        rows = {
            seen.name: [one for one in evidence.own_rows(seen.name, "process") if one["station"] == name]
            for seen in own
        }
        for seen, other in permutations(own, 2):
            for begin_s, end_s in [(row["start_s"], row["end_s"]) for row in rows[seen.name]]:
                there = [s for s in other.stays if s.station == name and s.end_s > begin_s + SLACK_S]
                stay = next((s for s in there if s.start_s < end_s - SLACK_S), None)
                if stay is None:
                    continue
                comes, goes = stay.start_s > begin_s + SLACK_S, stay.end_s < end_s - SLACK_S
                alike = any(
                    max(abs(row["start_s"] - begin_s), abs(row["end_s"] - end_s)) <= SLACK_S for row in rows[other.name]
                )
                if comes or goes:
                    at_s, verb = (stay.start_s, "came to") if comes else (stay.end_s, "left")
                    words = f"{verb} '{name}' at {at_s:.1f} s, while the batch with {seen.name} was worked on"
                    yield Finding("batch", other.name, name, at_s, words)
                elif not alike:
                    words = f"stood in '{name}' with {seen.name}, and was not worked on together with it"
                    yield Finding("batch", other.name, name, begin_s, words)
