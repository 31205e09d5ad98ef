"""Sequence + skills -> motions: durations measured, toasts delivered, failures noticed, tried again and explained."""

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np
import pytest

from lab.errors import WorkFailed
from lab.production.answers import MAX_TRIES
from lab.production.composer import Conditions, Production, carry_out
from lab.production.controls import RESET_FIRST
from lab.production.durations import Durations, cell_of, measure
from lab.production.floor import AT_REST_STEPS, SKIPPED_STEPS, Floor, Hooks
from lab.production.machine import MachineWork
from lab.production.outcome import Outcome
from lab.production.parts_in_machines import watch_machines
from lab.production.run_state import RunState
from lab.sequencing.cell.cell import Cell
from lab.sequencing.simulate.follow import simulate
from lab.sim.arms.robot import NAME
from lab.sim.frames import Body, Frame
from lab.sim.scene.places import Layout
from lab.sim.scene.scene_check import places_of
from lab.sim.world import TIME_STEP, World
from lab.skills import Cover
from lab.skills.prepared_scene import Prepared
from lab.skills.skill import Status
from lab.skills.skillset import SkillSet
from lab.skills.surveys import Surveys
from lab.skills.trial import trial_of
from lab.tasks.task import Order, Task
from lab.tasks.task_fields import Part, Stage
from lab.tasks.task_file import load
from lab.teaching.events import Event, MoveMade, MoveRetried, RunHeld, RunWentOn, TroubleMet
from lab.teaching.lesson_plan import LessonPlan
from lab.teaching.teacher import Teacher
from lab.toolbox.index import KnownPolicies
from lab.toolbox.registry import Toolbox
from lab.workers import Workers


@pytest.fixture(scope="module")
def task() -> Task:
    """The shipped cell without buffers and with machines that take seconds: three moves bring a toast to the end."""
    shipped = load("toast")
    still = tuple(o.model_copy(update={"area": (0.0, 0.0)}) for o in shipped.obstacles)
    stations = tuple(
        s.model_copy(update={"processing_s": 4.0} if s.name == "toaster" else {}) for s in shipped.stations
    )
    brisk = {name: p.model_copy(update={"speed_m_s": 0.2, "dwell_s": 0.05}) for name, p in shipped.processes.items()}
    route = tuple(Stage(station=stage.station) for stage in shipped.parts[0].routes[0])
    return shipped.changed(obstacles=still, stations=stations, processes=brisk, parts=(with_route(shipped, route),))


def with_route(task: Task, route: tuple[Stage, ...]) -> Part:
    """The slice of the shipped cell on another way."""
    return task.parts[0].model_copy(update={"routes": (route,)})


@pytest.fixture(scope="module")
def layout(task: Task) -> Layout:
    return Layout(tuple(o.position_m for o in task.obstacles), ((0.006, -0.003, 0.04),))


@pytest.fixture(scope="module")
def surveys(task: Task, layout: Layout) -> Surveys:
    return Surveys(task, ("slice",), layout)


@pytest.fixture(scope="module")
def taught(
    layout: Layout, surveys: Surveys, tmp_path_factory: pytest.TempPathFactory
) -> Callable[[Task, Order], Prepared]:
    """A task with its skills, learned from the expert."""
    teacher = Teacher(Toolbox(tmp_path_factory.mktemp("skills")))

    def teach(task: Task, order: Order) -> Prepared:
        skillset = SkillSet.of(task, order)
        problems = {name: skill.setup(surveys) for name, skill in skillset.skills.items()}
        for name, problem in problems.items():
            settings = task.subtask(problem.subtask)
            lesson = LessonPlan(problem, settings.learner, settings.gate, task.name)
            skillset.policies[name] = teacher.find_or_teach(lesson, KnownPolicies.of([])).policy
        return Prepared(task, order, 0, layout, surveys, skillset, problems)

    return teach


@pytest.fixture(scope="module")
def prepared(task: Task, taught: Callable[[Task, Order], Prepared]) -> Prepared:
    return taught(task, ("slice",))


@pytest.fixture(scope="module")
def skillset(prepared: Prepared) -> SkillSet:
    return prepared.skillset


