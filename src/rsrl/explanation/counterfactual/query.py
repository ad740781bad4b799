"""The policy asked about edited races, each with a history that leads up to it."""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rsrl.explanation.counterfactual.change import CAUSES, CLOCKS, GAPS, PAST, Calls, EditedRaces, RaceEditor, empty_rows, laps_ahead
from rsrl.explanation.counterfactual.edit_kernels import CALLED, LATER, OLDER, USED
from rsrl.explanation.moment import Moment
from rsrl.explanation.policy import ExplainedPolicy
from rsrl.simulator import compile_figures
from rsrl.state import COLUMN, FEATURES
from rsrl.state.outlook import lap_cost

Floats = NDArray[np.float32]
CONTINUOUS: Final = np.array([f.kind == "continuous" for f in FEATURES])


@dataclass(frozen=True)
class Answers:
    """The policy's answers to N changes: action values [N, 4], its calls [N], and the edited races."""

    q: Floats
    calls: NDArray[np.int8]
    races: EditedRaces

    def confirm(self, target: int) -> NDArray[np.bool_]:
        """Whether each change is feasible and the policy chooses `target` there, bool [N]; an only legal call is no choice."""
        legal = self.races.legal
        return self.races.feasible & legal[:, target] & (legal.sum(axis=1) > 1) & (self.calls == target)

    def shortfall(self, target: int) -> Floats:
        """How much the value of `target` lacks to the best other legal call, float32 [N]; infinite where it cannot be called."""
        others = np.where(self.races.legal, self.q, -np.inf)
        others[:, target] = -np.inf
        short = np.maximum(others.max(axis=1) - self.q[:, target], np.float32(0.0))
        return np.where(self.races.feasible & self.races.legal[:, target], short, np.float32(np.inf)).astype(np.float32)


