"""What was known before a race, and the pace forecast made of it."""

import dataclasses

import numpy as np
import pytest

from rsrl.calibration.forecast.form import FEATURES, FormBook, PastRace, quali_gaps, quali_ranks
from rsrl.calibration.forecast.pace import PastLevel, forecast_base_lap, forecast_pace, retirement_factors
from rsrl.calibration.forecast.places import forecast_places
from rsrl.calibration.race_facts import RaceFacts
from rsrl.evaluation.backtest.baselines import grid_prediction, regression_prediction

DRIVERS = tuple(f"D{i:02d}" for i in range(20))


def facts(grid: tuple[str, ...] = DRIVERS, order: tuple[str, ...] = DRIVERS, **changes: object) -> RaceFacts:
    parts: dict[str, object] = {
        "grid": {d: i + 1 for i, d in enumerate(grid)},
        "laps": 50,
        "retired": frozenset(),
        "source": "made up",
        "positions": {d: i + 1 for i, d in enumerate(order)},
        "classified": frozenset(order),
        "laps_done": dict.fromkeys(order, 50),
        "teams": {d: f"T{int(d[1:]) // 2}" for d in grid},
        "quali_s": {},
        "level_quali_s": {d: 80.0 + 0.1 * i for i, d in enumerate(grid)},
    }
    return RaceFacts(**{**parts, **changes})  # type: ignore[arg-type]


def season(races: int, seed: int = 0, year: int = 2030) -> list[PastRace]:
    """Car i is 0.1 per cent of a lap slower than car i - 1; grids and results are that order with a little luck."""
    rng = np.random.default_rng(seed)
    true = 0.1 * np.arange(20) - 0.95
    out = []
    for number in range(1, races + 1):
        grid = tuple(np.array(DRIVERS)[np.argsort(true + rng.normal(0, 0.2, 20))])
        order = tuple(np.array(DRIVERS)[np.argsort(true + rng.normal(0, 0.2, 20))])
        pace = {d: float(true[i] + rng.normal(0, 0.15)) for i, d in enumerate(DRIVERS)}
        out.append(PastRace(year, number, False, facts(grid, order), pace))
    return out


def test_features_do_not_see_the_race_itself_or_later_ones() -> None:
    races = season(10)
    before = FormBook(races).features(6)
    spoiled = [
        *races[:6],
        races[6]._replace(pace=dict.fromkeys(DRIVERS, 9.0), facts=dataclasses.replace(races[6].facts, positions=dict.fromkeys(DRIVERS, 1))),
        *[r._replace(pace={}) for r in races[7:]],
    ]
    after = FormBook(spoiled).features(6)
    assert all((before[d] == after[d]).all() for d in DRIVERS)


def test_a_newcomer_gets_the_teams_figures() -> None:
    races = season(8)
    grid = ("D20", *DRIVERS[1:])
    coming = facts(grid, grid, teams={"D20": "T0", **{d: f"T{int(d[1:]) // 2}" for d in DRIVERS[1:]}})
    rows = FormBook([*races, PastRace(2030, 9, False, coming, {})]).features(8)
    team, driver = FEATURES.index("team_pace"), FEATURES.index("driver_pace")
    assert rows["D20"][driver] == rows["D20"][team] == rows["D01"][team]


def test_a_team_under_a_new_name_keeps_its_history() -> None:
    old = dict.fromkeys(DRIVERS, "AlphaTauri")
    races = [r._replace(facts=dataclasses.replace(r.facts, teams=old)) for r in season(5)]
    new = facts(teams=dict.fromkeys(DRIVERS, "RB"))
    rows = FormBook([*races, PastRace(2030, 6, False, new, {})]).features(5)
    assert rows["D00"][FEATURES.index("team_pace")] != 0.4


def test_without_qualifying_all_gaps_are_zero() -> None:
    assert set(quali_gaps(facts(level_quali_s={})).values()) == {0.0}


def test_the_forecast_finds_who_is_quick_and_how_sure_it_may_be() -> None:
    book = FormBook(season(20))
    forecast = forecast_pace(book, 19)
    values = np.array([forecast.pace[d] for d in DRIVERS])
    assert values.mean() == pytest.approx(0.0, abs=1e-9)
    assert np.corrcoef(values, np.arange(20))[0, 1] > 0.97
    assert np.polyfit(np.arange(20), values, 1)[0] == pytest.approx(0.1, abs=0.02)
    assert 0.15 <= forecast.sd < 0.2
    assert forecast.rows == 15 * 20


def test_with_hardly_any_past_the_forecast_says_that_it_knows_little() -> None:
    forecast = forecast_pace(FormBook(season(3)), 2)
    assert forecast.sd > 0.4
    assert set(forecast.pace) == set(DRIVERS)


