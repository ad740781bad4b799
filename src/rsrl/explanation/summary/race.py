"""The summary of a race that the policy calls: the margin of every decision, the laps that mattered, the reasons of each stop."""

from typing import TYPE_CHECKING, Final

import numpy as np

from rsrl.drawing import COMPOUND_COLOURS, SERIES_COLOURS, STATUS_COLOURS
from rsrl.explanation.episodes import Episode, record_episode
from rsrl.explanation.policy import ExplainedPolicy
from rsrl.explanation.result import Explanation
from rsrl.explanation.summary.reasons import KeyLap, call_margins, key_laps, stop_advantage, why_the_stop
from rsrl.explanation.summary.state_warnings import state_warnings
from rsrl.explanation.summary.wording import CALL_WORDS, Sentence, SentenceBuilder, compound, documents, feature, status
from rsrl.season import COMPOUND_NAMES, SC, RaceRecord
from rsrl.state import ACTION_NAMES, Action

if TYPE_CHECKING:
    from matplotlib.axes import Axes

TYRE_COLOURS: Final = dict(zip(COMPOUND_NAMES, COMPOUND_COLOURS, strict=True))


class RaceSummary(Explanation):
    """An explanation with a row for each decision of a race, whose plot is the race lap by lap."""

    def plot(self, ax: "Axes | None" = None, rows: int = 12) -> "Axes":
        """Advantage of the best stop over staying out, lap by lap; stops as dots in the colour of their tyre, close calls hollow."""
        import matplotlib.pyplot as plt

        axes = plt.subplots(figsize=(8, 3.2), layout="constrained")[1] if ax is None else ax
        laps, worth = np.array(self.columns["lap"]), np.array(self.columns["for_a_stop"], np.float64)
        axes.plot(laps, worth, color=SERIES_COLOURS[0], linewidth=1.4)
        axes.axhline(0.0, color="black", linewidth=0.8)
        for lap, state in zip(laps, self.columns["status"], strict=True):
            if state != "green flag":
                axes.axvspan(lap - 0.5, lap + 0.5, color=STATUS_COLOURS[SC], linewidth=0, zorder=0)
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
    """Let the policy call a race, and summarise it.

    Rows are decisions. Values are their margins: the call's value less that of the best other legal call, NaN if there is none.
    `details["sentences"]` holds the lap, column and unrounded value of every number in every sentence. The decision of the result is the
    stop with the largest margin, or the closest call in a race without a stop.
    """
    episode = record_episode(policy, record, car, seed=seed, race=race)
    mattered = key_laps(episode)
    sentences = [_the_race(episode), *(s for lap in mattered for s in _told(policy, episode, lap))]
    key = _key_lap(episode, mattered)
    warnings = state_warnings(policy, episode.moment(key))
    return RaceSummary(
        method="summary",
        decision=policy.decide(episode.moment(key)),
        question=f"margin of each call of {record.cars[car].driver}'s race over the next best call",
        unit=policy.unit,
        labels=tuple(f"lap {lap}: {Action(int(episode.calls[lap - 1]))}" for lap in range(1, episode.laps + 1)),
        values=call_margins(episode),
        budget=episode.laps,
        columns=_columns(episode, mattered),
        details={
            "seed": seed,
            "race_number": race,
            "position": episode.position,
            "retired": episode.retired,
            "stops": [{"lap": lap.lap, "tyre": COMPOUND_NAMES[episode.calls[lap.lap - 1] - 1]} for lap in mattered if lap.why == "stop"],
            "mattered": [lap._asdict() for lap in mattered],
            "warnings": warnings,
            "sentences": documents(sentences),
        },
        sentences=tuple(sentence.text for sentence in sentences),
    )


def _columns(episode: Episode, mattered: list[KeyLap]) -> dict[str, list[object]]:
    why = dict(mattered)
    laps = range(1, episode.laps + 1)
    return {
        "lap": list(laps),
        "call": [ACTION_NAMES[call] for call in episode.calls],
        "for_a_stop": [float(value) for value in stop_advantage(episode)],
        "position": [int(feature(row, "position")) for row in episode.raw],
        "tyre": [compound(row) for row in episode.raw],
        "tyre_age_laps": [int(feature(row, "tyre_age_laps")) for row in episode.raw],
        "status": [status(row) for row in episode.raw],
        "mattered": [why.get(lap, "") for lap in laps],
    }


def _key_lap(episode: Episode, mattered: list[KeyLap]) -> int:
    margins = call_margins(episode)
    stops = [lap.lap for lap in mattered if lap.why == "stop" and np.isfinite(margins[lap.lap - 1])]
    if stops:
        return max(stops, key=lambda lap: margins[lap - 1])
    return int(np.argmin(np.where(np.isfinite(margins), np.abs(margins), np.inf))) + 1


def _the_race(episode: Episode) -> Sentence:
    t = SentenceBuilder()
    first, driver = episode.raw[0], episode.whole.record.cars[episode.whole.car].driver
    stops = [f"lap {t.lap(i + 1)} for {COMPOUND_NAMES[call - 1]}s" for i, call in enumerate(episode.calls) if call]
    boxes = f"boxes on {' and on '.join(stops)}" if stops else "makes no stop"
    last = episode.laps
    end = (
        f"retires on lap {t.lap(last)}" if episode.retired else f"finishes P{t.number(episode.position, last, 'finishing position', '.0f')}"
    )
    return t.sentence(f"{driver} starts P{t.feature(first, 1, 'position', '.0f')} on {compound(first)}s, {boxes}, and {end}.")


def _told(policy: ExplainedPolicy, episode: Episode, lap: KeyLap) -> list[Sentence]:
    if lap.why == "stop":
        return why_the_stop(policy, episode, lap.lap)
    t = SentenceBuilder()
    q, legal = episode.q[lap.lap - 1], episode.legal[lap.lap - 1]
    other = max((a for a in range(1, 4) if legal[a]), key=lambda a: float(q[a]), default=0)
    unit, column = policy.unit, f"q: no pit - q: {ACTION_NAMES[other]}"
    if not other or not legal[0]:
        return [t.sentence(f"on lap {t.lap(lap.lap)}, under the {status(episode.raw[lap.lap - 1])}, only one call is legal.")]
    margin = t.worth(float(q[0]) - float(q[other]), lap.lap, column)
    if lap.why == "close call":
        return [t.sentence(f"lap {t.lap(lap.lap)} is a close call: staying out is valued {margin} {unit} better than {CALL_WORDS[other]}.")]
    where = f"on lap {t.lap(lap.lap)}, under the {status(episode.raw[lap.lap - 1])}"
    return [t.sentence(f"{where}, the policy stays out, valued {margin} {unit} better than {CALL_WORDS[other]}.")]
