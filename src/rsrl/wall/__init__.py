"""The pit wall: a race served to a page that shows it, the call, and its reasons."""

from rsrl.wall.settings import Settings, View

__all__ = ["Settings", "View"]
