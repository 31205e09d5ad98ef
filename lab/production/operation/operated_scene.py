"""The scene in which the operator works: it is laid out, taught, ordered and carried out by commands, each checked first."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from threading import RLock
from typing import Any, NamedTuple

from lab.advice.advisors import PYTHON, AdvisorName, RecordedAdvisor
from lab.errors import BadInput, WorkFailed, unknown
from lab.export.recorder import MotionRecorder
from lab.production.composer import Conditions, Production, noting
from lab.production.controls import RESET_FIRST, StopKind
from lab.production.faults.injector import Injector, draw
from lab.production.floor import Floor, Hooks
from lab.production.operation.by_hand import ByHand
from lab.production.operation.commands import OPERATOR, Spoken
from lab.production.operation.lead import DROP, END, EVERY, Demonstration, Lead, led_in_words
from lab.production.operation.order_words import order_in_words
from lab.production.order import GIVEN, OrderAdvice, checked, ordered
from lab.production.order_learning import OrderLearning
from lab.production.parts_in_machines import watch_machines
from lab.production.replanning import Planner
from lab.production.run_journal import Led
from lab.production.run_state import RunState
from lab.production.run_status import RunStatus
from lab.production.taught import Relearner, Taught, skill_row, teach_all
from lab.production.transfers import bodies_of
from lab.sequencing.cell.routes import part_of
from lab.sequencing.methods.exact import Optimum
from lab.sequencing.search import SequenceResult
from lab.sequencing.simulate.follow import simulate
from lab.sim.world import World
from lab.skills import Skill
from lab.skills.prepared_scene import Prepared, prepare
from lab.skills.trial import trial_of
from lab.tasks.fault_fields import FaultFields
from lab.tasks.task import Order, Task, counts_from_word, in_words
from lab.teaching.events import Event, PhaseBegan, PlanMade, SkillReady, TroubleMet
from lab.teaching.lesson_plan import Lesson, LessonPlan
from lab.teaching.teacher import Teacher

Deed = Callable[[], str]  # carries a checked command out, and returns its result in words; raises WorkFailed
LAY_OUT = "parts lays the scene out anew"
PROTECTED = "a protective stop holds the robot: go first"


class Left(KeyboardInterrupt):
    """The operator has left during a command."""


@dataclass
class Plan:
    """The taught skills, the order to carry out, its proven bound, and how it was learned."""

    taught: Taught
    found: SequenceResult
    method: str
    proven: Optimum
    production: Production
    learning: OrderLearning

    @property
    def state(self) -> RunState:
        """The state of the job that this plan carries out."""
        return self.production.state


class SceneCalls(NamedTuple):
    """What a scene calls. on_laid_out: when it was laid out; before_step: before each physics step; meanwhile: in a pause of the
    run, for what is done by hand; it returns whether that was anything.
    """

    on_laid_out: Callable[[], None]
    before_step: Callable[[], None]
    meanwhile: Callable[[], bool]


class OperatedScene:
    """One operated scene; except `now` and the controls it belongs to the thread that simulates.

    leaving: the current command is aborted. resting: a pause lasts. again: the commands of a journal are repeated.
    """

    def __init__(
        self,
        task: Task,
        order: Order,
        seed: int,
        teacher: Teacher,
        conditions: Conditions,
        calls: SceneCalls,
    ) -> None:
        """Prepares a scene that `open` lays out; the teacher's listener gets its events."""
        self.task, self.order, self.seed, self.conditions = task, order, seed, conditions
        self.controls, self.journal = conditions.controls, conditions.journal
        self.leaving = self.again = self.resting = False
        self.plan: Plan | None = None
        self.lead: Lead | None = None
        self.demonstrations: list[dict[str, Any]] = []  # what came of each, as `Demonstration.judged`
        self.failure: str | None = None
        self.calls = calls
        self._world: World | None = None
        self.lock, self._status = RLock(), RunStatus.of(task, order)
        self._told, self.teacher = teacher.tell, replace(teacher, tell=self.tell)

    def open(self) -> None:
        """Lays the scene out. Raises BadInput for an impossible one."""
        self.prepared: Prepared = prepare(self.task, self.order, self.seed)
        self._build(self.task.faults)

    def _build(self, faults: Sequence[FaultFields]) -> None:
        """Builds the floor, at the beginning of its time."""
        self.close()
        prepared, self.plan, self.lead, self.failure = self.prepared, None, None, None
        self.injector, self.heard = Injector(faults), list[Event]()
        hooks = Hooks(
            before_step=self._reach_in,
            after_step=self._watch,
            meanwhile=self.calls.meanwhile,
            hear=noting(self.journal, self.heard, self.tell),
            note_stops=self.journal.note_stops,
        )
        world = World()
        scene = prepared.skillset, prepared.layout, prepared.order
        floor = self.floor = Floor(world, *scene, controls=self.controls, hooks=hooks)
        self.injector.prepare(floor.scene)
        self.recorder = floor.record(self.conditions.viewer)
        self.motions = MotionRecorder(floor.scene.robot)
        floor.scene.robot.override(self.conditions.override)
        floor.stand(prepared.surveys.approach(self.task.robot.start))
        floor.restart_clock()
        self._world, self.by_hand = world, ByHand(floor, self._ready)
        with self.lock:
            self._status = RunStatus.of(self.task, prepared.order)
        self.calls.on_laid_out()

    def close(self) -> None:
        """Closes the scene; safe to call again."""
        if self._world is not None:
            self._world.close()
            self._world = None

    def check_leaving(self) -> None:
        """Raises Left if the operator has left."""
        if self.leaving:
            raise Left("the operator left")

    def _reach_in(self, floor: Floor) -> bool:
        self._status.now_s, self.resting = floor.now_s, False
        if self.lead is not None and floor.steps % EVERY == 0:
            self.lead.see(floor.scene.robot.tool())
        self.calls.before_step()
        self.check_leaving()
        return self.injector.tick(floor)

    def _watch(self, floor: Floor) -> None:
        if self.plan is not None:
            watch_machines(self.plan.state, floor)

    @property
    def steps(self) -> int:
        """The number of physics steps since the scene was laid out."""
        return 0 if self._world is None else self.floor.steps

    def tell(self, event: Event) -> None:
        """Takes an event over, and passes it on."""
        with self.lock:
            self._status.hear(event)
        self._told(event)
        self.check_leaving()

    def now(self) -> RunStatus:
        """The status of the run, for any thread."""
        with self.lock:
            return self._status.copied()

    def names(self) -> dict[str, list[str]]:
        """The possible arguments of some commands: kinds of parts, and the skills that can be learned and carried out."""
        if self._world is None:
            return {}
        problems = self.prepared.problems
        families = dict.fromkeys(problem.subtask for problem in problems.values())
        return {
            "parts": [part.name for part in self.task.made],
            "learn": [*families, *problems],
            "execute": [*problems],
            "lead": [*problems, END, DROP],
        }

    def trouble(self, why: str) -> None:
        """Reports a failed command."""
        self.floor.tell(TroubleMet(why, "waits for the operator", "", "", self.floor.now_s))

    # ---- commands --------------------------------------------------------------------------------------------------

    def checked(self, said: Spoken) -> Deed:
        """A function that carries out a checked command. Raises BadInput for one that is not allowed."""
        word, argument = said.word, said.argument
        if word == "lead":
            return self._lead(str(argument))
        if said.how == "by hand":
            return self._moved(word, argument)
        match word, argument:
            case "policy", _:
                return self._policy()
            case "run", _:
                return self._run()
            case "order", tuple():
                return self._order(tuple(int(number) for number in argument))
            case "order", str():
                return self._order(order_in_words(argument, self._planned().state.plan))
            case "learn", str():
                return self._learn(argument)
            case "parts", str():
                order = self.task.order(None, counts_from_word(argument))
                return lambda: self._lay_out(order)
        raise BadInput(f"{word}: it is said to a console, not to the run")

    def _lay_out(self, order: Order) -> str:
        self.prepared = prepare(self.task, order, self.seed)
        self.order = order
        self._build(self.task.faults)
        return f"{in_words(order)} laid out"

    def _moved(self, word: str, argument: object) -> Deed:
        """A motion by hand, after which the run continues from the reached state."""
        if self.controls.holds_arm and not self.again:
            raise BadInput(RESET_FIRST if StopKind.EMERGENCY in self.controls.stops else PROTECTED)
        deed = getattr(self.by_hand, word)(*(() if argument is None else (argument,)))

        def moved() -> str:
            try:
                deed()
            finally:
                self.recorder.take()
                if self.plan is not None:
                    self.plan.state.place = ""
            if self.lead is None:
                return ""
            self.lead.see(self.floor.scene.robot.tool())
            return self.lead.where()

        return moved

    # ---- skills and order --------------------------------------------------------------------------------------------

    def _policy(self) -> Deed:
        if self.plan is not None and self.plan.state.moves:
            raise BadInput("policy: the run has begun: parts lays the scene out anew")
        drawn = self.conditions.fault_seed is not None
        if drawn and self.floor.steps:
            raise BadInput("policy: with --faults it comes before the arm is moved: parts lays the scene out anew")

        def deed() -> str:
            taught = teach_all(self.prepared, self.teacher, self.journal)
            self.tell(PhaseBegan("sequence", 1))
            chosen = ordered(taught.cell, self.task.sequencing, OrderAdvice(), self.seed, self.tell)
            result, proven = chosen.found, chosen.proven
            if drawn:
                self._build(
                    (
                        *self.task.faults,
                        *draw(self.task, self.prepared.order, self.conditions.fault_seed or 0, result.cost),
                    )
                )
            relearner = Relearner(self.prepared, taught, self.teacher)
            planner = Planner(self.task.sequencing, self.seed)
            production = Production.of(self.floor, RunState.of(taught.cell, self.floor.now_s), relearner, planner)
            self.plan = Plan(taught, result, chosen.used, proven, production, chosen.learning)
            self.plan.state.sequence = [*result.sequence]
            self._tell_plan("")
            return f"{len(result.sequence)} moves, {result.cost:.1f} s"

        return deed

    def _tell_plan(self, why: str) -> None:
        """Tells the plan in use, with its times counted from now on."""
        plan, now_s = self._planned(), self.floor.now_s
        schedule = simulate(plan.taught.cell, plan.found.sequence).later(now_s)
        gap = plan.proven.gap(plan.found.cost)
        self.tell(PlanMade(schedule, len(plan.found.sequence), gap, plan.proven.proven, now_s, why))

    def _planned(self) -> Plan:
        if self.plan is None:
            raise BadInput("there is no plan yet: policy finds one")
        return self.plan

    def _order(self, sequence: tuple[int, ...]) -> Deed:
        plan = self._planned()
        state = plan.state
        order = checked(state.plan, sequence)
        if state.lost or state.out:
            raise BadInput("order: parts or machines were given up in this run: its plan has to leave them out")

        def deed() -> str:
            state.sequence = [*order.sequence]
            if not state.moves:
                plan.found = replace(plan.found, sequence=order.sequence, cost=order.schedule.makespan_s)
                plan.method = GIVEN
                self._tell_plan(f"the operator's order: {order.words}")
            else:
                schedule = order.schedule.later(self.floor.now_s - state.plan.now_s)
                now_s, why = self.floor.now_s, f"the operator's order: {order.words}"
                self.tell(PlanMade(schedule, len(order.sequence), order.gap, order.proven, now_s, why))
            return order.words

        return deed

    def _ready(self, skill: Skill) -> None:
        """Gives a skill the policy of the journal or the toolbox, as the command `policy` would. BadInput if there is none."""
        name, policies = skill.name, self.prepared.skillset.policies
        if name in policies:
            return
        if (kept := self.journal.skill(name)) is not None:
            policies[name] = kept.policy
            return
        teacher = replace(self.teacher, trial=trial_of(self.prepared))
        lesson = teacher.find(self._plan(name), teacher.toolbox.index()[0])
        if lesson is None:
            raise BadInput(f"'{name}' is not learned yet: policy, or learn {name}")
        self._keep(name, lesson)

    def _plan(self, name: str) -> LessonPlan:
        """The plan of a skill's lesson in this scene."""
        problem = self.prepared.problems[name]
        settings = self.task.subtask(problem.subtask)
        return LessonPlan(problem, settings.learner, settings.gate, self.task.name)

    def _keep(self, name: str, lesson: Lesson) -> None:
        """Gives a skill the policy of a lesson, and keeps it with the run."""
        self.prepared.skillset.policies[name] = lesson.policy
        if not self.again:
            self.journal.keep_skill(skill_row(name, lesson), lesson.policy)
        self.tell(SkillReady(name, lesson))

    def _learn(self, name: str) -> Deed:
        problems = self.prepared.problems
        families = {problem.subtask for problem in problems.values()}
        wanted = [own for own, problem in problems.items() if name in (own, problem.subtask)]
        if not wanted:
            raise unknown("skill", name, [*problems, *families], "learn")

        def deed() -> str:
            teacher = replace(self.teacher, trial=trial_of(self.prepared))
            self.tell(PhaseBegan("learn", len(wanted)))
            for own in wanted:
                self._keep(own, teacher.teach(self._plan(own)))
            self._outdate_plan()
            return f"learned {', '.join(wanted)}"

        return deed

    def _outdate_plan(self) -> None:
        """Drops a plan that was not begun, because its durations are those of the earlier policies."""
        if self.plan is not None and not self.plan.state.moves:
            self.plan = None

    # ---- what a person shows -----------------------------------------------------------------------------------------

    def _lead(self, name: str) -> Deed:
        """Begins the demonstration of a skill's path, ends it and learns from it, or drops it."""
        lead, skills = self.lead, self.prepared.skillset.skills
        if name in (END, DROP):
            if lead is None:
                raise BadInput(f"lead {name}: nothing is led: lead NAME begins")
            return partial(self._learn_from, lead.demonstration()) if name == END else self._dropped
        if lead is not None:
            raise BadInput(f"lead: '{lead.skill.name}' is led: lead {END}, or lead {DROP}, first")
        if name not in skills:
            raise unknown("skill", name, skills, "lead")
        lead = Lead.of(skills[name], "lead")

        def deed() -> str:
            self.lead = lead
            lead.see(self.floor.scene.robot.tool())
            return lead.where()

        return deed

    def _dropped(self) -> str:
        self.lead = None
        return "forgotten"

    def _learn_from(self, shown: Demonstration) -> str:
        """Teaches the skill with the demonstration as its advisor, which the task's gate judges; returns the result in words."""
        name, self.lead = shown.skill.name, None
        self.journal.keep_led(Led(self.floor.steps, name, OPERATOR, shown.said))
        by = AdvisorName(f"led by {OPERATOR}", PYTHON, itself=RecordedAdvisor(shown.moves))
        advising = replace(self.teacher.advising, names=(by,))
        teacher = replace(self.teacher, advising=advising, trial=trial_of(self.prepared))
        self.tell(PhaseBegan("learn", 1))
        plan = self._plan(name)
        # a demonstration is dropped as soon as others are shorter, and not only when the evidence against it is strong
        lesson = teacher.teach(replace(plan, gate=replace(plan.gate, by_evidence=False)))
        self._keep(name, lesson)
        self._outdate_plan()
        self.demonstrations.append(shown.judged(lesson))
        return led_in_words(self.demonstrations[-1])

    # ---- the run -----------------------------------------------------------------------------------------------------

    def _run(self) -> Deed:
        plan = self._planned()
        state = plan.state
        if not state.sequence:
            raise BadInput("run: nothing is left to do: parts lays the scene out anew")
        if not self.again and self.controls.waits and (why := self.controls.go_on()):
            raise BadInput(f"run: {why}")

        def deed() -> str:
            self.tell(PhaseBegan("carry out", len(state.sequence)))
            if not state.moves:
                self._tell_plan("")
            self.held_first()
            self.failure = plan.production.carry_out(state.sequence)
            if self.failure is not None:
                raise WorkFailed(self.failure)
            return f"{len(state.finished)} of {len(self.prepared.order)} parts made"

        return deed

    def held_first(self) -> None:
        """Replans so that the part in the gripper is brought on first. Raises WorkFailed if that is not allowed."""
        held, plan = self.floor.bench.held, self.plan
        if held is None or plan is None or plan.state.under_way is not None:
            return
        state = plan.state
        parts = state.plan.cell.parts
        own = [d for d in state.plan.allowed() if held in bodies_of(self.floor, state, part_of(d, parts))]
        if not own:
            raise WorkFailed(f"{held} is in the gripper and may not be brought on now: put it down, and open")
        if state.sequence[0] not in own:
            state.sequence.insert(0, own[0])
            plan.production.recovery.replan(f"the robot holds {held}")
