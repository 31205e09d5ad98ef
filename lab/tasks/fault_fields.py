"""The record of a fault in a task file: its kind, its time, and the part, station or obstacle that it affects."""

from typing import Annotated, Any, Literal, Self

from pydantic import BeforeValidator, ConfigDict, Field, model_validator

from lab.tasks.record import Name, Record, as_tuple

FaultKind = Literal[
    "part moved",
    "part gone",
    "part fallen",
    "part slips",
    "part dropped",
    "machine slow",
    "machine fails",
    "obstacle put",
    "obstacle moved",
    "obstacle gone",
    "station moved",
    "station full",
    "camera blind",
]
When = Literal["carried", "in machine", "standing"]
PartName = Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9 _-]{0,39} [1-9][0-9]?$")]
Place = Annotated[float, Field(ge=-10, le=10)]
XY = Annotated[tuple[Place, Place], BeforeValidator(as_tuple)]
Edges = Annotated[
    tuple[
        Annotated[float, Field(ge=0.01, le=1)],
        Annotated[float, Field(ge=0.01, le=1)],
        Annotated[float, Field(ge=0.01, le=1)],
    ],
    BeforeValidator(as_tuple),
]

NEEDS: dict[str, tuple[str, ...]] = {  # the fields that each kind of fault requires
    "machine slow": ("station",),
    "machine fails": ("station",),
    "obstacle put": ("at_m",),
    "obstacle moved": ("obstacle",),
    "obstacle gone": ("obstacle",),
    "station moved": ("station",),
    "station full": ("station",),
}
TAKES: dict[str, tuple[str, ...]] = {  # the optional fields of each kind of fault
    "part moved": ("part", "when", "by_m", "at_m", "turn_rad"),
    "part gone": ("part", "when"),
    "part fallen": ("part",),
    "part slips": ("part", "share", "seconds"),
    "part dropped": ("part", "by_m", "at_m"),
    "machine slow": ("share",),
    "machine fails": (),
    "obstacle put": ("size_m",),
    "obstacle moved": ("by_m",),
    "obstacle gone": (),
    "station moved": ("by_m",),
    "station full": ("part",),
    "camera blind": ("seconds",),
}


def allowed(what: str) -> list[str]:
    """The fields that a kind of fault may have."""
    return sorted({"what", "at_s", *NEEDS.get(what, ()), *TAKES[what]})


def _by_kind(schema: dict[str, Any]) -> None:
    """Adds to a schema the required and the optional fields of each kind of fault."""
    schema["allOf"] = [
        {
            "if": {"properties": {"what": {"const": what}}, "required": ["what"]},
            "then": {"required": [*NEEDS.get(what, ())], "propertyNames": {"enum": allowed(what)}},
        }
        for what in TAKES
    ]


class FaultFields(Record):
    """A fault that strikes during a run: its kind, its time, and what it affects."""

    model_config = ConfigDict(json_schema_extra=_by_kind)

    what: FaultKind
    """The kind of fault."""
    at_s: Annotated[float, Field(ge=0, le=86_400)] = 0.0
    """The time of the run from which on the fault strikes as soon as it can [s]."""
    when: When | None = None
    """The state of the part that the fault waits for: carried, in a machine, or standing at a station, such as
    `"standing"`.
    """
    part: PartName | None = None
    """The affected part by kind and number, such as `"bun 1"`; left out: the first possible one."""
    station: Name | None = None
    """The affected station or machine, such as `"oven"`."""
    obstacle: Name | None = None
    """The affected obstacle, such as `"tower"`."""
    by_m: XY | None = None
    """The displacement of the part, obstacle or station that is moved or falls: x and y [m], such as `[0.05, 0.0]`."""
    turn_rad: Annotated[float, Field(ge=-3.2, le=3.2)] = 0.0
    """The angle by which the part is turned [rad]."""
    share: Annotated[float, Field(ge=0, le=100)] | None = None
    """The factor on the machine's processing time, or the share of the friction that remains [-], such as `1.5`."""
    seconds: Annotated[float, Field(gt=0, le=86_400)] | None = None
    """The duration of the fault [s], such as `30.0`."""
    at_m: XY | None = None
    """The new position of the moved, dropped or added body: x and y [m], such as `[0.5, 0.3]`."""
    size_m: Edges | None = None
    """Length, width and height of the added obstacle [m], such as `[0.06, 0.06, 0.34]`."""

    @model_validator(mode="after")
    def _its_own_fields(self) -> Self:
        for field in NEEDS.get(self.what, ()):
            if getattr(self, field) is None:
                raise ValueError(f"what = '{self.what}' needs {field}")
        for field in sorted(self.model_fields_set - {*allowed(self.what)}):
            raise ValueError(f"what = '{self.what}' has no {field}: allowed are {', '.join(allowed(self.what))}")
        if self.when == "carried" and self.what in ("part moved", "part gone"):
            raise ValueError(
                "when = 'carried': what is carried is dropped, or slips; wanted 'in machine' or 'standing'"
            )
        return self
