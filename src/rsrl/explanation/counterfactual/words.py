"""Counterfactuals in words: what has to be otherwise, from what to what, and the sentence that says so."""

from typing import Final

from rsrl.explanation.counterfactual.change import CAUSE
from rsrl.explanation.counterfactual.refining import FARTHEST_S, Counterfactual
from rsrl.season import COMPOUND_NAMES, TRACK_STATUS_NAMES
from rsrl.state import Action

LABELS: Final = {
    "laps_later": ("laps from now", "laps"),
    "laps_called": ("laps from now, called by the policy", "laps"),
    "time_lost_s": ("time lost", "s"),
    "gap_ahead_s": ("gap ahead", "s"),
    "gap_behind_s": ("gap behind", "s"),
    "track_status": ("track status", ""),
    "compounds_used": ("compounds used", ""),
    "laps_older": ("age of the set beyond its own", "laps"),
    "boxed_ahead": ("the car ahead has just boxed", ""),
    "boxed_behind": ("the car behind has just boxed", ""),
    "soft_sets": ("sets of softs left", "sets"),
    "medium_sets": ("sets of mediums left", "sets"),
    "hard_sets": ("sets of hards left", "sets"),
}
NUMBERS: Final = ("no", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine", "ten", "eleven", "twelve")
UNDER: Final = ("on a green track", "under a virtual safety car", "under a safety car")


def table_of(found: Counterfactual) -> dict[str, list[object]]:
    """Rows of the result: the cause, where it starts from, what it becomes, how it is meant, its unit."""
    rows: dict[str, list[object]] = {"cause": [], "from": [], "to": [], "condition": [], "unit": []}
    for cause in found.change.parts:
        start, end = found.starts[CAUSE[cause]], float(found.row[CAUSE[cause]])
        named = cause == "track_status"
        rows["cause"].append(cause)
        rows["from"].append(TRACK_STATUS_NAMES[int(start)] if named else round(float(start), 1))
        rows["to"].append(TRACK_STATUS_NAMES[int(end)] if named else round(end, 1))
        rows["condition"].append(_condition(found, cause))
        rows["unit"].append(LABELS[cause][1])
    return rows


def _condition(found: Counterfactual, cause: str) -> str:
    """Of a gap: how far the call holds beyond its value; of anything else "exactly"."""
    if cause not in found.holds_s:
        return "exactly"
    value, start, end = float(found.row[CAUSE[cause]]), found.starts[CAUSE[cause]], found.holds_s[cause]
    if value > start:
        return "at least" if end >= FARTHEST_S else f"up to {end:.1f}"
    return "at most" if end <= 0.0 else f"down to {end:.1f}"


def _gap(found: Counterfactual, cause: str, name: str) -> str:
    start = float(found.starts[CAUSE[cause]])
    then = "expected then" if found.change.laps else "now"
    return f"with the gap {name} {_seconds(found, cause)} ({start:.1f} s {then})"


def _seconds(found: Counterfactual, cause: str) -> str:
    """A value and how far beyond it the call holds."""
    value, start, end = float(found.row[CAUSE[cause]]), float(found.starts[CAUSE[cause]]), found.holds_s[cause]
    if value > start:
        return f"{value:.1f} s or more" if end >= FARTHEST_S else f"{value:.1f} to {end:.1f} s"
    return f"{value:.1f} s or less" if end <= 0.0 else f"{end:.1f} to {value:.1f} s"


def _laps(n: int) -> str:
    return f"{NUMBERS[n] if n < len(NUMBERS) else n} lap{'s' if n != 1 else ''}"


def clauses(found: Counterfactual, driver: str) -> list[str]:
    """The conditions of a counterfactual, in the order in which they are said."""
    c, words = found.change, []
    if c.laps:
        words.append(f"{_laps(c.laps)} from now" + (_after(found.on_the_way) if c.laps_called else ""))
    if c.time_lost_s is not None:
        words.append(f"having lost {_seconds(found, 'time_lost_s')}")
    if c.track_status is not None:
        words.append(UNDER[int(c.track_status)])
    if c.gap_ahead_s is not None:
        words.append(_gap(found, "gap_ahead_s", "ahead"))
    if c.gap_behind_s is not None:
        words.append(_gap(found, "gap_behind_s", "behind"))
    if c.laps_older is not None:
        words.append(f"had the set been {_laps(int(c.laps_older))} older")
    if c.compounds_used is not None:
        words.append("had only one compound been used so far" if c.compounds_used == 1 else "had two compounds been used by now")
    words += [f"had the car {side} of {driver} just boxed" for side in ("ahead", "behind") if f"boxed_{side}" in c.parts]
    for name, sets in zip(COMPOUND_NAMES, (c.soft_sets, c.medium_sets, c.hard_sets), strict=True):
        if sets is not None:
            words.append(f"had {'a' if sets else 'no'} set of {name}s been left")
    return words


def sentence_of(found: Counterfactual, target: Action, driver: str) -> str:
    """One sentence, each number of which was put to the policy."""
    words = clauses(found, driver)
    joined = words[0] if len(words) == 1 else ", ".join(words[:-1]) + " and " + words[-1] if len(words) > 2 else " ".join(words)
    joined = joined.replace(",,", ",").removesuffix(",")
    ending = _waiting(found) + ("" if found.legal[0] else "; the rules leave no choice but a stop there")
    return f"{str(target).capitalize()} would {'be' if found.change.reachable else 'have been'} called {joined}{ending}."


def _after(stops: tuple[tuple[int, int], ...]) -> str:
    """The policy's own stops on the way."""
    made = [f"for {COMPOUND_NAMES[call - 1]} {'in ' + _laps(n) if n else 'now'}" for n, call in stops]
    return f", after boxing {' and '.join(made)}," if made else ""


def _waiting(found: Counterfactual) -> str:
    """That one would have to stay out for it, against the policy's own call on the way."""
    if not found.change.laps_later or not found.on_the_way:
        return ""
    n, call = found.on_the_way[0]
    when = f"would be called {_laps(n)} from now" if n else "is called now"
    return f", were the car still out then: {Action(call)} {when}"


def labels_of(found: Counterfactual) -> tuple[str, ...]:
    """Names of the rows."""
    return tuple(LABELS[cause][0] for cause in found.change.parts)


def leaf_sentence(report: dict[str, object] | None, target: Action) -> str:
    """What the tree alone would say, and whether it is to be believed."""
    if report is None:
        return f"The tree has no leaf that can be reached from here in which it says to {target}."
    verdict = "the policy itself does not confirm it"
    if report["confirmed_consistent"]:
        verdict = "the policy confirms it"
    elif report["confirmed_on_last_lap"]:
        verdict = "the policy confirms it only as long as nothing that follows from it is computed anew"
    elif not report["names_a_cause"]:
        verdict = "it changes nothing by itself, only what would follow from a change, and the policy does not confirm it"
    n = int(str(report["features_changed"]))
    if n == 0:
        return f"The tree already says to {target} here, which the policy does not."
    return f"The tree's nearest such leaf is {n} feature{'s' if n != 1 else ''} and a distance of {report['distance']:.3f} away; {verdict}."
