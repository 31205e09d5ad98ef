"""A skill of one's own: an entry point in the group `teaching_lab.skills` makes it known (see examples/plugin)."""

from typing import Any, ClassVar

from lab.skills import Transfer
from lab.tasks.task import Task


class Return(Transfer):
    """The empty gripper goes back the way it came."""

    subtask: ClassVar[str] = "return"
    help: ClassVar[str] = "brings the empty gripper the whole way back"

    def __init__(self, origin: str, target: str) -> None:
        super().__init__(origin, target)
        self.name = f"return {origin} to {target}"

    @classmethod
    def on_travel(cls, task: Task, origin: str, target: str) -> "Return":
        """Every way without a part is gone back."""
        return cls(target, origin)

    @classmethod
    def on_carry(cls, task: Task, kind: str, origin: str, target: str) -> Any:
        """Not with a part in the gripper."""
        return None
