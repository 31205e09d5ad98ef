"""The teacher: finds a fitting policy in the toolbox, or teaches a new one and saves it, even if it is interrupted."""

from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import asdict, dataclass, field, replace

from lab.advice.advising import Advising
from lab.advice.entries import Closed
from lab.advice.journal import Again, Journal
from lab.errors import BadInput, LabError, WorkFailed, counted
from lab.learning.environment import TableEnvironment
from lab.learning.problem import Problem
from lab.learning.session_result import SessionResult
from lab.mdp import TabularMDP
from lab.teaching.events import KeptBeside, LessonBegan, LessonContinued, PolicyAdvises, RecordSkipped, Tell, unheard
from lab.teaching.lesson_plan import Interrupted, Keep, Lesson, LessonPlan, Source, Trial
from lab.teaching.lesson_sessions import RunsSessions, Sessions, fits, joined
from lab.toolbox.composition import composed
from lab.toolbox.fitness import Fitness, best_fit, reference
from lab.toolbox.index import KnownPolicies
from lab.toolbox.policy import MAX_NAME_LENGTH, Origin, Policy, is_name
from lab.toolbox.registry import Toolbox

_UNFINISHED = " unfinished"
_REUSED = "reused"  # the kind of records that note which policy was used for another problem than its own
_LONGEST_PROBLEM = MAX_NAME_LENGTH - 20  # characters of a policy's name; the rest is for its signature and state


