"""The tables of `rsrl replay`."""

import re
from collections import Counter
from collections.abc import Sequence
from typing import TYPE_CHECKING

from rsrl.cli.output import Column, Shown, table
from rsrl.results import ReplayAudit, ReplayLap, ReplayResult, ReplayWhatIf, known
from rsrl.season import TRACK_STATUS_NAMES
from rsrl.state import ACTION_NAMES

if TYPE_CHECKING:
    from rsrl.replay import Look

STATUS: dict[int, str] = dict(enumerate(("", "VSC", "SC", "red")))
assert len(STATUS) == len(TRACK_STATUS_NAMES)

CODES = re.compile(r"\b[A-Z]{3}(, [A-Z]{3})*\b")
"""Drivers in a note."""

SHORT = {"no pit": "stay out", "pit soft": "box for S", "pit medium": "box for M", "pit hard": "box for H"}


def told(driver: str, lap: int, look: "Look") -> str:
    """A look at a race on one line."""
    state, called = look.tracked.state, look.called
    place = "" if state is None else f", P{next(car.position for car in state.cars if car.driver == driver)}"
    call = SHORT[ACTION_NAMES[called.strategy.action]] if called else f"no call: {look.tracked.reason or 'tracked only'}"
    return f"{driver}, lap {lap}{place}, {look.why}: {call}"


def tables(result: ReplayResult) -> list[Shown]:
    """A replay for people: the laps, why there are no calls, and the audit."""
    shown: list[Shown] = [_laps(result)]
    if result.note:
        shown.append(result.note)
    reasons = Counter(lap.reason for lap in result.laps if lap.call is None and lap.reason)
    shown += [f"No call on {n} lap{'s' if n > 1 else ''}: {reason}." for reason, n in reasons.items()]
    missing = Counter(CODES.sub("some cars", note) for lap in result.laps if lap.health for note in lap.health.missing)
    shown += [f"On {n} lap{'s' if n > 1 else ''}: {note}." for note, n in missing.items()]
    shown += _audit(result.audit) if result.audit else []
    return [*shown, *(_what_if(result.what_if) if result.what_if else ())]


def _laps(result: ReplayResult) -> Shown:
    columns = (
        Column("lap", 1), Column("place", 1), Column("leader", 3), Column("ahead", 2), Column("behind", 2), Column("tyre", 1),
        Column("track", 2), Column("call", 1), Column("stay", 3), Column("best stop", 3), Column("team", 1), Column("gaps", 4),
    )  # fmt: skip
    rows = [_row(lap) for lap in result.laps]
    called = f", called by {result.model}" if result.model else ""
    captions = []
    if result.model:
        captions.append("stay, best stop: the policy's values, for RSRL's own minus the expected place; gaps: cars measured of all running")
    return table(f"{result.event} {result.season}, {result.driver}{called}", columns, rows, left=1, captions=captions)


def _row(lap: ReplayLap) -> tuple[object, ...]:
    tyre = f"{lap.compound or '?'} {'?' if lap.tyre_age_laps is None else lap.tyre_age_laps}"
    values = lap.values or {}
    stops = [value for name, value in values.items() if name != "no pit" and name in lap.legal]
    gaps = lap.health.gaps if lap.health else {}
    return (
        lap.lap,
        "" if lap.position is None else f"P{lap.position}",
        _seconds(lap.gap_to_leader_s),
        _seconds(lap.gap_ahead_s),
        _seconds(lap.gap_behind_s),
        tyre,
        STATUS[lap.track_status],
        "" if lap.call is None else SHORT[lap.call] + ("" if lap.agrees is not False else " *"),
        f"{values['no pit']:.2f}" if "no pit" in lap.legal and values else "",
        f"{max(stops):.2f}" if stops else "",
        "?" if lap.team is None else "" if lap.team == "no pit" else SHORT[lap.team],
        f"{gaps.get('measured', 0)}/{sum(gaps.values())}" if gaps else "",
    )


def _seconds(value: float | None) -> str:
    return "" if value is None else f"{value:.1f}"


def _audit(found: ReplayAudit) -> list[Shown]:
    differences = [
        (lap.lap, SHORT[lap.call], SHORT[lap.team], _places(lap.places, known(lap.ci95)), lap.verdict) for lap in found.differences
    ]
    stops = [
        (
            stop.lap,
            stop.compound,
            STATUS[stop.track_status],
            "never" if stop.policy_lap is None else f"{stop.policy_lap:.0f}",
            stop.policy_compound or "",
            "yes" if stop.within_two_laps else "no",
            "yes" if stop.same_compound else "no",
        )
        for stop in found.stops
    ]
    shown: list[Shown] = [f"Call and team agree on {found.laps_agreed} of {found.laps_called} laps."]
    if differences:
        title = f"Where they differ: the team's call against the policy's, {found.races} futures each"
        columns = ("lap", "call", "team", "places", "the team's call is")
        shown.append(table(title, columns, differences, left=1, captions=("places below zero: the team's call finishes further ahead",)))
    if stops:
        shown.append(
            table("The team's stops", ("lap", "tyre", "track", "policy's lap", "its tyre", "within 2 laps", "same tyre"), stops, left=1)
        )
        shown.append(
            f"{found.stops_within_two_laps} of {len(found.stops)} stops within two laps, {found.compounds_matched} on the same compound."
        )
    return shown


def _what_if(found: ReplayWhatIf) -> list[Shown]:
    """What would have happened by each option, beside what the team did."""
    rows = [
        (
            WHOSE[one.name],
            one.call,
            f"{one.mean_position:.2f}",
            _likely(one.positions),
            "" if one.verdict == "itself" else _places(one.places, known(one.places_ci95)),
            "" if one.verdict == "itself" else _places(one.seconds, known(one.seconds_ci95)),
            "" if one.verdict == "itself" else one.verdict,
        )
        for one in found.options
    ]
    columns = ("", "call", "mean finish", Column("most likely", 2), "places", Column("seconds", 1), "against the team's")
    title = f"{found.driver} at the end of lap {found.lap}: what would have happened, {found.races} futures"
    captions = ("places and seconds against what the team did, below zero better; the policy calls afterwards; [95 %]",)
    stops = ", ".join(f"lap {lap} for {compound or '?'}" for lap, compound in found.stops) or "none"
    finish = "did not finish" if found.finish is None else f"finished P{found.finish}"
    return [table(title, columns, rows, left=2, captions=captions), f"What happened: {finish}; stops from this lap on: {stops}."]


WHOSE = {"team": "what the team did", "asked": "what is asked", "policy": "the policy's call"}


def _likely(shares: Sequence[float], most: int = 3) -> str:
    """The likeliest finishing places with their chances."""
    best = sorted(range(len(shares)), key=lambda i: -shares[i])[:most]
    return ", ".join(f"P{i + 1} {shares[i]:.0%}" for i in best if shares[i] > 0)


def _places(mean: float | None, ends: tuple[float, float] | None) -> str:
    return "" if mean is None or ends is None else f"{mean:+.2f} [{ends[0]:+.2f}, {ends[1]:+.2f}]"
