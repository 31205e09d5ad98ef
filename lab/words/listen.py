"""A sentence in a scene to what it means, or a refusal in words with the nearest sentence that would be understood.

Its words become tokens (reader), tokens what belongs together (slots), these are put right where the sentence corrects itself
(repairs), and cut into groups that mean something (clauses, on_map, on_order). A word that nobody knows, a group that means
nothing, and two meanings at the same cost are refused.
"""

from collections.abc import Sequence
from difflib import get_close_matches

from lab.words.clauses import Clause, Misfit, Unclear, cuts
from lab.words.map_referents import MapReferents
from lab.words.meaning import Intent, Refusal
from lab.words.on_map import meanings as map_meanings
from lab.words.on_order import meanings as order_meanings
from lab.words.order_referents import OrderReferents
from lab.words.reader import UNKNOWN, Token, read
from lab.words.repairs import NotClear, as_meant
from lab.words.said import examples, in_words
from lab.words.scene import GridScene, Scene
from lab.words.slots import TooLong, slots_of

MOST_WORDS = 60  # of a sentence
MOST_CHARACTERS = 1000
TIE = 0.55  # meanings whose costs differ by less are both possible
TOO_LONG = "that is too long: say it in shorter sentences"


def listen(text: str, scene: Scene, corrects: bool = True) -> list[Intent] | Refusal:
    """The intents of a sentence in the order in which they are to be done, or a refusal of one line.

    corrects: whether words with typing errors are corrected. A word that nobody knows, a name that fits several objects and what
    may mean two things are refused.
    """
    if len(text.split()) > MOST_WORDS or len(text) > MOST_CHARACTERS:
        return Refusal(TOO_LONG)
    tokens = read(text, scene, corrects)
    unknown = list(dict.fromkeys(token.text for token in tokens if token.kind == UNKNOWN))
    if not unknown:
        return _meant(tokens, scene, text)
    said = ", ".join(f"'{word[:20]}'" for word in unknown[:3])
    rest = _meant([token for token in tokens if token.kind != UNKNOWN], scene, text)
    reason = f"{said}: not understood"
    return Refusal(
        _hint(reason, scene, text) if isinstance(rest, Refusal) else f"{reason}; without it: {in_words(rest, scene)}?"
    )


def _meant(tokens: Sequence[Token], scene: Scene, said: str) -> list[Intent] | Refusal:
    """The only meaning of tokens at the least cost, or a refusal."""
    try:
        found = _readings(tokens, scene)
    except TooLong:
        return Refusal(TOO_LONG)
    meanings: dict[tuple[Intent, ...] | Refusal, float] = {}
    for cost, clauses in found:
        if meanings and cost > min(meanings.values()) + TIE:
            break
        referents = MapReferents(scene) if isinstance(scene, GridScene) else OrderReferents(scene)
        try:
            meaning: tuple[Intent, ...] | Refusal = referents.intents(clauses)
        except Misfit:
            continue
        except Unclear as unclear:
            meaning = Refusal(str(unclear))
        meanings.setdefault(meaning, cost)
    if not meanings:
        return Refusal(_hint("that is not understood", scene, said))
    refusal = next((meaning for meaning in meanings if isinstance(meaning, Refusal)), None)
    if refusal is not None:
        return refusal
    first, *others = (meaning for meaning in meanings if not isinstance(meaning, Refusal))
    if others:
        return Refusal(f"that may mean two things: {in_words(first, scene)}, or {in_words(others[0], scene)}?")
    return list(first)


def _readings(tokens: Sequence[Token], scene: Scene) -> list[tuple[float, tuple[Clause, ...]]]:
    """The ways to understand tokens as clauses, the cheapest first. Raises TooLong."""
    on_map = isinstance(scene, GridScene)
    found: dict[tuple[Clause, ...], float] = {}
    for slots in slots_of(tokens, "map" if on_map else "order"):
        try:
            meant = as_meant(slots, on_map)
        except NotClear:
            continue
        for cost, clauses in cuts(meant, map_meanings if on_map else order_meanings):
            total = cost + 0.1 * len(slots)
            found[clauses] = min(total, found.get(clauses, total))
    return sorted(((cost, clauses) for clauses, cost in found.items()), key=lambda pair: pair[0])


def _hint(reason: str, scene: Scene, text: str = "") -> str:
    """The reason with the nearest sentence that would be understood."""
    known = examples(scene)
    near = get_close_matches(text.lower(), known, n=1, cutoff=0.3) or known[:1]
    return f"{reason}; what would be: {near[0]}" if near else reason
