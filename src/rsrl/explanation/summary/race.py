"""The summary of a race that the policy calls: margin of every decision, laps that mattered, why each stop was made."""

from typing import TYPE_CHECKING, Final

import numpy as np

from rsrl.explanation.policy import ExplainedPolicy
from rsrl.explanation.result import Explanation
from rsrl.explanation.summary.driven import DrivenRace, drive
from rsrl.explanation.summary.laps import LapThatMattered, laps_that_mattered
from rsrl.explanation.summary.reasons import why_the_stop
from rsrl.explanation.summary.usual import state_warnings
from rsrl.explanation.summary.wording import CALL_WORDS, Sentence, Teller, compound, documents, feature, status, value_unit
from rsrl.season import COMPOUND_NAMES, RaceRecord
from rsrl.state import ACTION_NAMES, Action

if TYPE_CHECKING:
    from matplotlib.axes import Axes

TYRE_COLOURS: Final = {"soft": "#c8102e", "medium": "#d99a00", "hard": "#6b7480"}


class RaceSummary(Explanation):
    """An explanation with a row for each decision of a race, whose plot is the race lap by lap."""

    def plot(self, ax: "Axes | None" = None, rows: int = 12) -> "Axes":
        """How much better the best stop was than staying out, lap by lap; stops as dots of their tyre's colour, close calls hollow."""
        import matplotlib.pyplot as plt

        axes = plt.subplots(figsize=(8, 3.2), layout="constrained")[1] if ax is None else ax
        laps, worth = np.array(self.columns["lap"]), np.array(self.columns["for_a_stop"], np.float64)
        axes.plot(laps, worth, color="#12406b", linewidth=1.4)
        axes.axhline(0.0, color="black", linewidth=0.8)
        for lap, state in zip(laps, self.columns["status"], strict=True):
            if state != "green flag":
                axes.axvspan(lap - 0.5, lap + 0.5, color="#f2c14e", alpha=0.4, linewidth=0)
        for i, why in enumerate(self.columns["mattered"]):
            if why in ("stop", "close call"):
                colour = TYRE_COLOURS.get(self.columns["call"][i].removeprefix("pit "), "#ffffff")
                height = worth[i] if np.isfinite(worth[i]) else 0.0
                axes.plot(laps[i], height, "o", markersize=7, color=colour, markeredgecolor="black")
        axes.set_xlabel("lap")
        axes.set_ylabel(f"best stop over staying out, {self.unit}")
        axes.set_title(self.question, loc="left", fontsize=10)
        return axes


def summarise_race(policy: ExplainedPolicy, record: RaceRecord, car: int, *, seed: int = 0, race: int = 0) -> RaceSummary:
    """Let the policy call a race and tell it.

    Rows are decisions, values their margins: the call's value less that of the best other legal call, not a number where
    there is none. `details["sentences"]` holds for each sentence the lap, column and unrounded value of its every number.
    The decision explained is the stop whose margin is largest, in a race without one the closest call.
    """
    driven = drive(policy, record, car, seed=seed, race=race)
    mattered = laps_that_mattered(driven)
    sentences = [_the_race(driven), *(s for lap in mattered for s in _told(policy, driven, lap))]
    key = _key_lap(driven, mattered)
    warnings = state_warnings(policy, driven.moment(key))
    return RaceSummary(
        method="summary",
        decision=policy.decide(driven.moment(key)),
        question=f"how much better each call of {record.cars[car].driver}'s race was than the next best, {value_unit(policy)}",
        unit=value_unit(policy),
        labels=tuple(f"lap {lap}: {Action(int(driven.calls[lap - 1]))}" for lap in range(1, driven.laps + 1)),
        values=driven.margins(),
        budget=driven.laps,
        columns=_columns(driven, mattered),
        details={
            "seed": seed,
            "race_number": race,
            "position": driven.position,
            "retired": driven.retired,
            "stops": [{"lap": lap.lap, "tyre": COMPOUND_NAMES[driven.calls[lap.lap - 1] - 1]} for lap in mattered if lap.why == "stop"],
            "mattered": [lap._asdict() for lap in mattered],
            "warnings": warnings,
            "sentences": documents(sentences),
        },
        sentences=tuple(sentence.text for sentence in sentences),
    )


def _columns(driven: DrivenRace, mattered: list[LapThatMattered]) -> dict[str, list[object]]:
    why = dict(mattered)
    laps = range(1, driven.laps + 1)
    return {
        "lap": list(laps),
        "call": [ACTION_NAMES[call] for call in driven.calls],
        "for_a_stop": [float(value) for value in driven.for_a_stop()],
        "position": [int(feature(row, "position")) for row in driven.raw],
        "tyre": [compound(row) for row in driven.raw],
        "tyre_age_laps": [int(feature(row, "tyre_age_laps")) for row in driven.raw],
        "status": [status(row) for row in driven.raw],
        "mattered": [why.get(lap, "") for lap in laps],
    }


def _key_lap(driven: DrivenRace, mattered: list[LapThatMattered]) -> int:
    margins = driven.margins()
    stops = [lap.lap for lap in mattered if lap.why == "stop" and np.isfinite(margins[lap.lap - 1])]
    if stops:
        return max(stops, key=lambda lap: margins[lap - 1])
    return int(np.argmin(np.where(np.isfinite(margins), np.abs(margins), np.inf))) + 1


def _the_race(driven: DrivenRace) -> Sentence:
    t = Teller()
    first, driver = driven.raw[0], driven.record.cars[driven.car].driver
    stops = [f"lap {t.lap(i + 1)} for {COMPOUND_NAMES[call - 1]}s" for i, call in enumerate(driven.calls) if call]
    boxes = f"boxes on {' and on '.join(stops)}" if stops else "makes no stop"
    last = driven.laps
    end = f"retires on lap {t.lap(last)}" if driven.retired else f"finishes P{t.number(driven.position, last, 'finishing position', '.0f')}"
    return t.sentence(f"{driver} starts P{t.feature(first, 1, 'position', '.0f')} on {compound(first)}s, {boxes}, and {end}.")


def _told(policy: ExplainedPolicy, driven: DrivenRace, lap: LapThatMattered) -> list[Sentence]:
    if lap.why == "stop":
        return why_the_stop(policy, driven, lap.lap)
    t = Teller()
    q, legal = driven.q[lap.lap - 1], driven.legal[lap.lap - 1]
    other = max((a for a in range(1, 4) if legal[a]), key=lambda a: float(q[a]), default=0)
    unit, column = value_unit(policy), f"q: no pit - q: {ACTION_NAMES[other]}"
    if not other or not legal[0]:
        return [t.sentence(f"on lap {t.lap(lap.lap)}, under the {status(driven.raw[lap.lap - 1])}, it has no choice.")]
    margin = t.worth(float(q[0]) - float(q[other]), lap.lap, column)
    if lap.why == "close call":
        return [t.sentence(f"lap {t.lap(lap.lap)} is a close call: staying out is worth {margin} {unit} more than {CALL_WORDS[other]}.")]
    where = f"on lap {t.lap(lap.lap)} the {status(driven.raw[lap.lap - 1])} is out"
    return [t.sentence(f"{where} and it stays out all the same, worth {margin} {unit} more than {CALL_WORDS[other]}.")]
