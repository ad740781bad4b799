"""The rolling backtest: every race of a season predicted from the races before it, and scored against what happened."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
import polars as pl

from rsrl.calibration import RaceFacts
from rsrl.errors import RsrlError
from rsrl.evaluation.backtest.ablation import ABLATIONS, script_without, without
from rsrl.evaluation.backtest.baselines import grid_prediction, regression_prediction
from rsrl.evaluation.backtest.forecast import Season, forecast_record
from rsrl.evaluation.backtest.hindsight import hindsight_pace
from rsrl.evaluation.backtest.observed import observe_race, replay_script
from rsrl.evaluation.backtest.scores import POINTS_PLACES, Actual, Predicted, average, differences, score
from rsrl.results import Car, MeanInterval
from rsrl.season import RaceRecord
from rsrl.simulator import LapMeans, Script, lap_means

MODES: Final = ("forecast", "replay", "hindsight", "plans")
BASELINES: Final = ("grid", "regression")
SIMULATION: Final = "simulation"
Progress = Callable[[str, int, int], None]
"""Called with (what is being done, how much of it is done, of how much)."""


@dataclass(frozen=True)
class RaceScores:
    """One race: scores by predictor, and its cars."""

    name: str
    season: int
    round: int
    wet: bool
    scores: Mapping[str, Mapping[str, float]]  # predictor to measures
    cars: tuple[Car, ...]


@dataclass(frozen=True)
class Backtest:
    """The whole of it; `overall` is over the dry races, `all_races` over all of them."""

    mode: str
    fit: tuple[int, ...]
    test: int
    simulated_races: int
    seed: int
    left_out: str | None  # the ablation
    races: tuple[RaceScores, ...]
    overall: Mapping[str, Mapping[str, float]]
    all_races: Mapping[str, Mapping[str, float]]
    against_grid: Mapping[str, Mapping[str, MeanInterval]]  # predictor, measure: difference over the dry races


def check_request(mode: str, fit: tuple[int, ...], test: int, races: int, left_out: str | None) -> None:
    """Raise RsrlError for a mode, seasons, number of races or ablation that cannot be."""
    if mode not in MODES:
        raise RsrlError(f"mode {mode!r}; there are {', '.join(MODES)}")
    if not fit:
        raise RsrlError("no season to fit; name at least one with --fit, for instance 2022,2023")
    if late := [s for s in fit if s >= test]:
        raise RsrlError(
            f"season {late[0]} cannot be fitted to predict {test}: it is not before it; earlier rounds of {test} are used anyway"
        )
    if races < 1:
        raise RsrlError(f"races is {races}; ask for one at least")
    if left_out is not None and mode == "plans":
        raise RsrlError("--without takes part in forecast, replay and hindsight only; leave it out")
    if left_out is not None and left_out not in ABLATIONS:
        raise RsrlError(f"cannot take out {left_out!r}; parts are {', '.join(ABLATIONS)}")


def run_backtest(
    season: Season, mode: str, *, races: int = 1000, seed: int = 0, left_out: str | None = None, progress: Progress | None = None
) -> Backtest:
    """Predict and score every race of the test season.

    Args:
        season: laps, results and analyses of the fitted seasons and the test season (`read_season`).
        mode: `forecast` (nothing of the race but grid and qualifying), `replay` (its stops, incidents and retirements too) or
            `hindsight` (its pace as well).
        races: simulated races for each.
        left_out: one of `ABLATIONS`, taken out of the simulator and out of the estimates made with it.

    Raises:
        RsrlError: see `check_request`; a race that cannot be read.
    """
    check_request(mode, season.fit, season.test, races, left_out)
    scored = []
    indices = season.test_indices
    for n, index in enumerate(indices):
        if progress:
            progress(season.name(index), n, len(indices))
        scored.append(_one_race(season, index, mode, races, seed, left_out))
    if progress:
        progress("scored", len(indices), len(indices))
    dry = [r for r in scored if not r.wet]
    return Backtest(
        mode, season.fit, season.test, races, seed, left_out, tuple(scored), _averages(dry), _averages(scored), _against_grid(dry)
    )


def _averages(races: Sequence[RaceScores]) -> dict[str, dict[str, float]]:
    names = (SIMULATION, *BASELINES)
    return {name: average([r.scores[name] for r in races]) for name in names} if races else {}


def _against_grid(races: Sequence[RaceScores]) -> dict[str, dict[str, MeanInterval]]:
    if not races:
        return {}
    grid = [r.scores["grid"] for r in races]
    return {name: differences([r.scores[name] for r in races], grid) for name in (SIMULATION, "regression")}


def _one_race(season: Season, index: int, mode: str, races: int, seed: int, left_out: str | None) -> RaceScores:
    facts, laps = season.book.races[index].facts, season.laps_of(index)
    actual = observe_race(laps, facts)
    record, script = prepare_race(season, index, mode, left_out)
    means = lap_means(record, races, seed, script=script, as_dry=True)
    predicted = _predicted(means, len(facts.grid))
    scores = {
        SIMULATION: score(predicted, actual),
        "grid": score(grid_prediction(season.book, index), actual),
        "regression": score(regression_prediction(season.book, index), actual),
    }
    past = season.book.races[index]
    return RaceScores(record.name, past.season, past.round, past.wet, scores, _cars(facts, actual, predicted))


def prepare_race(season: Season, index: int, mode: str, left_out: str | None = None) -> tuple[RaceRecord, Script | None]:
    """The record of a race as the mode knows it, and the script it replays (None: it decides for itself)."""
    record = forecast_record(season, index)
    if left_out:
        record = without(record, left_out)
    if mode == "forecast":
        return record, None
    laps, facts = season.laps_of(index), season.book.races[index].facts
    script = replay_script(laps, facts)
    if mode == "hindsight":
        record = _with_hindsight(record, laps)
    return record, script_without(script, left_out) if left_out else script


def _with_hindsight(record: RaceRecord, laps: pl.DataFrame) -> RaceRecord:
    """The record with base lap and every car's pace from the race itself, and what that leaves uncertain as the spread of its form."""
    before = {car.driver: car.pace_s._replace(se=car.form_sd_s.value) for car in record.cars}
    base, paces = hindsight_pace(laps, record, before)
    own = (replace(c, pace_s=paces[c.driver], form_sd_s=c.form_sd_s._replace(value=paces[c.driver].se)) for c in record.cars)
    cars = tuple(replace(c, team_form_share=None) for c in own)  # what is left is the error of each car's own laps
    return replace(record, cars=cars, track=replace(record.track, base_lap_s=base))


