"""Settings compared: the same sessions compiled and one by one, the same chances for all, and nothing run twice."""

import json
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any
from zlib import crc32

import numpy as np
import pytest

import lab
from lab.errors import BadInput
from lab.learning.batch import Batch, run_sessions
from lab.learning.gates import GATES, Gate
from lab.learning.members import Member
from lab.studies.compared import Compared, ComparedSetting, compared, sessions_of, words
from lab.studies.runner import STORE, Job
from lab.tasks.grid_world import from_rows

WORLD = from_rows("S..\n.#.\n..G", "small", "test")
SHORT: dict[str, Any] = {"episodes": [8]}


def one(what: Compared) -> ComparedSetting:
    (setting,) = what.settings()
    return setting


def test_every_combination_is_a_setting() -> None:
    what = Compared(WORLD, ("expert", "novice"), {"gate": ["ccrl", "ia"], "psi": [0.1, 0.2]})
    assert [setting.named for setting in what.settings()][:3] == [
        {"advisor": "expert", "gate": "ccrl", "psi": 0.1},
        {"advisor": "novice", "gate": "ccrl", "psi": 0.1},
        {"advisor": "expert", "gate": "ccrl", "psi": 0.2},
    ]
    assert len([*what.settings()]) == 8


def test_its_sessions_are_those_of_the_kernel() -> None:
    """The seeds are drawn for the problem alone: every setting meets the same chances."""
    setting = one(Compared(WORLD, ("none",), {"gate": ["never"], **SHORT}))
    found, how = sessions_of(setting, 4, 0), setting.subject().settings
    other = sessions_of(one(Compared(WORLD, ("none",), {"gate": ["always"], **SHORT})), 4, 0)
    assert found.curve.tolist() == other.curve.tolist()
    seeds = np.random.default_rng([0, crc32(WORLD.mdp().signature.encode())])
    batch = run_sessions(WORLD.mdp(), how.learner, how.gate, None, seeds.integers(2**64, size=4, dtype=np.uint64))
    assert found.mean_steps.tolist() == batch.steps.mean(axis=1).tolist()
    assert found.last_steps.tolist() == batch.steps[:, -1].tolist()


def test_returns_and_greedy_steps_are_rows_where_steps_are_in_a_table() -> None:
    rows = compared(Compared(WORLD, ("none",), {"gate": ["never"], "episodes": [200]}), Job(3, 0)).rows
    values = {row["measure"]: row["value"] for row in rows}
    assert values["greedy_last_steps"] == 4.0  # the shortest path
    assert values["greedy_steps"] >= 4.0
    assert values["mean_return"] < WORLD.mdp().reward.max()
    tiles = compared(Compared(WORLD, ("none",), {"learner": ["sarsa-lambda"], "tilings": [2], **SHORT}), Job(2, 0)).rows
    assert "mean_return" in {row["measure"] for row in tiles}
    assert not {row["measure"] for row in tiles} & {"greedy_steps", "greedy_last_steps"}


def test_the_tables_of_few_sessions_are_held_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """60 sessions in rounds of 24, 24 and 12, with the same results as in one."""
    setting, held = one(Compared(WORLD, ("expert",), SHORT)), []
    whole = sessions_of(setting, 60, 0)

    def recorded(*given: Any, **how: Any) -> Batch:
        batch = run_sessions(*given, **how)
        held.append(len(batch.q))
        return batch

    monkeypatch.setattr("lab.studies.compared.MOST_ENTRIES", 1)
    monkeypatch.setattr("lab.studies.compared.run_sessions", recorded)
    assert sessions_of(setting, 60, 0).to_json() == whole.to_json()
    assert held == [24, 24, 12]


