"""When teams box and for which compound: a model fitted to any set of races, and the `RivalFigures` of a race from it.

Boxing is a logistic regression on the features of `season.rival_features`, the compound a multinomial logit over the three. What a pit wall
expects of a race (usual stints, number of stops, compounds) comes from the races known (`stint_lengths`). In the fit these include the race
itself, as if teams had known how long its tyres would last; what they could not know is in the standard errors of the usual stints,
which the compiled race draws once for all cars.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
import polars as pl
from numpy.typing import NDArray

from rsrl.calibration.bounded import truncated
from rsrl.calibration.entry import RaceEntry, RaceKey
from rsrl.calibration.rivals import prior
from rsrl.calibration.rivals.decisions import RaceDecisions
from rsrl.calibration.rivals.features import choice_features, hazard_features, is_young, numbers, pieces, usual_stint
from rsrl.calibration.rivals.plans import Reactions, intended_plans, reaction_figures
from rsrl.calibration.rivals.stint_lengths import Outlook, RaceSummary, outlooks
from rsrl.season import CHOICE_FEATURES, COMPOUNDS, HAZARD_FEATURES, LIFE_NAMES, Figure, RivalFigures
from rsrl.season.bounds import bounds_of
from rsrl.season.rival_features import AGE_CAP, STOPS_LEVELS

Matrix = NDArray[np.float64]

STILL_TO_COME: Final = (-1.5, 0.0, 1.0, 2.0)
"""Knots of the number of expected stops less stops made."""

FEW_RACES: Final = 8  # with fewer, their decisions are taken as independent: so few clusters have no spread to speak of
LONGEST_STINT: Final = 1.5  # race distances: a usual stint beyond the flag
EXPECTED: Final = len(STILL_TO_COME) - 1
"""Features of stops still to come."""


@dataclass(frozen=True)
class RivalModel:
    """A fitted model of decisions.

    Attributes:
        hazard, hazard_cov: coefficients of `hazard_design` and their covariance, races taken as independent clusters.
        choice, choice_cov: the same for `choice_design`.
        reactions: what plans do under safety cars, for rivals that drive plans.
        past: the races known, with their summaries.
        decisions, stops, choices: rows fitted.
    """

    hazard: Matrix
    hazard_cov: Matrix
    choice: Matrix
    choice_cov: Matrix
    reactions: Reactions
    past: tuple[tuple[RaceKey, RaceSummary], ...]
    decisions: int
    stops: int
    choices: int


def fit_rival_model(races: Sequence[RaceDecisions]) -> RivalModel:
    """Fit the model to the dry races among those given, in any order; with few of them it is close to `prior`."""
    used = sorted((r for r in races if r.summary is not None), key=lambda r: (r.key.season, r.key.round))
    past = tuple((r.key, r.summary) for r in used if r.summary is not None)
    known = [(r.rows, outlook) for r, outlook in zip(used, outlooks(past, [key for key, _ in past]), strict=True)]
    fitted = [without_young_sets(rows, outlook) for rows, outlook in known]
    groups = np.repeat(np.arange(len(used)), [g.height for g in fitted])
    designs = [hazard_design(rows, outlook) for rows, (_, outlook) in zip(fitted, known, strict=True)]
    boxed = np.concatenate([g["box"].to_numpy() for g in fitted]).astype(np.float64)
    hazard, hazard_cov = fit_logistic(np.vstack(designs), boxed, groups, prior.HAZARD, prior.HAZARD_PRECISION)
    stops = [g.filter(pl.col("box") & (pl.col("fits") >= 0)) for g in fitted]
    taken = np.concatenate([s["fits"].to_numpy() for s in stops])
    choices = np.concatenate([choice_design(rows, outlook) for rows, (_, outlook) in zip(stops, known, strict=True)])
    of_race = np.repeat(np.arange(len(used)), [s.height for s in stops])
    choice, choice_cov = fit_choice(choices, taken, of_race, prior.CHOICE, prior.CHOICE_PRECISION)
    reactions = reaction_figures([(rows, outlook.stint_laps) for rows, outlook in known])
    return RivalModel(hazard, hazard_cov, choice, choice_cov, reactions, past, len(boxed), int(boxed.sum()), len(taken))


def without_young_sets(rows: pl.DataFrame, outlook: Outlook) -> pl.DataFrame:
    """Decisions but those on young sets, which the model does not cover."""
    return rows.filter(~is_young(rows, _spread(outlook, rows)))


def hazard_design(rows: pl.DataFrame, outlook: Outlook) -> Matrix:
    """Design of boxing: `HAZARD_FEATURES`, with stops still to come beside stops made: one fit covers races of one and of three stops."""
    features = hazard_features(rows, _spread(outlook, rows))
    to_come = pieces(outlook.stops - numbers(rows, "made"), STILL_TO_COME)
    age = np.minimum((numbers(rows, "age") + 1) / usual_stint(rows, _spread(outlook, rows)), AGE_CAP)[:, None]
    return np.hstack([features[:, :STOPS_LEVELS], to_come, age, to_come * age, features[:, 2 * STOPS_LEVELS :]])


def choice_design(rows: pl.DataFrame, outlook: Outlook) -> Matrix:
    """Design of the compound: soft and hard against medium, how usual each is here, then as `CHOICE_FEATURES`."""
    features = choice_features(rows, _spread(outlook, rows))
    usual = np.broadcast_to(np.log(outlook.fitted)[None, :, None], (rows.height, 3, 1))
    return np.concatenate([features[:, :, [0, 2]], usual, features[:, :, 3:]], axis=2)


def _spread(outlook: Outlook, rows: pl.DataFrame) -> Matrix:
    return np.broadcast_to(outlook.stint_laps, (rows.height, 2, 3))


def fit_logistic(design: Matrix, outcome: Matrix, groups: NDArray[np.int64], centre: Matrix, precision: float) -> tuple[Matrix, Matrix]:
    """Logistic regression with prior N(centre, 1 / precision) of each coefficient, by Newton's method; coefficients and covariance."""
    beta = centre.copy()

    def loss(b: Matrix) -> float:
        logit = design @ b
        return float(np.logaddexp(0, logit).sum() - outcome @ logit + 0.5 * precision * (b - centre) @ (b - centre))

    best = loss(beta)
    while True:
        p: Matrix = 1 / (1 + np.exp(-design @ beta))
        hessian = (design.T * (p * (1 - p))) @ design + precision * np.eye(len(beta))
        step = np.linalg.solve(hessian, design.T @ (outcome - p) - precision * (beta - centre))
        beta, now = _along(loss, beta, step, best)
        if best - now < 1e-4:
            return beta, _covariance(np.linalg.inv(hessian), design * (outcome - p)[:, None], groups, precision)
        best = now


