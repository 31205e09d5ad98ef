"""A session of `lab sequence` from its options: the check before anybody is asked, and its document."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from lab.learning.requests import Ask
from lab.production.sequencing_job import SequencingOptions, check_named, sequence_named
from lab.teaching.kept_order import OrderSession, OrderSessionOptions
from lab.teaching.teacher import Teacher
from lab.toolbox.registry import Toolbox


def sequencing_options(options: OrderSessionOptions) -> SequencingOptions:
    """What the options of a session ask for. Raises BadInput for an unknown advisor."""
    return SequencingOptions(
        method=options.method,
        episodes=options.episodes,
        objective=options.objective,
        sessions=options.sessions,
        seed=options.seed,
        stochastic=options.stochastic,
        advisor=options.asked,
        gate=options.gate,
        parts=options.parts,
        layout=options.beside.layout,
        robots=options.robots,
        policy=None if options.policy is None else Path(options.policy),
        seconds=options.seconds,
        gap=options.gap,
        practice=options.practice,
        keep_policy=options.keep_policy,
    )


def check_order_session(options: OrderSessionOptions, toolbox: Toolbox) -> None:
    """Raises BadInput for options that a session would refuse; nothing is learned or measured."""
    check_named(options.task, options.case, options.toasts, sequencing_options(options), toolbox)


def sequenced(
    kept: OrderSession, people: Mapping[str, Ask], teacher: Teacher, files: Mapping[str, Path] | None = None
) -> dict[str, Any]:
    """The document of a session of `lab sequence`; people: who is asked, by names such as "terminal"; files: its pictures.

    Raises BadInput as `sequence_named` does.
    """
    options = kept.options
    wanted = replace(sequencing_options(options), people=people, keep=kept.keep, durations=kept.durations())
    return sequence_named(options.task, options.case, options.toasts, wanted, teacher=teacher, files={**(files or {})})
