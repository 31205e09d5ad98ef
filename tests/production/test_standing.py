"""Where there is room to set a part down: in a layer only where what carries it really stands below."""

from collections.abc import Iterator

import pytest

from lab.production.floor import Floor
from lab.production.standing import free_spot, too_near
from lab.production.trouble import Trouble
from lab.sim.parts.kinds import Spot
from lab.sim.world import World
from lab.skills.prepared_scene import lay_out
from lab.skills.skillset import CarriedPath, SkillSet
from lab.tasks.task_file import load

WAY = CarriedPath("labeller", "pallet", "box")


@pytest.fixture
def floor() -> Iterator[Floor]:
    """Six boxes of the task that palletises."""
    task = load("palletise")
    order = task.order(6)
    with World() as world:
        yield Floor(world, SkillSet.of(task, order), lay_out(task, order, 0), order)


def first_layer(floor: Floor) -> dict[str, Spot]:
    """Boxes 1 to 4 stand on the first layer: on which spot each."""
    scene = floor.scene
    spots = scene.places.spots(scene.task.station("pallet"))
    standing = {f"box {n}": spot for n, spot in enumerate(spots[:4], 1)}
    for name, spot in standing.items():
        scene.put(name, "box", scene.kinds["box"].held_at(spot))
    return standing


def test_the_first_layer_is_filled_before_the_second(floor: Floor) -> None:
    spots = floor.scene.places.spots(floor.scene.task.station("pallet"))
    standing = first_layer(floor)
    assert free_spot(floor.bench, "box 5", WAY, standing, (), ()) == spots[4]
    left = {name: spot for name, spot in standing.items() if name != "box 3"}
    assert free_spot(floor.bench, "box 5", WAY, left, (), ()) == spots[2]


def test_nothing_is_put_where_nothing_stands_below(floor: Floor) -> None:
    """Box 1 has been taken away by a hand, box 2 was given up; then all lie about."""
    spots = floor.scene.places.spots(floor.scene.task.station("pallet"))
    standing = first_layer(floor)
    floor.scene.put("box 1", "box", floor.scene.kinds["box"].held_at(Spot(0.8, 0.5, 0.0, 0.0)))
    assert free_spot(floor.bench, "box 5", WAY, standing, (), ()) == spots[5]
    assert free_spot(floor.bench, "box 5", WAY, standing, (), ("box 2",)) == spots[6]
    with pytest.raises(Trouble, match="no spot of 'pallet' is free: what would carry it does not stand there"):
        free_spot(floor.bench, "box 5", WAY, standing, (), tuple(standing))


def test_the_arm_itself_tells_whether_a_part_can_be_taken_up() -> None:
    """Cans stand between turned walls, with room for the arm; one beside a wall has room for the fingers, not for the hand."""
    task = load("sorting")
    order = task.ordered()
    with World() as world:
        floor = Floor(world, SkillSet.of(task, order), lay_out(task, order, 0), order)
        assert {too_near(floor.bench, name) for name in floor.scene.kind_of} == {""}
        (_, _, z), turn = world.pose("can-2 2")
        world.put("can-2 2", (0.74, -0.16, z), turn)
        assert too_near(floor.bench, "can-2 2") == "container right"
        world.put("can-2 2", (0.55, 0.30, z), turn)
        for off, other in (
            ((0.0, 0.05), "can-1 1"),
            ((0.05, 0.0), ""),
        ):  # where a finger comes down, or before the hand
            at = floor.bench.part_pose("can-2 2").local(*off)
            world.put("can-1 1", (at.x, at.y, z), turn)
            assert too_near(floor.bench, "can-2 2") == other
