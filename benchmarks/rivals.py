"""The model of real decisions to box, against constant odds and against plans: fitted to some seasons, scored on a later one.

python benchmarks/rivals.py --laps LAPS_FOLDER --facts FACTS_FOLDER

Every test race is forecast from the fit seasons and the test season's earlier rounds; coefficients come from the fit seasons alone.
First stops are simulated on one neutral race (the shipped Bahrain 2023) with the test race's distance and forecast rivals.
"""

import argparse
import sys
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

import numpy as np
import polars as pl
from numpy.typing import NDArray
from scipy.special import ndtr

from rsrl.calibration.entry import RaceEntry
from rsrl.calibration.race_facts import race_facts
from rsrl.calibration.rivals.decisions import RaceDecisions, race_decisions
from rsrl.calibration.rivals.features import is_young, usual_stint
from rsrl.calibration.rivals.model import RivalModel, expectation, fit_rival_model, hazard_design, rival_figures
from rsrl.cli.files import write_json
from rsrl.cli.provenance import provenance
from rsrl.errors import RsrlError
from rsrl.laps import RACE, read_seasons
from rsrl.results import RivalMeasure, RivalsOverall, RivalsRace, RivalsResult, to_json
from rsrl.season import GREEN, SC, RaceRecord, RivalFigures, load_race
from rsrl.simulator import Plan, RaceBatch, compile_figures
from rsrl.simulator import layout as at
from rsrl.statistics import bootstrap_over_races

Matrix = NDArray[np.float64]
SETS: Final = {"S": 3, "M": 2, "H": 2}
LEAST: Final = 1e-4  # odds of a decision are clipped to this, for every model
NODES: Final = 9
NEAR_LAPS: Final = 3
COMPARED = ("model", "constant", "plans")


@dataclass(frozen=True)
class Scores:
    """Of one race, by model: log-loss of each decision, error of each first stop in laps, mean stops; and the real mean stops."""

    name: str
    calls: dict[str, Matrix]
    firsts: dict[str, Matrix]
    stops: dict[str, float]
    real_stops: float


def entry_of(race: RaceDecisions) -> RaceEntry:
    """What is known of a race beforehand; neither its event nor its starters matter to the model."""
    return RaceEntry(**vars(race.key), event="", wet=False, starters=(), max_laps_per_set=0, sets=SETS)


def model_odds(model: RivalModel, race: RaceDecisions, figures: RivalFigures, young_rate: float) -> Matrix:
    """Probability of each decision by the model, averaged over how fast tyres may wear in the race."""
    outlook = expectation(model, race.key)
    spread = min(f.se / f.value for f in figures.life_laps.values())
    nodes, weights = np.polynomial.hermite_e.hermegauss(NODES)
    total = np.zeros(race.rows.height)
    for node, weight in zip(nodes, weights / weights.sum(), strict=True):
        at_wear = replace(outlook, stint_laps=outlook.stint_laps * np.exp(-node * spread))
        odds = 1 / (1 + np.exp(-hazard_design(race.rows, at_wear) @ model.hazard))
        young = is_young(race.rows, np.broadcast_to(at_wear.stint_laps, (race.rows.height, 2, 3)))
        total += weight * np.where(young, young_rate, odds)
    return total


def plan_odds(race: RaceDecisions, figures: RivalFigures) -> Matrix:
    """Probability of each decision by plans: normal about the planned lap; within the window of a safety car, the reaction to it."""
    plans = [(Plan.parse(p.plan), p.weight) for p in figures.plans]
    sd = max(figures.jitter_sd_laps.value, 0.5)
    odds = np.zeros(race.rows.height)
    columns = race.rows.select("start", "made", "lap", "status", "since")
    for i, (start, made, lap, status, since) in enumerate(columns.iter_rows()):
        usable = [(p, w) for p, w in plans if p.compounds[0] == start] or plans
        total = sum(w for _, w in usable)
        for plan, weight in usable:
            if made >= plan.stops:
                continue
            z = (lap + np.array([-0.5, 0.5]) - plan.laps[made]) / sd
            chance = float((ndtr(z[1]) - ndtr(z[0])) / max(1 - ndtr(z[0]), 1e-6))
            if status != GREEN and since == 0:
                sc = status == SC
                window = (figures.sc_window_laps if sc else figures.vsc_window_laps).value
                if plan.laps[made] - lap <= window:
                    chance = max(chance, (figures.sc_reaction if sc else figures.vsc_reaction).value)
            odds[i] += weight / total * chance
    return odds


