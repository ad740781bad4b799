"""Calibration of one Grand Prix: all fits, assembled into a `RaceRecord`."""

from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Final

import polars as pl

from rsrl import __version__
from rsrl.calibration.facts import RaceFacts, find_round, published_strategies, race_facts
from rsrl.calibration.form import fit_form
from rsrl.calibration.incidents import fit_incidents, retirement_hazards
from rsrl.calibration.pace import FUEL_START_KG, PaceModel, base_lap, car_pace, fit_pace, lap_noise
from rsrl.calibration.pit import PitFit, fit_pit
from rsrl.calibration.rivals import fit_rivals, sets_used
from rsrl.calibration.start import StartFit, fit_start
from rsrl.calibration.traffic import TrafficFit, fit_traffic
from rsrl.calibration.tyres import tyre_figures
from rsrl.errors import RsrlError
from rsrl.laps import BROKEN_RACES, RACE, WET, clean, file_fingerprint, read_seasons, season_file
from rsrl.season import EVENT_SLUGS, FIELD_SIZE, CarFigures, Figure, Provenance, RaceRecord, TrackFigures

MIN_RACE_LAPS: Final = 300  # driver-laps of a race below which there is nothing to fit
MIN_KEPT_LAPS: Final = 200
DEFAULT_TEAM: Final = "Mercedes"
DEFAULT_DRIVER: Final = "HAM"
MAX_LAPS_PER_SET: Final = {(2023, 17): 18}  # Qatar 2023, an FIA safety rule
Progress = Callable[[str], None]


@dataclass(frozen=True)
class CalibrationResult:
    """A record and what shows how good it is."""

    record: RaceRecord
    attrition: pl.DataFrame  # filter, removed, left: this Grand Prix
    residual_sd_s: float  # of the pace fit, robust, free air
    figures: pl.DataFrame  # name, value, se, n, note
    pace_laps: pl.DataFrame  # the laps fitted, with residual_s


@dataclass(frozen=True)
class _Inputs:
    """What all fits share."""

    dry: pl.DataFrame  # every dry race of the seasons, all laps
    season: int
    round: int
    event: str
    event_rounds: list[tuple[int, int]]
    facts: dict[tuple[int, int], RaceFacts]


def calibrate_race(
    name: str, laps_folder: Path, facts_folder: Path | None, seasons: tuple[int, ...], command: str, progress: Progress
) -> CalibrationResult:
    """Fit every figure of one race.

    Args:
        name: such as `bahrain-2023`; its season must be among `seasons`.
        laps_folder: holds `laps_<season>.csv.gz`.
        facts_folder: holds the results and published strategies; None: the grid is taken from lap 1, and the record says so.
        seasons: whose laps are used, for this Grand Prix and for what all races share.
        command: what remakes the file, for provenance.
        progress: called with a line as each step begins.

    Raises:
        RsrlError: an unknown or wet race, a broken file, too few laps.
    """
    progress("reading laps")
    table = read_seasons(laps_folder, tuple(sorted(set(seasons))))
    inputs = _inputs(table, name, facts_folder)
    progress("fitting pace, tyres and fuel")
    mine = _event(inputs.dry, inputs.event_rounds)
    cleaned = clean(mine, {key: inputs.facts[key].laps for key in inputs.event_rounds})
    if cleaned.laps.filter(pl.col("season") == inputs.season).height < MIN_KEPT_LAPS:
        raise RsrlError(f"{name}: hardly any green dry laps are left of {mine.height}; the race cannot be calibrated")
    distances = {s: inputs.facts[(s, r)].laps for s, r in inputs.event_rounds}
    model = fit_pace(cleaned.laps, inputs.season, distances, _c_numbers(mine, inputs, facts_folder))
    record = _assemble(name, inputs, model, facts_folder, progress)
    provenance = Provenance(
        command=command,
        date=datetime.now(UTC).date().isoformat(),
        version=__version__,
        data=tuple(file_fingerprint(season_file(laps_folder, s)) for s in sorted(set(seasons))),
        laps_used=cleaned.laps.height,
        laps_read=mine.height,
    )
    record = replace(record, provenance=provenance)
    return CalibrationResult(record, cleaned.attrition, model.fit.sigma, figure_table(record), model.laps)


