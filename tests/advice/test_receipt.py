"""The receipt: counted by hand in small journals, held against real sessions, and true to any journal at all."""

import json
from dataclasses import replace
from typing import Any, get_args

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lab.advice.advisors import AdvisorName, Person
from lab.advice.entries import Answer, Closed, Entry
from lab.advice.journal import Journal
from lab.advice.panel import Panel, PanelSettings, members_of
from lab.advice.receipt import OVERRULED, SILENT, UNHEARD, WIDTH, Judgements, Receipt, receipt
from lab.advice.table_level import TableLevel
from lab.learning.requests import AdviceRequest, AdvisorLeft
from lab.learning.session import Session
from lab.learning.session_events import (
    AdviceEnded,
    AdviceGiven,
    AdviceRejected,
    AdviceRemembered,
    AdviceRequested,
    AdvisorDropped,
    AdvisorReadmitted,
    AdvisorsDisagreed,
    Ending,
    EpisodeEnded,
    Event,
    MoveJudged,
    Verdict,
)
from lab.learning.settings import GateSettings, LearnerSettings
from lab.mdp import TabularMDP, grid, optimal_values

LEFT, RIGHT = 0, 1


def corridor() -> TabularMDP:
    """States 0-1-2-3, the goal is 3; a move out of it stays."""
    return grid((4,), np.zeros(4, bool), (0,), (3,), action_labels=("left", "right"))


VALUES = optimal_values(corridor(), 0.99)


def asked(episode: int) -> AdviceRequested:
    return AdviceRequested(episode, None, None, None)


def ended(episode: int, steps: int, helped: int = 0) -> EpisodeEnded:
    return EpisodeEnded(episode, steps, helped > 0, helped, None, True)


LESSON: list[Entry] = [
    ended(1, 10),
    ended(2, 8),
    asked(3),
    AdviceGiven(3, 1, 0, RIGHT, LEFT),
    AdviceGiven(3, 2, 1, LEFT, LEFT),  # back to 0, as it would have done itself
    AdviceGiven(3, 3, 0, LEFT, RIGHT),  # against the wall
    AdviceGiven(3, 4, 0, None, RIGHT),
    ended(3, 6, helped=3),
    asked(4),
    AdviceGiven(4, 1, 0, None, RIGHT),
    ended(4, 7),
    AdviceRemembered(4, 2),
    ended(5, 5),
    AdviceRemembered(5, 5),
    ended(6, 3),
]


def test_a_lesson_counted_by_hand() -> None:
    """Windows of 2: 10 and 8 steps before the guided episode, 7 and 5 after it."""
    found = receipt(LESSON, corridor(), VALUES, window=2)
    assert (found.requests, found.questions, found.taken, found.refused) == (2, 5, 3, {SILENT: 2})
    assert (found.helped_steps, found.episodes, found.guided, found.better) == (3, 6, 1, 1)
    assert found.remembered == 7
    assert (found.mean_before, found.mean_after) == (9.0, 6.0)
    assert found.change_percent == pytest.approx(-100 / 3)
    assert (found.agreed, found.into_walls, found.into_obstacles, found.sent_back) == (1, 1, 0, 1)
    assert found.against_best == 2
    assert [(one.label, one.said, one.best, one.times) for one in found.differences] == [
        ("(0,)", "left", ("right",), 1),
        ("(1,)", "left", ("right",), 1),
    ]
    assert (found.skill, found.voices, found.notices) == (None, (), ())
    assert found.lines() == [
        "advice: it asked in 2 episodes about 5 steps; 3 of them with advice",
        "  not followed: 2 (nothing was said)",
        "  3 helped steps in 1 guided episode, 1 of them better than before",
        "  7 steps more from memory, without asking",
        "  mean steps 9.0 before the first of them, 6.0 after the last (-33 %; what it",
        "    learned by itself is in it)",
        "  1 of 3 were its own choice, too",
        "  another action was better in 2 steps:",
        "    (0,): said left, best right (1 x)",
        "    (1,): said left, best right (1 x)",
        "  next time: in 1 state the advice sent it back to where it had been in that",
        "    episode",
        "  next time: 1 advised step went against a wall",
        "  next time: in 2 of 3 steps another action was better: see the list",
    ]


