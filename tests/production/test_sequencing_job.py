"""The order of the transfers: what `lab sequence` answers for a cell and for a task, and what it refuses."""

from collections.abc import Callable
from dataclasses import replace
from math import nan
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest

from lab.advice.advisors import AdvisorName
from lab.production.order import reference
from lab.production.sequencing_job import (
    SequencingOptions,
    sequence_cell,
    sequence_named,
)
from lab.sequencing import SEQUENCERS, find_sequence
from lab.sequencing.cell.chance import NO_CHANCE, Chance
from lab.sequencing.cell.objectives import OBJECTIVES
from lab.sequencing.cell.schedule import rows_of
from lab.sequencing.methods.rules import RULES
from lab.sequencing.search import Reference
from lab.sequencing.simulate.follow import simulate
from lab.tasks.sequencing import search_for
from lab.tasks.task import Order
from lab.tasks.task_file import load, load_cell
from lab.teaching.events import Event, PhaseBegan, SequenceFound
from lab.teaching.teacher import Teacher
from lab.vision import read_picture

Lab = Callable[..., Any]  # the fixture of tests/conftest.py; it returns a Ran
CONTRACT = {  # what CLI.md promises
    *("method", "makespan_s", "sequence", "episode_makespans_s", "optimal_s", "bound_s", "gap"),
    *("success_percent", "final_success_percent", "mean_best_s"),
}
FIELDS = (
    *("task", "toasts", "order", "seed", "method", "objective", "episodes", "sessions", "makespan_s", "cost"),
    *("found_at_episode", "luckiest_cost"),
    *(
        "sequence",
        "moves",
        "episode_costs",
        "episode_makespans_s",
        "optimal_s",
        "optimal_cost",
        "optimum_proven",
        "proven_of",
    ),
    *("bound_s", "bound_cost", "bound_by", "gap", "success_percent", "final_success_percent", "mean_best_s"),
    *("mean_best_cost", "best_s", "best_cost", "best_by", "best_sequence", "best_moves", "schedule", "srl_s", "proven"),
    *("robots", "advisor", "advice", "advised", "stochastic", "files", "stopped_by", "interrupted"),
)
LEARNERS = ("srl", "srl-time", "srl-improved", "srl-linear", "mc")
AT_ONCE = {"fifo", "exact", "cp-sat", "portfolio", "carried", *RULES}
UNDUE = sorted(set(SEQUENCERS) - {"earliest-due"})  # those that need no due times


def asked(lab: Lab, words: str, **more: Any) -> dict[str, Any]:
    """The document of a command that went well."""
    ran = lab("sequence", *words.split(), "--json", **more)
    assert ran.code == 0, ran.err
    document: dict[str, Any] = ran.json
    return document


def listed(folder: Path) -> list[str]:
    return sorted(str(path.relative_to(folder)) for path in folder.rglob("*"))


# ---- the document -------------------------------------------------------------------------------------------------


def test_one_document_and_nothing_else_on_stdout(lab: Lab, folder: Path) -> None:
    before = listed(folder)
    ran = lab("sequence", "oven.toml", "--method", "fifo", "--json")
    assert (ran.code, ran.out.count("\n")) == (0, 1)
    assert tuple(ran.json) == FIELDS
    assert set(FIELDS) >= CONTRACT
    first, *_, last = ran.err.splitlines()  # on a busy machine a line of progress stands between
    assert first == "Find the order of the transfers"
    assert all(fact in last for fact in ("parts 1 1 2 2: 29.0 s", "fifo", "episode 1 of 1", "proven optimum 29.0 s"))
    assert listed(folder) == before


