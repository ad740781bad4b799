"""Races and their choices as arrays for the likelihood."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rsrl.calibration.choices.frequency import log_frequencies
from rsrl.calibration.choices.observed import CarChoice, RaceChoices
from rsrl.calibration.choices.parameters import GRID_GROUPS, NEW_RULES, OLD_WEIGHT, STOP_BEYOND_S, Space, grid_group
from rsrl.calibration.choices.sequences import MAX_STINTS, SEQUENCES, STINTS
from rsrl.calibration.compounds import hardness
from rsrl.season import COMPOUNDS

Array = NDArray[np.float64]

NO_LIMIT_LAPS: Final = 1000.0
FORBIDDEN: Final = -30.0  # log-odds of a sequence with fewer stops than the rules ask
USUAL_PIT_LOSS_S: Final = 22.5
PAD_RACES, PAD_ROWS = 16, 256  # arrays are padded to multiples of these
STUCK_LAPS: Final = 3  # a first stint shorter than this ended for damage


class LapFigures(NamedTuple):
    """What lap times say of one race by compound: slope of a stint, s a lap, and level against the medium, s; NaN: nothing."""

    slope: Array
    slope_se: Array
    level: Array
    level_se: Array


@dataclass(frozen=True)
class Setting:
    """A race before it is run: what a plan is chosen for."""

    season: int
    round: int
    circuit: str
    laps: int
    c_numbers: Mapping[str, str]
    pit_loss_s: float
    max_laps_per_set: int = 0
    min_stops: int = 1


class RaceArrays(NamedTuple):
    """Settings of races: first axis is the race."""

    laps: Array
    stop_s: Array
    hardness: NDArray[np.int64]  # [races, 3]
    circuit: NDArray[np.int64]  # -1: never seen
    season: NDArray[np.int64]
    rules: NDArray[np.int64]  # 0 before NEW_RULES, else 1
    limit: Array
    allowed: Array  # log-odds of every sequence by rule, [races, sequences]
    log_frequency: Array  # [races, sequences]


class ChoiceArrays(NamedTuple):
    """What was chosen. All arrays are padded with rows of weight zero, so that a few more races need no other compiled code.

    Attributes:
        weight: of a race, [races].
        counts: cars of each grid group on each sequence, [races, groups, sequences].
        stops: race, sequence, grid group, stops, then the stop laps; one row per car that made its own choice.
        stops_weight: of each row.
        first: race, starting compound, grid group, lap, and 1 for a stop on a racing lap, 0 where the stint was cut short; the others.
        first_weight: of each row.
        laps: slope, se, known, level, se, known of every compound, [races, 3, 6].
    """

    weight: Array
    counts: Array
    stops: NDArray[np.int64]
    stops_weight: Array
    first: NDArray[np.int64]
    first_weight: Array
    laps: Array


def settings_before(
    season: int,
    round_number: int,
    circuit: str,
    laps: int,
    c_numbers: Mapping[str, str],
    max_laps_per_set: int,
    history: Sequence[RaceChoices],
    min_stops: int = 1,
) -> Setting:
    """The setting of a race; a stop costs the median of what stops cost at its circuit in `history`, or anywhere for a new one."""
    losses = [(r.key.circuit, r.pit_loss_s) for r in history if r.clean and r.pit_loss_s is not None]
    here = [loss for track, loss in losses if track == circuit] or [loss for _, loss in losses]
    pit_loss_s = float(np.median(here)) if here else USUAL_PIT_LOSS_S
    return Setting(season, round_number, circuit, laps, c_numbers, pit_loss_s, max_laps_per_set, min_stops)


def setting_before(race: RaceChoices, history: Sequence[RaceChoices]) -> Setting:
    """The setting of a race whose choices are known; see `settings_before`."""
    k = race.key
    return settings_before(k.season, k.round, k.circuit, k.laps, k.c_numbers, race.max_laps_per_set, history, race.min_stops)


def race_arrays(settings: Sequence[Setting], space: Space, history: Sequence[RaceChoices]) -> RaceArrays:
    """Settings as arrays; frequencies come from the seasons of `history` before each race's own."""
    return RaceArrays(
        laps=np.array([s.laps for s in settings], float),
        stop_s=np.array([s.pit_loss_s + STOP_BEYOND_S for s in settings]),
        hardness=np.array([[hardness(s.c_numbers[c], s.season) for c in COMPOUNDS] for s in settings]),
        circuit=np.array([space.circuit(s.circuit) for s in settings]),
        season=np.array([space.season(s.season) for s in settings]),
        rules=np.array([int(s.season >= NEW_RULES) for s in settings]),
        limit=np.array([float(s.max_laps_per_set or NO_LIMIT_LAPS) for s in settings]),
        allowed=np.array([np.where(s.min_stops < STINTS, 0.0, FORBIDDEN) for s in settings]),
        log_frequency=np.array([log_frequencies(s, history) for s in settings]),
    )