def fit_choice(
    design: Matrix, taken: NDArray[np.int64], groups: NDArray[np.int64], centre: Matrix, precision: float
) -> tuple[Matrix, Matrix]:
    """Multinomial logit of a design [n, 3, features] with prior N(centre, 1 / precision), by Newton's method; coefficients, covariance."""
    rows = np.arange(len(taken))
    beta = centre.copy()

    def loss(b: Matrix) -> float:
        utility = design @ b
        chosen = utility[rows, taken].sum()
        return float(np.logaddexp.reduce(utility, axis=1).sum() - chosen + 0.5 * precision * (b - centre) @ (b - centre))

    best = loss(beta)
    while True:
        utility = design @ beta
        p = np.exp(utility - np.logaddexp.reduce(utility, axis=1)[:, None])
        centred = design - np.einsum("nc,ncf->nf", p, design)[:, None]
        hessian = np.einsum("nc,ncf,ncg->fg", p, centred, centred) + precision * np.eye(len(beta))
        scores = centred[rows, taken]
        beta, now = _along(loss, beta, np.linalg.solve(hessian, scores.sum(axis=0) - precision * (beta - centre)), best)
        if best - now < 1e-4:
            return beta, _covariance(np.linalg.inv(hessian), scores, groups, precision)
        best = now


def _along(loss: Callable[[Matrix], float], beta: Matrix, step: NDArray[Any], best: float) -> tuple[Matrix, float]:
    """Line search: the step is halved until the loss does not grow."""
    length = 1.0
    while length > 1e-4:
        now = loss(beta + length * step)
        if now <= best:
            return beta + length * step, now
        length /= 2
    return beta, best


