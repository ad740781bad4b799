"""Tables of README and docs, made from the result files so that no number is typed by hand.

    python benchmarks/tables.py            # write every table anew
    python benchmarks/tables.py --check    # say which are out of date, and exit with 1

A table stands between `<!-- table: NAME -->` and `<!-- end -->`; `TABLES` has its function. benchmarks/remake.sh makes the result files.
"""

import argparse
import json
import re
import sys
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from audit_tables import TABLES as AUDIT_TABLES
from backtest_tables import ablations, backtest, forecast_seasons
from plan_tables import plan_races, plans
from season_tables import TABLES as SEASON_TABLES
from table_text import interval, markdown, over_tracks

ROOT = Path(__file__).parents[1]
RESULTS = ROOT / "benchmarks" / "results"
BLOCK = re.compile(r"(<!-- table: ([\w-]+) -->\n)(.*?)(<!-- end -->)", re.DOTALL)

FORMER_SEARCH = ("generalise", "held-out-and-cars", "planner-1s", "seeds-bahrain-2023")
"""Files older than the present strategist `search`: their rows of that name are of another one, and are left out."""

TUNED_ON = ("japan-2023", "bahrain-2023", "singapore-2023")
"""Races on which the constants of `search` were measured."""

ABOUT = {
    "hindsight": "best plan knowing each race's luck (a bound)",
    "planner": "Monte Carlo rollouts on every lap",
    "search": "`all` with rollouts where its call is close",
    "rsrl": "`bahrain-2023`, trained for this race",
    "rsrl all": "`all`, trained for every race and car",
    "all": "policy trained on 28 races",
    "tree": "decision tree of `all`",
    "dp": "dynamic programming, not trained",
    "heuristic": "rules of the pit wall",
    "best-plan-sc": "best plan and safety-car rule, brute force",
    "best-plan": "best plan, brute force",
    "fixed": "a published strategy at random",
    "imitation": "calls as real teams made them",
}


@cache
def result(name: str) -> Any:
    """A result file, without the rows of the former `search`."""
    content = json.loads((RESULTS / f"{name}.json").read_text(encoding="utf-8"))
    return _without_search(content) if name in FORMER_SEARCH else content


def _without_search(item: Any) -> Any:
    if isinstance(item, dict):
        return {key: _without_search(value) for key, value in item.items()}
    if isinstance(item, list):
        return [_without_search(one) for one in item if not (isinstance(one, dict) and one.get("strategist") == "search")]
    return item


def _share(value: float) -> str:
    return f"{100 * value:.0f} %"


def _described(name: str) -> str:
    return f"`{name}`: {ABOUT[name]}" if name in ABOUT and not name.startswith("rsrl") else ABOUT.get(name, f"`{name}`")


def evaluation(file: str) -> str:
    """The leaderboard of `rsrl evaluate`."""
    rows = result(file)["rows"]
    gap = rows[0]["gap_closed"] is not None
    heads = ["strategist", "mean position", "places behind the model [95 %]", *(["gap closed"] if gap else []), "points", "stops"]
    return markdown(
        heads,
        [
            [
                _described(r["strategist"]),
                f"{r['mean_position']:.2f}",
                interval(r["difference"], r["difference_ci95"]) if r["difference"] else "",
                *([_share(r["gap_closed"])] if gap else []),
                f"{r['mean_points']:.2f}",
                f"{r['mean_stops']:.2f}",
            ]
            for r in rows
        ],
    )


def fresh_seed() -> str:
    """16,384 races of a seed on which nothing was chosen, to three digits."""
    rows = result("leaderboard-fresh-seed")["rows"]
    cells = [
        [
            _described(r["strategist"]),
            f"{r['mean_position']:.3f}",
            interval(r["difference"], r["difference_ci95"], 3) if r["difference"] else "",
        ]
        for r in rows
    ]
    return markdown(["strategist", "mean position", "places behind the model [95 %]"], cells)


