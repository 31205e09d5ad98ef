"""The journal: what is written, read again however it was cut, and how a session is folded out of it."""

import json
import os
from contextlib import suppress
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any, get_args

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lab.advice.advising import Advising
from lab.advice.advisors import AdvisorName
from lab.advice.entries import (
    FILE,
    KINDS,
    Answer,
    Closed,
    Entry,
    Praise,
    SessionEntry,
    Undone,
    entry_of,
    line_of,
    read_journal,
    undoable,
)
from lab.advice.journal import Again, Journal, Undo
from lab.advice.json_lines import differing
from lab.advice.table_level import TableLevel
from lab.errors import BadInput, WorkFailed
from lab.learning import session as learning
from lab.learning.environment import TableEnvironment
from lab.learning.praise import MOST_MOVES, MOST_VALUE, Judgement
from lab.learning.requests import AdviceRequest, AdvisorLeft, Ask, Reply
from lab.learning.session_events import AdviceGiven, Ending, EpisodeEnded, Event, MoveJudged, Verdict
from lab.learning.session_result import SessionResult
from lab.learning.settings import GateSettings, LearnerSettings
from lab.mdp import TabularMDP, grid

LEARNER = LearnerSettings(episodes=30, max_steps=20)
GATE = GateSettings(first_episode=4, window=2, omega=50)
HEAD = SessionEntry({"subtask": "board"}, "board", "0123456789abcdef", "test")


def board() -> TabularMDP:
    blocked = np.zeros((3, 4), bool)
    blocked[1, 1] = True
    return grid(blocked.shape, blocked, (0, 0), (2, 3), action_labels=("up", "down", "left", "right"))


def lesson(journal: Journal, ask: Ask, told: list[Event] | None = None) -> SessionResult:
    """A session with a person behind a journal, from its beginning each time an answer is taken back."""
    place = TableEnvironment(board())
    while True:
        events: list[Event] = []

        def tell(event: Event, events: list[Event] = events) -> None:
            journal.tell(event)
            events.append(event)

        rng = np.random.default_rng(5)
        advisor = Advising.of(("terminal",), {"terminal": ask}).gather(place, LEARNER, rng, journal=journal, tell=tell)
        try:
            result = learning.Session(place.mdp, LEARNER, GATE, advisor, rng).run(tell)
        except Again:
            journal.rewind()
            continue
        if told is not None:
            told += events
        return result


def person(request: AdviceRequest) -> int | None:
    """Somebody who answers by the state alone, now and then not at all, and goes in the end."""
    if request.episode > 20:
        raise AdvisorLeft("enough")
    return None if request.state == 2 else (request.state + request.episode) % 4


def same(one: SessionResult, other: SessionResult) -> bool:
    pairs = zip(asdict(one).values(), asdict(other).values(), strict=True)
    return all(np.array_equal(a, b) if isinstance(a, np.ndarray) else a == b for a, b in pairs)


def written(folder: Path, ask: Ask = person) -> tuple[SessionResult, list[Event]]:
    journal, told = Journal.begin(folder, HEAD), list[Event]()
    result = lesson(journal, ask, told)
    journal.close()
    return result, told


def test_every_event_and_answer_is_one_line(tmp_path: Path) -> None:
    _, told = written(tmp_path)
    read = read_journal(tmp_path, "DIR")
    assert read.session == HEAD
    assert [entry for entry in read.entries if not isinstance(entry, Answer)] == told
    answers = [entry for entry in read.entries if isinstance(entry, Answer)]
    given = [entry for entry in read.entries if isinstance(entry, AdviceGiven)]
    assert [(a.episode, a.step, a.state, a.action) for a in answers if not a.left] == [
        (g.episode, g.step, g.state, g.action) for g in given
    ]
    assert (answers[-1].left, answers[-1].why) == (True, "enough")
    assert read.cut == ""
    assert read.said() == {g.state: g.action for g in given if g.action is not None}


