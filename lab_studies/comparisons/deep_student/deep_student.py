"""Whether the rules of asking carry over to a network: the bench's rules and advisors with a DQN, in the lab's own sessions."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from lab.lazy import torch
from lab.learning import splitmix
from lab.learning.gates.heard import best_of
from lab.learning.greedy import GREEDY_EVERY
from lab.learning.session import Session
from lab.learning.settings import GateSettings
from lab.learning.simulated_advice import TableAdvisor
from lab.learning.updates import UPDATES
from lab.mdp import FloatArray
from lab.optional import require
from lab.studies.charts import legend_below
from lab.studies.findings import Findings, Row, mean_row, those, varying_row
from lab.studies.runner import Job, seeds_of
from lab.view.canvas import BLUE, GREEN, INK, ORANGE, PURPLE, RED, SKY, picture_bytes
from lab_studies.comparisons.advice_bench import rules as bench
from lab_studies.comparisons.advice_bench.bad_advisors import ADVISORS
from lab_studies.comparisons.deep_student.dqn import seeing
from lab_studies.comparisons.deep_student.places import LEARNER, PLACES, STUDY, Place, place

if TYPE_CHECKING:
    from matplotlib.figure import Figure

NOBODY = bench.NOBODY
EARLY_BUDGET = 200  # answers
WALKS = 5  # episodes that measure the greedy policy of CartPole, whose starts are drawn
BY_ADVISOR = ("expert", "limited", "novice", "contrary")
NAMES = {"ia": "introspection", "importance": "importance (learner's)", "advice-reuse": "advice reuse"}  # of the bench
RULES: Mapping[str, GateSettings] = {"early": replace(bench.rules_of("always")["any"].gate, budget=EARLY_BUDGET)} | {
    name: bench.rules_of(NAMES.get(name, name))["any"].gate
    for name in ("always", "ccrl", "ia", "importance", "fading", "advice-reuse", "earned-trust")
}
SHOWN = (NOBODY, "always", "early", "ccrl", "fading", "advice-reuse", "earned-trust")  # the curves of the picture
COLOURS = dict(zip(SHOWN, (INK, ORANGE, SKY, BLUE, GREEN, PURPLE, RED), strict=True))
MEASURES = (
    "A session has {episodes} episodes; the rules have the settings that AdviceBench chose for tables, but for psi, and the same "
    f"seeds. early: always, with {EARLY_BUDGET} answers. points: 100 for an episode as good as the best policy's, 0 for one that "
    "fails, the mean over all episodes of the session (the return while advised); greedy_points: the same of the greedy policy "
    f"without the advisor, the mean of the measurements after every {GREEDY_EVERY}th episode; greedy_last: the last one. "
    "gain_points, greedy_gain: the paired differences to nobody. answers: of a session."
)
NUMBERS = (
    "A gate that counts by state counts MiniGrid's symbolic states, which are exact, and cells of CartPole (12 x 12 x 24 x 24), "
    "while the network sees fields and points. uncertainty is left out: its ensemble would be five more networks."
)


@dataclass(frozen=True)
class Setting:
    """A problem, the advisor and the rule of asking; nobody has neither."""

    problem: str
    advisor: str = ""
    rule: str = NOBODY


class Outcome(NamedTuple):
    """The results of N sessions: points (N, E) of the episodes, greedy (N, K) of the greedy policy, answers (N,)."""

    points: FloatArray
    greedy: FloatArray
    answers: FloatArray

    @classmethod
    def from_json(cls, lists: Any) -> "Outcome":
        """The outcome of lists of numbers. Raises TypeError or ValueError for anything else."""
        return cls(*(np.array(values, np.float64) for values in lists))


def deep_student(job: Job, reading: Mapping[str, Any]) -> Findings:
    """The results of every rule with every advisor; the reading has no effect. Raises BadInput if PyTorch is not installed."""
    require(STUDY, torch)
    settings = [
        Setting(problem, *asked)
        for problem in PLACES
        for asked in [("", NOBODY), *((advisor, rule) for advisor in BY_ADVISOR for rule in RULES)]
    ]
    outcomes = measured(job, settings)
    rows = [result for setting in settings for result in rows_of(setting, outcomes)]
    episodes = place(PLACES[0]).benched.learner.episodes
    pictures = {"Greedy policy without the advisor, by advisor and problem": curves(outcomes)}
    return Findings(rows, in_short(rows), pictures, (MEASURES.format(episodes=episodes), NUMBERS))


def measured(job: Job, settings: Sequence[Setting]) -> dict[Setting, Outcome]:
    """The outcome of each setting; those that are kept are not measured again."""

    def read(entry: Any) -> tuple[Setting, Outcome] | None:
        of = entry["sessions"], entry["seed"]
        return (
            (Setting(*entry["setting"]), Outcome.from_json(entry["found"])) if of == (job.sessions, job.seed) else None
        )

    done: dict[Setting, Outcome] = job.kept_as(read)
    left = [setting for setting in settings if setting not in done]
    job.progress(len(settings) - len(left), len(settings))
    for setting, outcome in job.computed(partial(setting_outcome, sessions=job.sessions, seed=job.seed), left, 1):
        done[setting] = outcome
        named = {"setting": list(vars(setting).values()), "sessions": job.sessions, "seed": job.seed}
        job.keep(named | {"found": [values.tolist() for values in outcome]})
        job.progress(sum(setting in done for setting in settings), len(settings))
    return done


def setting_outcome(setting: Setting, *, sessions: int, seed: int) -> Outcome:
    """The outcome of `sessions` sessions of a setting; every rule and advisor of a problem has the same seeds."""
    seeds = seeds_of(Setting(setting.problem), sessions, seed).tolist()
    parts = zip(*(session_outcome(setting, own) for own in seeds), strict=True)
    return Outcome.from_json([np.round(np.array(values, np.float64), 2) for values in parts])


def session_outcome(setting: Setting, seed: int) -> tuple[FloatArray, list[float], int]:
    """The points (E,) of a session's episodes, those (K,) of the greedy policy along the way, and the answers."""
    here, advisor, gate = place(setting.problem), None, GateSettings("never")
    UPDATES.use(LEARNER, seeing(here.sight))
    if setting.advisor:
        advisor = TableAdvisor(ADVISORS[setting.advisor](here.benched), splitmix.stream(splitmix.apart(seed, 0)))
        gate = replace(RULES[setting.rule], psi=here.psi)
    session = Session(here.environment, here.benched.learner, gate, advisor, splitmix.stream(seed))
    greedy: list[float] = []

    def measure() -> bool:
        number, left = divmod(session.episode, GREEDY_EVERY)
        if not left:
            greedy.append(greedy_points(here, session, splitmix.apart(seed, number)))
        return False

    result = session.run(enough=measure)
    if result.interrupted:
        raise KeyboardInterrupt
    return here.points(result.steps), greedy, result.helped_steps


