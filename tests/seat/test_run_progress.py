"""How a run's progress looks: short lines at any width, each fact once, nothing that a log could not hold."""

import re
from dataclasses import replace
from io import StringIO

import numpy as np
import pytest
from rich.console import Console

from lab.learning.session import Session
from lab.learning.session_events import AdviceRejected, AdviceRequested
from lab.learning.session_result import SessionResult
from lab.learning.settings import GateSettings, LearnerSettings
from lab.mdp import TabularMDP, grid
from lab.seat.event_text import run_text
from lab.seat.run_progress import ALL_FREE, RunProgress
from lab.sequencing.cell.schedule import Move
from lab.sequencing.search import Reference, SequenceResult
from lab.teaching.events import (
    Event,
    KeptBeside,
    LessonEvent,
    MoveMade,
    MoveRetried,
    MoveTimed,
    PhaseBegan,
    RecordSkipped,
    SequenceFound,
    SequencingStands,
    SkillReady,
)
from lab.teaching.lesson_plan import Lesson
from lab.toolbox.fitness import Fitness
from lab.toolbox.policy import Origin, Policy

LONG = "transfer butter_applier to finished_plate with slice"


def console(width: int = 80, terminal: bool = True, encoding: str = "utf-8") -> Console:
    class Encoded(StringIO):
        @property
        def encoding(self) -> str:  # type: ignore[override]
            return encoding

    return Console(file=Encoded(), width=width, force_terminal=terminal, color_system=None, highlight=False)


def lines(console: Console) -> list[str]:
    assert isinstance(console.file, StringIO)
    plain = re.sub(r"\x1b\[[0-9?]*[A-Za-z]", "", console.file.getvalue())
    return [line.rstrip() for line in plain.splitlines()]


def has_bar(console: Console) -> bool:
    """While a bar is shown the cursor is hidden."""
    assert isinstance(console.file, StringIO)
    written = console.file.getvalue()
    return written.rfind("\x1b[?25l") > written.rfind("\x1b[?25h")


@pytest.fixture(scope="module")
def board() -> TabularMDP:
    return grid((3, 3), np.zeros((3, 3), bool), (0, 0), (2, 2))


def lesson(board: TabularMDP, source: str = "learned", requests: int = 0, helped_steps: int = 0) -> Lesson:
    learner, gate = LearnerSettings(episodes=30, max_steps=30), GateSettings()
    result: SessionResult = Session(board, learner, gate, None, np.random.default_rng(1)).run()
    object.__setattr__(result, "requests", requests)
    object.__setattr__(result, "helped_steps", helped_steps)
    policy = Policy.of(result, board, learner, gate, Origin("p", "transfer", "toast", "none", 0))
    return Lesson(policy, source, None if source == "reused" else result)  # type: ignore[arg-type]


def taught(board: TabularMDP, console: Console) -> list[str]:
    """What is shown of one lesson with all that a lesson can have."""
    progress = RunProgress(console)
    progress.hear(LessonEvent(LONG, AdviceRequested(33, 0.0, 40.0, 40.0)))
    progress.hear(LessonEvent(LONG, AdviceRequested(34, 0.0, 40.0, 40.0)))
    progress.hear(LessonEvent(LONG, AdviceRejected(162, 8, 7, 30, 20.0)))
    progress.hear(SkillReady(LONG, lesson(board, "learned", 67, 578)))
    return lines(console)


def test_a_lesson_at_80_columns(board: TabularMDP) -> None:
    first, second, third = taught(board, console(80))
    assert first == f"  learned   {LONG}"
    assert second.startswith("            █")
    assert second.endswith("  4/4 steps  asked 67 x from episode 33, 578 helped steps")
    assert third == "            rejected its advisor in episode 162 after 8 misleads"


def test_a_lesson_in_a_log_is_one_line(board: TabularMDP) -> None:
    (line,) = taught(board, console(80, terminal=False))
    assert line.startswith(f"  learned   {LONG} ")
    assert line.endswith("rejected its advisor in episode 162 after 8 misleads")


@pytest.mark.parametrize("width", [80, 100, 120, 140, 200])
def test_no_line_is_wider_than_the_terminal(board: TabularMDP, width: int) -> None:
    shown = taught(board, console(width))
    assert max(map(len, shown)) <= width
    words = " ".join(shown).split()
    assert words == " ".join(taught(board, console(terminal=False))).split()


