"""What commands show at their end, from their JSON documents."""

from io import StringIO
from typing import Any

import pytest
from rich.console import Console, RenderableType

from lab.view.summary import (
    grid_summary,
    lesson_summary,
    run_summary,
    sequence_summary,
    study_summary,
    table_of,
)


def shown(what: RenderableType, width: int = 100) -> list[str]:
    console = Console(file=StringIO(), width=width, color_system=None, highlight=False)
    console.print(what)
    assert isinstance(console.file, StringIO)
    return [line.rstrip() for line in console.file.getvalue().splitlines()]


def skill(
    source: str, helped_steps: int = 0, *, elsewhere: bool = False, saved: int = 0, from_task: str = "toast"
) -> dict[str, Any]:
    """A skill's row; saved: episodes, and as many helped steps; from_task: whose policy it was made of, if any."""
    fitness = {"verdict": "use"} if elsewhere else None
    return {
        "source": source,
        "from_task": from_task if source in ("reused", "adapted") else None,
        "helped_steps": helped_steps,
        "episodes": 0 if source == "reused" else 200,
        "moves": 0 if source == "reused" else 3000,
        "fitness": fitness,
        "saved_episodes": saved,
        "saved_helped_steps": saved,
    }


RUN: dict[str, Any] = {
    "task": "toast",
    "seed": 7,
    "toasts": 3,
    "parts": {"slice": 2, "cup": 1},
    "success": True,
    "delivered": 3,
    "dropped": 0,
    "failure": None,
    "faults": [],
    "receipts": None,
    "cyclic": None,
    "retries": [],
    "skills": [skill("learned", 30), skill("continued", 12), skill("reused")],
    "sequence": [1, 2, 1, 2],
    "method": "given",
    "order_learning": None,
    "replanned": [],
    "predicted_makespan_s": 100.0,
    "measured_makespan_s": 101.0,
    "optimal_makespan_s": 80.0,
    "bound_s": 80.0,
    "optimality_gap": 0.25,
    "optimum_proven": True,
    "proven_of": "every plan",
    "sim_s": 300.0,
    "skipped_s": 10.0,
    "timed_s": 30.0,
    "wall_s": 10.0,
    "files": {"gantt": "out/gantt.png", "learning_curves": "[out]/learning-curves.png"},
}


def test_a_run_says_what_was_found_and_saved() -> None:
    skills = [skill("learned", 3), skill("adapted", saved=171), skill("reused", saved=200)]
    found = shown(run_summary(RUN | {"skills": [*skills, skill("reused", elsewhere=True, saved=200)]}))
    assert found[1] == "         skills  2 reused (1 of another problem), 1 adapted, 1 learned"
    assert found[2] == "     learned in  400 episodes, 6000 moves, 3 of them advised"
    assert found[3] == "          saved  571 episodes, 571 helped steps"


def test_a_run_says_which_tasks_its_skills_come_from() -> None:
    own, butter = skill("reused"), skill("reused", from_task="two-toasters", elsewhere=True)
    skills = [own, *[skill("reused", from_task="sorting")] * 2, butter, skill("adapted", from_task="sorting")]
    found = shown(run_summary(RUN | {"skills": skills}), 120)
    reused = "4 reused (2 from sorting, 1 from two-toasters, 1 of another problem)"
    assert found[1] == f"         skills  {reused}, 1 adapted (1 from sorting)"
    assert shown(run_summary(RUN | {"skills": [own]}))[1] == "         skills  1 reused"


def test_a_run_that_went_well() -> None:
    assert shown(run_summary(RUN)) == [
        "        outcome  3 of 3 parts delivered (2 slices, 1 cup) (seed 7)",
        "         skills  1 reused, 2 learned",
        "     learned in  400 episodes, 6000 moves, 42 of them advised",
        "       sequence  1 2 1 2",
        "       found by  the given order",
        "       makespan  100.0 s predicted, 101.0 s measured (+1.00%)",
        " proven optimum  80.0 s by the planned times, gap 25.00%",
        "           time  10.0 s for 300 simulated seconds (30 x real time)",
        "          gantt  out/gantt.png",
        "learning curves  [out]/learning-curves.png",
    ]


