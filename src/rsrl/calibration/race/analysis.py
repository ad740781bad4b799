"""Stage one: all figures that one race gives by itself, with standard errors; no other race is used."""

from dataclasses import dataclass
from typing import Final

import numpy as np
import polars as pl

from rsrl.calibration.entry import RaceEntry, completed, make_entry
from rsrl.calibration.race.design import Array
from rsrl.calibration.race.incidents import IncidentAnalysis, analyse_incidents
from rsrl.calibration.race.pace_and_tyres import PaceModel, car_paces, fit_pace, lap_noise, shared_figures
from rsrl.calibration.race.pit import PitAnalysis, analyse_pit, lane_time
from rsrl.calibration.race.start import StartAnalysis, analyse_start
from rsrl.calibration.race.traffic import TrafficAnalysis, analyse_traffic
from rsrl.calibration.race_facts import RaceFacts
from rsrl.calibration.rivals.decisions import RaceDecisions, race_decisions
from rsrl.laps import clean
from rsrl.season import Figure

MIN_RACE_LAPS: Final = 300  # driver-laps of a race below which there is nothing to fit
MIN_KEPT_LAPS: Final = 200
MIN_PACE_LAPS: Final = 5  # of a driver, for a pace of his own


@dataclass(frozen=True)
class PaceAnalysis:
    """Pace, tyres and noise of one race."""

    cars: dict[str, Figure]  # against the mean of the cars here; a driver with hardly a lap is absent
    base_lap_s: Figure
    gain_s: Figure  # start to flag: fuel and track
    wear_s: dict[str, Figure]  # by colour letter
    offset_s: dict[str, Figure]
    noise_s: Figure
    noise_by_driver: dict[str, tuple[float, int]]  # own noise, from so many differences
    stint_sd_s: Figure
    residual_sd_s: float
    worst_s: float  # largest mean residual of a car on a stint of five laps or more
    names: tuple[str, ...]  # of `shared`: base, gain, wear S .. offset H, with hardly a prior
    shared: Array
    shared_cov: Array
    laps_by_letter: dict[str, int]
    oldest: dict[str, int]  # laps on the oldest set, by letter


@dataclass(frozen=True)
class RaceAnalysis:
    """Figures of one race. The parts are None for a wet race and for one with too few laps."""

    entry: RaceEntry  # as driven
    laps_read: int
    laps_used: int
    laps_unknown: int  # on tyres that are not on record: no fit uses them
    attrition: pl.DataFrame  # filter, removed, left
    pace: PaceAnalysis | None
    start: StartAnalysis | None
    pit: PitAnalysis | None
    lane_s: Figure | None  # pit-lane time of a quick stop; known of wet races too
    traffic: TrafficAnalysis | None
    incidents: IncidentAnalysis | None
    retired: tuple[tuple[str, int], ...]  # driver, laps completed
    decisions: RaceDecisions
    warnings: tuple[str, ...]

    @property
    def dry(self) -> bool:
        """Whether it was a dry race with enough laps to fit."""
        return self.pace is not None


