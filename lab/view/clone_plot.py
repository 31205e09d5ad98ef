"""The picture of a cloning session: the students' success by the questions that they have asked."""

from collections.abc import Sequence
from pathlib import Path

from lab.lazy import matplotlib
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
        before = 0.0
        for number, (asked, (share, _, _)) in enumerate(zip(questions, shares, strict=True)):
            label = (-5, 5 if share >= before else -12)  # beside the line from the round before
            axes.annotate(f"round {number}", (asked, share), label, textcoords="offset points", fontsize=8, ha="right")
            before = share
        axes.set(xlabel="questions", ylabel=f"successes of {len(successes[0])} episodes [%]", ylim=(0, 105))
        axes.set_title(title)
        axes.margins(x=0.16)
        axes.xaxis.set_major_locator(matplotlib.ticker.MaxNLocator(integer=True))
        axes.grid()
