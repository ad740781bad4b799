"""Assumptions changed one by one: what each does to a race, what is refused, and that commands apply and record them."""

import json
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from synthetic_race import synthetic_race

from rsrl.cli import main
from rsrl.cli.entries import read_entries
from rsrl.errors import RsrlError
from rsrl.season import ASSUMPTIONS, RaceRecord, assume, load_race, parse_sets, race_hash, read_race, write_race
from rsrl.season.assumptions import parse_assumption

Capture = pytest.CaptureFixture[str]
EXAMPLES = {
    "pit_loss_s": "pit_loss_s=+1", "pit_loss_vsc_s": "pit_loss_vsc_s=13", "pit_loss_sc_s": "pit_loss_sc_s=x0.9", "wear.TYRE": "wear.S=x1.2",
    "offset.TYRE": "offset.H=+0.1", "sets.TYRE": "sets.M=2", "sets.DRIVER": "sets.HAM=S1M2H2",
    "pace.DRIVER": "pace.HAM=-0.2", "grid.DRIVER": "grid.HAM=3",
    "pass_threshold_s": "pass_threshold_s=+0.3", "sc_chance": "sc_chance=0", "vsc_chance": "vsc_chance=x2",
    "fuel_s_per_kg": "fuel_s_per_kg=0.03",
}  # fmt: skip

PARTS = ("track", "tyres", "pit", "incidents", "cars", "rivals")


def refusal(record: RaceRecord, *changes: str) -> str:
    with pytest.raises(RsrlError) as caught:
        assume(record, changes)
    assert "\n" not in str(caught.value)
    return str(caught.value)


def safety_car_chance(record: RaceRecord) -> float:
    i = record.incidents
    return 1 - (1 - i.sc_lap1.value) * (1 - i.sc_per_lap.value) ** (record.laps - 1)


def test_absolute_relative_and_factor(bahrain: RaceRecord) -> None:
    fitted = bahrain.tyres["S"].wear_s_per_lap
    for text, value, se in (("0.2", 0.2, 0.0), ("+0.01", fitted.value + 0.01, fitted.se), ("-0.01", fitted.value - 0.01, fitted.se)):
        figure = assume(bahrain, [f"wear.S={text}"]).tyres["S"].wear_s_per_lap
        assert figure.value == pytest.approx(value)
        assert (figure.se, figure.n) == (se, 0)
        assert figure.note == f"assumed: wear.S={text}, fitted: {fitted.value:.6g}"
    doubled = assume(bahrain, ["wear.S=x2"]).tyres["S"].wear_s_per_lap
    assert (doubled.value, doubled.se) == (2 * fitted.value, 2 * fitted.se)
    assert assume(bahrain, ["offset.S==-0.5"]).tyres["S"].offset_s.value == -0.5
    assert assume(bahrain, ["offset.S=-0.5"]).tyres["S"].offset_s.value == bahrain.tyres["S"].offset_s.value - 0.5


def test_assumptions_are_changed_in_order(bahrain: RaceRecord) -> None:
    assert assume(bahrain, ["pit_loss_s=20", "pit_loss_s=+2"]).pit.loss_green_s.value == 22
    assert assume(bahrain, ["pit_loss_s=+2", "pit_loss_s=20"]).pit.loss_green_s.value == 20
    assert assume(bahrain, []) == bahrain
    assert assume(bahrain, "pit_loss_s=20") == assume(bahrain, ["pit_loss_s=20"])


def test_each_assumption_changes_the_race_and_nothing_else_of_it(bahrain: RaceRecord, tmp_path: Path) -> None:
    assert list(EXAMPLES) == list(ASSUMPTIONS)
    hashes = {race_hash(assume(bahrain, [text])) for text in EXAMPLES.values()}
    assert len(hashes | {race_hash(bahrain)}) == len(EXAMPLES) + 1
    for text in EXAMPLES.values():
        changed = assume(bahrain, [text])
        parts = [part for part in PARTS if getattr(changed, part) != getattr(bahrain, part)]
        # a number of sets for all is for cars with sets of their own as well
        assert len(parts) == 1 or (text.startswith("sets.") and parts == ["tyres", "cars"]), text
        write_race(changed, tmp_path / "changed.toml")
        assert race_hash(read_race(tmp_path / "changed.toml")) == race_hash(changed), "a changed race is a valid season file"


def test_stops_under_safety_cars_keep_their_share_of_the_pit_loss(bahrain: RaceRecord) -> None:
    old, new = bahrain.pit, assume(bahrain, ["pit_loss_s=+2"]).pit
    assert new.loss_green_s.value == old.loss_green_s.value + 2
    for name in ("loss_vsc_s", "loss_sc_s"):
        assert getattr(new, name).value / new.loss_green_s.value == pytest.approx(getattr(old, name).value / old.loss_green_s.value)
    assert assume(bahrain, ["pit_loss_s=+2", "pit_loss_sc_s=11"]).pit.loss_sc_s.value == 11


