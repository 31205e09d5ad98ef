"""What an audit asks of `schedule.csv`: the frames show what its measured rows say, and the robot's rows are one story."""

from collections.abc import Iterator, Sequence
from itertools import pairwise, zip_longest
from typing import Any

from lab.audit.evidence import SLACK_S, Evidence, Finding
from lab.audit.stays import PartSeen

MOVES = ("carry", "pallet")


def told(evidence: Evidence, seen: PartSeen) -> Iterator[Finding]:
    """The measured rows say where the part was and when it was carried, and it was carried at no other time."""
    carries = evidence.own_rows(seen.name, "carry")
    for row in carries:
        for place, at_s in ((row["station"], row["start_s"]), (row["target"], row["end_s"])):
            if not _stood_at(seen, place, at_s):
                words = f"is not at '{place}' at {at_s:.1f} s, as the schedule has it"
                yield Finding("schedule", seen.name, place, at_s, words)
    for row in evidence.own_rows(seen.name, "process"):
        inside = [s for s in seen.stays if s.station == row["station"] and s.start_s <= row["start_s"] + SLACK_S]
        if not any(stay.end_s >= row["end_s"] - SLACK_S for stay in inside):
            when = f"from {row['start_s']:.1f} to {row['end_s']:.1f} s"
            words = f"did not stand in '{row['station']}' {when}, as the schedule has it"
            yield Finding("schedule", seen.name, row["station"], row["start_s"], words)
    for stay in seen.stays if evidence.rows else ():
        works = evidence.task.station(stay.station).kind == "machine" and stay is not seen.stays[0]
        rows = [row for row in evidence.own_rows(seen.name, "process") if row["station"] == stay.station]
        if works and stay is not seen.stays[-1] and not rows:
            words = f"stood in '{stay.station}', and the schedule has no row of that"
            yield Finding("schedule", seen.name, stay.station, stay.start_s, words)
    for before, after in zip(seen.stays, seen.stays[1:], strict=False):
        if before.station != after.station and not any(
            row["start_s"] - SLACK_S <= before.end_s and after.start_s <= row["end_s"] + SLACK_S for row in carries
        ):
            words = f"went from '{before.station}' to '{after.station}' at {before.end_s:.1f} s, which the schedule does not have"
            yield Finding("schedule", seen.name, after.station, before.end_s, words)


def _stood_at(seen: PartSeen, station: str, at_s: float) -> bool:
    return any(
        stay.station == station and stay.start_s - SLACK_S <= at_s <= stay.end_s + SLACK_S for stay in seen.stays
    )


def one_story(evidence: Evidence) -> Iterator[Finding]:
    """What the robot did follows on one another in time and place, as planned and as measured; both have the same transfers.

    Of runs without faults; of one that ended early the plan's first transfers.
    """
    if evidence.struck:
        return
    for rows in (evidence.rows, evidence.planned):
        yield from _chained(rows)
    if not evidence.planned:
        return
    planned, measured = _moves(evidence.planned), _moves(evidence.rows)
    early = len(evidence.claimed) < len(evidence.parts)
    for number, (plan, done) in enumerate(zip_longest(planned, measured)):
        if plan == done or (done is None and early):
            continue
        part, station, _ = done or plan
        words = f"transfer {number + 1} is {_words(done)}, and in the plan {_words(plan)}"
        yield Finding("schedule", part, station, 0.0, words)
        return


def _words(move: tuple[str, str, str] | None) -> str:
    return "none" if move is None else f"{move[0]} from '{move[1]}' to '{move[2]}'"


def _moves(rows: Sequence[dict[str, Any]]) -> list[tuple[str, str, str]]:
    own = sorted((row for row in rows if row["operation"] in MOVES), key=lambda row: row["start_s"])
    return [(row["part"], row["station"], row["target"]) for row in own]


def _chained(rows: Sequence[dict[str, Any]]) -> Iterator[Finding]:
    """Each row of the robot's begins when and where the one before ended."""
    own = sorted((row for row in rows if row["robot"]), key=lambda row: (row["start_s"], row["end_s"]))
    for before, after in pairwise(own):
        if abs(after["start_s"] - before["end_s"]) > SLACK_S:
            words = f"from {after['start_s']:.1f} s, and the one before ends at {before['end_s']:.1f} s"
        elif after["station"] != before["target"]:
            words = f"from '{after['station']}', and it was at '{before['target']}'"
        else:
            continue
        words = f"'{after['operation']}' of the robot is {after['when']} {words}"
        yield Finding("schedule", after["part"] or before["part"] or "", after["station"], after["start_s"], words)
