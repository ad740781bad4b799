"""Calibration from lap files to race records: read the laps, analyse every race, pool, write the record of each."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Final, NamedTuple

from rsrl import __version__
from rsrl.calibration.choices import ChoiceFits, ChoiceModel, choices_in
from rsrl.calibration.earlier_passing import earlier_passing
from rsrl.calibration.history import read_history
from rsrl.calibration.pooling.lap_figures import lap_figures_of
from rsrl.calibration.pooling.season_model import SeasonModel, pool
from rsrl.calibration.race.analysis import RaceAnalysis
from rsrl.calibration.seasons import analyse_seasons
from rsrl.errors import RsrlError
from rsrl.laps import file_fingerprint, read_seasons, refuse_hardly_run, season_file
from rsrl.season import Provenance, RaceRecord

STEEP_WEAR: Final = 0.35  # s per lap: a figure beyond it is marked in the diagnostics
Report = Callable[[int, int], None]


class Diagnosis(NamedTuple):
    """Diagnostics of one race: laps used, fit, main figures, warnings."""

    race: str
    wet: bool
    laps_read: int
    laps_used: int
    laps_unknown: int  # on tyres that are not on record
    residual_sd_s: float | None
    worst_s: float | None  # largest mean residual of a car over a stint
    base_lap_s: float
    wear_s: tuple[float, float, float]  # S, M, H
    pit_loss_s: float
    sc_per_race: float  # after the first lap
    warnings: tuple[str, ...]


@dataclass(frozen=True)
class Calibration:
    """A pooled model, the analyses it rests on, and their provenance."""

    model: SeasonModel
    analyses: tuple[RaceAnalysis, ...]
    choices: ChoiceModel | None  # None: no race whose choices of tyres are known
    provenance: Provenance

    def names(self, seasons: tuple[int, ...] | None = None) -> list[str]:
        """Names of the races of some seasons, all by default, in order."""
        return [a.entry.name for a in self.analyses if seasons is None or a.entry.season in seasons]

    def find(self, name: str) -> RaceAnalysis:
        """The analysis of a race; raises RsrlError listing those of its season."""
        for analysis in self.analyses:
            if analysis.entry.name == name:
                return analysis
        year = name.rpartition("-")[2]
        known = ", ".join(n for n in self.names() if n.endswith(year)) or "none of that season"
        raise RsrlError(f"race {name!r} is not in the lap files; there are {known}")

    def record(self, name: str) -> RaceRecord:
        """The record of one of the races, with provenance; `rsrl.environment` adds the scaling of features."""
        return replace(self.model.record(self.find(name).entry), provenance=self.provenance)

    def records(self, seasons: tuple[int, ...] | None = None) -> Iterator[RaceRecord]:
        """The records of the races of some seasons, in order."""
        for name in self.names(seasons):
            yield self.record(name)

    def diagnosis(self, record: RaceRecord) -> Diagnosis:
        """Diagnostics of a race and its record."""
        analysis = self.find(record.name)
        wear = tuple(record.tyres[c].wear_s_per_lap.value for c in "SMH")
        odd = ("steep wear",) if max(wear) > STEEP_WEAR else ()
        return Diagnosis(
            race=record.name,
            wet=record.wet,
            laps_read=analysis.laps_read,
            laps_used=analysis.laps_used,
            laps_unknown=analysis.laps_unknown,
            residual_sd_s=analysis.pace.residual_sd_s if analysis.pace else None,
            worst_s=analysis.pace.worst_s if analysis.pace else None,
            base_lap_s=record.track.base_lap_s.value,
            wear_s=(wear[0], wear[1], wear[2]),
            pit_loss_s=record.pit.loss_green_s.value,
            sc_per_race=record.incidents.sc_per_lap.value * record.laps,
            warnings=(*analysis.warnings, *odd),
        )


def calibrate(
    laps_folder: Path, facts_folder: Path | None, seasons: tuple[int, ...], command: str, progress: Report | None = None, workers: int = 2
) -> Calibration:
    """Read the laps of seasons, analyse every race and pool the figures.

    Args:
        laps_folder: holds `laps_<season>.csv.gz`.
        facts_folder: holds results, nominations and earlier safety cars; None: grids come from lap 1, and only
            these seasons tell the rate of safety cars.
        seasons: whose laps are used.
        command: command that makes the records again, for provenance.
        progress: called with races analysed and races in all.
        workers: processes; the result does not depend on it.

    Raises:
        RsrlError: a broken file, named with row and remedy, or no dry race.
    """
    years = tuple(sorted(set(seasons)))
    table = read_seasons(laps_folder, years)
    refuse_hardly_run(table, laps_folder)
    analyses = tuple(analyse_seasons(table, facts_folder, progress, workers))
    history = read_history(facts_folder, (years[0], 1)) if facts_folder is not None else ()
    choices = choices_in(laps_folder, facts_folder, years[-1])
    # Without a dry race whose choices are known, tyres come from lap times alone, and the notes of their figures say so.
    chosen = ChoiceFits(choices, lap_figures_of(analyses)).everything() if any(r.teaches for r in choices) else None
    passing = earlier_passing(laps_folder, facts_folder, analyses)
    model = pool(analyses, history, choices=chosen, passing=passing)
    dry = [a for a in analyses if a.dry]
    provenance = Provenance(
        command=command,
        date=datetime.now(UTC).date().isoformat(),
        version=__version__,
        data=tuple(file_fingerprint(season_file(laps_folder, s)) for s in years),
        laps_used=sum(a.laps_used for a in dry),
        laps_read=table.height,
    )
    return Calibration(model, analyses, chosen, provenance)
