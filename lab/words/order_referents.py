"""What clauses about the order of transfers refer to in their scene: parts, stations, and the moves that are allowed."""

from collections.abc import Sequence

from lab.words.clauses import Clause, Misfit, Said, Unclear, listed, without_going_on
from lab.words.meaning import Before, Finish, Intent, Move, Never, Stop, Work
from lab.words.on_order import IT, THERE
from lab.words.scene import OrderScene
from lab.words.slots import Part


class OrderReferents:
    """Turns the clauses of a sentence into intents on the order; it remembers the part and the station that were named last."""

    def __init__(self, scene: OrderScene) -> None:
        self.scene = scene
        self._part: str | None = None
        self._station: str | None = None

    def intents(self, clauses: Sequence[Clause]) -> tuple[Intent, ...]:
        """The intents of the clauses, in order. Raises Unclear or Misfit."""
        found: list[Intent] = []
        for clause in without_going_on(clauses):
            for intent in self._intents(clause) if isinstance(clause, Said) else (clause,):
                if not (found and found[-1] == intent):
                    found.append(intent)
        if not found:
            raise Misfit
        return tuple(found)

    def _intents(self, clause: Said) -> tuple[Intent, ...]:
        values = clause.values
        match clause.rule:
            case "unclear":
                raise Unclear(str(values[0]))
            case "reason":
                if values:
                    self._named(values[0])
                return ()
            case "stay":
                raise Misfit
            case "stop":
                return (Stop(),)
            case "number":
                numbers = {move.number for move in self.scene.moves}
                if values[0] not in numbers:
                    raise Unclear(f"{values[0]:g} is none of the moves: {listed([str(n) for n in sorted(numbers)])}")
                return (Move(int(values[0])),)
            case "move":
                return (self._move(*values),)
            case "finish":
                return (Finish(self._single(values[0])),)
            case "never":
                part, station = values
                return (Never(self._part_or_any(part), self._place(station)),)
            case "before":
                return (self._before(*values),)
            case "in turn":
                return self._in_turn(*values)
        raise AssertionError(clause)

    def _before(self, first: Said, second: Said) -> Before:
        works = [self._work(work) for work in (first, second)]
        if works[0] == works[1] or Work() in works:
            raise Misfit
        return Before(works[0], works[1])

    def _in_turn(self, first: Said, second: Said) -> tuple[Intent, ...]:
        """Two moves if both are allowed now, else one work before the other."""
        try:
            pair = tuple(
                self._move(part, None, station)
                for part, station, _ in (first.values, second.values)
                if station and not part.is_any
            )
        except (Unclear, Misfit):
            pair = ()
        return pair if len(pair) == 2 else (self._before(first, second),)

    def _place(self, station: str) -> str:
        if station == THERE:
            if self._station is None:
                raise Unclear("'there' is no station that was named: name it")
            return self._station
        self._station = station
        return station

    def _named(self, part: Part) -> tuple[str, ...]:
        if part == IT:
            if self._part is None:
                raise Unclear("'it' is no part that was named: name it")
            return (self._part,)
        if len(part.parts) == 1:
            self._part = part.parts[0]
        return part.parts

    def _single(self, part: Part) -> str:
        parts = self._named(part)
        if len(parts) != 1:
            raise Unclear(f"several parts fit: say which of {listed(parts)}")
        return parts[0]

    def _part_or_any(self, part: Part) -> str | None:
        """The part; None for any, also for a kind as "bread"."""
        parts = () if part.is_any else self._named(part)
        return parts[0] if len(parts) == 1 else None

    def _move(self, part: Part, origin: str | None, target: str | None) -> Move:
        parts = self.scene.parts if part.is_any else self._named(part)
        origin = None if origin is None else self._place(origin)
        target = None if target is None else self._place(target)
        fitting = [
            move
            for move in self.scene.moves
            if move.part in parts and origin in (None, move.origin) and target in (None, move.target)
        ]
        if len(fitting) != 1:
            among = fitting or [move for move in self.scene.moves if move.part in parts] or self.scene.moves
            known = listed([f"{move.number} ({move.part}, {move.origin} to {move.target})" for move in among[:4]])
            said = "several moves fit" if fitting else "that is none of the moves now"
            raise Unclear(f"{said}: {known}")
        self._part, self._station = fitting[0].part, fitting[0].target
        return Move(fitting[0].number)

    def _work(self, work: Said) -> Work:
        part, station, _ = work.values
        if part == IT and self._part is None:
            part = Part(is_any=True)  # "everything has to be washed before it goes to the exit"
        return Work(self._part_or_any(part), None if station is None else self._place(station))