def log_loss(odds: Matrix, boxed: NDArray[np.bool_]) -> Matrix:
    """Of each call."""
    p = np.clip(odds, LEAST, 1 - LEAST)
    return -np.where(boxed, np.log(p), np.log(1 - p))


def simulated_firsts(record: RaceRecord, races: int, seed: int, rivals: Any) -> tuple[dict[int, float], float]:
    """Median lap of the first stop by starting compound (-1: of all), and mean stops of cars that finish."""
    batch = RaceBatch(compile_figures(record), races, rivals=rivals)
    batch.start(seed, np.arange(races))
    start, first = batch.k[:, at.K_COMPOUND].copy(), np.zeros((races, at.CARS))
    for lap in range(1, record.laps + 1):
        batch.advance()
        first[(batch.k[:, at.K_STOPPED] > 0) & (first == 0)] = lap
    ran = (batch.k[:, at.K_RETIRE] > record.laps) & (np.arange(at.CARS) < len(record.cars))
    stopped = ran & (first > 0)
    medians = {c: float(np.median(first[stopped & (start == c)])) for c in range(3) if (stopped & (start == c)).any()}
    return {**medians, -1: float(np.median(first[stopped]))}, float(batch.k[:, at.K_STOPS][ran].mean())


def score(model: RivalModel, race: RaceDecisions, neutral: RaceRecord, rates: tuple[float, float], races: int, seed: int) -> Scores:
    """Everything about one test race."""
    figures = rival_figures(model, entry_of(race))
    boxed = race.rows["box"].to_numpy()
    odds = {
        "model": model_odds(model, race, figures, rates[1]),
        "constant": np.full(len(boxed), rates[0]),
        "plans": plan_odds(race, figures),
    }
    tyres = {c: replace(t, sets=SETS[c]) for c, t in neutral.tyres.items()}
    record = replace(neutral, laps=race.key.laps, tyres=tyres, rivals=figures)
    firsts, stops = {}, {"constant": rates[0] * race.key.laps}
    real = race.stints.filter(pl.col("first") & pl.col("ended").is_in(["box", "slow"]))
    laps, start = real["laps"].to_numpy().astype(float), real["compound"].to_list()
    for name, kind in (("model", "reactive"), ("plans", "plans")):
        medians, stops[name] = simulated_firsts(record, races, seed, kind)
        firsts[name] = laps - np.array([medians.get(c, medians[-1]) for c in start])
    firsts["constant"] = laps - np.log(2) / rates[0]
    assert race.summary is not None
    name = f"{race.key.grand_prix}-{race.key.season}"
    return Scores(name, {k: log_loss(p, boxed) for k, p in odds.items()}, firsts, stops, race.summary.stops)


def summary(scores: list[Scores]) -> RivalsOverall:
    """Means over decisions and cars, with bootstrap intervals over races of the model's lead over the others."""
    out: dict[str, RivalMeasure] = {}
    measures = {
        "logloss": lambda s, m: s.calls[m],
        "first_stop_mae": lambda s, m: np.abs(s.firsts[m]),
        "first_stop_within_3": lambda s, m: (np.abs(s.firsts[m]) <= NEAR_LAPS).astype(float),
        "stops_mae": lambda s, m: np.array([abs(s.stops[m] - s.real_stops)] if np.isfinite(s.real_stops) else []),
    }
    for measure, values in measures.items():
        by_race = np.array([[(values(s, m).sum(), len(values(s, m))) for m in COMPARED] for s in scores])
        means = pooled_means(by_race).tolist()
        low, high = bootstrap_over_races(by_race, lambda rows: pooled_means(rows)[0] - pooled_means(rows)[1:])
        (constant, plans) = ((float(low[i]), float(high[i])) for i in range(len(COMPARED) - 1))
        out[measure] = RivalMeasure(means[0], means[1], means[2], constant, plans)
    return RivalsOverall(**out)