@dataclass(frozen=True)
class Teacher:
    """A teacher, with the toolbox that policies are saved in, the advisors, the seed and the listener.

    keep: returns the journal of a lesson, by default one that is not written; begun: for a resumed lesson, returns the policy
    that it continued or was warm-started from; trial: tries a learned policy in physics before it is saved, and a found one
    before it is used; sessions: makes the sessions of a lesson, with the arguments of `Sessions` and its method `run`; composes:
    whether ways are put together out of shorter ones, see `find_or_teach`.
    """

    toolbox: Toolbox
    advising: Advising = field(default_factory=Advising)
    seed: int = 0
    tell: Tell = unheard
    keep: Keep = lambda plan: Journal()
    begun: Callable[[Problem], Policy | None] | None = None
    trial: Trial | None = None
    sessions: Callable[..., RunsSessions] = Sessions
    composes: bool = False

    def find_or_teach(self, plan: LessonPlan, known: KnownPolicies) -> Lesson:
        """A policy that reaches the goal of this problem: found in `known`, or learned now.

        In this order: a solved policy of exactly this problem is reused; one of another problem that fits (see
        `lab.toolbox.fitness`) is reused, and not saved again; an unsolved one of this problem is continued; one of another
        problem is adapted; otherwise the lesson begins anew. A teacher that composes does not adapt one policy if the
        problem has one start: it puts the moves of all together (see `lab.toolbox.composition`), uses that if it is a shortest
        path, and otherwise begins the lesson from it. Raises WorkFailed if no session reaches the goal, Interrupted on Ctrl-C.
        """
        problem = plan.problem
        ready, found, fitting = self._looked_up(plan, known)
        if ready is not None:
            return ready
        if found is not None:
            lesson = self.teach(replace(plan, unfinished=found))
            return _explained(lesson, f"'{found.name}' was left unfinished", found, problem)
        if self.composes and (put_together := self._composed(plan, known)) is not None:
            return put_together
        if fitting is None:
            return replace(self.teach(plan), reason="nothing in the toolbox has its states and moves")
        policy, fitness = fitting
        parent = policy if fitness.verdict == "adapt" else None
        lesson = self.teach(replace(plan, warm=parent))
        saved = (0, 0) if parent is None else _saved(plan, parent, lesson.result)
        lesson = replace(lesson, parent=parent, fitness=fitness, saved=saved)
        return _explained(lesson, _reason(policy, fitness, plan), policy, problem)

    def find(self, plan: LessonPlan, known: KnownPolicies) -> Lesson | None:
        """The policy that `find_or_teach` would reuse, None if it would teach."""
        return self._looked_up(plan, known)[0]

    def _looked_up(
        self, plan: LessonPlan, known: KnownPolicies
    ) -> tuple[Lesson | None, Policy | None, tuple[Policy, Fitness] | None]:
        """(the lesson of a reused policy, the policy of this problem, the best one of another problem with its fitness)."""
        problem = plan.problem
        found = known.get((problem.subtask, problem.mdp.signature))
        if found is not None and not _belongs(found, problem.mdp):
            found = None
        if found is not None and found.solved and fits(found.q, problem, plan.learner):
            reason = f"it was learned in exactly this problem{_elsewhere(found, plan)}"
            return _reused(plan, found, reason), found, None
        fitting = None
        if problem.environment is None:
            fitting = best_fit(self._candidates(known, problem), problem.mdp, plan.learner.discount)
        if fitting is not None and fitting[1].verdict == "use":
            policy, fitness = fitting
            failure = None if self.trial is None else self.trial(problem, policy)
            if failure is None:
                self._remember(problem, {"policy": reference(policy)})
                return _reused(plan, policy, _reason(policy, fitness, plan), fitness), found, fitting
            fitting = policy, replace(fitness, verdict="refuse", reason=f"in physics, {failure}")
        return None, found, fitting

    def _composed(self, plan: LessonPlan, known: KnownPolicies) -> Lesson | None:
        """The lesson of a policy that is put together from the moves of others, or begun from it; None if none of them count."""
        problem = plan.problem
        made = None
        if problem.environment is None:
            made = composed(candidates(known, problem), problem.mdp, plan.learner.discount)
        if made is None:
            return None
        judged = TableEnvironment(problem.mdp).judge(made.q, plan.learner)
        origin = Origin(plain_name(problem), problem.subtask, plan.task, "nobody", self.seed)
        result = SessionResult.of_table(made.q, made.visits, judged)
        policy = Policy.of(result, problem.mdp, plan.learner, plan.gate, origin)
        policy = replace(policy, scene=problem.scene, arm=problem.arm)
        if policy.solved and (self.trial is None or self.trial(problem, policy) is None):
            self.toolbox.check()
            self.toolbox.put(policy)
            return Lesson(policy, "composed", reason=made.reason, saved=_saved(plan, policy))
        lesson = self.teach(replace(plan, warm=policy, composed=True))
        return replace(lesson, reason=made.reason, parent=policy, saved=_saved(plan, policy, lesson.result))

    def _candidates(self, known: KnownPolicies, problem: Problem) -> Iterator[Policy]:
        """The `candidates`, beginning with the one that was used for this problem before, so that runs repeat."""
        record = None
        try:
            record = self.toolbox.load_record(_REUSED, _record_key(problem))
        except BadInput as error:  # the order of candidates is not essential
            self.tell(RecordSkipped(str(error)))
        return candidates(known, problem, first=str((record or {}).get("policy")).rpartition("@")[0])

    def _remember(self, problem: Problem, record: dict[str, str]) -> None:
        """Records which policy is used for a problem, unless it is recorded already; a failure is only reported."""
        with suppress(BadInput):  # a damaged record is replaced
            if self.toolbox.load_record(_REUSED, _record_key(problem)) == record:
                return
        try:
            self.toolbox.save_record(_REUSED, _record_key(problem), record)
        except LabError as error:
            self.tell(RecordSkipped(f"what is used for '{problem.name}': {error}"))

    def unfinished(self, problem: Problem, name: str | None = None) -> Policy | None:
        """The unsolved policy to continue: the one of that name, the best one, or the unfinished one beside a solved one."""
        key = (problem.subtask, problem.mdp.signature)
        for wanted in (name or plain_name(problem), None, f"{plain_name(problem)}{_UNFINISHED}"):
            found = self.toolbox.find(*key, wanted)
            if found is not None and not found.solved and _belongs(found, problem.mdp):
                return found
        return None

    def continuing(self, plan: LessonPlan) -> LessonPlan:
        """The plan, begun from a policy that was interrupted, or left unsolved by the same learner, gate and advisor, if any.

        A resumed lesson begins from the policy that it began from before. Raises BadInput if the plan's name is that of another
        problem's policy.
        """
        problem, name = plan.problem, plan.name
        for row in self.toolbox.list() if name is not None else ():
            if row["name"] == name and (row["subtask"], row["signature"]) != (problem.subtask, problem.mdp.signature):
                raise BadInput(
                    f"policy name '{name}' (--save): it is the name of a policy for '{row['subtask']}' in another "
                    f"problem ({row['signature'][:8]}): choose another name, or remove that policy"
                )
        if self.begun is not None:
            found = self.begun(problem)
            if found is not None and found.signature != problem.mdp.signature:
                return replace(plan, warm=found)
        else:
            found = self.unfinished(problem, name)
            if found is not None and (self.advising.records or not self._same(found, plan)):
                found = None  # another learner, gate or advisor begins anew, so that they can be compared
            if found is not None:
                self.tell(LessonContinued(found))
        return replace(plan, unfinished=found)

    def _same(self, policy: Policy, plan: LessonPlan) -> bool:
        """Whether a policy was learned with these settings and advisors, or interrupted with the same learner."""
        length = {"episodes": 0}
        broken_off = len(policy.curve) < policy.learner.get("episodes", 0)
        alike = policy.gate == asdict(plan.gate) and policy.advisor == str(self.advising)
        return policy.learner | length == asdict(plan.learner) | length and (alike or broken_off)

    def teach(self, plan: LessonPlan) -> Lesson:
        """The result of the planned lesson, whose policy is saved, solved or not.

        Raises WorkFailed if several sessions do not reach the goal, BadInput before learning if the toolbox is not writable.
        """
        self.toolbox.check()
        problem, unfinished = plan.problem, plan.unfinished
        for known in self.advising.check_records(problem.mdp):
            self.tell(PolicyAdvises(known))
        journal = self.keep(plan)
        try:
            result = None
            while result is None:
                self.tell(LessonBegan(plan, journal))
                try:
                    result = self.sessions(plan, self.advising, self.seed, journal, self.tell).run()
                except Again:  # an answer was taken back
                    journal.rewind()
            name = plan.name or self._free_name(problem, result.solved)
            origin = Origin(name, problem.subtask, plan.task, str(self.advising), self.seed)
            policy = Policy.of(joined(unfinished, result), problem.mdp, plan.learner, plan.gate, origin)
            policy = replace(policy, parent=_parent(plan), scene=problem.scene, arm=problem.arm)
            failure = None
            if not (result.interrupted or journal.read_only):
                policy, failure = self._tried(problem, policy)
            if not (result.interrupted and journal.folding):  # otherwise the saved policy has learned more
                saved = self.toolbox.put(policy)
                if not saved.in_use:
                    self.tell(KeptBeside(policy.name, saved.version, saved.why_not))
            if not result.interrupted:
                ended = (len(result.steps), result.final_steps, result.optimal_steps, policy.solved)
                journal.closes(Closed(*ended, saved_as=policy.name))
        finally:
            journal.close()
        if policy.solved and unfinished is not None and unfinished.name == f"{policy.name}{_UNFINISHED}":
            with suppress(BadInput):  # it may have been removed
                self.toolbox.remove(unfinished.name)  # the finished policy has the plain name
        length = counted(len(result.steps), "episode")
        if result.interrupted:
            raise Interrupted(f"stopped by Ctrl-C after {length} of '{problem.name}'; what was learned is kept")
        if plan.sessions > 1 and not journal.read_only and not fits(result.q, problem, plan.learner):
            raise WorkFailed(
                f"'{problem.name}' was not learned in {length} with the advisor '{self.advising}'; "
                "what was learned is kept: try a better advisor, or more episodes in the task file"
            )
        source: Source = "learned" if unfinished is None else "continued"
        return Lesson(policy, source if plan.warm is None else "adapted", result, failure)

    def _tried(self, problem: Problem, policy: Policy) -> tuple[Policy, str | None]:
        """(policy, failure): if it failed in physics, the policy counts as unsolved, and does not replace a solved one."""
        if self.trial is None:
            return policy, None
        kept, unproven = self.toolbox.find(policy.subtask, policy.signature, policy.name), policy
        if policy.solved:
            beside = f"{policy.name[: MAX_NAME_LENGTH - len(_UNFINISHED)]}{_UNFINISHED}"
            unproven = replace(policy, solved=False, name=beside if kept is not None and kept.solved else policy.name)
        try:
            failure = self.trial(problem, policy)
        except BaseException:  # also on Ctrl-C, what was learned is saved
            self.toolbox.save(unproven)
            raise
        return (policy if failure is None else unproven), failure

    def _free_name(self, problem: Problem, solved: bool) -> str:
        """The name to save under; an unfinished policy never replaces a solved one."""
        name = plain_name(problem)
        kept = None if solved else self.toolbox.find(problem.subtask, problem.mdp.signature, name)
        return f"{name}{_UNFINISHED}" if kept is not None and kept.solved else name