def _covariance(bread: NDArray[Any], scores: Matrix, groups: NDArray[np.int64], precision: float) -> Matrix:
    """Covariance clustered by races (sandwich), the prior as one more observation of each coefficient; see `FEW_RACES`."""
    races = np.unique(groups)
    if len(races) < FEW_RACES:
        return np.asarray(bread)
    sums = np.zeros((int(races.max()) + 1, scores.shape[1]))
    np.add.at(sums, groups, scores)
    covariance: Matrix = bread @ (sums.T @ sums + precision * np.eye(len(bread))) @ bread
    return covariance


def expectation(model: RivalModel, race: RaceKey) -> Outlook:
    """What is to be expected of a race, from the races the model knows."""
    return outlooks(model.past, [race])[0]


def rival_figures(model: RivalModel, entry: RaceEntry) -> RivalFigures:
    """Rivals of a race: one that the model was fitted to is described, any other is forecast."""
    outlook = expectation(model, entry)
    note = f"{model.stops} stops in {model.decisions} decisions of {len(model.past)} races"
    return RivalFigures(
        plans=intended_plans(outlook, entry.laps, {c: entry.sets[c] for c in COMPOUNDS}, entry.max_laps_per_set, entry.min_sets),
        jitter_sd_laps=model.reactions.jitter(float(outlook.stint_laps[0] @ outlook.starts)),
        sc_window_laps=model.reactions.sc_window_laps,
        sc_reaction=model.reactions.sc_reaction,
        vsc_window_laps=model.reactions.vsc_window_laps,
        vsc_reaction=model.reactions.vsc_reaction,
        life_laps=_stint_figures(outlook, entry.laps, len(model.past)),
        hazard=_folded(HAZARD_FEATURES, _hazard_fold(outlook.stops), model.hazard, model.hazard_cov, model.decisions, note),
        choice=_folded(CHOICE_FEATURES, _choice_fold(outlook), model.choice, model.choice_cov, model.choices, f"{model.choices} stops"),
    )


def _stint_figures(outlook: Outlook, laps: int, races: int) -> dict[str, Figure]:
    values, errors = outlook.stint_laps.ravel(), outlook.stint_log_se.ravel()
    note = "usual stint expected from the other races known"
    least, most = bounds_of("rivals.life_laps.S")
    return {
        name: truncated(Figure(float(v), float(v * se), races, note), least, min(most, LONGEST_STINT * laps))
        for name, v, se in zip(LIFE_NAMES, values, errors, strict=True)
    }


def _hazard_fold(stops: float) -> Matrix:
    """Matrix from coefficients of `hazard_design` to those of `HAZARD_FEATURES`, at a race's expected number of stops."""
    kept = len(HAZARD_FEATURES) - 2 * STOPS_LEVELS
    ahead = pieces(stops - np.arange(STOPS_LEVELS, dtype=np.float64), STILL_TO_COME)
    fold = np.zeros((len(HAZARD_FEATURES), STOPS_LEVELS + 2 * EXPECTED + 1 + kept))
    fold[:STOPS_LEVELS, :STOPS_LEVELS] = np.eye(STOPS_LEVELS)
    fold[:STOPS_LEVELS, STOPS_LEVELS : STOPS_LEVELS + EXPECTED] = ahead
    fold[STOPS_LEVELS : 2 * STOPS_LEVELS, STOPS_LEVELS + EXPECTED] = 1.0
    fold[STOPS_LEVELS : 2 * STOPS_LEVELS, STOPS_LEVELS + EXPECTED + 1 : STOPS_LEVELS + 2 * EXPECTED + 1] = ahead
    fold[2 * STOPS_LEVELS :, -kept:] = np.eye(kept)
    return fold


def _choice_fold(outlook: Outlook) -> Matrix:
    kept = len(CHOICE_FEATURES) - 3
    fold = np.zeros((len(CHOICE_FEATURES), 3 + kept))
    fold[0, 0] = fold[2, 1] = 1.0
    fold[:3, 2] = np.log(outlook.fitted)
    fold[3:, 3:] = np.eye(kept)
    return fold


def _folded(names: tuple[str, ...], fold: Matrix, beta: Matrix, covariance: Matrix, n: int, note: str) -> dict[str, Figure]:
    values, errors = fold @ beta, np.sqrt(np.einsum("ij,jk,ik->i", fold, covariance, fold))
    return {name: Figure(float(v), float(se), n, note) for name, v, se in zip(names, values, errors, strict=True)}