def test_without_values_nobody_knows_what_was_best() -> None:
    found = receipt(LESSON, corridor(), None, window=2)
    assert (found.against_best, found.differences, found.skill) == (None, (), None)
    assert found.into_walls == 1
    assert not any("better in" in line for line in found.lines())


def test_tied_actions_are_all_best() -> None:
    """A free board of 2 x 2: from the corner both ways are as short."""
    mdp = grid((2, 2), np.zeros((2, 2), bool), (0, 0), (1, 1))
    values = optimal_values(mdp, 0.99)
    down, right, up = 1, 3, 0
    given: list[Entry] = [AdviceGiven(1, n, 0, action, 0) for n, action in enumerate((down, right, up), start=1)]
    found = receipt(given, mdp, values)
    assert found.against_best == 1
    assert found.differences[0].best == ("+axis0", "+axis1")


def test_advice_into_an_obstacle() -> None:
    mdp = grid((2, 2), np.array([[False, True], [False, False]]), (0, 0), (1, 1))
    found = receipt([AdviceGiven(1, 1, 0, 3, 3)], mdp, None)
    assert (found.into_obstacles, found.into_walls) == (1, 0)
    assert "1 advised step went into an obstacle" in found.hints


def test_nothing_and_no_answer() -> None:
    empty = receipt([], corridor(), VALUES)
    assert (empty.questions, empty.refused, empty.hints) == (0, {}, ())
    silent = receipt([asked(1), AdviceGiven(1, 1, 0, None, RIGHT), ended(1, 5)], corridor(), VALUES)
    assert silent.refused == {SILENT: 1}
    assert silent.hints == ("it asked about 1 step and was never advised: an answer would show it a path at once",)
    assert (silent.mean_before, silent.change_percent) == (None, None)


def test_hints_come_from_the_numbers() -> None:
    same: list[Entry] = [AdviceGiven(1, n, 0, RIGHT, RIGHT) for n in (1, 2, 3)]
    assert receipt(same, corridor(), VALUES).hints == (
        "most of the advice, 3 of 3 steps, was what it would have done by itself: help elsewhere",
    )
    late: list[Entry] = [asked(1), ended(1, 9), asked(2), AdviceGiven(2, 1, 0, RIGHT, LEFT), ended(2, 3, 1)]
    assert receipt(late, corridor(), VALUES).hints == (
        "earlier: it had asked in 1 episode before it was helped for the first time",
    )
    silent: list[Entry] = [AdviceGiven(1, n, 0, action, LEFT) for n, action in enumerate((None, None, RIGHT))]
    assert receipt(silent, corridor(), VALUES).hints == ("2 of 3 questions had no answer: answer more of them",)


def test_only_a_person_is_spoken_to() -> None:
    """The same lesson, each answer a person's; with another advisor beside, the advice is not all theirs."""
    person: list[Entry] = []
    for entry in LESSON:
        person += [_said(entry), entry] if isinstance(entry, AdviceGiven) else [entry]
    found = receipt(person, corridor(), VALUES, window=2)
    assert found.yours
    assert found.lines()[0] == "advice: it asked in 2 episodes about 5 steps; 3 of them with your help"
    assert "1 step of yours went against a wall" in found.hints
    dispute = AdvisorsDisagreed(3, 1, 0, (("terminal", RIGHT), ("wrong", LEFT)), RIGHT)
    several = [*person[:3], dispute, *person[3:]]
    for entries in (LESSON, several):
        others = receipt(entries, corridor(), VALUES, window=2)
        assert not others.yours
        assert "you" not in " ".join([*others.lines(), *others.hints])


def _said(given: AdviceGiven) -> Answer:
    return Answer("terminal", given.episode, given.step, given.state, given.action)