@pytest.fixture(scope="module")
def told() -> list[tuple[str, float]]:
    """What `measure` said on its way."""
    return []


@pytest.fixture(scope="module")
def durations(prepared: Prepared, told: list[tuple[str, float]]) -> Durations:
    return measure(prepared, lambda name, seconds: told.append((name, seconds)))


@pytest.fixture(scope="module")
def cell(task: Task, durations: Durations) -> Cell:
    return cell_of(task, durations, ("slice",))


@pytest.fixture
def clueless(skillset: SkillSet) -> Iterator[Callable[[str], None]]:
    """Lets a skill forget all it knows; it knows it again after the test."""
    kept = dict(skillset.policies)

    def forget(name: str) -> None:
        skillset.policies[name] = replace(kept[name], q=np.zeros_like(kept[name].q))

    yield forget
    skillset.policies.update(kept)


class Watcher:
    """A live viewer that keeps what it is shown."""

    def __init__(self) -> None:
        self.bodies: tuple[Body, ...] = ()
        self.frames: list[Frame] = []

    def show(self, bodies: tuple[Body, ...]) -> None:
        self.bodies = bodies

    def update(self, frame: Frame) -> None:
        self.frames.append(frame)


def test_every_needed_move_is_measured(skillset: SkillSet, durations: Durations, told: list[tuple[str, float]]) -> None:
    assert set(durations.empty_s) == set(skillset.moves.empty)
    assert [way[:2] for way in durations.loaded_s] == list(skillset.moves.loaded)
    assert {way.kind for way in durations.loaded_s} == {"slice"}
    assert set(durations.process_s) == {"butter_applier"}
    times = [*durations.empty_s.values(), *durations.loaded_s.values(), *durations.process_s.values()]
    assert all(1.0 < seconds < 40.0 for seconds in times)
    assert min(durations.loaded_s.values()) > max(durations.empty_s.values())  # grasping and placing included
    assert durations.sim_s > sum(times)
    assert sorted(seconds for _, seconds in told) == sorted(times)
    assert {"plate > toaster with slice, loaded", "butter at butter_applier", "toaster_buffer > plate, empty"} <= {
        n for n, _ in told
    }


def test_measuring_again_gives_the_same_to_the_last_bit(task: Task, taught: Callable[[Task, Order], Prepared]) -> None:
    first, *_, last = task.parts[0].routes[0]
    short = taught(task.changed(parts=(with_route(task, (first, last)),)), ("slice",))
    one = measure(short)
    assert list(one.loaded_s) == [("plate", "finished_plate", "slice")]
    assert one == measure(short)


def test_times_do_not_depend_on_how_many_processes_share_the_trials(prepared: Prepared, durations: Durations) -> None:
    with Workers(3) as workers:
        assert measure(prepared, workers=workers) == durations


def test_a_move_that_cannot_be_measured_is_a_failure_that_says_so(
    prepared: Prepared, clueless: Callable[[str], None]
) -> None:
    clueless("grasp at plate")
    with pytest.raises(WorkFailed, match=r"^measuring 'grasp at plate': policy 'grasp at plate \w+' does not reach"):
        measure(prepared)


def test_one_toast_is_delivered_in_the_time_predicted(prepared: Prepared, skillset: SkillSet, cell: Cell) -> None:
    heard: list[Event] = []
    watcher = Watcher()
    outcome, recording = carry_out(prepared, cell, (1, 1, 1), Conditions(viewer=watcher), heard.append)
    moves = [event.move for event in heard if isinstance(event, MoveMade)]
    assert outcome.failure is None
    assert (outcome.delivered, outcome.dropped, outcome.retries) == ((1,), (), ())
    predicted = simulate(cell, (1, 1, 1))
    assert outcome.schedule.makespan_s == pytest.approx(predicted.makespan_s, rel=0.03)
    assert outcome.schedule.sequence == (1, 1, 1)
    assert [(m.origin, m.target) for m in moves] == list(skillset.moves.loaded)
    assert moves[1].pick_s >= moves[0].drop_s + 4.0  # the toaster's time
    assert 0 < max(outcome.camera_deviations_m) < 0.008
    recording.check()
    assert (watcher.bodies, watcher.frames) == (recording.bodies, recording.frames)
    shown = [name for frame in recording.frames for name, visible in frame.visible.items() if visible]
    assert shown[0] == "done slice 1 at toaster"
    assert sorted(shown[1:]) == [f"butter on slice 1 {row}{column}" for row in range(3) for column in range(3)]
    last = recording.frames[-1].poses["slice 1"]
    spot = places_of(skillset.task).spots(skillset.task.station("finished_plate"))[0]
    assert (last[0], last[1]) == pytest.approx((spot.x, spot.y), abs=0.005)
    assert outcome.sim_s >= outcome.schedule.makespan_s


