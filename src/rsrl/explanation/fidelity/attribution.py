"""Figures of merit of attributions: their cost, the error of sampled values, and whether they name what moves the policy.

The paper reports one figure, a mean error of 5 % of the largest reward, without saying of what. Three are kept apart here: the error of
sampled values against exact ones; the gap in the sum of values (efficiency); and how far the policy's action values are from the outcome of
its calls (calibration), which is a property of the policy and not of the explanation.

Two figures hold by construction and check the code alone: values are exact where the players are few enough for all coalitions, and exact
values add up to the value explained but for rounding.
"""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from scipy.stats import kendalltau

from rsrl.explanation.attribution.backgrounds import ReferenceRaces, drive_references, make_background
from rsrl.explanation.attribution.explain import BUDGET, RECURRENT_BUDGET, explain_attribution
from rsrl.explanation.attribution.shapley import MAX_EXACT_PLAYERS, ShapleyValues, shapley_values
from rsrl.explanation.attribution.timeshap import feature_level, feature_players, group_players
from rsrl.explanation.attribution.values import ValueFunction
from rsrl.explanation.episodes import EpisodeRecorder, Episodes
from rsrl.explanation.fidelity.curves import FEWEST_PLAYERS, Curves, curve_figures, curves
from rsrl.explanation.moment import Moment
from rsrl.explanation.policy import ExplainedPolicy
from rsrl.season import RaceRecord
from rsrl.state import ACTION_NAMES, feature_set
from rsrl.statistics import mean_interval

Doubles = NDArray[np.float64]
Progress = Callable[[int, int], None]

FIDELITY_SEED: Final = 702_113
"""Seed of the races explained. No evaluation, training or background uses it."""

SEEDS: Final = 3
"""Estimates of the same decision, to measure how much they differ."""


@dataclass(frozen=True)
class SampledDecisions:
    """Decisions drawn from R races of L laps that the policy called.

    Attributes:
        moments: from each race one decision on a lap drawn at random, and one stop if it made any; more than one call is legal in each.
        running: bool [R, L], the lap was driven.
        q: float32 [R, L], value of the call made.
        outcome: float64 [R, L], the return that the value predicts: minus the finishing position for RSRL's own policies, for others the
            rewards from that lap on, discounted as in training.
    """

    moments: tuple[Moment, ...]
    running: NDArray[np.bool_]
    q: NDArray[np.float32]
    outcome: Doubles


@dataclass(frozen=True)
class _Measured:
    """Measurements of one decision; errors are relative to the sum of absolute values."""

    gap: float
    q_values: Doubles
    seconds: float
    cpu_seconds: float
    exact: bool
    estimates: tuple[Doubles, ...]
    values: Doubles
    feature_estimates: tuple[Doubles, ...]
    feature_error: float
    curves: Curves | None


def measure_attribution(
    policy: ExplainedPolicy,
    record: RaceRecord,
    car: int,
    races: int = 100,
    seed: int = FIDELITY_SEED,
    progress: Progress | None = None,
) -> dict[str, Any]:
    """Measure attributions of decisions drawn from `races` races that the policy calls; intervals are 95 % over decisions.

    Decisions are explained against lap-aligned races, by features where the policy has few enough for exact values, else by groups; in that
    case sampled values of features are measured as well (`feature_level`).
    """
    driven = sample_decisions(policy, record, car, races, seed)
    references = drive_references(policy, record, car)
    few = len(feature_set(policy.agent.feature_set)) <= MAX_EXACT_PLAYERS
    measured = []
    for done, moment in enumerate(driven.moments):
        measured.append(_measure(policy, moment, references, few, seed + done))
        if progress:
            progress(done + 1, len(driven.moments))
    q = np.stack([m.q_values for m in measured])
    gaps, own = np.array([m.gap for m in measured]), np.ptp(q, axis=1)
    return {
        "model": policy.name,
        "race": record.name,
        "races": races,
        "decisions": len(measured),
        "level": "feature" if few else "group",
        "q_range": float(np.ptp(q)),
        "efficiency_gap_of_q_range": {"mean": float((gaps / np.ptp(q)).mean()), "largest": float((gaps / np.ptp(q)).max())},
        "efficiency_gap_of_decision_range": {"mean": float((gaps / own).mean()), "largest": float((gaps / own).max())},
        "exact_by_construction": float(np.mean([m.exact for m in measured])),
        "seconds": _times([m.seconds for m in measured]),
        "cpu_seconds": _times([m.cpu_seconds for m in measured]),
        "sampled": _sampled_figures(measured),
        "feature_level": {} if few else _feature_figures(measured),
        "curves": curve_figures([m.curves for m in measured if m.curves]),
        "calibration": calibration(driven),
    }


