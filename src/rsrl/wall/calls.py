"""The call of a car from a look at the race: at once what the policy says, then what its futures say."""

import time
from typing import Any, Final, Literal

from rsrl.explanation import AnyPolicy, Decision, ExplainedPolicy, Explanation, Moment, explain_what_if, state_warnings
from rsrl.state import ACTION_NAMES, Action, Observer
from rsrl.wall.ahead import Ahead
from rsrl.wall.card import card
from rsrl.wall.messages import CALLS, CallMessage, Finish, Interval, Marks, OptionValue, Training
from rsrl.wall.pit_window import gap_chart, pit_loss, window
from rsrl.wall.race_log import Look

CALL_FUTURES: Final = 400
"""Futures of each legal call; the explanation that is asked for runs more."""

MARKS: Final[Marks] = {
    "options.value": "derived",
    "options.places": "derived",
    "options.time_s": "derived",
    "finish": "derived",
    "gaps.gap_s": "measured",
    "gaps.pace_s": "derived",
    "pit_loss": "derived",
    "rejoin": "derived",
    "duels": "derived",
    "duels.stops": "assumed",
    "odds": "derived",
    "window": "derived",
    "card": "derived",
    "training": "derived",
}

Stage = Literal["policy", "full"]


class Caller:
    """Makes the calls of one session; slow, for a thread of its own.

    Args:
        seed: of the futures: 0 for a race that is not simulated, so that the same state has the same figures.
    """

    def __init__(self, session: str, policy: AnyPolicy, seed: int) -> None:
        self._session, self._policy, self._seed = session, policy, seed
        self._observers: dict[int, Observer] = {}
        self._unit = policy.unit if isinstance(policy, ExplainedPolicy) else ""

    def observer(self, moment: Moment) -> Observer:
        """The observer of a moment's car, made once."""
        if moment.car not in self._observers:
            self._observers[moment.car] = Observer(moment.record, moment.car)
        return self._observers[moment.car]

    def call(self, driver: str, look: Look, stage: Stage) -> CallMessage:
        """The call for a look."""
        begun = time.perf_counter()
        common: dict[str, Any] = {
            "session": self._session,
            "driver": driver,
            "lap": look.lap,
            "look": look.number,
            "stage": stage,
            "time_s": look.time_s,
            "why": look.why,
            "status": look.status,
            "model": self._policy.name,
            "value_unit": self._unit,
            "missing": look.missing,
            "marks": MARKS | {f"state.{name}": mark for name, mark in look.marks.items()},
        }
        if look.moment is None:
            return CallMessage(**common | {"stage": "full"}, call=None, words="no call", reason=look.reason)
        moment = look.moment()
        decided = self._policy.decide(moment)
        made = ACTION_NAMES.index(decided.call)
        common |= {"call": CALLS[made], "words": str(Action(made)), "options": _options(decided, moment, made)}
        common |= self._of_moment(moment)
        if stage == "full":
            common |= self._of_futures(moment, made)
        return CallMessage(**common, took_ms=round(1000 * (time.perf_counter() - begun), 1))

    def _of_moment(self, moment: Moment) -> dict[str, Any]:
        observer = self.observer(moment)
        return {"gaps": gap_chart(moment, observer), "pit_loss": pit_loss(observer), "window": window(moment, observer)}

    def _training(self, moment: Moment) -> Training | None:
        """How far outside training a state is; None for a policy of which nothing is known."""
        if not isinstance(self._policy, ExplainedPolicy):
            return None
        notes = tuple(state_warnings(self._policy, moment))
        figures = len(self._policy.encoder(moment.record).features)
        return Training(share=round(len(notes) / figures, 3), figures=figures, notes=notes)

    def _of_futures(self, moment: Moment, made: int) -> dict[str, Any]:
        found = explain_what_if(self._policy, moment, races=CALL_FUTURES, seed=self._seed, horizon_laps=0)
        options = tuple(self._valued(found, i, moment) for i in range(len(found.labels)))
        parts: dict[str, Any] = {"options": options, "futures": CALL_FUTURES, "finish": _finish(found)}
        if len(options) > 1:
            best = min(options[1:], key=lambda option: option.places.mean if option.places else 0.0)
            parts |= {"versus": best.call, "lead": best.places, "no_difference": best.verdict in ("equal", "undecided")}
        observer = self.observer(moment)
        ahead = Ahead(moment, observer, self._seed)
        stops = [call for call in (1, 2, 3) if moment.legal[call]]
        stop = made or (self._policy.preferred(moment, stops) if stops else 0)
        return parts | {
            "rejoin": ahead.rejoin(stop) if stop else None,
            "duels": ahead.duels(stop) if stop else (),
            "odds": ahead.odds(),
            "training": self._training(moment),
            "card": card(self._policy, moment, observer, self._seed),
        }

    def _valued(self, found: Explanation, i: int, moment: Moment) -> OptionValue:
        column = {name: values[i] for name, values in found.columns.items()}
        itself = column["verdict"] == "itself"
        value = found.decision.q_values.get(ACTION_NAMES[column["call"]])
        return OptionValue(
            call=CALLS[column["call"]],
            label=str(Action(column["call"])),
            value=None if value is None else round(value, 3),
            places=None if itself else _interval(float(found.values[i]), column["low"], column["high"]),
            points=None if itself else _interval(column["points"], column["points_low"], column["points_high"]),
            time_s=round(column["time_s"], 2),
            better=None if itself else round(column["chance_gain"], 3),
            worse=None if itself else round(column["chance_lose"], 3),
            mean_position=round(column["mean_position"], 3),
            verdict=column["verdict"],
        )


def _options(decided: Decision, moment: Moment, made: int) -> tuple[OptionValue, ...]:
    """The legal calls with the policy's values, its own first."""
    legal = [made, *(a for a in range(4) if moment.legal[a] and a != made)]
    values = {a: decided.q_values.get(ACTION_NAMES[a]) for a in legal}
    return tuple(
        OptionValue(call=CALLS[a], label=str(Action(a)), value=None if value is None else round(value, 3)) for a, value in values.items()
    )


def _finish(found: Explanation) -> Finish:
    """Finishing positions under the policy's call, the first option."""
    shares = tuple(round(float(share), 4) for share in found.details["positions"][0])
    return Finish(shares=shares, mean=round(found.columns["mean_position"][0], 3), finished=round(found.details["finished"][0], 3))


def _interval(mean: float, low: float, high: float) -> Interval:
    return Interval(mean=round(mean, 3), low=round(low, 3), high=round(high, 3))
