"""The policy asked about a changed race, with a history that leads up to it."""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rsrl.explanation.counterfactual.change import CAUSE, CAUSES, HYPOTHETICAL, Altered, Calls, RaceEditor
from rsrl.explanation.moment import Moment
from rsrl.explanation.policy import ExplainedPolicy
from rsrl.simulator import compile_figures
from rsrl.state import COLUMN, FEATURES
from rsrl.state.outlook import lap_cost

Floats = NDArray[np.float32]
GAPS: Final = (CAUSE["gap_ahead_s"], CAUSE["gap_behind_s"])
LATER, CALLED = CAUSE["laps_later"], CAUSE["laps_called"]
PAST: Final = [CAUSE[name] for name in HYPOTHETICAL]
NUMBERS: Final = np.array([f.kind == "continuous" for f in FEATURES])


@dataclass(frozen=True)
class Answers:
    """What a policy says to N changed races: values [N, 4], its calls [N], and the races themselves."""

    q: Floats
    calls: NDArray[np.int8]
    races: Altered

    def says(self, target: int) -> NDArray[np.bool_]:
        """Where the race can be so, the call may be made, and it is the policy's, bool [N]. The only legal call is nobody's choice."""
        legal = self.races.legal
        return self.races.possible & legal[:, target] & (legal.sum(axis=1) > 1) & (self.calls == target)

    def short_of(self, target: int) -> Floats:
        """How much more the call would have to be worth to be made, float32 [N]; infinite where it cannot be."""
        others = np.where(self.races.legal, self.q, -np.inf)
        others[:, target] = -np.inf
        short = np.maximum(others.max(axis=1) - self.q[:, target], np.float32(0.0))
        return np.where(self.races.possible & self.races.legal[:, target], short, np.float32(np.inf)).astype(np.float32)


