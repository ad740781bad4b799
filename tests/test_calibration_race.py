"""Whole seasons calibrated: from files of simulated laps, from the real ones where they are, and what is refused."""

import dataclasses
from pathlib import Path

import polars as pl
import pytest
from calibration_laps import known_record, simulated, write_season

from rsrl.calibration import Calibration, calibrate, figure_table, pool
from rsrl.calibration.seasons import analyse_seasons
from rsrl.errors import RsrlError
from rsrl.laps import read_seasons
from rsrl.season import Figure, RaceRecord, load_race, race_hash, read_race, write_race
from rsrl.simulator import Plan, check_plan, simulate

SEASONS = (2022, 2023)


def some_seasons() -> pl.DataFrame:
    """Bahrain and Canada of two seasons, dry, and a wet Monaco in 2023."""
    table = simulated(known_record(), 11)
    other = simulated(known_record(base_lap_s=80.0), 13).with_columns(round=pl.lit(3, dtype=pl.Int64), event=pl.lit("Canadian Grand Prix"))
    wet = simulated(known_record(), 12, (2023,)).with_columns(
        round=pl.lit(2, dtype=pl.Int64),
        event=pl.lit("Monaco Grand Prix"),
        compound=pl.when((pl.col("driver") == "HAM") & (pl.col("lap") > 50)).then(pl.lit("I")).otherwise("compound"),
    )
    return pl.concat([table, wet, other])


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("laps")
    table = some_seasons()
    for season in SEASONS:
        write_season(table, path, season)
    return path


@pytest.fixture(scope="module")
def found(folder: Path) -> Calibration:
    seen: list[tuple[int, int]] = []
    result = calibrate(folder, None, SEASONS, "the command", lambda done, total: seen.append((done, total)), workers=1)
    assert seen == [(i, 5) for i in range(1, 6)]
    return result


@pytest.fixture(scope="module")
def record(found: Calibration) -> RaceRecord:
    return found.record("bahrain-2023")


def test_record_is_whole_and_survives_its_file(record: RaceRecord, tmp_path: Path) -> None:
    write_race(record, tmp_path / "new.toml")
    assert race_hash(read_race(tmp_path / "new.toml")) == race_hash(record)
    assert (record.name, record.laps, len(record.cars), record.default_driver) == ("bahrain-2023", 57, 20, "HAM")
    assert [car.grid for car in record.cars] == list(range(1, 21))
    assert record.provenance.command == "the command"
    assert [name.split()[0] for name in record.provenance.data] == ["laps_2022.csv.gz", "laps_2023.csv.gz"]
    assert record.scaling == {}


def test_every_figure_says_what_it_rests_on(record: RaceRecord) -> None:
    figures = figure_table(record)
    assert figures.filter(pl.col("name") == "cars.VER.pace_s").height == 1
    assert figures["se"].min() >= 0  # type: ignore[operator]
    loose = figures.filter((pl.col("n") == 0) & (pl.col("note") == "") & (pl.col("se") > 0))
    assert loose.is_empty()


def test_diagnostics_tell_what_was_left_out(found: Calibration, record: RaceRecord) -> None:
    attrition = found.find("bahrain-2023").attrition
    assert attrition["filter"][0] == "read"
    assert attrition["left"][0] - attrition["removed"].sum() == attrition["left"][-1]
    told = found.diagnosis(record)
    assert (told.wet, told.laps_used) == (False, attrition["left"][-1])
    assert told.residual_sd_s is not None
    assert 0.1 < told.residual_sd_s < 0.4


def test_main_figures_are_those_simulated(record: RaceRecord) -> None:
    truth = known_record()
    for letter in ("S", "H"):
        assert record.tyres[letter].wear_s_per_lap.value == pytest.approx(truth.tyres[letter].wear_s_per_lap.value, abs=0.02)
    assert record.pit.loss_green_s.value == pytest.approx(truth.pit.loss_green_s.value, abs=1.5)
    assert record.incidents.sc_per_lap.value < 0.01


def test_a_wet_race_is_marked_fits_nothing_and_cannot_be_simulated(found: Calibration) -> None:
    wet = found.record("monaco-2023")
    assert wet.wet
    assert not found.find("monaco-2023").dry
    assert found.diagnosis(wet).warnings == ("wet",)
    assert found.diagnosis(wet).laps_used == 0
    without = pool([a for a in found.analyses if a.dry], rivals=found.model.rivals, choices=found.choices).record(
        found.find("bahrain-2023").entry
    )
    assert without.track == found.record("bahrain-2023").track
    assert without.incidents == found.record("bahrain-2023").incidents
    with pytest.raises(RsrlError, match="monaco-2023 was a wet race and there is no wet-weather model; choose a dry one"):
        simulate(wet, 10, 1)


def test_a_race_nobody_analysed_has_wider_errors(found: Calibration, record: RaceRecord) -> None:
    entry = dataclasses.replace(found.find("bahrain-2023").entry, season=2030, round=9, grand_prix="spain")
    unseen = found.model.record(entry)
    for figure in ("base_lap_s", "pass_threshold_s", "evolution_s", "start_loss_s"):
        assert getattr(unseen.track, figure).se > getattr(record.track, figure).se, figure
    assert unseen.tyres["S"].wear_s_per_lap.se > record.tyres["S"].wear_s_per_lap.se
    assert unseen.pit.loss_green_s.se > record.pit.loss_green_s.se