def analyse_race(race: pl.DataFrame, facts: RaceFacts, c_numbers: dict[str, str], published: tuple[str, ...] = ()) -> RaceAnalysis:
    """Analyse one race.

    Args:
        race: its laps, all cars.
        facts: its grid, distance and result.
        c_numbers: C-number by colour letter, as far as it is known.
        published: strategies published before the race, passed on.
    """
    season, unknown = int(race["season"][0]), race["compound"].null_count()
    entry = make_entry(race, facts, completed(c_numbers, season), published, as_driven=True)
    cleaned = clean(race, {entry.season_round: entry.laps})
    out = tuple((d, facts.laps_done.get(d, 0)) for d in sorted(facts.retired))
    whole = not entry.wet and race.height >= MIN_RACE_LAPS and cleaned.laps.height >= MIN_KEPT_LAPS
    warnings = _about_laps(unknown, c_numbers)
    if not whole:
        warnings += ("wet" if entry.wet else f"only {cleaned.laps.height} green dry laps",)
    decisions = race_decisions(race, facts, *entry.season_round)
    if not whole:
        return RaceAnalysis(
            entry, race.height, 0, unknown, cleaned.attrition, None, None, None, lane_time(race), None, None, out, decisions, warnings
        )
    model = fit_pace(cleaned.laps, entry.laps, entry.c_numbers)
    pace = _pace(model, entry)
    start = analyse_start(race, model, facts.grid)
    pit = analyse_pit(race, model)
    return RaceAnalysis(
        entry=entry,
        laps_read=race.height,
        laps_used=cleaned.laps.height,
        laps_unknown=unknown,
        attrition=cleaned.attrition,
        pace=pace,
        start=start,
        pit=pit,
        lane_s=lane_time(race),
        traffic=analyse_traffic(cleaned.laps, model, pace.noise_s.value),
        incidents=analyse_incidents(race),
        retired=out,
        decisions=decisions,
        warnings=(*warnings, *_warnings(pace, start, pit)),
    )


def _pace(model: PaceModel, entry: RaceEntry) -> PaceAnalysis:
    """Figures of the fitted race; what is pooled comes from a second fit that leaves the tyres' priors out."""
    laps = model.laps
    counts = dict(laps.group_by("driver").len().iter_rows())
    cars = [(team, driver) for driver, team, _ in entry.starters if counts.get(driver, 0) >= MIN_PACE_LAPS]
    weak = fit_pace(laps.drop("residual_s"), entry.laps, entry.c_numbers, weak=True, stint_sd_s=model.stint_sd_s)
    names, shared, cov = shared_figures(weak, cars)
    own_names, own, own_cov = shared_figures(model, cars)
    own_se = np.sqrt(np.diag(own_cov))
    n = laps.height
    figures = {name: Figure(float(v), float(s), n) for name, v, s in zip(own_names, own, own_se, strict=True)}
    noise, by_driver = lap_noise(model)
    stints = laps.group_by("driver", "stint_number").agg(pl.col("residual_s").mean(), n=pl.len()).filter(pl.col("n") >= 5)
    return PaceAnalysis(
        cars=car_paces(model, cars),
        base_lap_s=figures["base"],
        gain_s=figures["gain"],
        wear_s={name[-1]: f for name, f in figures.items() if name.startswith("wear")},
        offset_s={name[-1]: f for name, f in figures.items() if name.startswith("offset")},
        noise_s=noise,
        noise_by_driver=by_driver,
        stint_sd_s=Figure(model.stint_sd_s, model.stint_sd_s / float(np.sqrt(2 * max(stints.height, 2))), stints.height),
        residual_sd_s=model.fit.sigma,
        worst_s=float(stints["residual_s"].abs().max() or 0.0),  # type: ignore[arg-type]
        names=names,
        shared=shared,
        shared_cov=cov,
        laps_by_letter=dict(sorted(laps.group_by("compound").len().iter_rows())),
        oldest=dict(sorted(laps.group_by("compound").agg(pl.col("age_laps").max()).iter_rows())),
    )


def _about_laps(unknown: int, c_numbers: dict[str, str]) -> tuple[str, ...]:
    """What the lap file lacks."""
    return (
        *((f"{unknown} laps on unknown tyres left out",) if unknown else ()),
        *(("C-numbers unknown, the usual ones assumed",) if not c_numbers else ()),
    )


def _warnings(pace: PaceAnalysis, start: StartAnalysis | None, pit: PitAnalysis) -> tuple[str, ...]:
    """Warnings for the diagnostics."""
    found = []
    if start is None:
        found.append("no green, timed first lap")
    if not pit.cost_s:
        found.append("too few green stops")
    if pace.residual_sd_s > 0.7:
        found.append("large residuals")
    thin = [c for c, n in pace.laps_by_letter.items() if n < 30]
    if thin:
        found.append(f"few laps on {'/'.join(thin)}")
    return tuple(found)