def test_nothing_is_counted_of_nothing() -> None:
    """Nobody asked; asked, and never answered: no line says 0 of 0."""
    assert receipt([ended(1, 5)], corridor(), VALUES).lines() == ["advice: it asked nobody"]
    silent = receipt([asked(1), AdviceGiven(1, 1, 0, None, RIGHT), ended(1, 5)], corridor(), VALUES)
    assert not any("0 of 0" in line or "in 0 guided" in line for line in silent.lines())
    one = receipt([asked(1), AdviceGiven(1, 1, 0, RIGHT, RIGHT), ended(1, 5, 1)], corridor(), VALUES).lines()
    assert "  1 of 1 was its own choice, too" in one


def test_what_the_gate_makes_of_an_episode_counts() -> None:
    """Steps 9, then guided 9, 9, 9: the gate found the first two as good as the best, and the last one, a near start, not."""
    verdicts: tuple[Verdict, ...] = ("", "best", "best", "misled")
    entries = [replace(ended(n, 9, int(n > 1)), verdict=verdict) for n, verdict in enumerate(verdicts, start=1)]
    found = receipt(entries, corridor(), VALUES, window=1)
    assert (found.guided, found.better, found.best) == (3, 0, 2)
    assert "  3 helped steps in 3 guided episodes, 0 of them better than before, 2 as good" in found.lines()


def test_help_that_went_on_for_too_long() -> None:
    """Steps 9, then guided 8, 7, 7, 8 with windows of 1: the first two are better than the one before, the last two not."""
    steps = [(1, 9), (2, 8), (3, 7), (4, 7), (5, 8)]
    entries: list[Entry] = [
        entry
        for episode, count in steps
        for entry in ([AdviceGiven(episode, 1, 0, RIGHT, LEFT)] if episode > 1 else [])
        + [ended(episode, count, int(episode > 1))]
    ]
    found = receipt(entries, corridor(), VALUES, window=1)
    assert found.better == 2
    assert found.mean_after is None
    assert found.hints == ("shorter: 2 of the first 2 guided episodes were better than before, 0 of the last 2",)


def test_several_advisors() -> None:
    """The person is followed, is overruled, says nothing, and is asked while dropped; of `wrong` only disputes are known."""
    dispute = (("terminal", RIGHT), ("wrong", LEFT))
    entries: list[Entry] = [
        Answer("terminal", 1, 1, 0, RIGHT),
        AdvisorsDisagreed(1, 1, 0, dispute, RIGHT),
        AdviceGiven(1, 1, 0, RIGHT, LEFT),
        Answer("terminal", 1, 2, 1, RIGHT),
        AdvisorsDisagreed(1, 2, 1, dispute, LEFT),
        AdviceGiven(1, 2, 1, LEFT, LEFT),
        Answer("terminal", 1, 3, 0, None),
        AdviceGiven(1, 3, 0, LEFT, LEFT),
        AdvisorDropped(1, "terminal", 0.2, "1 of its 12 answers led nearer"),
        ended(1, 9, 3),
        Answer("terminal", 2, 1, 0, RIGHT),
        AdviceGiven(2, 1, 0, LEFT, LEFT),
        Answer("terminal", 2, 2, 0, RIGHT),
        AdviceGiven(2, 2, 0, None, LEFT),
        AdvisorReadmitted(2, "terminal", 0.8, "5 of its 5 answers led nearer"),
        ended(2, 9, 1),
    ]
    found = receipt(entries, corridor(), VALUES)
    assert found.refused == {SILENT: 1, OVERRULED: 2, UNHEARD: 2}
    person, wrong = found.voices
    assert (person.name, person.whole, person.said) == ("terminal", True, 4)
    assert (person.followed, person.overruled, person.unheard, person.against_best) == (1, 1, 2, 0)
    assert (wrong.name, wrong.whole, wrong.said) == ("wrong", False, 2)
    assert (wrong.followed, wrong.overruled, wrong.unheard, wrong.against_best) == (1, 1, 0, 2)
    assert found.notices == (
        "episode 1: terminal dropped: 1 of its 12 answers led nearer",
        "episode 2: terminal heard again: 5 of its 5 answers led nearer",
    )