def failed(outcome: Outcome, where: str, why: str) -> None:
    """It was tried three times, each noted, and then told which part, where and why."""
    assert outcome.failure == f"slice 1 at '{where}': {why} (tried {MAX_TRIES} times)"
    assert len(outcome.retries) == MAX_TRIES == 3
    assert outcome.delivered == ()
    assert all(f"try {n}: {why}" in text for n, text in enumerate(outcome.retries, start=1))


@pytest.mark.parametrize(
    ("skill", "where"),
    [
        ("grasp at plate", "plate"),
        ("transfer plate to insert with slice", "toaster"),
        ("insert at toaster", "toaster"),
    ],
)
def test_a_step_that_goes_on_failing_stops_the_run_with_part_place_and_reason(
    skill: str,
    where: str,
    prepared: Prepared,
    skillset: SkillSet,
    cell: Cell,
    clueless: Callable[[str], None],
) -> None:
    clueless(skill)
    heard: list[Event] = []
    outcome, _ = carry_out(prepared, cell, (1, 1, 1), tell=heard.append)
    start = skillset.skills[skill].reason
    assert start.startswith(f"policy '{skillset.policies[skill].name}' does not reach its goal from ")
    failed(outcome, where, start)
    assert [event for event in heard if isinstance(event, MoveRetried)] == [MoveRetried(why) for why in outcome.retries]
    assert all(text.startswith(f"slice 1 at '{where}', '{skill}', try ") for text in outcome.retries)
    assert outcome.schedule.robot == ()


def test_where_no_learned_way_leads_the_empty_gripper_goes_by_free_cells(
    prepared: Prepared, cell: Cell, clueless: Callable[[str], None]
) -> None:
    clueless("transfer toaster_buffer to plate")
    outcome, _ = carry_out(prepared, cell, (1, 1, 1))
    assert (outcome.delivered, outcome.failure) == ((1,), None)
    assert len(outcome.retries) == 1
    assert "'transfer toaster_buffer to plate', try 1: policy " in outcome.retries[0]


def test_slippery_slices_are_not_delivered_and_said_to_be_gone(task: Task, prepared: Prepared, cell: Cell) -> None:
    oily = task.changed(parts=(task.parts[0].model_copy(update={"friction": 0.0}),))
    outcome, recording = carry_out(replace(prepared, skillset=replace(prepared.skillset, task=oily)), cell, (1, 1, 1))
    assert outcome.failure is not None
    assert outcome.failure.startswith("slice 1 ")  # where it lies hangs on how it slipped
    assert outcome.retries[0] == (
        "slice 1 at 'plate', 'grasp at plate', try 1: slice 1 is not in the gripper after grasping at 'plate'"
    )
    assert outcome.delivered == ()
    assert outcome.dropped == (1,)
    recording.check()


class Ground:
    """A floor with a production on it, begun at the robot's start."""

    def __init__(self, world: World, prepared: Prepared, cell: Cell) -> None:
        self.state, self.heard = RunState.of(cell), list[Event]()
        self.spoil: Callable[[], None] | None = None  # called after each step instead of looking after the machines
        scene = prepared.skillset, prepared.layout, prepared.order
        hooks = Hooks(after_step=self.after_step, hear=lambda event, step: self.heard.append(event))
        self.floor = Floor(world, *scene, hooks=hooks)
        self.floor.stand(prepared.surveys.approach(cell.robot_start))
        self.floor.restart_clock()
        self.production = Production.of(self.floor, self.state)

    def after_step(self, floor: Floor) -> None:
        if self.spoil is None:
            watch_machines(self.state, floor)
        else:
            self.spoil()

    @property
    def notes(self) -> list[str]:
        return self.state.notes

    def put(self, name: str, x: float, y: float, z: float) -> None:
        self.floor.world.put(name, (x, y, z))