def test_a_cell_by_hand(lab: Lab) -> None:
    oven = load_cell("oven.toml").cell()
    assert asked(lab, "oven.toml --method fifo --seed 5") == {
        "task": "oven",
        "toasts": 2,
        "order": ["toast", "toast"],
        "seed": 5,
        "method": "fifo",
        "objective": "makespan",
        "episodes": 1,
        "sessions": 1,
        "makespan_s": 29.0,
        "cost": 29.0,
        "found_at_episode": 1,
        "luckiest_cost": None,
        "sequence": [1, 1, 2, 2],
        "moves": ["toast 1: in > hot", "toast 1: hot > out", "toast 2: in > hot", "toast 2: hot > out"],
        "episode_costs": [29.0],
        "episode_makespans_s": [29.0],
        "optimal_s": 29.0,
        "optimal_cost": 29.0,
        "optimum_proven": True,
        "proven_of": "every plan",
        "bound_s": 29.0,
        "bound_cost": 29.0,
        "bound_by": "A*",
        "gap": 0.0,
        "success_percent": 100.0,
        "final_success_percent": None,
        "mean_best_s": 29.0,
        "mean_best_cost": 29.0,
        "best_s": 29.0,
        "best_cost": 29.0,
        "best_by": "fifo",
        "best_sequence": [1, 1, 2, 2],
        "best_moves": ["toast 1: in > hot", "toast 1: hot > out", "toast 2: in > hot", "toast 2: hot > out"],
        "schedule": rows_of(simulate(oven, (1, 1, 2, 2)), oven, "planned"),
        "srl_s": None,
        "proven": True,
        "robots": 1,
        "advisor": "none",
        "advice": None,
        "advised": None,
        "stochastic": None,
        "files": {},
        "stopped_by": None,
        "interrupted": False,
    }


@pytest.mark.parametrize("method", UNDUE)
def test_every_method_has_the_same_document(lab: Lab, method: str) -> None:
    document = asked(lab, f"oven.toml --method {method} --episodes 12 --sessions 2")
    assert tuple(document) == (*FIELDS, *(("policy", "policy_kept") if method == "srl-linear" else ()))
    assert (document["method"], document["sessions"]) == (method, 2)
    assert (document["makespan_s"], document["gap"], document["success_percent"]) == (29.0, 0.0, 100.0)
    assert sorted(document["sequence"]) == [1, 1, 2, 2]
    assert document["episode_makespans_s"] == [29.0] * (1 if method in AT_ONCE else 12)
    assert document["final_success_percent"] == (100.0 if method in LEARNERS else None)


@pytest.mark.parametrize(
    ("words", "makespan_s"),
    [
        ("--case I --toasts 3", 513),
        ("--case I --toasts 4", 663),
        ("--case II --toasts 3", 700),
        ("--case II --toasts 4", 900),
        ("--case III --toasts 3", 995),
        ("--case III --toasts 4", 1290),
    ],
)
def test_the_optima_that_the_thesis_prints(lab: Lab, words: str, makespan_s: int) -> None:
    document = asked(lab, f"toast {words} --method exact")
    assert (document["makespan_s"], document["optimal_s"], document["bound_s"]) == (makespan_s,) * 3
    assert (document["gap"], document["success_percent"], document["optimum_proven"]) == (0.0, 100.0, True)
    assert simulate(load_cell(document["task"]).cell(document["toasts"]), document["sequence"]).makespan_s == makespan_s


@pytest.mark.parametrize("method", ["random", "srl"])
def test_several_sessions_are_summed_up(method: str) -> None:
    """Each session has chance of its own; the document is of the best one, and counts how many got there."""
    file = load_cell("toast-case-1")
    cell = file.cell(3)
    document, found = sequence_cell(cell, file.sequencing, SequencingOptions(method, 40, sessions=8, seed=3), NO_CHANCE)
    search = search_for(file.sequencing, episodes=40)
    alone = [find_sequence(cell, method, search, 3, session) for session in range(8)]
    assert [result.episode_costs for result in found] == [result.episode_costs for result in alone]
    costs = [result.cost for result in alone]
    best = costs.index(min(costs))
    assert document["cost"] == document["makespan_s"] == costs[best]
    assert document["sequence"] == list(alone[best].sequence)
    assert document["mean_best_s"] == document["mean_best_cost"] == pytest.approx(sum(costs) / 8)
    assert document["episode_makespans_s"] == document["episode_costs"] == list(alone[best].episode_costs)
    assert best != 0  # so that the first session is not the best one
    assert document["gap"] == pytest.approx(costs[best] / 513 - 1)
    assert document["success_percent"] == 12.5 * costs.count(513.0)
    finals = [getattr(result, "final_cost", nan) for result in alone]
    assert document["final_success_percent"] == (12.5 * finals.count(513.0) if method == "srl" else None)
    assert len(set(costs)) > 1


