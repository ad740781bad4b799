"""The commonest strategies a strategist drove: compounds, frequency, and laps of the stops."""

from collections import Counter

import numpy as np

from rsrl.evaluation.paired import RaceLog
from rsrl.results import CommonStrategy
from rsrl.simulator import Plan

WINDOW_QUANTILES = (0.1, 0.9)


def common_strategies(log: RaceLog, most: int = 3) -> list[CommonStrategy]:
    """The sequences of compounds driven most often among the races finished, commonest first."""
    finished = np.flatnonzero(~log.retired)
    stints = {int(i): log.stints(int(i)) for i in finished}
    counted = Counter(compounds for compounds, _ in stints.values())
    ranked = sorted(counted.items(), key=lambda item: (-item[1], item[0]))[:most]
    return [_summary(log, compounds, [i for i, (c, _) in stints.items() if c == compounds], len(finished)) for compounds, _ in ranked]


def _summary(log: RaceLog, compounds: tuple[int, ...], rows: list[int], finished: int) -> CommonStrategy:
    laps = np.array([log.stints(i)[1] for i in rows], np.int64).reshape(len(rows), len(compounds) - 1)
    low, high = np.quantile(laps, WINDOW_QUANTILES, axis=0, method="nearest").astype(int)
    medians = tuple(int(lap) for lap in np.quantile(laps, 0.5, axis=0, method="nearest"))
    return CommonStrategy(
        strategist=log.strategist,
        share=len(rows) / finished,
        races=len(rows),
        compounds=compounds,
        laps=medians,
        windows=tuple((int(a), int(b)) for a, b in zip(low, high, strict=True)),
        mean_position=float(log.position[rows].mean()),
        plan=str(Plan(compounds, medians)),
    )
