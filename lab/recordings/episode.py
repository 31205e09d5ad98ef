"""The records of a robot's recorded episodes: observations, actions, pictures, and the steps that a teacher gave."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from lab.errors import BadInput

FloatArray = NDArray[np.float32]
Image = NDArray[np.uint8]


class Pictures(Protocol):
    """The pictures of one camera in one episode; a video is decoded only where one is asked for."""

    def __len__(self) -> int:
        """The number of pictures, which is that of the episode's steps."""

    def __getitem__(self, step: int) -> Image:
        """The picture (height, width, 3) RGB uint8 at a step."""

    def __iter__(self) -> Iterator[Image]:
        """All pictures in the order of the steps."""


@dataclass(frozen=True, eq=False)
class Episode:
    """One episode of n steps: in step i the robot observed `states[i]` and carried `actions[i]` out.

    task: what it was told to do, in words; states (n, d) and actions (n, k): float32.
    corrected (n,): whether the action came from a person or another teacher who had taken over, not from the policy.
    success: whether the task was done at the end; None if nobody recorded that.
    pictures: by camera, such as "overhead". extra: by name of the feature, other arrays (n, ...), such as "next.reward".
    Raises BadInput if the lengths differ or a value is not finite.

        >>> import lab, numpy as np
        >>> states, actions = np.zeros((4, 2), np.float32), np.ones((4, 1), np.float32)
        >>> lab.Episode("press", states, actions, np.array([False, True, True, False])).takeovers()
        [(1, 3)]
    """

    task: str
    states: FloatArray
    actions: FloatArray
    corrected: NDArray[np.bool_]
    success: bool | None = None
    pictures: Mapping[str, Pictures] = field(default_factory=dict)
    extra: Mapping[str, NDArray[np.generic]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        n = len(self.states)
        rows = {"actions": self.actions, "corrected": self.corrected, **self.pictures, **self.extra}
        for name, row in rows.items():
            if len(row) != n:
                raise BadInput(f"{name}: {len(row)} steps (episode): wanted {n}, as the states have")
        for name, values in (("states", self.states), ("actions", self.actions)):
            if values.ndim != 2 or not np.isfinite(values).all():
                raise BadInput(f"{name} (episode): wanted finite numbers, a row a step")

    def __len__(self) -> int:
        return len(self.states)

    def part(self, start: int, end: int, success: bool | None) -> "Episode":
        """The steps from `start` to before `end`, without pictures, as an episode of that success."""
        own = slice(start, end)
        extra = {name: values[own] for name, values in self.extra.items()}
        return Episode(self.task, self.states[own], self.actions[own], self.corrected[own], success, extra=extra)

    def takeovers(self) -> list[tuple[int, int]]:
        """The first step and the step after the last of each stretch in which a teacher gave the actions."""
        edges = np.flatnonzero(np.diff(np.concatenate([[False], self.corrected, [False]]).astype(np.int8)))
        return [(int(first), int(after)) for first, after in edges.reshape(-1, 2)]


@dataclass(frozen=True, eq=False)
class Recording:
    """Episodes of one robot, all with the same states and actions, at `fps` steps a second.

    robot: its type, such as "so101_follower"; state_names (d,), action_names (k,): what the numbers are.
    Raises BadInput if an episode has other widths than the names.

        >>> import lab, numpy as np
        >>> still = lab.Episode("wait", np.zeros((4, 2), np.float32), np.zeros((4, 1), np.float32), np.zeros(4, bool))
        >>> len(lab.Recording(30, "cart", ("x", "y"), ("speed",), [still]).episodes)
        1
    """

    fps: int
    robot: str
    state_names: tuple[str, ...]
    action_names: tuple[str, ...]
    episodes: Sequence[Episode]

    def __post_init__(self) -> None:
        wanted = len(self.state_names), len(self.action_names)
        for number, episode in enumerate(self.episodes):
            if (episode.states.shape[1], episode.actions.shape[1]) != wanted:
                widths = f"{episode.states.shape[1]} states and {episode.actions.shape[1]} actions"
                raise BadInput(f"episode {number}: {widths}: wanted {wanted[0]} and {wanted[1]}, as their names")
