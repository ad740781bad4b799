"""Policies: `rsrl.load_policy`, `rsrl.evaluate` and `rsrl.explain`."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Final, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from rsrl.api.races import Driver, Race
from rsrl.compile_watch import announce
from rsrl.environment import race_and_car
from rsrl.errors import RsrlError
from rsrl.evaluation import first_unseen_race, leaderboard, run_races
from rsrl.explanation import (
    ExplainedCaller,
    ExplainedPolicy,
    Explanation,
    check_methods,
    explain_attribution,
    explain_counterfactual,
    explain_tree,
    explain_what_if,
    load_any_policy,
    reach,
    summarise_race,
)
from rsrl.explanation.tree import find_tree
from rsrl.results import Row
from rsrl.strategists import STRATEGISTS, Strategist, make_model_strategist, make_strategist, strategist_names, strategist_of
from rsrl.strategists import load_policy as load_model

Caller = Callable[[NDArray[np.float32], NDArray[np.int8]], int]
"""A policy as a function: the call, 0 to 3, from an observation of the feature set `full` and the mask of legal calls int8 [4]."""

Model = str | Path | ExplainedPolicy | ExplainedCaller | Caller
Method = Literal["what-if", "attribution", "tree", "counterfactual", "summary"]
METHODS: Final = get_args(Method)

DEFAULT_STRATEGISTS: Final = ("fixed", "heuristic", "dp", "best-plan", "best-plan-sc")


def load_policy(model: Model = "all") -> ExplainedPolicy | ExplainedCaller:
    """A policy, for `evaluate` and `explain`.

    Args:
        model: a policy shipped with RSRL (`all` for any race, or `bahrain-2023`), the folder of a training run, a file of
            Stable-Baselines3 (`model.zip`), `module:function`, or a function of an observation and the mask of legal calls.

    Raises:
        RsrlError: there is none, or it cannot be read.

    Example:
        >>> import rsrl
        >>> policy = rsrl.load_policy("all")
        >>> print(policy.about.race, policy.agent.feature_set)
        all full
    """
    announce()
    return model if isinstance(model, ExplainedPolicy | ExplainedCaller) else load_any_policy(model)


def evaluate(
    race: Race,
    model: Model | Strategist = "all",
    *,
    driver: Driver = None,
    strategists: str | Sequence[str | Strategist] = DEFAULT_STRATEGISTS,
    races: int = 1920,
    seed: int = 7,
) -> tuple[Row, ...]:
    """Compare a model with other strategists on the same races, as `rsrl evaluate`.

    Args:
        model: as of `load_policy`, or a strategist of your own.
        strategists: names as of the command, separated by commas or in a list; models, or strategists of your own.
        races: that each strategist calls.

    Returns:
        A row for each strategist, best mean position first; `difference` is in places behind the model on the same races.

    Raises:
        RsrlError: no such race, driver, model or strategist.

    Example:
        >>> import rsrl
        >>> for row in rsrl.evaluate("bahrain-2023", driver="HAM", strategists=["heuristic"], races=384):
        ...     print(f"{row.strategist:9} P{row.mean_position:.2f}, {row.difference:+.2f} places behind the model")
        rsrl      P5.69, +0.00 places behind the model
        heuristic P5.87, +0.18 places behind the model
    """
    announce()
    record, car = race_and_car(race, driver)
    models: list[Any] = []
    if isinstance(model, Strategist):
        mine = model
    else:
        policy = load_policy(model)
        models.append((policy.agent, policy.about))
        mine = strategist_of(policy.agent, record, policy.agent.kind)
    others: list[Strategist] = []
    taken = {mine.name}
    for one in [strategists] if isinstance(strategists, str) else strategists:
        for each in strategist_names(one) if isinstance(one, str) else (one,):
            if isinstance(each, str) and each not in STRATEGISTS:
                models.append(load_model(each))
                others.append(make_model_strategist(each, record, taken))
                taken.add(others[-1].name)
            else:
                others.append(make_strategist(each, record, car) if isinstance(each, str) else each)
    first = first_unseen_race(seed, models)
    log, *logs = (run_races(each, record, car, seed, races, first_race=first) for each in (mine, *others))
    return tuple(leaderboard(log, logs))


def explain(
    race: Race,
    *,
    lap: int | None = None,
    model: Model = "all",
    driver: Driver = None,
    method: Method = "what-if",
    seed: int = 0,
    race_number: int = 0,
    races: int = 2000,
) -> Explanation:
    """Explain a policy's call for one lap of a simulated race, as `rsrl explain`.

    Args:
        lap: whose call is explained, 1 for the first; None for a summary, which covers the whole race.
        method: what-if works with any policy, the others with those of RSRL, which value each call.
        seed, race_number: of the simulated race, which the policy calls up to the lap.
        races: futures simulated for each what-if option.

    Raises:
        RsrlError: no such race, driver, model, method or lap, or the car's race is over before the lap.

    Example:
        >>> import rsrl
        >>> found = rsrl.explain("bahrain-2023", driver="HAM", lap=12, seed=1, races=200)
        >>> print(found.sentences[0])
        HAM, lap 12: the policy's call is to stay out; mean finishing position 4.14 over 200 simulated futures.
    """
    announce()
    record, car = race_and_car(race, driver)
    policy = load_policy(model)
    if method not in METHODS:
        raise RsrlError(f"unknown method {method!r}; there are {', '.join(METHODS)}")
    check_methods(policy, (method,))
    if method == "summary":
        return summarise_race(_with_values(policy), record, car, seed=seed, race=race_number)
    if lap is None:
        raise RsrlError("which lap? give lap, or method='summary' for the whole race")
    moment = reach(policy.strategist(record), record, car, lap, seed=seed, race=race_number)
    if method == "what-if":
        return explain_what_if(policy, moment, races=races, seed=seed)
    if method == "attribution":
        return explain_attribution(_with_values(policy), moment, seed=seed)
    tree = find_tree(_with_values(policy), record, car)
    if method == "tree":
        return explain_tree(_with_values(policy), moment, tree)
    return explain_counterfactual(_with_values(policy), moment, tree)


def _with_values(policy: ExplainedPolicy | ExplainedCaller) -> ExplainedPolicy:
    assert isinstance(policy, ExplainedPolicy), "check_methods lets no other policy pass"
    return policy
