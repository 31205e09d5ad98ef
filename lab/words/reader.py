"""Raw text to tokens: contractions, typing errors, numbers, lengths, the names of the scene, and phrases of the vocabulary."""

import re
import unicodedata
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from lab.words.names import Named, names_of
from lab.words.scene import GridScene, Scene
from lab.words.spelling import apart, corrected
from lab.words.vocabulary import LENGTHS, NUMBERS, ORDINALS, TENS, TIMES, UNITS_AND_TEENS, known_words, phrases, skipped

CONTRACTIONS = (
    *((rf"\b{short}\b", full) for short, full in {
        "can'?t": "can not", "cannot": "can not", "won'?t": "will not", "shan'?t": "shall not", "i'?m": "i am",
        "youre": "you are", "youve": "you have", "thats": "that is", "whats": "what is", "theres": "there is",
        "let'?s": "let us", "lets": "let us", "don'?t": "do not", "doesn'?t": "does not", "didn'?t": "did not",
        "isn'?t": "is not", "wasn'?t": "was not", "aren'?t": "are not", "mustn'?t": "must not",
        "shouldn'?t": "should not", "wouldn'?t": "would not", "couldn'?t": "could not", "needn'?t": "need not",
        "haven'?t": "have not", "hasn'?t": "has not", "ain'?t": "is not", "gonna": "going to", "wanna": "want to",
        "gotta": "have to", "id(?= [a-z])": "i would", "youd": "you would", "itd": "it would", "ive": "i have",
        "itll": "it will", "youll": "you will", "ill": "i will",
        "u": "you", "strait": "straight", "thn": "then", "dn": "down", "rt": "right", "pls": "please",
        "plz": "please", "upto": "up to", "goto": "go to", "alot": "a lot", "lemme": "let me", "gimme": "give me",
        "hows": "how is", "hes": "he is", "w/o": "without", "ur": "your", "thx": "thanks", "twise": "twice",
        "tw": "two", "wy": "why", "agn": "again", "gud": "good", "nvm": "never mind", "tbh": "to be honest", "kk": "ok",
        "r": "are", "moar": "more", "stp": "stop", "upp": "up", "oposite?": "opposite", "wel": "well", "dun": "done",
        "god job": "good job",
    }.items()),
    (r"\b(away|clear|far|back) form\b", r"\1 from"),
    (r"\b(?:the|any|which|whichever|whatever) one (?=you (?:like|want|pick|choose|select|prefer|think|find)\b)", "whichever "),
    (r"\bits (?=((all|completely|fully|totally|entirely) )?(done|finished|completed?|ready|blocked|over|through)\b)", "it is "),
    *((rf"{short}\b", f" {full}") for short, full in {
        "n't": "not", "'re": "are", "'ve": "have", "'ll": "will", "'d": "would", "'m": "am", "'s": "is",
    }.items()),
    (r"\b(?<!i )(?<!i will )(?<!i would )(pick|choose|select)( any)? one\b"
     r"(?= *($|[,.;!?]|(of|for|yourself|then|please|now|number|option|move|possibility|choice)\b))",
     r"\1 any"),  # a pronoun, and no number
)  # fmt: skip
BY_LETTER = {"l": "left", "r": "right", "f": "forward", "b": "backward", "u": "up", "d": "down"}
LETTERS = r"(?:[lrfbud] ?\d+[ ,]*)+|(?:\d+ ?[lrfbud][ ,]*)+"  # "l2 u3"
ARROWS = {
    "->": "arrowright",
    "=>": "arrowright",
    "→": "arrowright",
    "←": "arrowleft",
    "↑": "arrowup",
    "↓": "arrowdown",
    "⇒": "arrowright",
    "➡": "arrowright",
    "⬅": "arrowleft",
    "⬆": "arrowup",
    "⬇": "arrowdown",
}
TAG = re.compile(
    r"(?<=[,;]) (?:do|does|did|is|are|was|were|has|have|can|could|will|would|should|must|shall)(?: not)?"
    r" (?:it|you|we|i|they)(?= [?.!,]|$)"
)  # "that was good, wasn't it?"
PUNCTUATION = {",": "COMMA", ":": "COMMA", ".": "DOT", "!": "DOT", "?": "DOT", ";": "DOT"}
NOT_MANNERS = frozenset(
    [
        "only",
        "hardly",
        "barely",
        "nearly",
        "early",
        "fly",
        "apply",
        "reply",
        "supply",
        "family",
        "jelly",
        "belly",
        "rely",
        "hourly",
        "daily",
    ]
)
TELLING = frozenset(["i", "my", "we", "our", "he", "she", "because", "since", "yesterday"])
TELLS = frozenset(
    [
        "NOT",
        "NEVER",
        "AVOID",
        "NEAR",
        "STOP",
        "IF",
        "OR",
        "CANCEL",
        "RULE",
        "BEFORE",
        "AFTER",
        "FINISH",
        "OFFLIMITS",
        "LEFT",
        "RIGHT",
        "FORWARD",
        "BACK",
        "UP",
        "DOWN",
        "UNDO",
        "ASK",
    ]
)  # they make it more than a story
RELATIVES = frozenset(["that", "which", "who", "that is", "which is", "where", "what is", "what", "who is"])
TAKEN_BACK = "rules?|bans?|restrictions?|limits?|limitations?|warnings?|prohibitions?"  # "take my rules back"
POINTING = frozenset(["that", "this", "those", "these"])
NAMES = frozenset(["NAME", "PART", "KIND", "STATION", "ACTKIND"])  # kinds of names of the scene
UNKNOWN = "UNKNOWN"  # the kind of what is of no kind


