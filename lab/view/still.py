"""What was shown to a viewer, kept: for a page in a file that needs no lab."""

from collections.abc import Sequence

from lab.sim.frames import Body, Frame, Recording


class Still:
    """A viewer that keeps the bodies and frames that it is given."""

    def __init__(self) -> None:
        self.recording = Recording(())

    def show(self, bodies: Sequence[Body]) -> None:
        """Begin anew with these bodies."""
        self.recording = Recording(tuple(bodies))

    def update(self, frame: Frame) -> None:
        """Keep a frame, too."""
        self.recording.frames.append(frame)
