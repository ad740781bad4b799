"""Which laps of a race mattered, and why each stop was made on its lap and not before.

For a stop, each group of features in turn is set back to its values on the last lap on which the policy preferred to stay out, and the
policy is asked again. How much that lowers the value of the stop over staying out is the effect of that group. Effects are measured one
group at a time and need not add up.
"""

from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rsrl.explanation.episodes import Episode
from rsrl.explanation.policy import ExplainedPolicy
from rsrl.explanation.summary.facts import BY_NAME, facts_of_a_stop, was_and_is
from rsrl.explanation.summary.wording import CALL_WORDS, Sentence, SentenceBuilder
from rsrl.season import COMPOUND_NAMES
from rsrl.state import ACTION_NAMES, COLUMN

CLOSE_SHARE: Final = 0.25
"""A call is close if its margin is at most this share of the race's median margin."""

APART_LAPS: Final = 3
"""Of close calls within this many laps of one another, or of a stop, only the closest is reported."""

MOST_CLOSE: Final = 3

LEAST_SHARE: Final = 0.15
"""A group is reported if setting it back undoes at least this share of the change."""

MOST_GROUPS: Final = 2

EVEN_PLACES: Final = 0.02
"""Calls whose values differ by less than this are called practically equal."""


def call_margins(episode: Episode) -> NDArray[np.float64]:
    """Value of each call less that of the best other legal one, [T]; NaN where no other was legal."""
    steps = np.arange(episode.laps)
    others = episode.legal.copy()
    others[steps, episode.calls] = False
    return _above_best(episode.q[steps, episode.calls], episode.q, others)


def stop_advantage(episode: Episode) -> NDArray[np.float64]:
    """Value of the best legal stop less that of staying out, [T]; NaN where either is not legal."""
    stops = episode.legal & episode.legal[:, :1]
    stops[:, 0] = False
    return -_above_best(episode.q[:, 0], episode.q, stops)


def _above_best(own: NDArray[np.float32], q: NDArray[np.float32], others: NDArray[np.bool_]) -> NDArray[np.float64]:
    """`own` [T] less the best of `others` [T, 4]; NaN where there are none."""
    best = np.where(others, q.astype(np.float64), -np.inf).max(axis=1)
    return np.where(others.any(axis=1), own.astype(np.float64) - best, np.nan)


class KeyLap(NamedTuple):
    """A lap, 1 for the first, and why it mattered: "stop", "close call" or "safety car"."""

    lap: int
    why: str


def key_laps(episode: Episode) -> list[KeyLap]:
    """Stops, first laps of safety cars, and close calls, in the order of the race."""
    stops = [lap for lap in range(1, episode.laps + 1) if episode.calls[lap - 1]]
    found = dict.fromkeys(stops, "stop")
    for lap in _neutralised(episode):
        found.setdefault(lap, "safety car")
    for lap in _close_calls(episode, stops):
        found.setdefault(lap, "close call")
    return [KeyLap(lap, found[lap]) for lap in sorted(found)]


def _neutralised(episode: Episode) -> list[int]:
    """Laps on which a safety car or a virtual one came out, or one turned into the other, and more than one call was legal."""
    status = episode.raw[:, COLUMN["safety_car"]].astype(int)
    return [i + 1 for i in range(episode.laps) if status[i] and (i == 0 or status[i - 1] != status[i]) and episode.legal[i].sum() > 1]


def _close_calls(episode: Episode, stops: list[int]) -> list[int]:
    """Laps without a stop on which a stop was nearly as good: the closest of each neighbourhood, none near a stop."""
    margins = call_margins(episode)
    known = np.isfinite(margins)
    if not known.any():
        return []
    limit = CLOSE_SHARE * float(np.median(margins[known]))
    chosen: list[int] = []
    for i in np.argsort(np.where(known, margins, np.inf), kind="stable"):
        lap = int(i) + 1
        near = any(abs(lap - other) <= APART_LAPS for other in (*stops, *chosen))
        if known[i] and 0 <= margins[i] <= limit and not episode.calls[i] and not near and len(chosen) < MOST_CLOSE:
            chosen.append(lap)
    return chosen


def turning_lap(advantage: NDArray[np.float64], lap: int) -> int | None:
    """The last lap before `lap` on which staying out was preferred; None where there is none."""
    for earlier in range(lap - 1, 0, -1):
        if advantage[earlier - 1] < 0:
            return earlier
    return None


class GroupEffect(NamedTuple):
    """A group of features, and how much the value of the stop over staying out falls when the group is set back."""

    group: str
    effect: float


def why_the_stop(policy: ExplainedPolicy, episode: Episode, lap: int) -> list[Sentence]:
    """Sentences on a stop: its value, what changed the call, and the circumstances."""
    call = int(episode.calls[lap - 1])
    seen = frozenset(one.name for one in policy.encoder(episode.whole.record).features)
    change = _what_changed_it(policy, episode, lap, call)
    facts = facts_of_a_stop(episode.raw[lap - 1], lap, call, seen)
    return [_worth(policy, episode, lap, call), *([change] if change else []), *facts]