def test_of_the_portfolio_it_is_told_what_in_it_found_the_order(lab: Lab) -> None:
    document = asked(lab, "oven.toml --method portfolio")
    assert (document["method"], document["best_by"], document["bound_by"]) == ("portfolio", "A*", "A*")


def test_a_gap_is_told(lab: Lab) -> None:
    document = asked(lab, "toast-case-1 --method fifo --sessions 3")
    assert (document["makespan_s"], document["optimal_s"]) == (544.0, 513.0)
    assert (document["gap"], document["success_percent"]) == (pytest.approx(31 / 513), 0.0)
    assert document["mean_best_s"] == 544.0


def test_the_same_seed_gives_the_same_document(lab: Lab) -> None:
    words = "fms --method random --episodes 6 --sessions 2"
    assert asked(lab, f"{words} --seed 3") == asked(lab, f"{words} --seed 3")
    assert asked(lab, f"{words} --seed 3")["episode_costs"] != asked(lab, f"{words} --seed 4")["episode_costs"]


def test_what_a_person_is_shown(lab: Lab) -> None:
    ran = lab("sequence", "toast", "--case", "I", "--method", "fifo", "--sessions", "2")
    assert ran.code == 0
    assert ran.out.splitlines() == [
        "best order known: 513.00 s for 3 toasts (by A*; seed 0)",
        "proven optimum 513.00 s (A*)",
        "fifo alone: 544.00 s, gap 6.04%, in episode 1 of 1",
        "order of the transfers: 1 2 1 2 1 2 3 2 3 3",
        "2 sessions: optimum found in 0 %, mean best 544.00 s",
    ]


# ---- which order of parts -----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("words", "task", "order"),
    [
        ("oven.toml", "oven", ["toast"] * 2),
        ("oven.toml --toasts 3", "oven", ["toast"] * 3),
        ("oven.toml --case TTT", "oven", ["toast"] * 3),
        ("toast --case 2", "toast-case-2", ["toast"] * 3),
        ("toast --case iii --toasts 1", "toast-case-3", ["toast"]),
        ("toast-case-3 --toasts 2", "toast-case-3", ["toast"] * 2),
        ("fms", "fms", ["rook", "sign", "rook"]),
        ("fms --case sR", "fms", ["sign", "rook"]),
        ("fms --case sign,rook", "fms", ["sign", "rook"]),
        ("fms --case rook", "fms", ["rook"]),
    ],
)
def test_cases(lab: Lab, words: str, task: str, order: list[str]) -> None:
    document = asked(lab, f"{words} --method fifo")
    assert (document["task"], document["order"], document["toasts"]) == (task, order, len(order))


def test_moves_in_words(lab: Lab) -> None:
    """One rook: to the lathe's table, lifted off its pallet, which follows around the lathe, and out."""
    assert asked(lab, "fms --case R --method exact")["moves"] == [
        "rook 1: incoming > lathe-1-in",
        "rook 1: lathe-1-in > lathe-1",
        "rook 1's pallet: lathe-1-in > lathe-1-out",
        "rook 1: lathe-1 > lathe-1-out",
        "rook 1: lathe-1-out > outgoing",
    ]


def test_moves_with_waits_in_words(lab: Lab) -> None:
    """Without the waits on purpose that it needs, the order would end at a carrier that was left too long."""
    document = asked(lab, "hoist-pu -n 3 --method exact")
    assert (document["best_s"], document["proven_of"], document["optimum_proven"]) == (2023.0, "every plan", True)
    assert len(document["moves"]) == len(document["best_moves"]) == 3 * 13


