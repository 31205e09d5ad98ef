"""The printed values that were used to choose what the thesis leaves open: agreement with these shows less.

World I: the seed of the advisor's learned table (`chapter_9_sessions.LEARNED_SEED`) was chosen among 36 as the one with
which all of world I comes nearest. World II: its layout and views were chosen (`world_2`). Chapter 7: reward factors of
type A were chosen.
"""

RECONSTRUCTED_BY = (0.01, 1.0)  # the taus of advisors whose cells chose world II, see `world_2.is_compared`
ALL_ADVISORS = "all"  # the tau of a line that averages over the four
DECAY_TABLE = "Table IV.1"
SAYS = {
    "world-1": "The advisor's table was chosen by every advised cell of world I.",
    "world-2": (
        "The reconstruction of world II was chosen by its cells of experts and novices, the averages over all advisors, the "
        "scores of these, and the 37 % of figure 9.4."
    ),
}
SAYS_7 = (
    "Table IV.1 was used to choose its factor, type A, and the cells of type A with four toasts were used to choose their a and "
    "b."
)


def is_used(world: str, tau: float | str | None) -> bool:
    """Whether the printed values of a line of chapter 9 were used for choices, SP, HS and score alike.

    tau: the advisor's, ALL_ADVISORS, or None if nobody advises, for which the best success of figure 9.4 is printed and world
    II's was used. One line of table 9.5 (novice, Lambda .9) that Appendix V lacks counts as the others of its advisor.
    """
    if world == "world-1":
        return tau is not None
    return tau in (*RECONSTRUCTED_BY, ALL_ADVISORS, None)


def is_used_7(table: str, reward_factor: str | None, toasts: int) -> bool:
    """Whether the printed values of a line of chapter 7 were used for choices."""
    return reward_factor == "A" and (table == DECAY_TABLE or toasts == 4)
