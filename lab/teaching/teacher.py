"""Find a policy that fits, or teach a new one and keep it, whatever happens."""

from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import asdict, dataclass, field, replace

from lab.advice.advising import Advising
from lab.advice.entries import Closed
from lab.advice.journal import Again, Journal
from lab.errors import BadInput, LabError, WorkFailed, counted
from lab.learning.problem import Problem
from lab.learning.session_result import SessionResult
from lab.mdp import TabularMDP
from lab.teaching.events import KeptBeside, LessonBegan, LessonContinued, PolicyAdvises, RecordSkipped, Tell, unheard
from lab.teaching.lesson_plan import Interrupted, Keep, Lesson, LessonPlan, Source, Trial
from lab.teaching.lesson_sessions import Sessions, fits, joined
from lab.toolbox.fitness import Fitness, best_fit, reference
from lab.toolbox.index import KnownPolicies
from lab.toolbox.policy import MAX_NAME_LENGTH, Origin, Policy, is_name
from lab.toolbox.registry import Toolbox

_UNFINISHED = " unfinished"
_REUSED = "reused"  # the toolbox's records of which policy was used for a problem that it was not learned in
_LONGEST_PROBLEM = MAX_NAME_LENGTH - 20  # characters of a policy's name; the rest is for its signature and state


