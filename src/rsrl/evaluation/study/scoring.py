"""Strategists on the same races of several Grands Prix: the paper's Table 3, paired differences, criteria, share of the gap closed."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

from rsrl.evaluation.study.criteria import Reference, judge, window_text
from rsrl.evaluation.study.estimates import Difference, Run, Values, comparable_mean, difference, gap_closed, over_tracks
from rsrl.season import UNSEEN_TRACKS, load_race, track_of
from rsrl.simulator import Plan

BOUNDS: Final = ("hindsight",)
"""Strategists that know what is to come: shown, but neither a baseline nor ever the best."""

WORST, BEST_POSSIBLE = "fixed", "hindsight"
"""Ends of the gap of which a share is closed."""

CODES: Final = {
    "japan": "JPN", "bahrain": "BHR", "azerbaijan": "AZE", "great-britain": "GBR", "hungary": "HUN", "italy": "ITA",
    "singapore": "SGP", "qatar": "QAT", "abu-dhabi": "ABU", "spain": "SPN", "saudi-arabia": "SAU", "austria": "AUT",
    "mexico": "MEX", "united-states": "USA",
}  # fmt: skip
"""The tracks as the paper's Table 3 heads them."""

Json = dict[str, Any]
Runs = Mapping[tuple[str, str], Run]
"""Finished runs by names of strategist and race."""