def pooled_means(by_race: np.ndarray) -> np.ndarray:
    """Means over all calls of some races, from sums and counts [races, compared, 2]."""
    sums, counts = by_race.sum(axis=0).T
    return sums / counts


def all_decisions(laps: Path, facts: Path, seasons: tuple[int, ...]) -> list[RaceDecisions]:
    """Decisions in every race of some seasons."""
    found = []
    for season in seasons:
        table = read_seasons(laps, (season,))
        for (number,) in table.select("round").unique().sort("round").iter_rows():
            race = table.filter(pl.col("round") == number)
            found.append(race_decisions(race, race_facts(race, facts, season, int(number)), season, int(number)))
    return found


def young_rate(model: RivalModel, races: list[RaceDecisions]) -> float:
    """Share of decisions on young sets that were stops."""
    boxed, calls = 0.5, 1.0
    for race in (r for r in races if r.summary is not None):
        stint_laps = np.broadcast_to(expectation(model, race.key).stint_laps, (race.rows.height, 2, 3))
        young = is_young(race.rows, stint_laps) & (usual_stint(race.rows, stint_laps) > 0)
        boxed, calls = boxed + float(race.rows["box"].to_numpy()[young].sum()), calls + float(young.sum())
    return boxed / calls


def main() -> int:
    """Fit, score, print and write; returns the exit code."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--laps", type=Path, required=True)
    parser.add_argument("--facts", type=Path, required=True)
    parser.add_argument("--fit", default="2018,2019,2020,2021,2022,2023")
    parser.add_argument("--test", type=int, default=2024)
    parser.add_argument("--races", type=int, default=300)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--out", type=Path, default=Path("benchmarks/results/rivals.json"))
    options = parser.parse_args()
    seasons = tuple(int(s) for s in options.fit.split(","))
    try:
        decisions = all_decisions(options.laps, options.facts, (*seasons, options.test))
        fitted = [c for c in decisions if c.key.season in seasons and c.summary is not None]
        model = fit_rival_model(fitted)
        rows = pl.concat([c.rows.select(*RACE, "box") for c in fitted])
        rates = (float(rows["box"].to_numpy().mean()), young_rate(model, fitted))
        neutral, known, scores = load_race("bahrain-2023"), list(model.past), []
        for race in (c for c in decisions if c.key.season == options.test and c.summary is not None):
            scores.append(score(replace(model, past=tuple(known)), race, neutral, rates, options.races, options.seed))
            if race.summary is not None:
                known.append((race.key, race.summary))
    except RsrlError as error:
        print(f"rivals: {error}", file=sys.stderr)
        return 2
    command = f"python benchmarks/rivals.py --laps LAPS_FOLDER --facts FACTS_FOLDER --fit {options.fit} --test {options.test}"
    races = tuple(
        RivalsRace(
            race=s.name,
            real_stops=s.real_stops,
            stops=s.stops,
            within_3=float((np.abs(s.firsts["model"]) <= NEAR_LAPS).mean()),
            first_stop_error_laps=float(np.median(s.firsts["model"])),
            logloss=float(s.calls["model"].mean()),
        )
        for s in scores
    )
    about, overall = provenance(options.seed, command=command), summary(scores)
    options.out.parent.mkdir(exist_ok=True)
    write_json(options.out, RivalsResult(seasons, options.test, model.decisions, model.stops, overall, races, about))
    print(to_json(overall), end="")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
