"""Whom a floor calls, and when: before and after each step, for each event; and nobody before its time begins."""

from lab.production.floor import Floor, Hooks
from lab.sim.world import World
from lab.skills.prepared_scene import lay_out
from lab.skills.skillset import SkillSet
from lab.tasks.task_file import load
from lab.teaching.events import Event, PartDone


def test_hooks_are_called_around_each_step_and_not_while_the_arm_is_put_to_where_it_begins() -> None:
    task = load("toast")
    order, called, heard = task.ordered(1), list[tuple[str, int]](), list[tuple[Event, int]]()

    def before_step(floor: Floor) -> bool:
        called.append(("before", floor.steps))
        return False

    hooks = Hooks(
        before_step=before_step,
        after_step=lambda floor: called.append(("after", floor.steps)),
        hear=lambda event, step: heard.append((event, step)),
    )
    with World() as world:
        floor = Floor(world, SkillSet.of(task, order), lay_out(task, order, 0), order, hooks=hooks)
        floor.stand(floor.scene.robot.tool())
        assert called == []
        floor.restart_clock()
        floor.tick()
        floor.tick()
        floor.tell(PartDone("slice 1", floor.now_s))
    assert called == [("before", 0), ("after", 1), ("before", 1), ("after", 2)]
    assert [step for _, step in heard] == [2]
