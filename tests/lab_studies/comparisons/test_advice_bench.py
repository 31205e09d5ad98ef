"""AdviceBench: its problems and advisors by hand, its ranks, and a small run of it that goes on where it stopped."""

import csv
import json
import os
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import lab
from lab.errors import BadInput
from lab.learning.environment import Step, TableEnvironment
from lab.learning.selection import Draw
from lab.learning.settings import LearnerSettings
from lab.mdp import greedy_path, grid, optimal_values, shortest_steps
from lab.studies.runner import Job
from lab_studies.comparisons.advice_bench import layouts
from lab_studies.comparisons.advice_bench.advice_bench import _later, advice_bench
from lab_studies.comparisons.advice_bench.aggregates import RETURN, aggregates, table_of
from lab_studies.comparisons.advice_bench.bad_advisors import ACCURACIES, ADVISORS, advice_of, importance
from lab_studies.comparisons.advice_bench.problems import Benched, problem
from lab_studies.comparisons.advice_bench.problems import own_problem as problem_of
from lab_studies.comparisons.advice_bench.ranks import holm, ranks
from lab_studies.comparisons.advice_bench.rules import RULES
from lab_studies.comparisons.advice_bench.sessions import Case, Outcome, Outcomes, case_outcomes


def test_layouts_take_as_many_moves_as_by_hand() -> None:
    assert shortest_steps(layouts.minigrid(("S.G",))) == 2
    assert shortest_steps(layouts.minigrid(("S.", ".G"))) == 3  # ahead, turn, ahead
    assert shortest_steps(layouts.minigrid(("SkDG",))) == 5  # pick up, ahead, toggle, ahead, ahead
    lava = layouts.minigrid(("S~G", "..."))
    assert shortest_steps(lava) == 7  # turn, ahead, turn, two ahead, turn, ahead
    assert (lava.terminal & ~lava.goal).sum() == 1


def test_a_door_stays_shut_without_its_key() -> None:
    assert (
        shortest_steps(layouts.minigrid(("S.DG", "...."))) == 8
    )  # round it: ahead, turn, ahead, turn, two ahead, turn, ahead
    assert shortest_steps(layouts.minigrid(("S.DG", "k..."))) == 7  # turn, pick up, turn, ahead, toggle, two ahead
    locked = layouts.minigrid(("S.DG", "k###"))
    actions = greedy_path(optimal_values(locked, 0.99), locked, 30)[1]
    assert actions.index(layouts.PICK_UP) < actions.index(layouts.TOGGLE)


def test_three_toasts_take_as_long_as_by_hand() -> None:
    # two slots, 4 steps each: in 1, in 2, wait till 5, out 6 (under the applier till 8), the third goes in at 7, ...
    mdp = layouts.toast_order()
    assert shortest_steps(mdp) == 17
    q = optimal_values(mdp, 0.99)
    assert greedy_path(q, mdp, 40)[2]


def test_bad_advisors_are_bad_in_their_way() -> None:
    place = problem("empty")
    best = place.values.argmax(axis=1)
    live = np.flatnonzero(~place.mdp.terminal)

    def share(name: str) -> float:
        advice = ADVISORS[name](place)
        heard = [state for state in live if advice.region[state]]
        right = place.values[heard] >= place.values[heard].max(axis=1, keepdims=True) - 1e-9
        chances = np.diff(advice.thresholds[0, heard], axis=1, prepend=0.0)
        return float((chances * right).sum(axis=1).mean())

    assert [share(name) for name in ACCURACIES] == pytest.approx([*ACCURACIES.values()])
    assert share("contrary") < 0.02
    assert 0.65 < share("wrong there") < 0.85
    assert share("silent") > 0.98  # what it says
    assert 0.1 < ADVISORS["silent"](place).region.mean() < 0.4
    stuck = ADVISORS["stuck"](place).thresholds[0]
    assert (np.diff(stuck, axis=1, prepend=0.0).argmax(axis=1) == best[place.mdp.start]).all()
    drifting = np.diff(ADVISORS["drifting"](place).thresholds, axis=2, prepend=0.0)
    assert drifting[0, live, best[live]].min() > 0.3 > drifting[-1, live].max(axis=1).min() - 1.0
    assert ADVISORS["late"](place).late
    assert 0.3 < importance(place, 0.5)[live].mean() < 0.9


