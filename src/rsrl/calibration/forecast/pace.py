"""Forecast of a race before it is run: each car's pace against the field, the base lap, who is likelier to retire.

Of the race itself only the entry list, grid and qualifying are used.
"""

from collections.abc import Mapping, Sequence
from typing import Final, NamedTuple

import numpy as np
from sklearn.linear_model import LogisticRegression

from rsrl.calibration.forecast.form import FEATURES, FormBook
from rsrl.calibration.forecast.places import forecast_places
from rsrl.calibration.race.design import Array, Design, fit
from rsrl.season import Figure

SHRINK_ROWS: Final = 20.0  # ridge strength, in rows, on standardised features
PACE_NOISE: Final = 0.25  # per cent: standard error of a car's pace in a race, median of 2022 and of 2023; luck of the stints among it
RESULTS_SHARE: Final = 0.5  # of the forecast, that earlier results say; the rest is what earlier lap times say
OF_RESULTS: Final = tuple(name for name in FEATURES if name not in ("grid", "log_grid"))  # what the grid does, the race simulates
MIN_SD: Final = 0.15  # per cent: no forecast of a car's race pace is better
MIN_ROWS: Final = 60
GRID_SLOPE_SD: Final = 0.5  # prior of the log-odds of retiring per ten places
FEW_RACES_SD: Final = 0.45  # per cent: residual spread assumed with fewer than MIN_ROWS
BASE_GP_SD: Final = 0.008  # spread of base lap over qualifying lap between Grands Prix, share
BASE_YEAR_SD: Final = 0.004  # the same from year to year at one circuit
BASE_SEASON_SD: Final = 0.012  # base lap from year to year where no qualifying is known
WET_QUALI: Final = 0.035  # a base lap from qualifying this far above the last one: qualifying was wet
DRY_RATIO: Final = (1.005, 1.075)  # base lap over median qualifying lap beyond which one of the two was not dry


class PaceForecast(NamedTuple):
    """Pace of every starter against the mean starter, per cent of a lap."""

    pace: dict[str, float]
    sd: float  # of one car's race pace about it
    rows: int  # cars of earlier races it rests on
    weights: dict[str, float]  # per standard deviation of a feature


def forecast_pace(book: FormBook, index: int) -> PaceForecast:
    """Pace of race `index`, half from earlier lap times and half from earlier results.

    Lap times: robust ridge regression of race pace on `FEATURES`, fitted to the dry races before it. Results: the forecast of places from
    everything but the grid, put on the scale of pace: what wins places without showing in a fitted pace. The features of
    every race come from the races before it, never from itself.
    """
    rows, paces = _training_rows(book, index)
    now = book.features(index)
    drivers = list(now)
    x_now = np.array([now[d] for d in drivers])
    if len(paces) < MIN_ROWS:
        gap = x_now[:, FEATURES.index("driver_pace")]
        return PaceForecast(_centred(drivers, gap), FEW_RACES_SD, len(paces), {})
    x, y = np.array(rows), np.array(paces)
    mean, spread = x.mean(axis=0), x.std(axis=0)
    known = spread > 1e-9
    z, z_now = (x - mean)[:, known] / spread[known], (x_now - mean)[:, known] / spread[known]
    d = Design(len(y))
    d.add("mean", np.ones(len(y)))
    names = [n for n, k in zip(FEATURES, known, strict=True) if k]
    for name, column in zip(names, z.T, strict=True):
        d.add(name, column, 0.0, float(y.std()) / np.sqrt(SHRINK_ROWS))
    result = fit(d, y, np.arange(len(y)))
    predicted = z_now @ np.array([result.value(n) for n in names])
    left = float(np.average(result.residuals**2, weights=result.weights))
    sd = float(np.sqrt(max(left - PACE_NOISE**2, MIN_SD**2)))  # the simulator draws every stint's own deviation besides
    pace = _with_results(predicted, book, index)
    return PaceForecast(_centred(drivers, pace), sd, len(y), {n: result.value(n) for n in names})


def _with_results(pace: Array, book: FormBook, index: int) -> Array:
    """Pace mixed with the forecast of places, both with the spread over the field that lap times give."""
    forecast = forecast_places(book, index, OF_RESULTS)
    assert forecast is not None  # there are rows with a pace, so there are results
    own, results = _standardised(pace), _standardised(forecast.places)
    return _standardised((1 - RESULTS_SHARE) * own + RESULTS_SHARE * results) * float(pace.std())


def _standardised(values: Array) -> Array:
    return (values - values.mean()) / max(float(values.std()), 1e-9)


