"""Grips computed from the shapes of parts that others made, tested in physics."""

from collections.abc import Mapping, Sequence
from math import degrees
from typing import TYPE_CHECKING, Any

import numpy as np

from lab.sim.arms.arm_models import arm_of
from lab.sim.parts.grip import BESIDE_M
from lab.studies.findings import Findings, Row, row, share_row
from lab.studies.runner import Job
from lab.view.canvas import BLUE, GREY, INK, PALE_GREY, RED, picture_bytes
from lab_studies.comparisons.grip_models import FITTED_M, FRICTION, GRASPABLE_M, MASS_KG, MODELS
from lab_studies.comparisons.grip_trials import (
    ARM,
    CARRY_M,
    HEADINGS,
    NEAR_M,
    ROLLED_M,
    Outcome,
    Setting,
    model_outcome,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLUMNS = 5  # of the picture
CAPTION = "Widths by heading; grey: what the gripper takes; dots: the grips"
ABOUT = (
    f"{len(MODELS)} models of pybullet_data and trimesh, {MASS_KG} kg each, friction {FRICTION}; each stands as it comes "
    f"to rest in physics. A model keeps its own size if the middle one of its three extents is at most {GRASPABLE_M} m, else "
    f"it is scaled until that is {FITTED_M} m. Physics uses convex hulls, as for every part with a mesh."
)
POSES = (
    f"{{}} poses of each: a part is taken from above, lifted, carried {CARRY_M} m, turned by up to a quarter turn, set down and "
    f"released. It arrives if it stands within {NEAR_M} m of its place a second later; a part without an upright pose, such as "
    f"a ball, if it lies within {ROLLED_M} m. Both places and yaws are drawn from the seed."
)


def grips(job: Job, reading: Mapping[str, Any]) -> Findings:
    """The results of some poses of each model; the reading has no effect."""
    settings = [Setting(model.name, job.sessions, job.seed) for model in MODELS]
    outcomes = {setting.model: outcome for setting, outcome in job.each(model_outcome, settings).items()}
    rows = [result for name, outcome in outcomes.items() for result in rows_of(name, outcome)]
    arrived = [not why for outcome in outcomes.values() for why in outcome.failures]
    if arrived:
        rows.append(share_row({"part": "all that can be gripped"}, "arrived_percent", arrived))
    refusals = [f"Refused: {outcome.refused}." for outcome in outcomes.values() if outcome.refused]
    figures = {CAPTION: _picture(outcomes)}
    return Findings(rows, in_short(outcomes), figures, (ABOUT, POSES.format(job.sessions), *refusals))


def rows_of(name: str, outcome: Outcome) -> list[Row]:
    """The rows of one model: whether it is graspable, and the share of its poses that arrived."""
    low, high = min(outcome.widths_m), max(outcome.widths_m)
    named: Row = {"part": name, "narrowest_m": round(low, 4), "widest_m": round(high, 4)}
    named["high_m"] = round(outcome.edges_m[2], 4)
    if outcome.grip is None:
        return [row(named | {"refused": outcome.refused}, "graspable", 0)]
    own: Row = {"yaw": round(outcome.grip.yaw, 3), "up_m": round(outcome.grip.up_m, 4)}
    own |= {"width_m": round(outcome.grip.width_m, 4), "failures": "; ".join(sorted({*outcome.failures} - {""}))}
    off = [off_m for off_m, why in zip(outcome.off_m, outcome.failures, strict=True) if not why]
    rows = [
        row(named | own, "graspable", 1),
        share_row(named, "arrived_percent", [not why for why in outcome.failures]),
    ]
    return rows + ([row(named, "largest_off_m", max(off))] if off else [])


def in_short(outcomes: Mapping[str, Outcome]) -> Row:
    """The number of models that can be gripped, the share of their poses that arrived, and the models that failed in some."""
    gripped = {name: outcome for name, outcome in outcomes.items() if not outcome.refused}
    poses = [why for outcome in gripped.values() for why in outcome.failures]
    says: Row = {"parts": len(outcomes), "graspable": len(gripped), "poses": len(poses)}
    says["arrived"] = sum(not why for why in poses)
    says["arrived_percent"] = round(100 * says["arrived"] / len(poses), 2) if poses else None
    says["refused"] = ", ".join(name for name in outcomes if name not in gripped) or "none"
    says["not always"] = ", ".join(name for name, outcome in gripped.items() if any(outcome.failures)) or "none"
    return says


def _picture(outcomes: Mapping[str, Outcome]) -> bytes:
    """A small plot for each part: its width across each heading, what the gripper takes, and the grip."""
    most = 1000 * (arm_of(ARM).gripper.opening_m - 2 * BESIDE_M)
    lines = -(-len(outcomes) // COLUMNS)

    def draw(figure: "Figure") -> None:
        every: Sequence[Axes] = figure.subplots(lines, COLUMNS, sharex=True, squeeze=False).ravel().tolist()
        for number, (axes, (name, outcome)) in enumerate(zip(every, outcomes.items(), strict=False)):
            _draw(axes, name, outcome, most)
            if number % COLUMNS == 0:
                axes.set_ylabel("width [mm]")
            if number >= len(outcomes) - COLUMNS:
                axes.set(xlabel="heading [degrees]", xticks=(0, 90, 180))
                axes.tick_params(labelbottom=True)
        for axes in every[len(outcomes) :]:
            axes.set_axis_off()

    return picture_bytes(draw, 10.0, 0.6 + 1.75 * lines)


def _draw(axes: "Axes", name: str, outcome: Outcome, most: float) -> None:
    headings = np.arange(HEADINGS + 1) * 180 / HEADINGS
    widths = 1000 * np.array([*outcome.widths_m, outcome.widths_m[0]])
    axes.axhspan(0, most, color=PALE_GREY, linewidth=0)
    axes.axhline(most, color=GREY, linewidth=0.8, linestyle="--")
    axes.plot(headings, widths, color=BLUE, linewidth=1.4)
    if outcome.grip is None:
        why, colour = f"refused, {1000 * outcome.edges_m[2]:.0f} mm high", RED
    else:
        axes.plot(degrees(outcome.grip.yaw) % 180, 1000 * outcome.grip.width_m, "o", color=INK, markersize=5, zorder=3)
        arrived = sum(not why for why in outcome.failures)
        why, colour = f"{arrived} of {len(outcome.failures)} arrived", INK if arrived == len(outcome.failures) else RED
    axes.set_title(name, fontsize=9)
    axes.text(0.97, 0.06, why, color=colour, fontsize=8, ha="right", transform=axes.transAxes)
    axes.set(xlim=(0, 180), ylim=(0, 1.08 * max(float(widths.max()), most)))