@pytest.mark.parametrize("name", ["lake", "taxi", "toast-order", "place"])
def test_a_label_means_the_same_share_of_optimal_answers_in_every_problem(name: str) -> None:
    place, rng = problem(name), np.random.default_rng(3)
    best = place.values > place.values.max(axis=1, keepdims=True) - 1e-6
    asked = rng.choice(np.flatnonzero(~best.all(axis=1) & ~place.mdp.terminal), size=4000)
    for label, share in ACCURACIES.items():
        thresholds = ADVISORS[label](place).thresholds[0, asked]
        answers = (thresholds <= rng.random(4000)[:, None]).sum(axis=1).clip(max=place.mdp.n_actions - 1)
        assert best[asked, answers].mean() == pytest.approx(share, abs=0.03)


def test_where_drawing_evenly_is_as_good_a_novice_draws_evenly() -> None:
    three_of_four = np.array([[0.0, 0.0, 0.0, -1.0], [0.0, 0.0, 0.0, 0.0]])
    mdp = grid((1, 2), np.zeros((1, 2), bool), (0, 0), (0, 1))
    place = Benched("two", mdp, LearnerSettings(), three_of_four)
    assert ADVISORS["novice"](place).thresholds[0, 0] == pytest.approx([0.25, 0.5, 0.75, 1.0], abs=1e-4)


def test_ranks_by_hand() -> None:
    cells = [("maze", "expert", "any"), ("maze", "novice", "any"), ("lake", "expert", "any")]
    scores = {
        "ours": dict(zip(cells, (9.0, 9.0, 9.0), strict=True)),
        "first": dict(zip(cells, (5.0, 9.0, 5.0), strict=True)),
        "last": dict(zip(cells, (1.0, 1.0, 7.0), strict=True)),
    }
    found = ranks(scores, ["maze", "lake"], "ours")
    # maze: 1, 2, 3 and 1.5, 1.5, 3; lake: 1, 3, 2
    assert found.mean == {"ours": 1.125, "first": 2.375, "last": 2.5}
    assert found.critical == pytest.approx(2.343 * np.sqrt(3 * 4 / 12), abs=0.01)  # Demsar's q for three
    assert {*found.beaten} == {"first", "last"}
    assert holm({"a": 0.01, "b": 0.04, "c": 0.03}) == pytest.approx({"a": 0.03, "c": 0.06, "b": 0.06})


@pytest.mark.slow
def test_every_rule_runs_and_nobody_is_the_same_whatever_the_advisor() -> None:
    found = case_outcomes(Case("empty", "expert"), 3, 0)
    assert {rule for rule, _ in found} == {*RULES}
    assert all(one.points.shape == (3,) and one.answers.max() <= 100 for key, one in found.items() if key[1] == "100")
    nobody = case_outcomes(Case("empty", None), 3, 0)["nobody", "any"]
    assert found["always", "any"].points == pytest.approx([100.0] * 3, abs=0.5)
    assert found["earned-trust", "any"].points.mean() > nobody.points.mean()
    assert nobody.greedy_curve.shape == (20,)  # 200 episodes, every tenth
    np.testing.assert_allclose(nobody.greedy_curve.mean(), nobody.greedy.mean(), atol=0.01)
    np.testing.assert_allclose(nobody.greedy_curve[-1], nobody.greedy_last.mean(), atol=0.01)


def test_recovery_is_the_episode_from_which_a_curve_stays_up() -> None:
    nobody, late = np.array([0.0, 90.0, 100.0, 100.0]), np.array([95.0, 0.0, 0.0, 90.0])
    assert _later(nobody, nobody, 100.0, 40) == 0  # from the second of four bins on, as nobody's own
    assert _later(late, nobody, 100.0, 40) == 20
    assert _later(np.zeros(4), nobody, 100.0, 40) is None