@dataclass(frozen=True)
class Entrant:
    """One strategist of a study.

    Attributes:
        name: what it is called in tables.
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


def score(entrants: Sequence[Entrant], races: Sequence[str], drivers: Mapping[str, str], runs: Runs) -> Json:
    """All that is told of the runs of some races; docs/studies.md has the fields. Strategists that did not run are passed over."""
    table = [row for race in races for row in _race_rows(entrants, race, runs)]
    best = {race: _best(table, race, [e.name for e in entrants if e.is_baseline]) for race in races}
    reference = reference_model(entrants)
    return {
        "races": [_about(race, drivers[race]) for race in races],
        "table": table,
        "averages": _averages(entrants, races, runs),
        "differences": _differences(entrants, races, runs, reference),
        "best_baselines": [_against_best(entrants, race, best[race], runs) for race in races if best[race]],
        "criteria": [row for race in races for row in _criteria(entrants, race, table, runs)],
        "strategies": [row for race in races for e in entrants if (e.name, race) in runs for row in _strategies(e.name, race, runs)],
        "gap_closed": _gaps(entrants, races, runs),
    }


def _about(race: str, driver: str) -> Json:
    record, track = load_race(race), track_of(race)
    return {
        "race": race, "track": track, "code": CODES.get(track, track), "event": record.event, "season": record.season,
        "laps": record.laps, "driver": driver, "unseen": track in UNSEEN_TRACKS,
    }  # fmt: skip


def _race_rows(entrants: Sequence[Entrant], race: str, runs: Runs) -> list[Json]:
    here = [e for e in entrants if (e.name, race) in runs]
    if not here:
        return []
    longest = _longest(entrants, race, runs)
    rows = []
    for entrant in here:
        run = runs[entrant.name, race]
        mean, interval = comparable_mean(run.position, longest)
        rows.append(
            {
                "strategist": entrant.name, "race": race, "races": run.races, "mean_position": mean, "ci95": interval,
                "own_mean_position": float(run.position.mean()), "mean_points": float(run.points.mean()),
                "mean_stops": float(run.stops.mean()), "invalid_share": float(run.invalid.mean()),
                "retired_share": float(run.retired.mean()), "decision_ms": run.decision_ms, "trained": entrant.trained(race),
            }
        )  # fmt: skip
    best = _best(rows, race, [e.name for e in here if e.name not in BOUNDS])
    return [row | {"best": row["strategist"] == best} for row in rows]


def _longest(entrants: Sequence[Entrant], race: str, runs: Runs) -> Values:
    """Positions of whoever called most races, the reference model where it is among them."""
    here = sorted((e.name for e in entrants if (e.name, race) in runs), key=lambda name: name != reference_model(entrants))
    return max((runs[name, race].position for name in here), key=len)


def _best(table: Sequence[Json], race: str, among: Sequence[str]) -> str | None:
    rows = [row for row in table if row["race"] == race and row["strategist"] in among]
    return str(min(rows, key=lambda row: row["mean_position"])["strategist"]) if rows else None


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


def _averages(entrants: Sequence[Entrant], races: Sequence[str], runs: Runs) -> list[Json]:
    rows = []
    for entrant in entrants:
        for over, group in _groups(entrant, races, runs).items():
            own = over_tracks([runs[entrant.name, race].position for race in group])
            mean, interval = comparable_mean(own, over_tracks([_longest(entrants, race, runs) for race in group]))
            rows.append({"strategist": entrant.name, "over": over, "tracks": len(group), "mean_position": mean, "ci95": interval})
    return rows


def _differences(entrants: Sequence[Entrant], races: Sequence[str], runs: Runs, reference: str | None) -> list[Json]:
    """Of each entrant to the reference model, by race and averaged; above zero the model finishes ahead."""
    both = {key: run for key, run in runs.items() if (reference, key[1]) in runs}
    rows: list[Json] = []
    for entrant in entrants:
        if reference is None or entrant.name == reference:
            continue
        groups = _groups(entrant, races, both)
        for name, group in [*((race, [race]) for race in groups.get("all", [])), *groups.items()]:
            own, other = ([runs[who, race].position for race in group] for who in (entrant.name, reference))
            told = {"strategist": entrant.name, "against": reference, "race": name, "tracks": len(group)}
            rows.append(told | _told(difference(own, other)))
    return rows


def _told(d: Difference) -> Json:
    return {"difference": d.mean, "ci95": d.ci95, "p_ahead": d.p_ahead, "p_ci95": d.p_ci95, "races": d.races}


def _against_best(entrants: Sequence[Entrant], race: str, best: str | None, runs: Runs) -> Json:
    models = [e.name for e in entrants if e.is_model and (e.name, race) in runs]
    own = runs[str(best), race].position
    return {
        "race": race,
        "baseline": best,
        "models": [{"strategist": name} | _told(difference([own], [runs[name, race].position])) for name in models],
    }


def _criteria(entrants: Sequence[Entrant], race: str, table: Sequence[Json], runs: Runs) -> list[Json]:
    """The verdict on each entrant, against `fixed` and the best baseline other than itself."""
    rows = []
    for entrant in entrants:
        if (entrant.name, race) not in runs:
            continue
        best = _best(table, race, [e.name for e in entrants if e.is_baseline and e.name != entrant.name])
        names = [name for name in dict.fromkeys((WORST, best)) if name and name != entrant.name and (name, race) in runs]
        verdict = judge(runs[entrant.name, race], [_reference(name, runs[name, race]) for name in names])
        if verdict:
            rows.append({"strategist": entrant.name, "race": race} | verdict)
    return rows


def _reference(name: str, run: Run) -> Reference:
    return Reference(name, tuple(Plan.parse(c["plan"]) for c in run.common), run.position)


def _strategies(name: str, race: str, runs: Runs) -> list[Json]:
    return [
        {"strategist": name, "race": race, "text": window_text(common["plan"], common["windows"])} | dict(common)
        for common in runs[name, race].common
    ]


def _gaps(entrants: Sequence[Entrant], races: Sequence[str], runs: Runs) -> list[Json]:
    """Share of the gap from `fixed` to `hindsight` that each closes, by race and over all of them."""
    both = [race for race in races if (WORST, race) in runs and (BEST_POSSIBLE, race) in runs]
    rows = []
    for entrant in entrants:
        ran = [race for race in both if (entrant.name, race) in runs]
        for name, group in [*((race, [race]) for race in ran), *([("all", ran)] if ran else [])]:
            ends = [over_tracks([runs[who, race].position for race in group]) for who in (entrant.name, WORST, BEST_POSSIBLE)]
            share, interval = gap_closed(*ends)
            rows.append({"strategist": entrant.name, "race": name, "tracks": len(group), "share": share, "ci95": interval})
    return rows
