"""The model of real decisions: what is expected of a race, known coefficients found again, plans that can be driven."""

import dataclasses

import numpy as np
import polars as pl
import pytest
from calibration_laps import known_record, simulated
from hypothesis import given, settings
from hypothesis import strategies as st
from synthetic_race import synthetic_race

from rsrl.calibration.entry import RaceEntry, RaceKey
from rsrl.calibration.race_facts import race_facts
from rsrl.calibration.rivals import prior
from rsrl.calibration.rivals.decisions import RaceDecisions, race_decisions
from rsrl.calibration.rivals.model import choice_design, fit_choice, fit_logistic, fit_rival_model, hazard_design, rival_figures
from rsrl.calibration.rivals.plans import intended_plans
from rsrl.calibration.rivals.stint_lengths import Outlook, outlooks, summarise_race
from rsrl.laps import LAP_SCHEMA, check_table, tyre_stops
from rsrl.season import CHOICE_FEATURES, HAZARD_FEATURES, LIFE_NAMES
from rsrl.simulator import Plan, check_plan


def lap_rows(driver: str, compounds: str, ages: list[int], trips: dict[int, str]) -> pl.DataFrame:
    """Laps of one car: a compound and tyre life per lap, `trips` through the pit lane by lap with the track status."""
    n = len(compounds)
    rows: dict[str, list[object]] = {name: [None] * n for name in LAP_SCHEMA}
    rows |= {
        "season": [2023] * n, "round": [1] * n, "event": ["Bahrain Grand Prix"] * n, "driver": [driver] * n, "team": ["T"] * n,
        "lap": list(range(1, n + 1)), "lap_time_s": [90.0] * n, "compound": list(compounds), "tyre_life_laps": [float(v) for v in ages],
        "position": [1] * n, "track_status": [trips.get(i, "1") for i in range(1, n + 1)],
        "session_time_s": [90.0 * i for i in range(1, n + 1)], "pit_in_s": [1.0 if i in trips else None for i in range(1, n + 1)],
    }  # fmt: skip
    return check_table(pl.DataFrame(rows, schema=LAP_SCHEMA), "made up", 0)


def test_a_change_under_a_red_flag_is_marked_and_is_no_call() -> None:
    laps = lap_rows("AAA", "SSSSSSHHHHHHHHHH", [*range(1, 7), *range(1, 11)], {6: "15"})
    assert tyre_stops(laps)["red"].to_list() == [True]
    calls = race_decisions(laps, race_facts(laps, None, 2023, 1), 2023, 1)
    assert not calls.rows["box"].any()
    assert 6 not in calls.rows["lap"].to_list()
    assert calls.stints["ended"].to_list() == ["red", "flag"]


@pytest.fixture(scope="module")
def races() -> list[RaceDecisions]:
    """Calls of simulated races of plans, told apart as rounds."""
    found = []
    for seed in (1, 2, 3):
        table = simulated(known_record(sc=0.01, vsc=0.01), seed)
        for season, number in table.select("season", "round").unique().sort("season", "round").iter_rows():
            race = table.filter((pl.col("season") == season) & (pl.col("round") == number)).with_columns(round=pl.lit(10 * seed + number))
            found.append(race_decisions(race, race_facts(race, None, season, 10 * seed + number), season, 10 * seed + number))
    return found


def test_a_call_knows_the_laps_before_and_the_status_of_its_lap(races: list[RaceDecisions]) -> None:
    rows = races[0].rows
    assert rows["lap"].min() == 2
    assert rows["lap"].max() == races[0].key.laps - 1
    assert (rows["laps_left"] + rows["lap"] == races[0].key.laps).all()
    one = rows.filter(pl.col("driver") == rows["driver"][0]).sort("lap")
    made = one["made"].to_numpy()
    np.testing.assert_array_equal(np.diff(made), one["box"].to_numpy()[:-1].astype(int))
    fresh = one.filter(pl.col("box").shift(1).fill_null(False))
    assert (fresh["age"] == 0).all()


def test_a_fit_describes_the_races_it_saw_and_its_figures_are_whole(races: list[RaceDecisions]) -> None:
    model = fit_rival_model(races)
    sets = {"S": 3, "M": 2, "H": 3}
    entry = RaceEntry(2023, 9, "bahrain", 57, {}, event="Bahrain Grand Prix", wet=False, starters=(), max_laps_per_set=0, sets=sets)
    figures = rival_figures(model, entry)
    assert tuple(figures.hazard) == HAZARD_FEATURES
    assert tuple(figures.choice) == CHOICE_FEATURES
    assert tuple(figures.life_laps) == LIFE_NAMES
    assert all(np.isfinite(f.value) and f.se >= 0 for f in (*figures.hazard.values(), *figures.choice.values()))
    soft = pl.col("first") & (pl.col("ended") == "box") & (pl.col("compound") == 0)
    first = np.mean([r.stints.filter(soft)["laps"].to_numpy().mean() for r in races])
    assert figures.life_laps["S"].value == pytest.approx(first, rel=0.2)
    again = fit_rival_model(races[::-1])
    np.testing.assert_allclose(again.hazard, model.hazard, atol=1e-6)