def test_a_journal_cut_at_any_byte_gives_the_same_session(tmp_path: Path) -> None:
    whole, told = written(tmp_path / "whole")
    raw = (tmp_path / "whole" / FILE).read_bytes()
    head = raw.index(b"\n") + 1
    rng = np.random.default_rng(1)
    for cut in [head, head + 1, len(raw) - 1, len(raw), *rng.integers(head, len(raw), 40).tolist()]:
        folder = tmp_path / f"cut {cut}"
        folder.mkdir(exist_ok=True)
        (folder / FILE).write_bytes(raw[:cut])
        read = read_journal(folder, "--resume")
        assert read.cut.encode() == raw[:cut][raw[:cut].rfind(b"\n") + 1 :]
        journal, again = Journal.resume(read), list[Event]()
        assert same(lesson(journal, person, again), whole)
        journal.close()
        assert again == told
        assert (folder / FILE).read_bytes() == raw


def test_nobody_is_asked_again_what_was_answered(tmp_path: Path) -> None:
    written(tmp_path)
    asked = list[AdviceRequest]()

    def ask(request: AdviceRequest) -> int:
        asked.append(request)
        return 0

    journal = Journal.resume(read_journal(tmp_path, "--resume"))
    lesson(journal, ask)
    journal.close()
    assert asked == []


class Fickle:
    """Says 0 at the n-th question, takes it back when asked next, and then answers like `person`."""

    def __init__(self, n: int) -> None:
        self.left, self.state, self.undone = n, "before", 0
        self.undoable = list[bool]()

    def __call__(self, request: AdviceRequest) -> int | None:
        if self.state == "said":
            self.undoable.append(request.undoable)
            if request.undoable:
                self.state = "after"
                self.undone += 1
                raise Undo
            self.state = "after"
        self.left -= 1
        if self.left == 0:
            self.state = "said"
            return 0
        return person(request)


@pytest.mark.parametrize("n", [1, 2, 3, 10])
def test_an_answer_taken_back_was_never_given(tmp_path: Path, n: int) -> None:
    plain, _ = written(tmp_path / "plain")
    fickle = Fickle(n)
    result, _ = written(tmp_path / "fickle", fickle)
    assert fickle.undoable
    assert fickle.undone == fickle.undoable[0]
    if fickle.undone:
        assert same(result, plain)
        read = read_journal(tmp_path / "fickle", "DIR")
        assert sum(isinstance(entry, Undone) for entry in read.entries) == 1
        assert read.effective() == list(read_journal(tmp_path / "plain", "DIR").entries)
        journal = Journal.resume(read)
        assert same(lesson(journal, person), plain)
        journal.close()


def test_an_answer_of_an_earlier_episode_cannot_be_taken_back() -> None:
    tries = list[tuple[int, int]]()

    def ask(request: AdviceRequest) -> int:
        if request.step == 1 and len(tries) < 50:
            assert not request.undoable
            tries.append((request.episode, request.state))
            raise Undo
        return 3

    assert lesson(Journal(), ask).requests > 0
    assert len(tries) == 50
    assert len(set(tries)) == 1  # the same question, asked again


def test_another_session_is_noticed(tmp_path: Path) -> None:
    written(tmp_path)
    entries: list[Entry] = list(read_journal(tmp_path, "DIR").entries)
    at = next(n for n, entry in enumerate(entries) if isinstance(entry, EpisodeEnded) and entry.episode == 7)
    entries[at] = EpisodeEnded(7, 3, False, 0, None, True)
    with pytest.raises(WorkFailed, match=r'^the session.s journal: it cannot be run again.*"episode": 7'):
        lesson(Journal(None, entries), person)
    with pytest.raises(WorkFailed, match=rf"^journal '{tmp_path}': it cannot be run again"):
        lesson(Journal(None, entries, found=tmp_path), person)


def test_an_edited_answer_that_is_no_action_is_refused(tmp_path: Path) -> None:
    written(tmp_path)
    read = read_journal(tmp_path, "DIR")
    entries: list[Entry] = [replace(one, action=77) if isinstance(one, Answer) else one for one in read.entries]
    with pytest.raises(BadInput, match=r"action 77: allowed 0\.\.3: it was edited"):
        lesson(Journal(None, entries, read_only=True), person)