def test_aggregates_by_hand() -> None:
    outcomes: dict[Case, Outcomes] = {}
    for name, points in (("maze", [0.0, 100.0]), ("lake", [50.0, 50.0, 7.0])):
        none = np.zeros(0)
        alone = Outcome(np.array(points), none, none, none, none, none, none)
        better = alone._replace(points=alone.points + 1.0)
        outcomes[Case(name, None)] = {("nobody", "any"): alone}
        outcomes[Case(name, "expert")] = {("ours", "100"): better, ("ours", "any"): better}
    tables = {rule: table_of(outcomes, rule, RETURN, ["maze", "lake"], ["expert"]) for rule in ("ours", "nobody")}
    assert tables["nobody"].scores.tolist() == [[0.0, 0.0, 50.0, 50.0], [100.0, 100.0, 50.0, 50.0]]
    assert tables["ours"].strata.tolist() == [0, 0, 1, 1]
    more = {**outcomes, Case("lake", None): {("nobody", "any"): alone._replace(points=np.array([1.0, 2.0, 3.0, 4.0]))}}
    assert table_of(more, "nobody", RETURN, ["maze", "lake"], ["expert"]).scores[:, 2].tolist() == [1.0, 3.0]  # spread
    found = aggregates(tables, "ours", 0)
    assert found["ours"].iqm[0] == 51.0
    assert found["nobody"].improvement == (0.75 + 1.0) / 2  # of the maze's four pairs three, of the lake's all
    assert found["ours"].improvement is None
    assert found["nobody"].profile[[0, 20, 70, 120]].tolist() == [1.0, 0.75, 0.25, 0.0]  # above -20, 0, 50, 100


def test_a_small_bench_goes_on_where_it_stopped_and_says_the_same(tmp_path: Path) -> None:
    reading = {"problem": ["empty"], "methods": ["always", "earned-trust"], "advisors": ["expert", "contrary"]}
    job = Job(sessions=3, folder=tmp_path)
    found = advice_bench(job, reading)
    assert len(found.rows) == 2 * (1 + 2 * 2 * 2)  # two scores
    harm = [one for one in found.rows if (one["rule"], one["advisor"], one["budget"]) == ("always", "contrary", "any")]
    assert {one["measure"] for one in harm} == {"gain_points", "greedy_gain"}
    assert harm[0]["value"] < -80.0
    assert re.match(r"rank [123] of 3; ", found.summary["'earned-trust'"])
    assert {"winner", "greedy policy: winner", "greedy policy: harm by always"} <= {*found.summary}
    assert harm[1]["ci95"][1] < -80.0
    aggregated = list(csv.DictReader(found.files["aggregates.csv"].splitlines()))
    assert len(aggregated) == 2 * 3
    assert {line["rule"] for line in aggregated} == {"always", "earned-trust", "nobody"}
    lines = (tmp_path / "sessions.jsonl").read_text().splitlines()
    assert [json.loads(line)["case"][1] for line in lines] == [None, "expert", "contrary"]
    (tmp_path / "sessions.jsonl").write_text("\n".join([*lines[:2], "cut"]))
    again = advice_bench(job, reading)
    assert again.rows == found.rows
    assert again.summary == found.summary
    assert again.files == found.files
    versions = {text.splitlines()[2] for name, text in found.files.items() if name.startswith("scores/")}
    assert len(versions) == 1
    assert {"scores/always.csv", "scores/earned-trust.csv"} < {*found.files}
    other = advice_bench(Job(sessions=3, seed=1), reading)
    assert other.files["scores/always.csv"].splitlines()[2] not in versions


def test_what_cannot_be_benched_is_refused() -> None:
    job = Job(sessions=2)
    with pytest.raises(BadInput, match=r"unknown rule 'trost'.*trust"):
        advice_bench(job, {"methods": ["trost"]})
    with pytest.raises(BadInput, match="unknown advisor 'expart'"):
        advice_bench(job, {"problem": ["empty"], "advisors": ["expart"]})
    with pytest.raises(BadInput):
        advice_bench(job, {"problem": ["no-such-maze"]})


@pytest.mark.slow
def test_a_file_of_ones_own_and_any_advisor_that_always_answers_alike(tmp_path: Path) -> None:
    maze = tmp_path / "maze.txt"
    maze.write_text("S..\n.#.\n..G\n")
    found = advice_bench(
        Job(sessions=3), {"problem": [str(maze)], "methods": ["earned-trust"], "advisors": ["tau=0.05"]}
    )
    assert found.rows[-2]["measure"] == "gain_points"
    assert {*found.files} == {"aggregates.csv"}  # a problem of the user is on no leaderboard
    assert found.rows[-2]["value"] > 0.0
    place = problem(str(maze))
    advice = advice_of("tau=0.05", place)
    assert advice is not None
    assert advice.thresholds.shape == (1, *place.mdp.successor.shape)


# ---- members of the user -------------------------------------------------------------------------------------------


