"""A member of a family is one object and one row: with these alone it is offered, runs, and is held to the contract.

Here stand nine members that do not ship. `add_all` is all that their authors would write beside the objects themselves.
"""

import subprocess
import sys
from collections.abc import Callable, Mapping, MutableMapping
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pytest

from lab.advice.advisors import ADVISORS, AdvisorKind, AdvisorName, Level
from lab.cli.app import COMMANDS, Command
from lab.cli.options import Json
from lab.cli.output import show
from lab.export import FORMATS, Format, trajectory_csv
from lab.learning.gates import GATES, Gate, Steps
from lab.learning.members import Member
from lab.learning.requests import Advisor
from lab.learning.selection import SELECTIONS, greedy
from lab.learning.updates import UPDATES
from lab.learning.updates.tabular import QLearning
from lab.sequencing import SEQUENCERS, Sequencer
from lab.sequencing.cell.cell import Cell
from lab.sequencing.methods.fifo import fifo
from lab.sequencing.search import Search, SequenceResult
from lab.skills import SKILLS, Transfer
from lab.studies import STUDIES, Study
from lab.studies.findings import Findings, row
from lab.studies.runner import Job
from lab.tasks.task import Task

Lab = Callable[..., Any]  # the fixture of tests/conftest.py; it returns a Ran
Tables = tuple[tuple[MutableMapping[str, Any], str, Any], ...]


# ---- the objects --------------------------------------------------------------------------------------------------


class Hasty(QLearning):
    """A learner: learns each step twice."""

    def learn(self, s_tm1: int, a_tm1: int, r_t: float, discount_t: float, s_t: int, a_t: int) -> None:
        for _ in range(2):
            super().learn(s_tm1, a_tm1, r_t, discount_t, s_t, a_t)


class EveryOther(Gate):
    """A gate: asks in every other episode."""

    def opens(self, episode: int, steps: Steps) -> bool:
        return episode % 2 == 0


def wavering(name: AdvisorName, level: Level) -> Advisor:
    """An advisor, between a moderate and a limited one."""
    return level.simulated((0.2,), 1.0)


class Return(Transfer):
    """A skill: brings the empty gripper the whole way back."""

    subtask: ClassVar[str] = "dummy-skill"

    def __init__(self, origin: str, target: str) -> None:
        super().__init__(origin, target)
        self.name = f"dummy-skill {origin} to {target}"

    @classmethod
    def on_travel(cls, task: Task, origin: str, target: str) -> "Return":
        return cls(target, origin)

    @classmethod
    def on_carry(cls, task: Task, kind: str, origin: str, target: str) -> Any:
        return None


def queued(cell: Cell, search: Search, rng: np.random.Generator) -> SequenceResult:
    """A sequencer."""
    return fifo(cell, search, rng)


def study(job: Job, reading: Mapping[str, Any]) -> Findings:
    """A study."""
    return Findings([row({"seed": job.seed}, "answer_steps", 42.0)], {})


def greet(name: str, as_json: Json = False) -> None:
    """Greets somebody."""
    show({"greeted": name}, as_json, lambda document: f"hello {document['greeted']}")


# ---- the rows -----------------------------------------------------------------------------------------------------

ROWS: Tables = (
    (UPDATES, "dummy-learner", Member(Hasty, "as q, but learns each step twice")),
    (GATES, "dummy-gate", Member(EveryOther, "asks in every other episode")),
    (SELECTIONS, "dummy-selection", Member(lambda values, temperature, u: greedy(values), "the best, ties: the first")),
    (ADVISORS, "dummy-advisor", AdvisorKind(wavering)),
    (SKILLS, "dummy-skill", Return),
    (SEQUENCERS, "dummy-method", Sequencer(lambda: queued, "as fifo")),
    (STUDIES, "dummy-study", Study("A dummy", study)),
    (FORMATS, "dummy-format", Format("as csv", trajectory_csv.write, trajectory_csv.read)),
    (COMMANDS, "dummy-command", Command(greet, "Greets somebody.", "lab dummy-command you")),
)


def add_all() -> None:
    """Adds the rows, for good."""
    for table, name, member in ROWS:
        table[name] = member


# ---- what follows from them ---------------------------------------------------------------------------------------