def test_a_replay_writes_nothing_and_ends_with_the_journal(tmp_path: Path) -> None:
    result, told = written(tmp_path)
    read = read_journal(tmp_path, "DIR")
    raw = read.path.read_bytes()
    half = Journal(None, read.effective()[: len(read.entries) // 2], read_only=True)
    assert lesson(half, person).interrupted
    assert same(lesson(Journal(None, read.effective(), read_only=True), person), result)
    assert read.path.read_bytes() == raw
    assert told


def test_a_closed_session_does_not_go_on(tmp_path: Path) -> None:
    journal = Journal.begin(tmp_path, HEAD)
    lesson(journal, person)
    closed = Closed(30, 5, 5, True, "board")
    journal.closes(closed)
    journal.close()
    read = read_journal(tmp_path, "DIR")
    assert read.closed == closed
    with pytest.raises(BadInput, match="is over: look at it again with lab replay"):
        Journal.resume(read)


def test_a_folder_holds_one_session(tmp_path: Path) -> None:
    Journal.begin(tmp_path, HEAD).close()
    with pytest.raises(BadInput, match="holds a session already: go on with it"):
        Journal.begin(tmp_path, HEAD)
    (tmp_path / "file").write_text("")
    with pytest.raises(BadInput, match="cannot be written"):
        Journal.begin(tmp_path / "file" / "below", HEAD)


GOOD = line_of(HEAD)


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("", "does not begin with a session"),
        (GOOD, "does not begin with a session"),  # cut in its first line
        ("{}\n", "schema None: this version of the lab reads schema 1"),
        (GOOD.replace('"schema": 1', '"schema": 2') + "\n", "schema 2: this version of the lab reads schema 1"),
        (line_of(Undone("terminal", 3)) + "\n", "does not begin with a session"),
        (f"{GOOD}\n{GOOD}\n", "line 2: a second session"),
        (f"{GOOD}\nhello\n", "line 2: b'hello': Expecting value"),
        (f"{GOOD}\n[1]\n", "line 2: .*kind None is none of session, request"),
        (f'{GOOD}\n{{"kind": "undo"}}\n', "line 2: .*episode"),
        (f'{GOOD}\n{{"kind": "undo", "by": "x", "episode": "3"}}\n', "line 2: .*valid integer"),
        (f'{GOOD}\n{{"kind": "undo", "by": "x", "episode": 3, "more": 1}}\n', "line 2: .*nexpected"),
        (f"{GOOD}\n{'[' * 100_000}\n", "line 2"),
        (
            f"{GOOD}\n{line_of(Closed(1, 1, 1, True, 'x'))}\n{line_of(Undone('terminal', 3))}\n",
            "line 2: a second session",
        ),
    ],
)
def test_what_is_no_journal_is_refused_with_its_line(tmp_path: Path, text: str, reason: str) -> None:
    (tmp_path / FILE).write_text(text)
    with pytest.raises(BadInput, match=reason) as refused:
        read_journal(tmp_path, "--resume")
    assert "--resume" in str(refused.value)
    assert len(str(refused.value)) < 500


def test_a_journal_that_cannot_be_read(tmp_path: Path) -> None:
    with pytest.raises(BadInput, match=r"\(DIR\): cannot be read: No such file"):
        read_journal(tmp_path / "nothing", "DIR")


whole_numbers = st.integers(0, 10**9)
numbers = st.one_of(whole_numbers, st.floats(allow_nan=False, allow_infinity=False))
some_numbers = st.one_of(st.none(), st.floats(allow_nan=False, allow_infinity=False))
BY_FIELD: dict[str, Any] = {
    **dict.fromkeys(
        ("words", "learner", "gate"),
        st.dictionaries(st.text(max_size=5), st.one_of(st.none(), st.text(max_size=5), whole_numbers)),
    ),
    "said": st.lists(st.tuples(st.text(max_size=5), whole_numbers), max_size=3).map(tuple),
    "holds": st.none() | st.lists(st.dictionaries(st.text(max_size=5), whole_numbers), max_size=2).map(tuple),
    "action": st.one_of(st.none(), whole_numbers),
    "verdict": st.sampled_from(get_args(Verdict)),
    "reason": st.sampled_from(get_args(Ending)),
    **dict.fromkeys(("improvement_rate", "current_mean", "previous_mean"), some_numbers),
    **dict.fromkeys(("final_steps", "optimal_steps"), st.one_of(st.none(), numbers)),
    **dict.fromkeys(("mean_before", "trust"), st.floats(allow_nan=False, allow_infinity=False)),
    **dict.fromkeys(("guided", "reached", "left", "solved"), st.booleans()),
    **dict.fromkeys(("by", "why", "advisor", "saved_as"), st.text(max_size=9)),
    **dict.fromkeys(
        ("problem", "signature", "lab", "continues", "command"), st.text(max_size=9).filter(str.isprintable)
    ),
}


