"""The audit of a season: every race of its lap file that can be called, each kept as soon as it is done, and the means over them."""

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Final, NamedTuple

import numpy as np
import polars as pl

from rsrl.audit.car import Settings, mean_by_caller
from rsrl.audit.race import RecordedField, audit_race, recorded_field, still_holds
from rsrl.errors import RsrlError
from rsrl.explanation import AnyPolicy, ExplainedPolicy
from rsrl.laps import read_lap_csv
from rsrl.results import AuditedGroup, AuditLeftOut, AuditMean, CarAudit, RaceAudit, SeasonAudit, read_result, to_json
from rsrl.season import RaceRecord, codes_called, grand_prix_of, load_race, race_names, resolve_race
from rsrl.statistics import mean_interval

MADE_BY: Final = "rsrl audit"

Progress = Callable[[int, int], None]
"""Called with (races done in hundredths, races in all in hundredths)."""

CENT: Final = 100


class SeasonRaces(NamedTuple):
    """The races of a season that can be audited, and those that cannot."""

    fields: tuple[RecordedField, ...]
    left_out: tuple[AuditLeftOut, ...]


def season_races(
    laps: Path, season: int, races: Collection[str] | None, drivers: Collection[str] | None, files: Path | None
) -> SeasonRaces:
    """The races of a lap file, in order.

    Args:
        laps: the lap file of a season.
        races: those wanted, by any name of the season's races; None for all.
        drivers: those wanted, by code, number or surname; None for all.
        files: folder of season files to use instead of the shipped ones.

    Raises:
        RsrlError: the lap file cannot be read; it holds none of the races or drivers.
    """
    table = read_lap_csv(laps).filter(pl.col("season") == season)
    heads = table.select("round", "event").unique(maintain_order=True).sort("round")
    names = {f"{grand_prix_of(event)}-{season}": number for number, event in heads.iter_rows()}
    wanted = names if races is None else dict.fromkeys(_race(race, season, sorted(names)) for race in races)
    codes = None if drivers is None else _codes(drivers, sorted(table["driver"].unique()), season)
    fields, left_out = [], []
    for name in (n for n in names if n in wanted):
        record, reason = _record(name, files)
        if record is None:
            left_out.append(AuditLeftOut(name, reason))
        else:
            fields.append(recorded_field(name, table.filter(pl.col("round") == names[name]), record, codes))
    fields = [field for field in fields if field.drivers]
    if not fields:
        raise RsrlError(f"{laps}: holds no dry race with a season file" + (" and these drivers" if drivers is not None else ""))
    return SeasonRaces(tuple(fields), tuple(left_out))


def _race(text: str, season: int, known: Sequence[str]) -> str:
    """The race of the season that a text names."""
    return resolve_race(text if str(season) in text else f"{text} {season}", known)


def _codes(asked: Collection[str], started: Sequence[str], season: int) -> set[str]:
    """Codes of the drivers asked for; raises RsrlError for a name that is no driver's or several drivers'."""
    found = set()
    for name in asked:
        codes = codes_called(name, started, season)
        if len(codes) != 1:
            said = f"may be {' or '.join(codes)}" if codes else "drove no race"
            raise RsrlError(f"driver {name!r} {said} in {season}; who did: {', '.join(started)}")
        found.add(codes[0])
    return found


def _record(name: str, files: Path | None) -> tuple[RaceRecord | None, str]:
    """The season file of a race, or why it is left out."""
    if files is not None:
        path = files / f"{name}.toml"
        record = load_race(str(path)) if path.exists() else None
    else:
        record = load_race(name) if name in race_names() else None
    if record is None:
        return None, "no season file"
    return (None, "a wet race: there is no wet-weather model") if record.wet else (record, "")


def refuse_memory(policy: AnyPolicy) -> None:
    """Raise RsrlError for a policy with a memory: its calls on a lap depend on those before."""
    recurrent = policy.recurrent if isinstance(policy, ExplainedPolicy) else policy.agent.recurrent
    if recurrent:
        raise RsrlError(f"{policy.name}: has a memory of the laps before, and an audit asks for single laps; give a policy without one")


def audited_races(
    races: Sequence[RecordedField], policy: AnyPolicy, settings: Settings, kept: Path | None, progress: Progress | None = None
) -> Iterator[RaceAudit]:
    """Audit races one by one.

    Args:
        kept: folder in which each is kept once it is done, and taken from where it still holds; None keeps none.

    Raises:
        RsrlError: a race that cannot be followed, or a folder that cannot be written to.
    """
    for done, field in enumerate(races):
        path = kept / f"{field.name}.json" if kept is not None else None
        stored = _stored(path)
        if stored is None or not still_holds(stored, field, policy, settings):
            report = _within(progress, done, len(races)) if progress else None
            stored = audit_race(field, policy, settings, report)
            if path is not None:
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_text(to_json(stored), encoding="utf-8")
        yield stored


