"""`rsrl replay`: a recorded race from its source to the result."""

from pathlib import Path
from typing import NamedTuple

from rsrl.errors import RsrlError
from rsrl.explanation import load_any_policy
from rsrl.feeds.anomalies import Anomalies
from rsrl.feeds.event_log import log_head
from rsrl.feeds.pacing import paced, with_silences
from rsrl.feeds.recordings import open_source
from rsrl.replay.audit import Progress, audit
from rsrl.replay.binding import Asked, season_asked
from rsrl.replay.follow import Followed, Tell, check_drivers
from rsrl.replay.laps import replay_laps
from rsrl.replay.watch import CarWatch
from rsrl.replay.what_if import AskedCall, what_if
from rsrl.results import ReplayResult

__all__ = ["RecordedRace", "replay_recorded"]


class RecordedRace(NamedTuple):
    """What is to be replayed.

    Attributes:
        source: path of a lap file, a recording, a folder or a log, or `openf1:` with a session's key (`rsrl.feeds.recordings`).
        race: its name; None for what the source says, where it holds one race only.
        driver: whose car is called; None for the race's default driver.
        model: a policy, as of `load_any_policy`; None for that of a log, and `all` for other sources.
        audit_races: futures of each lap on which call and team differ; 0 for no audit.
        season_from: a race or season file whose figures stand for those that are missing.
        speed: so many times as fast as the race was; None for as fast as can be.
        what_if: another call, rolled out in `what_if_races` futures.
    """

    source: Path
    race: str | None
    driver: str | None
    model: str | None = None
    audit_races: int = 0
    seed: int = 0
    season_from: str | None = None
    speed: float | None = None
    what_if: AskedCall | None = None
    what_if_races: int = 2


def replay_recorded(wanted: RecordedRace, progress: Progress | None = None, tell: Tell | None = None) -> ReplayResult:
    """Replay a recorded race for one car.

    Args:
        progress: of the audit, called with (laps done, laps in all).
        tell: takes each look at the race as it is made, as of `RaceFollower`.

    Raises:
        RsrlError: the source cannot be read, or there is no such race, driver, season file or model.
    """
    anomalies = Anomalies()
    source = open_source(str(wanted.source), anomalies, wanted.race, season_asked(Asked(wanted.race)))
    wanted = _as_logged(wanted) if source.kind == "log" else wanted
    policy = load_any_policy(wanted.model or "all")
    # which race of a lap file is meant has been settled by reading it
    driver = wanted.driver or (wanted.what_if.driver if wanted.what_if else None)
    asked = Asked(None if source.kind == "lap file" else wanted.race, driver, wanted.season_from)
    watch = CarWatch(asked, policy, source.stale_after_s, tell)
    events = with_silences(source.events, source.stale_after_s) if source.stale_after_s is not None else source.events
    for event in paced(events, wanted.speed):
        watch.take(event)
    bound, session, follower = watch.settle(), watch.tracker.session, watch.car
    assert session is not None
    assert follower is not None
    check_drivers(watch.tracker, [bound.driver])
    rows = replay_laps(Followed(watch.tracker, watch.states, (follower,)))
    car = next(c for c in watch.tracker.cars.values() if c.driver == bound.driver)
    audited = None
    if watch.caller is not None and wanted.audit_races:
        audited = audit(follower, rows, watch.caller, wanted.audit_races, wanted.seed, progress)
    if wanted.what_if is not None and watch.caller is None:
        raise RsrlError(f"what-if: {bound.note}")
    other = None
    if wanted.what_if is not None and watch.caller is not None:
        other = what_if(follower, rows, car, watch.caller, wanted.what_if, wanted.what_if_races, wanted.seed)
    notes = [note for note in (bound.note, f"left out of the source: {anomalies.summary()}" if anomalies.counts else None) if note]
    return ReplayResult(
        source=str(wanted.source),
        race=bound.name,
        event=session.event or (bound.record.event if bound.record else ""),
        season=session.season or (bound.record.season if bound.record else 0),
        driver=bound.driver,
        model=policy.name if watch.caller else None,
        model_hash=policy.hash if watch.caller else None,
        note="; ".join(notes) or None,
        total_laps=watch.tracker.total_laps,
        finished=not car.out and not car.disqualified,
        laps=rows,
        audit=audited,
        what_if=other,
    )


def _as_logged(wanted: RecordedRace) -> RecordedRace:
    """With the race, driver, season file and policy that a log was made with, where no others are asked for."""
    head = log_head(wanted.source)
    texts = {name: head.get(name) for name in ("race", "driver", "model", "season_from")}
    if not all(text is None or isinstance(text, str) for text in texts.values()):
        raise RsrlError(f"{wanted.source}: race, driver, model and season_from of its first line are no words")
    race, driver, model, season_from = (getattr(wanted, name) or text for name, text in texts.items())
    return wanted._replace(race=race, driver=driver, model=model, season_from=season_from)