def test_pace_and_base_lap_may_be_given(found: Calibration) -> None:
    entry = found.find("bahrain-2023").entry
    pace = {driver: Figure(1.0 + 0.1 * i, 0.2, 5, "forecast") for i, (driver, _, _) in enumerate(entry.starters)}
    given = found.model.record(entry, pace, Figure(91.0, 0.5, 3, "forecast"))
    assert given.track.base_lap_s == Figure(91.0, 0.5, 3, "forecast")
    assert sum(car.pace_s.value for car in given.cars) == pytest.approx(0.0, abs=1e-9)
    assert given.cars[-1].pace_s.value - given.cars[0].pace_s.value == pytest.approx(1.9)
    del pace["HAM"]
    with pytest.raises(RsrlError, match="bahrain-2023: no pace given for HAM"):
        found.model.record(entry, pace)


def test_result_does_not_depend_on_the_order_or_on_later_races(found: Calibration) -> None:
    """What is pooled is what was handed over: an entry of 2023 from 2022 alone knows nothing of 2023."""
    earlier = [a for a in found.analyses if a.entry.season == 2022]
    entry = found.find("bahrain-2023").entry
    alone = pool(earlier, rivals=found.model.rivals).record(entry)
    table = some_seasons()
    again = pool(analyse_seasons(table.filter(pl.col("season") == 2022), None, workers=1), rivals=found.model.rivals).record(entry)
    assert figure_table(alone).equals(figure_table(again))


def test_files_that_cannot_be_used_are_refused(folder: Path, tmp_path: Path) -> None:
    table = some_seasons().filter(pl.col("season") == 2023)
    write_season(table.filter((pl.col("round") != 2) | (pl.col("lap") < 4)), tmp_path, 2023)
    with pytest.raises(
        RsrlError, match=r"laps_2023\.csv\.gz: row 1142: round 2 \(Monaco Grand Prix\) ends after lap 3, with 60 rows; give"
    ):
        calibrate(tmp_path, None, (2023,), "x", workers=1)
    write_season(table.filter(pl.col("round") == 2), tmp_path, 2023)
    with pytest.raises(RsrlError, match="no dry race to calibrate from in the lap files given"):
        calibrate(tmp_path, None, (2023,), "x", workers=1)
    with pytest.raises(RsrlError, match=r"laps_2021\.csv\.gz: cannot be read"):
        calibrate(folder, None, (2021, 2023), "x", workers=1)


@pytest.mark.real_data
def test_shipped_files_are_what_the_code_makes_and_what_a_strategist_expects(real_data: Path) -> None:
    found = calibrate(real_data / "laps", real_data / "facts", (2022, 2023), "x")
    for name in ("bahrain-2023", "belgium-2022"):
        fresh, shipped = found.record(name), load_race(name)
        bare = dataclasses.replace(fresh, provenance=shipped.provenance, scaling=shipped.scaling)
        mine, theirs = figure_table(bare), figure_table(shipped)
        assert mine["name"].to_list() == theirs["name"].to_list()
        for own, other in zip(mine.iter_rows(), theirs.iter_rows(), strict=True):
            assert own[1] == pytest.approx(other[1], rel=1e-3, abs=1e-4 + 0.02 * other[2]), own[0]
    bahrain, monza, spa = (found.record(n) for n in ("bahrain-2023", "italy-2023", "belgium-2023"))
    soft, medium, hard = (bahrain.tyres[c] for c in "SMH")
    assert soft.wear_s_per_lap.value > max(medium.wear_s_per_lap.value, hard.wear_s_per_lap.value) > 0.05
    assert soft.offset_s.value < 0
    assert 21.0 < bahrain.pit.loss_green_s.value < 24.0
    assert spa.pit.loss_green_s.value < 19.0
    assert bahrain.pit.loss_sc_s.value < bahrain.pit.loss_vsc_s.value < bahrain.pit.loss_green_s.value
    # C2 at Bahrain against C3, a step softer, at Monza: the track tells
    assert bahrain.tyres["M"].wear_s_per_lap.value > 1.2 * monza.tyres["H"].wear_s_per_lap.value
    assert found.record("singapore-2023").incidents.sc_per_lap.value > 1.3 * bahrain.incidents.sc_per_lap.value
    assert found.record("singapore-2023").track.pass_threshold_s.value > spa.track.pass_threshold_s.value + 0.5
    monaco = found.record("monaco-2023").track.pass_threshold_s  # wet in 2022 and 2023: from the dry races of 2018-2021
    assert monaco.value > spa.track.pass_threshold_s.value + 1.0
    assert "earlier seasons" in monaco.note
    pace = {car.driver: car.pace_s.value for car in bahrain.cars}
    order = sorted(pace, key=pace.__getitem__)
    assert order[:2] == ["VER", "PER"]
    assert set(order[2:8]) == {"LEC", "SAI", "ALO", "STR", "HAM", "RUS"}
    assert found.record("qatar-2023").max_laps_per_set == 18
    assert bahrain.drs_off_laps == 2
    assert found.record("monaco-2023").wet


@pytest.mark.real_data
def test_a_race_alone_gives_a_file_that_can_be_used(real_data: Path, tmp_path: Path) -> None:
    """Singapore 2018, of which cars that stopped behind the safety car gained time on those that did not."""
    table = read_seasons(real_data / "laps", (2018,)).filter(pl.col("event") == "Singapore Grand Prix")
    model = pool(analyse_seasons(table, real_data / "facts", workers=1))
    record = model.record(model.analyses[0].entry)
    write_race(record, tmp_path / "alone.toml")
    read = read_race(tmp_path / "alone.toml")
    assert read.pit.loss_sc_s.value < read.pit.loss_vsc_s.value < read.pit.loss_green_s.value
    for plan in read.rivals.plans:
        check_plan(Plan.parse(plan.plan), read)