def entries() -> st.SearchStrategy[Entry]:
    def of(kind: type[Any]) -> st.SearchStrategy[Entry]:
        fields = {name: BY_FIELD.get(name, whole_numbers) for name in kind.__dataclass_fields__}
        if kind is EpisodeEnded:
            fields["steps"] = numbers  # of an order: its cost
        if kind is MoveJudged:
            fields["action"] = whole_numbers
        if kind is Praise:
            fields |= {"value": st.integers(-MOST_VALUE, MOST_VALUE), "moves": st.integers(0, MOST_MOVES)}
        return st.builds(kind, **fields)

    return st.one_of(*map(of, KINDS.values()))


@given(entries())
def test_every_entry_is_read_as_it_was_written(entry: Entry) -> None:
    line = line_of(entry)
    assert "\n" not in line
    assert entry_of(line) == entry


@given(st.binary(max_size=200))
def test_the_reader_never_fails_but_in_words(tmp_path_factory: pytest.TempPathFactory, raw: bytes) -> None:
    path = tmp_path_factory.mktemp("journal") / FILE
    path.write_bytes(GOOD.encode() + b"\n" + raw)
    with suppress(BadInput):
        read = read_journal(path, "DIR")
        assert read.whole_bytes <= len(GOOD) + 1 + len(raw)
        assert read.cut.encode()[:1] == raw[raw.rfind(b"\n") + 1 :].decode("utf-8", "replace").encode()[:1]


def test_a_recording_advises_by_state_and_only_about_its_problem(tmp_path: Path) -> None:
    head = SessionEntry(HEAD.words, "board", board().signature, "test")
    journal = Journal.begin(tmp_path, head)
    lesson(journal, person)
    journal.close()
    said = read_journal(tmp_path, "DIR").said()
    rng = np.random.default_rng(0)
    recorded = TableLevel(board(), 0.99, rng).advisor(AdvisorName.of(f"recorded:{tmp_path}"))
    assert recorded is not None
    for state in range(board().n_states):
        request = AdviceRequest(
            mdp=board(), q=[[0.0] * 4] * 12, state=state, episode=1, step=1, own=0, allowed=range(board().n_actions)
        )
        assert recorded.advise(request) == said.get(state)
    other = grid((2, 2), np.zeros((2, 2), bool), (0, 0), (1, 1))
    with pytest.raises(BadInput, match="it is advice about another problem, 'board'"):
        TableLevel(other, 0.99, rng).advisor(AdvisorName.of(f"recorded:{tmp_path}"))


def test_json_lines_hold_what_the_documentation_says(tmp_path: Path) -> None:
    written(tmp_path)
    lines = [json.loads(line) for line in (tmp_path / FILE).read_text().splitlines()]
    assert lines[0]["kind"] == "session"
    assert lines[0]["schema"] == 1
    kinds = {line["kind"] for line in lines}
    assert {"request", "answer", "advice", "episode", "ended"} <= kinds <= set(KINDS)


def test_a_person_takes_only_own_words_of_this_episode_back() -> None:
    ended = EpisodeEnded(1, 3, True, 1, None, True)
    first, mine, theirs = Answer("terminal", 1, 1, 0, 2), Answer("terminal", 2, 1, 0, 2), Answer("web", 2, 2, 4, 1)
    left = Answer("terminal", 2, 3, 5, None, left=True)
    assert undoable([first, ended], "terminal") is None
    assert undoable([first, ended, mine, theirs], "terminal") == 2
    assert undoable([first, ended, mine, theirs, left], "terminal") == 2  # who has left does not come back
    assert undoable([first, ended, mine, theirs], "web") == 3
    assert undoable([first, ended, theirs], "terminal") is None


def test_two_commands_do_not_write_one_journal(tmp_path: Path) -> None:
    journal = Journal.begin(tmp_path, HEAD)
    with pytest.raises(BadInput, match="another command is writing it"):
        Journal.resume(read_journal(tmp_path, "--resume"))
    journal.close()
    Journal.resume(read_journal(tmp_path, "--resume")).close()


