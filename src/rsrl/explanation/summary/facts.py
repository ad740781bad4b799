"""The circumstances of a stop in natural units, of features that the policy reads."""

from collections.abc import Callable
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rsrl.explanation.quantities import PERCENT, decimals, feature_text, with_unit
from rsrl.explanation.summary.wording import Sentence, SentenceBuilder, compound, feature, has_car, many, status
from rsrl.season import COMPOUND_NAMES, TRACK_STATUS_NAMES
from rsrl.state import FEATURES, Feature

Row = NDArray[np.float32]

EVEN_S: Final = 0.1
"""Expected times that differ by less than this count as equal."""

BY_NAME: Final = {one.name: one for one in FEATURES}


def facts_of_a_stop(row: Row, lap: int, call: int, seen: frozenset[str]) -> list[Sentence]:
    """Circumstances of boxing for compound `call` (1 soft ...) on a lap: tyres, cost, traffic, time, places.

    Args:
        row: raw features of the decision.
        seen: features the policy reads; others are not mentioned.
    """
    found = [fact(row, lap, COMPOUND_NAMES[call - 1], seen) for fact in FACTS]
    return [sentence for sentence in found if sentence is not None]


def _tyres(row: Row, lap: int, fitted: str, seen: frozenset[str]) -> Sentence | None:
    if not {"tyre", "tyre_degradation_s"} <= seen:
        return None
    t = SentenceBuilder()
    age = f" are {many(t.feature(row, lap, 'tyre_age_laps', '.0f'), 'lap')} old and" if "tyre_age_laps" in seen else ""
    return t.sentence(f"the {compound(row)}s{age} lose {t.feature(row, lap, 'tyre_degradation_s', '.2f')} s a lap to wear.")


def _cost(row: Row, lap: int, fitted: str, seen: frozenset[str]) -> Sentence | None:
    if "pit_cost_s" not in seen:
        return None
    t = SentenceBuilder()
    text = f"a stop on this lap costs {t.feature(row, lap, 'pit_cost_s')} s"
    if feature(row, "safety_car") and "pit_loss_s" in seen:
        text += f", under the {status(row)}, instead of {t.feature(row, lap, 'pit_loss_s')} s on a racing lap,"
    if "pit_cost_places" in seen:
        text += f" and {many(t.feature(row, lap, 'pit_cost_places', '.0f'), 'place')} on track"
    return t.sentence(text + ".")


def _traffic(row: Row, lap: int, fitted: str, seen: frozenset[str]) -> Sentence | None:
    if not {"rejoin_gap_ahead_s", "rejoin_gap_behind_s"} <= seen:
        return None
    t = SentenceBuilder()
    ahead, behind = feature(row, "rejoin_gap_ahead_s"), feature(row, "rejoin_gap_behind_s")
    text = f"{t.feature(row, lap, 'rejoin_gap_ahead_s')} s behind the car ahead" if has_car(ahead) else "with nobody ahead"
    text += f" and {t.feature(row, lap, 'rejoin_gap_behind_s')} s in front of the next" if has_car(behind) else " and with nobody behind"
    if "cars_at_rejoin" in seen and has_car(ahead):
        text += f", with {many(t.feature(row, lap, 'cars_at_rejoin', '.0f'), 'car')} within four seconds ahead"
    return t.sentence(f"the car rejoins {text}.")


def _time(row: Row, lap: int, fitted: str, seen: frozenset[str]) -> Sentence | None:
    """Expected time to the flag if the policy reads it, else the time on an empty track."""
    kind = next((k for k in ("expected", "outlook") if f"{k}_stay_s" in seen), None)
    if kind is None:
        return None
    t = SentenceBuilder()
    stay, box = f"{kind}_stay_s", f"{kind}_{fitted}_s"
    track = "allowing for safety cars" if kind == "expected" else "on an empty track"
    difference = feature(row, stay) - feature(row, box)
    side = "neither for nor against" if abs(difference) < EVEN_S else "for" if difference > 0 else "against"
    return t.sentence(
        f"the expected time to the flag, {track}, is {side} the stop: staying out loses {t.feature(row, lap, stay)} s to the best call, "
        f"boxing for {fitted} {t.feature(row, lap, box)} s."
    )


def _places(row: Row, lap: int, fitted: str, seen: frozenset[str]) -> Sentence | None:
    name = f"projected_{fitted}_places"
    if not {"projected_place", name} <= seen:
        return None
    t = SentenceBuilder()
    change = feature(row, name)
    if not round(change, 1):
        effect = "costs no place"
    elif change > 0:
        effect = f"costs {t.feature(row, lap, name)} places"
    else:
        effect = f"gains {t.number(-change, lap, name, '.1f')} places"
    return t.sentence(f"the projected finish is P{t.feature(row, lap, 'projected_place')}; the stop {effect} in that projection.")


FACTS: Final[tuple[Callable[[Row, int, str, frozenset[str]], Sentence | None], ...]] = (_tyres, _cost, _traffic, _time, _places)


def was_and_is(t: SentenceBuilder, one: Feature, before: Row, before_lap: int, row: Row, lap: int) -> str:
    """A feature now and on an earlier lap: `gap to the car one place ahead: 1.2 s, was 4.5`."""
    if one.kind == "category":
        names = [_category(one, feature(r, one.name)) for r in (row, before)]
        return f"{feature_text(one)}: {names[0]}, was {names[1]}"
    if one.kind == "boolean":
        return f"{feature_text(one)}: {'yes' if feature(row, one.name) else 'no'}"
    now, then = (_number(t, one, r, at) for r, at in ((row, lap), (before, before_lap)))
    return f"{feature_text(one)}: {with_unit(now, one.unit)}, was {then}"


def _number(t: SentenceBuilder, one: Feature, row: Row, lap: int) -> str:
    value = feature(row, one.name)
    if "gap" in one.name and one.name != "gap_to_leader_s" and not has_car(value):
        return "no car"
    if one.unit in PERCENT:
        return t.number(100.0 * value, lap, f"{one.name}, %", ".1f")
    return t.number(value, lap, one.name, f".{decimals(one, value)}f")


def _category(one: Feature, code: float) -> str:
    name = one.categories[int(code)]
    return {TRACK_STATUS_NAMES[0]: "none", TRACK_STATUS_NAMES[1]: "virtual", TRACK_STATUS_NAMES[2]: "full"}.get(name, name)
