"""Datagrams of the games as records, where they are what their header says."""

from typing import Final, NamedTuple

import numpy as np

from rsrl.feeds.anomalies import Anomalies
from rsrl.feeds.games.formats import FORMATS, HEADER, SIZES, packet_type

__all__ = ["Packet", "decode"]

OTHER_FORMATS: Final = range(2016, 2100)


class Packet(NamedTuple):
    """A packet: its season's format, its id, and the record of the whole packet with `header` and the fields of `formats`."""

    season: int
    packet_id: int
    record: np.void


def decode(data: bytes, anomalies: Anomalies) -> Packet | None:
    """The packet of a datagram; None for one that is not needed, and for one that is none, which is counted.

    The first packet of another season's format is told as an example, those after it are counted.
    """
    if len(data) < HEADER.itemsize:
        anomalies.add("no packet of a game", f"{len(data)} bytes")
        return None
    season, packet_id = int.from_bytes(data[:2], "little"), data[6]
    if season not in FORMATS:
        if season in OTHER_FORMATS:
            advice = f"RSRL reads {FORMATS[0]} to {FORMATS[-1]}; choose one in the game's telemetry settings"
            anomalies.add(f"packets of format {season}", advice)
        else:
            anomalies.add("no packet of a game", f"format {season}")
        return None
    sizes = SIZES.get(packet_id)
    if sizes is None:
        return None  # of the player's car, such as time trials and active aerodynamics
    size = sizes[FORMATS.index(season)]
    if len(data) != size:
        anomalies.add("packet of a wrong size", f"id {packet_id} of {season}: {len(data)} bytes, not {size}")
        return None
    kind = packet_type(season, packet_id)
    return None if kind is None else Packet(season, packet_id, np.frombuffer(data, kind)[0])
