"""A car's own sets of tyres: how they are written, stored and assumed, what is refused, and that commands apply and record them."""

import dataclasses
import json
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rsrl.cli import main
from rsrl.errors import RsrlError
from rsrl.season import COMPOUNDS, RaceRecord, assume, load_race, parse_sets, race_hash, read_race, read_sets, write_race, write_sets

Capture = pytest.CaptureFixture[str]
HAM = 6
SETS = st.fixed_dictionaries({c: st.lists(st.integers(0, 30), max_size=6).map(lambda laps: tuple(sorted(laps))) for c in COMPOUNDS})


@given(SETS)
def test_sets_are_read_as_they_are_written(sets: dict[str, tuple[int, ...]]) -> None:
    assert read_sets(write_sets(sets)) == sets


def test_how_sets_are_written() -> None:
    assert read_sets("S1M2H2") == {"S": (0,), "M": (0, 0), "H": (0, 0)}
    assert read_sets("h1u2s2u3m0H1s1") == {"S": (0, 3, 3), "M": (), "H": (0, 2)}, "any order, the freshest set first"
    for text in ("", "S1", "S1M2", "S1M2X2", "SMH", "S1M2H2u", "S1 M2 H2", "S-1M2H2", "S1M2H2u100"):
        assert read_sets(text) is None, text


def test_a_driver_has_sets_of_his_own(bahrain: RaceRecord) -> None:
    for name in ("HAM", "44", "hamilton", "Lewis Hamilton"):
        changed = assume(bahrain, parse_sets(f"{name}=S1S2u3M1H2"))
        assert changed.sets_of(HAM) == ((0, 3, 3), (0,), (0, 0))
        assert all(changed.sets_of(car) == bahrain.sets_of(car) for car in range(20) if car != HAM)
        assert changed.sets == bahrain.sets == (3, 1, 2)
        assert changed.rivals == bahrain.rivals
        assert race_hash(changed) != race_hash(bahrain)
    assert bahrain.sets_of(HAM) == bahrain.sets_of(None) == ((0, 0, 0), (0,), (0, 0))


def test_sets_of_all_cars_and_of_some(bahrain: RaceRecord) -> None:
    texts = parse_sets(["HAM=S1M2H2", "S2M2H2", "1=S4M1H1"])
    assert texts == ("sets.S=2", "sets.M=2", "sets.H=2", "sets.HAM=S1M2H2", "sets.1=S4M1H1")
    changed = assume(bahrain, texts)
    counts = [tuple(map(len, changed.sets_of(car))) for car in range(20)]
    assert counts[HAM] == (1, 2, 2)
    assert counts[0] == (4, 1, 1), "Verstappen, whatever the order"
    assert set(counts[1:HAM] + counts[HAM + 1 :]) == {(2, 2, 2)}
    assert parse_sets("all=S1S1u3M2H2") == ("sets.all=S1S1u3M2H2",)
    assert {assume(bahrain, "sets.all=S1S1u3M2H2").sets_of(car) for car in range(20)} == {((0, 3), (0, 0), (0, 0))}


def test_a_number_of_sets_for_each_car_is_for_those_with_their_own_as_well(bahrain: RaceRecord) -> None:
    changed = assume(bahrain, ["sets.HAM=S1S1u3M2H2", "sets.S=4"])
    assert changed.sets_of(HAM) == ((0, 0, 0, 0), (0, 0), (0, 0))
    assert changed.sets_of(0) == ((0, 0, 0, 0), (0,), (0, 0))


def test_own_sets_are_stored_in_the_season_file(bahrain: RaceRecord, tmp_path: Path) -> None:
    changed = assume(bahrain, ["sets.HAM=S1S2u3M0H2"])
    write_race(changed, tmp_path / "own.toml")
    text = (tmp_path / "own.toml").read_text(encoding="utf-8")
    assert text.count("[cars.sets]\nS = [0, 3, 3]\nM = []\nH = [0, 0]\n") == 1
    fitted = sum(car.sets is not None for car in bahrain.cars)
    assert text.count("cars.sets") == fitted + 1
    read = read_race(tmp_path / "own.toml")
    assert race_hash(read) == race_hash(changed)
    assert read.sets_of(HAM) == changed.sets_of(HAM)


@pytest.mark.parametrize(
    ("sets", "message"),
    [
        ({"S": (0,), "M": (0,)}, "there must be a number of sets for each of S, M, H"),
        ({"S": (0, 0), "M": (), "H": ()}, "a dry race needs sets of two compounds"),
        ({"S": (0,), "M": (-1,), "H": ()}, "a set may have run 0 to 30 laps before the race"),
        ({"S": (0,) * 21, "M": (0,), "H": ()}, "a car has 20 sets of a compound at most"),
    ],
)
def test_a_file_with_impossible_sets_is_refused(
    bahrain: RaceRecord, sets: dict[str, tuple[int, ...]], message: str, tmp_path: Path
) -> None:
    cars = (*bahrain.cars[:HAM], dataclasses.replace(bahrain.cars[HAM], sets=sets), *bahrain.cars[HAM + 1 :])
    write_race(dataclasses.replace(bahrain, cars=cars), tmp_path / "own.toml")
    with pytest.raises(RsrlError) as caught:
        read_race(tmp_path / "own.toml")
    assert str(caught.value) == f"{tmp_path / 'own.toml'}: cars.sets of HAM: {message}"


