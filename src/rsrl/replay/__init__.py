"""A feed followed for cars of it: a state and a call whenever one is due, what the team did, and the audit of both."""

from rsrl.replay.caller import Called, StateCaller
from rsrl.replay.follow import CarFollower, Followed, FollowedLap, Look, follow

__all__ = ["Called", "CarFollower", "Followed", "FollowedLap", "Look", "StateCaller", "follow"]
