"""`benchmarks/passes.py`: passes in the races of known season files, counted alike on both sides; and what its options refuse."""

import sys
from pathlib import Path
from types import ModuleType

import pytest
from docs_pages import benchmark
from invented_seasons import TEST, InventedRace
from season_file_runs import words, written

from rsrl.evaluation.season_statistics import passes, simulated_races
from rsrl.results import PassesRace, PassesResult, read_result

SIMULATED = 12


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("passes")


@pytest.fixture(scope="module")
def races(folder: Path) -> list[InventedRace]:
    return written(folder)


@pytest.fixture
def script() -> ModuleType:
    return benchmark("passes")


def call(script: ModuleType, arguments: list[str], monkeypatch: pytest.MonkeyPatch) -> int:
    monkeypatch.setattr(sys, "argv", arguments)
    parser = script.options_of(script.SCRIPT, script.__doc__, SIMULATED)
    return int(script.run(script.SCRIPT, parser, script.measure, script.passes_table))


def test_real_passes_are_those_of_the_trace_and_simulated_ones_are_near(
    races: list[InventedRace], folder: Path, script: ModuleType, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert call(script, words(folder, "passes"), monkeypatch) == 0
    found = read_result(folder / "passes.json", PassesResult, "passes.py")
    assert [(r.race, r.real) for r in found.races] == [(r.record.name, passes(simulated_races(r.record, r.trace)[0])) for r in races]
    season = found.seasons[0]
    assert (season.season, season.races) == (str(TEST), len(races))
    for side in (season.real_stops, season.rivals_decide):  # the season files are the truth
        assert side.ratio == pytest.approx(1.0, abs=0.5)
    assert str(folder) not in found.provenance.command
    assert f"| {TEST} | {len(races)} | {season.real:.1f} |" in capsys.readouterr().out


def test_ratios_are_of_means_and_two_seasons_have_a_row_together(script: ModuleType) -> None:
    found = [PassesRace("a", 2022, 10.0, 20.0, 1.0, 30.0, 1.0), PassesRace("b", 2022, 30.0, 20.0, 1.0, 90.0, 1.0)]
    season = script.over("2022", found)
    assert (season.real, season.real_stops.ratio, season.rivals_decide.ratio) == (20.0, 1.0, 3.0)
    assert season.rivals_decide.ci95 == pytest.approx((3.0, 3.0))  # the same ratio in both
    low, high = season.real_stops.ci95
    assert low < 1.0 < high


@pytest.mark.parametrize(
    ("more", "message"),
    [
        (["--races", "1"], "--races 1: simulate two at least"),
        (["--only", "monza-2023"], "no season file monza-2023 in 2033"),
        (["--laps", "nowhere"], "nowhere"),
    ],
)
@pytest.mark.usefixtures("races")
def test_bad_options_end_in_one_line(
    more: list[str],
    message: str,
    folder: Path,
    script: ModuleType,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert call(script, words(folder, "passes", *more), monkeypatch) == 2
    said = capsys.readouterr().err.splitlines()
    assert len(said) == 1
    assert message in said[0]


@pytest.mark.usefixtures("races")
def test_a_season_without_a_file_is_refused(
    folder: Path, script: ModuleType, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = words(folder, "passes")
    arguments.insert(1, "1999")
    assert call(script, arguments, monkeypatch) == 2
    assert "no season file of 1999" in capsys.readouterr().err
