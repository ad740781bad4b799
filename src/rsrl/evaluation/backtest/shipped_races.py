"""Real races beside their season files as shipped: a file may know the very race it is asked about."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

import polars as pl

from rsrl.calibration import RaceFacts, race_facts
from rsrl.calibration.choices import RaceChoices, race_choices
from rsrl.errors import RsrlError
from rsrl.laps import RACE, read_seasons
from rsrl.season import RaceHead, RaceRecord, load_race, race_heads


class ShippedRace(NamedTuple):
    """A race: its season file, its laps, its result and what its cars chose."""

    record: RaceRecord
    laps: pl.DataFrame
    facts: RaceFacts
    choices: RaceChoices

    @property
    def teaches(self) -> bool:
        """Whether the field ran the race it had planned: dry, and never stopped by a red flag."""
        return not self.record.wet and not self.choices.wet and not self.choices.red


def shipped_races(
    laps_folder: Path, facts_folder: Path | None, seasons: Sequence[int], only: Sequence[str] = (), folder: Path | None = None
) -> Iterator[ShippedRace]:
    """The races that have a season file, in order of season and round; lap files are read season by season.

    Args:
        laps_folder: `laps_2023.csv.gz` and so on.
        facts_folder: results and qualifying; None: from the laps.
        seasons: whose races.
        only: names of the races wanted, such as `monza-2023`; all of the seasons where empty.
        folder: of the season files; the shipped ones by default.

    Raises:
        RsrlError: a season has no season file, a race that is wanted is not among them, a file cannot be read.
    """
    heads = [h for h in race_heads(folder) if h.season in seasons]
    if lacking := sorted(set(seasons) - {h.season for h in heads}):
        raise RsrlError(f"no season file of {', '.join(map(str, lacking))}; make some with rsrl calibrate, or leave the season out")
    if unknown := sorted(set(only) - {h.name for h in heads}):
        raise RsrlError(f"no season file {unknown[0]} in {', '.join(map(str, seasons))}; rsrl races lists those there are")
    for season in sorted(set(seasons)):
        wanted = [h for h in heads if h.season == season and (not only or h.name in only)]
        if wanted:
            table = read_seasons(laps_folder, (season,))
            yield from (_race(head, table, facts_folder, folder) for head in wanted)


def _race(head: RaceHead, table: pl.DataFrame, facts_folder: Path | None, folder: Path | None) -> ShippedRace:
    laps = table.filter((pl.col(RACE[0]) == head.season) & (pl.col(RACE[1]) == head.round))
    if laps.is_empty():
        raise RsrlError(f"the lap file of {head.season} has no lap of round {head.round}, {head.name}; give the file it was fitted to")
    facts = race_facts(laps, facts_folder, head.season, head.round)
    return ShippedRace(load_race(head.name, folder), laps, facts, race_choices(laps, facts_folder))