def training_seeds() -> str:
    """Places behind the mean of several training seeds."""
    files = {"`bahrain-2023`, 5 seeds": "seeds-bahrain-2023", "`all`, 3 seeds": "seeds-all"}
    told = {label: result(file)["aggregate"] for label, file in files.items()}
    names = [c["strategist"] for c in told["`all`, 3 seeds"]["comparisons"]]
    rows = [["mean position of the seeds", *(f"{a['mean_position']:.2f}" for a in told.values())]]
    for name in names:
        compared = [next(c for c in a["comparisons"] if c["strategist"] == name) for a in told.values()]
        rows.append([f"`{name}` behind", *(interval(c["difference"], c["difference_ci95"], 3) for c in compared)])
    return markdown(["", *told], rows)


def _by_race(file: str) -> tuple[list[Any], dict[tuple[str, str], Any]]:
    tracks = result(file)["tracks"]
    return tracks["races"], {(r["strategist"], r["race"]): r for r in tracks["table"]}


def _averages(file: str) -> dict[tuple[str, str], Any]:
    return {(r["strategist"], r["over"]): r for r in result(file)["tracks"]["averages"]}


STUDY_ORDER = ("hindsight", "search", "planner", "all", "all-1", "all-2", "rsrl-9", "rsrl-2", "rsrl-1", "dp", "heuristic", "best-plan-sc",
               "best-plan", "fixed", "imitation")  # fmt: skip


def fourteen_tracks() -> str:
    """Table 3 of the paper: mean positions by track."""
    races, newer = _by_race("generalise-search")
    _, older = _by_race("generalise")
    averages = _averages("generalise") | _averages("generalise-search")
    rows = []
    for name in STUDY_ORDER:
        cells = [f"`{name}`"]
        for race in races:
            one = newer.get((name, race["race"])) or older.get((name, race["race"]))
            text = f"{one['mean_position']:.2f}" if one else ""
            cells.append(f"<u>{text}</u>" if one and one["trained"] else text)
        for over in ("seen", "unseen", "all"):
            average = averages[name, over]
            fewer = average["tracks"] < averages["all", over]["tracks"]
            cells.append(f"{average['mean_position']:.2f}" + (f" ({average['tracks']})" if fewer else ""))
        rows.append(cells)
    return markdown(["", *(r["code"] for r in races), "seen", "unseen", "all"], rows)


def behind_all() -> str:
    """Places behind the policy `all` over the tracks of the study."""
    told: dict[tuple[str, str], Any] = {}
    for file in ("generalise", "generalise-search"):
        told |= {(r["strategist"], r["race"]): r for r in result(file)["tracks"]["differences"]}
    gaps = {r["strategist"]: r for r in result("generalise-search")["tracks"]["gap_closed"] if r["race"] == "all"}
    rows = []
    for name in STUDY_ORDER:
        if name != "all":
            cells = [interval(told[name, over]["difference"], told[name, over]["ci95"], 3) for over in ("all", "seen", "unseen")]
            rows.append([f"`{name}`", *cells, _share(gaps[name]["share"]) if name in gaps else ""])
    return markdown(["behind `all`", "14 tracks", "9 trained on", "5 not trained on", "gap closed"], rows)


def search_split() -> str:
    """`search` on the tracks its constants were measured on, and elsewhere."""
    races, table = _by_race("generalise-search")
    rows = []
    for label, chosen in (
        ("Japan, Bahrain, Singapore: its constants were measured there", [r["race"] for r in races if r["race"] in TUNED_ON]),
        ("the other 11 tracks", [r["race"] for r in races if r["race"] not in TUNED_ON]),
    ):
        cells = []
        for other in ("planner", "dp"):
            apart = [table[other, race]["mean_position"] - table["search", race]["mean_position"] for race in chosen]
            cells.append(interval(*over_tracks(apart), 3) if len(chosen) > len(TUNED_ON) else f"{np.mean(apart):+.3f}")
        rows.append([label, *cells])
    return markdown(["`search` ahead of", "`planner`", "`dp`"], rows)


def elsewhere() -> str:
    """Policies on the tracks they did not train on, against the untrained calls that they started from."""
    races, table = _by_race("generalise")
    rows = []
    for name in ("rsrl-1", "rsrl-2", "rsrl-9", "all"):
        unseen = [r["race"] for r in races if not table[name, r["race"]]["trained"]]
        apart = [table[name, race]["mean_position"] - table["dp", race]["mean_position"] for race in unseen]
        rows.append([f"`{name}`", str(len(unseen)), interval(*over_tracks(apart), 3)])
    return markdown(["policy", "tracks not trained on", "places behind `dp` there [95 %, over tracks]"], rows)


