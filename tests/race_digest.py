"""A few races of every kind of caller, lap by lap, as one digest a lap; run as a program it prints them.

With NUMBA_DISABLE_JIT=1 the same code is plain Python, so the two outputs can be compared bit for bit.
"""

import hashlib

import numpy as np
from synthetic_race import synthetic_race

from rsrl.environment import RaceEnvironment
from rsrl.simulator import Plan

RACES, CALLED, PLANNED = 3, 6, 2


def digests() -> list[str]:
    """State, observation, legality and reward after every lap of a few races."""
    record = synthetic_race(max_laps_per_set=9, retire_per_lap=0.01, plans=("S-H@7", "M-H@8", "H-M@9", "S-M@5-S@11"))
    plans = {PLANNED: Plan.parse("S-M@6-S@11")}
    environment = RaceEnvironment(record, CALLED, batch=RACES, plans=plans)
    lines = []
    with np.errstate(over="ignore"):  # random numbers wrap around, of which only plain NumPy warns
        environment.reset(21, np.arange(RACES, dtype=np.int64))
        for lap in range(record.laps):
            calls = np.where(environment.legal[:, 0] & (lap != 4), 0, environment.legal[:, 1:].argmax(axis=1) + 1)
            t = environment.step(calls.astype(np.int8))
            b = environment.races
            parts = (b.f, b.k, b.r, environment.raw, t.features, t.legal, t.reward, t.terminated)
            lines.append(" ".join(hashlib.sha256(np.ascontiguousarray(p).tobytes()).hexdigest()[:8] for p in parts))
        lines.append(str(environment.races.positions().tolist()))
    return lines


if __name__ == "__main__":
    print("\n".join(digests()))