def _inputs(table: pl.DataFrame, name: str, facts_folder: Path | None) -> _Inputs:
    season, number, event = find_round(table, name)
    race = table.filter((pl.col("season") == season) & (pl.col("round") == number))
    if race["compound"].is_in(list(WET)).any():
        raise RsrlError(f"{name}: was a wet race, and there is no wet-weather model; choose a dry one")
    if race.height < MIN_RACE_LAPS or race["driver"].n_unique() > FIELD_SIZE:
        raise RsrlError(f"{name}: {race.height} laps of {race['driver'].n_unique()} cars is no whole race; check its lap file")
    wet = table.filter(pl.col("compound").is_in(list(WET))).select(*RACE).unique()
    dry = table.join(wet, on=RACE, how="anti").filter(pl.len().over(*RACE) >= MIN_RACE_LAPS)
    for s, r in BROKEN_RACES:
        dry = dry.filter((pl.col("season") != s) | (pl.col("round") != r))
    races = dry.select(*RACE, "event").unique().sort(*RACE)
    rounds = [(s, r) for s, r, e in races.iter_rows() if EVENT_SLUGS.get(e) == EVENT_SLUGS[event]]
    facts = {(s, r): race_facts(dry, facts_folder, s, r) for s, r, _ in races.iter_rows()}
    return _Inputs(dry, season, number, event, rounds, facts)


def _event(table: pl.DataFrame, rounds: list[tuple[int, int]]) -> pl.DataFrame:
    return table.join(pl.DataFrame(rounds, schema={"season": pl.Int64, "round": pl.Int64}, orient="row"), on=RACE)


def _c_numbers(mine: pl.DataFrame, inputs: _Inputs, facts_folder: Path | None) -> dict[str, str]:
    """C-number by colour: from the laps, a compound nobody ran taken as the next one."""
    own = mine.filter(pl.col("season") == inputs.season).drop_nulls("compound_c")
    found = dict(own.group_by("compound").agg(pl.col("compound_c").mode().first()).iter_rows())
    if not found:
        raise RsrlError(f"{inputs.event} {inputs.season}: the lap file has no C-numbers; add the column compound_c")
    step = {"S": 1, "M": 0, "H": -1}
    letter, c = next(iter(sorted(found.items())))
    middle = int(c[1]) - step[letter]
    return {x: found.get(x, f"C{min(max(middle + step[x], 0), 5)}") for x in step}


