"""What spoke for and against a stop, told of the features the policy sees, in natural units."""

from collections.abc import Callable
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rsrl.explanation.quantities import PERCENT, decimals, feature_text, with_unit
from rsrl.explanation.summary.wording import Sentence, Teller, compound, feature, has_car, many, status
from rsrl.season import COMPOUND_NAMES, TRACK_STATUS_NAMES
from rsrl.state import FEATURES, Feature

Row = NDArray[np.float32]

EVEN_S: Final = 0.1
"""Expected times nearer to one another than this are called even."""

BY_NAME: Final = {one.name: one for one in FEATURES}


def facts_of_a_stop(row: Row, lap: int, call: int, seen: frozenset[str]) -> list[Sentence]:
    """Circumstances of boxing for compound `call` (1 soft ...) on a lap: tyres, cost, traffic, time, places.

    Args:
        row: raw features of the decision.
        seen: features the policy reads; nothing is told of others.
    """
    told = [teller(row, lap, COMPOUND_NAMES[call - 1], seen) for teller in FACTS]
    return [sentence for sentence in told if sentence is not None]


def _tyres(row: Row, lap: int, fitted: str, seen: frozenset[str]) -> Sentence | None:
    if not {"tyre", "tyre_degradation_s"} <= seen:
        return None
    t = Teller()
    age = f" are {many(t.feature(row, lap, 'tyre_age_laps', '.0f'), 'lap')} old and" if "tyre_age_laps" in seen else ""
    return t.sentence(f"the {compound(row)}s fitted{age} lose {t.feature(row, lap, 'tyre_degradation_s', '.2f')} s a lap to wear.")


def _cost(row: Row, lap: int, fitted: str, seen: frozenset[str]) -> Sentence | None:
    if "pit_cost_s" not in seen:
        return None
    t = Teller()
    text = f"a stop costs {t.feature(row, lap, 'pit_cost_s')} s on this lap"
    if feature(row, "safety_car") and "pit_loss_s" in seen:
        text += f", under the {status(row)}, against {t.feature(row, lap, 'pit_loss_s')} s on a racing lap"
    if "pit_cost_places" in seen:
        text += f", and {many(t.feature(row, lap, 'pit_cost_places', '.0f'), 'place')} at once"
    return t.sentence(text + ".")


def _traffic(row: Row, lap: int, fitted: str, seen: frozenset[str]) -> Sentence | None:
    if not {"rejoin_gap_ahead_s", "rejoin_gap_behind_s"} <= seen:
        return None
    t = Teller()
    ahead, behind = feature(row, "rejoin_gap_ahead_s"), feature(row, "rejoin_gap_behind_s")
    text = f"{t.feature(row, lap, 'rejoin_gap_ahead_s')} s behind the car ahead" if has_car(ahead) else "with nobody ahead"
    text += f" and {t.feature(row, lap, 'rejoin_gap_behind_s')} s in front of the next" if has_car(behind) else " and with nobody behind"
    if "cars_at_rejoin" in seen and has_car(ahead):
        text += f", {many(t.feature(row, lap, 'cars_at_rejoin', '.0f'), 'car')} within four seconds ahead"
    return t.sentence(f"it rejoins {text}.")


def _time(row: Row, lap: int, fitted: str, seen: frozenset[str]) -> Sentence | None:
    """Expected time where the policy sees it, else that of an empty track."""
    kind = next((k for k in ("expected", "outlook") if f"{k}_stay_s" in seen), None)
    if kind is None:
        return None
    t = Teller()
    stay, box = f"{kind}_stay_s", f"{kind}_{fitted}_s"
    way = "with safety cars in sight" if kind == "expected" else "on an empty track"
    difference = feature(row, stay) - feature(row, box)
    speaks = "neither for nor against the stop" if abs(difference) < EVEN_S else f"{'for' if difference > 0 else 'against'} the stop"
    return t.sentence(
        f"expected time to the flag, {way}, speaks {speaks}: staying out loses {t.feature(row, lap, stay)} s against the best call, "
        f"boxing for {fitted} {t.feature(row, lap, box)} s."
    )


def _places(row: Row, lap: int, fitted: str, seen: frozenset[str]) -> Sentence | None:
    name = f"projected_{fitted}_places"
    if not {"projected_place", name} <= seen:
        return None
    t = Teller()
    change = feature(row, name)
    if not round(change, 1):
        told = "the stop costs no place"
    elif change > 0:
        told = (
            f"the stop costs {t.feature(row, lap, name)} of a place" if change < 1 else f"the stop costs {t.feature(row, lap, name)} places"
        )
    else:
        told = f"the stop gains {t.number(-change, lap, name, '.1f')} places"
    return t.sentence(f"the place projected at the flag is P{t.feature(row, lap, 'projected_place')}; {told} in that projection.")


FACTS: Final[tuple[Callable[[Row, int, str, frozenset[str]], Sentence | None], ...]] = (_tyres, _cost, _traffic, _time, _places)


def was_and_is(t: Teller, one: Feature, before: Row, before_lap: int, row: Row, lap: int) -> str:
    """A feature now and on an earlier lap: `gap to the car one place ahead: now 1.2 s, was 4.5`."""
    if one.kind == "category":
        names = [_category(one, feature(r, one.name)) for r in (row, before)]
        return f"{feature_text(one)}: now {names[0]}, was {names[1]}"
    if one.kind == "boolean":
        return f"{feature_text(one)}: {'yes' if feature(row, one.name) else 'no'}"
    now, then = (_number(t, one, r, at) for r, at in ((row, lap), (before, before_lap)))
    return f"{feature_text(one)}: now {with_unit(now, one.unit)}, was {then}"


def _number(t: Teller, one: Feature, row: Row, lap: int) -> str:
    value = feature(row, one.name)
    if "gap" in one.name and one.name != "gap_to_leader_s" and not has_car(value):
        return "no car"
    if one.unit in PERCENT:
        return t.number(100.0 * value, lap, f"{one.name}, %", ".1f")
    return t.number(value, lap, one.name, f".{decimals(one, value)}f")


def _category(one: Feature, code: float) -> str:
    name = one.categories[int(code)]
    return {TRACK_STATUS_NAMES[0]: "none", TRACK_STATUS_NAMES[1]: "virtual", TRACK_STATUS_NAMES[2]: "full"}.get(name, name)
