"""Form of drivers and teams before a race: features of the pace forecast and of the regression baseline.

A rolling figure is a mean of earlier races whose weight fades, shrunk towards the team's and the team's towards the field's. Pace has two
such figures, one that fades slowly and one that fades fast, so that the regression finds out how quickly cars change. Fading, shrinkage
and features were chosen on 2019-2023, each season forecast from the one or two before it; docs/realism.md has what each is worth.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final, NamedTuple

import numpy as np

from rsrl.calibration.race.design import Array
from rsrl.calibration.race_facts import RaceFacts


class Fading(NamedTuple):
    """How the weight of a past race fades."""

    half_life_races: float
    winter_races: float  # that a winter counts as


SLOW: Final = Fading(6.0, 6.0)
FAST: Final = Fading(3.0, 12.0)
RETIREMENT: Final = Fading(20.0, 6.0)
PRIOR_RACES: Final = 1.0
PRIOR_RETIREMENT_RACES: Final = 4.0
NEWCOMER_PACE: Final = 0.4  # per cent of a lap behind the median car: a new team
NEWCOMER_POSITION: Final = 12.0
NEWCOMER_RETIREMENT: Final = 0.12
MAX_QUALI: Final = 3.0  # per cent: larger gaps in qualifying mean a mistake or a fault
NO_TIME_EXTRA: Final = 0.2  # per cent behind the slowest, for a car without a qualifying lap
SKIPPED_RACES: Final = 4  # at the beginning: their own features rest on hardly any history
SUCCESSORS: Final = {
    "Racing Bulls": "RB", "RB": "AlphaTauri", "AlphaTauri": "Toro Rosso", "Audi": "Kick Sauber", "Kick Sauber": "Alfa Romeo",
    "Alfa Romeo": "Alfa Romeo Racing", "Alfa Romeo Racing": "Sauber", "Alpine": "Renault", "Aston Martin": "Racing Point",
    "Racing Point": "Force India",
}  # fmt: skip
"""Team to the name it had before: the same factory under another sponsor."""


class PastRace(NamedTuple):
    """Result and pace of a race that has been run."""

    season: int
    round: int
    wet: bool
    facts: RaceFacts
    pace: Mapping[str, float]  # race pace by driver against the field's median, per cent of a lap; cars with enough laps


FEATURES: Final = (
    "grid", "log_grid", "quali", "quali_rank", "team_pace", "driver_pace", "team_recent_pace", "driver_recent_pace",
    "team_finish", "driver_finish", "team_retirements", "driver_retirements",
)  # fmt: skip
"""Grid and rank in qualifying are both there: a car with a penalty is quicker than its place on the grid."""


class _Past(NamedTuple):
    races_ago: int
    winters_ago: int
    value: float


@dataclass
class _EarlierForm:
    """Earlier races of one driver or team by kind of figure."""

    pace: list[_Past] = field(default_factory=list)
    finish: list[_Past] = field(default_factory=list)
    out: list[_Past] = field(default_factory=list)

    def add(self, other: "_EarlierForm") -> None:
        self.pace += other.pace
        self.finish += other.finish
        self.out += other.out


def quali_gaps(facts: RaceFacts) -> dict[str, float]:
    """Qualifying lap of every starter against the median, sessions on one level, per cent; all zero where there is no qualifying table."""
    if not facts.level_quali_s:
        return dict.fromkeys(facts.grid, 0.0)
    median = float(np.median(list(facts.level_quali_s.values())))
    gaps = {driver: (time / median - 1) * 100 for driver, time in facts.level_quali_s.items()}
    slowest = max(gaps.values())
    return {driver: min(gaps.get(driver, slowest + NO_TIME_EXTRA), MAX_QUALI) for driver in facts.grid}


def quali_ranks(facts: RaceFacts) -> dict[str, int]:
    """Rank of every starter in qualifying, 1 is the quickest lap; the grid decides between equals and where there is no qualifying."""
    gaps = quali_gaps(facts)
    order = sorted(facts.grid, key=lambda driver: (gaps[driver], facts.grid[driver]))
    return {driver: i + 1 for i, driver in enumerate(order)}


class FormBook:
    """Races in the order they were run; the features of each come from those before it."""

    def __init__(self, races: Sequence[PastRace]) -> None:
        self.races = tuple(races)
        self._features: dict[int, dict[str, Array]] = {}

    def features(self, index: int) -> dict[str, Array]:
        """`FEATURES` of every starter of a race from the races before it, its grid, teams and qualifying alone."""
        if index not in self._features:
            race = self.races[index]
            self._features[index] = _features(self.races[:index], race.season, race.facts)
        return self._features[index]

    def training_races(self, index: int) -> Iterator[tuple[PastRace, dict[str, Array]]]:
        """The dry races before race `index`, each with its features; the first `SKIPPED_RACES` are left out."""
        for i, race in enumerate(self.races[:index]):
            if i >= SKIPPED_RACES and not race.wet:
                yield race, self.features(i)


def _features(past: Sequence[PastRace], season: int, coming: RaceFacts) -> dict[str, Array]:
    earlier = _collect(past, season)
    quali, rank = quali_gaps(coming), quali_ranks(coming)
    rows = {}
    for driver, place in coming.grid.items():
        team, own = _team(earlier, coming.teams[driver]), earlier.get(f"driver {driver}", _EarlierForm())
        team_pace, team_recent = (_rolling(team.pace, NEWCOMER_PACE, fading) for fading in (SLOW, FAST))
        team_finish = _rolling(team.finish, NEWCOMER_POSITION, SLOW)
        team_out = _rolling(team.out, NEWCOMER_RETIREMENT, RETIREMENT, PRIOR_RETIREMENT_RACES)
        values = {
            "grid": float(place),
            "log_grid": float(np.log(place)),
            "quali": quali[driver],
            "quali_rank": float(rank[driver]),
            "team_pace": team_pace,
            "driver_pace": _rolling(own.pace, team_pace, SLOW),
            "team_recent_pace": team_recent,
            "driver_recent_pace": _rolling(own.pace, team_recent, FAST),
            "team_finish": team_finish,
            "driver_finish": _rolling(own.finish, team_finish, SLOW),
            "team_retirements": team_out,
            "driver_retirements": _rolling(own.out, team_out, RETIREMENT, PRIOR_RETIREMENT_RACES),
        }
        rows[driver] = np.array([values[name] for name in FEATURES])
    return rows


def _collect(past: Sequence[PastRace], season: int) -> dict[str, _EarlierForm]:
    earlier: dict[str, _EarlierForm] = {}
    for i, race in enumerate(past):
        ago = (len(past) - 1 - i, season - race.season)
        for driver in race.facts.grid:
            for key in (f"driver {driver}", f"team {race.facts.teams[driver]}"):
                own = earlier.setdefault(key, _EarlierForm())
                retired = driver in race.facts.retired
                own.out.append(_Past(*ago, float(retired)))
                if not retired:
                    own.finish.append(_Past(*ago, float(race.facts.positions[driver])))
                if driver in race.pace and not race.wet:
                    own.pace.append(_Past(*ago, race.pace[driver]))
    return earlier


def _team(earlier: Mapping[str, _EarlierForm], name: str) -> _EarlierForm:
    """Earlier races of a team, under its former names too."""
    whole = _EarlierForm()
    while name:
        whole.add(earlier.get(f"team {name}", _EarlierForm()))
        name = SUCCESSORS.get(name, "")
    return whole


def _rolling(earlier: list[_Past], prior: float, fading: Fading, strength: float = PRIOR_RACES) -> float:
    weights = [0.5 ** ((e.races_ago + fading.winter_races * e.winters_ago) / fading.half_life_races) for e in earlier]
    total = sum(w * e.value for w, e in zip(weights, earlier, strict=True))
    return (total + strength * prior) / (sum(weights) + strength)