def _measure(policy: ExplainedPolicy, moment: Moment, references: ReferenceRaces, few: bool, seed: int) -> _Measured:
    began, cpu = time.perf_counter(), time.process_time()
    explanation = explain_attribution(policy, moment, level="feature" if few else "group", references=references)
    seconds, cpu_seconds = time.perf_counter() - began, time.process_time() - cpu
    weights = np.zeros(4)
    weights[[ACTION_NAMES.index(explanation.decision.call), ACTION_NAMES.index(explanation.decision.alternative)]] = 1.0, -1.0
    state, name = policy.encoder(moment.record)(moment.raw), policy.agent.feature_set
    background = make_background(policy, moment, "lap_aligned", references).features
    # By the whole network, not the folded one: what the values should add up to.
    plain = policy.q_of_sequences(np.concatenate([state[None], background])).astype(np.float64) @ weights
    gap = abs(float(explanation.values.sum()) - (plain[0] - plain[1:].mean()))

    def function(features: bool) -> ValueFunction:
        cells = feature_level(name, (feature_players if features else group_players)(name), len(state))
        return ValueFunction(policy.agent, state, background, cells.owners, len(cells.labels))

    def estimates(v: ValueFunction) -> list[ShapleyValues]:
        budget = RECURRENT_BUDGET if policy.recurrent else BUDGET
        return [shapley_values(v, None, np.random.default_rng((seed, i)), budget, force_sampling=True) for i in range(SEEDS)]

    v = function(few)
    values = shapley_values(v, None, np.random.default_rng(seed), BUDGET).values @ weights
    by_feature = [] if few else estimates(function(True))
    errors = [s.standard_errors(weights).sum() / np.abs(s.values @ weights).sum() * np.sqrt(2 / np.pi) for s in by_feature]
    return _Measured(
        gap, np.array(list(explanation.decision.q_values.values())), seconds, cpu_seconds, explanation.exact,
        tuple(s.values @ weights for s in estimates(v)), values, tuple(s.values @ weights for s in by_feature),
        float(np.mean(errors)) if errors else 0.0,
        curves(v, weights, values, np.random.default_rng(seed)) if np.count_nonzero(values) >= FEWEST_PLAYERS else None,
    )  # fmt: skip


def _times(seconds: Sequence[float]) -> dict[str, float]:
    """Statistics of times. Processor time, over all threads, does not depend on other load of the machine."""
    return {"mean": float(np.mean(seconds)), "p95": float(np.quantile(seconds, 0.95)), "largest": float(np.max(seconds))}


def _sampled_figures(measured: Sequence[_Measured]) -> dict[str, Any]:
    """Error of sampled values against exact ones, and their agreement across seeds."""
    exact = [m for m in measured if m.exact and np.count_nonzero(m.values) > 1]
    errors = np.array([np.mean([np.abs(e - m.values).sum() for e in m.estimates]) / np.abs(m.values).sum() for m in exact])
    return {
        "relative_error": {"mean": float(errors.mean()), "interval": mean_interval(errors), "largest": float(errors.max())},
        "kendall_tau_across_seeds": _tau([m.estimates for m in exact]),
    }


def _feature_figures(measured: Sequence[_Measured]) -> dict[str, Any]:
    """Of sampled values of features, whose exact values are out of reach: the error that they state, and their agreement across seeds."""
    return {
        "stated_relative_error": float(np.mean([m.feature_error for m in measured])),
        "kendall_tau_across_seeds": _tau([m.feature_estimates for m in measured]),
    }


