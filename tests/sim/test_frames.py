"""The plain records: what they accept, and what they say when something is wrong."""

import math
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from lab.errors import BadInput
from lab.sim.frames import IDENTITY, SIZES, Body, Frame, Recording, Shape

BOX = Shape("box", (1.0, 2.0, 3.0))


def test_shapes_of_every_kind() -> None:
    for kind, count in SIZES.items():
        mesh, text = Path("part.stl") if kind == "mesh" else None, "x" if kind == "label" else ""
        Shape(kind, (0.1,) * count, mesh=mesh, text=text)  # type: ignore[arg-type]
    assert Shape("mesh", mesh=Path("part.stl")).size == ()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"kind": "ball", "size": (1.0,)}, "unknown shape kind 'ball'"),
        ({"kind": "box", "size": (1.0,)}, "a box takes 3 numbers"),
        ({"kind": "mesh"}, "`mesh` must be a path"),
        ({"kind": "label", "size": (0.1,)}, "the text '': a label has one, and nothing else"),
        ({"kind": "sphere", "size": (0.1,), "text": "x"}, "the text 'x': a label has one, and nothing else"),
        ({"kind": "sphere", "size": (-1.0,)}, "above 0"),
        ({"kind": "sphere", "size": (math.nan,)}, "above 0"),
        ({"kind": "sphere", "size": (1.0,), "rgba": (0, 0, 2, 1)}, "within 0..1"),
        ({"kind": "sphere", "size": (1.0,), "quaternion": (0, 0, 0, 0)}, "must be 1"),
        ({"kind": "sphere", "size": (1.0,), "position": (0, math.inf, 0)}, "7 finite numbers"),
    ],
)
def test_bad_shapes_are_named(arguments: dict[str, object], message: str) -> None:
    with pytest.raises(BadInput, match=message.replace("(", r"\(")):
        Shape(**arguments)  # type: ignore[arg-type]


@pytest.mark.parametrize("name", ["", "a/b"])
def test_body_names_cannot_break_the_scene_tree(name: str) -> None:
    with pytest.raises(BadInput):
        Body(name, (BOX,))


@given(st.floats(), st.lists(st.floats(), max_size=9))
def test_a_frame_is_finite_with_unit_quaternions_or_refused(time_s: float, pose: list[float]) -> None:
    fine = math.isfinite(time_s) and len(pose) == 7 and all(map(math.isfinite, pose))
    if fine and abs(math.hypot(*pose[3:]) - 1) <= 1e-3:
        Frame(time_s, {"a": tuple(pose)})  # type: ignore[dict-item]
    else:
        with pytest.raises(BadInput):
            Frame(time_s, {"a": tuple(pose)})  # type: ignore[dict-item]


def test_a_recording_lasts_from_first_to_last_frame() -> None:
    recording = Recording((Body("a", (BOX,)),))
    assert recording.duration_s == 0
    recording.frames += [Frame(1.0, {"a": IDENTITY}), Frame(3.5, {})]
    recording.check()
    assert recording.duration_s == 2.5


def test_a_recording_with_wrong_frames_is_refused() -> None:
    bodies = (Body("slice", (BOX,)),)
    with pytest.raises(BadInput, match="did you mean 'slice'"):
        Recording(bodies, [Frame(0, {"slce": IDENTITY})]).check()
    with pytest.raises(BadInput, match="must not run back"):
        Recording(bodies, [Frame(1, {}), Frame(0, {})]).check()
    with pytest.raises(BadInput, match="used twice"):
        Recording(bodies * 2).check()
