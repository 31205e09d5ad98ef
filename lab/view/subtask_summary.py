"""Found sub-tasks as text: a map of a grid with the proposed doorways, and what was learned."""

from collections.abc import Collection, Mapping, Sequence
from string import ascii_lowercase, digits
from typing import Any

from rich.console import Group, RenderableType
from rich.text import Text

from lab.errors import counted
from lab.mdp import TabularMDP
from lab.view.summary import table_of

MARKS = digits[1:] + ascii_lowercase  # of the proposals, on a map


def map_of(mdp: TabularMDP, seen: Collection[int], groups: Sequence[Sequence[int]]) -> str:
    """The map of a grid with two axes: S, G, a mark for each proposal, . for other states seen, blank for all others.

    "" for a problem that is no such grid.
    """
    if len(mdp.shape) != 2:
        return ""
    marks = dict.fromkeys(seen, ".") | {state: "G" for state in range(mdp.n_states) if mdp.goal[state]}
    marks |= {mdp.start: "S"}
    marks |= {state: mark for mark, group in zip(MARKS, groups, strict=False) for state in group}
    height, width = mdp.shape
    rows = ("".join(marks.get(row * width + column, " ") for column in range(width)) for row in range(height))
    return "\n".join(row.rstrip() for row in rows)


def proposals_text(mdp: TabularMDP, named: Sequence[tuple[str, Sequence[int]]]) -> str:
    """One line for each proposal: its mark, its name, where it is."""
    marks = [*MARKS, *("" for _ in named)]
    return "\n".join(
        f"{mark:1} {name}: {', '.join(map(mdp.state_label, states))}".strip()
        for mark, (name, states) in zip(marks, named, strict=False)
    )


def subtask_summary(document: Mapping[str, Any]) -> RenderableType:
    """The document of `lab find --json` as text."""
    proposed, kept = document["proposed"], [one for one in document["proposed"] if one["accepted"]]
    seen = f"{counted(document['moves'], 'move')} through {counted(document['states_seen'], 'state')}"
    if not proposed:
        return Text(f"no bottleneck in {seen} of '{document['problem']}': with more --episodes there may be one")
    lines = [f"{len(kept)} of {counted(len(proposed), 'proposed sub-task')} accepted, found in {seen}"]
    if not document["ways"]:
        return Text("\n".join(lines))
    parts: list[RenderableType] = [Text("\n".join(lines))]
    parts.append(table_of(document["ways"], ("to", "from", "episodes", "moves", "longest", "saved_as")))
    if document["gain"] is not None:
        parts.append(Text(gain_text(document)))
    return Group(*parts)


def gain_text(document: Mapping[str, Any]) -> str:
    """What the accepted sub-tasks gain, in a sentence; how many ways were learned, where that was not measured."""
    gain, ways = document["gain"], document["ways"]
    if gain is None:
        return f"{counted(len(ways), 'way')} learned and kept."
    return (
        f"gain: {gain['tasks']} drawn tasks in the same rooms took {counted(gain['moves'], 'move')} in "
        f"{counted(gain['episodes'], 'episode')} with these ways, {counted(gain['flat_moves'], 'move')} in "
        f"{counted(gain['flat_episodes'], 'episode')} without; finding them took {counted(document['moves'], 'move')}, "
        f"learning the ways {sum(way['moves'] for way in ways)} more"
    )