def test_a_race_alone_is_near_to_what_earlier_seasons_say(races: list[RaceDecisions]) -> None:
    alone, season = fit_rival_model(races[:1]), fit_rival_model(races)
    assert 10 < alone.stops < 100 < season.stops
    for name, usual in (("hazard", prior.HAZARD), ("choice", prior.CHOICE)):
        moved = [np.abs(getattr(model, name) - usual).mean() for model in (alone, season)]
        assert 0 < moved[0] < moved[1], name
    wider = [np.diag(model.hazard_cov).mean() for model in (alone, season)]
    assert wider[0] > wider[1]


def test_the_prior_has_a_value_for_every_coefficient(races: list[RaceDecisions]) -> None:
    rows, outlook = races[0].rows, outlooks([(races[0].key, races[0].summary)], [races[0].key])[0]  # type: ignore[list-item]
    assert hazard_design(rows, outlook).shape[1] == len(prior.HAZARD)
    assert choice_design(rows, outlook).shape[2] == len(prior.CHOICE)


def test_a_new_track_gets_what_is_usual_and_is_less_sure(races: list[RaceDecisions]) -> None:
    past = [(r.key, r.summary) for r in races if r.summary is not None]
    here, new = outlooks(past, [past[0][0], RaceKey(2030, 1, "nowhere", 57, {})])
    assert (new.stint_log_se > here.stint_log_se).all()
    assert np.isfinite(new.stint_laps).all()
    assert new.stops_se > here.stops_se


def test_known_coefficients_are_found_again() -> None:
    rng = np.random.default_rng(1)
    design = np.hstack([np.ones((20_000, 1)), rng.random((20_000, 4))])
    true = np.array([-3.0, 1.5, -1.0, 2.0, 0.0])
    outcome = (rng.random(20_000) < 1 / (1 + np.exp(-design @ true))).astype(float)
    beta, covariance = fit_logistic(design, outcome, np.arange(20_000) // 200, np.zeros(5), 0.1)
    assert (np.abs(beta - true) < 4 * np.sqrt(np.diag(covariance))).all()
    assert (np.sqrt(np.diag(covariance)) < 0.3).all()
    options = rng.normal(size=(8000, 3, 3))
    wanted = np.array([1.0, -0.5, 0.3])
    taken = (options @ wanted + rng.gumbel(size=(8000, 3))).argmax(axis=1)
    found, spread = fit_choice(options, taken, np.arange(8000) // 100, np.zeros(3), 0.1)
    assert (np.abs(found - wanted) < 4 * np.sqrt(np.diag(spread))).all()


def test_the_usual_stint_counts_cars_that_went_on() -> None:
    """Half the cars stop on lap 20, the others never: the median stint is 20 only if those are not forgotten."""
    stints = pl.DataFrame(
        {"driver": list("abcdef"), "compound": [1] * 6, "laps": [20, 20, 20, 50, 50, 50], "first": [True] * 6,
         "ended": ["box", "box", "box", "flag", "flag", "flag"]}
    )  # fmt: skip
    summary = summarise_race(stints, 50)
    assert np.exp(summary.log_stint_share[0, 1]) == pytest.approx(0.4)
    assert summary.starts.tolist() == [0.0, 6.0, 0.0]
    rare = summarise_race(stints.with_columns(ended=pl.Series(["box", *["flag"] * 5])), 50)
    assert np.exp(rare.log_stint_share[0, 1]) > 0.6


@settings(max_examples=60, deadline=None)
@given(
    laps=st.integers(30, 78),
    stops=st.floats(0.4, 4.2),
    stint_laps=st.lists(st.floats(0.1, 1.4), min_size=6, max_size=6),
    sets=st.tuples(st.integers(2, 4), st.integers(1, 3), st.integers(1, 3)),
    limited=st.booleans(),
    min_sets=st.integers(2, 3),
)
def test_intended_plans_can_be_driven(
    laps: int, stops: float, stint_laps: list[float], sets: tuple[int, int, int], limited: bool, min_sets: int
) -> None:
    limit = -(-laps // 3) + 1 if limited else 0
    shares = np.array([0.3, 0.45, 0.25])
    outlook = Outlook(laps * np.array(stint_laps).reshape(2, 3), np.zeros((2, 3)), stops, 0.1, shares, shares[::-1])
    plans = intended_plans(outlook, laps, dict(zip("SMH", sets, strict=True)), limit, min_sets)
    record = dataclasses.replace(synthetic_race(laps, sets=sets), max_laps_per_set=limit, min_sets=min_sets)
    assert plans
    for plan in plans:
        check_plan(Plan.parse(plan.plan), record)
        assert plan.weight > 0