def test_only_whole_records_show_a_skill() -> None:
    """What only disputes tell of an advisor would make it look worse than it is."""
    entries: list[Entry] = []
    for step in range(1, 9):
        entries += [
            Answer("terminal", 1, step, 1, RIGHT),
            AdvisorsDisagreed(1, step, 1, (("terminal", RIGHT), ("limited", LEFT)), RIGHT),
            AdviceGiven(1, step, 1, RIGHT, LEFT),
        ]
    person, simulated = receipt(entries, corridor(), VALUES).voices
    assert person.skill is not None
    assert (person.skill.tau, person.skill.answers) == (0.001, 8)
    assert simulated.skill is None


def test_how_it_ended_is_said() -> None:
    rejected: list[Entry] = [ended(1, 9, 2), AdviceRejected(1, 8, 7, 9, 8.5), ended(2, 5), ended(3, 5)]
    assert receipt(rejected, corridor(), VALUES).notices == (
        "episode 1: advice rejected (8 episodes no better than before, 7 tolerated); alone for the 2 episodes after it",
    )
    assert receipt([AdviceEnded(4, "converged")], corridor(), VALUES).notices == (
        "episode 4: no more advice: converged",
    )


def lesson(*, several: bool = False, answers: int = 60) -> tuple[Receipt, Any, list[Entry]]:
    """A person who goes the best way, and leaves after so many answers, in a real session with a journal."""
    mdp, journal = grid((5, 5), np.zeros((5, 5), bool), (0, 0), (4, 4)), Journal()
    values = optimal_values(mdp, 0.99)
    count = 0

    def ask(request: AdviceRequest) -> int | None:
        nonlocal count
        count += 1
        if count > answers:
            raise AdvisorLeft("enough")
        return int(np.argmax(values[request.state])) if count % 3 else None

    def tell(event: Event) -> None:
        journal.tell(event)

    advisor: Any = Person(lambda request: journal.answer("terminal", request, ask))
    rng = np.random.default_rng(0)
    if several:
        wrong = TableLevel(mdp, 0.99, np.random.default_rng(1)).advisor(AdvisorName.of("wrong"))
        members = members_of(("terminal", "wrong"), (advisor, wrong))
        advisor = Panel(members, mdp.n_states, PanelSettings(), draw=rng.random, tell=tell)
    learner = LearnerSettings(episodes=30, max_steps=40)
    result = Session(mdp, learner, GateSettings("always"), advisor, rng).run(tell)
    return receipt(journal.entries, mdp, values), result, journal.entries


@pytest.mark.parametrize("several", [False, True])
def test_a_real_session(several: bool) -> None:
    found, result, entries = lesson(several=several)
    assert found.helped_steps == result.helped_steps == found.taken
    assert found.requests == result.requests
    assert found.episodes == len(result.steps)
    assert found.guided == int(result.guided.sum())
    assert found.questions == found.taken + found.refused.get(SILENT, 0)
    answers = [one for one in entries if isinstance(one, Answer)]
    assert answers[-1].left
    if several:
        assert found.voices[0].name == "terminal"
        assert found.voices[0].said == sum(one.action is not None for one in answers) == 40
        assert found.voices[0].against_best == 0
    else:
        assert found.voices == ()
        assert (found.taken, found.against_best) == (40, 0)
        assert found.skill is not None
        assert found.skill.word == "expert"
        assert "no more advice: advisor left" in found.notices[-1]
    assert json.loads(json.dumps(found.to_json(), allow_nan=False)) == found.to_json()