class EveryOther(lab.Gate):
    """Asks in every other episode."""

    def opens(self, episode: int, steps: lab.Steps) -> bool:
        return episode % 2 == 0


class Tiring:
    """Answers at random, and only the first 30 questions of a session."""

    def __init__(self, rng: np.random.Generator):
        self.rng, self.left = rng, 30

    def advise(self, request: lab.AdviceRequest) -> int | None:
        self.left -= 1
        return int(self.rng.integers(len(request.allowed))) if self.left >= 0 else None


def first(request: lab.AdviceRequest) -> int:
    return 0


@pytest.mark.slow
def test_members_made_in_python_are_measured_alike_in_several_processes() -> None:
    maze = lab.world("S..\n.#.\n..G", name="maze")
    reading: dict[str, Any] = {
        "methods": [EveryOther, "ccrl", "ia", "predictive"],
        "advisors": [Tiring, first],
        "problem": [maze, lab.Problem("board", "push", maze.mdp())],
    }
    found = lab.study("advicebench", sessions=2, **reading)
    assert len(found.rows) == 2 * 2 * (1 + 2 * 2 * 4)
    assert {row["rule"] for row in found.rows} == {"nobody", "EveryOther", "ccrl", "ia", "predictive"}
    tired = [row["answers"] for row in found.rows if (row["advisor"], row["rule"]) == ("Tiring", "EveryOther")]
    assert tired == [30.0] * 8  # each session has an advisor of its own
    assert {"harm by EveryOther", "greedy policy: harm by EveryOther"} <= {*found.summary}
    assert len(found.figures) == 7
    assert lab.study("advicebench", sessions=2, workers=2, **reading).rows == found.rows


def test_an_own_gate_that_was_edited_is_run_again(tmp_path: Path) -> None:
    (tmp_path / "maze.txt").write_text("S..\n.#.\n..G\n")
    gate = (
        "import lab\n\n\nclass Mine(lab.Gate):\n    def opens(self, episode, steps):\n        return episode % 2 == 0\n"
    )
    says = "\n\ndef says(request):\n    return 3\n"
    options = ["--methods=./mine.py:Mine,ccrl", "--advisors=./mine.py:says", "--problem=maze.txt", "--sessions=2"]
    program = [sys.executable, "-c", "from lab.cli import main; main()", "study", "run", "advicebench", *options]

    def rows(code: str) -> Any:
        (tmp_path / "mine.py").write_text(code)
        path = {"PYTHONPATH": str(Path(lab.__file__).parents[1])}
        ran = subprocess.run([*program, "--json"], cwd=tmp_path, env=os.environ | path, capture_output=True, check=True)
        return json.loads(ran.stdout)["rows"]

    kept = tmp_path / "advicebench-study" / "sessions.jsonl"
    before = rows(gate + says)
    assert {row["rule"] for row in before} == {"nobody", "mine.Mine", "ccrl"}
    assert len(kept.read_text().splitlines()) == 2
    assert rows(gate + says) == before
    assert len(kept.read_text().splitlines()) == 2  # nothing was run twice
    assert rows(gate.replace("% 2", "% 5") + says) != before
    assert len(kept.read_text().splitlines()) == 3  # nobody's sessions are as they were


@pytest.mark.parametrize(
    ("reading", "why"),
    [
        ({"methods": [Tiring]}, "Tiring.*wanted a subclass of lab.Gate"),
        ({"methods": [type("ccrl", (EveryOther,), {})]}, "two rules are called 'ccrl'"),
        ({"methods": []}, "methods: nothing to measure"),
        ({"methods": ["mine.Gate"]}, "'mine.Gate'.*it came from a file"),
        ({"advisors": [7]}, "advisor 7: wanted a name"),
        ({"advisors": [Tiring, type("Tiring", (Tiring,), {})]}, "two advisors are called 'Tiring'"),
        ({"problem": [7]}, "problem 7.*wanted a name, a GridWorld"),
        ({"problem": [lab.world("S.G", name="empty")]}, "two problems are called 'empty'"),
        ({"problem": ["gym:MountainCar-v0"]}, "problem 'gym:MountainCar-v0'.*needs a table or a model"),
    ],
)
def test_a_member_that_cannot_enter_is_named_in_one_line(reading: dict[str, Any], why: str) -> None:
    with pytest.raises(BadInput, match=why) as refused:
        advice_bench(Job(sessions=2), {"problem": ["empty"]} | reading)
    assert "\n" not in str(refused.value)


