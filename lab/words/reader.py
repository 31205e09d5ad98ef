"""Raw text to the words of the grammar: contractions, typing errors, numbers, lengths, and the names of the scene."""

import re
import unicodedata
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache

from lab.words.scene import GridScene, OrderScene, Scene
from lab.words.vocabulary import COMMON, GRID, LENGTHS, ORDER, PHRASES, SKIPPED

MOST_WORDS = 60  # of a sentence
CONTRACTIONS = (
    *((rf"\b{short}\b", full) for short, full in {
        "can'?t": "can not", "cannot": "can not", "won'?t": "will not", "shan'?t": "shall not", "i'?m": "i am",
        "youre": "you are", "youve": "you have", "thats": "that is", "whats": "what is", "theres": "there is",
        "let'?s": "let us", "lets": "let us", "don'?t": "do not", "doesn'?t": "does not", "didn'?t": "did not",
        "isn'?t": "is not", "wasn'?t": "was not", "aren'?t": "are not", "mustn'?t": "must not", "shouldn'?t": "should not",
        "wouldn'?t": "would not", "couldn'?t": "could not", "needn'?t": "need not", "haven'?t": "have not",
        "hasn'?t": "has not", "ain'?t": "is not", "gonna": "going to", "wanna": "want to", "gotta": "have to",
        "id like": "i would like", "ive": "i have", "itll": "it will", "ill": "i will", "u": "you", "strait": "straight", "thn": "then", "dn": "down", "rt": "right",
        "pls": "please", "plz": "please", "upto": "up to", "goto": "go to", "alot": "a lot", "lemme": "let me",
        "gimme": "give me", "hows": "how is", "hes": "he is", "w/o": "without", "ur": "your", "thx": "thanks", "twise": "twice", "tw": "two",
    }.items()),
    (r"\b(away|clear|far|back) form\b", r"\1 from"), (r"n't\b", " not"), (r"'re\b", " are"), (r"'ve\b", " have"), (r"'ll\b", " will"), (r"'d\b", " would"), (r"'m\b", " am"),
    (r"\b(it|that|what|there|here|he|she|who|how|where|why|nothing|everything|way)'s\b", r"\1 is"), (r"'s\b", " is"),
)  # fmt: skip
UNITS_AND_TEENS = (
    "zero one two three four five six seven eight nine ten eleven twelve thirteen fourteen fifteen sixteen seventeen "
    "eighteen nineteen"
).split()
TENS = dict(zip("twenty thirty forty fifty sixty seventy eighty ninety".split(), range(20, 100, 10), strict=True))
NUMBERS = {**{word: n for n, word in enumerate(UNITS_AND_TEENS)}, **TENS, "fourty": 40, "dozen": 12, "hundred": 100}
TIMES = {"twice": 2, "thrice": 3}
ORDINALS = {
    **dict(zip("first second third fourth fifth sixth seventh eighth ninth tenth".split(), range(1, 11), strict=True)),
    **{f"{n}{ending}": n for n, ending in ((1, "st"), (2, "nd"), (3, "rd"), *((n, "th") for n in range(4, 13)))},
}
# words of our language that are near one of the grammar's, and are not that word with a typing error
OTHER_WORDS = frozenset(
    "lift light night fight sight might tight felt lest list last past paste post lot lots cat cut hat hit bat ball call tall fall"
    " fill bill kill will till mill well bell sell tell want went hunt wait wall walk talk work word world would wood wold food foot"
    " good god gold cold old hold told sold bold mold gone done none bone one tone stone store stare start state stay stays star step steps"
    " stop stops top tap tip trip drip drop crop shop ship slip sleep sheep cheap heap help held head heat heart hear here there where"
    " were wear bear beer deer dear near fear year gear tear rear real deal meal meat meet feet feel fell tower town down dawn drawn drown"
    " brown crown clown bread break brake bake cake lake make take tale sale male pale pile mile smile file life wife wise rise rice nice"
    " dice price prize size side ride wide hide tide time lime line fine mine wine pine pin bin fin tin win ten men pen den hen when then than"
    " that what hat this thin thing think thank tank bank rank sank sang song long wrong strong string spring bring king ring wing sing"
    " camp lamp damp jump lump pump bump bum bug bag big beg bed red rod road load loaf leaf lead read ready lady baby body busy bury burn"
    " turn born corn horn torn worn worm warm arm harm farm form from firm film fish dish wish wash cash dash lash mash rash crash trash flash"
    " fresh flesh house mouse horse nurse purse curse course coarse coat boat goat float flat fat mat rat sat eat tea sea see bee fee free tree"
    " three throw throat through though thought taught caught cough rough tough touch such much march match catch watch water later matter"
    " letter better butter bitter litter little battle bottle cattle castle table cable able label level lever never ever every very"
    " green queen screen seen keen been bean clean mean lean learn loan load lord cord card hard yard ward word"
    " blue glue clue true rule ruler red yellow white black pink grey gray purple orange colour color morning evening tomorrow yesterday"
    " weather football joke music song play game name same fame lame came come home some dome tomb comb poem"
    " spoon moon noon soon room root boot shoot shout about above dove love live give five dive drive dried tried cried fried friend"
    " brother mother father sister cook book look took hook rook hope rope pope pipe ripe wipe wine window door floor poor pool tool fool cool"
    " roof proof loose lose close clothes cloud loud proud round sound found ground pound wound hound bound mountain fountain"
    " paint point pint print sprint faint saint plant plane plan plain play clay day say pay lay may way"
    " pray tray gray bray stray spray phone photo police please place palace plate slate skate late rate date gate hate fate mate"
    " bath path math myth moth mouth south north worth earth birth death breath health wealth money honey monkey donkey turkey"
    " key boy toy joy buy guy dry cry try fly sky spy why who whom whose how now know knew new few view"
    " person people woman women man men child children dog cats dogs fire wire tire hire her his him them they their"
    " fast rest best test west east nest pest vest guest quest twist wrist list mist fist first thirst burst worst worse"
    " since science sense fence hence pence scene seat beat neat wheat sheet street sweet swear sweat sugar salt milk silk"
    " kitchen chicken knife fork cup cap map gap lap nap tape shape escape grape drape ape knee knot not note nose rose hose"
    " does did do dig pig fig wig jig leg beg egg ego echo each beach reach teach peach speech"
    " sorry worry hurry story lorry marry carry merry cherry berry ferry"
    " send sand hand land band bend lend mend tend end and sound stand stack stuck stick sick pick kick lick thick brick trick truck track"
    " pack back sack lack hack rack snack crack black slack block lock sock rock clock shock knock luck duck"
    " human machine engine magic logic python code file delete erase program computer system instruction instructions"
    " twelve twenty open pen often oven over cover river liver silver"
    " slide glide pride bride guide inside outside beside decide"
    " color ghost most host cost lost coast toast roast boast breast"
    " bird third girl swirl world early hourly daily nearly dearly really rally"
    " chair hair fair pair stair air chain rain train brain drain grain gain main pain vain"
    " story storey parrot carrot tomato potato".split()
)


