"""The record of every step of a lesson, and its export as a Minari dataset and for TensorBoard."""

import time
import warnings
from copy import copy
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from lab.errors import BadInput, WorkFailed
from lab.lazy import gymnasium, h5py, minari, tensorboard
from lab.learning.environment import Environment, Step
from lab.learning.selection import Draw
from lab.learning.session_events import EpisodeEnded
from lab.mdp import TabularMDP
from lab.optional import require
from lab.teaching.events import LessonBegan, LessonEvent, QuestionAnswered, SessionBegan


@dataclass
class RecordedEpisode:
    """One episode of T steps: T + 1 states, T actions, rewards and advised flags, and whether it terminated."""

    states: list[int]
    actions: list[int] = field(default_factory=list)
    rewards: list[float] = field(default_factory=list)
    advised: list[bool] = field(default_factory=list)
    terminated: bool = False
    steps: int = 0  # as the session counts them


class StepRecord:
    """The finished episodes of a lesson, recorded by its listener `hear`."""

    def __init__(self) -> None:
        self.episodes: list[RecordedEpisode] = []
        self.mdp: TabularMDP | None = None
        self.name = ""
        self._now: RecordedEpisode | None = None
        self._advised = False

    def hear(self, event: Any) -> None:
        """Receives an event of the lesson."""
        if isinstance(event, LessonBegan):
            self.episodes, self._now = [], None
            self.name, self.mdp = event.plan.problem.name, event.plan.problem.mdp
        elif isinstance(event, SessionBegan):
            event.session.environment = _recorded(event.session.environment, self)
        elif isinstance(event, QuestionAnswered):
            self._advised = isinstance(event.action, int)
        elif isinstance(event, LessonEvent) and isinstance(event.event, EpisodeEnded) and self._now is not None:
            steps = event.event.steps  # a float only for a score that is no number of steps
            self._now.steps = steps if isinstance(steps, int) else len(self._now.actions)
            self.episodes.append(self._now)
            self._now = None

    def began(self, state: int) -> None:
        """Begins an episode."""
        self._now, self._advised = RecordedEpisode([state]), False

    def moved(self, action: int, step: Step) -> None:
        """Records a step."""
        assert self._now is not None
        self._now.states.append(step.state)
        self._now.actions.append(action)
        self._now.rewards.append(float(step.reward))
        self._now.advised.append(self._advised)
        self._now.terminated = step.terminated
        self._advised = False

    def written(self, minari: str | None, tensorboard: Path | None) -> dict[str, str]:
        """Writes what is asked for (None: not); returns the places by name."""
        files = {}
        if minari is not None:
            files["minari"] = str(self.to_minari(minari))
        if tensorboard is not None:
            files["tensorboard"] = str(self.to_tensorboard(tensorboard))
        return files

    def to_minari(self, dataset_id: str) -> Path:
        """The folder of a new Minari dataset with the episodes; dataset_id: such as "lab/world-1-v0".

        Observations are states; infos say which steps were advised. Raises BadInput if Minari is not installed, if nothing was
        recorded, and if the dataset exists; WorkFailed if it cannot be written.
        """
        check_libraries(dataset_id)
        if self.mdp is None or not self.episodes:
            raise BadInput(f"dataset '{dataset_id}': no episode was recorded")
        buffers = [
            minari.data_collector.EpisodeBuffer(
                id=n,
                observations=np.array(episode.states, np.int64),
                actions=np.array(episode.actions, np.int64),
                rewards=episode.rewards,
                terminations=[*[False] * (len(episode.actions) - 1), episode.terminated],
                truncations=[*[False] * (len(episode.actions) - 1), not episode.terminated],
                infos={"advised": np.array([*episode.advised, False])},
            )
            for n, episode in enumerate(self.episodes)
        ]
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # about authors and links that a session has not
                minari.create_dataset_from_buffers(
                    dataset_id,
                    buffers,
                    observation_space=gymnasium.spaces.Discrete(self.mdp.n_states),
                    action_space=gymnasium.spaces.Discrete(self.mdp.n_actions),
                    algorithm_name="teaching-lab",
                    description=f"A taught session: '{self.name}'; infos: which steps were advised.",
                )
        except (ValueError, AssertionError) as error:
            raise BadInput(f"dataset '{dataset_id}': {error}") from None
        except OSError as error:
            raise WorkFailed(f"dataset '{dataset_id}' cannot be written: {error}") from error
        return Path(minari.storage.get_dataset_path(dataset_id))

    def to_tensorboard(self, folder: Path) -> Path:
        """The folder, to which steps, return and advised steps of each episode were written for TensorBoard.

        Raises BadInput if TensorBoard is not installed, or if the folder cannot be written.
        """
        check_libraries(None, folder)
        event, summary = tensorboard.compat.proto.event_pb2.Event, tensorboard.compat.proto.summary_pb2.Summary
        try:
            writer = tensorboard.summary.writer.event_file_writer.EventFileWriter(str(folder))
        except OSError as error:
            raise BadInput(f"folder '{folder}' cannot be written: {error.strerror or error}") from error
        for n, episode in enumerate(self.episodes, start=1):
            values = {"steps": episode.steps, "return": sum(episode.rewards), "advised steps": sum(episode.advised)}
            said = [summary.Value(tag=tag, simple_value=float(value)) for tag, value in values.items()]
            writer.add_event(event(wall_time=time.time(), step=n, summary=summary(value=said)))
        writer.close()
        return folder


def check_libraries(dataset_id: str | None, folder: Path | None = None) -> None:
    """Loads the libraries that write a Minari dataset and a folder for TensorBoard, each None if it is not wanted.

    Raises BadInput if one is missing.
    """
    if dataset_id is not None:
        require(f"dataset '{dataset_id}'", h5py, minari)  # Minari misses h5py only with a folder half made
    if folder is not None:
        require(f"folder '{folder}'", tensorboard)


def _recorded(inner: Environment, record: StepRecord) -> Environment:
    """A copy of the environment whose steps are recorded."""
    made = copy(inner)

    def reset(episode: int, draw: Draw) -> int:
        state = inner.reset(episode, draw)
        record.began(state)
        return state

    def step(state: int, action: int, draw: Draw) -> Step:
        entered = inner.step(state, action, draw)
        record.moved(action, entered)
        return entered

    vars(made).update(reset=reset, step=step)
    return made
