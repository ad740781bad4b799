"""Tables of the scripts that hold season files against real races; their results are in benchmarks/results."""

import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TypeVar

from table_text import markdown

from rsrl.results import (
    BetterPlansResult,
    Domination,
    Interval,
    LateLapsResult,
    MeanInterval,
    Number,
    OwnPlansResult,
    PassesRatio,
    PassesResult,
    PublishedResult,
    RanSequence,
    Result,
    known,
    read_result,
)

RESULTS = Path(__file__).parent / "results"
T = TypeVar("T", bound=Result)


def passes_table(result: PassesResult) -> str:
    """Passes by season: real, with the real stops, with rivals that decide; simulated ones with their ratio to real ones."""
    heads = ("dry races", "races", "real", "with the real stops", "ratio [95 %]", "rivals decide", "ratio [95 %]")
    rows = [[s.season, str(s.races), f"{s.real:.1f}", *_passes(s.real_stops), *_passes(s.rivals_decide)] for s in result.seasons]
    return markdown(heads, rows)


def _passes(simulated: PassesRatio) -> tuple[str, str]:
    ratio = math.nan if simulated.ratio is None else simulated.ratio
    return f"{simulated.passes:.1f}", f"{ratio:.2f} {ends(simulated.ci95)}".strip()


def ends(ci95: Interval, digits: int = 2, sign: str = "") -> str:
    """Both ends of an interval in brackets; nothing where they cannot be told."""
    both = known(ci95)
    return "" if both is None else f"[{both[0]:{sign}.{digits}f}, {both[1]:{sign}.{digits}f}]"


SHARES = {
    "start_match": "starts on the field's commonest starting tyre",
    "compounds_match": "has its commonest set of compounds, order left out",
    "sequence_match": "has its commonest sequence",
    "stops_match": "stops as often",
}
AMOUNTS = {
    "regret_s": "the commonest sequence loses to it, s (median)",
    "regret_places": "and places (median)",
    "behind_quickest_s": "the commonest sequence loses to the quickest plan, s (median)",
    "first_stop_bias_laps": "first stop of the commonest sequence, laps later than the cars",
    "first_stop_error_laps": "its error, laps",
}
ORDER = {
    "dominated": "a compound that is quicker when fresh than another and wears no more",
    "dominated_by_softer": "the softer one of the two",
    "dominated_by_harder": "the harder one of the two",
}
SIGNS = {"regret_s": "under {:g}", "dominated": "at most {:.0%}"}


def own_plans_tables(result: OwnPlansResult) -> str:
    """All tables of `benchmarks/own_race_plans.py`."""
    return "\n".join([own_plans(result), own_plan_races(result), tyre_order(result)])


def own_plans(result: OwnPlansResult) -> str:
    """Agreement of the best plans with the field, in the race and on an empty track, and the goals."""
    rows = []
    for name, words in (SHARES | AMOUNTS | ORDER).items():
        goal = SIGNS.get(name, "at least {:.0%}").format(result.goals[name]) if name in result.goals else ""
        cells = [_measure(result.overall.get(key), name in AMOUNTS) for key in (name, f"clean_air_{name}")]
        rows.append([words, *cells, goal])
    whole = sum(r.apart is None for r in result.races)
    heads = (f"best plan, {len(result.races)} races ({whole} with plans)", "in the race [95 %]", "on an empty track [95 %]", "goal")
    return markdown(heads, rows)


def _measure(value: MeanInterval | None, amount: bool) -> str:
    if value is None:
        return ""
    both = (value.low, value.high)
    return f"{value.mean:.2f} {ends(both)}" if amount else f"{value.mean:.0%} [{both[0]:.0%}, {both[1]:.0%}]"


def own_plan_races(result: OwnPlansResult) -> str:
    """Race by race: what most cars ran, the best plans of three cars, and what the commonest sequence loses."""
    rows = []
    for race in result.races:
        ran = f"{race.ran} ({race.ran_cars} of {race.own_cars})" if race.ran else "-"
        best = ", ".join(f"{car.best} (P{car.grid} {car.driver})" for car in race.cars)
        scores = [_number(race.scores[name]) for name in ("regret_places", "regret_s", "behind_quickest_s")]
        rows.append([race.race, f"{race.start} ({race.starts} of {race.started})", ran, best, race.clean_air_best, *scores])
    heads = (
        "",
        "most started on",
        "most ran",
        "best for",
        "best on an empty track",
        "regret, places",
        "regret, s",
        "behind the quickest, s",
    )
    return markdown(heads, rows)


def tyre_order(result: OwnPlansResult) -> str:
    """Pairs of compounds without an order, with what their season file says."""
    rows = []
    for race in result.races:
        for pair in race.dominations:
            fresh, wear = (f"{v:.{n}f} ± {se:.{n}f}" for v, se, n in _leads(pair))
            rows.append([race.race, f"{pair.better} over {pair.worse}", fresh, wear, pair.reason])
    return markdown(("", "compounds", "quicker fresh, s ± se", "less wear, s a lap ± se", "figures and what they rest on"), rows)