@dataclass(frozen=True)
class Teacher:
    """How to teach: who advises, with which seed, whom to tell, and where policies and journals are kept.

    keep: gives the journal of a lesson, by default one that is not written; begun: in a lesson that is resumed, the
    policy that it once went on from, or was warm-started from; trial: tries in physics what was learned, before it is kept,
    and what was learned elsewhere, before it is used.
    """

    toolbox: Toolbox
    advising: Advising = field(default_factory=Advising)
    seed: int = 0
    tell: Tell = unheard
    keep: Keep = lambda plan: Journal()
    begun: Callable[[Problem], Policy | None] | None = None
    trial: Trial | None = None

    def find_or_teach(self, plan: LessonPlan, known: KnownPolicies) -> Lesson:
        """A policy that reaches the goal of this problem: from `known`, by (sub-task, signature), or learned now.

        A solved policy of exactly this problem is reused; then one of any other problem that would give nothing less (see
        `lab.toolbox.fitness`), which is not kept twice. An unsolved one of this problem is learned on from where it stands, and
        followed when it fits though no shorter way was found; then one of another problem is adapted. WorkFailed when no
        session finds a way; Interrupted on Ctrl-C.
        """
        problem = plan.problem
        ready, found, fitting = self._looked_up(plan, known)
        if ready is not None:
            return ready
        if found is not None:
            lesson = self.teach(replace(plan, unfinished=found))
            return _told(lesson, f"'{found.name}' was left unfinished", found, problem)
        if fitting is None:
            return replace(self.teach(plan), reason="nothing in the toolbox has its states and moves")
        policy, fitness = fitting
        parent = policy if fitness.verdict == "adapt" else None
        lesson = self.teach(replace(plan, warm=parent))
        saved = (0, 0) if parent is None else _saved(plan, parent, lesson.result)
        lesson = replace(lesson, parent=parent, fitness=fitness, saved=saved)
        return _told(lesson, _reason(policy, fitness, plan), policy, problem)

    def find(self, plan: LessonPlan, known: KnownPolicies) -> Lesson | None:
        """The policy that `find_or_teach` would reuse, None where it would teach one."""
        return self._looked_up(plan, known)[0]

    def _looked_up(
        self, plan: LessonPlan, known: KnownPolicies
    ) -> tuple[Lesson | None, Policy | None, tuple[Policy, Fitness] | None]:
        """What is reused; else the policy of exactly this problem, and the best one of another, with what is judged of it."""
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

    def _candidates(self, known: KnownPolicies, problem: Problem) -> Iterator[Policy]:
        """As `candidates`, but the one that was used for this problem before comes first: the next run does the same."""
        record = None
        try:
            record = self.toolbox.load_record(_REUSED, _record_key(problem))
        except BadInput as error:  # then any order will do
            self.tell(RecordSkipped(str(error)))
        return candidates(known, problem, first=str((record or {}).get("policy")).rpartition("@")[0])

    def _remember(self, problem: Problem, record: dict[str, str]) -> None:
        """Note what is used for a problem, where that is news; a note that cannot be kept is told: any order will do."""
        with suppress(BadInput):  # a damaged note is written anew
            if self.toolbox.load_record(_REUSED, _record_key(problem)) == record:
                return
        try:
            self.toolbox.save_record(_REUSED, _record_key(problem), record)
        except LabError as error:
            self.tell(RecordSkipped(f"what is used for '{problem.name}': {error}"))

    def unfinished(self, problem: Problem, name: str | None = None) -> Policy | None:
        """The unsolved policy to go on from: the one it would replace, the best one, or the one beside a solved one."""
        key = (problem.subtask, problem.mdp.signature)
        for wanted in (name or plain_name(problem), None, f"{plain_name(problem)}{_UNFINISHED}"):
            found = self.toolbox.find(*key, wanted)
            if found is not None and not found.solved and _belongs(found, problem.mdp):
                return found
        return None

    def one_session(self, plan: LessonPlan) -> Lesson:
        """One session that goes on from what was broken off, or left unsolved by the same learner, gate and advisor.

        It has several sessions when the lesson of a run had, and that is gone on with. BadInput when the plan's name is
        that of another problem's policy.
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
                return self.teach(replace(plan, warm=found))
        else:
            found = self.unfinished(problem, name)
            if found is not None and (self.advising.records or not self._same(found, plan)):
                found = None  # another learner, gate or advisor begins anew, so that they can be compared
            if found is not None:
                self.tell(LessonContinued(found))
        return self.teach(replace(plan, unfinished=found))

    def _same(self, policy: Policy, plan: LessonPlan) -> bool:
        """Whether a policy was learned in this way, or broken off before anything can be said of its gate and advisor."""
        length = {"episodes": 0}
        broken_off = len(policy.curve) < policy.learner.get("episodes", 0)
        alike = policy.gate == asdict(plan.gate) and policy.advisor == str(self.advising)
        return policy.learner | length == asdict(plan.learner) | length and (alike or broken_off)

    def teach(self, plan: LessonPlan) -> Lesson:
        """Teach what is planned, and save the policy, solved or not. WorkFailed when several sessions find no way.

        Nothing is learned where nothing can be kept: BadInput.
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
                    result = Sessions(plan, self.advising, self.seed, journal, self.tell).run()
                except Again:  # an answer was taken back
                    journal.rewind()
            name = plan.name or self._free_name(problem, result.solved)
            origin = Origin(name, problem.subtask, plan.task, str(self.advising), self.seed)
            policy = Policy.of(joined(unfinished, result), problem.mdp, plan.learner, plan.gate, origin)
            policy = replace(policy, parent=_parent(plan), scene=problem.scene, arm=problem.arm)
            failure = None
            if not (result.interrupted or journal.read_only):
                policy, failure = self._tried(problem, policy)
            if not (result.interrupted and journal.folding):  # what it was before is more
                saved = self.toolbox.put(policy)
                if not saved.in_use:
                    self.tell(KeptBeside(policy.name, saved.version, saved.why_not))
            if not result.interrupted:
                ended = (len(result.steps), result.final_steps, result.optimal_steps, policy.solved)
                journal.closes(Closed(*ended, saved_as=policy.name))
        finally:
            journal.close()
        if policy.solved and unfinished is not None and unfinished.name == f"{policy.name}{_UNFINISHED}":
            with suppress(BadInput):  # it may be gone already
                self.toolbox.remove(unfinished.name)  # it is finished now, under its plain name
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
        """The policy as it is to be kept, and why it failed in physics; then it is unsolved, and replaces no solved one."""
        if self.trial is None:
            return policy, None
        kept, unproven = self.toolbox.find(policy.subtask, policy.signature, policy.name), policy
        if policy.solved:
            beside = f"{policy.name[: MAX_NAME_LENGTH - len(_UNFINISHED)]}{_UNFINISHED}"
            unproven = replace(policy, solved=False, name=beside if kept is not None and kept.solved else policy.name)
        try:
            failure = self.trial(problem, policy)
        except BaseException:  # Ctrl-C, too: what was learned is kept
            self.toolbox.save(unproven)
            raise
        return (policy if failure is None else unproven), failure

    def _free_name(self, problem: Problem, solved: bool) -> str:
        """The name to save under; what did not get finished never replaces what is."""
        name = plain_name(problem)
        kept = None if solved else self.toolbox.find(problem.subtask, problem.mdp.signature, name)
        return f"{name}{_UNFINISHED}" if kept is not None and kept.solved else name