@dataclass(frozen=True)
class Token:
    """A word or phrase: its kind, and the number, length (number, cm) or name that it stands for."""

    kind: str
    value: Any = None
    text: str = ""


def read(text: str, scene: Scene, corrects: bool = True) -> list[Token]:
    """The tokens of a text without words that add no meaning; those of the kind UNKNOWN are in no vocabulary."""
    named = names_of(scene)
    section = "map" if isinstance(scene, GridScene) else "order"
    own = {word for words in named for word in words if word.isalpha()}
    known = known_words(section) | own
    words = words_of(text)
    if corrects:
        frequent = {word for word in own if len(word) > 3}
        words = [_spelled(word, known, frequent) for word in apart(words, known)]
    words = _in_plain_order(" ".join(_numbered(words))).split()
    tokens = _without_stories(_parts(words, named, section))
    return _plain(tokens)


def _in_plain_order(text: str) -> str:
    """The text with "the near" as an adjective, and with "as far left as you can" in an order of words that phrases can have."""
    text = re.sub(r"\bif ((?:\w+ ){1,2})went\b", r"if \1go", text)
    text = TAG.sub("", text)
    text = re.sub(r"\b(go|drive|walk|run|head|move|travel) where\b", r"\1 to where", text)
    text = re.sub(r"\bto where ((?:\w+ ){1,4}?)(?:is|are|stands|lies|sits)\b", r"to \1", text)
    text = re.sub(r"\bits (left|right|top|bottom|upper|lower)( hand)? edge\b", r"its \1 side", text)
    text = re.sub(r"\btoo the\b", "to the", text)
    text = re.sub(
        rf"\b(take|throw) ((?:\w+ ){{0,3}}?(?:{TAKEN_BACK})(?: (?!and |then |go )\w+){{0,4}}?) (back|away|out)\b",
        r"\1 \3 \2",
        text,
    )
    text = re.sub(r"\bbefore you(?= [,.;!?]|$)", "in front of you", text)
    text = re.sub(r"\b(is|are|was|has been|have been)( now| already| all)? clean\b", r"\1 cleaned", text)
    text = re.sub(r"\bthe (near|close|nearer|closer)\b(?! to\b)", "the nearest", text)
    text = re.sub(
        r"\bright (?=(next to|in front|beside|behind|against|up against|in between|on top|away|now|there|here)\b)",
        "",
        text,
    )
    text = re.sub(r"\b(?:the )?very (left|right|top|bottom|end|front|back)\b", r"all the way to the \1", text)
    text = re.sub(r"\bthe reverse\b(?! side)", "the opposite", text)
    able = "(?:you (?:can|are able to)|possible|it goes|it will|it can)(?: go| move)?"
    return re.sub(rf"\bas far (?!as\b)((?:to )?(?:the )?\w+) as {able}\b", r"all the way \1", text)


def _parts(words: Sequence[str], named: Named, section: str) -> list[tuple[str, list[Token]]]:
    """The parts of a sentence between commas and the like: the first word of each, and its tokens with the mark that ends it."""
    parts: list[list[str]] = [[]]
    for word in words:
        parts[-1].append(word)
        if word in PUNCTUATION:
            parts.append([])
    return [
        (part[0], _tokens([word for word in part if word not in skipped()], named, section))
        for part in parts
        if any(word not in skipped() for word in part)
    ]


def _without_stories(parts: Sequence[tuple[str, list[Token]]]) -> list[Token]:
    """The tokens without the parts in which a person only tells something, as "I burnt my toast yesterday, so ..."."""
    parts = [(first, tokens) for first, tokens in parts if not _is_exclamation(tokens)] or list(parts)
    stories = [
        (first in TELLING or tokens[-1].text == ":")
        and any(token.kind == UNKNOWN for token in tokens)
        and all(token.kind not in TELLS for token in tokens)
        for first, tokens in parts
    ]
    if all(stories):
        stories = [False] * len(parts)
    return [token for (_, tokens), is_story in zip(parts, stories, strict=True) if not is_story for token in tokens]