class PolicyQuery:
    """Asks one policy about one moment changed.

    Attributes:
        asked: changed races it has been asked about.
    """

    def __init__(self, policy: ExplainedPolicy, moment: Moment, alterer: RaceEditor) -> None:
        self.policy, self.moment, self.alterer = policy, moment, alterer
        self._encoder = policy.encoder(moment.record)
        self.asked = 0
        self._plans: dict[bytes, NDArray[np.int8]] = {}

    def __call__(self, rows: Floats) -> Answers:
        """Answers to the changes `rows` [N, causes], each put into the race itself: what follows from it is computed anew."""
        return self._ask(rows, self.calls_of(rows))

    def calls_of(self, rows: Floats) -> Calls:
        """What the policy calls lap by lap from now in the races of `rows`, int8 [N, laps]; None where no row is to follow it.

        Only what could have been otherwise bears on it: whatever else changes does so at the end of these laps.
        """
        follows = np.flatnonzero(~np.isnan(rows[:, CALLED]))
        if not len(follows):
            return None
        calls = np.zeros((len(rows), self.moment.record.laps), np.int8)
        for i in follows:
            calls[i] = self._plan(rows[i])
        return calls

    def _plan(self, row: Floats) -> NDArray[np.int8]:
        """The policy's calls int8 [laps] from now on in a race without luck, its past as `row` has it; remembered."""
        past = row[PAST].tobytes()
        if past not in self._plans:
            ends = max(int(self.moment.raw[-1, COLUMN["laps_left"]]), 1)
            steps = np.full((ends, len(CAUSES)), np.nan, np.float32)
            steps[:, PAST] = row[PAST]
            steps[1:, CALLED] = np.arange(1, ends)
            calls, known = np.zeros(self.moment.record.laps, np.int8), 0
            while known < ends:
                said = self._ask(steps[known:], np.repeat(calls[None], ends - known, axis=0))
                stops = np.flatnonzero(said.races.possible & (said.calls > 0) & said.races.legal[np.arange(len(said.calls)), said.calls])
                if not len(stops):
                    break
                calls[known + stops[0]] = said.calls[stops[0]]
                known += int(stops[0]) + 1
            self._plans[past] = calls
        return self._plans[past]

    def _ask(self, rows: Floats, calls: Calls) -> Answers:
        races = self.alterer(rows, calls)
        self.asked += len(rows)
        if self.policy.recurrent:
            q = self._with_history(rows, races.raw, calls)
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

    def _with_history(self, rows: Floats, raw: Floats, calls: Calls) -> Floats:
        """Values [N, 4] for a policy that remembers: changes with as many laps behind them are gone through together."""
        plans = [None] * len(rows) if calls is None else list(calls)
        races = [
            np.concatenate([self._led_up_to(row), *self._laps_between(row, plan), last[None]])
            for row, plan, last in zip(rows, plans, raw, strict=True)
        ]
        laps, q = np.array([len(race) for race in races]), np.zeros((len(rows), 4), np.float32)
        for n in np.unique(laps):
            alike = np.flatnonzero(laps == n)
            features = self._encoder(np.concatenate([races[i] for i in alike]))
            q[alike] = self.policy.q_of_sequences(features.reshape(len(alike), n, -1))
        return q

    def _laps_between(self, row: Floats, calls: Calls) -> list[Floats]:
        """Rows of the laps from now to the changed one, gaps moving evenly toward what they are to be."""
        clock = LATER if np.isnan(row[CALLED]) else CALLED
        if np.isnan(row[clock]):
            return []
        laps = int(row[clock])
        steps = np.full((laps + 1, len(CAUSES)), np.nan, np.float32)
        steps[:, PAST] = row[PAST]
        steps[1:, clock] = np.arange(1, laps + 1)
        each = None if calls is None else np.repeat(calls[None], laps + 1, axis=0)
        plain = self.alterer(steps, each).raw
        for cause in GAPS:
            if not np.isnan(row[cause]):
                gaps = plain[:, COLUMN[CAUSES[cause]]]
                steps[:, cause] = np.maximum(gaps + (row[cause] - gaps[-1]) * np.linspace(0.0, 1.0, laps + 1), 0.0)
        steps[0, list(GAPS)] = np.nan
        return [self.alterer(steps[:-1], None if each is None else each[:-1]).raw]

    def _led_up_to(self, row: Floats) -> Floats:
        """Laps before the decision, those of this stint made to lead to the changed one.

        Gaps that are to be otherwise at once open evenly over it; what could only have been was so all along.
        """
        changed = self.moment.raw[:-1].copy()
        stops = self.moment.raw[:, COLUMN["stops_made"]]
        begun = int(np.flatnonzero(stops == stops[-1])[0])
        laps = len(changed) - begun
        at_once = np.isnan(row[[LATER, CALLED]]).all() and not np.isnan(row[list(GAPS)]).all()
        if laps > 0 and at_once:
            only = np.full((1, len(CAUSES)), np.nan, np.float32)
            only[0, list(GAPS)] = row[list(GAPS)]
            shift = np.where(NUMBERS, self.alterer(only).raw[0] - self.moment.raw[-1], np.float32(0.0))
            changed[begun:] += np.linspace(0.0, 1.0, laps + 1, dtype=np.float32)[:-1, None] * shift
        if not np.isnan(row[CAUSE["laps_older"]]):
            _age(changed[begun:], float(row[CAUSE["laps_older"]]), self.moment)
        if not np.isnan(row[CAUSE["compounds_used"]]):
            changed[begun:, COLUMN["valid_finish"]] = row[CAUSE["compounds_used"]] - 1.0
        return changed


def _age(rows: Floats, older: float, moment: Moment) -> None:
    """Make the set of these laps older, in place."""
    tyres = compile_figures(moment.record).tyres
    age, worn = COLUMN["tyre_age_laps"], COLUMN["tyre_degradation_s"]
    for row in rows:
        compound = int(row[COLUMN["tyre"]])
        row[worn] += lap_cost(tyres, compound, row[age] + older) - lap_cost(tyres, compound, row[age])
        row[age] += older
