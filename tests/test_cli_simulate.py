"""`rsrl simulate`: its result, and each input it refuses."""

import json
from typing import Any

import pytest

from rsrl.cli import main

Capture = pytest.CaptureFixture[str]
CAR_FIELDS = [
    "driver", "team", "grid", "mean_position", "p_win", "p_podium", "p_points", "p_retired", "mean_stops", "positions",
]  # fmt: skip


def simulated(capsys: Capture, *options: str) -> dict[str, Any]:
    assert main(["simulate", "bahrain-2023", "--races", "200", "--json", *options]) == 0
    result: dict[str, Any] = json.loads(capsys.readouterr().out)
    return result


def test_result_as_json(capsys: Capture) -> None:
    result = simulated(capsys, "--seed", "3")
    assert (result["race"], result["races"], result["seed"]) == ("bahrain-2023", 200, 3)
    assert result["races_per_s"] == pytest.approx(200 / result["seconds"])
    assert result["provenance"]["seed"] == 3
    assert len(result["cars"]) == 20
    for car in result["cars"]:
        assert list(car) == CAR_FIELDS
        assert len(car["positions"]) == 20
        assert sum(car["positions"]) == pytest.approx(1)
        assert sum(car["positions"][:3]) == pytest.approx(car["p_podium"])
    assert sum(car["p_win"] for car in result["cars"]) == pytest.approx(1)
    means = [car["mean_position"] for car in result["cars"]]
    assert means == sorted(means)
    assert sum(means) == pytest.approx(210)


def test_seed_names_the_races_whatever_the_threads(capsys: Capture) -> None:
    first = simulated(capsys, "--seed", "1", "--threads", "1")["cars"]
    assert simulated(capsys, "--seed", "1", "--threads", "2")["cars"] == first
    assert simulated(capsys, "--seed", "2")["cars"] != first


def test_plan_is_driven_by_the_driver_named(capsys: Capture) -> None:
    own = simulated(capsys, "--driver", "alo", "--plan", "s-h@12-h@30")
    assert (own["driver"], own["plan"]) == ("ALO", "S-H@12-H@30")
    stops = {car["driver"]: car["mean_stops"] for car in own["cars"]}
    drawn = {car["driver"]: car["mean_stops"] for car in simulated(capsys)["cars"]}
    assert 1.5 < stops["ALO"] <= 2, "two stops, but for races it did not finish"
    assert stops["ALO"] != drawn["ALO"]


def test_table_shows_every_car(capsys: Capture, bahrain: Any) -> None:
    assert main(["simulate", "bahrain-2023", "--races", "50", "--driver", "HAM"]) == 0
    out = capsys.readouterr().out
    assert "50 races" in out
    assert "HAM <" in out
    for car in bahrain.cars:
        assert car.driver in out
        assert car.team in out


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["atlantis-2023"], "unknown race 'atlantis-2023'; known races: "),
        (["none.toml"], "none.toml: cannot be read"),
        (["bahrain-2023", "--races", "0"], "Invalid value for '--races'"),
        (["bahrain-2023", "--races", "many"], "Invalid value for '--races'"),
        (["bahrain-2023", "--seed", "-1"], "Invalid value for '--seed'"),
        (["bahrain-2023", "--seed", "99999999999999999999"], "Invalid value for '--seed'"),
        (["bahrain-2023", "--threads", "0"], "Invalid value for '--threads'"),
        (["bahrain-2023", "--driver", "SEN"], "unknown driver 'SEN' for bahrain-2023; who started: "),
        (["bahrain-2023", "--plan", "two stops"], "plan 'two stops' does not parse"),
        (["bahrain-2023", "--plan", "S-X@20"], "plan 'S-X@20': unknown compound 'X'"),
        (["bahrain-2023", "--plan", "S"], "plan S: "),
        (["bahrain-2023", "--plan", "S-S@20"], "plan S-S@20: "),
        (["bahrain-2023", "--plan", "S-H@30-S@20"], "plan S-H@30-S@20: "),
        (["bahrain-2023", "--plan", "S-H@57"], "plan S-H@57: "),
    ],
)
def test_unusable_input_is_one_line_and_exit_code_2(capsys: Capture, arguments: list[str], message: str) -> None:
    assert main(["simulate", *arguments, "--json"]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err.startswith(f"rsrl: error: {message}")
    assert err.count("\n") == 1