def test_who_never_asked_says_so(board: TabularMDP) -> None:
    shown = console(200)
    RunProgress(shown).hear(SkillReady("butter at applier", lesson(board, "continued")))
    (line,) = lines(shown)
    assert line.startswith("  continued butter at applier ")
    assert line.endswith("never asked")


def test_a_way_that_is_not_the_shortest_is_called_so(board: TabularMDP) -> None:
    shown = console(200)
    known = lesson(board)
    RunProgress(shown).hear(
        SkillReady("insert", replace(known, policy=replace(known.policy, final_steps=6, solved=False)))
    )
    RunProgress(shown).hear(SkillReady("insert", known))
    longer, shortest = lines(shown)
    assert "  6/4 steps  not the shortest path  never asked" in longer
    assert "not the shortest" not in shortest


def test_reused_skills_come_together_when_the_phase_is_over(board: TabularMDP) -> None:
    shown = console(80)
    with RunProgress(shown) as progress:
        progress.hear(PhaseBegan("learn", 2))
        for name in ("grasp at plate", "grasp at toaster"):
            progress.hear(SkillReady(name, lesson(board, "reused")))
        progress.hear(PhaseBegan("sequence", 1))
    assert [line for line in lines(shown) if "reused" in line] == ["  reused    grasp at plate, grasp at toaster"]


def test_many_reused_skills_are_counted(board: TabularMDP) -> None:
    shown = console(80, terminal=False)
    with RunProgress(shown) as progress:
        for n in range(20):
            progress.hear(SkillReady(f"skill {n}", lesson(board, "reused")))
    assert lines(shown) == ["  reused    20 skills: 20 x transfer"]


def test_a_skill_of_another_problem_says_why_and_what_it_saved(board: TabularMDP) -> None:
    shown = console(200, terminal=False)
    fitness = Fitness("adapt", "its path meets what is in the way at (1, 1)")
    adapted = replace(lesson(board, "adapted"), reason=f"'p 1': {fitness.reason}", fitness=fitness, saved=(171, 80))
    used = replace(lesson(board, "reused"), reason="'p 2': its path is free", fitness=fitness, saved=(200, 1))
    with RunProgress(shown) as progress:
        progress.hear(SkillReady("insert at toaster", adapted))
        progress.hear(SkillReady("grasp at plate", replace(lesson(board, "reused"), saved=(600, 0))))
        progress.hear(SkillReady("grasp at toaster", used))
    first, same, other, saved = lines(shown)
    assert first.endswith(f"never asked  from 'p 1': {fitness.reason}  saved 171 episodes, 80 helped steps")
    assert same == "  reused    grasp at plate"
    assert other == f"  reused    grasp at toaster (of another problem: {ALL_FREE})"
    assert saved == "            saved 800 episodes, 1 helped step"
    refused = replace(lesson(board), reason="'p 3': the goal is not where it was", fitness=fitness)
    assert run_text(SkillReady("insert", refused)).endswith("refused 'p 3': the goal is not where it was")
    assert run_text(SkillReady("insert", used)).endswith(
        "by 'p 2': its path is free, saved 200 episodes, 1 helped step"
    )


def test_the_rest_of_a_run() -> None:
    shown = console(80, terminal=False)
    with RunProgress(shown) as progress:
        progress.hear(PhaseBegan("measure", 1))
        progress.hear(MoveTimed("plate > toaster, loaded", 15.131))
        progress.hear(PhaseBegan("sequence", 1))
        known = Reference(100.0, True, "A*")
        progress.hear(SequenceFound(SequenceResult((1, 2, 1), 110.0, (120.0, 110.0)), known, method="ga"))
        progress.hear(SequenceFound(SequenceResult((1, 1, 2), 110.0, (110.0,)), known, method="given"))
        progress.hear(PhaseBegan("carry out", 2))
        progress.hear(MoveMade(Move(1, "plate", "plate", "toaster", 0.0, 0.0, 0.0, 17.14), "slice 1"))
        progress.hear(MoveMade(Move(2, "toaster", "toaster", "oven [hot]", 20.0, 21.0, 81.0, 84.4), "cup 2"))
        progress.hear(MoveRetried("cup 2 at 'oven': it [slipped]"))
        progress.hear(RecordSkipped("policy file x.safetensors: cut [off]"))
        progress.hear(KeptBeside("grasp", 2, "version 1 does better"))
        progress.hear(PhaseBegan("another", 1))
    assert lines(shown) == [
        "Time every move in simulation",
        "  plate > toaster, loaded                               15.13 s",
        "Find the order of the transfers",
        "  parts 1 2 1: 110.0 s found by ga in episode 2 of 2, proven optimum 100.0 s, gap 10.0%",
        "  parts 1 1 2: 110.0 s, the given order, proven optimum 100.0 s, gap 10.0%",
        "Carry the order out in physics",
        "     17.1 s  slice 1: plate to toaster",
        "     84.4 s  cup 2: toaster to oven [hot], waited 60.0 s",
        "  failed, trying again: cup 2 at 'oven': it [slipped]",
        "  skipped: policy file x.safetensors: cut [off]",
        "  'grasp', version 2 is kept, but not put in use: version 1 does better",
        "another",
    ]


