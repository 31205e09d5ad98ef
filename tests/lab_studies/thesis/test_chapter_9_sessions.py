"""The sessions of a study: named by their setting, the same wherever they run, kept, and not run again."""

import json
from collections.abc import Callable
from dataclasses import fields, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lab.errors import WorkFailed
from lab.learning import batch as compiled
from lab.learning.batch import Batch
from lab.learning.settings import GateSettings
from lab.mdp import optimal_values
from lab.studies.runner import STORE, Job, seeds_of
from lab.tasks.grid_world import GridWorld
from lab_studies.thesis import chapter_9_sessions as chapter
from lab_studies.thesis.chapter_9_sessions import AdviceOutcome, AdviceSetting, measured, sessions_of

# 3 x 3 x 2 cells, one of them an obstacle, which is also all that an advisor with a limited view sees of it. From one
# corner to the opposite one on the same floor: 4 moves, 5 steps with the start.
SMALL = """
name = "small"
kind = "world"
shape = [3, 3, 2]
start = [0, 0, 0]
goal = [2, 2, 0]
obstacles = [[1, 1, 0]]
view = { lower = [1, 1, 0], upper = [1, 1, 0] }
learner = { learner = "afterstate", beta = 0.7, episodes = 60, max_steps = 40, count_start = true }
gate = { gate = "ccrl", first_episode = 10, omega = 7 }
"""
STEPS = 5


