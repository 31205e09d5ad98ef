"""Optuna, asked for settings in batches: whoever measures them, the same seed and the same values give the same trials."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any
from warnings import simplefilter

from lab.learning.tuned_ranges import Range, Span
from lab.optional import optional

BATCH = 8  # trials that are asked for at once, whatever the number of workers
Values = dict[str, Any]
# a rung and the settings that are still in it -> their costs, None for settings that cannot be
Measure = Callable[[int, Sequence[Values]], list[float | None]]


@dataclass(frozen=True)
class Trial:
    """Settings that were tried: their cost on each rung that they reached; pruned: they did not reach the last."""

    number: int
    values: Values
    costs: tuple[float, ...]
    pruned: bool


def search(
    ranges: Mapping[str, Range], first: Values, trials: int, seed: int, rungs: int, measure: Measure
) -> tuple[list[Trial], dict[str, float]]:
    """Trials in order, and the importance of each setting for the cost (shares of 1; empty where it cannot be told).

    first: the settings of the first trial. On each rung but the last a trial is given up when it does worse than the median
    of those that came to the end. Source of the sampler: Bergstra et al., NIPS 24 (2011); of the importances: Watanabe et al.,
    IJCAI 2023. Raises BadInput without Optuna.
    """
    optuna = _optuna()
    kinds = {name: _distribution(optuna, allowed) for name, allowed in ranges.items()}
    study = optuna.create_study(
        sampler=optuna.samplers.TPESampler(seed=seed, constant_liar=True),
        pruner=optuna.pruners.MedianPruner(n_startup_trials=BATCH),
    )
    study.enqueue_trial(first)
    done: list[Trial] = []
    while len(done) < trials:
        asked = [study.ask(kinds) for _ in range(min(BATCH, trials - len(done)))]
        costs: dict[int, list[float]] = {one.number: [] for one in asked}
        left, given_up = list(asked), set()
        for rung in range(rungs):
            found = measure(rung, [one.params for one in left])
            for one, cost in zip(list(left), found, strict=True):
                if cost is not None:
                    costs[one.number].append(cost)
                    one.report(cost, rung)
                if cost is None or (rung < rungs - 1 and one.should_prune()):
                    given_up.add(one.number)
            left = [one for one in left if one.number not in given_up]
        for one in asked:
            pruned = one.number in given_up
            state = optuna.trial.TrialState
            if not costs[one.number]:
                study.tell(one, state=state.FAIL)
            elif pruned:
                study.tell(one, state=state.PRUNED)
            else:
                study.tell(one, costs[one.number][-1])
            done.append(Trial(one.number, one.params, tuple(costs[one.number]), pruned))
    return done, _importances(optuna, study)


def _optuna() -> Any:
    with optional("tuning"):
        import optuna
    simplefilter("ignore", optuna.exceptions.ExperimentalWarning)
    optuna.logging.set_verbosity(optuna.logging.ERROR)
    return optuna


def _distribution(optuna: Any, allowed: Range) -> Any:
    if not isinstance(allowed, Span):
        return optuna.distributions.CategoricalDistribution(allowed)
    if isinstance(allowed.low, int) and isinstance(allowed.high, int):
        return optuna.distributions.IntDistribution(allowed.low, allowed.high, log=allowed.log)
    return optuna.distributions.FloatDistribution(allowed.low, allowed.high, log=allowed.log)


def _importances(optuna: Any, study: Any) -> dict[str, float]:
    ended = study.get_trials(deepcopy=False, states=(optuna.trial.TrialState.COMPLETE,))
    if len({one.value for one in ended}) < BATCH:
        return {}
    evaluator = optuna.importance.PedAnovaImportanceEvaluator()
    found = optuna.importance.get_param_importances(study, evaluator=evaluator)
    return {name: float(share) for name, share in found.items()}
