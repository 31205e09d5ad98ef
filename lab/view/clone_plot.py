"""The picture of a cloning session: the students' success by the questions that they have asked."""

from collections.abc import Sequence
from pathlib import Path

from lab.statistics import proportion_interval
from lab.view.canvas import BLUE, INK, picture_file


def success_by_questions(successes: Sequence[Sequence[bool]], questions: Sequence[int], title: str, path: Path) -> None:
    """Draws the share of successful episodes after each round, with its Wilson interval, to a PNG or SVG file.

    successes: of each round's episodes; questions: up to each round. Raises BadInput as `picture_file` does.
    """
    shares = [proportion_interval(sum(episodes), len(episodes)) for episodes in successes]
    with picture_file(path, 5.6, 3.4) as figure:
        axes = figure.add_subplot()
        axes.vlines(questions, [low for _, low, _ in shares], [high for _, _, high in shares], color=INK, linewidth=1.2)
        axes.plot(questions, [share for share, _, _ in shares], "o-", color=BLUE, markersize=6)
        for number, (asked, (share, _, _)) in enumerate(zip(questions, shares, strict=True)):
            axes.annotate(f"round {number}", (asked, share), (5, 5), textcoords="offset points", fontsize=8)
        axes.set(xlabel="questions", ylabel=f"successes of {len(successes[0])} episodes [%]", ylim=(0, 105))
        axes.set_title(title)
        axes.margins(x=0.12)
        axes.grid()
