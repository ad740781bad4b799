"""What is known of a race before it starts: drivers, grid, distance, compounds."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

import polars as pl

from rsrl.calibration.race_facts import RaceFacts, published_strategies, race_facts, starters_only, table_rows
from rsrl.calibration.rules import announced, rules_of, softest
from rsrl.errors import RsrlError
from rsrl.laps import RACE, WET, stints
from rsrl.season import COMPOUNDS, FEWEST_SETS, MAX_CARS, TyreSets, circuit_of, grand_prix_of

USUAL_SETS: Final = {"S": 4, "M": 2, "H": 2}  # of 8, 3 and 2: what is left on Sunday
MIN_SETS: Final = {"S": 2, "M": 1, "H": 2}
MAX_SETS: Final = {"S": 8, "M": 3, "H": 2}  # the regulation's allotment for a weekend
SHORT_STINT_LAPS: Final = 5  # a shorter stint was often continued on the same set
USUAL_C_NUMBERS: Final = {"S": "C4", "M": "C3", "H": "C2"}
_STEP: Final = {"S": 1, "M": 0, "H": -1}


@dataclass(frozen=True)
class RaceKey:
    """A race by when and where it is run, how long it is and on which compounds."""

    season: int
    round: int
    grand_prix: str  # first part of its name, such as `bahrain`
    laps: int
    c_numbers: dict[str, str]  # S, M, H to C0..C6

    @property
    def circuit(self) -> str:
        """Where it is run: what it shares with other races there, whatever they are called."""
        return circuit_of(self.grand_prix, self.season)

    @property
    def label(self) -> str:
        """Season and round as text, such as `2023/1`."""
        return f"{self.season}/{self.round}"

    @property
    def season_round(self) -> tuple[int, int]:
        """Season and round."""
        return self.season, self.round


@dataclass(frozen=True)
class RaceEntry(RaceKey):
    """A race to be described or forecast."""

    event: str
    wet: bool  # any car ran intermediates or wets
    starters: tuple[tuple[str, str, int], ...]  # driver, team, grid, in grid order
    max_laps_per_set: int  # 0: no such rule
    sets: dict[str, int]  # by compound letter, for the race
    car_sets: Mapping[str, TyreSets] = field(default_factory=dict)  # of drivers who fitted more sets than that
    published: tuple[str, ...] = ()
    pole_s: float | None = None  # best qualifying lap
    min_sets: int = FEWEST_SETS  # sets that a car must use

    @property
    def name(self) -> str:
        """Such as `bahrain-2023`."""
        return f"{self.grand_prix}-{self.season}"


def entry_from(table: pl.DataFrame, facts_folder: Path | None, season: int, round_number: int, as_driven: bool = False) -> RaceEntry:
    """The entry of a race in the lap table.

    Args:
        table: laps, of which those of this race give event, teams, compounds and rain, and without facts distance and grid.
        facts_folder: holds results, nominations and published strategies; None: the grid is the order at the end of lap 1.
        season: of the race.
        round_number: in that season.
        as_driven: the race has been run: a car's sets are the most any car used, and at least those that it fitted itself. Otherwise the
            usual allocation.

    Raises:
        RsrlError: no such race in the table, or more cars than a field has.
    """
    race = table.filter((pl.col("season") == season) & (pl.col("round") == round_number))
    if race.is_empty():
        raise RsrlError(f"season {season} round {round_number} is not in the lap files; give the file of that season with --laps")
    facts = race_facts(race, facts_folder, season, round_number)
    race = starters_only(race, facts)
    published = published_strategies(facts_folder, season, round_number, facts.laps)
    return make_entry(race, facts, completed(nominated(race, facts_folder), season), published, as_driven)


def make_entry(race: pl.DataFrame, facts: RaceFacts, c_numbers: dict[str, str], published: tuple[str, ...], as_driven: bool) -> RaceEntry:
    """The entry of a race from its own laps and facts; see `entry_from`."""
    season, number, event = race.select(*RACE, "event").row(0)
    if len(facts.grid) > MAX_CARS:
        raise RsrlError(f"{event} {season}: {len(facts.grid)} cars, and a race has {MAX_CARS} at most; check its lap file for foreign rows")
    sets = sets_used(race) if as_driven else dict(USUAL_SETS)
    teams = dict(race.sort("lap").group_by("driver").agg(pl.col("team").drop_nulls().last()).iter_rows()) | facts.teams
    order = sorted(facts.grid, key=facts.grid.__getitem__)
    grand_prix = grand_prix_of(event)
    rules = rules_of(season, grand_prix)
    return RaceEntry(
        season=season,
        round=number,
        event=event,
        grand_prix=grand_prix,
        laps=facts.laps,
        wet=bool(race["compound"].is_in(list(WET)).any()),
        c_numbers=c_numbers,
        starters=tuple((d, teams[d], i + 1) for i, d in enumerate(order)),
        max_laps_per_set=rules.max_laps_per_set,
        min_sets=rules.min_sets,
        sets=sets,
        car_sets=sets_beyond(race, sets) if as_driven else {},
        published=published,
        pole_s=min(facts.quali_s.values(), default=None),
    )


def nominated(race: pl.DataFrame, facts_folder: Path | None) -> dict[str, str]:
    """C-number by colour as far as it is known: from the laps, of a compound nobody ran from the nominations; empty where neither tells."""
    raced = race.drop_nulls("compound_c").filter(pl.col("compound").is_in(list(COMPOUNDS)))
    found = dict(raced.group_by("compound").agg(pl.col("compound_c").mode().sort().first()).iter_rows())
    season, number, event = race.select(*RACE, "event").row(0)
    told = announced(season, grand_prix_of(event))
    if facts_folder is not None and (facts_folder / "compound_nominations.csv").is_file():
        for row in table_rows(facts_folder, "compound_nominations.csv"):
            if (row["season"], row["round"]) == (str(season), str(number)):
                told = {"S": row["soft"], "M": row["medium"], "H": row["hard"]}
    return told | found


def completed(c_numbers: dict[str, str], season: int) -> dict[str, str]:
    """C-numbers of all three colours: one not known is a step from its neighbour; where none is, the usual ones are assumed."""
    if not c_numbers:
        return dict(USUAL_C_NUMBERS)
    letter, c = next(iter(sorted(c_numbers.items())))
    middle = int(c[1]) - _STEP[letter]
    return {x: c_numbers.get(x, f"C{min(max(middle + _STEP[x], 0), softest(season))}") for x in COMPOUNDS}


def sets_used(race: pl.DataFrame) -> dict[str, int]:
    """Most sets of each compound any car used in the race, within `MIN_SETS` and `MAX_SETS`."""
    long = stints(race).filter(pl.col("laps") > SHORT_STINT_LAPS)
    counts = long.group_by("driver", "compound").len().group_by("compound").agg(pl.col("len").max())
    most = {c: int(n) for c, n in counts.iter_rows() if c is not None}
    return {c: min(max(MIN_SETS[c], most.get(c, 0)), MAX_SETS[c]) for c in COMPOUNDS}


def sets_beyond(race: pl.DataFrame, sets: Mapping[str, int]) -> dict[str, TyreSets]:
    """Sets of the drivers who fitted more of a compound in the race than `sets`.

    A set that was fitted a second time counts again. All count as new: wear is fitted to the laps since the stop, on used sets as on new
    ones, and the other cars' sets count as new as well.
    """
    fitted: dict[str, dict[str, int]] = {}
    for driver, compound in stints(race).select("driver", "compound").iter_rows():
        if compound in COMPOUNDS:
            fitted.setdefault(driver, dict.fromkeys(COMPOUNDS, 0))[compound] += 1
    return {
        driver: {c: (0,) * max(own[c], sets[c]) for c in COMPOUNDS}
        for driver, own in sorted(fitted.items())
        if any(own[c] > sets[c] for c in COMPOUNDS)
    }
