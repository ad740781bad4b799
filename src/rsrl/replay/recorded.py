"""`rsrl replay`: a recorded race from its file to the result."""

from pathlib import Path
from typing import NamedTuple

from rsrl.errors import RsrlError
from rsrl.explanation import load_any_policy
from rsrl.feeds.lap_files import lap_events, read_lap_file
from rsrl.replay.audit import Progress, audit
from rsrl.replay.caller import StateCaller
from rsrl.replay.follow import follow
from rsrl.replay.laps import replay_laps
from rsrl.replay.what_if import AskedCall, what_if
from rsrl.results import ReplayResult
from rsrl.season import RaceRecord, codes_called, find_car, load_race, race_names


class RecordedRace(NamedTuple):
    """What is to be replayed.

    Attributes:
        source: the file.
        race: its name; None where the file holds one race only.
        driver: whose car is called; None for the race's default driver.
        model: a policy, as of `load_any_policy`.
        audit_races: futures of each lap on which call and team differ; 0 for no audit.
        what_if: another call, rolled out in `what_if_races` futures.
    """

    source: Path
    race: str | None
    driver: str | None
    model: str
    audit_races: int = 0
    seed: int = 0
    what_if: AskedCall | None = None
    what_if_races: int = 2


def replay_recorded(wanted: RecordedRace, progress: Progress | None = None) -> ReplayResult:
    """Replay a recorded race for one car.

    Raises:
        RsrlError: the file is no lap file, or there is no such race, driver or model.
    """
    name, table = read_lap_file(wanted.source, wanted.race)
    events = lap_events(table)
    started = sorted(table["driver"].unique())
    season = int(table["season"][0])
    record, note = _record(name)
    named = wanted.driver or (wanted.what_if.driver if wanted.what_if else None)
    driver = _driver(named, started, season, record, name)
    caller = policy = None
    if record is not None:
        policy = load_any_policy(wanted.model)
        caller = StateCaller(policy, record, find_car(record, driver))
    followed = follow(events, record, {driver: caller})
    rows = replay_laps(followed)
    car = next(c for c in followed.tracker.cars.values() if c.driver == driver)
    audited = None
    if caller is not None and wanted.audit_races:
        audited = audit(followed.cars[0], rows, caller, wanted.audit_races, wanted.seed, progress)
    asked = None
    if wanted.what_if is not None:
        if caller is None:
            raise RsrlError(f"what-if: {note}")
        asked = what_if(followed.cars[0], rows, car, caller, wanted.what_if, wanted.what_if_races, wanted.seed)
    return ReplayResult(
        source=str(wanted.source),
        race=name,
        event=str(table["event"][0]),
        season=season,
        driver=driver,
        model=policy.name if policy else None,
        model_hash=policy.hash if policy else None,
        note=note,
        total_laps=followed.tracker.total_laps,
        finished=not car.out and not car.disqualified,
        laps=rows,
        audit=audited,
        what_if=asked,
    )


def _record(name: str) -> tuple[RaceRecord | None, str | None]:
    """The season file of a race, or why the race is tracked without calls."""
    if name not in race_names():
        return None, f"no season file of {name}: the race is tracked without calls (see `rsrl races`, `rsrl calibrate`)"
    record = load_race(name)
    if record.wet:
        return None, f"{name} was a wet race and there is no wet-weather model: it is tracked without calls"
    return record, None


def _driver(asked: str | None, started: list[str], season: int, record: RaceRecord | None, name: str) -> str:
    """Code of the driver asked for."""
    if record is not None and (asked is None or asked.upper() not in started):
        return record.cars[find_car(record, asked)].driver
    if asked is None:
        raise RsrlError(f"{name} has no season file, which would name a default driver; name one with --driver: {', '.join(started)}")
    codes = codes_called(asked, started, season)
    if len(codes) != 1:
        found = f"may be {' or '.join(codes)}" if codes else "did not start"
        raise RsrlError(f"driver {asked!r} {found} at {name}; who did: {', '.join(started)}")
    return codes[0]