small, maybe = st.integers(-2, 6), st.none() | st.integers(-2, 6)
numbers, names = st.floats(-1e6, 1e6), st.sampled_from(["terminal", "web", "wrong", "x" * 100, "a\x1b[31m\nb"])
ENTRIES = st.one_of(
    st.builds(AdviceRequested, small, st.none() | numbers, st.none() | numbers, st.none() | numbers),
    st.builds(Answer, names, small, small, small, maybe, st.booleans()),
    st.builds(AdviceGiven, small, small, small, maybe, small),
    st.builds(AdviceGiven, small, small, st.integers(0, 2), st.integers(0, 1), small),
    st.builds(EpisodeEnded, small, st.integers(0, 200), st.booleans(), small, st.none() | numbers, st.booleans()),
    st.builds(AdviceRejected, small, small, small, small, numbers),
    st.builds(AdviceEnded, small, st.sampled_from(get_args(Ending))),
    st.builds(AdviceRemembered, small, small),
    st.builds(MoveJudged, small, small, small, small, small, small),
    st.builds(AdvisorsDisagreed, small, small, small, st.lists(st.tuples(names, small), max_size=3).map(tuple), small),
    st.builds(AdvisorDropped, small, names, numbers, names),
    st.builds(AdvisorReadmitted, small, names, numbers, names),
    st.builds(Closed, small, maybe, maybe, st.booleans(), names),
)


@given(st.lists(ENTRIES, max_size=40), st.booleans(), st.integers(1, 4))
def test_any_journal_has_a_receipt(entries: list[Entry], known: bool, window: int) -> None:
    found = receipt(entries, corridor(), VALUES if known else None, window)
    judged = sum(isinstance(entry, MoveJudged) for entry in entries)
    assert 0 <= found.questions - found.taken - found.refused.get(SILENT, 0) <= judged
    assert found.guided <= found.episodes
    assert 0 <= found.better <= found.guided
    assert 0 <= found.agreed <= found.taken
    assert found.into_walls + found.into_obstacles <= found.taken
    assert (found.against_best is None) == (not known)
    assert sum(one.times for one in found.differences) <= (found.against_best or 0) <= found.taken
    for voice in found.voices:
        assert voice.said == voice.followed + voice.overruled + voice.unheard
        assert min(voice.followed, voice.overruled, voice.unheard) >= 0
    if found.voices:
        assert found.refused.get(OVERRULED, 0) == sum(voice.overruled for voice in found.voices)
        assert found.refused.get(UNHEARD, 0) == sum(voice.unheard for voice in found.voices)
    lines = found.lines()
    assert max(map(len, lines)) <= WIDTH
    assert all(line.isprintable() for line in lines)
    json.dumps(found.to_json(), allow_nan=False)


# ---- judgements -----------------------------------------------------------------------------------------------------


def test_judgements_by_hand() -> None:
    """Three of single moves: right praised, left praised (wrong), right blamed (wrong); one of two moves; one question open."""
    journal: list[Entry] = [
        ended(1, 10),
        asked(2),
        MoveJudged(2, 1, 0, RIGHT, 1, 1),
        MoveJudged(2, 2, 1, LEFT, 2, 1),
        MoveJudged(2, 3, 0, RIGHT, -1, 1),
        MoveJudged(2, 4, 1, RIGHT, -1, 2),
        AdviceGiven(2, 5, 2, None, RIGHT),
        ended(2, 5, 4),
    ]
    found = receipt(journal, corridor(), VALUES)
    assert found.judged == Judgements(praised=2, blamed=2, single=3, against_best=2)
    assert (found.questions, found.taken, found.helped_steps, found.refused) == (5, 0, 4, {SILENT: 1})
    assert "  judged: 2 times good, 2 times bad; 2 of 3 against what was best" in found.lines()
    assert not found.hints
    unknown = receipt(journal, corridor(), None)
    assert unknown.judged == Judgements(2, 2, 3, None)
    assert unknown.to_json()["judged"] == {"praised": 2, "blamed": 2, "single": 3, "against_best": None}


def test_a_judgement_beside_an_action_is_the_same_question() -> None:
    journal: list[Entry] = [MoveJudged(1, 2, 0, RIGHT, 1, 1), AdviceGiven(1, 2, 1, RIGHT, LEFT), ended(1, 3, 2)]
    assert receipt(journal, corridor(), VALUES).questions == 1


def test_a_receipt_without_judgements_does_not_mention_them() -> None:
    assert "judged" not in receipt(LESSON, corridor(), VALUES).to_json()