def _worth(policy: ExplainedPolicy, episode: Episode, lap: int, call: int) -> Sentence:
    t = SentenceBuilder()
    q, legal = episode.q[lap - 1], episode.legal[lap - 1]
    text = f"on lap {t.lap(lap)} the policy boxes for {ACTION_NAMES[call].removeprefix('pit ')}"
    if not legal[call]:
        return t.sentence(f"{text}, which is not legal; this policy was trained without an action mask.")
    others = sorted((a for a in range(4) if a != call and legal[a]), key=lambda a: -float(q[a]))
    if not others:
        return t.sentence(f"{text}, the only legal call.")
    unit = policy.unit
    worth = [_above(t, q, lap, call, other, unit) for other in dict.fromkeys(([0] if legal[0] else []) + others[:1])]
    if unit == "places" and float(q[call]) - max(float(q[a]) for a in others) < EVEN_PLACES:
        worth.append("practically equal to the next best")
    rule = "" if legal[0] else "; staying out is not legal"
    return t.sentence(f"{text}, valued {', '.join(worth)}{rule}.")


def _above(t: SentenceBuilder, q: np.ndarray[tuple[int], np.dtype[np.float32]], lap: int, call: int, other: int, unit: str) -> str:
    column = f"q: {ACTION_NAMES[call]} - q: {ACTION_NAMES[other]}"
    return f"{t.worth(float(q[call]) - float(q[other]), lap, column)} {unit} better than {CALL_WORDS[other]}"


def group_effects(policy: ExplainedPolicy, episode: Episode, lap: int, before: int, call: int) -> list[GroupEffect]:
    """Effect of each group of features on the value of `call` over staying out, from lap `before` to `lap`; largest first."""
    encoder = policy.encoder(episode.whole.record)
    groups: dict[str, list[int]] = {}
    for one in encoder.features:
        groups.setdefault(one.group, []).append(COLUMN[one.name])
    rows = np.repeat(episode.raw[None, :lap], len(groups) + 1, axis=0)
    for i, columns in enumerate(groups.values(), 1):
        rows[i, -1, columns] = episode.raw[before - 1, columns]
    if not policy.recurrent:
        rows = rows[:, -1:]
    encoded = encoder(rows.reshape(-1, rows.shape[2])).reshape(*rows.shape[:2], encoder.width)
    q = policy.q_of_sequences(encoded).astype(np.float64)
    worth = q[:, call] - q[:, 0]
    found = [GroupEffect(group, float(worth[0] - worth[i])) for i, group in enumerate(groups, 1)]
    return sorted(found, key=lambda one: -one.effect)


def _what_changed_it(policy: ExplainedPolicy, episode: Episode, lap: int, call: int) -> Sentence | None:
    before = turning_lap(stop_advantage(episode), lap)
    if before is None or not episode.legal[lap - 1, 0]:
        return None
    t = SentenceBuilder()
    q = episode.q.astype(np.float64)
    change = (q[lap - 1, call] - q[lap - 1, 0]) - (q[before - 1, call] - q[before - 1, 0])
    unit = policy.unit
    causes = [
        f"{group}: {t.worth(effect, lap, f'effect of {group}')} {unit} ({_most_changed(t, policy, episode, group, lap, before)})"
        for group, effect in group_effects(policy, episode, lap, before, call)[:MOST_GROUPS]
        if change > 0 and effect >= LEAST_SHARE * change
    ]
    margin = f"{t.worth(-stop_advantage(episode)[before - 1], before, 'q: no pit - q: best stop')} {unit}"
    text = f"on lap {t.lap(before)} staying out was still better, by {margin}"
    if not causes:
        return t.sentence(f"{text}; no single group of features explains the change.")
    return t.sentence(f"{text}; the change comes mainly from {' and '.join(causes)}.")


def _most_changed(t: SentenceBuilder, policy: ExplainedPolicy, episode: Episode, group: str, lap: int, before: int) -> str:
    """The feature of a group whose scaled value changed most, now and before; features of the compounds not fitted are left out."""
    encoder = policy.encoder(episode.whole.record)
    now, then = encoder(episode.raw[[lap - 1]])[0], encoder(episode.raw[[before - 1]])[0]
    changes: dict[str, float] = {}
    for i, name in enumerate(encoder.names):
        own = name.partition("=")[0]
        changes[own] = max(changes.get(own, 0.0), abs(float(now[i] - then[i])))
    fitted = COMPOUND_NAMES[episode.calls[lap - 1] - 1]
    others = [f"_{name}_" for name in COMPOUND_NAMES if name != fitted]
    names = [one.name for one in encoder.features if one.group == group and not any(other in one.name for other in others)]
    name = max(names, key=lambda n: changes[n])
    return was_and_is(t, BY_NAME[name], episode.raw[before - 1], before, episode.raw[lap - 1], lap)