# ---- other objectives ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("objective", "cost"),
    [
        ("robot-idle", 20.0),  # it waits 10 s at the oven, twice
        ("machine-idle", 9.0),  # 29 s, of which it works 20 s
        ("mean-tardiness", 4.5),  # 0 s and 9 s
        ("tardy-parts", 1.0),
    ],
)
@pytest.mark.parametrize("method", ["srl-time", "exact", "fifo"])
def test_objectives_by_hand(lab: Lab, objective: str, cost: float, method: str) -> None:
    words = f"late.toml --objective {objective} --method {method} --episodes 30"
    document = asked(
        lab, words + (" --seconds 20" if method == "fifo" else "")
    )  # a rule waits for a proof if it is asked to
    assert (document["objective"], document["cost"], document["optimal_cost"]) == (objective, cost, cost)
    assert (document["bound_cost"], document["bound_by"], document["optimum_proven"]) == (cost, "CP-SAT", True)
    assert (document["gap"], document["success_percent"], document["mean_best_cost"]) == (0.0, 100.0, cost)
    assert document["makespan_s"] == 29.0  # of that sequence
    assert min(document["episode_costs"]) == cost
    names = ("episode_makespans_s", "optimal_s", "bound_s", "mean_best_s")
    assert [document[name] for name in names] == [None] * 4  # these are about makespans


def test_the_objective_is_told_in_words(lab: Lab) -> None:
    ran = lab("sequence", "late.toml", "--objective", "mean-tardiness", "--method", "earliest-due")
    assert ran.out.splitlines()[0] == "best order known: mean tardiness 4.50 s for 2 toasts (by earliest-due; seed 0)"
    ran = lab("sequence", "late.toml", "--objective", "tardy-parts", "--method", "earliest-due")
    assert ran.out.splitlines()[0] == "best order known: tardy parts 1.00 for 2 toasts (by earliest-due; seed 0)"


def test_what_cannot_be_beaten_comes_from_whom_it_can() -> None:
    cell = load_cell("late.toml").cell()
    assert reference(cell, "makespan") == Reference(29.0, True, "A*", sequence=(1, 1, 2, 2), found_by="A*")
    for objective in set(OBJECTIVES) - {"makespan"}:
        assert reference(cell, objective).method == "CP-SAT"


def test_an_optimum_that_is_not_proven_is_a_bound(monkeypatch: pytest.MonkeyPatch) -> None:
    cell = load_cell("oven.toml").cell()
    monkeypatch.setattr("lab.production.any_time.look_first", lambda shared: shared.tell("A*", bound=20.0))
    document, _ = sequence_cell(cell, load_cell("oven.toml").sequencing, SequencingOptions("fifo"), NO_CHANCE)
    assert (document["optimal_s"], document["optimal_cost"], document["optimum_proven"]) == (None, None, False)
    assert (document["bound_s"], document["gap"]) == (20.0, pytest.approx(0.45))
    assert (document["success_percent"], document["final_success_percent"]) == (None, None)


# ---- advice -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("gate", ["always", "never", "ccrl"])
def test_advice(lab: Lab, gate: str) -> None:
    """An expert who is always asked leads along the optimum from the first episode; ccrl asks from episode 30 on."""
    words = f"toast --case I --toasts 3 --method srl --advisor expert --gate {gate} --episodes 40 --sessions 2"
    document = asked(lab, words)
    assert tuple(document) == FIELDS
    assert (document["advisor"], len(document["advice"])) == ("expert", 2)
    assert document["advised"] == (gate != "never")
    names = {"requests", "helped_steps", "misleads", "rejected_at_episode"}
    assert all(session.keys() == names for session in document["advice"])
    requests = [session["requests"] for session in document["advice"]]
    assert all(bool(session["helped_steps"]) == (gate != "never") for session in document["advice"])
    if gate == "always":
        assert requests == [40, 40]
        assert document["episode_makespans_s"] == [513.0] * 40
    else:
        assert all(0 < number <= 11 for number in requests) if gate == "ccrl" else requests == [0, 0]


def test_nobody_is_asked_unless_it_is_wanted(lab: Lab) -> None:
    words = "toast-case-1 --method srl --episodes 40"
    alone, never = asked(lab, words), asked(lab, f"{words} --advisor wrong --gate never")
    assert alone.pop("advice") is None
    assert never.pop("advice") == [{"requests": 0, "helped_steps": 0, "misleads": 0, "rejected_at_episode": None}]
    assert (alone.pop("advisor"), never.pop("advisor")) == ("none", "wrong")
    assert (alone.pop("advised"), never.pop("advised")) == (None, False)
    assert alone == never


