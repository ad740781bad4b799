"""The strategies a strategist ends up driving: which compounds, how often, and in which laps it stops."""

from collections import Counter
from dataclasses import dataclass

import numpy as np

from rsrl.evaluation.paired import RaceLog
from rsrl.season import COMPOUNDS

WINDOW_QUANTILES = (0.1, 0.9)


@dataclass(frozen=True)
class CommonStrategy:
    """One sequence of compounds a strategist drove.

    Attributes:
        strategist: who.
        share: of the races it finished.
        races: in which it was driven.
        compounds: codes, stint by stint.
        laps: median lap of each stop.
        windows: 10 % and 90 % quantile of the laps of each stop.
        mean_position: in those races.
    """

    strategist: str
    share: float
    races: int
    compounds: tuple[int, ...]
    laps: tuple[int, ...]
    windows: tuple[tuple[int, int], ...]
    mean_position: float

    @property
    def text(self) -> str:
        """Compounds and laps as a plan is written, `S-H@14-S@36`."""
        return COMPOUNDS[self.compounds[0]] + "".join(
            f"-{COMPOUNDS[c]}@{lap}" for c, lap in zip(self.compounds[1:], self.laps, strict=True)
        )


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
    return CommonStrategy(
        strategist=log.strategist,
        share=len(rows) / finished,
        races=len(rows),
        compounds=compounds,
        laps=tuple(int(lap) for lap in np.quantile(laps, 0.5, axis=0, method="nearest")),
        windows=tuple((int(a), int(b)) for a, b in zip(low, high, strict=True)),
        mean_position=float(log.position[rows].mean()),
    )