def _predicted(means: LapMeans, cars: int) -> Predicted:
    results = means.results
    positions = results.positions[:, :cars]
    finished = ~results.retired[:, :cars]
    stops = np.where(finished.any(axis=0), (results.stops[:, :cars] * finished).sum(axis=0) / np.maximum(finished.sum(axis=0), 1), np.nan)
    return Predicted(
        position=np.median(positions, axis=0),
        mean_position=positions.mean(axis=0),
        p_points=(positions <= POINTS_PLACES).mean(axis=0),
        p_win=(positions == 1).mean(axis=0),
        lap_positions=means.position[:, :cars],
        green_lap_s=means.green_lap_s[:, :cars],
        stops=stops,
        first_stop=_median_lap(means.first_stop[:, :cars]),
        sc_laps=means.sc_laps,
    )


def _median_lap(counts: np.ndarray) -> np.ndarray:
    """Median lap of the first stop of each car over the races in which it made one; nan where it never did."""
    made = counts[1:]
    total = made.sum(axis=0)
    middle = (made.cumsum(axis=0) * 2 >= np.maximum(total, 1)).argmax(axis=0) + 1.0
    return np.asarray(np.where(total > 0, middle, np.nan))


def _cars(facts: RaceFacts, actual: Actual, predicted: Predicted) -> tuple[Car, ...]:
    stops, first_stop = predicted.stops, predicted.first_stop
    assert stops is not None
    assert first_stop is not None
    return tuple(
        Car(
            driver=driver,
            team=facts.teams[driver],
            grid=place,
            position=facts.positions[driver],
            predicted=float(predicted.mean_position[i]),
            p_points=float(predicted.p_points[i]),
            p_win=float(predicted.p_win[i]),
            stops=float(actual.stops[i]),
            stops_predicted=float(stops[i]),
            first_stop=float(actual.first_stop[i]),
            first_stop_predicted=float(first_stop[i]),
        )
        for i, (driver, place) in enumerate(facts.grid.items())
    )