def _stored(path: Path | None) -> RaceAudit | None:
    if path is not None and path.exists():
        with suppress(RsrlError):  # of another version: it is made again
            return read_result(path, RaceAudit, MADE_BY)
    return None


def _within(progress: Progress, race: int, races: int) -> Callable[[int, int], None]:
    return lambda done, total: progress(CENT * race + CENT * done // max(total, 1), CENT * races)


def audit_season(
    season: int, found: SeasonRaces, policy: AnyPolicy, settings: Settings, kept: Path | None, progress: Progress | None = None
) -> SeasonAudit:
    """Audit the races of a season; the arguments are those of `audited_races`, and it raises RsrlError as that does."""
    refuse_memory(policy)
    races = tuple(audited_races(found.fields, policy, settings, kept, progress))
    callers = tuple(dict.fromkeys(name for race in races for car in race.cars for stop in car.stops for name in stop.within_two_laps))
    return SeasonAudit(
        season=season,
        model=policy.name,
        model_hash=policy.hash,
        rollouts=settings.rollouts,
        seed=settings.seed,
        callers=callers,
        overall=group(str(season), [race.cars for race in races], len(races)),
        more_often=more_often(races, policy.name, [name for name in callers if name != policy.name]),
        by_race=by_race(races),
        by_team=by_team(races),
        left_out=found.left_out,
        races=races,
    )


def group(name: str, units: Sequence[Sequence[CarAudit]], races: int) -> AuditedGroup:
    """Means over units of cars: over races, each the mean of its cars, or over cars, each a unit of its own."""
    cars = [car for unit in units for car in unit]
    return AuditedGroup(
        name=name,
        races=races,
        cars=sum(car.laps_called > 0 for car in cars),
        stops=sum(stop.first for car in cars for stop in car.stops),
        laps_called=sum(car.laps_called for car in cars),
        laps_agreed=sum(car.laps_agreed for car in cars),
        illegal=sum(car.illegal for car in cars),
        within_two_laps=over([unit_means(unit, _within_two) for unit in units]),
        same_compound=over([unit_means(unit, _compound) for unit in units]),
        against_policy=over([unit_means(unit, lambda car: [car.against_policy]) for unit in units]),
        regret=over([unit_means(unit, lambda car: [car.regret]) for unit in units]),
    )


def _within_two(car: CarAudit) -> list[dict[str, float]]:
    return [stop.within_two_laps for stop in car.stops if stop.first]


def _compound(car: CarAudit) -> list[dict[str, float]]:
    return [stop.same_compound for stop in car.stops if stop.first]


def unit_means(cars: Sequence[CarAudit], of: Callable[[CarAudit], list[dict[str, float]]]) -> dict[str, float]:
    """Mean by caller over cars."""
    return mean_by_caller([one for car in cars for one in of(car)])


def over(units: Sequence[Mapping[str, float]]) -> dict[str, AuditMean]:
    """Mean by caller over units, with the interval over them."""
    names = dict.fromkeys(name for unit in units for name in unit)
    found = {name: np.array([unit[name] for unit in units if name in unit]) for name in names}
    return {name: AuditMean(mean=float(v.mean()), ci95=mean_interval(v), of=len(v)) for name, v in found.items()}


def by_race(races: Sequence[RaceAudit]) -> tuple[AuditedGroup, ...]:
    """Each race, over its cars."""
    return tuple(group(race.race, [[car] for car in race.cars], 1) for race in races)


def by_team(races: Sequence[RaceAudit]) -> tuple[AuditedGroup, ...]:
    """Each team, over races, in the order of what its calls lost against the policy's."""
    teams = sorted({car.team for race in races for car in race.cars})
    groups = []
    for team in teams:
        units = [own for race in races if (own := [car for car in race.cars if car.team == team])]
        groups.append(group(team, units, len(units)))
    return tuple(sorted(groups, key=lambda one: _lost(one)))


def _lost(one: AuditedGroup) -> float:
    lost = one.against_policy.get("team")
    return 0.0 if lost is None or lost.mean is None else lost.mean


def more_often(races: Sequence[RaceAudit], policy: str, others: Sequence[str]) -> dict[str, AuditMean]:
    """By caller, the share of first stops that the policy matches within two laps less its own, race by race."""
    shares = [unit_means(race.cars, _within_two) for race in races]
    return over([{name: one[policy] - one[name] for name in others if name in one and policy in one} for one in shares])