def candidates(known: KnownPolicies, problem: Problem, first: str = "") -> Iterator[Policy]:
    """The solved policies of a problem's sub-task and table size: `first`, then those of the same skill, then the newest."""
    own = f"{problem.name[:_LONGEST_PROBLEM]} "
    found = known.alike(problem.subtask, problem.mdp.n_states, problem.mdp.n_actions)
    for key, _ in sorted(found, key=lambda one: (one[1] != first, not one[1].startswith(own))):
        with suppress(KeyError):  # damaged, or removed meanwhile
            yield known[key]


def _record_key(problem: Problem) -> str:
    return f"{problem.subtask} {problem.mdp.signature}"


def _explained(lesson: Lesson, reason: str, found: Policy, problem: Problem) -> Lesson:
    """The lesson with its reason, which names the arm of the found policy if that is another one."""
    if problem.arm == found.arm or not found.arm:
        return replace(lesson, reason=reason)
    return replace(lesson, reason=f"learned with the arm {found.arm}; {reason}", other_arm=found.arm)


def _reused(plan: LessonPlan, policy: Policy, reason: str, fitness: Fitness | None = None) -> Lesson:
    lesson = Lesson(policy, "reused", fitness=fitness, saved=_saved(plan, policy))
    return _explained(lesson, reason, policy, plan.problem)


