"""Precedences between transfers of different parts, such as that a part which carries another one comes first."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from lab.errors import BadInput
from lab.sequencing.cell.routes import Option, Position, reached_from


@dataclass(frozen=True)
class RouteStep:
    """A transfer on a part's route: the one that brings it to a station or, with `leaves`, the one that takes it away."""

    station: str
    leaves: bool = False

    def __str__(self) -> str:
        return f"{'leave' if self.leaves else 'come to'} '{self.station}'"


@dataclass(frozen=True)
class Precedence:
    """A precedence: the k-th of `parts` (numbers from 1) to make `step` waits until `needs[k - 1]` of the parts `of` have ended
    `of_step`, on any route.

    needs: non-decreasing integers, one for each of `parts`; left out: all of `of`. With one part on each side it is the usual
    finish-to-start constraint. Source: finish-to-start precedence, Brucker et al. 1999.
    """

    parts: tuple[int, ...]
    step: RouteStep
    of: tuple[int, ...]
    of_step: RouteStep
    needs: tuple[int, ...] = ()

    @property
    def counts(self) -> tuple[int, ...]:
        """How many of `of` the first, second, ... of `parts` needs to have ended their step."""
        return self.needs or (len(self.of),) * len(self.parts)


class Rule(NamedTuple):
    """A precedence in terms of positions (indices).

    made, ended: the positions in which a part of `parts`, or of `of`, has made its step. counts: see `Precedence.counts`. A lost
    part is nowhere: it has left every station and come to none.
    """

    made: frozenset[int]
    ended: frozenset[int]
    counts: tuple[int, ...]

    def applies(self, place: int, option: Option) -> bool:
        """Whether an option of a position is the step that waits."""
        return option.to in self.made and place not in self.made

    def missing(self, made: int, ended: int) -> int:
        """How many more of `of` must end their step before one more part may begin its own; 0: it may."""
        return max(0, self.counts[made] - ended) if made < len(self.counts) else 0


def allows(rules: Sequence[Rule], counted: Sequence[int], place: int, option: Option) -> bool:
    """Whether no precedence forbids an option of a position; counted: the number of parts in each position."""
    return not any(rule.applies(place, option) and missing(rule, counted) for rule in rules)


def missing(rule: Rule, counted: Sequence[int]) -> int:
    """`Rule.missing` from the number of parts in each position."""
    return rule.missing(sum(counted[n] for n in rule.made), sum(counted[n] for n in rule.ended))


def signatures(precedences: Sequence[Precedence], parts: int) -> list[tuple[tuple[bool, bool], ...]]:
    """For each part, part 1 first, on which sides of each precedence it stands; parts that differ in it are not identical."""
    return [
        tuple((part in precedence.parts, part in precedence.of) for precedence in precedences)
        for part in range(1, parts + 1)
    ]


def made_in(
    positions: Sequence[Position], own: Collection[int], step: RouteStep, names: Sequence[str]
) -> frozenset[int]:
    """The positions of a product in which its part has made a step."""
    ways = [way for place in own for way in positions[place].options if way.carries == "part"]
    at = [names[way.origin] if step.leaves else names[way.target] for way in ways]
    return frozenset(
        reached_from(positions, {way.to for way, name in zip(ways, at, strict=True) if name == step.station})
    )


def check_precedences(
    precedences: Sequence[Precedence],
    names: Sequence[str],
    part_names: Sequence[str],
    steps: Mapping[str, Collection[RouteStep]],
) -> None:
    """Raises BadInput for a precedence with invalid parts, stations or counts; steps: those on every route of each product."""
    for precedence in precedences:
        where = f"precedence of {precedence.step} after {precedence.of_step}"
        for part in (*precedence.parts, *precedence.of):
            if not 1 <= part <= len(part_names):
                raise BadInput(f"{where}: there is no part {part}, only 1 to {len(part_names)}")
        for parts, step in ((precedence.parts, precedence.step), (precedence.of, precedence.of_step)):
            if not parts or len(set(parts)) < len(parts):
                raise BadInput(f"{where}: parts {list(parts)}: wanted one or more, each once")
            for part in parts:
                if step not in steps[part_names[part - 1]]:
                    known = dict.fromkeys(str(other) for other in steps[part_names[part - 1]])
                    raise BadInput(
                        f"{where}: {part_names[part - 1]} does not {step} on every route; it does {', '.join(known)}"
                    )
        if len(precedence.counts) != len(precedence.parts) or [*precedence.counts] != sorted(precedence.counts):
            raise BadInput(
                f"{where}: needs = {list(precedence.needs)}: wanted {len(precedence.parts)} counts that do not fall"
            )
        if precedence.counts[0] < 0 or precedence.counts[-1] > len(precedence.of):
            raise BadInput(
                f"{where}: needs = {list(precedence.counts)}: there are {len(precedence.of)} parts to wait for"
            )
