"""Strategists on the same races of several Grands Prix: the paper's Table 3, paired differences, criteria, share of the gap closed."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

from msgspec.structs import asdict

from rsrl.evaluation.gap import BEST, WORST, share_of_gap
from rsrl.evaluation.study.criteria import Reference, judge, window_text
from rsrl.evaluation.study.estimates import Run, Values, comparable_mean, difference, over_tracks
from rsrl.results import (
    Average,
    BestBaseline,
    Criteria,
    GapClosed,
    ModelDifference,
    Race,
    RaceRow,
    Scored,
    TrackDifference,
    TrackStrategy,
)
from rsrl.season import UNSEEN_TRACKS, load_race, track_of
from rsrl.simulator import Plan
from rsrl.statistics import Interval

BOUNDS: Final = ("hindsight",)
"""Strategists that know the future of a race: shown, but neither baselines nor ever the best."""

CODES: Final = {
    "japan": "JPN", "bahrain": "BHR", "azerbaijan": "AZE", "great-britain": "GBR", "hungary": "HUN", "italy": "ITA",
    "singapore": "SGP", "qatar": "QAT", "abu-dhabi": "ABU", "spain": "SPN", "saudi-arabia": "SAU", "austria": "AUT",
    "mexico": "MEX", "united-states": "USA",
}  # fmt: skip
"""The tracks as the paper's Table 3 heads them."""

Runs = Mapping[tuple[str, str], Run]
"""Finished runs by names of strategist and race."""


@dataclass(frozen=True)
class Entrant:
    """One strategist of a study.

    Attributes:
        name: in tables.
        strategist: what its cells run, see `Cell.strategist`.
        is_model: a trained model.
        trained_on: names of the races it trained on.
        races: races it calls at each track.
    """

    name: str
    strategist: str
    is_model: bool
    trained_on: tuple[str, ...]
    races: int

    @property
    def is_baseline(self) -> bool:
        """Neither a model nor a bound."""
        return not self.is_model and self.name not in BOUNDS

    def trained(self, race: str) -> bool:
        """Whether it trained at the track of a race, in whatever season."""
        return track_of(race) in {track_of(name) for name in self.trained_on}


def reference_model(entrants: Sequence[Entrant]) -> str | None:
    """The model others are compared with: `all` where it is there, else the last."""
    models = [e.name for e in entrants if e.is_model]
    return "all" if "all" in models else models[-1] if models else None


def score(entrants: Sequence[Entrant], races: Sequence[str], drivers: Mapping[str, str], runs: Runs) -> Scored:
    """Scores of the runs of some races. Strategists that did not run are left out."""
    table = tuple(row for race in races for row in _race_rows(entrants, race, runs))
    best = {race: _best(table, race, [e.name for e in entrants if e.is_baseline]) for race in races}
    here = [(e, race) for race in races for e in entrants if (e.name, race) in runs]
    return Scored(
        races=tuple(_about(race, drivers[race]) for race in races),
        table=table,
        averages=tuple(_averages(entrants, races, runs)),
        differences=tuple(_differences(entrants, races, runs, reference_model(entrants))),
        best_baselines=tuple(_against_best(entrants, race, name, runs) for race, name in best.items() if name),
        criteria=tuple(_criteria(entrants, races, table, runs)),
        strategies=tuple(row for e, race in here for row in _strategies(e.name, race, runs)),
        gap_closed=tuple(_gaps(entrants, races, runs)),
    )


def _about(race: str, driver: str) -> Race:
    record, track = load_race(race), track_of(race)
    code, unseen = CODES.get(track, track), track in UNSEEN_TRACKS
    return Race(race, track, code, record.event, record.season, record.laps, driver, unseen)


def _race_rows(entrants: Sequence[Entrant], race: str, runs: Runs) -> list[RaceRow]:
    here = [e for e in entrants if (e.name, race) in runs]
    if not here:
        return []
    longest = _longest(entrants, race, runs)
    means = {e.name: comparable_mean(runs[e.name, race].position, longest) for e in here}
    best = min((e.name for e in here if e.name not in BOUNDS), key=lambda name: means[name][0], default=None)
    return [_race_row(e, race, runs[e.name, race], means[e.name], e.name == best) for e in here]


def _race_row(entrant: Entrant, race: str, run: Run, mean: tuple[float, Interval], best: bool) -> RaceRow:
    return RaceRow(
        strategist=entrant.name,
        race=race,
        races=run.races,
        mean_position=mean[0],
        ci95=mean[1],
        own_mean_position=float(run.position.mean()),
        mean_points=float(run.points.mean()),
        mean_stops=float(run.stops.mean()),
        invalid_share=float(run.invalid.mean()),
        retired_share=float(run.retired.mean()),
        decision_ms=run.decision_ms,
        trained=entrant.trained(race),
        best=best,
    )