def rows_for(races: int) -> int:
    """Rows of arrays of so many races: the next multiple of `PAD_RACES`."""
    return races + -races % PAD_RACES


def padded_settings(settings: Sequence[Setting]) -> list[Setting]:
    """Settings with the last repeated up to a multiple of `PAD_RACES`; `choice_arrays` gives those no weight."""
    return [*settings, *[settings[-1]] * (rows_for(len(settings)) - len(settings))]


def choice_arrays(races: Sequence[RaceChoices], lap_figures: Mapping[tuple[int, int], LapFigures]) -> ChoiceArrays:
    """The choices of races as arrays."""
    size = rows_for(len(races))
    counts = np.zeros((size, len(GRID_GROUPS) + 1, len(SEQUENCES)))
    stops, first = [], []
    laps = np.zeros((size, len(COMPOUNDS), 6))
    laps[:, :, [1, 4]] = 1.0
    weight = np.zeros(size)
    weight[: len(races)] = [1.0 if r.key.season >= NEW_RULES else OLD_WEIGHT for r in races]
    for i, race in enumerate(races):
        for car in race.cars:
            group = grid_group(car.grid)
            if car.own:
                counts[i, group, car.sequence] += 1
                stops.append((i, car.sequence, group, len(car.stops), *car.stops, *(0,) * (MAX_STINTS - 1 - len(car.stops))))
            elif (row := _first_stint(car)) is not None:
                first.append((i, car.compounds[0], group, *row))
        _fill_laps(laps[i], lap_figures.get(race.key.season_round))
    stop_rows, stops_weight = _padded(stops, (0, 0, 0, 1, 20, 0, 0), weight)
    first_rows, first_weight = _padded(first, (0, 0, 0, 20, 1), weight)
    return ChoiceArrays(weight, counts, stop_rows, stops_weight, first_rows, first_weight, laps)


def _padded(rows: Sequence[tuple[int, ...]], filler: tuple[int, ...], weight: Array) -> tuple[NDArray[np.int64], Array]:
    """Rows with fillers up to a multiple of `PAD_ROWS`, and their weights: the race's, none for a filler."""
    missing = -len(rows) % PAD_ROWS or (0 if rows else PAD_ROWS)
    table = np.array([*rows, *[filler] * missing], np.int64)
    weights = weight[table[:, 0]]
    weights[len(rows) :] = 0.0
    return table, weights


def _first_stint(car: CarChoice) -> tuple[int, int] | None:
    """Length of a first stint, and 1 if it ended by choice, 0 if a safety car, a retirement or the flag ended it."""
    if not car.compounds or car.compounds[0] < 0:
        return None
    end = car.stops[0] if car.stops else car.last_lap
    return (end, int(bool(car.stops) and car.green[0])) if end >= STUCK_LAPS else None


def _fill_laps(rows: Array, figures: LapFigures | None) -> None:
    if figures is None:
        return
    for at, value, se in ((0, figures.slope, figures.slope_se), (3, figures.level, figures.level_se)):
        known = np.isfinite(value)
        rows[known, at], rows[known, at + 1], rows[known, at + 2] = value[known], se[known], 1.0
