"""Studies made with the lab: the thesis's tables and figures measured again (`thesis`), and our own `comparisons`.

The lab never imports this package. It comes in as any plug-in does, by the entry point "teaching_lab.studies", and is the
largest example of how to build on the lab. A study is a function of a job and a reading (changes to all settings) that
returns its findings, and a row of STUDIES.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from importlib import import_module
from typing import TYPE_CHECKING, Any

from lab.studies import ADVISED, Study

if TYPE_CHECKING:
    from lab.studies.findings import Findings
    from lab.studies.runner import Job


@dataclass(frozen=True)
class _In:
    """A study's function in a module of this package, loaded only when the study runs, because its libraries load slowly.

    given: what the function takes after the job and the reading.
    """

    module: str
    function: str
    given: tuple[str, ...] = ()

    def __call__(self, job: "Job", reading: Mapping[str, Any]) -> "Findings":
        function = getattr(import_module(f"{__name__}.{self.module}"), self.function)
        findings: Findings = function(job, reading, *self.given)
        return findings


STUDIES: dict[str, Study] = {
    "table-9.2": Study(
        "Table 9.2: best scores in world I with full view",
        _In("thesis.chapter_9", "best_scores", ("table-9.2",)),
        ADVISED,
    ),
    "table-9.3": Study(
        "Table 9.3: best scores in world I with limited view",
        _In("thesis.chapter_9", "best_scores", ("table-9.3",)),
        ADVISED,
    ),
    "table-9.4": Study(
        "Table 9.4: best scores in world II with full view",
        _In("thesis.chapter_9", "best_scores", ("table-9.4",)),
        ADVISED,
    ),
    "table-9.5": Study(
        "Table 9.5: best scores in world II with limited view",
        _In("thesis.chapter_9", "best_scores", ("table-9.5",)),
        ADVISED,
    ),
    "appendix-v": Study(
        "Appendix V: all methods, parameters and advisors in both worlds and views",
        _In("thesis.chapter_9", "appendix_v"),
        ADVISED,
    ),
    "figure-9.4": Study("Figure 9.4: learning alone with several decay factors", _In("thesis.chapter_9", "figure_9_4")),
    "chapter-9": Study("Chapter 9: its tables, Appendix V and figures", _In("thesis.chapter_9", "chapter_9"), ADVISED),
    "readings": Study(
        "Readings of chapter 9: what the thesis leaves open, and what comes nearest",
        _In("thesis.chapter_9", "readings"),
    ),
    "world-2": Study(
        "World II, of which the thesis prints a picture, looked for again; takes minutes",
        _In("thesis.world_2", "reconstruction"),
        sessions=1,
        least=1,
    ),
    "advice-budget": Study(
        "Success against helped steps: every gate with and without memory",
        _In("comparisons.advice_budget", "advice_budget"),
        ADVISED,
    ),
    "advice-worth": Study(
        "What an advisor's help is worth over nobody's, for every skill of toast",
        _In("comparisons.advice_worth", "advice_worth"),
    ),
    "attention": Study(
        "What costs a person least for the same result: moves, ways, praise and blame, or a demonstration",
        _In("comparisons.attention", "attention"),
        sessions=40,
        least=2,
    ),
    "rejection": Study(
        "Whom CCRL rejects before a budget is spent, for every sub-task of toast and every learner",
        _In("comparisons.rejection", "rejection"),
        sessions=40,
        least=2,
    ),
    "advicebench": Study(
        "AdviceBench: rules of when to ask, whatever the advisor, the budget and the problem",
        _In("comparisons.advice_bench.advice_bench", "advice_bench"),
        ("methods", "problem", "advisors", "families_seed"),
        sessions=50,
        least=2,
    ),
    "advicebench-tuning": Study(
        "The settings of every rule of AdviceBench, tuned by one procedure on the problems that are not held out",
        _In("comparisons.advice_bench.tuning", "tuning"),
        ("methods", "problem", "advisors"),
        sessions=4,
        least=1,
    ),
    "deep-student": Study(
        "A deep student: the same gates and advisors with a DQN, in MiniGrid and CartPole; it needs PyTorch",
        _In("comparisons.deep_student.deep_student", "deep_student"),
        sessions=10,
        least=2,
    ),
    "clone": Study(
        "When a clone should ask: success by questions in three skills; takes hours",
        _In("comparisons.clone", "clone"),
        sessions=20,
        least=2,
    ),
    "promises": Study(
        "Whether a mentor keeps its promises: false alarms and failures caught in held-out rollouts of clones",
        _In("comparisons.promises", "promises"),
        sessions=4,
        least=2,
    ),
    "mentor": Study(
        "A mentor for other people's policies: when they should ask, at equal questions",
        _In("comparisons.mentor", "mentor"),
        sessions=40,
        least=2,
    ),
    "whom-to-believe": Study(
        "Whom to believe: is a panel of seven ranked rightly, and are three limited advisors better than nobody?",
        _In("comparisons.whom_to_believe", "whom_to_believe"),
        sessions=100,
        least=2,
    ),
    "advisors": Study(
        "Several advisors at once, beside the best and the worst of them alone",
        _In("comparisons.several_advisors", "advisors"),
        ADVISED,
    ),
    "peers": Study(
        "Learners who advise each other, beside the same alone at equal moves; and one wrong among them",
        _In("comparisons.peers", "peers"),
        sessions=20,
        least=2,
    ),
    "peers-of-two-arms": Study(
        "Two arms that learn the same toast and advise each other, beside each of them alone",
        _In("comparisons.peers_of_two_arms", "peers_of_two_arms"),
        sessions=20,
        least=2,
    ),
    "mountain-car": Study(
        "Mountain Car: when a teacher should speak, at equal budgets",
        _In("comparisons.mountain_car", "mountain_car"),
        sessions=30,
        least=2,
    ),
    "table-7.4": Study(
        "Table 7.4: sequencing case I by session length", _In("thesis.chapter_7", "best_results", ("I",))
    ),
    "table-7.5": Study(
        "Table 7.5: sequencing case II by session length", _In("thesis.chapter_7", "best_results", ("II",))
    ),
    "table-7.6": Study(
        "Table 7.6: sequencing case III by session length", _In("thesis.chapter_7", "best_results", ("III",))
    ),
    "table-iv.1": Study("Table IV.1: SRL with several decay factors", _In("thesis.chapter_7", "table_iv_1")),
    "table-iv.2": Study("Table IV.2: SRL with reward factors of types A and B", _In("thesis.chapter_7", "table_iv_2")),
    "chapter-7": Study("Chapter 7 and Appendix IV: tables and figures", _In("thesis.chapter_7", "chapter_7")),
    "readings-7": Study(
        "Readings of chapter 7: what the thesis leaves open, and what comes nearest",
        _In("thesis.chapter_7", "readings"),
    ),
    "appendix-iii": Study("Appendix III: a flexible manufacturing system", _In("thesis.appendix_3", "appendix_iii")),
    "srl-time": Study(
        "srl-time, Q-learning from a bound of the full model on, beside every rival",
        _In("comparisons.srl_time_compared", "srl_time_study"),
    ),
    "faults": Study(
        "Runs of drawn faults: delivered, stopped with a true reason, or wrong",
        _In("comparisons.faults", "faults"),
        least=1,
    ),
    "flat": Study(
        "One flat problem, or two levels: the toast task on a small grid",
        _In("comparisons.two_levels.flat_or_two_levels", "flat"),
    ),
    "found-subtasks": Study(
        "Sub-tasks that are found: doorways from a learner's moves, beside those given by hand and a flat learner",
        _In("comparisons.found_subtasks", "found_subtasks"),
        sessions=40,
        least=2,
    ),
    "changed-scenes": Study(
        "Skills in changed scenes: used as they are, adapted or learned, beside learning all anew",
        _In("comparisons.changed_scenes_study", "changed_scenes"),
    ),
    "grips": Study(
        "Parts that others made: which can be gripped, and whether they arrive", _In("comparisons.grips", "grips")
    ),
    "reuse": Study(
        "Tasks in several orders, all in one toolbox: does a lab that has lived longer learn less?",
        _In("comparisons.reuse", "reuse"),
        sessions=10,
        least=1,
    ),
    "carried-over": Study(
        "A policy learned on small cells orders larger ones, beside every dispatching rule",
        _In("comparisons.carried_over", "carried_over"),
        sessions=240,
    ),
    "srl-linear": Study(
        "SRL with linear values instead of a table, and policies that it keeps, beside every rival in cells held out",
        _In("comparisons.srl_linear", "srl_linear_study"),
        sessions=20,
        least=1,
    ),
    "reacting": Study(
        "Drawn times, breakdowns, late parts: a list, policies that react, hindsight",
        _In("comparisons.reacting", "reacting"),
        sessions=50,
    ),
    "sequencing-speed": Study(
        "Speed of the high level: episodes a second, proofs, time to 1 %",
        _In("comparisons.sequencing_speed", "sequencing_speed"),
    ),
    "transport": Study(
        "Orders of work: every method on the field's own instances, beside the best known and the printed",
        _In("comparisons.transport", "transport"),
        ("seconds", "methods", "instances", "verify"),
        sessions=1,
        least=1,
    ),
    "tiles-speed": Study(
        "Speed on tiles: steps of Mountain Car a second, beside Gymnasium's loop",
        _In("comparisons.tiles_speed", "tiles_speed"),
        sessions=50,
        least=1,
    ),
    "speed": Study(
        "Speed: environment steps a second on one core, beside rivals", _In("comparisons.learning_speed", "speed")
    ),
}
