"""Raw text to the words of the grammar: contractions, typing errors, numbers, lengths, and the names of the scene."""

import re
import unicodedata
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache

from lab.words.scene import GridScene, OrderScene, Scene
from lab.words.vocabulary import LENGTHS, SKIPPED, sections

MOST_WORDS = 60  # of a sentence
CONTRACTIONS = (
    *((rf"\b{short}\b", full) for short, full in {
        "can'?t": "can not", "cannot": "can not", "won'?t": "will not", "shan'?t": "shall not", "i'?m": "i am",
        "youre": "you are", "youve": "you have", "thats": "that is", "whats": "what is", "theres": "there is",
        "let'?s": "let us", "lets": "let us", "don'?t": "do not", "doesn'?t": "does not", "didn'?t": "did not",
        "isn'?t": "is not", "wasn'?t": "was not", "aren'?t": "are not", "mustn'?t": "must not",
        "shouldn'?t": "should not", "wouldn'?t": "would not", "couldn'?t": "could not", "needn'?t": "need not",
        "haven'?t": "have not", "hasn'?t": "has not", "ain'?t": "is not", "gonna": "going to", "wanna": "want to",
        "gotta": "have to", "id like": "i would like", "ive": "i have", "itll": "it will", "ill": "i will",
        "u": "you", "strait": "straight", "thn": "then", "dn": "down", "rt": "right", "pls": "please",
        "plz": "please", "upto": "up to", "goto": "go to", "alot": "a lot", "lemme": "let me", "gimme": "give me",
        "hows": "how is", "hes": "he is", "w/o": "without", "ur": "your", "thx": "thanks", "twise": "twice",
        "tw": "two",
    }.items()),
    (r"\b(away|clear|far|back) form\b", r"\1 from"),
    *((rf"{short}\b", f" {full}") for short, full in {
        "n't": "not", "'re": "are", "'ve": "have", "'ll": "will", "'d": "would", "'m": "am", "'s": "is",
    }.items()),
)  # fmt: skip
UNITS_AND_TEENS = (
    *("zero", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine", "ten", "eleven", "twelve"),
    *("thirteen", "fourteen", "fifteen", "sixteen", "seventeen", "eighteen", "nineteen"),
)
TENS = {
    "twenty": 20, "thirty": 30, "forty": 40, "fifty": 50, "sixty": 60, "seventy": 70, "eighty": 80, "ninety": 90,
}  # fmt: skip
NUMBERS = {**{word: n for n, word in enumerate(UNITS_AND_TEENS)}, **TENS, "fourty": 40, "dozen": 12, "hundred": 100}
TIMES = {"twice": 2, "thrice": 3}
AMOUNTS = ("couple", "pair", "half", "quarter", "quarters", "of", "a", "toast")
ORDINALS = {
    "first": 1, "second": 2, "third": 3, "fourth": 4, "fifth": 5, "sixth": 6, "seventh": 7, "eighth": 8, "ninth": 9,
    "tenth": 10, "1st": 1, "2nd": 2, "3rd": 3, **{f"{n}th": n for n in range(4, 13)},
}  # fmt: skip


@dataclass(frozen=True)
class Reading:
    """The words of a text as the grammar has them, the words that nobody knows, and what was corrected."""

    text: str
    unknown: tuple[str, ...] = ()
    corrected: tuple[tuple[str, str], ...] = ()


def words_of(text: str) -> list[str]:
    """The words, numbers and separators of a text in lower case, contractions in full."""
    plain = unicodedata.normalize("NFKD", text.replace("’", "'").replace("‘", "'").replace("`", "'").replace("´", "'"))
    plain = (
        "".join(c for c in plain if not unicodedata.combining(c))
        .lower()
        .replace("½", " half ")
        .replace("¼", " quarter ")
    )
    for pattern, full in CONTRACTIONS:
        plain = re.sub(pattern, full, plain)
    plain = re.sub(r"(\d)[.,](\d)", r"\1_\2", plain)
    found = re.findall(r"\d+_\d+|\d+(?:st|nd|rd|th)\b|\d+|[^\W\d_]+|[,;:.!?&]|[^\s\w'\"()\-–—…*]", plain)
    return ["and" if word == "&" else word.replace("_", ".") for word in found]


def _normal(words: Iterable[str]) -> list[str]:
    """Words without those that have no meaning of their own, and with numbers in digits."""
    return [str(NUMBERS[word]) if word in NUMBERS else word for word in words if word not in SKIPPED]


def phrases_of(listed: Iterable[str]) -> tuple[str, ...]:
    """The phrases of a row of the vocabulary, as the reader writes them, longest first."""
    said = [
        text
        for phrase in listed
        for text in (phrase, re.sub(r"\b(work|find|make|pick|wind) way\b", r"\1 your way", phrase))
    ]
    written = {" ".join(_normal(phrase.split())) for phrase in said} - {""}
    return tuple(sorted(written, key=lambda phrase: (-len(phrase), phrase)))


@cache
def kinds_of_words() -> Mapping[str, tuple[str, ...]]:
    """Kind of word -> its phrases, longest first; kinds of an order begin with O_."""
    found = sections()
    orders = {f"O_{kind}": listed for kind, listed in found["order"].items()}
    rows = {**found["common"], **found["map"], **orders, **found["phrases"]}
    return {kind: phrases_of(listed) for kind, listed in rows.items()}


@cache
def known_words(section: str) -> frozenset[str]:
    """The single words of scenes whose own words are in a section, "map" or "order"."""
    found = sections()
    rows = [row for name in ("common", section, "phrases") for row in found[name].values()]
    words = {word for row in rows for phrase in row for word in re.findall(r"[a-z]+", phrase)}
    return frozenset({*words, *NUMBERS, *TIMES, *ORDINALS, *LENGTHS, *SKIPPED, *AMOUNTS})


@cache
def other_words() -> frozenset[str]:
    """The words that are near a known one and are not that word with a typing error."""
    return frozenset(sections()["other"]["WORDS"])


# ---- typing errors -------------------------------------------------------------------------------------------------------


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


def corrected(word: str, known: frozenset[str], frequent: frozenset[str]) -> str | None:
    """The known word that was meant by a word with typing errors; None if none or several are near.

    Up to three letters only a swap is corrected, up to seven one error, from eight on two. Of several near words one of
    `frequent` is taken, else one with the same letters, else one with the same first letter.
    """
    if word in other_words() or not word.isalpha() or len(word) < 3:
        return None
    squeezed = re.sub(r"(.)\1{2,}", r"\1", word)
    if squeezed != word and squeezed in known:
        return squeezed
    most = 1 if len(word) < 8 else 2
    near: dict[int, list[str]] = {}
    for other in known:
        if len(other) < 2 or (len(other) == 2 and len(word) > 2):
            continue
        apart = distance(word, other, most)
        if apart <= most and (
            len(word) > 3 or sorted(word) == sorted(other) or (len(other) == 4 and other in frequent)
        ):
            if len(other) <= 3 and sorted(word) != sorted(other) and len(set(word) - set(other)) > 0:
                continue
            near.setdefault(apart, []).append(other)
    for apart in sorted(near):
        found = sorted(near[apart])
        for better in (
            [other for other in found if sorted(other) == sorted(word)],
            [other for other in found if other in frequent],
            [other for other in found if other[0] == word[0]],
        ):
            if len(better) == 1:
                return better[0]
            if better:
                found = better
        return found[0] if len(found) == 1 else None
    return None


# ---- names of the scene --------------------------------------------------------------------------------------------------

SYNONYMS: Mapping[str, tuple[str, ...]] = {
    "cube": ("cube", "block", "brick", "die"),
    "goal": ("goal", "slot", "target", "destination", "hole"),
    "bin": ("bin", "box", "container", "basket"),
    "plate": ("plate", "dish"),
    "machine": ("machine", "device", "apparatus"),
    "toaster": ("toaster",),
    "toast": ("toast", "slice", "bread", "slice of toast", "slice of bread", "piece of toast", "piece of bread"),
    "cup": ("cup", "mug"),
    "shaft": ("shaft", "axle"),
    "gear": ("gear", "cog", "gearwheel", "gear wheel", "cogwheel"),
    "slice": (
        "slice",
        "bread",
        "toast",
        "slice of bread",
        "piece of bread",
        "bread slice",
        "slice of toast",
        "piece of toast",
    ),
}
OBSTACLES = ("obstacle", "object", "block", "hurdle")
STATION_WORDS: Mapping[str, tuple[str, ...]] = {
    "washer": ("washer", "washing machine", "washing station", "wash"),
    "mill": ("mill", "milling machine", "milling station"),
    "lathe": ("lathe", "turning machine"),
    "tray": ("tray", "serving tray"),
    "plate": ("plate", "dish"),
    "exit": ("exit", "way out"),
    "toaster": ("toaster",),
}
STATION_WORK: Mapping[str, tuple[str, ...]] = {
    "lathe": ("turn", "turned", "turning"),
    "exit": (),
    "tray": ("serve", "served", "serving"),
    "plate": (),
}


STORES = (
    "buffer",
    "plate",
    "tray",
    "rack",
    "store",
    "storage",
    "table",
    "exit",
    "entry",
    "dock",
    "pallet",
)  # nothing is done there


def _plurals(names: Iterable[str]) -> list[str]:
    return [form for name in names for form in (name, f"{name}s")]


def work_words(station: str) -> list[str]:
    """The verbs of the work in a station: "toast", "toasting", "toasted", "toasts" for the toaster."""
    if station in STATION_WORK:
        return list(STATION_WORK[station])
    words = station.split()
    if words[-1] in STORES:
        return []
    stem = words[0] if len(words) > 1 else station.removesuffix("er") if station.endswith("er") else station
    stem = stem.rstrip("e")
    return [f"{stem}{ending}" for ending in ("ing", "ed", "es", "s", "e", "")]


def _station_forms(station: str) -> list[str]:
    """What a station may be called, its own name first."""
    words = station.split()
    if len(words) > 1:
        first, last = words[0], words[-1]
        return [
            station,
            last,
            f"{first}er",
            f"{first} station",
            f"{first} machine",
            f"{first}ing station",
            f"{first}ing machine",
        ]
    ing = [f"{station.removesuffix('er')}ing station"] if station.endswith("er") else []
    return [station, *STATION_WORDS.get(station, ()), *ing]


def _own(forms: Sequence[str], station: str, all_forms: Mapping[str, Sequence[str]]) -> list[str]:
    """The forms that no other station has, and the station's own name."""
    others = {form for other, listed in all_forms.items() if other != station for form in listed}
    return [form for form in forms if form == station or (form not in others and form not in all_forms)]


Named = Mapping[tuple[str, ...], str]  # words -> the word of the grammar


def names_of(scene: Scene) -> tuple[Named, tuple[tuple[str, object], ...]]:
    """The scene's names as words of the grammar, and what each of these stands for (ids, parts, stations)."""
    named: dict[tuple[str, ...], str] = {}
    means: list[tuple[str, object]] = []

    def add(kind: str, meaning: object, forms: Iterable[str]) -> None:
        word = f"{kind}{len(means)}x"
        means.append((word, meaning))
        for form in forms:
            named.setdefault(tuple(_normal(words_of(form))), word)

    if isinstance(scene, GridScene):
        by_name: dict[str, list[str]] = {}
        for thing in scene.objects:
            for name in thing.names:
                by_name.setdefault(name, []).append(thing.id)
        given = set(by_name)
        for name, ids in list(by_name.items()):
            for synonym in SYNONYMS.get(name, ()):
                if synonym not in given:
                    by_name.setdefault(synonym, []).extend(n for n in ids if n not in by_name[synonym])
        obstacles = [thing.id for thing in scene.objects if not thing.is_goal]
        for name in OBSTACLES:
            if obstacles and name not in by_name:
                by_name[name] = obstacles
        for thing in scene.objects:
            if (label := thing.id.replace("-", " ")) not in by_name:
                add("name", (thing.id,), (label,))
        for name, ids in by_name.items():
            add("name", tuple(ids), (name, f"{name}s") if len(ids) > 1 else (name,))
        return named, tuple(means)
    assert isinstance(scene, OrderScene)
    kinds: dict[str, list[str]] = {}
    for part in scene.parts:
        match = re.fullmatch(r"(.+) (\d+)", part)
        if match is None:
            add("part", part, SYNONYMS.get(part, (part,)))
            continue
        kinds.setdefault(match[1], []).append(part)
        number = int(match[2])
        ordinals = [word for word, n in ORDINALS.items() if n == number]
        forms = [part]
        for kind in dict.fromkeys((match[1], *SYNONYMS.get(match[1], ()))):
            forms += [f"{kind} {number}", f"{kind} number {number}", f"{kind} no {number}", f"{kind} nr {number}"]
            forms += [f"{ordinal} {kind}" for ordinal in ordinals] + [f"number {number} {kind}"]
        add("part", part, forms)
    for kind, parts in kinds.items():
        add(
            "kind",
            tuple(parts),
            _plurals(form for form in dict.fromkeys((kind, *SYNONYMS.get(kind, ()))) if form != "toast"),
        )
    forms_of = {station: _station_forms(station) for station in scene.stations}
    for station, forms in forms_of.items():
        add("station", station, _own(forms, station, forms_of))
    nouns = {form: parts for kind, parts in kinds.items() for form in (kind, *SYNONYMS.get(kind, ()))}
    works = {station: work_words(station) for station in scene.stations}
    for station, words in works.items():
        words = _own(words, station, works)
        for noun in [word for word in words if word in nouns]:
            add("actkind", (station, tuple(nouns[noun])), (noun,))
        add("act", station, words)
    return named, tuple(means)


# ---- the whole reading ---------------------------------------------------------------------------------------------------


def read(text: str, scene: Scene, named: Named, corrects: bool = True) -> Reading:
    """The text as words of the grammar."""
    known = known_words("map" if isinstance(scene, GridScene) else "order") | {
        word for words in named for word in words if word.isalpha()
    }
    frequent = frozenset(sections()["other"]["FREQUENT"]) | {word for words in named for word in words if len(word) > 3}
    right, unknown, changes = list[str](), list[str](), list[tuple[str, str]]()
    for word in _merged(_reason_cut(words_of(text)), known if corrects else None):
        if not word[0].isalpha() or word in known:
            right.append(word)
        elif corrects and (meant := corrected(word, known, frequent)) is not None:
            right.append(meant)
            changes.append((word, meant))
        else:
            right.append(f"?{word}")
            unknown.append(word)
    written = _named(_numbered(right), named)
    return Reading(" ".join(written), tuple(unknown), tuple(changes))


def _reason_cut(words: Sequence[str]) -> list[str]:
    """The words without a first part such as "I burnt my toast yesterday, so"."""
    if words[:1] == ["i"] and "," in words:
        cut = words.index(",")
        if list(words[cut + 1 : cut + 2]) == ["so"] and not {"want", "would", "need", "mean", "like"} & set(
            words[:cut]
        ):
            return list(words[cut + 2 :])
    return list(words)


def _merged(words: Sequence[str], known: frozenset[str] | None) -> list[str]:
    """The words, two in one ("tothe") apart; unchanged without known words."""
    if known is None:
        return list(words)
    result = list[str]()
    for word in words:
        cuts = [
            (word[:n], word[n:]) for n in range(2, len(word) - 1)
            if word[:n] in known and word[n:] in known and len(word[:n]) + len(word[n:]) > 4
            and (word[:n] in _GLUED or word[n:] in _GLUED)
        ] if word.isalpha() and word not in known and word not in other_words() else []  # fmt: skip
        result += cuts[0] if len(cuts) == 1 else (word,)
    return result


_GLUED = frozenset(["to", "the", "and", "then", "of", "in", "on", "until", "go", "left", "right", "two", "three"])


def _numbered(words: Sequence[str]) -> list[str]:
    """The words with numbers in digits, lengths as "20cm", and without those that mean nothing."""
    joined = " ".join(word for word in words if word not in SKIPPED)
    joined = re.sub(r"\b(?:a )?(?:couple|pair)(?: of)?\b", "2", joined)
    joined = re.sub(r"\bhalf (?:a )?dozen\b", "6", joined)
    joined = re.sub(r"\ba dozen\b", "12", joined)
    tens, units = "|".join(TENS), "|".join(UNITS_AND_TEENS[1:10])
    joined = re.sub(rf"\b({tens}) ({units})\b", lambda m: str(NUMBERS[m[1]] + NUMBERS[m[2]]), joined)
    joined = re.sub(r"\b(?:a|one) hundred\b", "100", joined)
    joined = re.sub(r"\b(\w+) point (\w+)\b", _pointed, joined)
    joined = " ".join(str(NUMBERS[word]) if word in NUMBERS else word for word in joined.split())
    joined = " ".join(f"{TIMES[word]} times" if word in TIMES else word for word in joined.split())
    units_of_length = "|".join(sorted(LENGTHS, key=len, reverse=True))
    joined = re.sub(
        rf"\b(\d+) and (?:a )?half ({units_of_length})\b", lambda m: _length(float(m[1]) + 0.5, m[2]), joined
    )
    joined = re.sub(rf"\ba ({units_of_length}) and (?:a )?half\b", lambda m: _length(1.5, m[1]), joined)
    joined = re.sub(
        rf"\b(\d+) quarters? of (?:a )?({units_of_length})\b", lambda m: _length(float(m[1]) / 4, m[2]), joined
    )
    joined = re.sub(rf"\b(?:a )?half (?:of )?(?:a )?({units_of_length})\b", lambda m: _length(0.5, m[1]), joined)
    joined = re.sub(rf"\b(?:a )?quarter (?:of )?(?:a )?({units_of_length})\b", lambda m: _length(0.25, m[1]), joined)
    joined = re.sub(rf"(\d+(?:\.\d+)?) ?({units_of_length})\b", lambda m: _length(float(m[1]), m[2]), joined)
    joined = re.sub(rf"\ba ({units_of_length})\b", lambda m: _length(1.0, m[1]), joined)
    return joined.split()


def _pointed(match: re.Match[str]) -> str:
    whole, part = (str(NUMBERS.get(word, word)) for word in match.groups())
    return f"{whole}.{part}" if whole.isdigit() and part.isdigit() else match[0]


def _length(number: float, unit: str) -> str:
    """A length in centimetres, with the unit that was said: "50cm100" is half a metre."""
    return f"{number * LENGTHS[unit]:g}cm{LENGTHS[unit]:g}"


def _named(words: Sequence[str], named: Named) -> list[str]:
    """The words with the scene's names as words of the grammar, the longest name first."""
    longest = max(map(len, named), default=0)
    result, at = list[str](), 0
    while at < len(words):
        for size in range(longest, 0, -1):
            if (word := named.get(tuple(words[at : at + size]))) is not None and len(words) >= at + size:
                result.append(word)
                at += size
                break
        else:
            result.append(words[at])
            at += 1
    return result
