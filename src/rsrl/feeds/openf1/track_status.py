"""The track status from race control's words: OpenF1 has no track status of its own."""

from collections.abc import Mapping
from typing import Any

from rsrl.season import GREEN, RED, SC, VSC

__all__ = ["status_after"]


def status_after(row: Mapping[str, Any], status: int) -> int:
    """The status after a message of race control, given the one before.

    Args:
        row: `category`, `flag`, `scope` and `message`, as OpenF1 has them and, with capitals, live timing.

    A virtual safety car that is "ending" and a safety car "in this lap" are still there; "track clear" ends both. A red flag ends when
    race control says that the race goes on: behind a safety car, from the grid, or with the pit exit open.
    """
    message, flag = str(row.get("message") or "").upper().strip(), str(row.get("flag") or "").upper()
    if flag == "RED" or message.startswith("RED FLAG"):
        return RED
    if message.startswith("VIRTUAL SAFETY CAR DEPLOYED") or message == "VSC DEPLOYED":
        return VSC
    if message.startswith("SAFETY CAR DEPLOYED"):
        return SC
    if str(row.get("scope") or "").upper() == "TRACK" and flag in ("CLEAR", "GREEN"):
        return GREEN
    return GREEN if status == RED and ("STANDING START" in message or "ROLLING START" in message) else status
