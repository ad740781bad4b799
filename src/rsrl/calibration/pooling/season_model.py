"""Stages two and three of calibration: figures pooled over races, and the record of any race from them."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from datetime import UTC, datetime
from functools import cached_property
from typing import Any, Final

import polars as pl
from threadpoolctl import threadpool_limits

from rsrl import __version__
from rsrl.calibration.bounded import believable
from rsrl.calibration.choices import ChoiceModel
from rsrl.calibration.entry import RaceEntry
from rsrl.calibration.history import EarlierRace
from rsrl.calibration.literature import DRS_WINDOW, FUEL_START, PASS_LOSS
from rsrl.calibration.pooling.car import CarPool, centred, pool_cars
from rsrl.calibration.pooling.incident import IncidentPool, pool_incidents
from rsrl.calibration.pooling.joint_tyres import JointTyres
from rsrl.calibration.pooling.pit import PitPool, pool_pit
from rsrl.calibration.pooling.scalars import PooledScalar, Spread, pool_scalar
from rsrl.calibration.pooling.traffic import EarlierPassing, TrafficPool, pool_traffic
from rsrl.calibration.pooling.tyre import TyrePool, pool_tyres
from rsrl.calibration.race.analysis import RaceAnalysis
from rsrl.calibration.rivals.model import RivalModel, fit_rival_model, rival_figures
from rsrl.calibration.rules import FOLLOWING_GAIN, drs_off_laps, following_aid
from rsrl.errors import RsrlError
from rsrl.season import COMPOUNDS, CarFigures, Figure, Provenance, RaceRecord, TrackFigures, TyreFigures

DEFAULT_DRIVER: Final = "HAM"
NO_CURVATURE: Final = Figure(0.0, 0.0, 0, "linear wear: a race hardly shows its curvature")
LAUNCH: Final = {"S": Spread(-0.3, 0.3, 0.1, 0.1, 0.1), "H": Spread(0.3, 0.3, 0.1, 0.1, 0.1)}
"""Lap 1 of soft and hard against medium, s; seasons 2019-2023 show about -0.7 and +0.5 with the compounds' own pace in it."""

NO_TEAM_LOSS: Final = Figure(0.0, 0.1, 0, "in stop_tail_factor")


