"""The rolling backtest: no leak and better than chance on invented races; on a few real ones, replay does what happened."""

import dataclasses
import gzip
import json
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
import pytest
from invented_seasons import FIT, TEST, invented_races, scramble, write_files
from synthetic_race import synthetic_race

from rsrl.cli.app import main
from rsrl.errors import RsrlError
from rsrl.evaluation.backtest import (
    MEASURES,
    Season,
    check_request,
    forecast_record,
    prepare_race,
    race_times_s,
    read_season,
    run_backtest,
    without,
)
from rsrl.evaluation.backtest.ablation import script_without
from rsrl.simulator import Script, lap_means

FIT_ROUNDS, TEST_ROUNDS = (1, 3, 5, 6, 8, 9, 11), (1, 2)
Json = dict[str, Any]


def backtest(folder: Path) -> Json:
    """The JSON of `rsrl backtest` on the files in a folder."""
    out = folder / "backtest.json"
    words = ["backtest", "--laps", str(folder / "laps"), "--facts", str(folder / "facts"), "--races", "40", "--out", str(out)]
    assert main([*words, "--fit", ",".join(map(str, FIT)), "--test", str(TEST)]) == 0
    return json.loads(out.read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def invented(tmp_path_factory: pytest.TempPathFactory) -> tuple[Json, Json]:
    """Backtests of invented seasons: as they were run, and with the races of the test season rewritten."""
    races = invented_races()
    as_run, rewritten = tmp_path_factory.mktemp("as-run"), tmp_path_factory.mktemp("rewritten")
    write_files(races, as_run)
    write_files(races, rewritten)
    scramble(rewritten)
    return backtest(as_run), backtest(rewritten)


def predictions(result: Json, race: int) -> list[Json]:
    """What was predicted of each car of a race, without what then happened."""
    names = ("driver", "team", "grid", "predicted", "p_points", "p_win", "stops_predicted", "first_stop_predicted")
    return [{name: car[name] for name in names} for car in result["races"][race]["cars"]]


def outcomes(result: Json, race: int) -> list[int]:
    return [car["position"] for car in result["races"][race]["cars"]]


def test_forecasts_of_invented_races_beat_the_grid_and_a_shuffled_order(invented: tuple[Json, Json]) -> None:
    result, _ = invented
    rng = np.random.default_rng(0)
    for race in result["races"]:
        predicted, position = (np.array([car[name] for car in race["cars"]], float) for name in ("predicted", "position"))
        shuffled = [np.abs(rng.permutation(predicted) - position).mean() for _ in range(2000)]
        assert race["mae_position"] < np.quantile(shuffled, 0.001) - 1.0
        assert race["mae_position"] < race["grid"]["mae_position"] - 0.8


def test_a_forecast_sees_neither_its_own_race_nor_later_ones(invented: tuple[Json, Json]) -> None:
    """Laps and results of both test races are rewritten: the first forecast stays as it was, the second learns from the first race."""
    as_run, rewritten = invented
    assert predictions(as_run, 0) == predictions(rewritten, 0)
    assert as_run["races"][0]["sc_laps_predicted"] == rewritten["races"][0]["sc_laps_predicted"]
    assert predictions(as_run, 1) != predictions(rewritten, 1)
    for race in (0, 1):
        assert outcomes(as_run, race) != outcomes(rewritten, race)


@pytest.fixture(scope="session")
def few_laps(real_data: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with seven races of 2022 and two of 2023."""
    folder = tmp_path_factory.mktemp("few-laps")
    for season, rounds in ((2022, FIT_ROUNDS), (2023, TEST_ROUNDS)):
        name = f"laps_{season}.csv.gz"
        table = pl.read_csv(real_data / "laps" / name, infer_schema=False)
        kept = table.filter(pl.col("round").is_in([str(r) for r in rounds]))
        (folder / name).write_bytes(gzip.compress(kept.write_csv().encode()))
    return folder


@pytest.fixture(scope="session")
def season(real_data: Path, few_laps: Path) -> Season:
    return read_season(few_laps, real_data / "facts", (2022,), 2023)


@pytest.mark.real_data
def test_a_forecast_does_not_see_the_race(season: Season) -> None:
    """With other laps, another result and another order of finish, the forecast is the same."""
    index = season.test_indices[0]
    race = season.book.races[index]
    scrambled = dataclasses.replace(
        race.facts,
        positions=dict(zip(race.facts.positions, reversed(race.facts.positions.values()), strict=True)),
        retired=frozenset(list(race.facts.grid)[:9]),
        classified=frozenset(),
    )
    book = type(season.book)([*season.book.races[:index], race._replace(facts=scrambled, pace={})])
    first_laps = (pl.col("season") == race.season) & (pl.col("round") == race.round)
    table = season.table.with_columns(lap_time_s=pl.when(first_laps).then(pl.lit(77.0)).otherwise(pl.col("lap_time_s")))
    other = dataclasses.replace(season, book=book, table=table, analyses=season.analyses[: index + 1])
    seen, unseen = forecast_record(season, index), forecast_record(other, index)
    assert dataclasses.replace(seen, provenance=unseen.provenance) == unseen


@pytest.mark.real_data
def test_later_rounds_learn_from_earlier_ones(season: Season) -> None:
    second = season.test_indices[1]
    shorter = dataclasses.replace(season, analyses=(*season.analyses[: second - 1], season.analyses[second]))
    shorter = dataclasses.replace(shorter, book=type(season.book)([*season.book.races[: second - 1], season.book.races[second]]))
    assert forecast_record(shorter, second - 1).cars != forecast_record(season, second).cars


@pytest.mark.real_data
def test_a_replay_makes_the_stops_and_retirements_that_were(season: Season) -> None:
    index = season.test_indices[0]  # Bahrain 2023
    record, script = prepare_race(season, index, "replay")
    assert script is not None
    drivers = [car.driver for car in record.cars]
    assert str(script.plans[drivers.index("VER")]) == "S-S@14-H@36"
    assert sorted(drivers[i] for i in script.retire) == ["LEC", "OCO", "PIA"]
    assert [lap for lap, status in enumerate(script.status, 1) if status] == [41]
    means = lap_means(record, 20, 0, script=script, as_dry=True)
    assert (means.results.stops[:, drivers.index("VER")] == 2).all()
    assert means.results.retired[:, drivers.index("LEC")].all()
    assert means.vsc_laps == 1.0


@pytest.mark.real_data
def test_race_times_end_with_the_official_one(season: Season) -> None:
    index = season.test_indices[0]
    facts = season.book.races[index].facts
    times = race_times_s(season.laps_of(index), facts)
    assert times[-1, list(facts.grid).index("VER")] == pytest.approx(5636.7, abs=1.0)  # official 1:33:56.736
    assert np.isnan(times[-1, list(facts.grid).index("LEC")])


@pytest.mark.real_data
def test_knowing_more_of_the_race_helps(season: Season) -> None:
    error = {m: run_backtest(season, m, races=100).overall["simulation"]["mae_position"] for m in ("forecast", "replay", "hindsight")}
    assert error["hindsight"] < error["replay"] < error["forecast"]
    assert error["hindsight"] < 2.0


@pytest.mark.real_data
def test_same_seed_same_scores(season: Season) -> None:
    first, again, other = (repr(run_backtest(season, "forecast", races=30, seed=s).races) for s in (3, 3, 4))  # NaN is no equal of NaN
    assert first == again
    assert first != other


@pytest.mark.real_data
def test_the_command_without_results_folder(few_laps: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Laps alone will do; and the JSON has the promised parts."""
    out = tmp_path / "b.json"
    words = ["backtest", "--laps", str(few_laps), "--fit", "2022", "--test", "2023", "--races", "20", "--json", "--out", str(out)]
    assert main(words) == 0
    result: dict[str, Any] = json.loads(capsys.readouterr().out)
    assert result == json.loads(out.read_text(encoding="utf-8"))
    for scores in (result["overall"], result["baselines"]["grid"], result["baselines"]["regression"], *result["races"]):
        assert set(MEASURES) <= set(scores)
    assert result["overall"]["races"] == result["all_races"]["races"] == result["all_races"]["grid"]["races"] == 2
    assert {"mean", "low", "high"} == set(result["overall"]["difference_to_grid"]["mae_position"])
    assert len(result["races"][0]["cars"]) == 20
    assert main(words) == 2  # the file is there already


@pytest.mark.parametrize(
    ("mode", "fit", "races", "part", "named"),
    [
        ("guess", (2022,), 10, None, "forecast, replay, hindsight"),
        ("replay", (2023,), 10, None, "season 2023"),
        ("replay", (2022, 2024), 10, None, "season 2024"),
        ("replay", (), 10, None, "--fit"),
        ("replay", (2022,), 0, None, "races is 0"),
        ("replay", (2022,), 10, "luck", "traffic, safety-cars, wear"),
    ],
)
def test_what_cannot_be_asked(mode: str, fit: tuple[int, ...], races: int, part: str | None, named: str) -> None:
    with pytest.raises(RsrlError, match=named):
        check_request(mode, fit, 2023, races, part)


def test_a_missing_lap_file_is_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["backtest", "--laps", str(tmp_path), "--fit", "2022", "--test", "2023"]) == 2
    assert "laps_2022.csv.gz" in capsys.readouterr().err


def test_without_traffic_cars_pass_freely_and_without_wear_tyres_do_not_age() -> None:
    record = synthetic_race(laps=20)
    order = [19 - i for i in range(20)]  # quick cars at the back
    cars = tuple(
        dataclasses.replace(car, pace_s=record.cars[j].pace_s, retire_per_lap=car.retire_per_lap._replace(value=0.0))
        for car, j in zip(record.cars, order, strict=True)
    )
    record = dataclasses.replace(record, cars=cars)
    script = Script(status=(0,) * 20)
    results = [lap_means(r, 200, 0, script=script, rivals="plans").results for r in (record, without(record, "traffic"))]
    held, free = (r.positions[:, 19].mean() for r in results)
    assert free < held
    fresh = without(record, "wear")
    assert all(t.wear_s_per_lap.value == 0.0 for t in fresh.tyres.values())
    laps = [lap_means(r, 50, 0, script=script, rivals="plans").green_lap_s for r in (record, fresh)]
    assert np.nanmean(laps[1]) < np.nanmean(laps[0])


def test_without_safety_cars_none_is_drawn_or_replayed() -> None:
    record = without(synthetic_race(laps=20), "safety-cars")
    assert lap_means(record, 200, 0, rivals="plans").sc_laps == 0
    assert script_without(Script(status=(0, 2, 1, 0)), "safety-cars").status == (0, 0, 0, 0)
    assert script_without(Script(status=(0, 2, 1, 0)), "wear").status == (0, 2, 1, 0)
    with pytest.raises(RsrlError, match="traffic, safety-cars, wear"):
        without(record, "rain")
