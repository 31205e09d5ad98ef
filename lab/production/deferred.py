"""Lazy imports of what needs the scene, because a cell is put in order without one."""

from typing import TYPE_CHECKING

from lab.lazy import loader

if TYPE_CHECKING:
    from lab.production.durations import Durations, cell_of, untimed
    from lab.production.order import check_order
    from lab.production.taught import teach_all
    from lab.skills.prepared_scene import prepare
    from lab.skills.skillset import SkillSet

TABLE = {
    "lab.production.durations": ("cell_of", "Durations", "untimed"),
    "lab.production.order": ("check_order",),
    "lab.production.taught": ("teach_all",),
    "lab.skills.prepared_scene": ("prepare",),
    "lab.skills.skillset": ("SkillSet",),
}

if not TYPE_CHECKING:  # so that mypy knows the names of the table alone
    __getattr__ = loader(__name__, TABLE)