class Slippery(TableEnvironment):
    """A corridor in which every third draw does not move the learner."""

    def __init__(self) -> None:
        super().__init__(lab.grid((1, 4), [[0, 0, 0, 0]], (0, 0), (0, 3)))

    def step(self, state: int, action: int, draw: Draw) -> Step:
        return Step(-0.1, state, False) if draw() < 1 / 3 else super().step(state, action, draw)


class Right:
    """An advisor's object: always names the last action."""

    def advise(self, request: lab.AdviceRequest) -> int | None:
        return request.allowed[-1]


def test_a_problem_with_an_environment_and_an_advisors_object_are_measured() -> None:
    slippery = lab.Problem("slippery", "walk", Slippery().mdp, Slippery())
    reading: dict[str, Any] = {"methods": ["always"], "advisors": [Right(), "expert"], "problem": [slippery]}
    found = lab.study("advicebench", sessions=2, **reading)
    points = {row["advisor"]: row["points"] for row in found.rows if row["budget"] == "any"}
    assert {*points} == {"Right", "expert"}
    assert all(99.0 < value < 101.0 for value in points.values())  # of the best policy, which slips as well
    assert lab.study("advicebench", sessions=2, workers=2, **reading).rows == found.rows


def _ran(folder: Path, *options: str) -> "subprocess.CompletedProcess[str]":
    program = [sys.executable, "-c", "from lab.cli import main; main()", "study", "run", "advicebench", "--json"]
    few = ["--methods=always", "--advisors=expert", "--sessions=2", *options]
    path = {"PYTHONPATH": str(Path(lab.__file__).parents[1])}
    return subprocess.run([*program, *few], cwd=folder, env=os.environ | path, capture_output=True, text=True)


def test_steps_of_ones_own_count_also_with_an_advisor_whose_answers_are_a_table() -> None:
    """The expert needs three moves, and every third draw holds it back: 4.5 steps on average, which are 100 points."""
    place = problem_of(lab.Problem("slippery", "walk", Slippery().mdp, Slippery()))
    assert 4.2 < place.par < 4.8


def test_a_problem_without_a_goal_is_refused_in_words() -> None:
    chain = lab.Problem.from_arrays([[[0.0, 1.0]], [[1.0, 0.0]]], [[0.0], [1.0]], horizon=5)
    with pytest.raises(BadInput, match=r"'arrays'.*AdviceBench counts steps to a goal, and it has none"):
        lab.study("advicebench", problem=[chain], methods=["always"], advisors=["expert"], sessions=2)


@pytest.mark.slow
def test_problems_from_a_file_and_from_a_module_are_measured_in_several_processes(tmp_path: Path) -> None:
    (tmp_path / "mine.py").write_text(
        "import gymnasium\nimport lab\nfrom gymnasium.envs.toy_text.frozen_lake import FrozenLakeEnv\n"
        "from lab.learning.environment import TableEnvironment\n\n\n"
        "class Corridor(TableEnvironment):\n    def __init__(self):\n"
        "        super().__init__(lab.grid((1, 4), [[0, 0, 0, 0]], (0, 0), (0, 3)))\n\n\n"
        "made = Corridor().mdp\ngymnasium.register('Own-v0', 'mine:FrozenLakeEnv', max_episode_steps=90)\n"
    )
    problems = ["--problem=./mine.py:Corridor", "--problem=./mine.py:made", "--problem=gym:mine:Own-v0"]
    ran = _ran(tmp_path, *problems, "--workers=2")
    assert ran.returncode == 0, ran.stderr
    rows = json.loads(ran.stdout)["rows"]
    assert {row["problem"] for row in rows} == {"mine.Corridor", "mine.made", "gym:mine:Own-v0"}
    kept = (tmp_path / "advicebench-study" / "sessions.jsonl").read_text()
    assert _ran(tmp_path, *problems).returncode == 0
    assert (tmp_path / "advicebench-study" / "sessions.jsonl").read_text() == kept  # nothing was run twice
    wrong = _ran(tmp_path, "--problem=./mine.py:Coridor")
    assert (wrong.returncode, wrong.stdout.count("\n") <= 1) == (2, True)
    assert "did you mean 'Corridor'" in wrong.stderr
