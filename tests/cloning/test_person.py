"""A person as the teacher: asked once a takeover, told where the part is, obeyed in physics."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from devtools.told_teacher import by_the_words
from lab.cloning.kept_cloning import KeptOptions, options_of, rounds_of
from lab.cloning.person import PersonRollouts, PersonTeacher, Situation, situation
from lab.cloning.rounds import CloningOptions
from lab.cloning.skill_problem import SkillProblem
from lab.cloning.takeover_command import TakeoverCommand, command_of
from lab.control import ControlEnv
from lab.errors import BadInput, WorkFailed
from lab.mentor.mentor import Question

STEPS = 10


@pytest.fixture(scope="module")
def problem() -> Iterator[SkillProblem]:
    made = SkillProblem("toast", "grasp", noise=0.0, seconds=8.0)
    yield made
    made.close()


def test_one_command_is_obeyed_for_a_takeover(problem: SkillProblem) -> None:
    env, told = problem.env, list[Situation]()
    env.reset(seed=3)

    def ask(seen: Situation) -> TakeoverCommand:
        told.append(seen)
        return command_of("ahead 5 up 2")

    teacher, before = PersonTeacher(env, STEPS, ask), env.tool
    for _ in range(STEPS):
        env.step(teacher(None))
    assert len(told) == 1
    moved = np.hypot(env.tool.x - before.x, env.tool.y - before.y)
    assert moved == pytest.approx(0.05, abs=0.012)  # it speeds up and has not come to rest
    assert env.tool.z - before.z == pytest.approx(0.02, abs=0.006)
    teacher(None)
    assert len(told) == 2


def test_the_situation_tells_where_the_part_is(problem: SkillProblem) -> None:
    env = problem.env
    env.reset(seed=3)
    state = dict(zip(env.state_names, env.state().tolist(), strict=True))
    told = situation(env, "because")
    ahead = state["part ahead"]
    assert told.why == "because"
    assert f"{abs(100 * ahead):.1f} cm {'ahead' if ahead >= 0 else 'back'}" in told.where
    assert "open; nothing touches them" in told.fingers


def test_a_session_with_a_person_keeps_each_episode_and_goes_on(problem: SkillProblem, tmp_path: Path) -> None:
    options = CloningOptions(
        demonstrations=1,
        rounds=1,
        questions=4,
        calibrated=1,
        episodes=4,
        evaluated=1,
        epochs=2,
        rule="clock",
        every_steps=20,
    )
    kept, folder, answers = KeptOptions(problem, options), tmp_path / "session", 0

    def leaves(seen: Situation) -> TakeoverCommand:
        nonlocal answers
        answers += 1
        if answers == 4:
            raise WorkFailed("gone")
        assert "clock" in seen.why
        return command_of("wait")

    with pytest.raises(WorkFailed, match="gone"):
        [*rounds_of(kept, folder, PersonRollouts(problem, STEPS, leaves))]
    (name,) = (path.name for path in (folder / "begun-1").iterdir())
    assert name == "0-3"  # the first episode, with three questions

    after = 0

    def stays(seen: Situation) -> TakeoverCommand:
        nonlocal after
        after += 1
        return command_of("teacher")

    *_, last = rounds_of(options_of(folder), folder, PersonRollouts(problem, STEPS, stays))
    assert (after, last.questions) == (1, 4)
    assert not (folder / "begun-1").exists()
    assert len(last.corrections) == 2


def test_a_person_demonstrates_by_what_they_are_told_and_a_failed_one_does_not_count(
    problem: SkillProblem, tmp_path: Path
) -> None:
    options = CloningOptions(demonstrations=2, rounds=0, calibrated=1, evaluated=1, epochs=2, rule="never")
    kept, folder, told = KeptOptions(problem, options, "person"), tmp_path / "session", list[Situation]()

    def leaves(seen: Situation) -> TakeoverCommand:
        """Waits through the first episode, gives the second one, and leaves in the third."""
        told.append(seen)
        if "2 of 2" in seen.demonstration:
            raise WorkFailed("gone")
        return command_of("wait") if not seen.why else by_the_words(seen)

    with pytest.raises(WorkFailed, match="gone"):
        [*rounds_of(kept, folder, PersonRollouts(problem, STEPS, leaves))]
    assert any("does not count" in seen.why for seen in told)
    (name,) = (path.name for path in (folder / "begun-demonstrations").iterdir())
    assert name.startswith("1-")  # of the second seed

    with pytest.raises(BadInput, match="--teacher"):
        next(rounds_of(options_of(folder), folder))
    after = list[str]()

    def stays(seen: Situation) -> TakeoverCommand:
        after.append(seen.demonstration)
        return by_the_words(seen)

    (begun,) = rounds_of(options_of(folder), folder, PersonRollouts(problem, STEPS, stays))
    assert {*after} == {"Demonstration 2 of 2"}
    assert [episode.success for episode in begun.demonstrations.episodes] == [True, True]
    assert not any(episode.corrected.any() for episode in begun.demonstrations.episodes)
    assert not (folder / "begun-demonstrations").exists()
    assert len([*rounds_of(options_of(folder), folder)]) == 1  # once they are there, the script can go on


def test_a_person_is_told_what_ends_an_episode_well() -> None:
    for skill, wanted in (
        ("grasp", "lifted by 3 cm"),
        ("place", "open fingers 3 cm above"),
        ("transfer", "1.5 cm and 5.7"),
    ):
        env = ControlEnv("toast", skill)
        env.reset(seed=3)
        told = situation(env, "")
        assert wanted in told.wanted
        assert wanted in str(told)
        assert ("between the fingers" in told.wanted) == (skill == "transfer")
        env.close()


def test_a_person_who_always_fails_is_not_asked_for_ever(
    problem: SkillProblem, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("lab.cloning.person.TRIES", 2)
    options = CloningOptions(demonstrations=1, rounds=0, calibrated=1, evaluated=1, epochs=2)
    waits = PersonRollouts(problem, STEPS, lambda seen: TakeoverCommand())
    with pytest.raises(WorkFailed, match=r"0 of 1 demonstrations .* 2 episodes"):
        next(rounds_of(KeptOptions(problem, options, "person"), None, waits))


def test_the_person_hears_why(problem: SkillProblem) -> None:
    person = PersonRollouts(problem, STEPS, lambda seen: TakeoverCommand())
    person.hear(Question(True, 2.0, 1.0, "distance"))
    assert "distance" in person.teacher.why
