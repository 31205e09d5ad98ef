"""The study of mentors, in small: it learns policies, calibrates and holds rules against chance at equal questions."""

from lab_studies.comparisons.mentor import CHANCE, FIXED, SHARES, Place, layout_tally, rows_of


def test_rules_are_held_against_chance_at_equal_questions() -> None:
    found = layout_tally(Place("lava"), 2, 0)
    assert {rule for rule, _ in found} == {*FIXED, CHANCE, "always", "never", "fixed threshold"}
    assert all(len(solved) == len(questions) == 2 for solved, questions in found.values())
    rows = rows_of("lava", found)
    always, never = (
        next(one["value"] for one in rows if one["rule"] == rule and one["measure"] == "solved_percent")
        for rule in ("always", "never")
    )
    assert never <= always
    assert always > 90.0
    asked = [one["value"] for one in rows if one["rule"] == CHANCE and one["measure"] == "questions"]
    assert len(asked) == len(SHARES)
    assert asked[0] < asked[-1]
    assert sum(one["measure"] == "gain_percent" for one in rows) == len(FIXED) * len(SHARES) + 1
