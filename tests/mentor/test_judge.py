"""The judge of takeovers, told of steps left to the end."""

from lab.mentor.judge import Judge


def tell(judge: Judge, alone: list[float], taken: list[float], after: float) -> None:
    """Tells of an episode: the steps left before each of the policy's steps, before each of the teacher's, and after them."""
    judge.begin()
    by_teacher = [False] * len(alone) + [True] * len(taken) + [False]
    gave_last = False
    for left, given in zip([*alone, *taken, after], by_teacher, strict=True):
        judge.saw(left, gave_last)
        gave_last = given
    judge.saw(after, corrected=False)


def test_a_takeover_helps_that_is_faster_than_the_policy_was() -> None:
    judge = Judge()
    tell(judge, [10, 10, 10], [10, 9], 8)
    assert (judge.helped, judge.judged) == (1, 1)
    tell(judge, [10, 9, 8], [7, 7], 7)  # the policy was faster
    assert (judge.helped, judge.judged) == (1, 2)


def test_a_takeover_at_the_first_step_is_held_against_standing_still() -> None:
    judge = Judge()
    tell(judge, [], [10, 9], 8)
    assert (judge.helped, judge.judged) == (1, 1)
    tell(judge, [], [10, 10], 10)
    assert (judge.helped, judge.judged) == (1, 2)


def test_a_takeover_that_ends_with_its_episode_is_not_judged() -> None:
    judge = Judge()
    judge.saw(10, corrected=False)
    judge.saw(9, corrected=True)
    judge.begin()
    judge.saw(10, corrected=False)
    judge.saw(10, corrected=False)
    assert judge.judged == 0


def test_teachers_who_mislead_are_rejected_and_others_are_not() -> None:
    misleads, helps, mixed = Judge(), Judge(), Judge()
    for number in range(20):
        tell(misleads, [5, 5], [5, 6], 7)
        tell(helps, [5, 5], [5, 4], 3)
        tell(mixed, [5, 5], *(([5, 4], 3) if number % 2 else ([5, 6], 7)))  # type: ignore[arg-type]
        assert misleads.rejects == (number >= 5)  # 1 / 64 < 0.02 <= 1 / 32
    assert not helps.rejects
    assert not mixed.rejects