@pytest.fixture
def ground(prepared: Prepared, cell: Cell) -> Iterator[Ground]:
    with World() as world:
        yield Ground(world, prepared, cell)


def test_a_slice_that_was_moved_is_taken_up_where_it_stands(ground: Ground) -> None:
    ground.put("slice 1", 0.30, 0.30, 0.061)  # on the table, half a metre from its plate
    assert ground.production.carry_out((1,)) is None
    trouble = [event for event in ground.heard if isinstance(event, TroubleMet)]
    assert [(one.part, one.answer) for one in trouble] == [("slice 1", "takes it up there")]
    assert ground.notes == []
    assert ground.state.moves[0].target == "toaster"


def test_a_way_that_cannot_be_gone_is_tried_a_few_times_not_for_ever(
    ground: Ground, monkeypatch: pytest.MonkeyPatch
) -> None:
    def too_high(*_: object) -> Iterator[None]:
        yield from ()
        raise WorkFailed("the tool cannot reach (0.541, -0.330, 0.460) m")

    monkeypatch.setattr("lab.production.transfers.by_free_cells", too_high)
    ground.state.place = ""
    stopped = ground.production.carry_out((1,))
    assert stopped == "'plate': the tool cannot reach (0.541, -0.330, 0.460) m (tried 3 times)"


def test_a_slice_set_down_beside_the_slot_is_picked_up_again_and_inserted(ground: Ground, task: Task) -> None:
    floor = ground.floor
    x, y, _ = task.station("toaster").pose
    spoiled: list[float] = []

    def spoil() -> None:
        insert = floor.skillset.skills["insert at toaster"]
        if insert.status is Status.RUNNING and floor.bench.held is None and not spoiled:
            spoiled.append(floor.now_s)
            floor.world.put("slice 1", (x, y - 0.11, 0.06))  # beside the toaster

    ground.spoil = spoil
    failure = ground.production.carry_out((1,))
    assert spoiled
    assert failure is None, ground.notes
    assert len(ground.notes) == 1
    assert "slice 1 is not in the slot of 'toaster'" in ground.notes[0]


def test_a_slice_set_down_beside_its_spot_on_the_last_plate_is_taken_up_again_and_delivered(
    ground: Ground, task: Task
) -> None:
    floor = ground.floor
    x, y, _ = task.station("finished_plate").pose
    spoiled: list[float] = []

    def spoil() -> None:
        place = floor.skillset.skills["place at finished_plate"]
        if place.status is Status.RUNNING and floor.bench.held is None and not spoiled:
            spoiled.append(floor.now_s)
            floor.world.put("slice 1", (x - 0.03, y + 0.02, 0.073))

    ground.spoil = spoil
    failure = ground.production.carry_out((1, 1, 1))
    assert spoiled
    assert failure is None, ground.notes
    assert [note for note in ground.notes if "does not stand on 'finished_plate'" in note] == ground.notes
    assert len(ground.notes) == 1
    assert floor.bench.stands("slice 1", ground.state.spot_of["slice 1"], 0.012)


def at_butter(ground: Ground, surveys: Surveys) -> MachineWork:
    """Slice 1 and the robot are at the butter applier, which begins with it."""
    floor, state = ground.floor, ground.state
    for decision in (1, 1):  # plate to toaster, toaster to butter_applier
        state.plan.move(decision)
    ground.put("slice 1", 0.80, -0.52, 0.0805)
    state.spot_of["slice 1"] = floor.scene.places.spots(floor.skillset.task.station("butter_applier"))[0]
    floor.stand(surveys.approach("butter_applier"))
    state.place = "butter_applier"
    return floor.begin("butter_applier", "slice 1", 20.0)


