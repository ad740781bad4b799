"""Why a stop was made on its lap and not before: what the policy itself says once a group of features is put back.

For each group of features the row of the stop is asked again with that group as it was on the last lap the policy
preferred to stay out. By how much that lowers the value of the stop against staying out is the group's part in it.
Parts are measured one at a time on the policy and need not add up.
"""

from typing import Final, NamedTuple

import numpy as np

from rsrl.explanation.policy import ExplainedPolicy
from rsrl.explanation.summary.driven import DrivenRace
from rsrl.explanation.summary.facts import BY_NAME, facts_of_a_stop, was_and_is
from rsrl.explanation.summary.laps import turning_lap
from rsrl.explanation.summary.wording import CALL_WORDS, Sentence, Teller, value_unit
from rsrl.season import COMPOUND_NAMES
from rsrl.state import ACTION_NAMES, COLUMN

LEAST_SHARE: Final = 0.15
"""A group is told where putting it back undoes at least this share of the change."""

MOST_GROUPS: Final = 2

EVEN_PLACES: Final = 0.02
"""Calls nearer to one another than this are called equal."""


class Part(NamedTuple):
    """A group of features, and by how much the stop is worth less against staying out with the group as it was before."""

    group: str
    part: float


def why_the_stop(policy: ExplainedPolicy, driven: DrivenRace, lap: int) -> list[Sentence]:
    """What the policy made of a stop, what tipped it, and the circumstances; sentences in that order."""
    call = int(driven.calls[lap - 1])
    seen = frozenset(one.name for one in policy.encoder(driven.record).features)
    tipped = _what_tipped_it(policy, driven, lap, call)
    facts = facts_of_a_stop(driven.raw[lap - 1], lap, call, seen)
    return [_worth(policy, driven, lap, call), *([tipped] if tipped else []), *facts]


def _worth(policy: ExplainedPolicy, driven: DrivenRace, lap: int, call: int) -> Sentence:
    t = Teller()
    q, legal = driven.q[lap - 1], driven.legal[lap - 1]
    text = f"on lap {t.lap(lap)} it boxes for {ACTION_NAMES[call].removeprefix('pit ')}"
    if not legal[call]:
        return t.sentence(f"{text}, which is not legal; this policy was trained without a mask.")
    others = sorted((a for a in range(4) if a != call and legal[a]), key=lambda a: -float(q[a]))
    if not others:
        return t.sentence(f"{text}, the only legal call.")
    unit = value_unit(policy)
    worth = [_above(t, q, lap, call, other, unit) for other in dict.fromkeys(([0] if legal[0] else []) + others[:1])]
    if unit == "places" and float(q[call]) - max(float(q[a]) for a in others) < EVEN_PLACES:
        worth.append("so as good as equal to the next best")
    rule = "" if legal[0] else "; staying out is not legal"
    return t.sentence(f"{text}, which it values {', '.join(worth)}{rule}.")


def _above(t: Teller, q: np.ndarray[tuple[int], np.dtype[np.float32]], lap: int, call: int, other: int, unit: str) -> str:
    column = f"q: {ACTION_NAMES[call]} - q: {ACTION_NAMES[other]}"
    return f"{t.worth(float(q[call]) - float(q[other]), lap, column)} {unit} above {CALL_WORDS[other]}"


def parts(policy: ExplainedPolicy, driven: DrivenRace, lap: int, before: int, call: int) -> list[Part]:
    """The part of each group of features in the change of `call` against staying out from lap `before` to `lap`, largest first."""
    encoder = policy.encoder(driven.record)
    groups: dict[str, list[int]] = {}
    for one in encoder.features:
        groups.setdefault(one.group, []).append(COLUMN[one.name])
    rows = np.repeat(driven.raw[None, :lap], len(groups) + 1, axis=0)
    for i, columns in enumerate(groups.values(), 1):
        rows[i, -1, columns] = driven.raw[before - 1, columns]
    if not policy.recurrent:
        rows = rows[:, -1:]
    encoded = encoder(rows.reshape(-1, rows.shape[2])).reshape(*rows.shape[:2], encoder.width)
    q = policy.q_of_sequences(encoded).astype(np.float64)
    worth = q[:, call] - q[:, 0]
    found = [Part(group, float(worth[0] - worth[i])) for i, group in enumerate(groups, 1)]
    return sorted(found, key=lambda one: -one.part)


def _what_tipped_it(policy: ExplainedPolicy, driven: DrivenRace, lap: int, call: int) -> Sentence | None:
    before = turning_lap(driven.for_a_stop(), lap)
    if before is None or not driven.legal[lap - 1, 0]:
        return None
    t = Teller()
    q = driven.q.astype(np.float64)
    change = (q[lap - 1, call] - q[lap - 1, 0]) - (q[before - 1, call] - q[before - 1, 0])
    unit = value_unit(policy)
    told = [
        f"{one.group}, {t.worth(one.part, lap, f'part of {one.group}')} {unit} ({_most_changed(t, policy, driven, one.group, lap, before)})"
        for one in parts(policy, driven, lap, before, call)[:MOST_GROUPS]
        if change > 0 and one.part >= LEAST_SHARE * change
    ]
    margin = f"{t.worth(-driven.for_a_stop()[before - 1], before, 'q: no pit - q: best stop')} {unit}"
    text = f"on lap {t.lap(before)} it still preferred staying out, by {margin}"
    if not told:
        return t.sentence(f"{text}; no single group of features makes the change.")
    return t.sentence(f"{text}; what makes the change, each put back alone on the policy: {'; '.join(told)}.")


def _most_changed(t: Teller, policy: ExplainedPolicy, driven: DrivenRace, group: str, lap: int, before: int) -> str:
    """The feature of a group whose scaled value changed most, then and now; those of compounds not boxed for left out."""
    encoder = policy.encoder(driven.record)
    now, then = encoder(driven.raw[[lap - 1]])[0], encoder(driven.raw[[before - 1]])[0]
    changes: dict[str, float] = {}
    for i, name in enumerate(encoder.names):
        own = name.partition("=")[0]
        changes[own] = max(changes.get(own, 0.0), abs(float(now[i] - then[i])))
    fitted = COMPOUND_NAMES[driven.calls[lap - 1] - 1]
    others = [f"_{name}_" for name in COMPOUND_NAMES if name != fitted]
    names = [one.name for one in encoder.features if one.group == group and not any(other in one.name for other in others)]
    name = max(names, key=lambda n: changes[n])
    return was_and_is(t, BY_NAME[name], driven.raw[before - 1], before, driven.raw[lap - 1], lap)
