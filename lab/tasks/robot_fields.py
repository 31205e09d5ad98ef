"""The record of the robot in a task file: the arm, its mounting, its speeds and forces."""

from pathlib import PurePosixPath
from typing import Annotated, Literal, Self

from pydantic import BeforeValidator, Field, field_validator, model_validator

from lab.errors import unknown
from lab.tasks.record import Name, Record, as_tuple

MODELS = ("up6", "panda", "iiwa", "xarm6")  # the arms that ship, by name: rows of `lab.sim.arms.arm_models.ARMS`
STRONGEST_N = 200.0  # the largest grip force of a finger
Part = Annotated[str, Field(min_length=1, max_length=100)]


class RobotSettings(Record):
    """The arm, its mounting, its start, its speed and its forces."""

    model: str = "up6"
    """The arm: `up6`, `panda`, `iiwa` or `xarm6`, or the URDF file of another one: beside the task file, such as
    `"my-arm.urdf"`, or in an installed Python package, as `"package://NAME/arm.urdf"`.
    """
    tool_link: Part | None = None
    """In a URDF: the link whose z axis points out of the gripper and along whose y axis two fingers close (one jaw:
    across z), such as `"hand"`.
    """
    fingers: Annotated[tuple[Part, ...], BeforeValidator(as_tuple), Field(min_length=1, max_length=8)] | None = None
    """In a URDF: the joints that move the fingers, such as `["left_finger", "right_finger"]`, or the one joint of a jaw
    that closes on the hand.
    """
    tip_m: Annotated[float, Field(ge=0, le=1)] | None = None
    """In a URDF: the distance of the finger tips along the tool link's z axis [m], such as `0.1`."""
    nearest_m: Annotated[float, Field(ge=0.05, le=5)] | None = None
    """The least distance of the tool from the arm's vertical axis [m], such as `0.3`; left out: the arm's own
    limit.
    """
    opening_m: Annotated[float, Field(ge=0.002, le=1)] | None = None
    """The opening between the fingers [m], such as `0.046`; left out: as wide as they open."""
    base_up_m: Annotated[float, Field(ge=-2, le=5)] = 0.0
    """The height of the arm's foot above the table [m]."""
    tool: Literal["hanging", "level"] | None = None
    """The direction of the tool in the whole task: it hangs down ("hanging"), or is level and takes parts from behind
    ("level"); left out: level if a station has approach = "side", else hanging.
    """
    start: Name
    """The station above which the arm waits at time 0, such as `"input"`."""
    speed_m_s: Annotated[float, Field(ge=0.01, le=1.5)] = 0.5
    """The largest speed of the tool along its path [m/s]."""
    acceleration_m_s2: Annotated[float, Field(ge=0.01, le=10)] = 2.0
    """The largest acceleration of the tool [m/s2]."""
    grip_force_n: Annotated[float, Field(gt=0, le=STRONGEST_N)] | None = None
    """The largest force of each finger [N], such as `25.0`; a part that would creep is held with less. Left out: chosen
    for each kind of part from its mass, size and friction.
    """
    joint_speed_rad_s: Annotated[float, Field(gt=0, le=100)] | None = None
    """The largest speed of each joint [rad/s], such as `4.7`; left out: the arm's own limits."""
    joint_torque_nm: Annotated[float, Field(gt=0, le=5000)] | None = None
    """The largest torque of the motor of each joint [Nm], such as `2.9`; left out: as strong as the load takes."""
    force_limit_n: Annotated[float, Field(ge=10, le=5000)] | None = None
    """The contact force of the arm at which a protective stop holds it [N], such as `150.0`; left out: 150, or six times
    the grip force if that is more.
    """

    @property
    def is_file(self) -> bool:
        """Whether the arm is a URDF file of the task."""
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
