"""Our record types of the games' packets against another reader of them, field by field: offset and size of every number.

    python benchmarks/packet_layouts.py FOLDER

FOLDER holds releases of the package f1-packets (MIT) unpacked, one for each season, since two cannot be installed side by side:

    pip download --no-deps -d wheels f1-packets==2023.1.0    # then 2024.1.0, 2025.1.1, 2026.1.1
    for wheel in wheels/*; do unzip -q $wheel -d FOLDER/$(basename $wheel .whl); done
"""

import ctypes
import importlib.util
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from rsrl.feeds.games.formats import FORMATS, packet_type

NAMES = {
    1: "PacketSessionData", 2: "PacketLapData", 3: "PacketEventData", 4: "PacketParticipantsData", 7: "PacketCarStatusData",
    8: "PacketFinalClassificationData", 10: "PacketCarDamageData", 11: "PacketSessionHistoryData", 12: "PacketTyreSetsData",
}  # fmt: skip


def ours(kind: np.dtype, at: int = 0) -> Iterator[tuple[int, int, str]]:
    """Offset, size and kind (u, i, f or S) of every number and text."""
    if kind.subdtype:
        base, shape = kind.subdtype
        for i in range(int(np.prod(shape))):
            yield from ours(base, at + i * base.itemsize)
    elif kind.fields:
        for field, offset, *_ in kind.fields.values():
            yield from ours(field, at + offset)
    else:
        yield at, kind.itemsize, kind.kind


def theirs(kind: Any, at: int = 0) -> Iterator[tuple[int, int, str]]:
    """The same of a ctypes structure; a union, which the event packet ends with, is bytes."""
    if issubclass(kind, ctypes.Union):
        yield from ((at + i, 1, "u") for i in range(ctypes.sizeof(kind)))
    elif issubclass(kind, ctypes.Structure):
        begins = at
        for _, field, *_ in kind._fields_:  # by order, since one release names two fields alike
            yield from theirs(field, begins)
            begins += ctypes.sizeof(field)
    elif issubclass(kind, ctypes.Array) and kind._type_ is not ctypes.c_char:
        for i in range(kind._length_):
            yield from theirs(kind._type_, at + i * ctypes.sizeof(kind._type_))
    else:
        letter = "S" if issubclass(kind, ctypes.Array) else "f" if kind._type_ in "fd" else "i" if kind._type_ in "bhil" else "u"
        yield at, ctypes.sizeof(kind), letter


def release(folder: Path, season: int) -> ModuleType | None:
    """The module of packets of a season's release."""
    found = sorted(folder.glob(f"*{season}*/f1/packets.py"))
    spec = importlib.util.spec_from_file_location(f"f1_packets_{season}", found[-1]) if found else None
    if spec is None or spec.loader is None:
        return None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def main() -> int:
    folder, wrong = Path(sys.argv[1]), 0
    for season in FORMATS:
        module = release(folder, season)
        if module is None:
            print(f"{season}: no release in {folder}")
            continue
        for packet_id, name in NAMES.items():
            kind = packet_type(season, packet_id)
            assert kind is not None
            mine, other = list(ours(kind)), list(theirs(getattr(module, name)))
            if packet_id == 3:  # a code of four bytes is text to us
                other = [(29, 4, "S") if at == 29 else (at, size, letter) for at, size, letter in other if not 29 < at < 33]
                other = [(29, 4, "S") if one[0] == 29 else one for one in other]
            same = mine == other
            wrong += not same
            print(f"{season} {name}: {len(mine)} numbers, {'equal' if same else 'DIFFER'}")
            for a, b in [pair for pair in zip(mine, other, strict=False) if pair[0] != pair[1]][:3]:
                print("   ours", a, "theirs", b)
    return wrong


if __name__ == "__main__":
    sys.exit(main())