def test_an_advisor_has_chance_of_its_own_in_every_session() -> None:
    """Every decision is a novice's, so what differs between the sessions is what the novice says."""
    file = load_cell("toast-case-1")
    wanted = SequencingOptions("srl", 5, sessions=2, advisor=AdvisorName.of("novice"), gate="always")
    _, (one, other) = sequence_cell(file.cell(3), file.sequencing, wanted, NO_CHANCE)
    assert one.episode_costs != other.episode_costs


def test_a_person_is_asked_on_the_terminal(lab: Lab) -> None:
    """Toast 2 first, then the learner goes on alone: it asked in one episode, and one move was advised."""
    words = "oven.toml --method srl --advisor terminal --gate always --episodes 2"
    ran = lab("sequence", *words.split(), "--json", stdin="2\nauto\n")
    assert ran.code == 0, ran.err
    assert ran.json["advice"] == [{"requests": 2, "helped_steps": 1, "misleads": 0, "rejected_at_episode": None}]
    assert "Episode 1: the learner asks for advice about 'The order of the transfers'." in ran.err


# ---- pictures -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("form", ["png", "svg"])
def test_pictures(lab: Lab, folder: Path, form: str) -> None:
    before = listed(folder)
    words = f"oven.toml --method random --episodes 8 --sessions 2 --plot p.{form} --gantt g.{form}"
    ran = lab("sequence", *words.split())
    assert ran.code == 0, ran.err
    assert ran.out.splitlines()[-2:] == [f"p.{form}", f"g.{form}"]
    assert sorted(set(listed(folder)) - set(before)) == [f"g.{form}", f"p.{form}"]
    if form == "png":
        assert all(min(read_picture(folder / name).shape[:2]) > 150 for name in ("p.png", "g.png"))
        return
    plot, chart = (" ".join(ElementTree.parse(folder / name).getroot().itertext()) for name in ("p.svg", "g.svg"))
    assert "makespan [s]" in plot
    assert all(word in chart for word in ("toast 1", "toast 2", "hot", "robot"))


def test_pictures_are_in_the_document(lab: Lab) -> None:
    assert asked(lab, "oven.toml --method fifo --gantt g.svg")["files"] == {"gantt": "g.svg"}
    words = "late.toml --method fifo --objective tardy-parts --plot p.svg --gantt g.svg"
    assert asked(lab, words)["files"] == {"plot": "p.svg", "gantt": "g.svg"}
    assert "tardy-parts" in Path("p.svg").read_text(encoding="utf-8")


def test_a_deadlock_is_a_mark_in_the_plot(lab: Lab) -> None:
    """And no cost: it would be the highest of all."""
    words = "crossing.toml --method random --episodes 8 --plot p.svg"
    ran = lab("sequence", *words.split())
    assert ran.code == 0, ran.err
    assert " of 8 episodes)" in Path("p.svg").read_text(encoding="utf-8")


# ---- a task: measured in simulation, then sequenced -----------------------------------------------------------------


@pytest.mark.parametrize("method", [None, "srl", "srl-time", "exact", "fifo", "random"])
def test_a_task(lab: Lab, measured: list[tuple[str, Order, int]], method: str | None) -> None:
    words = "toast --toasts 2 --episodes 20 --sessions 3 --seed 9 --plot p.png --gantt g.svg"
    document = asked(lab, words + (f" --method {method}" if method else ""))
    assert measured == [("toast", ("slice", "slice"), 9)]
    assert tuple(document) == FIELDS
    assert document["method"] == (method or load("toast").sequencing.method)
    assert (document["task"], document["order"], document["seed"]) == ("toast", ["slice", "slice"], 9)
    assert (document["makespan_s"], document["optimal_s"], document["mean_best_s"]) == (29.0, 29.0, 29.0)
    assert (document["gap"], document["success_percent"]) == (0.0, 100.0)
    assert document["final_success_percent"] == (100.0 if document["method"] in LEARNERS else None)
    assert sorted(document["sequence"]) == [1, 1, 2, 2]
    assert document["files"] == {"plot": "p.png", "gantt": "g.svg"}
    assert all(Path(path).is_file() for path in document["files"].values())


