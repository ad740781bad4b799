"""The one exception a user can cause. The command line turns it into a single line and exit code 2."""

__all__ = ["RsrlError"]


class RsrlError(Exception):
    """Input that cannot be used: the message says what was wrong, where, and what to do about it."""
