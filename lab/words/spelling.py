"""Typing errors: the known word that was meant."""

from collections.abc import Sequence, Set

from lab.words.vocabulary import frequent_words, other_words

GLUED = frozenset(["to", "the", "and", "then", "of", "in", "on", "until", "go", "left", "right", "two", "three", "a"])


def distance(first: str, second: str, most: int) -> int:
    """The fewest insertions, deletions, replacements and swaps of neighbours between two words; most + 1 if there are more."""
    if abs(len(first) - len(second)) > most:
        return most + 1
    before: list[int] = []
    row = list(range(len(second) + 1))
    for i, a in enumerate(first, 1):
        last, row = row, [i]
        for j, b in enumerate(second, 1):
            cost = min(last[j] + 1, row[j - 1] + 1, last[j - 1] + (a != b))
            if i > 1 and j > 1 and a == second[j - 2] and first[i - 2] == b:
                cost = min(cost, before[j - 2] + 1)
            row.append(cost)
        before = last
        if min(row) > most:
            return most + 1
    return row[-1]


def corrected(word: str, known: Set[str], frequent: Set[str] = frozenset()) -> str | None:
    """The known word that was meant by a word with typing errors; None if none or several are near.

    Up to three letters only a swap is corrected, up to seven one error, from eight on two. Of several near words one of the
    frequent is taken, else one with the same letters, else one with the same first letter.
    """
    if word in other_words() or not word.isalpha() or len(word) < 3:
        return None
    doubled = "".join(c for n, c in enumerate(word) if word[max(0, n - 2) : n + 1] != c * 3)
    for squeezed in (doubled, "".join(c for n, c in enumerate(word) if n == 0 or word[n - 1] != c)):
        if len(doubled) < len(word) and squeezed in known:
            return squeezed
    frequent = frequent | frequent_words()
    most = 1 if len(word) < 8 else 2
    near: dict[int, list[str]] = {}
    for other in known:
        if len(other) < 2 or (len(other) == 2 and len(word) > 2):
            continue
        apart = distance(word, other, most)
        if apart > most:
            continue
        same_letters = sorted(word) == sorted(other)
        if len(word) == 3 and not same_letters and not (len(other) == 4 and other in frequent):
            continue
        if len(other) <= 3 and not same_letters and set(word) - set(other):
            continue
        near.setdefault(apart, []).append(other)
    for apart in sorted(near):
        found = sorted(near[apart])
        for better in (
            [other for other in found if other in frequent],
            [other for other in found if sorted(other) == sorted(word)],
            [other for other in found if other[0] == word[0]],
            [other for other in found if other[-1] == word[-1]],
        ):
            if len(better) == 1:
                return better[0]
            if better:
                found = better
        return found[0] if len(found) == 1 else None
    return None


def apart(words: Sequence[str], known: Set[str]) -> list[str]:
    """The words, two in one ("tothe") apart."""
    result = list[str]()
    for word in words:
        cuts = [
            (word[:n], word[n:]) for n in range(2, len(word) - 1)
            if word[:n] in known and word[n:] in known and len(word) > 4 and (word[:n] in GLUED or word[n:] in GLUED)
        ] if word.isalpha() and word not in known and word not in other_words() else []  # fmt: skip
        result += cuts[0] if len(cuts) == 1 else (word,)
    return result