@pytest.fixture(autouse=True)
def added(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The rows, in an empty folder."""
    for table, name, member in ROWS:
        monkeypatch.setitem(table, name, member)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("LAB_TOOLBOX", str(tmp_path / "toolbox"))
    monkeypatch.setenv("COLUMNS", "200")


@pytest.mark.parametrize(
    ("command", "names"),
    [
        ("teach", ("dummy-learner", "dummy-gate", "dummy-advisor", "dummy-skill")),
        ("teach", ("dummy-learner: as q, but learns each step twice", "dummy-gate: asks in every other episode")),
        ("run", ("dummy-advisor",)),
        ("sequence", ("dummy-method", "dummy-method: as fifo")),
        ("export", ("dummy-format",)),
        ("dummy-command", ("Greets somebody.", "Example: lab dummy-command you")),
        ("", ("dummy-command",)),
    ],
)
def test_it_is_offered_in_help(lab: Lab, command: str, names: tuple[str, ...]) -> None:
    text = " ".join(lab(*command.split(), "--help").out.replace("│", " ").split())
    assert [name for name in names if name not in text] == []


def test_it_is_listed(lab: Lab) -> None:
    assert {"name": "dummy-study", "title": "A dummy"} in lab("study", "list", "--json").json["studies"]


@pytest.mark.parametrize(
    "words",
    [
        "teach world-1 --learner dummy-learne",
        "teach world-1 --gate dummy-gat",
        "teach world-1 --advisor dummy-adviso",
        "teach dummy-skil",
        "sequence fms --method dummy-metho",
        "study run dummy-stud",
        "export toast-run --format dummy-forma",
    ],
)
def test_who_mistypes_it_is_told(lab: Lab, words: str) -> None:
    ran = lab(*words.split())
    assert ran.code == 2
    assert f"did you mean '{words.split()[-1]}" in ran.err


def test_it_runs(lab: Lab) -> None:
    world = lab("task", "show", "random:3x3:0:1").out
    Path("w.toml").write_text(world.replace('"softmax"', '"dummy-selection"'), encoding="utf-8")
    words = "teach w.toml --learner dummy-learner --gate dummy-gate --advisor dummy-advisor --json"
    ran = lab(*words.split())
    assert ran.code == 0, ran.err
    made = ran.json
    assert {made[name] for name in ("learner", "gate", "advisor")} == {"dummy-learner", "dummy-gate", "dummy-advisor"}
    assert made["requests"] > 0
    assert lab("teach", "dummy-skill", "--json").json["subtask"] == "dummy-skill"
    words = "sequence fms --case RS --method dummy-method --json"
    assert lab(*words.split()).json["method"] == "dummy-method"
    assert lab("study", "run", "dummy-study", "--json").json["rows"][0]["value"] == 42.0
    assert lab("dummy-command", "you").out == "hello you\n"


CONTRACTS = (  # of a family, each run over all that its table lists
    "tests/learning/test_session.py::test_results_fit_together_and_repeat",
    "tests/learning/test_session.py::test_every_learner_solves_small_boards_with_an_expert",
    "tests/learning/test_session.py::test_every_selection_learns_a_corridor",
    "tests/learning/test_session.py::test_every_simulated_advisor_can_help",
    "tests/learning/test_gates.py::test_experts_and_novices_at_every_gate",
    "tests/learning/test_updates.py::test_scattered_values_lie_within_a_half",
    "tests/learning/test_kernels.py",
    "tests/skills/test_skill_life.py",
    "tests/sequencing/test_sequencers.py",
    "tests/export/test_formats.py",
    "tests/cli/test_app.py::test_every_command_has_help_with_an_example",
)


def test_it_is_held_to_its_familys_contract(root: Path) -> None:
    """The contract tests read the tables, so they hold whatever stands there."""
    code = (
        f"import sys; sys.path[:0] = [{str(root)!r}, {str(root / 'tests')!r}]\n"
        "import pytest, test_families\n"
        "test_families.add_all()\n"
        f"sys.exit(pytest.main(['-v', '-p', 'no:cacheprovider', '-k', 'dummy', *{CONTRACTS!r}]))"
    )
    ran = subprocess.run([sys.executable, "-c", code], cwd=root, capture_output=True, text=True, check=False)
    assert ran.returncode == 0, ran.stdout[-3000:]
    assert [name for _, name, _ in ROWS if name not in ran.stdout] == ["dummy-study"]  # each is a study of its own