def _tau(estimates: Sequence[Sequence[Doubles]]) -> dict[str, Any]:
    """Mean Kendall tau between estimates of the same decision, over players with a value other than zero in any of them."""
    taus = []
    for several in estimates:
        counts = np.flatnonzero(np.any(several, axis=0))
        pairs = [(a[counts], b[counts]) for i, a in enumerate(several) for b in several[:i]]
        taus.append(np.mean([kendalltau(a, b).statistic for a, b in pairs]))
    return {"mean": float(np.mean(taus)), "interval": mean_interval(np.array(taus)), "lowest": float(np.min(taus))}


def calibration(driven: SampledDecisions) -> dict[str, Any]:
    """Calibration error of the value of the call made against its outcome, over all laps driven; intervals over races.

    The randomness of the rest of the race is part of it, so no critic reaches zero.
    """
    error = np.where(driven.running, driven.q - driven.outcome, 0.0)
    laps = driven.running.sum(axis=1)
    absolute, absolute_interval = _over_laps(np.abs(error).sum(axis=1), laps)
    bias, bias_interval = _over_laps(error.sum(axis=1), laps)
    return {
        "mean_absolute_error": absolute,
        "mean_absolute_error_interval": absolute_interval,
        "bias": bias,
        "bias_interval": bias_interval,
        "correlation": _correlation(driven.q[driven.running], driven.outcome[driven.running]),
        "decisions": int(laps.sum()),
    }


def _over_laps(sums: Doubles, laps: NDArray[np.int64]) -> tuple[float, tuple[float, float]]:
    """Mean a lap from sums by race [R], with its interval over races: laps of a race are not independent, and races differ in length."""
    mean = float(sums.sum() / laps.sum())
    low, high = mean_interval((sums - mean * laps) / laps.mean())
    return mean, (mean + low, mean + high)


def sample_decisions(policy: ExplainedPolicy, record: RaceRecord, car: int, races: int, seed: int) -> SampledDecisions:
    """Let the policy call races 0 to `races` - 1 of `seed` and draw decisions from them."""
    rng = np.random.default_rng(seed)
    drawn_laps = (rng.random(races) * record.laps).astype(np.int64)
    episodes = EpisodeRecorder(record, car, races, policy, states=True).record(seed)
    steps, every = np.arange(record.laps)[:, None], np.arange(races)
    at_random = np.argwhere(episodes.choices & (steps == drawn_laps))
    stops: dict[int, list[int]] = {}
    for step, race in np.argwhere(episodes.choices & (episodes.calls > 0)).tolist():
        stops.setdefault(race, []).append(step)
    drawn = [(among[rng.integers(len(among))], race) for race, among in stops.items()]
    moments = tuple(episodes.moment(step + 1, race) for step, race in [*at_random.tolist(), *drawn])
    q = episodes.q[steps, every, episodes.calls]
    return SampledDecisions(moments, episodes.running.T, q.T, _returns(policy, episodes))


def _returns(policy: ExplainedPolicy, episodes: Episodes) -> Doubles:
    """What the policy's values predict, float64 [R, L]."""
    rewards = episodes.rewards.T.astype(np.float64)
    if policy.goal:  # what extra stops cost is left out: a reward known when the race ends is compared
        scores = policy.goal.of_positions(episodes.outcome.position.astype(np.float64))
        return np.repeat(scores[:, None], rewards.shape[1], axis=1)
    returns, gamma = np.zeros_like(rewards), float(policy.about.config["gamma"])
    following = np.zeros(len(rewards))
    for lap in reversed(range(rewards.shape[1])):
        returns[:, lap] = following = rewards[:, lap] + gamma * following
    return returns


def _correlation(values: NDArray[Any], outcomes: NDArray[Any]) -> float:
    """Pearson's correlation; NaN where either does not vary, as when every race of a few ends in the same place."""
    varies = np.ptp(values) > 0 and np.ptp(outcomes) > 0
    return float(np.corrcoef(values, outcomes)[0, 1]) if varies else float("nan")