@dataclass(frozen=True)
class Reading:
    """The words of a text as the grammar has them, the words that nobody knows, and what was corrected."""

    text: str
    unknown: tuple[str, ...] = ()
    corrected: tuple[tuple[str, str], ...] = ()


def words_of(text: str) -> list[str]:
    """The words, numbers and separators of a text in lower case, contractions in full."""
    plain = unicodedata.normalize("NFKD", text.replace("’", "'").replace("‘", "'").replace("`", "'").replace("´", "'"))
    plain = "".join(c for c in plain if not unicodedata.combining(c)).lower().replace("½", " half ").replace("¼", " quarter ")
    for pattern, full in CONTRACTIONS:
        plain = re.sub(pattern, full, plain)
    plain = re.sub(r"(\d)[.,](\d)", r"\1_\2", plain)
    found = re.findall(r"\d+_\d+|\d+(?:st|nd|rd|th)\b|\d+|[^\W\d_]+|[,;:.!?&]|[^\s\w'\"()\-–—…*]", plain)
    return ["and" if word == "&" else word.replace("_", ".") for word in found]


def _normal(words: Iterable[str]) -> list[str]:
    """Words without those that have no meaning of their own, and with numbers in digits."""
    return [str(NUMBERS[word]) if word in NUMBERS else word for word in words if word not in SKIPPED]


def phrases_of(listed: str) -> tuple[str, ...]:
    """The phrases of a row of the vocabulary, as the reader writes them, longest first."""
    said = [phrase for row in listed.split("|") for phrase in (row, re.sub(r"\b(work|find|make|pick|wind) way\b", r"\1 your way", row))]
    written = {" ".join(_normal(phrase.split())) for phrase in said} - {""}
    return tuple(sorted(written, key=lambda phrase: (-len(phrase), phrase)))