@pytest.fixture
def small(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    """The file of a small world in the folder that we are in: seeds go by its name, which is the same in every run."""
    monkeypatch.chdir(tmp_path)
    Path("small.toml").write_text(SMALL, encoding="utf-8")
    forget()
    return "small.toml"


def forget() -> None:
    """Worlds are read once; here their files change."""
    for read in (chapter.world, chapter.problem, chapter.known_values):
        read.cache_clear()


@pytest.fixture
def few() -> list[AdviceSetting]:
    """Six settings that come to different things."""
    guided = AdviceSetting("world-1", gate="ia", tau=0.1, psi=1.0)
    alone = [AdviceSetting("world-1", beta=beta) for beta in (0.3, 0.7, 1.1)]
    return [*alone, guided, replace(guided, tau=1.0), replace(guided, gate="ccrl", lambda_threshold=0.9, omega=1)]


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Where a job keeps what it did; not there yet."""
    return tmp_path / "study"


@pytest.fixture
def computed(monkeypatch: pytest.MonkeyPatch) -> list[AdviceSetting]:
    """The settings whose sessions were learned, one after another."""
    done: list[AdviceSetting] = []

    def counted(setting: AdviceSetting, sessions: int, seed: int) -> AdviceOutcome:
        done.append(setting)
        return sessions_of(setting, sessions, seed)

    monkeypatch.setattr(chapter, "sessions_of", counted)
    return done


def plain(outcomes: dict[AdviceSetting, AdviceOutcome]) -> dict[AdviceSetting, dict[str, list[int]]]:
    return {setting: outcome.to_json() for setting, outcome in outcomes.items()}


# ---- names --------------------------------------------------------------------------------------------------------

CHANGES: dict[str, Any] = {
    "world": "world-2",
    "view": "limited",
    "gate": "ia",
    "tau": 0.3,
    "lambda_threshold": 0.1,
    "omega": 3,
    "psi": 0.5,
    "beta": 0.9,
    "advisor_table": "exact",
    "learner": "q",
    "judge_unhelped": False,
    "memory": True,
    "wrong": True,
    "success": "any",
    "table_seed": 5,
}


def test_every_field_has_a_part_in_the_name() -> None:
    assert CHANGES.keys() == {field.name for field in fields(AdviceSetting)}
    setting = AdviceSetting("world-1", gate="combined", tau=0.1, lambda_threshold=0.05, omega=1, psi=1.0)
    others = [replace(setting, **{name: value}) for name, value in CHANGES.items()]
    keys = [one.key(10, 0) for one in (setting, *others)] + [setting.key(11, 0), setting.key(10, 1)]
    assert len({*keys}) == len(keys) == len(CHANGES) + 3
    assert setting.key(10, 0) == replace(setting).key(10, 0)


def test_another_world_in_the_same_file_has_another_name(small: str) -> None:
    setting = AdviceSetting(small)
    before = setting.key(10, 0)
    for old, new in (("[[1, 1, 0]]", "[[1, 1, 1]]"), ("beta = 0.7", "beta = 0.8"), ("omega = 7", "omega = 6")):
        Path(small).write_text(SMALL.replace(old, new), encoding="utf-8")
        forget()
        assert setting.key(10, 0) != before
    Path(small).write_text(SMALL, encoding="utf-8")
    forget()
    assert setting.key(10, 0) == before


@pytest.mark.parametrize("constant", ["FORMAT", "LEARNED_SEED", "LEARNED_BETA", "LEARNED_EPISODES"])
def test_another_way_of_computing_has_another_name(monkeypatch: pytest.MonkeyPatch, constant: str) -> None:
    before = AdviceSetting("world-1").key(10, 0)
    monkeypatch.setattr(chapter, constant, getattr(chapter, constant) + 1)
    assert AdviceSetting("world-1").key(10, 0) != before


def test_seeds_belong_to_a_setting() -> None:
    setting = AdviceSetting("world-1", tau=0.1)
    seeds = seeds_of(setting, 20, 0)
    assert (str(seeds.dtype), seeds.shape, len({*seeds.tolist()})) == ("uint64", (20,), 20)
    np.testing.assert_array_equal(seeds, seeds_of(replace(setting), 20, 0))
    others = [seeds_of(replace(setting, **{name: value}), 20, 0) for name, value in CHANGES.items()]
    for other in (*others, seeds_of(setting, 20, 1)):
        assert not {*other.tolist()} & {*seeds.tolist()}


# ---- outcomes -----------------------------------------------------------------------------------------------------


def test_an_outcome_comes_back_from_json() -> None:
    outcome = AdviceOutcome(np.array([True, False, True]), np.array([12, 0, 7]), np.array([2, 0, 1]))
    record = json.loads(json.dumps(outcome.to_json()))
    assert record == {"success": [1, 0, 1], "helped_steps": [12, 0, 7], "requests": [2, 0, 1]}
    back = AdviceOutcome.from_json(record)
    assert [str(part.dtype) for part in (back.success, back.helped_steps, back.requests)] == ["bool", "int64", "int64"]
    assert back.to_json() == record


@pytest.mark.parametrize("record", [{}, {"success": [1], "helped_steps": [1]}, [1], None, {"success": ["yes"]}])
def test_what_is_no_outcome(record: Any) -> None:
    with pytest.raises((KeyError, TypeError, ValueError)):
        AdviceOutcome.from_json(record)


@pytest.mark.parametrize(("success", "expected"), [("last", [True, False, False]), ("any", [True, True, False])])
def test_success_is_the_shortest_way_with_its_start(
    small: str, monkeypatch: pytest.MonkeyPatch, success: Any, expected: list[bool]
) -> None:
    """Three made-up sessions: one ends with the 5 steps of the shortest way, one had them before, one never did."""
    counts, steps = np.array([3, 2, 1]), np.array([[9, 5], [5, 9], [6, 41]], np.int32)
    made_up = Batch(steps, steps < 0, counts + 1, counts, counts, counts, counts, np.zeros(0))
    monkeypatch.setattr(compiled, "run_sessions", lambda *_, **__: made_up)
    outcome = sessions_of(AdviceSetting(small, success=success), 3, 0)
    assert outcome.success.tolist() == expected
    assert (outcome.helped_steps.tolist(), outcome.requests.tolist()) == ([3, 2, 1], [4, 3, 2])


def test_any_success_is_at_least_the_last(small: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """The same sessions judged both ways."""
    monkeypatch.setattr(chapter, "seeds_of", lambda setting, sessions, seed: np.arange(sessions, dtype=np.uint64))
    last, some = (sessions_of(AdviceSetting(small, beta=0.7, success=what), 40, 0).success for what in ("last", "any"))
    assert (some >= last).all()
    assert some.sum() > last.sum() > 0


def test_who_never_asks_is_not_helped_and_who_sees_less_helps_less() -> None:
    full = AdviceSetting("world-1", gate="ccrl", tau=0.1, lambda_threshold=0.9, omega=7)
    for alone in (AdviceSetting("world-1"), replace(full, gate="never")):
        never = sessions_of(alone, 10, 0)
        assert (never.helped_steps.sum(), never.requests.sum()) == (0, 0)
    wide, narrow = (sessions_of(replace(full, view=view), 10, 0) for view in ("full", "limited"))
    assert wide.helped_steps.mean() > narrow.helped_steps.mean() > 0


def test_a_setting_is_what_the_kernel_gets(small: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Learner and gate are the world's own but for what the setting says; an advisor with a limited view sees one cell."""
    calls: list[tuple[Any, ...]] = []

    def spied(*arguments: Any) -> Batch:
        calls.append(arguments)
        return kernels_run(*arguments)

    kernels_run = compiled.run_sessions
    monkeypatch.setattr(compiled, "run_sessions", spied)
    place = chapter.world(small)
    assert place.gate.spare_best  # of lessons in it; studies count misleads as printed
    sessions_of(AdviceSetting(small), 2, 0)
    mdp, learner, gate, advice, seeds = calls[0]
    printed = replace(place.gate, gate="never", spare_best=False)
    assert (mdp.n_states, learner, gate, advice) == (18, place.learner, printed, None)
    np.testing.assert_array_equal(seeds, seeds_of(AdviceSetting(small), 2, 0))

    setting = AdviceSetting(small, "limited", "combined", 0.2, 0.3, 2, 0.4, 1.2, "exact", "q", False)
    sessions_of(setting, 2, 0)
    _, learner, gate, advice, _ = calls[1]
    assert learner == replace(place.learner, beta=1.2, learner="q")
    assert gate == GateSettings("combined", 0.3, 2, first_episode=10, psi=0.4, judge_unhelped=False)
    assert np.flatnonzero(advice.region).tolist() == [8]  # (1 * 3 + 1) * 2
    values = optimal_values(mdp, 0.99)[0] / 0.2
    chances = np.exp(values) / np.exp(values).sum()
    np.testing.assert_allclose(advice.thresholds[0, 0], np.cumsum(chances))
    sessions_of(replace(setting, view="full"), 2, 0)
    assert calls[2][3].region.all()


def test_unhelped_episodes_count_as_misleads_unless_told_otherwise(small: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """The advisor never sees the learner: it learns the same, and who is judged all the same is soon asked no more."""
    monkeypatch.setattr(chapter, "seeds_of", lambda setting, sessions, seed: np.arange(sessions, dtype=np.uint64))
    setting = AdviceSetting(small, "limited", "ccrl", 0.01, 1.0, 1)
    judged, spared = (sessions_of(replace(setting, judge_unhelped=judge), 20, 0) for judge in (True, False))
    own = sessions_of(setting, 20, 0)
    assert own.to_json() == judged.to_json()  # the world says nothing, and the default is to judge
    assert judged.helped_steps.sum() == spared.helped_steps.sum() == 0
    assert judged.success.tolist() == spared.success.tolist()
    assert (judged.requests <= spared.requests).all()
    assert judged.requests.sum() < spared.requests.sum()


# ---- the advisor's table ------------------------------------------------------------------------------------------


def test_which_table_the_advisor_knows(small: str, monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[int | None] = []

    def told(name: str, seed: int | None) -> Any:
        asked.append(seed)
        return optimal_values(chapter.world(name).mdp(), 0.99)

    monkeypatch.setattr(chapter, "known_values", told)
    setting = AdviceSetting(small, gate="always", tau=0.1)
    for table_seed in (None, 3):
        sessions_of(replace(setting, table_seed=table_seed), 1, 0)
    sessions_of(replace(setting, advisor_table="exact"), 1, 0)
    sessions_of(AdviceSetting(small), 1, 0)
    assert asked == [chapter.LEARNED_SEED, 3, None]


def test_learned_tables(small: str) -> None:
    """Near the exact values and not the same; others with another seed."""
    place = chapter.world(small)
    table, exact = chapter.learned_table(place, 1), optimal_values(place.mdp(), 0.99)
    np.testing.assert_array_equal(table, chapter.learned_table(place, 1))
    np.testing.assert_array_equal(table, chapter.known_values(small, 1))
    assert not np.array_equal(table, chapter.learned_table(place, 2))
    assert 0.01 < np.abs(table - exact).max() < 2
    assert (table[place.mdp().terminal] == 0).all()


def test_tables_are_learned_from_anywhere(small: str) -> None:
    """Three obstacles wall (0, 2, 1) in: who stood there knows that running into the world's edge leads to no good."""
    walled = SMALL.replace("[[1, 1, 0]]", "[[1, 2, 1], [0, 1, 1], [0, 2, 0]]")
    Path(small).write_text(walled, encoding="utf-8")
    table = chapter.learned_table(chapter.world(small))
    assert table[5, 0] < -0.1  # state (0 * 3 + 2) * 2 + 1; never visited, it would be worth the step's -.1


def test_an_advisor_walks_alone(small: str) -> None:
    """One that knows the way takes its 5 steps; one that takes the worst for the best never arrives: 41."""
    place: GridWorld = chapter.world(small)
    values = optimal_values(place.mdp(), 0.99)
    assert chapter.walk_of_advisor(place, values, 0.001, 20).tolist() == [STEPS] * 20
    assert chapter.walk_of_advisor(place, -values, 0.001, 20).tolist() == [41] * 20


def test_the_example_is_a_session_that_succeeds(small: str) -> None:
    setting = AdviceSetting(small, beta=0.5)
    steps, guided = chapter.example_session(setting, 0)
    place = chapter.world(small)
    learner, seeds = replace(place.learner, beta=0.5), seeds_of(setting, 100, 0)
    batch = compiled.run_sessions(place.mdp(), learner, GateSettings("never"), None, seeds)
    first = np.flatnonzero(batch.steps[:, -1] == STEPS)[0]
    assert first > 0  # or it would be the first of all
    assert steps.tolist() == batch.steps[first].tolist()
    assert not guided.any()


# ---- where they run -----------------------------------------------------------------------------------------------


def test_the_same_from_one_process_from_two_and_from_a_cluster(few: list[AdviceSetting], cluster: str) -> None:
    one = measured(Job(sessions=5, seed=3), few)
    assert [*one] == few
    assert len({json.dumps(record) for record in plain(one).values()}) == len(few)
    assert plain(measured(Job(sessions=5, seed=3, workers=2), few)) == plain(one)
    assert plain(measured(Job(sessions=5, seed=3, dask=cluster), few)) == plain(one)


def test_a_cluster_that_is_not_there(few: list[AdviceSetting], monkeypatch: pytest.MonkeyPatch, folder: Path) -> None:
    """Nothing listens on port 9; the lab's ten seconds of patience are cut short here."""
    distributed = pytest.importorskip("distributed", reason="no Dask: install the extra 'dask'")
    client = distributed.Client
    monkeypatch.setattr(distributed, "Client", lambda address, timeout: client(address, timeout="50ms"))
    with pytest.raises(WorkFailed, match=r"^--dask 127\.0\.0\.1:9: no cluster answers there: .+$") as failed:
        measured(Job(10, dask="127.0.0.1:9", folder=folder), few)
    assert "\n" not in str(failed.value)
    assert not folder.exists()


# ---- what is kept -------------------------------------------------------------------------------------------------


def test_what_is_kept_is_not_computed_again(
    few: list[AdviceSetting], folder: Path, computed: list[AdviceSetting]
) -> None:
    job = Job(5, folder=folder)
    first = measured(job, few[:3])
    lines = [json.loads(line) for line in (folder / STORE).read_text(encoding="utf-8").splitlines()]
    assert [line["key"] for line in lines] == [setting.key(5, 0) for setting in few[:3]]
    assert [line["setting"]["beta"] for line in lines] == [0.3, 0.7, 1.1]
    assert computed == few[:3]
    again = measured(job, [few[2], few[3], few[0], few[2]])
    assert [*again] == [few[2], few[3], few[0]]
    assert computed == few[:4]
    assert plain(again)[few[0]] == plain(first)[few[0]]
    assert plain(again)[few[3]] == sessions_of(few[3], 5, 0).to_json()


def test_other_sessions_and_another_seed_are_computed(
    few: list[AdviceSetting], folder: Path, computed: list[AdviceSetting]
) -> None:
    for sessions, seed in ((5, 0), (6, 0), (5, 1)):
        (outcome,) = measured(Job(sessions, seed, folder=folder), few[:1]).values()
        assert len(outcome.success) == sessions
        assert outcome.to_json() == sessions_of(few[0], sessions, seed).to_json()
    assert computed == few[:1] * 3
    measured(Job(5, 0, folder=folder), few[:1])
    assert len(computed) == 3


FOREIGN = [
    '{"key": [], "success": [1], "helped_steps": [1], "requests": [1]}',
    "[" * 200_000,
    "",
    "not JSON",
    "3",
    "null",
    "[1, 2]",
    '"key"',
    "{}",
    '{"key": "of another study", "success": [1], "helped_steps": [0], "requests": [0]}',
    '{"key": "KEY"}',
    '{"key": "KEY", "success": ["?"], "helped_steps": [0], "requests": [0]}',
    f'{{"key": "KEY", "success": [{10**30}], "helped_steps": [0], "requests": [0]}}',
    "\udcff no UTF-8",
]


def test_what_is_not_ours_is_passed_over(few: list[AdviceSetting], folder: Path, computed: list[AdviceSetting]) -> None:
    """Lines of anything, also such as name our setting, before and after our own."""
    job = Job(5, folder=folder)
    found, text = measured(job, few[:1]), (folder / STORE).read_bytes()
    lines = "\n".join(FOREIGN).replace("KEY", few[0].key(5, 0))
    foreign = lines.encode("utf-8", "surrogateescape") + b"\n"
    (folder / STORE).write_bytes(foreign + text + foreign)
    assert plain(measured(job, few[:1])) == plain(found)
    assert computed == few[:1]
    (folder / STORE).write_bytes(foreign)
    assert plain(measured(job, few[:1])) == plain(found)
    assert computed == few[:1] * 2
    assert (folder / STORE).read_bytes() == foreign + text


def test_a_line_that_was_cut_is_computed_again(
    few: list[AdviceSetting], folder: Path, computed: list[AdviceSetting]
) -> None:
    """What comes next does not stick to it."""
    job = Job(5, folder=folder)
    found, text = measured(job, few[:2]), (folder / STORE).read_text(encoding="utf-8")
    (folder / STORE).write_text(text[:-30], encoding="utf-8")
    assert plain(measured(job, few[:3])) == plain(found) | {few[2]: sessions_of(few[2], 5, 0).to_json()}
    assert computed == [*few[:2], *few[1:3]]
    first, *rest = (folder / STORE).read_text(encoding="utf-8").splitlines()
    assert first == text.splitlines()[0]
    assert [json.loads(line)["key"] for line in rest] == [setting.key(5, 0) for setting in few[1:3]]
    measured(job, few[:3])
    assert len(computed) == 4


def test_ctrl_c_keeps_what_is_done(few: list[AdviceSetting], folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    whole = measured(Job(5), few)
    job, done = Job(5, folder=folder), list[AdviceSetting]()

    def stopped(setting: AdviceSetting, sessions: int, seed: int) -> AdviceOutcome:
        if setting == few[2] and len(done) == 2:
            raise KeyboardInterrupt
        done.append(setting)
        return sessions_of(setting, sessions, seed)

    monkeypatch.setattr(chapter, "sessions_of", stopped)
    with pytest.raises(KeyboardInterrupt):
        measured(job, few)
    assert len((folder / STORE).read_text(encoding="utf-8").splitlines()) == 2
    monkeypatch.setattr(chapter, "sessions_of", sessions_of)
    told: list[tuple[int, int]] = []
    assert plain(measured(replace(job, progress=lambda *both: told.append(both)), few)) == plain(whole)
    assert told == [(2, 6), (3, 6), (4, 6), (5, 6), (6, 6)]


def test_without_a_folder_nothing_is_written(
    few: list[AdviceSetting], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, computed: list[AdviceSetting]
) -> None:
    (tmp_path / "empty").mkdir()
    monkeypatch.chdir(tmp_path / "empty")
    for _ in range(2):
        measured(Job(5), few[:1])
    assert computed == few[:1] * 2
    assert [*Path().iterdir()] == []


@pytest.mark.parametrize("spoil", [Path.touch, lambda folder: (folder / STORE).mkdir(parents=True)])
def test_a_folder_that_cannot_be_written(few: list[AdviceSetting], folder: Path, spoil: Callable[[Path], None]) -> None:
    spoil(folder)
    with pytest.raises(WorkFailed, match=r"^output folder '.+' \(--out\) cannot be written: "):
        measured(Job(5, folder=folder), few[:1])


def test_nothing_to_do(folder: Path) -> None:
    told: list[tuple[int, int]] = []
    assert measured(Job(folder=folder, workers=2, progress=partial(_tell, told)), []) == {}
    assert told == [(0, 0)]
    assert not folder.exists()


def _tell(told: list[tuple[int, int]], done: int, total: int) -> None:
    told.append((done, total))
