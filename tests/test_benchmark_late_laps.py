"""Errors of laps late in their stints: on simulated laps whose tyres are known, rightly and wrongly forecast; and the whole script."""

import dataclasses
import sys
from pathlib import Path

import numpy as np
import pytest
from calibration_laps import known_record, lap_table
from docs_pages import benchmark
from invented_seasons import FIT, TEST, invented_races, write_files

from rsrl.evaluation.backtest import without
from rsrl.evaluation.backtest.late_laps import over_laps, rms, stint_errors
from rsrl.results import LateLapsRace, LateLapsResult, read_result
from rsrl.season import RaceRecord
from rsrl.simulator import trace_races

NOISE_S = 0.1


@pytest.fixture(scope="module")
def known() -> RaceRecord:
    return without(known_record(lap_noise_sd_s=NOISE_S), "traffic")


def with_wear(record: RaceRecord, more_s_per_lap: float) -> RaceRecord:
    tyres = {
        c: dataclasses.replace(t, wear_s_per_lap=t.wear_s_per_lap._replace(value=t.wear_s_per_lap.value + more_s_per_lap))
        for c, t in record.tyres.items()
    }
    return dataclasses.replace(record, tyres=tyres)


def test_late_laps_are_as_the_true_tyres_say_and_off_by_what_wrong_ones_lack(known: RaceRecord) -> None:
    laps = lap_table(known, trace_races(known, 1, 4), 2023, range(1, 2))
    right, kind = stint_errors(laps, known), stint_errors(laps, with_wear(known, -0.06))
    assert len(right.late) == len(kind.late) > 30
    assert len(right.early) > 3 * len(right.late)
    assert np.median(np.abs(right.late)) < 2.5 * NOISE_S
    longer = kind.late - right.late  # a set wears more than that record says: by its age less that of the stint's earlier laps
    assert (longer > 0.06).all()
    assert 0.06 * 5 < np.median(longer) < 0.06 * 25
    assert rms(kind.late) > rms(kind.early) > rms(right.early)


def test_the_level_of_a_stint_does_not_count(known: RaceRecord) -> None:
    laps = lap_table(known, trace_races(known, 1, 4), 2023, range(1, 2))
    slow = dataclasses.replace(known, track=dataclasses.replace(known.track, base_lap_s=known.track.base_lap_s._replace(value=99.0)))
    assert stint_errors(laps, slow).late == pytest.approx(stint_errors(laps, known).late, abs=1e-6)
    soft = dataclasses.replace(known.tyres["S"], offset_s=known.tyres["S"].offset_s._replace(value=2.0))
    other = dataclasses.replace(known, tyres=known.tyres | {"S": soft})
    assert stint_errors(laps, other).late == pytest.approx(stint_errors(laps, known).late, abs=1e-6)


def test_root_mean_squares_are_over_laps_not_races() -> None:
    races = [LateLapsRace("a", 30, 0.3, 0.4, 10, 0.2, 0.2), LateLapsRace("b", 10, 0.7, 0.4, 30, 0.2, 0.2)]
    found = over_laps(races)
    assert found["late_s"].mean == pytest.approx(np.sqrt((30 * 0.09 + 10 * 0.49) / 40))
    assert found["late_less_s"].mean == pytest.approx(found["late_s"].mean - 0.4)
    assert found["early_less_s"].mean == 0.0
    assert found["late_s"].low == pytest.approx(0.3)
    assert found["late_s"].high == pytest.approx(0.7)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    found = tmp_path_factory.mktemp("late")
    write_files(invented_races(), found)
    return found


def call(folder: Path, monkeypatch: pytest.MonkeyPatch, *fit: int) -> int:
    script = benchmark("late_laps")
    words = [str(TEST), "--fit", *map(str, fit), "--laps", str(folder / "laps"), "--facts", str(folder / "facts")]
    monkeypatch.setattr(sys, "argv", ["late_laps.py", *words, "--out", str(folder / "late_laps.json")])
    return int(script.run(script.SCRIPT, script.parser(), script.measure, script.late_laps_table))


@pytest.mark.slow
def test_the_script_forecasts_every_race(folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    assert call(folder, monkeypatch, *FIT) == 0
    found = read_result(folder / "late_laps.json", LateLapsResult, "late_laps.py")
    assert (found.fit, found.test) == (FIT, TEST)
    assert found.races
    assert found.overall["late_s"].low <= found.overall["late_s"].mean <= found.overall["late_s"].high
    assert found.provenance.command == f"python benchmarks/late_laps.py {TEST} --laps LAPS_FOLDER --facts FACTS_FOLDER --fit 2031 2032"
    assert capsys.readouterr().out.count("\n| ") >= 2


def test_a_later_season_cannot_be_fitted(folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    assert call(folder, monkeypatch, TEST) == 2
    assert f"--fit {TEST} is not before {TEST}" in capsys.readouterr().err
