"""Which printed figures were used to choose what the thesis leaves open: agreement with these shows less.

World I: the seed of the advisor's learned table (`chapter_9_sessions.LEARNED_SEED`) was chosen among 36 by how near all
of world I comes. World II: its layout and views were chosen (`world_2`). Chapter 7: reward factors of type A.
"""

RECONSTRUCTED_BY = (0.01, 1.0)  # tau of the advisors whose cells chose world II: see `world_2.is_compared`
ALL_ADVISORS = "all"  # the tau of a line that averages over the four
DECAY_TABLE = "Table IV.1"
SAYS = {
    "world-1": "Used to choose the advisor's table: every advised cell of world I.",
    "world-2": (
        "Used to choose the reconstruction: of world II the cells of experts and novices, averages over all advisors, the "
        "scores of these, and the 37 % of figure 9.4."
    ),
}
SAYS_7 = (
    "Used to choose: table IV.1, which shows that its factor is of type A, and the cells of type A with four toasts, whose "
    "numbers were chosen by them."
)


def is_used(world: str, tau: float | str | None) -> bool:
    """Whether the printed figures of a line of chapter 9 were used, SP, HS and score alike.

    tau: of the advisor, ALL_ADVISORS, or None where nobody advises; of those figure 9.4's best success is printed, and
    world II's was used. One line of table 9.5 (novice, Lambda .9) that Appendix V has not counts as the others of its advisor.
    """
    if world == "world-1":
        return tau is not None
    return tau in (*RECONSTRUCTED_BY, ALL_ADVISORS, None)


def is_used_7(table: str, reward_factor: str | None, toasts: int) -> bool:
    """Whether the printed figures of a line of chapter 7 were used."""
    return reward_factor == "A" and (table == DECAY_TABLE or toasts == 4)