@dataclass(frozen=True)
class SeasonModel:
    """Figures pooled over races, and the record of any race from them: the less the races given resemble it, the wider its errors."""

    analyses: tuple[RaceAnalysis, ...]
    tyres: TyrePool | JointTyres
    traffic: TrafficPool
    pit: PitPool
    incidents: IncidentPool
    cars: CarPool
    noise: PooledScalar
    stint: PooledScalar
    start_loss: PooledScalar
    start_place: PooledScalar
    start_sd: PooledScalar
    launch: dict[str, PooledScalar]  # soft and hard against medium
    given_rivals: RivalModel | None = None

    @cached_property
    def rivals(self) -> RivalModel:
        """The model of teams' decisions: the one given, else one fitted to these races when first needed."""
        return self.given_rivals or fit_rival_model([a.decisions for a in self.analyses])

    def record(self, entry: RaceEntry, pace: Mapping[str, Figure] | None = None, base_lap_s: Figure | None = None) -> RaceRecord:
        """The record of a race.

        Args:
            entry: the race, analysed or not.
            pace: pace of every starter, forecast; it is centred on their mean. None: what the analysed races say, this race
                itself among them where it was analysed.
            base_lap_s: forecast of the base lap; None: what the analysed races say.

        Raises:
            RsrlError: `pace` lacks a starter.
        """
        base = believable(self.tyres.base_lap(entry), "base_lap_s") if base_lap_s is None else base_lap_s
        missing = [d for d, _, _ in entry.starters if pace is not None and d not in pace]
        if missing:
            raise RsrlError(f"{entry.name}: no pace given for {', '.join(missing)}; give one for every starter")
        paces = self.cars.pace(entry, base.value) if pace is None else centred(pace, entry)
        return RaceRecord(
            name=entry.name,
            season=entry.season,
            round=entry.round,
            event=entry.event,
            grand_prix=entry.grand_prix,
            laps=entry.laps,
            wet=entry.wet,
            default_driver=_default_driver(entry),
            max_laps_per_set=entry.max_laps_per_set,
            min_sets=entry.min_sets,
            following_aid=following_aid(entry.season),
            drs_off_laps=drs_off_laps(entry.season),
            track=self._track(entry, base),
            tyres={c: self._tyre(entry, c) for c in COMPOUNDS},
            pit=self.pit.figures(entry),
            incidents=self.incidents.figures(entry.circuit),
            cars=tuple(self._car(entry, i, paces, base.value) for i in range(len(entry.starters))),
            rivals=rival_figures(self.rivals, entry),
            published=entry.published,
            provenance=Provenance("", datetime.now(UTC).date().isoformat(), __version__, (), *self._laps()),
        )

    def _laps(self) -> tuple[int, int]:
        dry = [a for a in self.analyses if a.dry]
        return sum(a.laps_used for a in dry), sum(a.laps_read for a in dry)

    def _track(self, entry: RaceEntry, base: Figure) -> TrackFigures:
        return TrackFigures(
            base_lap_s=base,
            fuel_s_per_kg=self.tyres.fuel(entry),
            fuel_start_kg=FUEL_START,
            lap_noise_sd_s=believable(self.noise.at(entry), "lap_noise_sd_s", 0.05),
            stint_sd_s=believable(self.stint.at(entry), "stint_sd_s"),
            evolution_s=believable(self.tyres.evolution(entry), "evolution_s"),
            start_loss_s=believable(self.start_loss.at(entry), "start_loss_s"),
            start_per_place_s=believable(self.start_place.at(entry), "start_per_place_s"),
            start_sd_s=believable(self.start_sd.at(entry), "start_sd_s", 0.2),
            drs_gain_s=FOLLOWING_GAIN[following_aid(entry.season)],
            drs_window_s=DRS_WINDOW,
            dirty_air_loss_s=believable(self.traffic.air.at(entry), "dirty_air_loss_s"),
            dirty_air_window_s=self.traffic.window,
            following_gap_s=believable(self.traffic.following.at(entry), "following_gap_s", 0.2),
            pass_threshold_s=believable(self.traffic.passing.as_raced(entry.circuit), "pass_threshold_s"),
            pass_scale_s=self.traffic.passing.scale,
            pass_per_gap=self.traffic.passing.per_gap,
            pass_loss_s=PASS_LOSS,
            passed_loss_s=believable(self.traffic.passed.at(entry), "passed_loss_s"),
            blue_flag_loss_s=believable(self.traffic.blue.at(entry), "blue_flag_loss_s"),
            lapping_loss_s=believable(self.traffic.lapping.at(entry), "lapping_loss_s"),
            launch_loss_s={c: believable(pooled.at(entry), f"launch_loss_s.{c}") for c, pooled in self.launch.items()},
        )

    def _tyre(self, entry: RaceEntry, letter: str) -> TyreFigures:
        return TyreFigures(
            c_number=entry.c_numbers[letter],
            offset_s=believable(self.tyres.offset(entry, letter), "offset_s"),
            wear_s_per_lap=believable(self.tyres.wear(entry, letter), "wear_s_per_lap"),
            curvature_s_per_lap2=NO_CURVATURE,
            cold_loss_s=self.pit.cold(entry, letter),
            sets=entry.sets[letter],
        )

    def _car(self, entry: RaceEntry, i: int, paces: Mapping[str, Figure], base_lap_s: float) -> CarFigures:
        driver, team, grid = entry.starters[i]
        later, first = self.incidents.retirement(team, entry.season, entry.circuit)
        return CarFigures(
            driver=driver,
            team=team,
            grid=grid,
            pace_s=believable(paces[driver], "pace_s"),
            form_sd_s=self.cars.form(entry.season, base_lap_s),
            noise_factor=self.cars.noise_factor(entry.season, driver),
            start_gain_s=believable(self.cars.start_gain(driver), "start_gain_s"),
            retire_per_lap=later,
            retire_lap1=first,
            stop_loss_s=NO_TEAM_LOSS,
            stop_tail_factor=self.pit.team_factor(team, entry.season),
            sets=entry.car_sets.get(driver),
            team_form_share=self.cars.form_share,
        )


