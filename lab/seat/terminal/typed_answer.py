"""The parser of answers typed at the teaching prompt: a move, a whole path, or a command word."""

import re
from collections.abc import Sequence
from difflib import get_close_matches

from lab.learning.praise import MOST_MOVES as MOST_JUDGED
from lab.learning.praise import MOST_VALUE, Judgement
from lab.mdp import TabularMDP
from lab.seat.grid_text import ARROWS, ASCII_ARROWS, DIRECTIONS, NAMES, direction_of

Understood = int | tuple[int, ...] | str
COMMANDS = {  # typed word -> answer, explanation; after "path" the moves follow
    "": ("own", "agree with the learner: take the move it would make itself"),
    "path": (
        "path",
        "a whole path at once, letters or arrows: path {example}, or 3{letter} for {letter}{letter}{letter}",
    ),
    "why": ("why", "why it asks, with the numbers: what it knows here, how advice stands"),
    "undo": ("undo", "take back the last answer of this episode"),
    "skip": ("skip", "leave this step to the learner"),
    "auto": ("auto", "no more advice for this skill: the learner goes on alone"),
    "done": ("done", "no more advice in this whole run, whatever is learned"),
    "quit": ("quit", "or q: stop the session, as Ctrl-C does; what has been learned is kept"),
    "q": ("quit", ""),
    "?": ("help", "this list"),
    "help": ("help", ""),
}
ANSWERS = frozenset(called for called, _ in COMMANDS.values()) - {"path"}
MOST_MOVES = 1000  # of one path
_TYPED_ARROWS = {f"\x1b{bracket}{key}": arrow for bracket in "[O" for key, arrow in zip("ABDC", ARROWS, strict=True)}
_PIECE = re.compile(r"([0-9]*)\s*([^\W\d_]+|[^\s\d,;])|([0-9]+)")


_JUDGED = re.compile(rf"(\+{{1,{MOST_VALUE}}}|-{{1,{MOST_VALUE}}}|good|bad)\s*([0-9]{{0,3}})")


def judged(line: str, labels: Sequence[str] = ()) -> Judgement | None:
    """The judgement in a typed line, such as "+", "--" (clearly bad), "bad" or "-3" (of the last 3 moves); None for none.

    labels: of the moves that may be typed as well; what begins one of them is that move.
    """
    word = line.strip(" \t\r\n").lower()
    found = _JUDGED.fullmatch(word)
    if found is None or int(found[2] or 0) > MOST_JUDGED or any(label.lower().startswith(word) for label in labels):
        return None
    signs = {"good": "+", "bad": "-"}.get(found[1], found[1])
    return Judgement(len(signs) if signs[0] == "+" else -len(signs), int(found[2] or 0))


PRAISES = (
    ("+, -", "what it did last was good or bad; ++ or -- is said more clearly; -3 is about any of the last 3 moves"),
    ("good, bad", "the same in words"),
)
JUDGE_HINT = "this question is about the move that it makes: type + or -, enter for no judgement, or ?"


def understand(line: str, mdp: TabularMDP) -> Understood:
    """The action that a typed line names, the actions of a path, one of ANSWERS, or a hint of one line.

    Tried in this order: an exact label, the beginning of exactly one label, an arrow or the (beginning of the) word for a
    direction in the picture, and a path, in which each letter is the move that it means alone.
    """
    word = line.strip(" \t\r\n").lower()
    for keys, arrow in _TYPED_ARROWS.items():
        word = word.replace(keys.lower(), arrow)
    head, _, rest = word.partition(" ")
    if head == "path":
        return _path(rest, mdp, asked=True)
    if word in COMMANDS:
        return COMMANDS[word][0]
    action, begun = _move(word, mdp)
    if action is not None:
        return action
    if begun:
        return f"'{word[:20]}' could be {' or '.join(mdp.action_labels[a] for a in begun)}: type more of it"
    return _path(word, mdp) or _unknown(word, mdp)


def _move(word: str, mdp: TabularMDP) -> tuple[int | None, list[int]]:
    """The action that a word names; if it names none, None and the actions whose labels begin with it."""
    labels = [label.lower() for label in mdp.action_labels]
    if word in labels:
        return labels.index(word), []
    begun = [action for action, label in enumerate(labels) if label.startswith(word)]
    if len(begun) == 1:
        return begun[0], []
    pointing = {NAMES.get(label): action for action, label in enumerate(labels)}
    pointing |= {direction_of(mdp, action): action for action in range(mdp.n_actions)}
    for direction, name in enumerate(DIRECTIONS):
        meant = name.startswith(word) or word in (ARROWS[direction], ASCII_ARROWS[direction])
        if meant and direction in pointing:
            return pointing[direction], []
    return None, begun