def test_a_long_order_is_cut_and_what_is_not_proven_is_not_called_so() -> None:
    shown = console(80)
    order = tuple(range(1, 51)) * 4
    RunProgress(shown).hear(SequenceFound(SequenceResult(order, 300.0, (300.0,)), Reference(150.0, False, "A*")))
    first, second = lines(shown)
    assert first.endswith(" 23 24 and 176 more:")
    assert second == "            300.0 s found in episode 1 of 1, proven bound 150.0 s, gap 100.0%"


def test_figures_and_gap_agree() -> None:
    shown = console(120)
    RunProgress(shown).hear(SequenceFound(SequenceResult((1,), 118.86, (118.86,)), Reference(118.84, True, "A*")))
    assert lines(shown) == ["  parts 1: 118.86 s found in episode 1 of 1, proven optimum 118.84 s, gap 0.02%"]


def test_a_bound_of_nothing_has_no_gap() -> None:
    shown = console(120)
    for cost in (0.0, 5.0):
        RunProgress(shown).hear(SequenceFound(SequenceResult((1,), cost, (cost,)), Reference(0.0, True, "CP-SAT")))
    first, second = lines(shown)
    assert first == "  parts 1: 0.0 s found in episode 1 of 1, proven optimum 0.0 s, gap 0.0%"
    assert second == "  parts 1: 5.0 s found in episode 1 of 1, proven optimum 0.0 s"


def test_a_prompt_gets_the_terminal_for_itself() -> None:
    shown = console()
    progress = RunProgress(shown)
    with progress.paused():
        shown.print("before it runs")
    assert lines(shown) == ["before it runs"]
    with progress:
        progress.hear(PhaseBegan("learn", 3))
        with progress.paused():
            assert not has_bar(shown)
        assert has_bar(shown)
        with pytest.raises(KeyboardInterrupt), progress.paused():
            raise KeyboardInterrupt
        assert has_bar(shown)
    assert not has_bar(shown)


def test_a_log_has_no_bar_and_no_control_codes() -> None:
    shown = console(terminal=False)
    with RunProgress(shown) as progress:
        progress.hear(PhaseBegan("learn", 3))
        with progress.paused():
            pass
    assert isinstance(shown.file, StringIO)
    assert shown.file.getvalue() == "Find or learn the skills\n"


def test_a_plain_console_gets_a_plain_curve(board: TabularMDP) -> None:
    shown = console(200, encoding="ascii")
    RunProgress(shown).hear(SkillReady("grasp at plate", lesson(board)))
    (line,) = lines(shown)
    assert line.isascii()
    assert "#" in line


# ---- what a search stands at ---------------------------------------------------------------------------------------


STANDS = [SequencingStands(cost, "annealing", Reference(80.0, False, "CP-SAT")) for cost in (100.0, 90.0)]
SAYS = [
    "best so far 100.0 s (annealing), bound 80.0 s, gap 25.0%",
    "best so far 90.0 s (annealing), bound 80.0 s, gap 12.5%",
]


def told_of(shown: Console, *more: Event) -> list[str]:
    with RunProgress(shown) as progress:
        for event in (PhaseBegan("sequence", 1), *STANDS, *more):
            progress.hear(event)
    return lines(shown)


def test_on_a_terminal_only_the_last_stays() -> None:
    kept = told_of(shown := console(100))
    assert [line for line in kept if line.startswith("  best")] == [f"  {SAYS[1]}"]
    assert not has_bar(shown)


def test_an_order_that_is_told_takes_its_place() -> None:
    order = SequenceFound(SequenceResult((1,), 90.0, (90.0,)), STANDS[1].reference, 1, "anneal")
    assert not [line for line in told_of(console(100), order) if line.startswith("  best")]


def test_in_a_log_each_is_a_line() -> None:
    assert told_of(console(terminal=False))[1:] == [f"  {text}" for text in SAYS]