def _reason(policy: Policy, fitness: Fitness, plan: LessonPlan) -> str:
    """The policy, its task if that is another one, and the reason for the verdict on it."""
    return f"'{policy.name}'{_elsewhere(policy, plan)}: {fitness.reason}"


def _elsewhere(policy: Policy, plan: LessonPlan) -> str:
    """The task that a policy was learned for, in words; "" if it is this one."""
    return "" if policy.task == plan.task else f" of task '{policy.task}'"


def _saved(plan: LessonPlan, found: Policy, now: SessionResult | None = None) -> tuple[int, int]:
    """The episodes and helped steps that a found policy saves, see `Lesson`."""
    episodes, helped = (0, 0) if now is None else (len(now.steps), now.helped_steps)
    return max(len(found.curve), plan.learner.episodes) - episodes, found.helped_steps - helped


def _parent(plan: LessonPlan) -> str:
    """The reference to the policy that this one was warm-started from, in this lesson or before; "" for none."""
    if plan.warm is not None:
        return "" if plan.composed else reference(plan.warm)
    return "" if plan.unfinished is None else plan.unfinished.parent


def check_name(name: str | None) -> None:
    """Raises BadInput unless a policy may have this name."""
    if name is not None and not is_name(name):
        raise BadInput(f"policy name '{name}' (--save): wanted 1 to {MAX_NAME_LENGTH} printable characters")


def plain_name(problem: Problem) -> str:
    """The default name of a policy of this problem."""
    return f"{problem.name[:_LONGEST_PROBLEM]} {problem.mdp.signature[:8]}"


def _belongs(policy: Policy, mdp: TabularMDP) -> bool:
    """Whether a policy with a problem's signature also has its table size and actions."""
    return policy.q.shape == (mdp.n_states, mdp.n_actions) and policy.action_labels == mdp.action_labels
