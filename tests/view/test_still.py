"""A viewer that keeps what it is shown."""

from lab.sim.frames import IDENTITY, Body, Frame, Shape
from lab.view.rasterizer import Still


def test_it_keeps_what_was_shown_last() -> None:
    one, other = (Body(name, (Shape("sphere", (0.1,)),)) for name in ("one", "other"))
    still = Still()
    still.show([one])
    still.update(Frame(0.0, {"one": IDENTITY}))
    still.show([other])
    still.update(Frame(1.0, {"other": IDENTITY}))
    still.recording.check()
    assert still.recording.bodies == (other,)
    assert [frame.time_s for frame in still.recording.frames] == [1.0]
