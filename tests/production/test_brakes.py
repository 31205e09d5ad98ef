"""An emergency stop holds the joints of every arm within one physics step, at full speed, too."""

from dataclasses import replace

import numpy as np
import pytest

from lab.production.floor import Floor, Hooks
from lab.sim.arms.robot import NAME
from lab.sim.world import World
from lab.skills.prepared_scene import lay_out
from lab.skills.skillset import SkillSet
from lab.tasks.task_file import load

HELD = 1e-3  # rad/s
STOPS = (60, 100, 140, 180)  # physics steps of the way
LASTS = 30


@pytest.mark.parametrize("name", ["toast", "toast-panda", "toast-xarm6", "toast-iiwa"])
def test_every_joint_holds_in_the_next_step(name: str) -> None:
    task = load(name)
    order = task.ordered(1)
    with World() as world:
        speeds: list[list[float]] = []

        def press(floor: Floor) -> None:
            fastest = float(np.abs(world.joint_speeds(NAME, floor.scene.robot.arm.joints)).max())
            controls = floor.controls
            if controls.stops:
                speeds[-1].append(fastest)
                if len(speeds[-1]) > LASTS:
                    controls.reset()
                    controls.go_on()
            elif len(speeds) < len(STOPS) and floor.steps >= STOPS[len(speeds)] + len(speeds) * LASTS:
                controls.emergency()
                speeds.append([fastest])

        scene = SkillSet.of(task, order), lay_out(task, order, 0), order
        floor = Floor(world, *scene, hooks=Hooks(after_step=press))
        robot = floor.scene.robot
        here = robot.tool()
        aside = replace(here, x=here.y, y=here.x, z=here.z + 0.1)
        for _ in STOPS:
            floor.follow(robot.follow([aside, here]))
    assert len(speeds) == len(STOPS)
    assert min(moving for moving, *_ in speeds) > 0.1
    assert max(max(after) for _, *after in speeds) < HELD


def test_the_solver_works_as_before_once_it_goes_on() -> None:
    task = load("toast-panda")
    order = task.ordered(1)
    with World() as world:

        def release(floor: Floor) -> None:
            floor.controls.reset()
            floor.controls.go_on()

        scene = SkillSet.of(task, order), lay_out(task, order, 0), order
        floor = Floor(world, *scene, hooks=Hooks(after_step=release))
        before = world.iterations(60)
        world.iterations(before)

        floor.controls.emergency()
        assert floor.held() == "emergency stop: pressed by hand"
        assert world.iterations(60) == before