def candidates(known: KnownPolicies, problem: Problem, first: str = "") -> Iterator[Policy]:
    """The solved policies of a problem's sub-task and table size: the one called `first`, those of the same skill, the newest."""
    own = f"{problem.name[:_LONGEST_PROBLEM]} "
    found = known.alike(problem.subtask, problem.mdp.n_states, problem.mdp.n_actions)
    for key, _ in sorted(found, key=lambda one: (one[1] != first, not one[1].startswith(own))):
        with suppress(KeyError):  # damaged, or gone meanwhile
            yield known[key]


def _record_key(problem: Problem) -> str:
    return f"{problem.subtask} {problem.mdp.signature}"


def _told(lesson: Lesson, reason: str, found: Policy, problem: Problem) -> Lesson:
    """The lesson with its reason, which says the arm that the found policy was learned with when it is another."""
    if problem.arm == found.arm or not found.arm:
        return replace(lesson, reason=reason)
    return replace(lesson, reason=f"learned with the arm {found.arm}; {reason}", other_arm=found.arm)


def _reused(plan: LessonPlan, policy: Policy, reason: str, fitness: Fitness | None = None) -> Lesson:
    lesson = Lesson(policy, "reused", fitness=fitness, saved=_saved(plan, policy))
    return _told(lesson, reason, policy, plan.problem)


def _reason(policy: Policy, fitness: Fitness, plan: LessonPlan) -> str:
    """Which policy was looked at, of which other task, and what was found of it."""
    return f"'{policy.name}'{_elsewhere(policy, plan)}: {fitness.reason}"


def _elsewhere(policy: Policy, plan: LessonPlan) -> str:
    """Which task a policy was learned for, where that is another one."""
    return "" if policy.task == plan.task else f" of task '{policy.task}'"


def _saved(plan: LessonPlan, found: Policy, now: SessionResult | None = None) -> tuple[int, int]:
    """Episodes and helped steps that a found policy saves: see `Lesson`."""
    episodes, helped = (0, 0) if now is None else (len(now.steps), now.helped_steps)
    return max(len(found.curve), plan.learner.episodes) - episodes, found.helped_steps - helped


def _parent(plan: LessonPlan) -> str:
    """What a policy's `parent` says: the one that it was warm-started from, be it in this lesson or before it."""
    if plan.warm is not None:
        return reference(plan.warm)
    return "" if plan.unfinished is None else plan.unfinished.parent


def check_name(name: str | None) -> None:
    """BadInput unless a policy may have the name that a person chose."""
    if name is not None and not is_name(name):
        raise BadInput(f"policy name '{name}' (--save): wanted 1 to {MAX_NAME_LENGTH} printable characters")


def plain_name(problem: Problem) -> str:
    """What a policy of this problem is called when nobody names it."""
    return f"{problem.name[:_LONGEST_PROBLEM]} {problem.mdp.signature[:8]}"


def _belongs(policy: Policy, mdp: TabularMDP) -> bool:
    """Whether a policy that bears a problem's signature also has its table's size and its actions."""
    return policy.q.shape == (mdp.n_states, mdp.n_actions) and policy.action_labels == mdp.action_labels