def test_what_another_command_added_before_the_lock_was_taken_stays(tmp_path: Path) -> None:
    """The journal was found, another command went on with it and ended: its answers are neither cut away nor unknown."""
    Journal.begin(tmp_path, HEAD).close()
    found = read_journal(tmp_path, "--resume")
    first = Journal.resume(found)
    first.tell(AdviceGiven(1, 1, 0, 3, 0))
    first.close()
    raw = found.path.read_bytes()
    second = Journal.resume(found)
    second.close()
    assert found.path.read_bytes() == raw
    assert second.entries == [AdviceGiven(1, 1, 0, 3, 0)]
    third = Journal.resume(found)
    third.tell(AdviceGiven(1, 1, 0, 3, 0))
    third.closes(Closed(30, 5, 5, True, "board"))
    third.close()
    with pytest.raises(BadInput, match="is over: look at it again with lab replay"):
        Journal.resume(found)
    found.path.unlink()
    Journal.begin(tmp_path, replace(HEAD, problem="another")).close()
    with pytest.raises(BadInput, match="it was another session's when it was first read"):
        Journal.resume(found)


def test_what_is_no_file_is_not_waited_for(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / FILE)
    with pytest.raises(BadInput, match="cannot be read: it is no regular file"):
        read_journal(tmp_path, "DIR")


def test_two_lines_that_differ_are_told_from_there_on() -> None:
    before, now = (
        '{"kind": "moved", "step": 1, "drop_s": 17.25}',
        '{"kind": "moved", "step": 1, "drop_s": 18.0, "more": 1}',
    )
    assert differing(before, now) == (
        'in {"kind": "moved", "step": 1,... it says "drop_s": 17.25}, now comes "drop_s": 18.0, "more": 1}'
    )
    assert len(differing("[" + "1, " * 99, "{" + "2, " * 99)) < 150


@pytest.mark.parametrize("left", [b"", b'{"ki', b'{"kind": "session", "words": {"sub'])
def test_a_journal_whose_first_line_was_cut_off_is_begun_anew(tmp_path: Path, left: bytes) -> None:
    (tmp_path / "events.jsonl").write_bytes(left)
    Journal.begin(tmp_path, HEAD).close()
    assert read_journal(tmp_path, "here").session == HEAD


def test_what_is_no_journal_stays(tmp_path: Path) -> None:
    (tmp_path / "events.jsonl").write_bytes(b'{"kind": "mine"')
    with pytest.raises(BadInput, match="holds a session already"):
        Journal.begin(tmp_path, HEAD)
    assert (tmp_path / "events.jsonl").read_bytes() == b'{"kind": "mine"'


# ---- judgements -----------------------------------------------------------------------------------------------------


def judges(request: AdviceRequest) -> Reply:
    """Blames every second move, praises every third other one, and says nothing of the rest."""
    return Judgement(-2, 3) if request.step % 2 else Judgement(1) if request.step % 3 else None


def judged_lesson(journal: Journal, ask: Ask) -> tuple[SessionResult, list[Event]]:
    place, told, rng = TableEnvironment(board()), list[Event](), np.random.default_rng(5)

    def tell(event: Event) -> None:
        journal.tell(event)
        told.append(event)

    advisor = Advising.of(("praise:terminal",), {"terminal": ask}).gather(place, LEARNER, rng, journal=journal)
    return learning.Session(place.mdp, LEARNER, GATE, advisor, rng).run(tell), told


def test_judgements_are_kept_and_answer_when_the_session_is_run_again() -> None:
    journal = Journal()
    result, told = judged_lesson(journal, judges)
    given = [entry for entry in journal.entries if isinstance(entry, Praise)]
    assert {(entry.by, entry.value, entry.moves) for entry in given} == {("terminal", -2, 3), ("terminal", 1, 0)}
    assert len(given) == result.helped_steps > 10
    journal.rewind()
    again, told_again = judged_lesson(journal, lambda request: pytest.fail("the journal answers"))
    assert told_again == told
    assert (again.q == result.q).all()


def test_a_judgement_may_be_taken_back() -> None:
    given: list[Entry] = [Praise("terminal", 4, 1, 0, 1, 0), Answer("terminal", 4, 2, 0, None)]
    assert undoable(given, "terminal") == 1
    assert undoable(given[:1], "terminal") == 0
    assert undoable(given[:1], "web") is None


def test_a_judgement_where_an_action_is_wanted_was_edited() -> None:
    """Replayed with an advisor of another kind, the session differs."""
    journal = Journal()
    judged_lesson(journal, judges)
    journal.rewind()
    with pytest.raises(WorkFailed, match="cannot be run again"):
        lesson(journal, person)