@pytest.mark.usefixtures("measured")
def test_who_listens_hears_every_session(teacher: Teacher) -> None:
    heard: list[Event] = []
    wanted = SequencingOptions("random", 4, sessions=3)
    document = sequence_named("toast", None, 2, wanted, teacher=replace(teacher, tell=heard.append), files={})
    assert document["sessions"] == 3
    assert heard[0] == PhaseBegan("sequence", 3)
    found = [(event.result.cost, event.reference) for event in heard if isinstance(event, SequenceFound)]
    assert found == [(29.0, Reference(29.0, True, "A*", sequence=(1, 1, 2, 2), found_by="A*"))] * 3


@pytest.mark.parametrize(
    ("words", "order"),
    [
        ("toast", ("slice",) * 3),
        ("toast --toasts 1", ("slice",)),
        ("toast --parts slice=2", ("slice",) * 2),
    ],
)
def test_a_task_is_for_what_its_file_says_unless_told(
    lab: Lab, measured: list[tuple[str, Order, int]], words: str, order: Order
) -> None:
    document = asked(lab, f"{words} --method fifo")
    assert (document["toasts"], document["order"]) == (len(order), list(order))
    assert measured == [("toast", order, 0)]


@pytest.mark.usefixtures("measured")
def test_the_parts_of_several_kinds_are_called_by_them(lab: Lab) -> None:
    document = asked(lab, "breakfast --parts slice=1,cup=1 --method fifo --gantt g.svg")
    assert document["order"] == ["slice", "cup"]
    assert {move.partition(":")[0] for move in document["moves"]} == {"slice 1", "cup 2"}
    chart = " ".join(ElementTree.parse("g.svg").getroot().itertext())
    assert all(name in chart for name in ("slice 1", "cup 2"))


def test_a_case_that_a_task_has_not(lab: Lab, folder: Path, root: Path, measured: list[tuple[str, Order, int]]) -> None:
    (folder / "mine.toml").write_text((root / "tasks" / "toast.toml").read_text(encoding="utf-8"))
    ran = lab("sequence", "mine.toml", "--case", "I")
    line = "lab: case 'I' (--case): task 'mine.toml' has none; toast has I, II and III, a cell its orders\n"
    assert (ran.code, ran.out, ran.err, measured) == (2, "", line, [])


@pytest.mark.usefixtures("measured")
def test_a_task_with_advice(lab: Lab) -> None:
    document = asked(lab, "toast --toasts 2 --method srl --advisor novice --gate always --episodes 3")
    assert (document["advisor"], document["advice"][0]["requests"]) == ("novice", 3)


def test_what_was_found_until_ctrl_c_is_told() -> None:
    """A person asked from episode 30 on ends the session there."""
    file = load_cell("toast-case-1")

    def ask(request: object) -> int | None:
        raise KeyboardInterrupt

    wanted = SequencingOptions("srl", 60, advisor=AdvisorName.of("terminal"), people={"terminal": ask})
    document, found = sequence_cell(file.cell(3), file.sequencing, wanted, Chance())
    assert document["interrupted"] is True
    assert (document["episodes"], len(found)) == (29, 1)
    assert document["cost"] == min(document["episode_costs"]) == simulate(file.cell(3), found[0].sequence).makespan_s


def test_ctrl_c_before_the_method_found_an_order() -> None:
    """There is the optimum of the first look."""
    file = load_cell("toast-case-1")

    def ask(request: object) -> int | None:
        raise KeyboardInterrupt

    wanted = SequencingOptions("srl", 60, advisor=AdvisorName.of("terminal"), gate="always", people={"terminal": ask})
    document, _ = sequence_cell(file.cell(3), file.sequencing, wanted, Chance())
    assert (document["stopped_by"], document["interrupted"]) == ("Ctrl-C", True)
    assert (document["method"], document["cost"], document["proven"]) == ("A*", 513.0, True)
