"""The skills that solve sub-tasks: one file each, all with the same life cycle (`lab.skills.skill.Skill`)."""

from typing import Any

from lab.plugins.family import Family, wanted
from lab.skills.cover import Cover
from lab.skills.grasp import Grasp
from lab.skills.insert import Insert
from lab.skills.place import PlacePart
from lab.skills.skill import Skill
from lab.skills.transfer import Transfer

# in the order in which they handle a part, followed by what machines do
_SHIPPED: dict[str, type[Skill]] = {skill.subtask: skill for skill in (Grasp, Transfer, Insert, PlacePart, Cover)}


def _adopted(name: str, thing: Any) -> type[Skill]:
    if not (isinstance(thing, type) and issubclass(thing, Skill)):
        raise wanted(thing, "a subclass of lab.skills.Skill")
    return thing


SKILLS = Family("skills", _SHIPPED, _adopted)

__all__ = ["SKILLS", "Cover", "Grasp", "Insert", "PlacePart", "Skill", "Transfer"]