def test_a_run_that_failed_says_which_part_where_and_why() -> None:
    why = "slice 2 at 'toaster': slice 2 is not in the slot of 'toaster' (tried 3 times)"
    failed = {"success": False, "delivered": 1, "dropped": 1, "measured_makespan_s": None, "failure": why}
    lines = shown(
        run_summary(RUN | failed | {"retries": ["try 1: a", "try 2: b"], "optimum_proven": False, "bound_s": 75.0})
    )
    assert lines[:5] == [
        "        outcome  1 of 3 parts delivered (2 slices, 1 cup) (seed 7)",
        "        dropped  1 part",
        f"        stopped  {why}",
        "        retries  try 1: a",
        "                 try 2: b",
    ]
    assert "       makespan  100.0 s predicted, ended after 280.0 s" in lines
    assert "   proven bound  75.0 s by the planned times, gap 25.00%" in lines


def test_a_gap_that_is_none_or_small_is_said_truly() -> None:
    """118.85 s beside 118.80 s: neither alike figures nor a gap of 0 %; a rounding error is no gap."""
    near = RUN | {"predicted_makespan_s": 118.84, "bound_s": 118.8, "optimality_gap": 118.84 / 118.8 - 1}
    lines = "\n".join(shown(run_summary(near)))
    assert "118.84 s predicted" in lines
    assert "118.80 s by the planned times, gap 0.03%" in lines
    rounded = RUN | {"predicted_makespan_s": 80.0 + 1e-12, "optimality_gap": -5e-12}
    assert " proven optimum  80.0 s by the planned times, gap 0.00%" in shown(run_summary(rounded))


@pytest.mark.parametrize("width", [40, 80])
def test_a_summary_fits_a_narrow_terminal(width: int) -> None:
    assert max(map(len, shown(run_summary(RUN | {"sequence": list(range(200))}), width))) <= width


LESSON: dict[str, Any] = {
    "skill": "insert at toaster",
    "episodes": 4,
    "steps_per_episode": [40, 20, 10, 10],
    "requests": 5,
    "helped_steps": 80,
    "misleads": 3,
    "rejected_at_episode": None,
    "optimal_steps": 16,
    "final_steps": 16,
    "steps_are_means": False,
    "solved": True,
    "failure": None,
    "source": "learned",
    "saved_as": "insert at toaster 1a2b",
    "session": "box/sessions/insert-1",
    "receipt": {"lines": ["advice: it asked in 5 episodes"]},
    "seed": 0,
    "files": {"learning_curve": "out/learning-curve.png"},
}


def test_a_lesson() -> None:
    assert shown(lesson_summary(LESSON)) == [
        f"insert at toaster: 4 episodes   {'█' * 10}{'▅' * 10}{'▃' * 20}",
        "learned path: 16 steps, the shortest takes 16: solved",
        "asked in 5 episodes, 80 helped steps, 3 misleads",
        "advice: it asked in 5 episodes",
        "saved as 'insert at toaster 1a2b' (seed 0)",
        "its journal: box/sessions/insert-1 (lab replay shows it again)",
        "out/learning-curve.png",
    ]


