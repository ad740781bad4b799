"""A feed followed for cars of it: a state and a call whenever one is due, what the team did, and the audit of both."""

from rsrl.replay.audit import audit
from rsrl.replay.binding import Asked, Bound
from rsrl.replay.caller import Called, StateCaller
from rsrl.replay.follow import CarFollower, Followed, FollowedLap, Look, RaceFollower, follow
from rsrl.replay.laps import live_look, replay_laps, team_call
from rsrl.replay.recorded import RecordedRace, replay_recorded
from rsrl.replay.watch import CarWatch
from rsrl.replay.what_if import AskedCall, parse_asked_call, what_if

__all__ = [
    "Asked",
    "AskedCall",
    "Bound",
    "Called",
    "CarFollower",
    "CarWatch",
    "Followed",
    "FollowedLap",
    "Look",
    "RaceFollower",
    "RecordedRace",
    "StateCaller",
    "audit",
    "follow",
    "live_look",
    "parse_asked_call",
    "replay_laps",
    "replay_recorded",
    "team_call",
    "what_if",
]