def test_base_lap_from_qualifying_uses_this_tracks_ratio() -> None:
    past = [PastLevel(f"gp{i}", 2030, 90.0 * 1.02, 90.0) for i in range(10)] + [PastLevel("slow", 2030, 90.0 * 1.04, 90.0)] * 3
    elsewhere = forecast_base_lap(past, "new", 2031, 80.0)
    here = forecast_base_lap(past, "slow", 2031, 89.0)
    assert elsewhere.value == pytest.approx(80.0 * 1.02)
    assert 89.0 * 1.02 < here.value < 89.0 * 1.04
    assert here.se < elsewhere.se


def test_a_wet_qualifying_is_not_believed() -> None:
    past = [PastLevel("here", 2030, 92.0, 90.0)] * 5
    figure = forecast_base_lap(past, "here", 2031, 104.0)
    assert figure.value == 92.0
    assert "no dry qualifying" in figure.note


def test_a_track_never_seen_without_qualifying_admits_it() -> None:
    figure = forecast_base_lap([PastLevel("a", 2030, 92.0, float("nan"))], "b", 2031, float("nan"))
    assert figure.se > 5


def test_cars_that_start_at_the_back_retire_more_where_they_did_before() -> None:
    races = season(20)
    back = [r._replace(facts=dataclasses.replace(r.facts, retired=frozenset(list(r.facts.grid)[15:18]))) for r in races]
    factors = retirement_factors(FormBook(back), 19)
    grid = list(back[19].facts.grid)
    assert np.mean(list(factors.values())) == pytest.approx(1.0)
    assert factors[grid[0]] < 0.6 < 1.4 < factors[grid[-1]]


def test_without_a_retirement_to_learn_from_all_are_alike() -> None:
    assert set(retirement_factors(FormBook(season(5)), 4).values()) == {1.0}


def test_rank_in_qualifying_ignores_a_penalty_and_grid_decides_without_times() -> None:
    penalised = facts(grid=(*DRIVERS[1:], "D00"), level_quali_s={d: 80.0 + 0.1 * i for i, d in enumerate(DRIVERS)})
    assert quali_ranks(penalised)["D00"] == 1
    without = facts(grid=(*DRIVERS[1:], "D00"), level_quali_s={})
    assert quali_ranks(without) == without.grid


def test_recent_pace_follows_a_car_that_has_just_been_made_quicker() -> None:
    races = season(16)
    quicker = [r._replace(pace={**r.pace, "D18": -1.0}) if r.round > 13 else r for r in races]
    row = FormBook(quicker).features(15)["D18"]
    assert row[FEATURES.index("driver_recent_pace")] < row[FEATURES.index("driver_pace")] - 0.1


def test_places_are_medians_that_a_retirement_in_seven_does_not_move() -> None:
    """The quickest car wins every race it finishes and is last in every seventh: its median place is the first."""
    races = season(30)
    past = []
    for i, race in enumerate(races):
        others = [d for d in race.facts.positions if d != "D00"]
        order = (*others, "D00") if i % 7 == 0 else ("D00", *others)
        past.append(race._replace(facts=facts(tuple(race.facts.grid), order)))
    forecast = forecast_places(FormBook(past), 29)
    assert forecast is not None
    places = dict(zip(past[29].facts.grid, forecast.places, strict=True))
    assert places["D00"] < 2.5
    assert np.corrcoef([places[d] for d in DRIVERS], np.arange(20))[0, 1] > 0.9
    assert 0.5 < forecast.sd < 5


def test_without_a_race_before_it_there_is_no_forecast_of_places() -> None:
    assert forecast_places(FormBook(season(3)), 0) is None


def test_a_driver_who_finishes_ahead_of_his_pace_is_forecast_quicker_than_his_pace() -> None:
    """Lap times of D10 and D11 are alike; D10 gains six places in every race, D11 loses six."""
    races = []
    for race in season(25):
        pace = {**race.pace, "D10": 0.1, "D11": 0.1}
        score = {d: place + {"D10": -6.5, "D11": 6.5}.get(d, 0.0) for d, place in race.facts.grid.items()}
        order = tuple(sorted(score, key=lambda d: score[d]))
        races.append(race._replace(pace=pace, facts=facts(tuple(race.facts.grid), order, teams={d: d for d in DRIVERS})))
    pace = forecast_pace(FormBook(races), 24).pace
    assert pace["D10"] < pace["D11"] - 0.05


def test_baselines_name_a_whole_place_for_every_car() -> None:
    book = FormBook(season(20))
    grid, regression = grid_prediction(book, 19), regression_prediction(book, 19)
    assert grid.position.tolist() == list(range(1, 21))
    assert set(regression.position.tolist()) <= set(range(1, 21))
    assert np.abs(regression.position - regression.mean_position).max() <= 0.5 + max(1 - regression.mean_position.min(), 0)
    assert regression.p_points.sum() == pytest.approx(10)
    actual = np.array([float(book.races[19].facts.positions[d]) for d in book.races[19].facts.grid])
    assert np.abs(regression.position - actual).mean() < np.abs(grid.position - actual).mean()