@pytest.mark.parametrize(
    ("change", "line"),
    [
        ({"requests": 0, "receipt": {"lines": ["advice: it asked nobody"]}}, "advice: it asked nobody"),
        (
            {"requests": 1, "helped_steps": 1, "misleads": 1},
            "asked in 1 episode, 1 helped step, 1 mislead",
        ),
        (
            {"final_steps": 1, "optimal_steps": 1, "episodes": 1},
            "learned path: 1 step, the shortest takes 1: solved",
        ),
        (  # Taxi: a policy that misses some starts may be quicker from the others
            {"steps_are_means": True, "final_steps": 12, "optimal_steps": 13, "solved": False},
            "learned path: 12 steps on average, where it reaches the goal, the best path takes 13: not solved, its mean "
            "return is below the best path's",
        ),
        (
            {"steps_are_means": True, "final_steps": 12, "optimal_steps": None},
            "learned path: 12 steps on average, where it reaches the goal: solved",
        ),
        (
            {"rejected_at_episode": 95, "misleads": 8},
            "asked in 5 episodes, 80 helped steps, 8 misleads: rejected its advisor in episode 95",
        ),
        (
            {"final_steps": None, "solved": False},
            "learned path: does not reach the goal, the shortest takes 16: not solved",
        ),
        (
            {"final_steps": 18, "solved": False},
            "learned path: 18 steps, the shortest takes 16: not solved, it is longer",
        ),
        (
            {"solved": False, "failure": "slice 1 slipped"},
            "learned path: 16 steps, the shortest takes 16: not solved in physics: slice 1 slipped",
        ),
    ],
)
def test_lessons_that_went_otherwise(change: dict[str, Any], line: str) -> None:
    assert line in shown(lesson_summary(LESSON | change), 200)


FOUND: dict[str, Any] = {
    "method": "srl",
    "objective": "makespan",
    "cost": 110.0,
    "luckiest_cost": None,
    "order": ["toast", "toast"],
    "seed": 3,
    "sequence": [2, 1, 2, 1],
    "optimum_proven": True,
    "proven_of": "every plan",
    "stopped_by": None,
    "bound_cost": 100.0,
    "bound_by": "A*",
    "gap": 0.1,
    "found_at_episode": 7,
    "episodes": 20,
    "best_cost": 100.0,
    "best_by": "annealing",
    "best_sequence": [1, 2, 1, 2],
    "best_moves": ["toast 1: in > hot", "toast 2: in > side", "toast 1: hot > out", "toast 2: side > out"],
    "sessions": 1,
    "success_percent": 0.0,
    "mean_best_cost": 110.0,
    "advice": None,
    "advised": None,
    "stochastic": None,
    "files": {},
}


def test_a_sequence() -> None:
    first = [
        "best order known: 100.00 s for 2 toasts (by annealing; seed 3)",
        "proven optimum 100.00 s (A*)",
        "srl alone: 110.00 s, gap 10.00%, in episode 7 of 20",
        "order of the transfers: 1 2 1 2",
    ]
    assert shown(sequence_summary(FOUND)) == first
    several = {"sessions": 4, "success_percent": 75.0, "mean_best_cost": 102.5, "files": {"plot": "[e].png"}}
    assert shown(sequence_summary(FOUND | several)) == [
        *first,
        "4 sessions: optimum found in 75 %, mean best 102.50 s",
        "[e].png",
    ]


@pytest.mark.parametrize(
    ("change", "line"),
    [
        ({"optimum_proven": False, "bound_cost": 80.0}, "proven bound 80.00 s, gap 25.00% (A*)"),
        ({"best_by": "A*"}, "best order known: 100.00 s for 2 toasts (by A*; seed 3)"),
        ({"order": ["rook", "sign", "rook"]}, "best order known: 100.00 s for 2 rooks, 1 sign (by annealing; seed 3)"),
        ({"order": ["job1", "job2", "job3", "job4"]}, "best order known: 100.00 s for 4 parts (by annealing; seed 3)"),
        (
            {"objective": "mean-tardiness"},
            "best order known: mean tardiness 100.00 s for 2 toasts (by annealing; seed 3)",
        ),
        ({"cost": 100.0}, "srl alone: 100.00 s, in episode 7 of 20"),
        ({"bound_cost": 0.0, "optimum_proven": False}, "proven bound 0.00 s (A*)"),  # no share of nothing
        (
            {"objective": "tardy-parts", "cost": 2.0, "best_cost": 1.0, "bound_cost": 1.0, "bound_by": "CP-SAT"},
            "srl alone: tardy parts 2.00, gap 100.00%, in episode 7 of 20",
        ),
        (
            {"objective": "tardy-parts", "best_cost": 1.0, "bound_cost": 1.0, "bound_by": "CP-SAT"},
            "proven optimum 1.00 (CP-SAT)",
        ),
        ({"best_sequence": [1, 4, 1, 2]}, "  toast 2: in > side"),  # 4: its second way
        ({"sessions": 2, "success_percent": None}, "2 sessions: mean best 110.00 s"),
    ],
)
def test_sequences_that_went_otherwise(change: dict[str, Any], line: str) -> None:
    assert line in shown(sequence_summary(FOUND | change))