def test_what_is_not_compiled_is_run_one_by_one(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(GATES, "plain", Member(GATES["always"].make, "always, without a compiled form"))
    for advisor in ("expert", lambda request: 3):
        found = sessions_of(one(Compared(WORLD, (advisor,), {"gate": ["plain"], **SHORT})), 3, 0)
        assert found.curve.shape == (8,)
        assert (found.helped_steps > 0).all()
        assert found.greedy_steps.tolist() == found.greedy_last_steps.tolist()  # eight episodes: measured once
        assert (found.greedy_steps > 0.0).all()


@pytest.mark.parametrize("name", ["gym:FrozenLake-v1", "random:4x4:0.2:1"])
def test_any_problem_is_compared(name: str) -> None:
    found = sessions_of(one(Compared(name, ("expert",), SHORT)), 2, 0)
    assert found.curve.shape == (8,)
    assert found.solved.shape == (2,)


def test_what_is_done_is_not_run_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    what = Compared(WORLD, ("expert", "wrong"), SHORT)
    job = Job(3, 0, folder=tmp_path)
    first = compared(what, job)
    lines = (tmp_path / STORE).read_text(encoding="utf-8").splitlines()
    assert len(lines) == 2
    with (tmp_path / STORE).open("a") as file:
        file.write('{"key": 3}\n{"key"')  # cut off, and none of ours
    monkeypatch.setattr("lab.studies.compared.run_sessions", None)  # nothing is run
    assert compared(what, job).rows == first.rows
    assert json.loads(lines[0])["solved"] is not None
    monkeypatch.undo()
    assert compared(what, replace(job, seed=1)).rows != first.rows


def test_the_rows_do_not_depend_on_the_workers() -> None:
    what = Compared("random:4x4:0.2:1", ("expert", "novice"), SHORT)
    assert compared(what, Job(3, 0, workers=2)).rows == compared(what, Job(3, 0)).rows


def test_names_say_what_differs() -> None:
    rows = [{"advisor": "expert", "gate": "ia", "psi": psi} for psi in (0.1, 0.2)]
    assert words(rows[0], rows) == "psi 0.1"
    assert words(rows[0], rows[:1]) == "expert"


@pytest.mark.parametrize(
    ("what", "fault"),
    [
        ({"values": {"gate": []}}, "gate: nothing to compare"),
        ({"advisors": ()}, "advisor: nothing to compare"),
        ({"advisors": ("expert", "llm:http://h")}, "advisor 'llm:http://h': only lab teach, run and sequence ask"),
    ],
)
def test_what_cannot_be_compared(what: dict[str, Any], fault: str) -> None:
    with pytest.raises(BadInput, match=fault):
        Compared(WORLD, **what)


def test_a_bad_value_is_found_before_anything_is_run(tmp_path: Path) -> None:
    with pytest.raises(BadInput, match=r"psi = -1.0: allowed at least 0"):
        compared(Compared(WORLD, values={"psi": [0.1, -1.0]}), Job(3, 0, folder=tmp_path))
    assert not [*tmp_path.iterdir()]


class Patient:
    """Answers 20 questions, then none; with a generator, at random."""

    def __init__(self, rng: np.random.Generator | None = None):
        self.left, self.rng = 20, rng

    def advise(self, request: Any) -> int | None:
        self.left -= 1
        return None if self.left < 0 else 0 if self.rng is None else int(self.rng.integers(len(request.allowed)))


class Entangled(Patient):
    """Cannot be copied."""

    def __deepcopy__(self, memo: Any) -> "Entangled":
        raise RuntimeError("it holds a socket")


def helped(advisor: Any, seed: int = 0) -> list[float]:
    setting = one(Compared(WORLD, (advisor,), {"gate": ["always"], **SHORT}))
    steps: list[float] = sessions_of(setting, 4, seed).helped_steps.tolist()
    return steps


@pytest.mark.parametrize("advisor", [Patient(), Patient])
def test_an_advisor_keeps_nothing_from_session_to_session(advisor: Any) -> None:
    assert helped(advisor) == [20.0] * 4


def test_an_advisor_that_cannot_be_copied_is_refused() -> None:
    with pytest.raises(
        BadInput, match=r"advisor 'Entangled': .* cannot be copied .*RuntimeError: it holds a socket.* class"
    ):
        helped(Entangled())


def test_a_class_gets_a_generator_of_its_session() -> None:
    setting = one(Compared(WORLD, (Patient,), {"gate": ["always"], **SHORT}))
    first, again, other = (sessions_of(setting, 4, seed).mean_steps.tolist() for seed in (0, 0, 1))
    assert first == again != other
    assert len(set(first)) > 1


def test_two_classes_of_one_name_are_not_mixed_up() -> None:
    with pytest.raises(BadInput, match="gate: two classes are called Gate"):
        Compared(WORLD, values={"gate": [type("Gate", (Gate,), {}), type("Gate", (Gate,), {})]})


OWN = """import lab
from lab.learning.updates.update import OnTable
from helping import SHARE


class Mine(lab.Gate):
    def opens(self, episode, steps):
        return episode % SHARE == 0


class Learns(OnTable):
    def learn(self, s_tm1, a_tm1, r_t, discount_t, s_t, a_t):
        self.q[s_tm1][a_tm1] += RATE * (r_t + discount_t * max(self.q[s_t]) - self.q[s_tm1][a_tm1])


def says(request):
    return ANSWER


RATE, ANSWER = 0.5, 3
"""


@pytest.mark.slow
def test_own_code_that_was_edited_is_run_again(tmp_path: Path) -> None:
    (tmp_path / "mine.py").write_text(OWN)
    (tmp_path / "helping.py").write_text("SHARE = 2\n")
    (tmp_path / "small.txt").write_text("S..\n.#.\n..G\n")
    own = [
        f"--{kind}=./mine.py:{name}" for kind, name in (("gate", "Mine"), ("learner", "Learns"), ("advisor", "says"))
    ]
    command = [
        sys.executable,
        "-c",
        "from lab.cli import main; main()",
        "study",
        "compare",
        "small.txt",
        *own,
        "--episodes=8",
        "--sessions=4",
    ]

    def rows() -> Any:
        path = os.pathsep.join([str(tmp_path), str(Path(lab.__file__).parents[1])])
        environment = os.environ | {"PYTHONPATH": path}
        ran = subprocess.run([*command, "--json"], cwd=tmp_path, env=environment, capture_output=True, check=True)
        return json.loads(ran.stdout)["rows"]

    first, stored = rows(), tmp_path / "compared" / STORE
    kept = stored.read_text().splitlines()
    assert rows() == first
    assert stored.read_text().splitlines() == kept  # nothing was run twice
    edits = (
        ("helping.py", "SHARE = 2", "SHARE = 3"),
        ("mine.py", "= 0.5, 3", "= 0.5, 1"),
        ("mine.py", "= 0.5, 1", "= 0.1, 1"),
    )
    for number, (file, old, new) in enumerate(edits, 2):  # an imported module, the advisor, the learner
        (tmp_path / file).write_text((tmp_path / file).read_text().replace(old, new))
        assert rows() != first
        assert len(stored.read_text().splitlines()) == number * len(kept)
