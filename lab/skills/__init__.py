"""The sub-tasks: one file a skill, all with the same life."""

from lab.skills.butter import Butter
from lab.skills.grasp import Grasp
from lab.skills.insert import Insert
from lab.skills.place import Place
from lab.skills.skill import Skill
from lab.skills.transfer import Transfer

# in the order in which they bring a slice on, and then what machines do
SKILLS: dict[str, type[Skill]] = {skill.subtask: skill for skill in (Grasp, Transfer, Insert, Place, Butter)}

__all__ = ["SKILLS", "Butter", "Grasp", "Insert", "Place", "Skill", "Transfer"]