@cache
def kinds_of_words() -> Mapping[str, tuple[str, ...]]:
    """Kind of word -> its phrases, longest first."""
    rows = {**COMMON, **GRID, **{f"O_{kind}": listed for kind, listed in ORDER.items()}, **PHRASES}
    return {kind: phrases_of(listed) for kind, listed in rows.items()}


@cache
def _known(kind: str) -> frozenset[str]:
    """The single words of a kind of scene ("grid" or "order")."""
    local = GRID if kind == "grid" else ORDER
    rows = [*COMMON.values(), *local.values(), *PHRASES.values()]
    words = {word for row in rows for word in re.findall(r"[a-z]+", row)}
    return frozenset(
        words | set(NUMBERS) | set(TIMES) | set(ORDINALS) | set(LENGTHS) | set(SKIPPED)
        | {"couple", "pair", "half", "quarter", "quarters", "of", "a", "toast"}
    )  # fmt: skip


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
    if word in OTHER_WORDS or not word.isalpha() or len(word) < 3:
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
        if apart <= most and (len(word) > 3 or sorted(word) == sorted(other) or (len(other) == 4 and other in frequent)):
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


FREQUENT = frozenset(
    "left right up down forward forwards back backward backwards step steps until wall toaster cube block goal machine plate"
    " around avoid away near the then and go move stop please again before after slice first never wait put tray finish turn"
    " higher lower other way direction last time good bad undo take why ask not past next nearest your you square squares twice"
    " straight once opposite same last than from with turn closest furthest bottom side sides metre meter wash milled keep once".split()
)


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
    "slice": ("slice", "bread", "toast", "slice of bread", "piece of bread", "bread slice", "slice of toast", "piece of toast"),
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


def _plurals(names: Iterable[str]) -> list[str]:
    return [form for name in names for form in (name, f"{name}s")]


def work_words(station: str) -> list[str]:
    """The verbs of the work in a station: "toast", "toasting", "toasted", "toasts" for the toaster."""
    if station in STATION_WORK:
        return list(STATION_WORK[station])
    words = station.split()
    stem = words[0] if len(words) > 1 else station.removesuffix("er") if station.endswith("er") else station
    stem = stem.rstrip("e")
    return [f"{stem}{ending}" for ending in ("ing", "ed", "es", "s", "e", "")]


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
        add("kind", tuple(parts), _plurals(form for form in dict.fromkeys((kind, *SYNONYMS.get(kind, ()))) if form != "toast"))
    for station in scene.stations:
        forms = [*STATION_WORDS.get(station, (station,))]
        words = station.split()
        if len(words) > 1:
            forms = [station, words[-1], f"{words[0]}er", f"{words[0]} station", f"{words[0]} machine", f"{words[0]}ing station"]
            forms += [f"{words[0]}ing machine"]
        elif station.endswith("er"):
            forms += [f"{station.removesuffix('er')}ing station"]
        add("station", station, forms)
    nouns = {form: parts for kind, parts in kinds.items() for form in (kind, *SYNONYMS.get(kind, ()))}
    for station in scene.stations:
        words = work_words(station)
        for noun in [word for word in words if word in nouns]:
            add("actkind", (station, tuple(nouns[noun])), (noun,))
        add("act", station, words)
    return named, tuple(means)


# ---- the whole reading ---------------------------------------------------------------------------------------------------


def read(text: str, scene: Scene, named: Named, corrects: bool = True) -> Reading:
    """The text as words of the grammar."""
    kind = "grid" if isinstance(scene, GridScene) else "order"
    known = _known(kind) | {word for words in named for word in words if word.isalpha()}
    frequent = FREQUENT | {word for words in named for word in words if len(word) > 3}
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
        if list(words[cut + 1 : cut + 2]) == ["so"] and not {"want", "would", "need", "mean", "like"} & set(words[:cut]):
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
        ] if word.isalpha() and word not in known and word not in OTHER_WORDS else []  # fmt: skip
        result += cuts[0] if len(cuts) == 1 else (word,)
    return result


_GLUED = frozenset("to the and then of in on until go left right two three".split())


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
    joined = re.sub(rf"\b(\d+) and (?:a )?half ({units_of_length})\b", lambda m: _length(float(m[1]) + 0.5, m[2]), joined)
    joined = re.sub(rf"\ba ({units_of_length}) and (?:a )?half\b", lambda m: _length(1.5, m[1]), joined)
    joined = re.sub(rf"\b(\d+) quarters? of (?:a )?({units_of_length})\b", lambda m: _length(float(m[1]) / 4, m[2]), joined)
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