def greedy_points(here: Place, session: Session, seed: int) -> float:
    """The mean points of the greedy policy, in episodes that nobody learns from."""
    world, most, draw, total = here.environment, here.benched.learner.max_steps, splitmix.stream(seed), 0.0
    walks = WALKS if session.longer_is_better else 1
    for _ in range(walks):
        state, moves, step = world.reset(1, draw), 0, None
        while moves < most and not (step and step.terminated):
            step = world.step(state, best_of(session.q[state]), draw)
            state, moves = step.state, moves + 1
        over = step is not None and step.terminated
        steps = (most - moves + 2 if over else 1) if session.longer_is_better else moves if over else most + 1
        total += float(here.points(steps))
    return total / walks


def rows_of(setting: Setting, outcomes: Mapping[Setting, Outcome]) -> list[Row]:
    """The measures of a setting, and its gains over nobody."""
    named: Row = {"problem": setting.problem, "advisor": setting.advisor or NOBODY, "rule": setting.rule}
    outcome, alone = outcomes[setting], outcomes[Setting(setting.problem)]
    points, greedy = outcome.points.mean(axis=1), outcome.greedy.mean(axis=1)
    rows = [
        mean_row(named, "points", points),
        mean_row(named, "greedy_points", greedy),
        mean_row(named, "greedy_last", outcome.greedy[:, -1]),
        varying_row(named, "answers", outcome.answers),
    ]
    if setting.rule == NOBODY:
        return rows
    gains = points - alone.points.mean(axis=1), greedy - alone.greedy.mean(axis=1)
    return [
        *rows,
        *(mean_row(named, name, gain) for name, gain in zip(("gain_points", "greedy_gain"), gains, strict=True)),
    ]


def in_short(rows: Sequence[Row]) -> Row:
    """The mean gains over nobody of each rule, over the problems, with each advisor."""
    says: Row = {}
    for rule in RULES:
        for advisor in BY_ADVISOR:
            means = [
                np.mean([row["value"] for row in those(rows, rule=rule, advisor=advisor, measure=measure)])
                for measure in ("gain_points", "greedy_gain")
            ]
            says[f"{rule}, {advisor}: points gained while advised, greedy"] = "{:+.1f}, {:+.1f}".format(*means)
    return says


def curves(outcomes: Mapping[Setting, Outcome]) -> bytes:
    """A picture of the greedy policy's points over the episodes: a column for each problem, a row for each of two advisors."""
    advisors = BY_ADVISOR[0], BY_ADVISOR[-1]

    def draw(figure: "Figure") -> None:
        grid = figure.subplots(len(advisors), len(PLACES), sharex=True, sharey=True, squeeze=False)
        for row, advisor in zip(grid, advisors, strict=True):
            for axes, problem in zip(row, PLACES, strict=True):
                for rule in SHOWN:
                    asked = () if rule == NOBODY else (advisor, rule)
                    mean = outcomes[Setting(problem, *asked)].greedy.mean(axis=0)
                    episodes = GREEDY_EVERY * np.arange(1, len(mean) + 1)
                    label = rule if axes is grid[0, 0] else None
                    axes.plot(episodes, mean, color=COLOURS[rule], linewidth=1.3, label=label)
                axes.set_title(f"{problem}, {advisor}", fontsize=9)
                axes.grid()
        for axes in grid[-1]:
            axes.set_xlabel("episode")
        for axes in grid[:, 0]:
            axes.set_ylabel("greedy points")
        legend_below(figure)

    return picture_bytes(draw, 8.4, 5.2)