def pool(
    analyses: Sequence[RaceAnalysis],
    history: Sequence[EarlierRace] = (),
    rivals: RivalModel | None = None,
    choices: ChoiceModel | None = None,
    passing: Sequence[EarlierPassing] = (),
) -> SeasonModel:
    """Pool any set of race analyses; nothing but these, `history` and `passing` enters.

    Args:
        analyses: of `analyse_race`; wet races add nothing.
        history: of `read_history`, safety cars of races without laps.
        choices: what teams chose, of `ChoiceFits`; None: tyres come from lap times alone.
        passing: of `earlier_passing`, for circuits without a dry race among the analyses.
        rivals: how teams call their race, of `fit_rival_model`; None: fitted on these analyses' calls when a record is first asked for.

    Raises:
        RsrlError: no dry race among them.
    """
    with threadpool_limits(1):
        tyres = pool_tyres(analyses)
        if tyres is None:
            raise RsrlError("no dry race to calibrate from in the lap files given; add a season with --seasons")
        starts = [(a.entry, a.start) for a in analyses if a.start is not None]
        paces = [(a.entry, a.pace) for a in analyses if a.pace is not None]
        return SeasonModel(
            analyses=tuple(analyses),
            tyres=JointTyres(tyres, choices) if choices else tyres,
            traffic=pool_traffic(analyses, passing),
            pit=pool_pit(analyses),
            incidents=pool_incidents(analyses, history),
            cars=pool_cars(analyses),
            noise=pool_scalar([(p, f.noise_s) for p, f in paces], Spread(0.25, 0.1, 0.05, 0.02, 0.05), 0.005),
            stint=pool_scalar([(p, f.stint_sd_s) for p, f in paces], Spread(0.2, 0.1, 0.04, 0.02, 0.05), 0.01),
            start_loss=pool_scalar([(p, s.loss_s) for p, s in starts], Spread(4.0, 2.0, 1.5, 0.3, 0.7), 0.2),
            start_place=pool_scalar([(p, s.per_place_s) for p, s in starts], Spread(0.3, 0.2, 0.1, 0.03, 0.05), 0.02),
            start_sd=pool_scalar([(p, s.sd_s) for p, s in starts], Spread(0.9, 0.5, 0.2, 0.1, 0.2), 0.1),
            launch={c: pool_scalar([(p, s.launch_s[c]) for p, s in starts if c in s.launch_s], LAUNCH[c], 0.05) for c in LAUNCH},
            given_rivals=rivals,
        )


def _default_driver(entry: RaceEntry) -> str:
    """Default driver of a race: `DEFAULT_DRIVER` if he starts, else a car within reach of the points."""
    drivers = [d for d, _, _ in entry.starters]
    return DEFAULT_DRIVER if DEFAULT_DRIVER in drivers else drivers[len(drivers) // 4]


def figure_table(record: RaceRecord) -> pl.DataFrame:
    """Every figure of a record: `name, value, se, n, note`."""
    schema = {"name": pl.String, "value": pl.Float64, "se": pl.Float64, "n": pl.Int64, "note": pl.String}
    return pl.DataFrame(list(_figures(record, "")), schema=schema, orient="row")


def _figures(item: Any, name: str) -> Iterator[tuple[str, float, float, int, str]]:
    if isinstance(item, Figure):
        yield name, item.value, item.se, item.n, item.note
    elif isinstance(item, dict):
        for key, value in item.items():
            yield from _figures(value, f"{name}.{key}")
    elif isinstance(item, CarFigures):
        for f in fields(item):
            yield from _figures(getattr(item, f.name), f"cars.{item.driver}.{f.name}")
    elif isinstance(item, tuple):
        for value in item:
            yield from _figures(value, name)
    elif hasattr(item, "__dataclass_fields__"):
        for f in fields(item):
            yield from _figures(getattr(item, f.name), f"{name}.{f.name}" if name else f.name)
