"""What a model learns from: the races and cars that words name, the environments made of them, the range trained on."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from synthetic_race import synthetic_race

from rsrl.agents import DqnConfig, DrqnConfig, RsrlConfig
from rsrl.cli.entries import Entries, environment_factory, read_entries, trained_range
from rsrl.environment import RaceEnvironment
from rsrl.errors import RsrlError
from rsrl.rollouts import BranchingRaces
from rsrl.season import Figure, group_races, load_race, race_hash, write_race
from rsrl.state import FIGURES, context_figures


def names_of(entries: Entries) -> list[str]:
    return list(dict.fromkeys(record.name for record in entries.records))


def test_one_race_is_one_car() -> None:
    entries = read_entries("bahrain-2023", None)
    assert (entries.name, entries.driver, len(entries.pairs)) == ("bahrain-2023", "HAM", 1)
    record, car = entries.pairs[0]
    assert record.cars[car].driver == "HAM"
    assert read_entries("bahrain-2023", "ALO").driver == "ALO"


def test_all_cars_of_a_race() -> None:
    entries = read_entries("bahrain-2023", "all")
    assert entries.driver == ""
    assert entries.cars == tuple(range(20))
    assert names_of(entries) == ["bahrain-2023"]


def test_several_races_are_all_their_cars_or_one_drivers() -> None:
    entries = read_entries("bahrain-2023, spain-2023,bahrain-2023,", None)
    assert entries.name == "bahrain-2023,spain-2023"
    assert names_of(entries) == ["bahrain-2023", "spain-2023"]
    assert (entries.driver, len(entries.pairs)) == ("", 40)
    one = read_entries("bahrain-2023,spain-2023", "ALO")
    assert [record.cars[car].driver for record, car in one.pairs] == ["ALO", "ALO"]
    assert one.driver == "ALO"


def test_a_group_is_its_races_with_all_their_cars() -> None:
    entries = read_entries("rsrl-2", None)
    assert entries.name == "rsrl-2"
    assert tuple(names_of(entries)) == group_races("rsrl-2")
    assert len(entries.pairs) == sum(len(load_race(name).cars) for name in group_races("rsrl-2"))
    assert read_entries("rsrl-1", None).driver == "", "a group of one race is a group"


def test_a_season_file_can_be_learned_from(tmp_path: Path) -> None:
    record = synthetic_race()
    write_race(record, tmp_path / "own.toml")
    entries = read_entries(str(tmp_path / "own.toml"), None)
    assert (entries.name, entries.driver, entries.pairs[0][1]) == (record.name, "C05", 5)


@pytest.mark.parametrize(
    ("races", "driver", "message"),
    [
        ("atlantis-2023", None, "unknown race 'atlantis-2023'"),
        ("bahrain-2023,atlantis-2023", None, "unknown race 'atlantis-2023'"),
        ("rsrl-3", None, "rsrl-3"),
        (" , ", None, "no race in ' , '; name one such as bahrain-2023"),
        ("bahrain-2023", "XXX", "unknown driver 'XXX' for bahrain-2023"),
        ("bahrain-2023,spain-2023", "DOO", "unknown driver 'DOO' for bahrain-2023"),
        ("netherlands-2023", None, "netherlands-2023 was a wet race and there is no wet-weather model"),
        ("bahrain-2023,netherlands-2023", "all", "netherlands-2023 was a wet race"),
    ],
)
def test_what_cannot_be_learned_from_is_told_in_one_line(races: str, driver: str | None, message: str) -> None:
    with pytest.raises(RsrlError, match=message) as caught:
        read_entries(races, driver)
    assert "\n" not in str(caught.value)


def test_the_environment_is_the_learners() -> None:
    one, many = read_entries("bahrain-2023", None), read_entries("rsrl-2", None)
    paper = environment_factory(one)(DrqnConfig())
    assert isinstance(paper, RaceEnvironment)
    assert (paper.feature_set, paper.record.name, paper.car) == ("paper", "bahrain-2023", one.cars[0])
    for entries in (one, many):
        for feature_set in ("full", "named"):
            races = environment_factory(entries)(RsrlConfig(feature_set=feature_set))
            assert isinstance(races, BranchingRaces)
            assert races.feature_set == feature_set
    for entries in (many, read_entries("bahrain-2023", "all")):
        with pytest.raises(RsrlError, match="dqn learns one race for one car, as in the paper; name one race and one driver"):
            environment_factory(entries)(DqnConfig())


def loose(name: str) -> Entries:
    """Two cars of a made-up race, and of another of its kind, whose loss in the pits is known to 2 s."""
    record = synthetic_race()
    record = dataclasses.replace(record, pit=dataclasses.replace(record.pit, loss_green_s=Figure(20.0, 2.0, 9)))
    other = dataclasses.replace(record, name="spain-2099", laps=18)
    records = (record, record, other, other) if name == "several" else (record, record)
    return Entries(name, records, (2, 9, 2, 9)[: len(records)], "")


def test_one_race_is_learned_as_it_is_and_several_as_they_might_be() -> None:
    pit, laps, grid = (next(i for i, f in enumerate(FIGURES) if f.name == name) for name in ("pit_loss_s", "race_laps", "grid"))
    for name, low, high in (("one", 16.0, 16.0), ("several", 16.0, 18.0)):
        entries = loose(name)
        known = np.array([context_figures(record, car) for record, car in entries.pairs])
        found = trained_range(entries, RsrlConfig())
        assert list(found) == [f.name for f in FIGURES]
        assert found["race_laps"] == [low, high]
        assert found["grid"] == [3.0, 10.0]
        values = np.array(list(found.values()))
        assert (values[:, 0] <= known.min(axis=0)).all()
        assert (values[:, 1] >= known.max(axis=0)).all()
        assert (np.ptp(values[pit]) > 0.1) == (name == "several")
        assert (np.ptp(values[grid]), np.ptp(values[laps])) == (7.0, high - low)
        assert trained_range(entries, RsrlConfig()) == found
        as_they_are = trained_range(entries, RsrlConfig(uncertainty=0.0))
        assert as_they_are["pit_loss_s"] == pytest.approx([known[0, pit]] * 2)


def test_a_model_says_what_it_was_trained_on() -> None:
    one, two, reverse = (read_entries(races, None) for races in ("bahrain-2023", "bahrain-2023,spain-2023", "spain-2023,bahrain-2023"))
    about = one.about("rsrl train bahrain-2023", RsrlConfig())
    assert (about.race, about.driver, about.command) == ("bahrain-2023", "HAM", "rsrl train bahrain-2023")
    assert about.season_hash == race_hash(one.records[0])
    assert about.trained_range["race_laps"] == [57.0, 57.0]
    hashes = {entries.about("", RsrlConfig()).season_hash for entries in (one, two, reverse)}
    assert len(hashes) == 3
    assert {len(h) for h in hashes} == {16}
    assert two.about("", RsrlConfig()).race == "bahrain-2023,spain-2023"
    assert two.about("", RsrlConfig()).driver == ""


def test_figures_of_all_races_stay_within_their_ranges() -> None:
    """A figure cut off at the end of its range would make two tracks look alike.

    Softs at Spa in 2022 wear 0.254 s a lap, past the end at 0.25: the next change of features, which needs new policies, moves it.
    """
    beyond = set()
    races = {record.name: record for record in read_entries("all", None).records}
    low, high = np.array([f.fixed for f in FIGURES]).T
    for record in races.values():
        for car in (0, len(record.cars) // 2, len(record.cars) - 1):
            figures = context_figures(record, car)
            beyond |= {(record.name, FIGURES[i].name) for i in np.flatnonzero((figures < low) | (figures > high))}
    assert beyond == {("belgium-2022", "wear_soft_s")}