def _is_exclamation(tokens: Sequence[Token]) -> bool:
    """Whether a part is one unknown word, as in "blimey, two left"."""
    return [token.kind for token in tokens if token.kind != "FILLER"] in ([UNKNOWN, "COMMA"], [UNKNOWN, "DOT"])


def _plain(tokens: Sequence[Token]) -> list[Token]:
    """The tokens without fillers, and without "that" before a name; after one ("the cube that is left") it is THATIS."""
    kept: list[Token] = []
    for token, after in zip(tokens, (*tokens, None)[1:], strict=True):
        relates = token.text in RELATIVES and bool(kept) and kept[-1].kind == "NAME"
        points = token.text in POINTING and after is not None and after.kind in NAMES
        beside = (
            token.text == "by" and bool(kept) and kept[-1].kind == "NAME" and after is not None and after.kind == "NAME"
        )
        if token.kind == "SCRATCH" and after is not None and after.kind == "RULE":
            kept.append(Token("CANCEL", None, token.text))  # "cancel that rule"
        elif beside:
            kept.append(Token("NEXTTO", None, token.text))
        elif relates:
            kept.append(Token("THATIS", None, token.text))
        elif token.kind == "IS" and kept and kept[-1].kind == "THATIS":
            continue
        elif token.kind != "FILLER" and not points:
            kept.append(token)
    return kept


def _spelled(word: str, known: frozenset[str], frequent: set[str]) -> str:
    if not word[0].isalpha() or word in known:
        return word
    return corrected(word, known, frequent) or word


def _tokens(words: Sequence[str], named: Named, section: str) -> list[Token]:
    """The words as names of the scene or phrases, the longest first."""
    result, at = list[Token](), 0
    longest = max(map(len, named), default=0)
    while at < len(words):
        sizes = range(min(longest, len(words) - at), 0, -1)
        size = next((size for size in sizes if tuple(words[at : at + size]) in named), 0)
        if size and words[at] in ORDINALS and words[at + size : at + size + 1] != [] and words[at + size].isdigit():
            size = 0  # "first slice 1"
        end, kind = phrases(section).longest(words, at)
        if size and size >= end - at:
            end = at + size
            result.append(Token(*named[tuple(words[at:end])], " ".join(words[at:end])))
        elif kind:
            result.append(Token(kind, None, " ".join(words[at:end])))
        else:
            end = at + 1
            result.append(_other(words[at], section))
        at = end
    return result


def _other(word: str, section: str) -> Token:
    if word in PUNCTUATION:
        return Token(PUNCTUATION[word], None, word)
    if re.fullmatch(r"[0-9]+(\.[0-9]+)?", word):
        return Token("ONE" if word == "1" else "NUM", float(word), word)
    if (length := re.fullmatch(r"([0-9.e+-]+)cm([0-9.]+)", word)) is not None:
        return Token("LENGTH", (float(length[1]), float(length[2])), word)
    if word in ORDINALS:
        return Token("THEN" if section == "map" else "ORDINAL", float(ORDINALS[word]), word)
    if word.endswith("ly") and len(word) > 4 and word not in NOT_MANNERS:
        return Token("FILLER", None, word)
    return Token(UNKNOWN, None, word)


def words_of(text: str) -> list[str]:
    """The words, numbers and separators of a text in lower case, contractions in full."""
    plain = unicodedata.normalize("NFKD", text.replace("’", "'").replace("‘", "'").replace("`", "'").replace("´", "'"))
    plain = (
        "".join(c for c in plain if not unicodedata.combining(c))
        .lower()
        .replace("½", " half ")
        .replace("¼", " quarter ")
    )
    plain = re.sub(r"#(?=\d)", " number ", plain.replace("\ufe0f", ""))
    if re.fullmatch(LETTERS, plain.strip()):
        plain = re.sub(r"[lrfbud]", lambda match: f" {BY_LETTER[match[0]]} ", plain)
    for arrow, word in ARROWS.items():
        plain = plain.replace(arrow, f" {word} ")
    plain = re.sub(r"(?<![\w)])[-−](?=\d)", " minus ", plain)
    for pattern, full in CONTRACTIONS:
        plain = re.sub(pattern, full, plain)
    plain = re.sub(r"(\d)[.,](\d)", r"\1_\2", plain)
    found = re.findall(r"\d+_\d+|\d+(?:st|nd|rd|th)\b|\d+|[^\W\d_]+|[,;:.!?&]|[^\s\w'\"()\-–—…*]", plain)
    return ["and" if word == "&" else word.replace("_", ".") for word in found]


def _numbered(words: Sequence[str]) -> list[str]:
    """The words with numbers in digits, lengths as "20cm", and without those that mean nothing."""
    joined = " ".join(words)
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
