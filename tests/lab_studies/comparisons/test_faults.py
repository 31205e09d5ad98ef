"""The study of drawn faults: real runs, the same again, kept and not run twice; its rows add up."""

from pathlib import Path

import pytest

from lab.studies.runner import Job
from lab_studies.comparisons.faults import (
    CAME,
    RunOutcome,
    Setting,
    _Clock,
    faults,
    in_short,
    measured,
    rows_of,
    run_outcome,
)

RAN = RunOutcome(
    "delivered", "", "", [{"what": "part gone", "noticed": "it is gone"}], [], ["part gone"], 2, 2, 100.0, 90.0, 1.0
)


@pytest.mark.slow
def test_a_run_with_drawn_faults_is_the_same_again() -> None:
    """Two toasts in physics with the faults of seed 4, twice."""
    one, two = run_outcome(Setting("toast", 4)), run_outcome(Setting("toast", 4))
    assert one.came in CAME
    assert one.drawn
    assert (one.rows, one.failure, one.makespan_s) == (two.rows, two.failure, two.makespan_s)


def test_what_the_folder_holds_is_not_run_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    job, settings = Job(sessions=2, folder=tmp_path), [Setting("toast", 0), Setting("sorting", 1)]
    monkeypatch.setattr("lab_studies.comparisons.faults.run_outcome", lambda setting: RAN)
    first = measured(job, settings)
    with (tmp_path / "sessions.jsonl").open("a") as store:
        store.write('{"setting": {"task": "toast"}, "ran": {}}\n{"cut')
    monkeypatch.setattr("lab_studies.comparisons.faults.run_outcome", lambda setting: pytest.fail(f"{setting} again"))
    assert measured(job, settings) == first == dict.fromkeys(settings, RAN)


def test_sessions_are_shared_out_over_the_tasks_each_with_its_seed(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[Setting] = []

    def ran(setting: Setting) -> RunOutcome:
        asked.append(setting)
        return RAN

    monkeypatch.setattr("lab_studies.comparisons.faults.run_outcome", ran)
    found = faults(Job(sessions=9, seed=5), {})
    assert len({one.task for one in asked}) == 7
    assert sorted(one.seed for one in asked) == list(range(5, 14))
    assert found.summary["runs"] == found.summary["delivered"] == 9
    assert found.summary["wrong"] == 0
    assert all(picture.startswith(b"<?xml") for picture in found.figures.values())


def test_rows_add_up_to_all_runs() -> None:
    wrong = RunOutcome("wrong", "no fault explains: x", "x", [], [], ["part gone"], 1, 2, 100.0, 90.0, 1.0)
    rows = rows_of("task", {"toast": [RAN, RAN, RAN, wrong]})
    values = {one["measure"]: one["value"] for one in rows}
    assert (values["delivered_percent"], values["stopped_percent"], values["wrong_percent"]) == (75.0, 0.0, 25.0)
    assert values["noticed_percent"] == 100.0
    assert values["parts_delivered_percent"] == pytest.approx(700 / 8)
    assert in_short([RAN, wrong])["delivered or stopped percent"] == 50.0


def test_a_run_that_does_not_end_is_ended() -> None:
    from lab.sim.frames import Frame

    clock = _Clock(10.0)
    clock.update(Frame(9.0, {}))
    with pytest.raises(Exception, match="after 11 s"):
        clock.update(Frame(11.0, {}))