def reasonable() -> str:
    """Tracks at which the commonest strategy is reasonable by the paper's criteria."""
    criteria = result("generalise-search")["tracks"]["criteria"]
    rows = []
    for name in ("search", "planner", "all", "dp", "heuristic"):
        mine = [c for c in criteria if c["strategist"] == name]
        parts = ("few_stops", "harder_longer", "like_or_better", "reasonable")
        rows.append([f"`{name}`", *(f"{sum(bool(c[p]) for c in mine)} of {len(mine)}" for p in parts)])
    return markdown(["", "one to three stops", "hardest set longest", "like a common one, or better", "all three"], rows)


def held_out() -> str:
    """The dry races of 2024, and every car of two races."""
    document = result("held-out-and-cars")
    held = {r["strategist"]: r for r in document["held_out"]["differences"] if r["race"] == "all"}
    cars = {(r["race"], r["strategist"]): r for r in document["cars"]}
    rows = []
    for name, told in held.items():
        of = [cars[race, name] for race in ("bahrain-2023", "spain-2023")]
        counts = [f"{c['surely_ahead']} of {c['cars']} ({c['surely_behind']})" for c in of]
        rows.append([f"`{name}`", interval(told["difference"], told["ci95"]), *counts])
    heads = ["behind `all`", "21 dry races of 2024", "cars of Bahrain 2023 for which `all` is ahead (behind)", "of Spain 2023"]
    return markdown(heads, rows)


def robustness() -> str:
    """Other rivals, and figures that are off."""
    rows = []
    for row in result("robustness")["rows"]:
        against = {a["strategist"]: interval(a["difference"], a["difference_ci95"]) for a in row["against"]}
        rows.append([row["rivals"], f"{row['scale']:.0f}", f"{row['mean_position']:.2f}", against["heuristic"], against["dp"]])
    return markdown(["rivals", "standard errors", "`all`", "`heuristic` behind", "`dp` behind"], rows)


def explanations() -> str:
    """Goals of the explanations, the paper's figure and ours."""
    goals = result("explanations")["goals"]
    values = [f"{g['value']:.3g}{' by construction' if g['by_construction'] else ''}" for g in goals]
    rows = [[g["method"], g["what"], g["paper"] or "", value] for g, value in zip(goals, values, strict=True)]
    return markdown(["method", "figure", "the paper", "here"], rows)


def speed() -> str:
    """`rsrl bench`."""
    two, one = result("bench"), result("bench-one-core")
    rows = [
        ["races a second", f"{one['simulator']['races_per_s']:,.0f}", f"{two['simulator']['races_per_s']:,.0f}"],
        ["environment steps a second", f"{one['environment']['steps_per_s']:,.0f}", ""],
        ["training branches a second", f"{one['training']['branches_per_s']:,.0f}", f"{two['training']['branches_per_s']:,.0f}"],
        ["a decision of the policy, ms", f"{one['decision']['ms']:.3f}", ""],
        ["peak memory, MB", f"{one['simulator']['peak_memory_mb']:.0f}", f"{two['simulator']['peak_memory_mb']:.0f}"],
    ]
    return markdown(["", "one core", "two cores"], rows)


def readme_results() -> str:
    """Six strategists over 14 tracks, for the reader of the README."""
    averages = _averages("generalise-search")
    told = {r["strategist"]: r for r in result("generalise-search")["tracks"]["differences"] if r["race"] == "all"}
    rows = []
    for name in ("search", "planner", "all", "dp", "heuristic", "fixed"):
        average = averages[name, "all"]
        behind = interval(told[name]["difference"], told[name]["ci95"], 3) if name != "all" else ""
        rows.append([_described(name), f"{average['mean_position']:.2f}", behind])
    return markdown(["strategist", "mean position", "places behind `all` [95 %]"], rows)


