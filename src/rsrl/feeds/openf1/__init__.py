"""OpenF1's history of sessions since 2023 as canonical events."""

from rsrl.feeds.anomalies import Anomalies
from rsrl.feeds.events import Event
from rsrl.feeds.openf1.client import OpenF1
from rsrl.feeds.openf1.folder import is_openf1_folder, openf1_folder_events
from rsrl.feeds.openf1.translate import ENDPOINTS, events_of_rows

__all__ = ["ENDPOINTS", "OpenF1", "events_of_rows", "is_openf1_folder", "openf1_events", "openf1_folder_events"]


def openf1_events(session_key: int, client: OpenF1 | None = None, anomalies: Anomalies | None = None) -> list[Event]:
    """The events of a session, from what is kept of it or else from the network.

    Raises:
        RsrlError: there is no such session, or it cannot be had; a session that is on closes the history to all without an account.
    """
    client = client or OpenF1()
    session = client.session(session_key)
    tables = {endpoint: client.rows(endpoint, session) for endpoint in ENDPOINTS}
    return events_of_rows(session, tables, anomalies or Anomalies())
