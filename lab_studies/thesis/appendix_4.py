"""Figures IV.1 to IV.3 of Appendix IV: the best order of three toasts as a Gantt chart, and the tree that proves it."""

from lab.sequencing.simulate.follow import simulate
from lab.view.gantt import gantt_picture
from lab_studies.thesis.branch_and_bound import branch_and_bound
from lab_studies.thesis.chapter_7_cells import robot_cell
from lab_studies.thesis.search_tree import branch_picture, branches_of

CASE, TOASTS = "II", 3


def pictures() -> dict[str, bytes]:
    """The three figures as SVG bytes by caption. Source: thesis App. IV."""
    cell = robot_cell(CASE, TOASTS)
    tree = branch_and_bound(cell)
    branches = branches_of(cell, ((node.decisions, node.end) for node in tree.nodes), tree.optimal)
    title = f"Case {CASE}, {TOASTS} toasts, alike ones counted as one: {len(tree.nodes)} nodes"
    return {
        "Figure IV.1: the best order as a Gantt chart": gantt_picture(simulate(cell, tree.optimal)),
        "Figure IV.2: the branch and bound tree": branch_picture(branches, title=title),
        "Figure IV.3: the way to the optimum, and what branches off it": branch_picture(
            branches, title=title, near=True
        ),
    }
