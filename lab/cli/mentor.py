"""`lab mentor`: when a robot's policy should ask, from its recorded episodes."""

from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import typer

from lab.cli import deferred
from lab.cli.families import from_files, offers
from lab.cli.options import Json, Seed
from lab.cli.output import console, show
from lab.errors import BadInput, counted, shortened
from lab.lazy import rich


def mentor(
    dataset: Annotated[Path, typer.Argument(help="The folder of a LeRobot dataset (format v3).")],
    report: Annotated[
        Path | None, typer.Option("--report", help="File (.html) for a page with curves, episodes and pictures.")
    ] = None,
    window_s: Annotated[
        float,
        typer.Option("--window", min=0.01, max=600, help="Seconds before a takeover in which an alarm warns of it."),
    ] = 3.0,
    false_alarms: Annotated[
        float, typer.Option("--false-alarms", help="Share of the episodes without need in which a rule may ask.")
    ] = 0.1,
    keep: Annotated[
        Path | None,
        typer.Option("--keep", help="File for a mentor that has learned from DATASET, calibrated by --rollouts."),
    ] = None,
    rollouts: Annotated[
        Path | None,
        typer.Option("--rollouts", help="For --keep: a dataset of the policy's rollouts without a teacher."),
    ] = None,
    failed: Annotated[
        str | None,
        typer.Option(
            "--failed",
            help="For --keep: the episodes of --rollouts that failed, such as 0,7, or none; where the dataset does not say.",
        ),
    ] = None,
    rule: Annotated[
        str | None,
        typer.Option(
            "--rule",
            help="For --keep, the measure of doubt: {doubts}; default: distance; without --keep, './mine.py:MyRule' to compare.",
            autocompletion=offers("doubts"),
            callback=from_files("doubts"),
        ),
    ] = None,
    seed: Seed = 0,
    as_json: Json = False,
) -> None:
    """Compare where rules would have asked with where a person took over in a recording, or keep a mentor for your policy.

    Takeovers are steps that the dataset marks by its feature 'intervention'.
    """
    if (keep is None) != (rollouts is None):
        raise BadInput("--keep and --rollouts: wanted both, or neither")
    if failed is not None and rollouts is None:
        raise BadInput(f"--failed {shortened(failed)} without --rollouts: it says which of these episodes failed")
    deferred.check_share("share", false_alarms, "--false-alarms")
    if rule is not None:
        deferred.check_rule(rule, "--rule")
        if keep is None and not deferred.DOUBTS.is_added(rule):
            raise BadInput(f"--rule {rule} without --keep: only a rule of your own joins those compared: remove --rule")
    rules = deferred.RULES if rule is None else (*deferred.RULES, rule)
    if keep is not None and report is not None:
        raise BadInput("--report beside --keep: a report compares rules: leave one of them away")
    for path, option in ((report, "--report"), (keep, "--keep")):
        if path is not None and (path.is_dir() or not path.parent.is_dir()):
            raise BadInput(f"file '{path}' ({option}): wanted a file in a folder that exists")
    recording = deferred.read_recording(dataset)
    if keep is not None and rollouts is not None:
        alone = _rolled_out(rollouts, failed, recording)
        show(_kept(recording, alone, keep, rule or "distance", false_alarms, seed), as_json, _kept_summary)
        return
    with deferred.counting(console(), "rules compared") as progress:
        done = iter(range(len(rules)))
        compared = deferred.rules_compared(
            recording,
            rules=rules,
            window_s=window_s,
            false_alarms=false_alarms,
            seed=seed,
            progress=lambda name: progress(next(done), len(rules)),
        )
    document = deferred.report_document(compared) | {"report": None if report is None else str(report)}
    if report is not None:
        deferred.write_text(report, deferred.report_page(compared, dataset.resolve().name))
    show(document, as_json, lambda _: _summary(compared, report))


def _rolled_out(rollouts: Path, failed: str | None, recording: Any) -> Any:
    """The rollouts of the policy, and which of them failed, if that was said."""
    alone = deferred.read_recording(rollouts)
    for name in ("fps", "state_names", "action_names"):
        shown, rolled = getattr(recording, name), getattr(alone, name)
        if shown != rolled:
            raise BadInput(
                f"--rollouts '{rollouts}': {name} {shortened(rolled)}: wanted {shortened(shown)}, as DATASET has"
            )
    if failed is None:
        return alone
    known = [str(number) for number in range(len(alone.episodes))]
    named = [word.strip() for word in failed.split(",")] if failed != "none" else []
    wrong = next((word for word in named if word not in known), None)
    if wrong is not None:
        raise BadInput(
            f"'{shortened(wrong)}' (--failed): wanted numbers of episodes from 0 to {len(known) - 1}, such as 0,7, or none"
        )
    marked = [
        replace(episode, success=number not in named) for number, episode in zip(known, alone.episodes, strict=True)
    ]
    return replace(alone, episodes=marked)


def _kept(recording: Any, alone: Any, keep: Path, rule: str, false_alarms: float, seed: int) -> dict[str, Any]:
    """The document of a mentor, after it was learned, calibrated and written."""
    learned, others = deferred.parted(rule, alone.episodes)
    made = deferred.Mentor.learn(recording, rule, rollouts=learned, seed=seed)
    made.calibrate(others, false_alarms=false_alarms)
    made.save(keep)
    promise = made.promise
    assert promise is not None
    return {
        "mentor": str(keep),
        "rule": rule,
        "threshold": promise.threshold,
        "false_alarms": promise.share,
        "expected": promise.expected,
        "in_95": promise.in_95,
        "successes": promise.episodes,
    }


def _kept_summary(document: dict[str, Any]) -> "rich.console.RenderableType":
    return rich.text.Text(
        f"{document['mentor']}: asks where the doubt by '{document['rule']}' is above {document['threshold']:.3g}\n"
        f"promised: of the episodes that would succeed, at most {100 * document['false_alarms']:g} % with a question, by "
        f"{counted(document['successes'], 'success')}; on average {100 * document['expected']:.1f} %, and in 95 % of such "
        f"calibrations below {100 * document['in_95']:.1f} %"
    )


def _summary(compared: "deferred.RulesCompared", report: Path | None) -> "rich.console.RenderableType":
    table = rich.table.Table(box=None, pad_edge=False)
    for number, name in enumerate(deferred.COLUMNS):
        table.add_column(name, justify="right" if number else "left")
    for line in deferred.table_lines(compared):
        table.add_row(*line)
    below = [
        f"a takeover was warned of, and an alarm right, if the alarm began in the {compared.window_s:g} s before it",
        "by chance: as many alarms at random steps",
        *compared.notes,
        *([f"page: {report}"] if report else []),
    ]
    return rich.console.Group(table, rich.text.Text("\n".join(below)))