@given(st.floats(0, 0.97))  # of more, so many a lap are refused
def test_the_chance_of_a_safety_car_is_the_one_asked_for(chance: float) -> None:
    for record in (synthetic_race(), assume(synthetic_race(), ["sc_chance=0"])):
        asked = f"{chance:.6f}"
        assert safety_car_chance(assume(record, [f"sc_chance={asked}"])) == pytest.approx(float(asked), abs=1e-9)


def test_no_chance_is_no_safety_car(bahrain: RaceRecord) -> None:
    none = assume(bahrain, ["sc_chance=0", "vsc_chance=0"]).incidents
    assert [f[:2] for f in (none.sc_lap1, none.sc_per_lap, none.vsc_per_lap)] == [(0.0, 0.0)] * 3
    twice = assume(bahrain, ["vsc_chance=x1.5"]).incidents.vsc_per_lap.value
    laps = bahrain.laps - 1
    assert 1 - (1 - twice) ** laps == pytest.approx(1.5 * (1 - (1 - bahrain.incidents.vsc_per_lap.value) ** laps))


def test_a_grid_place_moves_the_cars_between(bahrain: RaceRecord) -> None:
    before = [car.driver for car in bahrain.cars]
    assert before[:7] == ["VER", "PER", "LEC", "SAI", "ALO", "RUS", "HAM"]
    for text in ("grid.HAM=3", "grid.hamilton=-4", "grid.44=3"):
        cars = assume(bahrain, [text]).cars
        assert [car.driver for car in cars[:8]] == ["VER", "PER", "HAM", "LEC", "SAI", "ALO", "RUS", *before[7:8]]
        assert [car.grid for car in cars] == [car.grid for car in bahrain.cars]
        assert [car.driver for car in cars[7:]] == before[7:]
    back = assume(bahrain, ["grid.VER=20"]).cars
    assert [car.driver for car in back] == [*before[1:], "VER"]


def test_compounds_go_by_letter_colour_or_c_number(bahrain: RaceRecord) -> None:
    assert bahrain.tyres["S"].c_number == "C3"
    values = [assume(bahrain, [f"wear.{word}=0.2"]).tyres["S"].wear_s_per_lap.value for word in ("S", "s", "soft", "SOFT", "C3", "c3")]
    assert values == [0.2] * 6


def test_sets_of_all_cars(bahrain: RaceRecord) -> None:
    assert parse_sets("S3M2H2") == parse_sets("all=m2 s3H2".replace(" ", "")) == ("sets.S=3", "sets.M=2", "sets.H=2")
    changed = assume(bahrain, parse_sets("S1M2H2"))
    assert changed.sets == (1, 2, 2)
    assert 0 < len(changed.rivals.plans) < len(bahrain.rivals.plans), "plans with two softs cannot be driven any more"
    assert all(plan.plan.count("S") <= 1 for plan in changed.rivals.plans)
    assert [plan for plan in changed.published if plan.count("S") > 1] == []
    assert "needs more sets of H" in refusal(bahrain, "sets.H=0", "sets.M=0")


def test_the_guide_lists_every_name() -> None:
    guide = (Path(__file__).parents[1] / "docs" / "how-to" / "names-and-assumptions.md").read_text(encoding="utf-8")
    assert [name for name in ASSUMPTIONS if f"`{name}`" not in guide] == []


@pytest.mark.parametrize("text", ["", "S3", "S3M2", "S3M2H2X1", "SMH", "3-2-2", "ALL=", "=S3M2H2", "S3M2H", "HAM=S3", "HAM=S3M2H2u"])
def test_sets_that_do_not_parse(text: str) -> None:
    with pytest.raises(RsrlError, match="write the sets of all three compounds, such as S2M1H2"):
        parse_sets(text)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("pit_los=1", f"unknown name 'pit_los'; names are {', '.join(ASSUMPTIONS)}"),
        ("wear=1", "unknown name 'wear'; names are "),
        ("pit_loss_s.HAM=1", "unknown name 'pit_loss_s.HAM'; names are "),
        ("=1", "unknown name ''"),
        ("", "unknown name ''"),
        ("pit_loss_s", "write NAME=20 for a value"),
        ("pit_loss_s=", "write NAME=20 for a value"),
        ("pit_loss_s=much", "write NAME=20 for a value"),
        ("pit_loss_s=nan", "write NAME=20 for a value"),
        ("pit_loss_s=inf", "write NAME=20 for a value"),
        ("pit_loss_s=x-1", "write NAME=20 for a value"),
        (f"pit_loss_s={'9' * 400}", "write NAME=20 for a value"),
        ("pit_loss_s=+100", "loss_green_s would be 122.284, outside the believable range 8 to 50"),
        ("wear.X=1", "unknown compound 'X'; compounds are S, M, H (S is C3, M is C2, H is C1)"),
        ("wear.C5=1", "unknown compound 'C5'"),
        ("pace.SEN=1", "unknown driver 'SEN' for bahrain-2023"),
        ("grid.SEN=1", "unknown driver 'SEN' for bahrain-2023"),
        ("grid.HAM=0", "write a place on the grid, 1 to 20 at bahrain-2023"),
        ("grid.HAM=21", "write a place on the grid"),
        ("grid.HAM=x2", "write a place on the grid"),
        ("grid.HAM=1.5", "write a place on the grid"),
        ("sc_chance=1", "sc_chance would be 1; a chance is from 0 to below 1"),
        ("sc_chance=-0.9", "a chance is from 0 to below 1"),
        ("sc_chance=0.999999999999999", "sc_per_lap would be "),
        ("sets.S=99", "write a number of sets, 0 to 20"),
        ("sets.S=1.5", "write a number of sets, 0 to 20"),
        ("sets.S=x2", "write a number of sets, 0 to 20"),
    ],
)
def test_what_cannot_be_assumed_is_refused_in_one_line(bahrain: RaceRecord, text: str, message: str) -> None:
    assert message in refusal(bahrain, text)


