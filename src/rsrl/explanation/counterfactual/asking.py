"""The policy asked about a changed race, with a history that leads up to it."""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rsrl.explanation.counterfactual.causes import CAUSE, CAUSES, Altered, Alterer
from rsrl.explanation.moment import Moment
from rsrl.explanation.subject import ExplainedPolicy
from rsrl.simulator import compile_figures
from rsrl.state import COLUMN, FEATURES
from rsrl.state.outlook import lap_cost

Floats = NDArray[np.float32]
GAPS: Final = (CAUSE["gap_ahead_s"], CAUSE["gap_behind_s"])
LATER: Final = CAUSE["laps_later"]
NUMBERS: Final = np.array([f.kind == "continuous" for f in FEATURES])


@dataclass(frozen=True)
class Answers:
    """What a policy says to N changed races: values [N, 4], its calls [N], and the races themselves."""

    q: Floats
    calls: NDArray[np.int8]
    races: Altered

    def says(self, target: int) -> NDArray[np.bool_]:
        """Where the race can be so, the call may be made, and it is the policy's, bool [N]."""
        return self.races.possible & self.races.legal[:, target] & (self.calls == target)


class Asker:
    """Asks one policy about one moment changed.

    Attributes:
        asked: changed races it has been asked about.
    """

    def __init__(self, policy: ExplainedPolicy, moment: Moment, alterer: Alterer) -> None:
        self.policy, self.moment, self.alterer = policy, moment, alterer
        self._encoder = policy.encoder(moment.record)
        self.asked = 0

    def __call__(self, rows: Floats) -> Answers:
        """Answers to the changes `rows` [N, causes], each put into the race itself: what follows from it is computed anew."""
        races = self.alterer(rows)
        self.asked += len(rows)
        if self.policy.recurrent:
            q = np.concatenate([self._with_history(row, raw) for row, raw in zip(rows, races.raw, strict=True)]) if len(rows) else _NONE
        else:
            q = self.policy.q_of_rows(self._encoder(races.raw))
        return Answers(q, self.policy.chosen(q, races.legal), races)

    def of_rows(self, raw: Floats) -> Floats:
        """Values [N, 4] of raw rows [N, RAW_SIZE] put in the place of the last lap, the laps before as they were."""
        features = self._encoder(raw)
        if not self.policy.recurrent:
            return self.policy.q_of_rows(features)
        before = self._encoder(self.moment.raw[:-1])
        return self.policy.q_of_sequences(np.concatenate([np.repeat(before[None], len(raw), axis=0), features[:, None]], axis=1))

    def _with_history(self, row: Floats, raw: Floats) -> Floats:
        """Values [1, 4] for a policy that remembers."""
        history = np.concatenate([self.moment.raw[:-1], *self._laps_between(row)])
        if np.isnan(row[LATER]):
            history = self._led_up_to(row, history)
        return self.policy.q_of_sequences(self._encoder(np.concatenate([history, raw[None]]))[None])

    def _laps_between(self, row: Floats) -> list[Floats]:
        """Rows of the laps from now to the changed one, gaps moving evenly toward what they are to be."""
        if np.isnan(row[LATER]):
            return []
        laps = int(row[LATER])
        steps = np.full((laps + 1, len(CAUSES)), np.nan, np.float32)
        steps[1:, LATER] = np.arange(1, laps + 1)
        plain = self.alterer(steps).raw
        for cause in GAPS:
            if not np.isnan(row[cause]):
                gaps = plain[:, COLUMN[CAUSES[cause]]]
                steps[:, cause] = np.maximum(gaps + (row[cause] - gaps[-1]) * np.linspace(0.0, 1.0, laps + 1), 0.0)
        steps[0] = np.nan
        return [self.alterer(steps[:-1]).raw]

    def _led_up_to(self, row: Floats, history: Floats) -> Floats:
        """Past laps of this stint, made to lead to the changed one: gaps open evenly over it, an older set was older all along."""
        changed = history.copy()
        stops = self.moment.raw[:, COLUMN["stops_made"]]
        begun = int(np.flatnonzero(stops == stops[-1])[0])
        laps = len(self.moment.raw) - 1 - begun
        if laps > 0 and not np.isnan(row[list(GAPS)]).all():
            only = np.full((1, len(CAUSES)), np.nan, np.float32)
            only[0, list(GAPS)] = row[list(GAPS)]
            shift = np.where(NUMBERS, self.alterer(only).raw[0] - self.moment.raw[-1], np.float32(0.0))
            changed[begun:] += np.linspace(0.0, 1.0, laps + 1, dtype=np.float32)[:-1, None] * shift
        older = row[CAUSE["laps_older"]]
        if not np.isnan(older):
            _age(changed[begun:], float(older), self.moment)
        return changed


_NONE: Final = np.zeros((0, 4), np.float32)


def _age(rows: Floats, older: float, moment: Moment) -> None:
    """Make the set of these laps older, in place."""
    tyres = compile_figures(moment.record).tyres
    age, worn = COLUMN["tyre_age_laps"], COLUMN["tyre_degradation_s"]
    for row in rows:
        compound = int(row[COLUMN["tyre"]])
        row[worn] += lap_cost(tyres, compound, row[age] + older) - lap_cost(tyres, compound, row[age])
        row[age] += older