def _training_rows(book: FormBook, index: int) -> tuple[list[Array], list[float]]:
    rows: list[Array] = []
    paces: list[float] = []
    for race, features in book.training_races(index):
        for driver, pace in race.pace.items():
            if driver in features:
                rows.append(features[driver])
                paces.append(pace)
    return rows, paces


def _centred(drivers: list[str], values: Array) -> dict[str, float]:
    return dict(zip(drivers, (values - values.mean()).tolist(), strict=True))


def retirement_factors(book: FormBook, index: int) -> dict[str, float]:
    """Each starter's hazard of retiring against the average starter's, by place on the grid; mean 1.

    The slope is a logistic regression on the dry races before, with a prior of `GRID_SLOPE_SD` about none. In 2018-2023 11 % of the
    first five on the grid retired, and 18 % of the last five: slower cars break more often, and are nearer to trouble.
    """
    grids: list[float] = []
    out: list[bool] = []
    for race in book.races[:index]:
        if not race.wet:
            grids += [_tens(place) for place in race.facts.grid.values()]
            out += [driver in race.facts.retired for driver in race.facts.grid]
    slope = 0.0
    if 0 < sum(out) < len(out):
        model = LogisticRegression(C=GRID_SLOPE_SD**2).fit(np.array(grids)[:, None], np.array(out))
        slope = float(model.coef_[0, 0])
    raw = {driver: float(np.exp(slope * _tens(place))) for driver, place in book.races[index].facts.grid.items()}
    mean = float(np.mean(list(raw.values())))
    return {driver: value / mean for driver, value in raw.items()}


def _tens(place: int) -> float:
    """Place on the grid in tens, from the middle."""
    return (place - 10.5) / 10


class PastLevel(NamedTuple):
    """Lap-time level of an earlier dry race."""

    circuit: str
    season: int
    base_lap_s: float
    quali_s: float  # median best qualifying lap; NaN where unknown


def forecast_base_lap(past: Sequence[PastLevel], circuit: str, season: int, quali_s: float) -> Figure:
    """Base lap of a race that has not been run: from its qualifying and the ratio seen before, else from earlier years.

    Args:
        past: earlier dry races of any circuit.
        circuit: of the coming race.
        season: of the coming race.
        quali_s: its median qualifying lap, NaN where unknown.
    """
    here = sorted((p for p in past if p.circuit == circuit), key=lambda p: p.season)
    years = _from_years(here, season)
    ratios = [(p.circuit, float(np.log(p.base_lap_s / p.quali_s))) for p in past if _dry(p.base_lap_s / p.quali_s)]
    if np.isfinite(quali_s) and ratios:
        figure = _from_qualifying(ratios, circuit, quali_s)
        if years is None or figure.value < years.value * (1 + WET_QUALI):  # much below it: the track was made shorter
            return figure
    if years is not None:
        return years
    level = float(np.median([p.base_lap_s for p in past])) if past else 90.0
    return Figure(level, 8.0, 0, "a new track without qualifying: the median of all tracks")


def _dry(ratio: float) -> bool:
    return DRY_RATIO[0] < ratio < DRY_RATIO[1]


def _from_years(here: Sequence[PastLevel], season: int) -> Figure | None:
    if not here:
        return None
    last = here[-1]
    se = last.base_lap_s * BASE_SEASON_SD * float(np.sqrt(max(season - last.season, 1)))
    return Figure(last.base_lap_s, se, len(here), f"base lap of {last.season}, no dry qualifying known")


def _from_qualifying(ratios: Sequence[tuple[str, float]], circuit: str, quali_s: float) -> Figure:
    """Ratio of base lap to qualifying: this circuit's, shrunk to all."""
    everywhere = float(np.median([r for _, r in ratios]))
    own = [r for name, r in ratios if name == circuit]
    weight = len(own) / (len(own) + (BASE_YEAR_SD / BASE_GP_SD) ** 2)
    ratio = weight * float(np.mean(own)) + (1 - weight) * everywhere if own else everywhere
    se = float(np.hypot(BASE_GP_SD * np.sqrt(1 - weight), BASE_YEAR_SD))
    value = quali_s * float(np.exp(ratio))
    return Figure(value, value * se, len(own), f"median qualifying lap x {np.exp(ratio):.4f}, seen in {len(own)} earlier races here")


def pace_figures(forecast: PaceForecast, base_lap_s: float, known: Mapping[str, int]) -> dict[str, Figure]:
    """`pace_s` of every starter from a forecast; `known`: earlier races of each driver in the past given."""
    share = base_lap_s / 100
    note = f"forecast before the race from {forecast.rows} cars of earlier ones"
    return {d: Figure(p * share, forecast.sd * share, known.get(d, 0), note) for d, p in forecast.pace.items()}