def _leads(pair: Domination) -> list[tuple[float, float, int]]:
    return [(pair.fresh_s, pair.fresh_se, 2), (pair.wear_s_per_lap, pair.wear_se, 3)]


def _number(value: Number) -> str:
    return "" if value is None or math.isnan(value) else f"{value:.2f}"


def better_plans(result: BetterPlansResult) -> str:
    """Races in which another sequence would have been better, by the gain, with why; above them how many were asked about."""
    clear = sorted((r for r in result.races if r.clear), key=lambda r: -r.gain_s)
    rows = [
        [
            r.race,
            f"{r.ran} ({r.ran_cars} of {r.own_cars})",
            f"{r.better} for {r.commonest} (P{r.grid} {r.driver})",
            f"{r.gain_s:+.1f} {ends(r.gain_s_ci95, 1, '+')}",
            f"{r.gain_places:+.1f} {ends(r.gain_places_ci95, 1, '+')}",
            r.why,
        ]
        for r in clear
    ]
    heads = (f"{len(clear)} of {len(result.races)} races", "most ran", "better", "gain, s [95 %]", "gain, places [95 %]", "why")
    return markdown(heads, rows)


def published_tables(result: PublishedResult) -> str:
    """Both tables of `benchmarks/published_plans.py`."""
    return "\n".join([published_plans(result), published_agreement(result)])


def published_plans(result: PublishedResult) -> str:
    """Race by race: the plan of `rsrl plan`, published strategies, and what the top ten ran."""
    rows = []
    for race in result.races:
        windows = ", ".join(f"{first}-{last}" for first, last in race.windows)
        best = f"{race.best} ({race.driver}; laps {windows}; best {race.p_best:.0%})"
        following = f"{race.next_best} ({race.behind_places:+.2f})"
        rows.append([race.race, best, following, ", ".join(race.published), _ran(race.top_ten)])
    heads = ("", "`rsrl plan`", "next, places behind", "published", "top ten, median stops")
    return markdown(heads, rows)


def published_agreement(result: PublishedResult) -> str:
    """How often plans agree with the commonest choice of the top ten."""
    parts = ("start", "compounds", "sequence", "stops")
    rows = [[name, *(_measure(result.overall.get(f"{key}_{part}"), False) for part in parts)] for name, key in WHOSE]
    return markdown((f"as the top ten's commonest, {len(result.races)} races", *parts), rows)


WHOSE = (("`rsrl plan`", "plan"), ("first published", "published"))


def _ran(sequences: Sequence[RanSequence]) -> str:
    """Sequences with their stops, those of one car each together; how many of the stops were made behind a safety car."""
    told = [f"{r.cars} {r.sequence} ({', '.join(map(str, r.stop_laps))})" for r in sequences if r.cars > 1]
    alone = [r.sequence for r in sequences if r.cars == 1]
    slow, made = sum(r.slow_stops for r in sequences), sum(r.cars * len(r.stop_laps) for r in sequences)
    told += [f"1 each: {', '.join(alone)}"] if alone else []
    return "; ".join(told) + (f"; {slow} of {made} stops behind a safety car" if slow else "")


def late_laps_table(result: LateLapsResult) -> str:
    """Errors of laps on old tyres and on younger ones, with and without choices."""
    rows = []
    for part, words in (("late", f"beyond the {100 * result.late_share:.0f}th percentile of ages"), ("early", "before")):
        laps = sum(getattr(race, f"{part}_laps") for race in result.races)
        cells = [result.overall[f"{part}_{name}"] for name in ("s", "lap_times_s", "less_s")]
        goal = f"{result.goals['late_s']:.2f}" if part == "late" else "no worse"
        told = [f"{v.mean:{sign}.3f} {ends((v.low, v.high), 3, sign)}" for v, sign in zip(cells, ("", "", "+"), strict=True)]
        rows.append([words, str(laps), *told, goal])
    heads = (f"{result.test}, {len(result.races)} races", "laps", "laps and choices, s", "lap times alone, s", "difference, s", "goal, s")
    return markdown(heads, rows)


def _read(name: str, kind: type[T]) -> T:
    return read_result(RESULTS / f"{name}.json", kind, "benchmarks/backtest.sh")


TABLES: dict[str, Callable[[], str]] = {
    "passes": lambda: passes_table(_read("passes", PassesResult)),
    "own-plans": lambda: own_plans(_read("own-race-plans", OwnPlansResult)),
    "own-plan-races": lambda: own_plan_races(_read("own-race-plans", OwnPlansResult)),
    "tyre-order": lambda: tyre_order(_read("own-race-plans", OwnPlansResult)),
    "published-plans": lambda: published_plans(_read("published-plans", PublishedResult)),
    "published-agreement": lambda: published_agreement(_read("published-plans", PublishedResult)),
    "late-laps": lambda: late_laps_table(_read("late-laps", LateLapsResult)),
}
"""Tables of docs that are made here, by name."""
