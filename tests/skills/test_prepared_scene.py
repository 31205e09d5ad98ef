"""Which transfers of a task wait for others: parts put on parts, layers taken off, and what a file says."""

from typing import Any

import pytest

from lab.errors import BadInput
from lab.sequencing.cell.precedence import Precedence, RouteStep
from lab.sim.scene.blocked_cells import OUT_OF_REACH
from lab.skills.prepared_scene import precedences, prepare
from lab.tasks.task import Task
from lab.tasks.task_file import load

TRAY, PALLET = RouteStep("tray"), RouteStep("pallet", leaves=True)


def changed(task: str, **fields: Any) -> Task:
    """A shipped task with other fields."""
    loaded = load(task)
    return Task.model_validate(loaded.model_dump(mode="json", exclude_unset=True) | fields)


def with_after(**fields: Any) -> Task:
    """The kit, whose file says what has to wait."""
    return changed("kit", after=[{"part": "lid", "station": "tray", "of": "box"} | fields])


def depalletising() -> Task:
    """Boxes in two layers that are taken off their pallet."""
    parts = load("palletise").model_dump(mode="json", exclude_unset=True)["parts"]
    return changed("palletise", parts=[parts[0] | {"routes": [["pallet", "labeller", "conveyor"]]}])


def test_the_nth_lid_waits_for_the_box_below_its_place() -> None:
    kit = load("kit")
    assert precedences(kit, kit.order()) == (Precedence((4, 5, 6), TRAY, (1, 2, 3), TRAY, (1, 2, 3)),)
    assert precedences(kit, ("box", "box", "lid")) == (Precedence((3,), TRAY, (1, 2), TRAY, (1,)),)
    assert precedences(kit, ("box", "box")) == ()


def test_a_lid_across_two_boxes_waits_for_both() -> None:
    places = [
        {"at": [x, 0.0, 0.0], "height_m": z, "kind": kind}
        for x, z, kind in ((-0.03, 0.0, "box"), (0.032, 0.0, "box"), (0.0, 0.05, "lid"))
    ]
    kit = load("kit").model_dump(mode="json", exclude_unset=True)
    stations = [s | {"places": places, "capacity": 3} if s["name"] == "tray" else s for s in kit["stations"]]
    task = changed("kit", stations=stations)
    assert precedences(task, ("box", "box", "lid")) == (Precedence((3,), TRAY, (1, 2), TRAY, (2,)),)


def test_kinds_lie_on_one_another_in_turn() -> None:
    """A box on a lid on a box: the second box waits for the lid, and the lid for the first one."""
    places = [
        {"at": [0.0, 0.0, 0.0], "height_m": z, "kind": k} for z, k in ((0.0, "box"), (0.05, "lid"), (0.07, "box"))
    ]
    kit = load("kit").model_dump(mode="json", exclude_unset=True)
    stations = [s | {"places": places, "capacity": 3} if s["name"] == "tray" else s for s in kit["stations"]]
    found = precedences(changed("kit", stations=stations), ("box", "box", "lid"))
    assert found == (Precedence((1, 2), TRAY, (3,), TRAY, (0, 1)), Precedence((3,), TRAY, (1, 2), TRAY, (1,)))


def test_layers_of_one_kind_are_filled_from_the_lowest_on_by_themselves() -> None:
    task = load("palletise")
    assert precedences(task, task.order()) == ()


def test_the_upper_layer_is_taken_off_first() -> None:
    task = depalletising()
    assert precedences(task, task.order()) == (Precedence((1, 2, 3, 4), PALLET, (5, 6, 7, 8), PALLET),)
    assert precedences(task, task.order(6)) == (Precedence((1, 2, 3, 4), PALLET, (5, 6), PALLET),)
    assert precedences(task, task.order(4)) == ()


def test_lids_have_to_stand_on_boxes() -> None:
    kit = load("kit")
    with pytest.raises(
        BadInput, match=r"kit.toml: line \d+: station 'tray': 2 lids would stand on 2 boxes there, .* has 1"
    ):
        precedences(kit, ("box", "lid", "lid"))


def test_a_file_says_what_has_to_wait() -> None:
    """Beside what the tray's places say."""
    order = ("box", "box", "lid", "lid")
    derived = precedences(load("kit"), order)
    labelled = with_after(of_station="labeller", of_step="leaves", count="all")
    assert precedences(labelled, order) == (
        *derived,
        Precedence((3, 4), TRAY, (1, 2), RouteStep("labeller", leaves=True)),
    )
    each = with_after(station="magazine", step="leaves", of_station="tray")
    assert precedences(each, order)[1:] == (
        Precedence((3, 4), RouteStep("magazine", leaves=True), (1, 2), TRAY, (1, 2)),
    )


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ({"of": "lid"}, "a kind cannot wait for itself"),
        ({"of": "bax"}, "unknown part 'bax' (after 1): did you mean 'box'?"),
        (
            {"station": "labeller"},
            "unknown station 'labeller' (after 1: what every route of 'lid' comes to): known: tray",
        ),
        ({"step": "leaves"}, "unknown station 'tray' (after 1: what every route of 'lid' leaves): known: magazine"),
    ],
)
def test_what_cannot_wait_is_refused(wrong: dict[str, str], said: str) -> None:
    with pytest.raises((ValueError, BadInput), match="after 1") as refused:
        with_after(**wrong)
    assert said in str(refused.value)


def test_an_arm_reaches_every_cell_that_its_survey_does_not_call_out_of_reach() -> None:
    task, transfer = load("toast-panda"), "transfer toaster to plate"
    scene = prepare(task, task.order(2), 0, transfer)
    causes, reach = scene.surveys.workspace("").causes.ravel(), scene.reach(transfer)
    assert reach[causes != OUT_OF_REACH].all()
    assert 0 < (~reach).sum() <= (causes == OUT_OF_REACH).sum()  # fewer, as nothing is out of reach behind an arm
