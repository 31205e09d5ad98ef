"""When somebody else's policy should ask: rules of doubt compared with asking at random, at equal numbers of questions."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from lab.learning.environment import TableEnvironment
from lab.learning.session import Session
from lab.learning.settings import GateSettings
from lab.mdp import FloatArray, TabularMDP
from lab.studies.charts import legend_below
from lab.studies.findings import Findings, Row, mean_row, those
from lab.studies.runner import Job, seeds_of
from lab.teaching.mentor import CIRCLES, VISITS, Step, Watched, watch
from lab.view.canvas import BLUE, GREEN, GREY, INK, ORANGE, PURPLE, RED, SKY, picture_bytes
from lab_studies.comparisons.advice_bench.problems import problem

if TYPE_CHECKING:
    from matplotlib.figure import Figure

LAYOUTS = ("far-door", "lava", "crossing")
TABLES = 5  # of an ensemble; the first one is the policy
LEARNED = 200  # episodes, enough to know a path from the start, but less about other states
LABELLED, TRIED = 5, 20  # episodes for calibrating and for judging a rule
SLIP = 0.15  # the chance of a random move, which leads the policy to states that it does not know
SHARES = (0.02, 0.05, 0.1, 0.2, 0.4)
FIXED = {
    "margin": 0.9,
    "entropy": 0.9,
    "ensemble": 0.5,
    VISITS: 0.5,
    CIRCLES: 0.5,
}  # thresholds chosen by eye, without calibration
CHANCE, ALWAYS, NEVER, THRESHOLD = "chance", "always", "never", "fixed threshold"
RULES = (*FIXED, CHANCE)
MEASURES = (
    "A policy learned in {learned} episodes moves where a move is random with probability {slip:g}; in a step in which it asks, "
    "it makes the expert's move. share: the share of steps that a rule was calibrated to ask in, with {labelled} episodes "
    "without help; chance asks that share at random; fixed threshold: visits with 0.5, not calibrated. solved_percent: episodes "
    "that reach the goal; questions: the questions of an episode. Rules are compared at equal numbers of questions: "
    "gain_percent is the percentage above what asking at random solves with as many questions (interpolated linearly)."
)


@dataclass(frozen=True)
class Place:
    """A layout."""

    layout: str


class Taught(NamedTuple):
    """A policy and its ensemble: tables (TABLES, S, A), and the states that the first one has met."""

    tables: FloatArray
    seen: list[int]


Asks = Callable[[int | None], bool]  # (state) -> whether to ask in it; None: an episode begins
Tally = dict[tuple[str, float], tuple[list[float], list[float]]]  # (rule, share) -> (shares solved, questions)


def learned_policy(mdp: TabularMDP, place: Any, rng: np.random.Generator) -> Taught:
    """A policy and an ensemble, which learned the same problem with different random numbers."""
    tables, seen = [], list[int]()
    learner = place.learner.__class__(**(vars(place.learner) | {"episodes": LEARNED}))
    for number, own in enumerate(rng.spawn(TABLES)):
        session = Session(mdp, learner, GateSettings("never"), None, own).run()
        tables.append(session.q)
        if number == 0:
            seen = np.repeat(np.arange(mdp.n_states), session.visits.sum(axis=1)).tolist()
    return Taught(np.array(tables), seen)


def walked_episode(
    mdp: TabularMDP, place: Any, asks: Asks, policy: Any, rng: np.random.Generator
) -> tuple[bool, int, list[Step]]:
    """An episode: whether it reached the goal, its questions, and its steps, each with whether the policy was right."""
    environment, best = TableEnvironment(mdp), place.values
    state, questions, steps = mdp.start, 0, list[Step]()
    asks(None)
    for _ in range(place.learner.max_steps):
        action = policy(state)
        steps.append((state, bool(best[state, action] >= best[state].max() - 1e-9)))
        if asks(state):
            questions += 1
            action = int(best[state].argmax())
        if rng.random() < SLIP:
            action = int(rng.integers(mdp.n_actions))
        _, state, over, reached, _ = environment.step(state, action, rng.random)
        if over:
            return reached, questions, steps
    return False, questions, steps


def policy_tally(where: Place, seed: int) -> Tally:
    """The tally of every rule with one policy."""
    place = problem(where.layout)
    mdp, rng = place.mdp, np.random.default_rng(seed)
    taught = learned_policy(mdp, place, rng)

    def policy(state: int) -> int:
        return int(taught.tables[0, state].argmax())

    def episodes(asks: Asks, count: int) -> list[tuple[bool, int, list[Step]]]:
        return [walked_episode(mdp, place, asks, policy, rng) for _ in range(count)]

    labelled = [steps for _, _, steps in episodes(lambda state: False, LABELLED)]
    tally: Tally = {}

    def judged(rule: str, share: float, asks: Any) -> None:
        tried = episodes(asks, TRIED)
        solved, questions = tally.setdefault((rule, share), ([], []))
        solved.append(float(np.mean([episode[0] for episode in tried])))
        questions.append(float(np.mean([episode[1] for episode in tried])))

    judged(NEVER, 0.0, lambda state: False)
    judged(ALWAYS, 1.0, lambda state: True)
    judged(THRESHOLD, 0.0, _asks(_watched(taught, VISITS, FIXED[VISITS])))
    for share in SHARES:
        judged(CHANCE, share, lambda state, share=share: rng.random() < share)
        for rule, threshold in FIXED.items():
            watched = _watched(taught, rule, threshold).calibrate(labelled, share=share)
            judged(rule, share, _asks(watched))
    return tally


def _asks(watched: Watched) -> Asks:
    def asks(state: int | None) -> bool:
        if state is None:
            watched.begin()
            return False
        return watched(state).asks

    return asks


def _watched(taught: Taught, rule: str, threshold: float) -> Watched:
    several = [lambda state, table=table: table[state] for table in taught.tables]
    return watch(several if rule == "ensemble" else several[0], rule, threshold=threshold, seen=taught.seen)


def layout_tally(where: Place, policies: int, seed: int) -> Tally:
    """The tally of `policies` policies in a layout."""
    tally: Tally = {}
    for own in seeds_of(where, policies, seed):
        for key, (solved, questions) in policy_tally(where, int(own)).items():
            both = tally.setdefault(key, ([], []))
            both[0].extend(solved)
            both[1].extend(questions)
    return tally


def mentor(job: Job, reading: Mapping[str, Any]) -> Findings:
    """The results of every layout; a session is a policy, and the reading has no effect."""
    places = [Place(layout) for layout in LAYOUTS]
    tallies = job.each(partial(layout_tally, policies=job.sessions, seed=job.seed), places)
    rows = [row for place in places for row in rows_of(place.layout, tallies[place])]
    says: Row = {}
    for layout in LAYOUTS:
        for rule in FIXED:
            gains = [row["value"] for row in those(rows, problem=layout, rule=rule, measure="gain_percent")]
            says[f"{layout}: {rule} over chance at equal questions [points of success]"] = round(
                float(np.mean(gains)), 1
            )
    pictures = {f"Success against questions, {layout}": _picture(those(rows, problem=layout)) for layout in LAYOUTS}
    return Findings(rows, says, pictures, (MEASURES.format(learned=LEARNED, slip=SLIP, labelled=LABELLED),))


def rows_of(layout: str, tally: Tally) -> list[Row]:
    """The measures of every rule in a layout."""
    rows = []
    line = sorted((np.mean(q), np.mean(s)) for (rule, _), (s, q) in tally.items() if rule in (NEVER, CHANCE, ALWAYS))
    for (rule, share), (solved, questions) in tally.items():
        named: Row = {"problem": layout, "rule": rule, "share": share}
        rows.append(mean_row(named, "solved_percent", 100.0 * np.array(solved)))
        rows.append(mean_row(named, "questions", questions) if rule != NEVER else _no_questions(named))
        if rule in (*FIXED, THRESHOLD):
            by_chance = np.interp(np.mean(questions), [q for q, _ in line], [s for _, s in line])
            rows.append(mean_row(named, "gain_percent", 100.0 * (np.array(solved) - by_chance)))
    return rows


def _no_questions(named: Row) -> Row:
    return {**named, "measure": "questions", "value": 0.0, "ci95": None, "thesis": None, "within": None}


def _picture(rows: Sequence[Row]) -> bytes:
    """A picture of success against questions, a line for each rule."""
    looks = dict(zip((*RULES, THRESHOLD), (BLUE, GREEN, ORANGE, SKY, RED, GREY, PURPLE), strict=True))

    def draw(figure: "Figure") -> None:
        axes = figure.add_subplot()
        for rule, colour in looks.items():
            shares = [row["share"] for row in those(rows, rule=rule, measure="questions")]
            at = [
                (_value(rows, rule, share, "questions"), _value(rows, rule, share, "solved_percent"))
                for share in shares
            ]
            axes.plot(*zip(*at, strict=True), "o-", color=colour, label=rule, markersize=4, linewidth=1.3)
        for name, share in ((NEVER, 0.0), (ALWAYS, 1.0)):
            axes.axhline(_value(rows, name, share, "solved_percent"), color=INK, linewidth=0.8, linestyle=":")
        axes.set(xlabel="questions of an episode", ylabel="episodes that reach the goal [%]", xlim=(0, None))
        axes.grid()
        legend_below(figure)

    return picture_bytes(draw, 7.0, 4.2)


def _value(rows: Sequence[Row], rule: str, share: float, measure: str) -> float:
    return float(those(rows, rule=rule, share=share, measure=measure)[0]["value"])
