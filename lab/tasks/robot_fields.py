"""The robot's fields of a task file: which arm, how it is mounted, how fast and firm it works."""

from pathlib import PurePosixPath
from typing import Annotated, Self

from pydantic import BeforeValidator, Field, field_validator, model_validator

from lab.errors import unknown
from lab.tasks.record import Name, Record, as_tuple

MODELS = ("up6", "panda", "iiwa", "xarm6")  # the arms that ship, by name: rows of `lab.sim.arms.arm_models.ARMS`
STRONGEST_N = 200.0  # of a grip
Part = Annotated[str, Field(min_length=1, max_length=100)]


class RobotSettings(Record):
    """The arm, where it starts, and how fast and firm it works [m/s], [m/s2], [N].

    model: a name of MODELS, or the path of a URDF beside the task file; that one also needs tool_link, whose z axis points
    out of the gripper and along whose y axis its fingers close, fingers, the joints that move them, and tip_m, how far the
    finger tips are out along z [m]. nearest_m [m]: nearer to its own axis than this the tool never goes. opening_m [m]:
    between the open fingers, by default all that the gripper has. base_up_m: its foot above the table [m]. grip_force_n: of
    each finger [N], at most: a part that is light for it is held with 1000 N/kg; by default chosen for each kind of part from
    its mass and friction. force_limit_n: a protective stop holds the arm that presses on something harder [N], by default
    150 or six times the grip force.
    """

    model: str = "up6"
    tool_link: Part | None = None
    fingers: Annotated[tuple[Part, ...], BeforeValidator(as_tuple), Field(min_length=1, max_length=8)] | None = None
    tip_m: Annotated[float, Field(ge=0, le=1)] | None = None
    nearest_m: Annotated[float, Field(ge=0.05, le=5)] | None = None
    opening_m: Annotated[float, Field(ge=0.002, le=1)] | None = None
    base_up_m: Annotated[float, Field(ge=-2, le=5)] = 0.0
    start: Name
    speed_m_s: Annotated[float, Field(ge=0.01, le=1.5)] = 0.5
    acceleration_m_s2: Annotated[float, Field(ge=0.01, le=10)] = 2.0
    grip_force_n: Annotated[float, Field(gt=0, le=STRONGEST_N)] | None = None
    force_limit_n: Annotated[float, Field(ge=10, le=5000)] | None = None

    @property
    def is_file(self) -> bool:
        """Whether the arm is a URDF of the task's own."""
        return PurePosixPath(self.model).suffix.lower() == ".urdf"

    @field_validator("model")
    @classmethod
    def _known(cls, model: str) -> str:
        if model not in MODELS and PurePosixPath(model).suffix.lower() != ".urdf":
            raise unknown("arm", model, [*MODELS, "a URDF file beside the task file"], "robot.model")
        return model

    @model_validator(mode="after")
    def _file_says_its_tool(self) -> Self:
        for field in ("tool_link", "fingers", "tip_m"):
            given = getattr(self, field) is not None
            if self.is_file and not given:
                raise ValueError(f"model '{self.model}' is a URDF: {field} must say where its gripper is")
            if given and not self.is_file:
                raise ValueError(f"{field} is for a URDF file: the arm '{self.model}' knows its own")
        return self
