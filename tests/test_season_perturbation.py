"""Figures drawn anew within their errors stay believable, ordered and repeatable."""

import dataclasses
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rsrl.errors import RsrlError
from rsrl.season import Figure, RaceRecord, load_race, perturbed, race_names, read_race, write_race
from rsrl.season.bounds import bounds_of
from rsrl.season.perturbation import SIGNED, drawn, most_factor
from rsrl.simulator import compile_figures

SEEDS = st.integers(0, 2**32)
DRY = [name for name in race_names() if not load_race(name).wet]


def figures(record: Any, path: str = "") -> Iterator[tuple[str, Figure]]:
    """Every figure of a record with the name its bounds go by, and where it stands."""
    for f in dataclasses.fields(record):
        item = getattr(record, f.name)
        key = f"{path}.{f.name}" if path else f.name
        if isinstance(item, Figure):
            yield key, item
        elif dataclasses.is_dataclass(item):
            yield from figures(item, key)
        elif isinstance(item, tuple) and item and dataclasses.is_dataclass(item[0]):
            for i, entry in enumerate(item):
                yield from figures(entry, f"{key}[{i}]")
        elif isinstance(item, dict) and item:
            for name, entry in item.items():
                if isinstance(entry, Figure):
                    yield f"{key}.{name}", entry
                elif dataclasses.is_dataclass(entry):
                    yield from figures(entry, f"{key}[{name}]")


def bounds(key: str) -> tuple[float, float]:
    *tables, name = key.split(".")
    return bounds_of(f"{tables[-1]}.{name}")


@given(seed=SEEDS, scale=st.floats(0, 6))
@settings(max_examples=30)
def test_drawn_figures_stay_believable(bahrain: RaceRecord, seed: int, scale: float) -> None:
    record = perturbed(bahrain, np.random.default_rng(seed), scale)
    before = dict(figures(bahrain))
    after = dict(figures(record))
    assert before.keys() == after.keys()
    for key, figure in after.items():
        low, high = bounds(key)
        assert low <= figure.value <= high, key
        old = before[key]
        if old.value > 0 and key.split(".")[-1] not in SIGNED and ".hazard." not in key and ".choice." not in key:
            assert abs(math.log(figure.value / old.value)) <= math.log(most_factor(scale)) + 1e-9, key
    pit = record.pit
    assert max(pit.loss_vsc_s.value, pit.loss_sc_s.value) < pit.loss_green_s.value


@given(seed=SEEDS)
@settings(max_examples=10)
def test_scale_zero_is_the_identity_and_a_seed_names_its_record(bahrain: RaceRecord, seed: int) -> None:
    assert perturbed(bahrain, np.random.default_rng(seed), 0.0) == bahrain
    first, second = (perturbed(bahrain, np.random.default_rng(seed)) for _ in range(2))
    assert first == second != perturbed(bahrain, np.random.default_rng(seed + 1))


@pytest.mark.parametrize("name", DRY[::9])
def test_a_drawn_race_can_be_written_read_and_run(name: str, tmp_path: Path) -> None:
    for seed in range(3):
        record = perturbed(load_race(name), np.random.default_rng(seed), 3.0)
        write_race(record, tmp_path / "race.toml")
        assert read_race(tmp_path / "race.toml").name == name
        compile_figures(record)


def test_what_is_certain_or_decides_nothing_stays(bahrain: RaceRecord) -> None:
    record = perturbed(bahrain, np.random.default_rng(1), 3.0)
    assert record.tyres["M"].offset_s == bahrain.tyres["M"].offset_s
    assert record.track.drs_window_s == bahrain.track.drs_window_s
    assert record.track.base_lap_s == bahrain.track.base_lap_s
    assert record.sets == bahrain.sets
    assert [(c.driver, c.team, c.grid) for c in record.cars] == [(c.driver, c.team, c.grid) for c in bahrain.cars]
    assert (record.rivals.hazard, record.rivals.choice, record.rivals.plans) == (
        bahrain.rivals.hazard,
        bahrain.rivals.choice,
        bahrain.rivals.plans,
    )
    assert record.rivals.life_laps != bahrain.rivals.life_laps
    assert record.scaling == bahrain.scaling


def test_spread_of_the_draws_is_the_standard_error(bahrain: RaceRecord) -> None:
    records = [perturbed(bahrain, np.random.default_rng(seed)) for seed in range(400)]
    pace = np.array([[car.pace_s.value for car in r.cars] for r in records]) - [car.pace_s.value for car in bahrain.cars]
    se = np.array([car.pace_s.se for car in bahrain.cars])
    assert np.std(pace / se, axis=0).mean() == pytest.approx(1.0, abs=0.05)
    teams = [car.team for car in bahrain.cars]
    mate = next(i for i, team in enumerate(teams[1:], 1) if team == teams[0])
    stranger = next(i for i, team in enumerate(teams) if team != teams[0])
    assert np.corrcoef(pace[:, 0], pace[:, mate])[0, 1] > 0.7
    assert abs(np.corrcoef(pace[:, 0], pace[:, stranger])[0, 1]) < 0.2
    green = np.log([r.pit.loss_green_s.value / bahrain.pit.loss_green_s.value for r in records])
    assert np.std(green) == pytest.approx(bahrain.pit.loss_green_s.se / bahrain.pit.loss_green_s.value, rel=0.1)


def test_a_team_errs_as_one(bahrain: RaceRecord) -> None:
    record = perturbed(bahrain, np.random.default_rng(5), 2.0)
    by_team: dict[str, set[float]] = {}
    for car in record.cars:
        by_team.setdefault(car.team, set()).add(car.retire_per_lap.value)
    before: dict[str, set[float]] = {}
    for car in bahrain.cars:
        before.setdefault(car.team, set()).add(car.retire_per_lap.value)
    assert {team: len(values) for team, values in by_team.items()} == {team: len(values) for team, values in before.items()}


def test_a_positive_figure_fitted_at_zero_is_never_drawn_below_it() -> None:
    assert drawn("wear_s_per_lap", Figure(0.0, 0.01, 5), -1.0, 2.0).value == 0.0
    assert drawn("wear_s_per_lap", Figure(0.0, 0.01, 5), 1.0, 2.0).value == pytest.approx(0.02)


def test_cheap_stops_stay_cheaper_where_the_green_loss_is_drawn_low(bahrain: RaceRecord) -> None:
    pit = dataclasses.replace(bahrain.pit, loss_green_s=Figure(20, 8, 1), loss_vsc_s=Figure(18, 8, 1), loss_sc_s=Figure(17, 8, 1))
    record = dataclasses.replace(bahrain, pit=pit)
    for seed in range(50):
        new = perturbed(record, np.random.default_rng(seed), 2.0).pit
        assert max(new.loss_vsc_s.value, new.loss_sc_s.value) < new.loss_green_s.value


@pytest.mark.parametrize("scale", [-1.0, math.nan, math.inf])
def test_a_scale_that_is_none_is_refused(bahrain: RaceRecord, scale: float) -> None:
    with pytest.raises(RsrlError, match="scale is"):
        perturbed(bahrain, np.random.default_rng(0), scale)
