"""Season records survive their TOML file, and no figure goes unchecked."""

import dataclasses
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rsrl.calibration.rules import drs_off_laps
from rsrl.errors import RsrlError
from rsrl.season import (
    Figure,
    Provenance,
    RaceRecord,
    RivalPlan,
    load_race,
    race_hash,
    race_names,
    read_race,
    shipped_folder,
    write_race,
)
from rsrl.season.bounds import BOUNDS

TEXT = st.text(st.characters(exclude_categories=["Cs"]), max_size=20)


def figure_names(kind: Any) -> Iterator[str]:
    """Names of all figures in a record type and the records in it."""
    for f in dataclasses.fields(kind):
        if f.type is Figure or f.type == Figure | None:
            yield f.name
        else:
            inner = [t for t in (f.type, *getattr(f.type, "__args__", ())) if dataclasses.is_dataclass(t)]
            for t in inner:
                yield from figure_names(t)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("season")


def through_file(record: RaceRecord, folder: Path) -> RaceRecord:
    path = folder / "race.toml"
    write_race(record, path)
    return read_race(path)


def test_every_figure_has_a_believable_range() -> None:
    names = list(figure_names(RaceRecord))
    assert len(names) > 40
    assert set(names) == set(BOUNDS)


@pytest.mark.parametrize("path", sorted(shipped_folder().glob("*.toml")), ids=lambda p: p.stem)
def test_shipped_files_read_back_as_written(path: Path, folder: Path) -> None:
    record = read_race(path)
    assert record.name == path.stem
    assert through_file(record, folder) == record
    assert (folder / "race.toml").read_text(encoding="utf-8") == path.read_text(encoding="utf-8")


def test_drs_is_off_for_two_laps_until_2023_and_for_one_from_2024() -> None:
    rules = {(record.season, record.drs_off_laps) for record in map(load_race, race_names())}
    assert rules == {(2022, 2), (2023, 2), (2024, 1), (2025, 1)}
    assert [drs_off_laps(season) for season in (2018, 2023, 2024, 2025)] == [2, 2, 1, 1]


@given(
    value=st.floats(*BOUNDS["base_lap_s"]),
    se=st.floats(0, 10),
    n=st.integers(0, 10**9),
    note=TEXT,
    event=TEXT,
    published=st.lists(TEXT, max_size=3),
    scaling=st.dictionaries(TEXT.filter(bool), st.tuples(st.floats(-1e6, 1e6), st.floats(-1e6, 1e6)), max_size=4),
)
def test_any_record_survives_its_file(
    bahrain: RaceRecord,
    folder: Path,
    value: float,
    se: float,
    n: int,
    note: str,
    event: str,
    published: list[str],
    scaling: dict[str, tuple[float, float]],
) -> None:
    track = dataclasses.replace(bahrain.track, base_lap_s=Figure(value, se, n, note))
    record = dataclasses.replace(bahrain, track=track, event=event, published=tuple(published), scaling=scaling)
    read = through_file(record, folder)
    assert (read.event, read.published, set(read.scaling)) == (event, tuple(published), set(scaling))
    figure = read.track.base_lap_s
    assert (figure.n, figure.note) == (n, note)
    assert figure.value == pytest.approx(value, rel=1e-5)
    assert figure.se == pytest.approx(se, rel=1e-2, abs=1e-300)
    assert through_file(read, folder) == read, "what was read once is read the same ever after"
    assert race_hash(read) == race_hash(record)


def test_rules_survive_their_file_and_those_of_every_race_are_left_out(bahrain: RaceRecord, folder: Path) -> None:
    three = dataclasses.replace(bahrain, min_sets=3, following_aid="overtake")
    assert through_file(three, folder) == three
    assert race_hash(three) != race_hash(bahrain)
    assert "min_sets" in (folder / "race.toml").read_text(encoding="utf-8")
    through_file(bahrain, folder)
    assert not {"min_sets", "following_aid"} & set((folder / "race.toml").read_text(encoding="utf-8").split())


def test_figures_that_a_file_may_lack_survive_it_and_are_left_out_without(bahrain: RaceRecord, folder: Path) -> None:
    assert bahrain.incidents.sc_per_retirement is not None
    assert through_file(bahrain, folder) == bahrain
    alone = dataclasses.replace(bahrain.incidents, sc_per_retirement=None, vsc_per_retirement=None, sc_per_retirement_lap1=None)
    cars = tuple(dataclasses.replace(car, team_form_share=None) for car in bahrain.cars)
    record = dataclasses.replace(bahrain, incidents=alone, cars=cars)
    assert through_file(record, folder) == record
    assert race_hash(record) != race_hash(bahrain)
    text = (folder / "race.toml").read_text(encoding="utf-8")
    assert "per_retirement" not in text
    assert "team_form_share" not in text


def test_hash_names_the_figures_and_not_when_they_were_made(bahrain: RaceRecord) -> None:
    later = dataclasses.replace(bahrain, provenance=Provenance("other", "2030-01-01", "9", bahrain.provenance.data, *_laps(bahrain)))
    other = dataclasses.replace(bahrain, laps=bahrain.laps - 1)
    assert race_hash(later) == race_hash(bahrain) != race_hash(other)


def test_whole_numbers_in_a_record_are_the_same_figures_as_those_read_back(bahrain: RaceRecord, folder: Path) -> None:
    rivals = dataclasses.replace(bahrain.rivals, plans=(RivalPlan("S-H@14-H@31", 8),))
    incidents = dataclasses.replace(bahrain.incidents, vsc_laps=(0, 1))
    record = dataclasses.replace(bahrain, rivals=rivals, incidents=incidents, scaling={"gap_s": (0, 1)})
    assert race_hash(through_file(record, folder)) == race_hash(record)


def _laps(record: RaceRecord) -> tuple[int, int]:
    return record.provenance.laps_used, record.provenance.laps_read


def test_written_into_a_folder_that_is_made_for_it(bahrain: RaceRecord, tmp_path: Path) -> None:
    write_race(bahrain, tmp_path / "new" / "bahrain-2023.toml")
    assert load_race("bahrain-2023", tmp_path / "new") == bahrain


def test_unwritable_place_is_named(bahrain: RaceRecord, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("", encoding="utf-8")
    with pytest.raises(RsrlError, match=r"file/race\.toml: cannot be written \(.+\); choose another folder"):
        write_race(bahrain, tmp_path / "file" / "race.toml")