def letters(mdp: TabularMDP) -> dict[str, int]:
    """The action of each letter, in the order of actions: the first letter of its label, or else of its direction."""
    firsts = [*(label[:1].lower() for label in mdp.action_labels), *(name[0] for name in DIRECTIONS)]
    known: dict[int, str] = {}
    for letter in firsts:
        action = _move(letter, mdp)[0] if letter.isalpha() else None
        if action is not None:
            known.setdefault(action, letter)
    return {known[action]: action for action in sorted(known)}


def _path(text: str, mdp: TabularMDP, asked: bool = False) -> tuple[int, ...] | str:
    """The moves of a path; a hint if it is not valid, or "" if "path" was not typed and the text does not look like a path."""
    known = letters(mdp)
    moves: list[int] = []
    for count, run, lonely in _PIECE.findall(text):
        whole = None if lonely or (asked and set(run) <= set(known)) else _move(run, mdp)[0]
        part = [whole] if whole is not None else [known.get(letter, _move(letter, mdp)[0]) for letter in run]
        actions = [action for action in part if action is not None]
        if lonely or len(actions) < len(part):
            wrong = lonely or next(letter for letter, action in zip(run, part, strict=True) if action is None)
            return _no_path(text, wrong, known, mdp) if asked or _looks_like_one(text, known) else ""
        times = int(count[:6]) if count else 1
        moves += actions[:1] * times + actions[1:]
        if len(moves) > MOST_MOVES:
            return f"'{text[:20]}' has more than {MOST_MOVES} moves: a path may have {MOST_MOVES}"
    if not moves:
        return f"path what? {_known_letters(known, mdp)}, such as path {example(mdp)}" if asked or not text else ""
    return tuple(moves)


def _looks_like_one(text: str, known: dict[str, int]) -> bool:
    """Whether more than half of an unknown word's letters are moves."""
    return 2 * sum(c in known or c in ARROWS or c.isdigit() or c.isspace() for c in text) > len(text)


def _no_path(text: str, wrong: str, known: dict[str, int], mdp: TabularMDP) -> str:
    return f"'{text[:20]}' is no path: '{wrong[:8]}' is no move; {_known_letters(known, mdp)}"


def _known_letters(known: dict[str, int], mdp: TabularMDP) -> str:
    if not known:
        return "arrows and whole words are moves here, with spaces between them"
    return "letters: " + ", ".join(f"{letter} {mdp.action_labels[action]}" for letter, action in known.items())


def example(mdp: TabularMDP) -> str:
    """An example of a path as typed."""
    known = list(letters(mdp))
    return "".join((known[-1], known[-1], known[0])) if known else f"{ARROWS[3] * 2}{ARROWS[0]}"


def _unknown(word: str, mdp: TabularMDP) -> str:
    near = get_close_matches(word, [*COMMANDS, *mdp.action_labels], n=1, cutoff=0.7)
    hint = f"did you mean '{near[0]}'? " if near else ""
    known = ", ".join([*mdp.action_labels, *(name for name in COMMANDS if name not in ("", "?", "help", "q"))])
    return f"'{word[:20]}' is no direction: {hint}type {known} or ?"


IN_WORDS = (
    "a sentence",
    "such as two steps left, then up until the wall; keep away from the cube; like last time; take that back",
)


def is_sentence(line: str) -> bool:
    """Whether a line that is no move, path or command may be a sentence: not a key's name, and not "path" with a bad path."""
    return not line.lstrip().lower().startswith(("path ", "the key ")) and any(c.isalpha() for c in line)


def explained(mdp: TabularMDP) -> list[tuple[str, str]]:
    """The possible inputs and their effects, one row each."""
    known = letters(mdp)
    move = "a word from the list of moves, or its beginning; arrow keys follow the picture"
    if known:
        move += f"; {_known_letters(known, mdp)}"
    words = explained_words(example=example(mdp), letter=next(iter(known), ARROWS[0]))
    return [("a move", move), *words, IN_WORDS]


def explained_words(**examples: str) -> list[tuple[str, str]]:
    """The command words and their effects; "path" only with an example."""
    return [
        (typed or "enter", text.format(**examples))
        for typed, (_, text) in COMMANDS.items()
        if text and (examples or typed != "path")
    ]