def test_a_sequence_with_advice() -> None:
    advice = {"requests": 12, "helped_steps": 40, "misleads": 1, "rejected_at_episode": None}
    two = {"advice": [advice, advice | {"rejected_at_episode": 95}]}
    lines = shown(sequence_summary(FOUND | two | {"advised": True}))
    assert lines[2].startswith("srl with advice: 110.00 s")
    assert lines[4:] == [
        "session 1: asked in 12 episodes, 40 moves advised",
        "session 2: asked in 12 episodes, 40 moves advised; rejected its advisor in episode 95",
    ]
    unheard = shown(
        sequence_summary(FOUND | two | {"advised": False})
    )  # the best one was found before any move was advised
    assert unheard[2].startswith("srl alone: 110.00 s")
    stopped = shown(sequence_summary(FOUND | {"advice": [dict.fromkeys(advice)], "advised": None}))
    assert stopped[2].startswith("srl: 110.00 s")


def test_a_sequence_in_drawn_times() -> None:
    drawn = {
        "replications": 200,
        "robot_breaks_every_s": None,
        "robot_repair_s": None,
        "fixed": {"mean": 112.0, "ci95": [110.5, 113.5]},
        "reacting": {"mean": 109.0, "ci95": [108.0, 110.0], "policy": "planned anew at every decision"},
        "saved_by_reacting": {"mean": 3.0, "ci95": [2.25, 3.75]},
    }
    lines = shown(sequence_summary(FOUND | {"stochastic": drawn}))
    assert lines[4:] == [
        "200 drawn episodes: the list as it is 112.00 s (110.50 to 113.50)",
        "reacting 109.00 s (108.00 to 110.00): planned anew at every decision",
        "saved by reacting 3.00 s (2.25 to 3.75)",
    ]


def test_a_table_takes_what_looks_like_markup_as_it_is() -> None:
    assert shown(table_of([{"a_b": "[red]x", "c": 1}], ("a_b", "c"))) == ["a b     c", "[red]x  1"]


def test_a_grid_is_seen_from_above() -> None:
    """x (first index) to the right, y (second index) up."""
    seen = {"grid": ["S.", "#.", ".G"], "start": [0, 0], "goal": [2, 1], "obstacles": [[1, 0]], "markers": [1, 2, 3]}
    assert shown(grid_summary(seen)) == [
        "·  ·  G",
        "S  █  ·",
        "start (0, 0), goal (2, 1), 1 cell with obstacles, 3 markers",
    ]


def test_a_study_shows_the_settings_that_vary_in_the_rows_shown() -> None:
    """Thirty rows have a place, those after them an order, too."""
    measured = {"measure": "saved_percent", "ci95": None, "thesis": None, "within": None, "seed": 0}
    rows = [{"place": n, "value": 0.5 * n} | measured for n in range(30)]
    rows += [{"place": n, "order": n, "value": 1.0} | measured for n in range(2)]
    lines = shown(study_summary({"rows": rows, "summary": {"answer": "yes"}, "files": {}, "notes": ["why"]}))
    assert lines[0].split() == ["place", "measure", "value", "95", "%", "printed", "inside"]
    assert lines[3].split() == ["2", "saved_percent", "1"]
    assert lines[31:] == ["... and 2 more rows", "", "answer: yes", "", "why"]