def season() -> str:
    """2023 simulated with its own season files: the mean over the races, real and simulated."""
    rows = result("season-2023")["rows"]
    names = {
        "stops": "stops a car",
        "one_stop": "cars with one stop",
        "two_stops": "with two",
        "three_stops": "with three or more",
        "sc_laps": "laps under a safety car",
        "vsc_laps": "under a virtual one",
        "passes": "passes",
        "retirements": "retirements",
    }
    cells = []
    for name, words in names.items():
        real = np.array([row["real"][name] for row in rows])
        apart = np.array([row["simulated"][name][0] for row in rows]) - real
        known = ~np.isnan(apart)
        cells.append([words, f"{real[known].mean():.2f}", f"{(real + apart)[known].mean():.2f}", interval(*over_tracks(apart[known]))])
    return markdown(["a race", "real", "simulated", "difference [95 %]"], cells)


def rival_scores() -> str:
    """The model of rivals' calls on 2024, against two simpler ones."""
    overall = result("rivals")["overall"]
    rows = []
    for key, words, digits in (
        ("logloss", "log-loss of a call", 4),
        ("first_stop_mae", "first stop, mean error in laps", 2),
        ("first_stop_within_3", "share of first stops within 3 laps", 3),
        ("stops_mae", "mean stops of a race, mean error", 2),
    ):
        one = overall[key]
        ends = one["model_less_plans_ci95"]
        low, high = (f"{end:+.{digits}f}" for end in ends)
        rows.append([words, *(f"{one[who]:.{digits}f}" for who in ("model", "constant", "plans")), f"[{low}, {high}]"])
    return markdown(["2024, dry", "model", "constant odds", "plans", "model less plans [95 %]"], rows)


def worth_of_thinking() -> str:
    """Places won a race by rollouts, by the most futures a decision may take."""
    rows = []
    for race, parts in result("worth-of-thinking")["tracks"].items():
        for part, words in (("racing", "racing laps"), ("slow", "behind safety cars")):
            one = parts[part]
            won = [f"{f['places_won_a_race']:.3f} ± {f['half_width']:.3f}" for f in one["by_futures"].values()]
            rows.append([f"{race}, {words}", f"{one['network_sd']:.2f}", f"{one['future_sd']:.2f}", *won])
    futures = next(iter(result("worth-of-thinking")["tracks"].values()))["racing"]["by_futures"]
    return markdown(["", "error of the network, places", "spread of a future", *futures], rows)


TABLES: dict[str, Callable[[], str]] = {
    "readme-results": readme_results,
    "bahrain": lambda: evaluation("leaderboard-bahrain-2023"),
    "fresh-seed": fresh_seed,
    "training-seeds": training_seeds,
    "planner-1s": lambda: evaluation("planner-1s"),
    "paper-agents": lambda: evaluation("leaderboard-paper-agents"),
    "fourteen-tracks": fourteen_tracks,
    "behind-all": behind_all,
    "search-split": search_split,
    "elsewhere": elsewhere,
    "reasonable": reasonable,
    "held-out": held_out,
    "robustness": robustness,
    "explanations": explanations,
    "speed": speed,
    "plans-2024": lambda: plans(2024),
    "plans-2023": lambda: plans(2023),
    "plans-2025": lambda: plans(2025),
    "plan-races-2024": lambda: plan_races(2024),
    "backtest-2024": lambda: backtest(2024),
    "backtest-2023": lambda: backtest(2023),
    "forecast-seasons": forecast_seasons,
    "ablations": ablations,
    "season": season,
    "rivals": rival_scores,
    "worth-of-thinking": worth_of_thinking,
    **SEASON_TABLES,
    **AUDIT_TABLES,
}


def documents() -> list[Path]:
    """README and every page of docs."""
    return [ROOT / "README.md", *sorted(p for p in (ROOT / "docs").rglob("*.md") if not {"_build", "packages"} & set(p.parts))]


def filled(text: str) -> str:
    """`text` with every table made anew."""
    return BLOCK.sub(lambda match: match[1] + TABLES[match[2]]() + match[4], text)


def main() -> int:
    """Write or check every table; returns the exit code."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--check", action="store_true", help="write nothing; exit with 1 if a table is out of date")
    check = parser.parse_args().check
    stale = [path for path in documents() if filled(path.read_text(encoding="utf-8")) != path.read_text(encoding="utf-8")]
    for path in stale:
        print(f"{'out of date' if check else 'written'}: {path.relative_to(ROOT)}", file=sys.stderr)
        if not check:
            path.write_text(filled(path.read_text(encoding="utf-8")), encoding="utf-8")
    return 1 if check and stale else 0


if __name__ == "__main__":
    raise SystemExit(main())
