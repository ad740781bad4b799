"""A whole race calibrated: from files of simulated laps, from the real ones where they are, and what is refused."""

import gzip
from dataclasses import replace
from pathlib import Path

import polars as pl
import pytest
from calibration_laps import known_record, simulated

from rsrl.calibration import CalibrationResult, calibrate_race
from rsrl.errors import RsrlError
from rsrl.season import RaceRecord, load_race, race_hash, read_race, write_race

NAMES = {"S": "SOFT", "M": "MEDIUM", "H": "HARD", "I": "INTERMEDIATE"}


def write_season(table: pl.DataFrame, folder: Path, season: int) -> None:
    out = table.filter(pl.col("season") == season).with_columns(pl.col("compound").replace(NAMES))
    out = out.rename({"tyre_life_laps": "tyre_life", "pit_in_s": "pit_in", "pit_out_s": "pit_out"})
    (folder / f"laps_{season}.csv.gz").write_bytes(gzip.compress(out.write_csv().encode()))


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("laps")
    table = simulated(known_record(), 11)
    for season in (2022, 2023):
        write_season(table, path, season)
    return path


@pytest.fixture(scope="module")
def result(folder: Path) -> CalibrationResult:
    said: list[str] = []
    found = calibrate_race("bahrain-2023", folder, None, (2022, 2023), "the command", said.append)
    assert said[0] == "reading laps"
    return found


def test_record_is_whole_and_survives_its_file(result: CalibrationResult, tmp_path: Path) -> None:
    record = result.record
    write_race(record, tmp_path / "new.toml")
    assert race_hash(read_race(tmp_path / "new.toml")) == race_hash(record)
    assert (record.name, record.laps, len(record.cars), record.default_driver) == ("bahrain-2023", 57, 20, "HAM")
    assert [car.grid for car in record.cars] == list(range(1, 21))
    assert record.provenance.command == "the command"
    assert [name.split()[0] for name in record.provenance.data] == ["laps_2022.csv.gz", "laps_2023.csv.gz"]
    assert record.scaling == {}


def test_diagnostics_tell_what_was_left_out(result: CalibrationResult) -> None:
    attrition = result.attrition
    assert attrition["filter"][0] == "read"
    assert attrition["left"][0] - attrition["removed"].sum() == attrition["left"][-1] == result.record.provenance.laps_used
    assert 0.1 < result.residual_sd_s < 0.4
    assert result.figures.filter(pl.col("name") == "cars.VER.pace_s").height == 1
    assert result.figures["se"].min() >= 0  # type: ignore[operator]


def test_main_figures_are_those_simulated(result: CalibrationResult) -> None:
    truth = known_record()
    found = result.record
    for letter in ("S", "H"):
        assert found.tyres[letter].wear_s_per_lap.value == pytest.approx(truth.tyres[letter].wear_s_per_lap.value, abs=0.02)
    assert found.pit.loss_green_s.value == pytest.approx(truth.pit.loss_green_s.value, abs=1.0)
    assert found.incidents.sc_per_lap.value < 0.01


def test_wet_and_hardly_run_races_are_refused(folder: Path, tmp_path: Path) -> None:
    table = simulated(known_record(), 12, (2023,))
    wet = table.with_columns(compound=pl.when((pl.col("driver") == "HAM") & (pl.col("lap") > 50)).then(pl.lit("I")).otherwise("compound"))
    write_season(wet, tmp_path, 2023)
    with pytest.raises(RsrlError, match="bahrain-2023: was a wet race"):
        calibrate_race("bahrain-2023", tmp_path, None, (2023,), "x", lambda _: None)
    write_season(table.filter(pl.col("lap") < 4), tmp_path, 2023)
    with pytest.raises(RsrlError, match="bahrain-2023: 60 laps of 20 cars is no whole race"):
        calibrate_race("bahrain-2023", tmp_path, None, (2023,), "x", lambda _: None)
    with pytest.raises(RsrlError, match=r"laps_2021\.csv\.gz: cannot be read"):
        calibrate_race("bahrain-2023", folder, None, (2021, 2023), "x", lambda _: None)


@pytest.mark.real_data
def test_bahrain_2023_is_what_a_strategist_expects(real_data: Path) -> None:
    found = calibrate_race("bahrain-2023", real_data / "laps", real_data / "facts", (2022, 2023), "x", lambda _: None).record
    assert race_hash(_bare(found)) == race_hash(_bare(load_race("bahrain-2023")))  # the shipped file is what the code makes
    soft, medium, hard = (found.tyres[c] for c in "SMH")
    assert soft.wear_s_per_lap.value > medium.wear_s_per_lap.value > hard.wear_s_per_lap.value > 0.05
    assert soft.offset_s.value < 0 < hard.offset_s.value
    assert 21.5 < found.pit.loss_green_s.value < 24.0
    assert found.pit.loss_sc_s.value < found.pit.loss_vsc_s.value < found.pit.loss_green_s.value
    pace = {car.driver: car.pace_s.value for car in found.cars}
    order = sorted(pace, key=pace.__getitem__)
    assert order[:2] == ["VER", "PER"]
    assert set(order[2:8]) == {"LEC", "SAI", "ALO", "STR", "HAM", "RUS"}
    assert found.cars[-1].driver == "GAS"


def _bare(record: RaceRecord) -> RaceRecord:
    return replace(record, scaling={})