def _assemble(name: str, inputs: _Inputs, model: PaceModel, facts_folder: Path | None, progress: Progress) -> RaceRecord:
    facts = inputs.facts[(inputs.season, inputs.round)]
    mine = _event(inputs.dry, inputs.event_rounds)
    teams = dict(mine.filter(pl.col("season") == inputs.season).select("driver", "team").unique().iter_rows())
    starters = [(teams[d], d) for d in sorted(facts.grid, key=facts.grid.__getitem__)]
    base = base_lap(model, starters)
    noise, factors = lap_noise(model)
    progress("fitting pit stops, start and traffic")
    pit = fit_pit(inputs.dry, model, inputs.event_rounds)
    start = fit_start(inputs.dry, model, inputs.facts, inputs.season)
    traffic = fit_traffic(model.laps, model, noise.value)
    progress("fitting form, incidents and rivals")
    kept = clean(inputs.dry, {key: f.laps for key, f in inputs.facts.items()}).laps
    form = fit_form(kept, inputs.season, base.value)
    green_s = float(model.laps.filter(pl.col("season") == inputs.season)["lap_time_s"].median())  # type: ignore[arg-type]
    sets = sets_used(inputs.dry, inputs.season, inputs.round)
    cars = _cars(inputs, model, starters, form, factors, start, pit)
    drivers = {d for _, d in starters}
    return RaceRecord(
        name=name,
        season=inputs.season,
        round=inputs.round,
        event=inputs.event,
        grand_prix=EVENT_SLUGS[inputs.event],
        laps=facts.laps,
        wet=False,
        default_driver=DEFAULT_DRIVER if DEFAULT_DRIVER in drivers else starters[len(starters) // 4][1],
        max_laps_per_set=MAX_LAPS_PER_SET.get((inputs.season, inputs.round), 0),
        track=_track(base, model, noise, start, traffic),
        tyres=tyre_figures(model, pit.cold_s, sets),
        pit=pit.figures,
        incidents=fit_incidents(inputs.dry, inputs.event_rounds, base.value / green_s),
        cars=cars,
        rivals=fit_rivals(inputs.dry, inputs.facts, inputs.season, inputs.event_rounds, sets),
        published=published_strategies(facts_folder, inputs.season, inputs.round, facts.laps),
        provenance=Provenance("", "", "", (), 0, 0),
    )


def _track(base: Figure, model: PaceModel, noise: Figure, start: StartFit, traffic: TrafficFit) -> TrackFigures:
    fuel, se = model.fit.combine({"fuel": 1.0})
    return TrackFigures(
        base_lap_s=base,
        fuel_s_per_kg=Figure(fuel, se, model.laps.height, "prior 0.031 +- 0.005; holds what the track gains over the race too"),
        fuel_start_kg=Figure(FUEL_START_KG, 2.0, 0, "technical regulations: 110 kg at most"),
        lap_noise_sd_s=noise,
        start_loss_s=start.loss_s,
        start_per_place_s=start.per_place_s,
        start_sd_s=start.sd_s,
        **traffic._asdict(),
    )


def _cars(
    inputs: _Inputs,
    model: PaceModel,
    starters: list[tuple[str, str]],
    form: Figure,
    factors: dict[str, Figure],
    start: StartFit,
    pit: PitFit,
) -> tuple[CarFigures, ...]:
    hazards = retirement_hazards(inputs.dry, inputs.facts, inputs.season, inputs.event_rounds)
    zero = Figure(0.0, 0.3, 0, "too few laps: the field's")
    return tuple(
        CarFigures(
            driver=driver,
            team=team,
            grid=place + 1,
            pace_s=car_pace(model, starters, team, driver),
            form_sd_s=form,
            noise_factor=factors.get(driver, Figure(1.0, 0.2, 0, "too few laps: the field's")),
            start_gain_s=start.gains_s.get(driver, zero),
            retire_per_lap=hazards[team],
            stop_loss_s=pit.team_s.get(team, zero),
        )
        for place, (team, driver) in enumerate(starters)
    )


def figure_table(record: RaceRecord) -> pl.DataFrame:
    """Every figure of a record: `name, value, se, n, note`."""
    rows: list[tuple[str, float, float, int, str]] = []

    def walk(item: Any, name: str) -> None:
        if isinstance(item, Figure):
            rows.append((name, item.value, item.se, item.n, item.note))
        elif isinstance(item, dict):
            for key, value in item.items():
                walk(value, f"{name}.{key}")
        elif isinstance(item, CarFigures):
            for f in fields(item):
                walk(getattr(item, f.name), f"cars.{item.driver}.{f.name}")
        elif isinstance(item, tuple):
            for value in item:
                walk(value, name)
        elif hasattr(item, "__dataclass_fields__"):
            for f in fields(item):
                walk(getattr(item, f.name), f"{name}.{f.name}" if name else f.name)

    walk(record, "")
    return pl.DataFrame(
        rows, schema={"name": pl.String, "value": pl.Float64, "se": pl.Float64, "n": pl.Int64, "note": pl.String}, orient="row"
    )
