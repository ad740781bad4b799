"""The plans a pit wall chooses from: every sequence of compounds with one to three stops that the rules and the usual sets allow."""

from itertools import product
from typing import Final

import numpy as np

MAX_STINTS: Final = 4
USUAL_SETS: Final = (3, 2, 2)
"""Sets of soft, medium and hard a car has for the race as a rule; the few cars that ran more are left out of the choices."""

SEQUENCES: Final = tuple(
    c
    for stints in range(2, MAX_STINTS + 1)
    for c in product(range(3), repeat=stints)
    if len(set(c)) > 1 and all(c.count(k) <= sets for k, sets in enumerate(USUAL_SETS))
)
"""Compound codes by stint; two compounds at least, as the sporting regulations ask in a dry race."""

SEQUENCE_INDEX: Final = {c: i for i, c in enumerate(SEQUENCES)}
STINTS: Final = np.array([len(c) for c in SEQUENCES])
START: Final = np.array([c[0] for c in SEQUENCES])
COMPOUND_TABLE: Final = np.array([(*c, *(0,) * (MAX_STINTS - len(c))) for c in SEQUENCES])
"""int [sequences, MAX_STINTS]; beyond a sequence's last stint 0, which nothing reads."""


def sequence_name(index: int) -> str:
    """Such as `S-H-S`."""
    return "-".join("SMH"[c] for c in SEQUENCES[index])