@given(
    st.text(max_size=16)
    | st.tuples(st.sampled_from(["pit_loss_s", "grid.HAM", "wear.S"]), st.text("=+-x.0123 e", max_size=8)).map("=".join)
)
def test_any_text_is_an_assumption_or_refused(text: str) -> None:
    try:
        found = parse_assumption(text)
    except RsrlError:
        return
    assert found.change in ("=", "+", "x")
    assert abs(found.amount) < 1e17


COMMANDS = {
    "simulate": ["simulate", "bahrain-2023"],
    "plan": ["plan", "bahrain-2023"],
    "evaluate": ["evaluate", "all", "--race", "bahrain-2023"],
    "explain": ["explain", "all", "--race", "bahrain-2023", "--lap", "5"],
    "train": ["train", "bahrain-2023", "--out", "run"],
}


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_takes_assumptions(command: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Capture) -> None:
    monkeypatch.chdir(tmp_path)
    for options, message in (
        (["--set", "pit_loss_s=+1", "--set", "luck=1"], f"--set luck=1: unknown name 'luck'; names are {', '.join(ASSUMPTIONS)}"),
        (["--sets", "HAM=S1M2"], "--sets HAM=S1M2: write the sets of all three compounds, such as S2M1H2 (sets of soft"),
        (["--sets", "S2M2H2", "--sets", "SEN=S1M2H2"], "unknown driver 'SEN' for bahrain-2023"),
    ):
        assert main([*COMMANDS[command], *options]) == 2
        out, err = capsys.readouterr()
        assert out == ""
        assert err.startswith(f"rsrl: error: {message}")
        assert err.count("\n") == 1


def test_training_learns_from_the_changed_races() -> None:
    changed = read_entries("monza-2023,spain-2023,Italian GP 2023", "44", ["pit_loss_s=20"])
    assert changed.name == "italy-2023,spain-2023"
    assert changed.driver == "HAM"
    assert [record.pit.loss_green_s.value for record in changed.records] == [20, 20]
    assert read_entries("monza-2023", None, None, ["S3M2H2"]).records[0].sets == (3, 2, 2)


def test_a_tree_is_not_fitted_for_changed_figures(capsys: Capture) -> None:
    assert main(["explain", "all", "--race", "bahrain-2023", "--fit-tree", "--set", "sc_chance=0"]) == 2
    assert "--fit-tree with --set or --sets: a tree is stored for the race's own figures" in capsys.readouterr().err


def test_results_are_those_of_the_changed_race_and_say_so(capsys: Capture, tmp_path: Path) -> None:
    changes = ["pit_loss_s=+5", "sc_chance=0", "grid.HAM=1"]
    options = [word for change in changes for word in ("--set", change)]
    assert main(["simulate", "Bahrain 2023", "--races", "200", "--driver", "hamilton", *options, "--json"]) == 0
    by_option = json.loads(capsys.readouterr().out)
    assert by_option["provenance"]["assumptions"] == changes
    write_race(assume(load_race("bahrain-2023"), changes), tmp_path / "own.toml")
    assert main(["simulate", str(tmp_path / "own.toml"), "--races", "200", "--json"]) == 0
    by_file = json.loads(capsys.readouterr().out)
    assert by_option["cars"] == by_file["cars"]
    assert next(car for car in by_option["cars"] if car["driver"] == "HAM")["grid"] == 1
    assert "assumptions" not in by_file["provenance"]
    assert main(["simulate", "bahrain-2023", "--races", "20", *options]) == 0
    assert capsys.readouterr().out.startswith("Assumed: pit_loss_s=+5, sc_chance=0, grid.HAM=1\n")
