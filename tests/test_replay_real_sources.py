"""Real recordings through the race tracker and `rsrl replay`: what is called, tracked and refused."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import polars as pl
import pytest

from rsrl.cli import main
from rsrl.feeds.anomalies import Anomalies
from rsrl.feeds.recordings import open_source
from rsrl.laps.schema import COMPOUND_LETTERS
from rsrl.season import SC
from rsrl.translators import RaceTracker

pytestmark = pytest.mark.real_data

Capture = pytest.CaptureFixture[str]
AZERBAIJAN, QATAR, SPRINT = "azerbaijan_2018_race", "australia_2023_race_timing", "sao_paulo_2025_sprint_signalr.txt.gz"


def replayed(capsys: Capture, source: Path, *arguments: str) -> dict[str, Any]:
    assert main(["replay", str(source), *arguments, "--json"]) == 0
    found: dict[str, Any] = json.loads(capsys.readouterr().out)
    return found


def tracked(source: Path) -> RaceTracker:
    tracker = RaceTracker()
    for event in open_source(str(source), Anomalies()).events:
        tracker.take(event)
    return tracker


def rows_of(real_data: Path, season: int, number: int) -> Iterator[dict[str, Any]]:
    table = pl.read_csv(real_data / "laps" / f"laps_{season}.csv.gz", infer_schema_length=None)
    return table.filter(pl.col("round") == number).iter_rows(named=True)


def test_azerbaijan_2018_is_called_with_the_figures_of_2022(real_data: Path, capsys: Capture) -> None:
    """Compounds of 2018 have letters once three names have been seen, on lap 2; the race of HAM is what it was."""
    found = replayed(capsys, real_data / "livetiming" / AZERBAIJAN, "--driver", "HAM", "--season-from", "azerbaijan-2022")
    assert (found["race"], found["season"], found["total_laps"], found["finished"]) == ("azerbaijan-2018", 2018, 51, True)
    laps = found["laps"]
    assert [lap["lap"] for lap in laps] == list(range(1, 52))
    assert all(lap["call"] in lap["legal"] for lap in laps[2:])
    assert [(lap["lap"], lap["team"]) for lap in laps if lap["team"] not in (None, "no pit")] == [(22, "pit hard"), (40, "pit soft")]
    assert laps[-1]["position"] == 1
    assert {look["why"] for lap in laps for look in lap["looks"]} >= {"safety car", "green", "pit entry", "BOT boxes"}
    assert not [look for lap in laps for look in lap["looks"] if look["why"] == "no data"], "a whole archive has no silence"


def test_azerbaijan_2018_has_no_season_file_of_its_own(real_data: Path, capsys: Capture) -> None:
    found = replayed(capsys, real_data / "livetiming" / AZERBAIJAN, "--driver", "RIC")
    assert "no season file of azerbaijan-2018" in found["note"]
    assert found["finished"] is False
    assert all("call" not in lap for lap in found["laps"])


@pytest.mark.parametrize(("name", "season", "number", "without"), [(AZERBAIJAN, 2018, 4, {7}), (QATAR, 2023, 17, set())])
def test_tracked_stints_and_safety_car_laps_are_those_of_the_lap_file(
    real_data: Path, name: str, season: int, number: int, without: set[int]
) -> None:
    """Car 7 in Azerbaijan: the lap file believed the feed, which called its third stint one without a change until its second stop."""
    tracker = tracked(real_data / "livetiming" / name)
    every = list(rows_of(real_data, season, number))
    rows = [row for row in every if row["driver_number"] not in without and row["compound"]]
    stints = {(car.number, lap): car.stint_at(lap - 1) for car in tracker.cars.values() for lap in range(1, car.laps + 2)}
    different = [row for row in rows if (row["driver_number"], row["lap"]) in stints]
    assert len(different) > 750
    for row in different:
        stint = stints[row["driver_number"], row["lap"]]
        assert stint is not None
        assert stint.compound == COMPOUND_LETTERS[row["compound"]]
    if name == AZERBAIJAN:
        leaders = {row["lap"] for row in every if row["position"] == 1 and "4" in str(row["track_status"])}
        spans = [*tracker.spans, tracker.spans[0]._replace(lap=tracker.leader_laps + 1)]
        ours = {lap for span, after in zip(spans, spans[1:], strict=False) if span.status == SC for lap in range(span.lap, after.lap + 1)}
        assert ours == leaders


def test_a_race_that_the_source_does_not_name_is_named(real_data: Path, capsys: Capture) -> None:
    """Qatar 2023, without track status and lap count: what is missing is said, and no call is more than of low confidence."""
    found = replayed(capsys, real_data / "livetiming" / QATAR, "--race", "qatar-2023", "--driver", "VER")
    called = [lap for lap in found["laps"] if "call" in lap]
    assert len(called) > 50
    assert {lap["confidence"] for lap in called} == {"low"}
    assert "the distance: the season file's 57 laps are assumed" in called[20]["health"]["missing"]


def test_a_sprint_joined_late_is_followed_to_its_flag(real_data: Path, capsys: Capture) -> None:
    found = replayed(capsys, real_data / "livetiming" / SPRINT, "--driver", "NOR")
    assert "name it with --race" in found["note"]
    assert found["laps"][0]["lap"] in (8, 9)
    assert found["laps"][-1]["position"] == 1


@pytest.mark.parametrize(("name", "message"), [("spain_2024_qualifying", "this is a qualifying session"), ("absent", "cannot be read")])
def test_what_is_refused(real_data: Path, capsys: Capture, name: str, message: str) -> None:
    assert main(["replay", str(real_data / "livetiming" / name), "--driver", "HAM"]) == 2
    assert message in capsys.readouterr().err
