"""Sentences that correct themselves, say what they do not mean, or name a later step first: their slots as they are meant."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

from lab.words.clauses import SEPARATORS
from lab.words.slots import Amount, Slot

Slots = tuple[Slot, ...]
NAMING = frozenset(["dir", "side", "amount", "until", "thing", "part", "station", "work", "numbered"])
COMPLETE = {"dir": ("amount", "until"), "amount": ("dir",)}
MOTIONS = frozenset(["GO", "MOVE", "TURN", "TO", "ON", "ONLYTHEN", "PUT", "IN"])


WEAK = ("actually", "sorry")  # words that correct only after a comma


class NotClear(Exception):
    """A correction of which it is not clear what it corrects."""


def as_meant(slots: Slots, on_map: bool) -> Slots:
    """The slots without what was taken back in the same breath and what is only said not to be meant. Raises NotClear."""
    slots = _with_single_breaks(slots)
    if (
        [slot.kind for slot in slots[1:2]] == ["COMMA"]
        and slots[0] == Slot("dir", "right")
        and slots[2].kind in ("GO", "MOVE", "TURN")
    ):
        raise NotClear("'right' may be a direction or no more than 'well'")
    slots = _corrected(slots)
    slots = _without_asides(tuple(slot for slot in slots if slot.kind != "CORRECT"))
    return _in_order(slots) if on_map else slots


def _with_single_breaks(slots: Slots) -> Slots:
    """The slots with the strongest of several separators that follow each other."""
    kept: list[Slot] = []
    for slot in slots:
        if slot.kind in SEPARATORS and kept and kept[-1].kind in SEPARATORS:
            kept[-1] = max(kept[-1], slot, key=lambda one: SEPARATORS[one.kind])
        else:
            kept.append(slot)
    return tuple(kept)


def _last_break(slots: Sequence[Slot]) -> int:
    """Where the last clause of slots begins."""
    return max((n + 1 for n, slot in enumerate(slots) if slot.kind in SEPARATORS), default=0)


def _corrected(slots: Slots) -> Slots:
    """Without what a later part corrects: "two left, no, three left" and "two left, sorry, three"."""
    while (at := next((n for n, slot in enumerate(slots) if _corrects(slots, n)), None)) is not None:
        before, after = list(slots[:at]), list(slots[at + 1 :])
        while before and before[-1].kind in SEPARATORS:
            before.pop()
        while after and (after[0].kind in (*SEPARATORS, "CORRECT", "NO") or (before and after[0].kind == "SCRATCH")):
            after.pop(0)
        if slots[at].kind == "SCRATCH":
            slots = tuple(after) if after else (slots[at],)
            continue
        end = next((n for n, slot in enumerate(after) if slot.kind in SEPARATORS), len(after))
        start = _last_break(before)
        slots = (*before[:start], *_merged(before[start:], after[:end]), *after[end:])
    return slots


def _corrects(slots: Slots, at: int) -> bool:
    """Whether a slot is a word of correction with something before it; "sorry" and "no" at a beginning correct nothing."""
    slot = slots[at]
    if slot.kind == "SCRATCH":
        return _commands(slots[:at]) or ("thought" in slot.value and len(slots) > 1)
    if slot.kind == "CORRECT":
        return slot.value not in WEAK or at == 0 or slots[at - 1].kind in SEPARATORS
    later = any(slot.kind in NAMING for slot in slots[at + 1 :])
    earlier = any(slot.kind in NAMING for slot in slots[_last_break(slots[: max(0, at - 1)]) : at])
    is_apart = (
        at > 0
        and slots[at - 1].kind in ("COMMA", "DOT")
        and slots[at + 1 : at + 2] != ()
        and slots[at + 1].kind in (*SEPARATORS, *NAMING, *MOTIONS)
    )
    return (
        slot.kind == "NO"
        and slots[at + 1 : at + 2] != ()
        and slots[at + 1].kind != "work"
        and is_apart
        and earlier
        and later
    )


def _commands(slots: Slots) -> bool:
    """Whether there is a command that can be scratched: "no, that was bad, scratch that" takes back an earlier answer."""
    breaks = [-1, *(n for n, slot in enumerate(slots) if slot.kind in SEPARATORS), len(slots)]
    parts = ({slot.kind for slot in slots[a + 1 : b]} for a, b in pairwise(breaks))
    return any("BAD" not in kinds and kinds - {"NO", "NOTTHAT", "CORRECT", "SCRATCH", "YES", "OK"} for kinds in parts)


def _merged(wrong: Sequence[Slot], right: Sequence[Slot]) -> list[Slot]:
    """A clause with its correction: the correction if it is as complete, else what it names put in its place."""
    said = [slot.kind for slot in wrong if slot.kind in NAMING]
    new = [slot for slot in right if slot.kind in NAMING]
    if not said or not new:
        return [*wrong, *([Slot("COMMA")] if wrong and right else []), *right]
    kinds = {slot.kind for slot in new}
    if kinds >= set(said) or {"dir", "amount"} <= kinds or {"dir", "until"} <= kinds or not kinds & set(said):
        if not kinds & set(said) and not (kinds & {"until", "amount"} and set(said) & {"until", "amount"}):
            return [*wrong, Slot("COMMA"), *right]
        return list(right) if kinds & {"dir", "thing", "part", "numbered"} else _put_in(wrong, new)
    return _put_in(wrong, new)


def _put_in(wrong: Sequence[Slot], new: Sequence[Slot]) -> list[Slot]:
    """The clause with what is named anew in the place of what it named last."""
    result = list(wrong)
    for slot in new:
        alike = ("until", "amount") if slot.kind in ("until", "amount") else (slot.kind,)
        at = max((n for n, old in enumerate(result) if old.kind in alike), default=None)
        if at is None:
            raise NotClear("say again in one sentence what is meant")
        if isinstance(slot.value, Amount) and isinstance(result[at].value, Amount) and slot.value.is_bare:
            slot = Slot(
                slot.kind, replace(slot.value, unit=result[at].value.unit, is_bare=result[at].value.unit is None)
            )
        result[at] = slot
    return result


def _without_asides(slots: Slots) -> Slots:
    """Without "not left" where another direction is said: "not left but right", "right, not left"."""
    for at, slot in enumerate(slots):
        if slot.kind not in ("NOT", "NO", "NOTTHAT"):
            continue
        end = at + 1
        while end < len(slots) and (slots[end].kind in NAMING or slots[end].kind in MOTIONS):
            end += 1
        denied = {item.kind for item in slots[at + 1 : end] if item.kind in NAMING}
        if not denied or (end < len(slots) and slots[end].kind not in SEPARATORS):
            continue
        rest = slots[:at] + slots[end + _has_but(slots, end) :]
        kept = {item.kind for item in rest if item.kind in NAMING}
        if denied <= kept and not any(item.kind in ("BEFORE", "AFTER", "WAIT") for item in rest):
            return _without_asides(rest)
    return slots


def _has_but(slots: Slots, at: int) -> bool:
    return slots[at : at + 1] != () and slots[at].kind == "BUT"


def _in_order(slots: Slots) -> Slots:
    """The steps of a map in the order in which they are to be done: "left 2, but first up 1", "up 1 before you go left"."""
    if any(slot.kind in ("ASK", "QUIET") for slot in slots):
        return slots  # "do not ask before you are stuck"
    for at, slot in enumerate(slots):
        first, second = slots[:at], slots[at + 1 :]
        if slot.kind == "BUTFIRST" and first and second:
            return (*_in_order(second), Slot("THEN"), *_trimmed(first))
        if slot.kind == "BUTFIRST":
            return _in_order((*first, *second))
        if slot.kind not in ("BEFORE", "AFTER"):
            continue
        steps = any(item.kind in NAMING for item in first)
        if steps and (slot.kind == "BEFORE" or first[-1].kind in SEPARATORS):
            return (*_trimmed(first), Slot("THEN"), *_in_order(second))
        if steps:
            return (*_in_order(second), Slot("THEN"), *_trimmed(first))
        named = next((n for n, item in enumerate(second) if item.kind in NAMING), len(second))
        cut = next((n for n, item in enumerate(second) if item.kind in SEPARATORS), None)
        cut = cut or next(
            (n for n, item in enumerate(second) if n > named and item.kind in ("GO", "MOVE", "TURN")), None
        )
        if cut is None:
            raise NotClear("say what comes first, then what comes after it")
        near, far = second[:cut], second[cut:]
        return (*far, Slot("THEN"), *near) if slot.kind == "BEFORE" else (*near, Slot("THEN"), *far)
    return slots


def _trimmed(slots: Slots) -> Slots:
    end = len(slots)
    while end and slots[end - 1].kind in SEPARATORS:
        end -= 1
    return slots[:end]