def test_a_file_with_sets_of_the_wrong_type_is_refused(bahrain: RaceRecord, tmp_path: Path) -> None:
    write_race(assume(bahrain, "sets.HAM=S1M2H2"), tmp_path / "own.toml")
    text = (tmp_path / "own.toml").read_text(encoding="utf-8")
    for bad, message in (("S = 1\n", "sets.S must be a list, found 1"), ('S = ["new"]\n', "sets.S[0] must be a whole number, found 'new'")):
        (tmp_path / "bad.toml").write_text(text.replace("S = [0]\n", bad), encoding="utf-8")
        with pytest.raises(RsrlError) as caught:
            read_race(tmp_path / "bad.toml")
        assert message in str(caught.value)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("sets.SEN=S1M2H2", "unknown driver 'SEN' for bahrain-2023"),
        ("sets.HAM=S2M0H0", "a dry race needs sets of two compounds at bahrain-2023"),
        ("sets.HAM=S21M2H2", "a car has 20 sets of a compound at most at bahrain-2023"),
        ("sets.HAM=S1u31M2H2", "a set may have run 0 to 30 laps before the race at bahrain-2023"),
        ("sets.HAM=3", "unknown compound 'HAM'"),
        ("sets.HAM=S1M2", "write NAME=20 for a value"),
    ],
)
def test_impossible_sets_are_refused_in_one_line(bahrain: RaceRecord, text: str, message: str) -> None:
    with pytest.raises(RsrlError) as caught:
        assume(bahrain, text)
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


def test_sets_on_which_nobody_started_are_refused(bahrain: RaceRecord) -> None:
    plans = tuple(plan for plan in bahrain.rivals.plans if plan.plan[0] == "S")
    record = dataclasses.replace(bahrain, rivals=dataclasses.replace(bahrain.rivals, plans=plans))
    with pytest.raises(RsrlError, match="no team started bahrain-2023 on a tyre of these sets"):
        assume(record, "sets.HAM=S0M1H1")


def test_used_sets_are_refused_where_a_set_may_run_so_many_laps_only() -> None:
    qatar = load_race("qatar-2023")
    assert assume(qatar, "sets.HAM=S2M2H2").sets_of(qatar.car_index("HAM")) == ((0, 0),) * 3
    with pytest.raises(RsrlError, match="used sets are not supported where a set may run 18 laps only at qatar-2023"):
        assume(qatar, "sets.HAM=S1S1u3M2H2")


REAL = "S-H@10-S@17-M@27-H@37-S@47-S@54"  # Norris at Bahrain 2023, six stops for air pressure


def test_a_real_plan_is_refused_for_sets_with_the_option_that_allows_it(capsys: Capture) -> None:
    command = ["simulate", "bahrain-2023", "--races", "20", "--driver", "HAM", "--plan", REAL]
    assert main(command) == 2
    option = "--sets HAM=S4M1H2"
    refused = f"plan {REAL}: needs 4 sets of S, HAM has 3 at bahrain-2023; if there were more, say {option}\n"
    assert capsys.readouterr().err == f"rsrl: error: {refused}"
    assert main([*command, *option.split(), "--json"]) == 0
    result = json.loads(capsys.readouterr().out)
    assert result["plan"] == REAL
    assert result["provenance"]["assumptions"] == ["sets.HAM=S4M1H2"]
    assert next(car for car in result["cars"] if car["driver"] == "HAM")["mean_stops"] > 4
    assert main([*command, "--sets", "HAM=S1S1u3S1u4S1u6M1H2"]) == 0
    assert capsys.readouterr().out.startswith("Assumed: sets.HAM=S1S1u3S1u4S1u6M1H2\n")


def test_the_start_and_the_plans_of_a_search_are_those_of_the_drivers_sets(capsys: Capture) -> None:
    assert main(["plan", "bahrain-2023", "--driver", "HAM", "--sets", "HAM=S0M1H2", "--start", "S"]) == 2
    assert "--start S: HAM has no set of soft at bahrain-2023" in capsys.readouterr().err
    assert main(["plan", "bahrain-2023", "--driver", "HAM", "--sets", "HAM=S1M2H1", "--races", "600", "--json"]) == 0
    result = json.loads(capsys.readouterr().out)
    assert result["provenance"]["assumptions"] == ["sets.HAM=S1M2H1"]
    for plan in result["plans"]:
        compounds = [plan["start"], *(stop["compound"] for stop in plan["stops"])]
        assert compounds.count("S") <= 1, plan
        assert compounds.count("H") <= 1, plan