def test_a_machine_that_failed_while_the_robot_was_away_is_noticed_and_tried_again(
    ground: Ground, surveys: Surveys, task: Task
) -> None:
    """The butter's failure is over long before the robot asks for the slice; that goes to the first plate that is free."""
    state, places = ground.state, ground.floor.scene.places
    plates = places.spots(task.station("finished_plate"))
    butter = at_butter(ground, surveys).skill
    assert isinstance(butter, Cover)
    butter.fail("the butter missed 9 of 9 cells")
    state.taken |= {plates[0]}
    assert ground.production.carry_out((1,)) is None
    assert ground.notes == ["slice 1 at 'butter_applier', try 1: the butter missed 9 of 9 cells"]
    assert len(butter.covered) == 9
    assert state.spot_of["slice 1"] == plates[1]


def test_a_machine_that_goes_on_failing_is_out_of_order_and_its_part_is_left(
    ground: Ground, clueless: Callable[[str], None], surveys: Surveys
) -> None:
    clueless("butter at butter_applier")
    at_butter(ground, surveys)
    failure = ground.production.carry_out((1,))
    assert failure is not None
    assert failure.startswith("slice 1 at 'butter_applier': policy 'butter at butter_applier ")
    assert failure.endswith(f"(tried {MAX_TRIES} times)")
    assert list(ground.state.out) == ["butter_applier"]


def test_a_part_that_may_not_move_is_a_failure_in_words(ground: Ground) -> None:
    for decision in (1, 1, 1):
        ground.state.plan.move(decision)
    assert ground.production.carry_out((1,)) == "slice 1 is already at 'finished_plate'"


def test_a_grasp_can_be_tried_alone(prepared: Prepared, clueless: Callable[[str], None]) -> None:
    grasp, trial = prepared.skillset.skills["grasp at plate"], trial_of(prepared)
    assert grasp.tried
    assert trial(grasp.problem, prepared.skillset.policies[grasp.name]) is None
    clueless(grasp.name)
    assert "does not reach its goal" in (trial(grasp.problem, prepared.skillset.policies[grasp.name]) or "")


def test_time_is_skipped_only_while_nothing_moves(ground: Ground, surveys: Surveys) -> None:
    """Ten seconds: one at a time, but not the last quarter; while a machine's head moves, or for a short time: one step."""
    floor = ground.floor
    before = floor.now_s
    floor.wait(before + 0.2)
    assert floor.now_s == pytest.approx(before + TIME_STEP)
    assert floor.skipped_s == 0.0
    at_butter(ground, surveys)
    before = floor.now_s
    floor.wait(before + 10.0)
    assert floor.now_s == pytest.approx(before + TIME_STEP)
    floor.take_out("slice 1")
    before = floor.now_s
    floor.wait(before + 10.0)
    assert floor.now_s == pytest.approx(before + SKIPPED_STEPS * TIME_STEP)
    while floor.skipped_s < 10.0 - (AT_REST_STEPS + 1) * TIME_STEP:
        floor.wait(before + 10.0)
    assert floor.now_s == pytest.approx(before + 10.0 - AT_REST_STEPS * TIME_STEP)


def test_an_emergency_stop_holds_every_joint_within_one_step(ground: Ground) -> None:
    """In the middle of a way at full speed; reset and go on, and the move is done again from there."""
    floor, arm = ground.floor, ground.floor.scene.robot.arm
    held: list[float] = []

    def press() -> None:
        if floor.steps == 200:
            floor.controls.emergency()
            held.append(float(np.abs(floor.world.joint_speeds(NAME, arm.joints)).max()))
        elif floor.steps == 201 or floor.steps == 300:
            held.append(float(np.abs(floor.world.joint_speeds(NAME, arm.joints)).max()))
        elif floor.steps == 301:
            assert floor.controls.go_on() == RESET_FIRST
            assert floor.controls.reset() == ""
            assert floor.controls.go_on() == ""

    ground.spoil = press
    assert ground.production.carry_out((1,)) is None
    assert held[0] > 0.5
    assert held[1:] == pytest.approx([0.0, 0.0], abs=1e-3)
    stops = [
        (e.kind, e.by) if isinstance(e, RunHeld) else "on" for e in ground.heard if isinstance(e, (RunHeld, RunWentOn))
    ]
    assert stops == [("emergency", "operator"), "on"]