def _longest(entrants: Sequence[Entrant], race: str, runs: Runs) -> Values:
    """Positions of the strategist that called most races; of several the reference model, where it is among them."""
    here = sorted((e.name for e in entrants if (e.name, race) in runs), key=lambda name: name != reference_model(entrants))
    return max((runs[name, race].position for name in here), key=len)


def _best(table: Sequence[RaceRow], race: str, among: Sequence[str]) -> str | None:
    rows = [row for row in table if row.race == race and row.strategist in among]
    return min(rows, key=lambda row: row.mean_position).strategist if rows else None


def _groups(entrant: Entrant, races: Sequence[str], runs: Runs) -> dict[str, list[str]]:
    """Races an entrant ran, by what an average may be over; groups without a race are left out."""
    ran = [race for race in races if (entrant.name, race) in runs]
    groups = {
        "all": ran,
        "seen": [race for race in ran if track_of(race) not in UNSEEN_TRACKS],
        "unseen": [race for race in ran if track_of(race) in UNSEEN_TRACKS],
    }
    if entrant.is_model:
        groups["trained"] = [race for race in ran if entrant.trained(race)]
        groups["untrained"] = [race for race in ran if not entrant.trained(race)]
    return {name: group for name, group in groups.items() if group}


def _averages(entrants: Sequence[Entrant], races: Sequence[str], runs: Runs) -> list[Average]:
    rows = []
    for entrant in entrants:
        for over, group in _groups(entrant, races, runs).items():
            own = over_tracks([runs[entrant.name, race].position for race in group])
            mean, interval = comparable_mean(own, over_tracks([_longest(entrants, race, runs) for race in group]))
            rows.append(Average(entrant.name, over, len(group), mean, interval))
    return rows


def _differences(entrants: Sequence[Entrant], races: Sequence[str], runs: Runs, reference: str | None) -> list[TrackDifference]:
    """Of each entrant to the reference model, by race and averaged; above zero the model has the better mean."""
    both = {key: run for key, run in runs.items() if (reference, key[1]) in runs}
    rows: list[TrackDifference] = []
    for entrant in entrants:
        if reference is None or entrant.name == reference:
            continue
        groups = _groups(entrant, races, both)
        for name, group in [*((race, [race]) for race in groups.get("all", [])), *groups.items()]:
            own, other = ([runs[who, race].position for race in group] for who in (entrant.name, reference))
            places = asdict(difference(own, other))
            rows.append(TrackDifference(**places, strategist=entrant.name, against=reference, race=name, tracks=len(group)))
    return rows


def _against_best(entrants: Sequence[Entrant], race: str, best: str, runs: Runs) -> BestBaseline:
    models = [e.name for e in entrants if e.is_model and (e.name, race) in runs]
    places = {name: difference([runs[best, race].position], [runs[name, race].position]) for name in models}
    return BestBaseline(race, best, tuple(ModelDifference(**asdict(d), strategist=name) for name, d in places.items()))


def _criteria(entrants: Sequence[Entrant], races: Sequence[str], table: Sequence[RaceRow], runs: Runs) -> Iterator[Criteria]:
    """The verdict on each entrant at each race, against `fixed` and the best baseline other than itself."""
    for race in races:
        for name in [e.name for e in entrants if (e.name, race) in runs]:
            best = _best(table, race, [e.name for e in entrants if e.is_baseline and e.name != name])
            others = [other for other in dict.fromkeys((WORST, best)) if other and other != name and (other, race) in runs]
            verdict = judge(runs[name, race], [_reference(other, runs[other, race]) for other in others])
            if verdict:
                yield Criteria(**asdict(verdict), strategist=name, race=race)


def _reference(name: str, run: Run) -> Reference:
    return Reference(name, tuple(Plan.parse(common.plan) for common in run.common), run.position)


def _strategies(name: str, race: str, runs: Runs) -> list[TrackStrategy]:
    return [
        TrackStrategy(**asdict(common), strategist=name, race=race, text=window_text(common.plan, common.windows))
        for common in runs[name, race].common
    ]


def _gaps(entrants: Sequence[Entrant], races: Sequence[str], runs: Runs) -> list[GapClosed]:
    """Share of the gap from `fixed` to `hindsight` that each closes, by race and over all of them."""
    both = [race for race in races if (WORST, race) in runs and (BEST, race) in runs]
    rows = []
    for entrant in entrants:
        ran = [race for race in both if (entrant.name, race) in runs]
        for name, group in [*((race, [race]) for race in ran), *([("all", ran)] if ran else [])]:
            ends = [over_tracks([runs[who, race].position for race in group]) for who in (entrant.name, WORST, BEST)]
            closed = share_of_gap(*ends)
            rows.append(GapClosed(entrant.name, name, len(group), closed.value, closed.ci95))
    return rows