class PolicyQuery:
    """Asks one policy about changes of one moment.

    Attributes:
        asked: edited races that the policy was asked about so far.
    """

    def __init__(self, policy: ExplainedPolicy, moment: Moment, editor: RaceEditor) -> None:
        self.policy, self.moment, self.editor = policy, moment, editor
        self._encoder = policy.encoder(moment.record)
        self.asked = 0
        self._plans: dict[bytes, NDArray[np.int8]] = {}

    def ask(self, rows: Floats) -> Answers:
        """Answers to changes `rows` [N, causes], each made to the race itself, so that what follows from it is computed anew."""
        return self._ask(rows, self.calls_of(rows))

    def calls_of(self, rows: Floats) -> Calls:
        """The policy's calls lap by lap from now in the races of `rows`, int8 [N, laps]; None where no row has `laps_called`.

        Only the past of a row bears on them: all other causes take effect at the end of these laps.
        """
        follows = np.flatnonzero(~np.isnan(rows[:, CALLED]))
        if not len(follows):
            return None
        calls = np.zeros((len(rows), self.moment.record.laps), np.int8)
        for i in follows:
            calls[i] = self._plan(rows[i])
        return calls

    def _plan(self, row: Floats) -> NDArray[np.int8]:
        """The policy's calls int8 [laps] from now on at expected lap times, with the past of `row`; cached."""
        past = row[PAST].tobytes()
        if past not in self._plans:
            ends = max(int(self.moment.raw[-1, COLUMN["laps_left"]]), 1)
            steps = laps_ahead(row, CALLED, ends)
            calls, known = np.zeros(self.moment.record.laps, np.int8), 0
            while known < ends:  # ask about all laps at once; each stop found changes those after it
                answers = self._ask(steps[known:], np.repeat(calls[None], ends - known, axis=0))
                legal = answers.races.legal[np.arange(len(answers.calls)), answers.calls]
                stops = np.flatnonzero(answers.races.feasible & (answers.calls > 0) & legal)
                if not len(stops):
                    break
                calls[known + stops[0]] = answers.calls[stops[0]]
                known += int(stops[0]) + 1
            self._plans[past] = calls
        return self._plans[past]

    def _ask(self, rows: Floats, calls: Calls) -> Answers:
        races = self.editor.edit(rows, calls)
        self.asked += len(rows)
        if self.policy.recurrent:
            q = self._q_with_history(rows, races.raw, calls)
        else:
            q = self.policy.q_of_rows(self._encoder(races.raw))
        return Answers(q, self.policy.chosen(q, races.legal), races)

    def q_of_last_rows(self, raw: Floats) -> Floats:
        """Values [N, 4] where each of the raw rows [N, RAW_SIZE] replaces the last lap, the laps before as they were."""
        features = self._encoder(raw)
        if not self.policy.recurrent:
            return self.policy.q_of_rows(features)
        before = self._encoder(self.moment.raw[:-1])
        return self.policy.q_of_sequences(np.concatenate([np.repeat(before[None], len(raw), axis=0), features[:, None]], axis=1))

    def _q_with_history(self, rows: Floats, raw: Floats, calls: Calls) -> Floats:
        """Values [N, 4] of a recurrent policy; changes with histories of equal length form a batch."""
        plans = [None] * len(rows) if calls is None else list(calls)
        histories = [
            np.concatenate([self._laps_before(row), *self._laps_between(row, plan), last[None]])
            for row, plan, last in zip(rows, plans, raw, strict=True)
        ]
        laps, q = np.array([len(history) for history in histories]), np.zeros((len(rows), 4), np.float32)
        for n in np.unique(laps):
            alike = np.flatnonzero(laps == n)
            features = self._encoder(np.concatenate([histories[i] for i in alike]))
            q[alike] = self.policy.q_of_sequences(features.reshape(len(alike), n, -1))
        return q

    def _laps_between(self, row: Floats, calls: Calls) -> list[Floats]:
        """Raw rows of the laps from now until the change holds, gaps moving evenly to their new values."""
        clock = LATER if np.isnan(row[CALLED]) else CALLED
        if np.isnan(row[clock]):
            return []
        laps = int(row[clock])
        steps = laps_ahead(row, clock, laps + 1)
        each = None if calls is None else np.repeat(calls[None], laps + 1, axis=0)
        expected = self.editor.edit(steps, each).raw
        for cause in GAPS:
            if not np.isnan(row[cause]):
                gaps = expected[:, COLUMN[CAUSES[cause]]]
                steps[:, cause] = np.maximum(gaps + (row[cause] - gaps[-1]) * np.linspace(0.0, 1.0, laps + 1), 0.0)
        steps[0, GAPS] = np.nan
        return [self.editor.edit(steps[:-1], None if each is None else each[:-1]).raw]

    def _laps_before(self, row: Floats) -> Floats:
        """Raw rows of the laps before the decision; those of the present stint are changed so that they lead to the edited race.

        Gaps that change at once open evenly over the stint; a change of the past holds in all of it.
        """
        history = self.moment.raw[:-1].copy()
        stops = self.moment.raw[:, COLUMN["stops_made"]]
        stint = history[int(np.flatnonzero(stops == stops[-1])[0]) :]
        at_once = np.isnan(row[CLOCKS]).all() and not np.isnan(row[GAPS]).all()
        if len(stint) and at_once:
            only_gaps = empty_rows(1)
            only_gaps[0, GAPS] = row[GAPS]
            shift = np.where(CONTINUOUS, self.editor.edit(only_gaps).raw[0] - self.moment.raw[-1], np.float32(0.0))
            stint += np.linspace(0.0, 1.0, len(stint) + 1, dtype=np.float32)[:-1, None] * shift
        if not np.isnan(row[OLDER]):
            _age(stint, float(row[OLDER]), self.moment)
        if not np.isnan(row[USED]):
            stint[:, COLUMN["valid_finish"]] = row[USED] - 1.0
        return history


def _age(rows: Floats, older: float, moment: Moment) -> None:
    """Make the set of these laps older, in place."""
    tyres = compile_figures(moment.record).tyres
    age, worn = COLUMN["tyre_age_laps"], COLUMN["tyre_degradation_s"]
    for row in rows:
        compound = int(row[COLUMN["tyre"]])
        row[worn] += lap_cost(tyres, compound, row[age] + older) - lap_cost(tyres, compound, row[age])
        row[age] += older
