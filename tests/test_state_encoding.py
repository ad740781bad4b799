"""The encoder: ranges, clipping, one-hots, and working ranges fitted on simulated races."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays
from synthetic_race import UNSCALED, synthetic_race

from rsrl.environment import RaceEnvironment, with_scaling
from rsrl.errors import RsrlError
from rsrl.season import GRAND_PRIX
from rsrl.state import COLUMN, FEATURES, NO_CAR_GAP_S, RAW_SIZE, Encoder, Feature, feature_set, fit_scaling, input_names

NAMES = ["paper", "full", "named"]
LOGARITHMIC = [f for f in feature_set("full") if f.logarithmic]


def plain(raw: np.ndarray, feature: Feature) -> list[float]:
    """Columns of one feature of one row, from the definition."""
    value = float(raw[COLUMN[feature.name]])
    if feature.kind == "category":
        return [float(int(value) == c) for c in range(feature.width)]
    low, high = feature.fixed or UNSCALED[feature.name]
    if feature.logarithmic:
        low, high, value = np.log(1 + low), np.log(1 + high), np.log(1 + max(value, 0.0))
    share = (value - low) / (high - low)
    return [min(max(feature.low + share * (1 - feature.low), feature.low), 1.0)]


def rows() -> st.SearchStrategy[np.ndarray]:
    return arrays.arrays(np.float32, RAW_SIZE, elements=st.floats(-200, 2000, width=32))


@pytest.mark.parametrize("name", NAMES)
@given(raw=rows(), codes=st.integers(0, 33))
def test_columns_are_scaled_clipped_and_one_hot(name: str, raw: np.ndarray, codes: int) -> None:
    encoder = Encoder(name, UNSCALED)
    for feature in FEATURES:
        if feature.kind == "category":
            raw[COLUMN[feature.name]] = codes % feature.width
    out = encoder(raw[None])[0]
    expected = [value for feature in encoder.features for value in plain(raw, feature)]
    assert len(out) == encoder.width == len(encoder.names) == len(input_names(name))
    np.testing.assert_allclose(out, expected, atol=1e-4)
    low = [feature.low for feature in encoder.features for _ in range(feature.width)]
    assert (out >= low).all()
    assert (out <= 1).all()


def encoded(feature: Feature, values: list[float]) -> list[float]:
    """Scaled values of one feature of the full set."""
    encoder = Encoder("full", {})
    raw = np.zeros((len(values), RAW_SIZE), np.float32)
    raw[:, COLUMN[feature.name]] = values
    return [float(v) for v in encoder(raw)[:, encoder.names.index(feature.name)]]


@pytest.mark.parametrize("feature", LOGARITHMIC, ids=lambda f: f.name)
@given(values=st.lists(st.floats(-50, 200, width=32), min_size=2, max_size=8))
def test_a_gap_never_counts_less_than_a_smaller_one(feature: Feature, values: list[float]) -> None:
    scaled = encoded(feature, sorted(values))
    assert scaled == sorted(scaled)
    assert feature.low <= scaled[0] <= scaled[-1] <= 1.0


@pytest.mark.parametrize("feature", LOGARITHMIC, ids=lambda f: f.name)
def test_gaps_fill_their_range_and_their_first_seconds_count_most(feature: Feature) -> None:
    assert feature.fixed is not None
    low, high = feature.fixed
    assert encoded(feature, [low, high, high + 50, low - 5]) == pytest.approx([feature.low, 1.0, 1.0, feature.low], abs=1e-5)
    gaps = encoded(feature, [0.0, 1.0, 3.0, 7.0, 15.0, 31.0])
    assert np.diff(gaps) == pytest.approx(gaps[1] - gaps[0], abs=1e-5), "one plus the gap, doubled, is a step of one size"
    assert gaps[1] > gaps[0]


@given(gap=st.floats(0, 130, width=32))
def test_a_logarithm_is_rounded_once_as_on_any_machine(gap: float) -> None:
    """The encoder's own steps in NumPy, the logarithm in double precision: the same bits, where single precision differs by libraries."""
    feature = LOGARITHMIC[0]
    encoder = Encoder("full", {})
    low, factor, floor = encoder.values[encoder.features.index(feature)]
    scaled = floor + (np.float32(np.log1p(np.float64(gap))) - low) * factor
    assert encoded(feature, [gap])[0] == min(max(scaled, floor), np.float32(1.0))


def test_gaps_and_only_gaps_are_scaled_by_their_logarithm_where_one_policy_calls_all_races() -> None:
    assert {f.name for f in LOGARITHMIC} == {
        "gap_ahead_s", "gap_behind_s", "gap_to_leader_s", "rejoin_gap_ahead_s", "rejoin_gap_behind_s", "gap_two_ahead_s",
        "gap_two_behind_s",
    }  # fmt: skip
    assert {f.name for f in feature_set("named") if f.logarithmic} == {f.name for f in LOGARITHMIC}
    assert not any(f.logarithmic for f in feature_set("paper"))


@pytest.mark.parametrize("name", ["full", "named"])
def test_a_second_looks_the_same_at_every_race(name: str) -> None:
    raw = np.random.default_rng(0).uniform(0, 30, (20, RAW_SIZE)).astype(np.float32)
    other = dict.fromkeys(UNSCALED, (3.0, 9.0))
    np.testing.assert_array_equal(Encoder(name, UNSCALED)(raw), Encoder(name, other)(raw))
    assert not np.array_equal(Encoder("paper", UNSCALED)(raw), Encoder("paper", other)(raw))


def test_names_of_categories_tell_the_category() -> None:
    names = input_names("full")
    assert "tyre=soft" in names
    assert "safety_car=virtual" in names
    assert not any(n.startswith("track=") for n in names)
    for name in ("paper", "named"):
        assert sum(n.startswith("track=") for n in input_names(name)) == 34
    for name in NAMES:
        assert len(set(input_names(name))) == len(input_names(name))


def test_the_schema_hash_tells_sets_apart_and_nothing_else() -> None:
    a, b = Encoder("full", UNSCALED), Encoder("full", dict.fromkeys(UNSCALED, (0.0, 9.0)))
    assert a.schema_hash() == b.schema_hash()
    hashes = {Encoder(name, UNSCALED).schema_hash() for name in NAMES}
    assert len(hashes) == 3
    assert {len(h) for h in hashes} == {16}


def test_scaling_that_is_missing_or_flat_is_refused() -> None:
    with pytest.raises(RsrlError, match="no scaling for gap_ahead_s"):
        Encoder("paper", {n: r for n, r in UNSCALED.items() if n != "gap_ahead_s"})
    with pytest.raises(RsrlError, match="scaling of gap_ahead_s runs from 5 to 5; it must rise"):
        Encoder("paper", {**UNSCALED, "gap_ahead_s": (5.0, 5.0)})


def test_working_ranges_are_quantiles_without_absent_cars() -> None:
    raw = np.zeros((1000, RAW_SIZE), np.float32)
    raw[:, COLUMN["gap_ahead_s"]] = np.linspace(0, 50, 1000)
    raw[500:, COLUMN["gap_behind_s"]] = NO_CAR_GAP_S
    raw[:500, COLUMN["gap_behind_s"]] = np.linspace(0, 10, 500)
    ranges = fit_scaling(raw)
    assert ranges["gap_ahead_s"] == pytest.approx((0.5, 47.5), abs=0.01)
    assert ranges["gap_behind_s"] == pytest.approx((0.1, 9.5), abs=0.01)
    assert all(high > low for low, high in ranges.values())
    assert set(ranges) == set(UNSCALED)


def test_a_record_is_scaled_by_its_own_races_and_the_same_way_twice() -> None:
    record = synthetic_race()
    scaled = with_scaling(record, 1)
    assert scaled.scaling == with_scaling(record, 1).scaling != record.scaling
    assert scaled.scaling["pit_cost_s"][1] > 20
    assert Encoder("full", scaled.scaling).width == Encoder("full", record.scaling).width


def test_a_track_that_is_no_category_is_none_of_them() -> None:
    """A new circuit: the policies that know tracks by name see a track of no name, the others its figures."""
    record = dataclasses.replace(synthetic_race(laps=14, plans=("S-H@6",)), name="atlantis-2026", grand_prix="atlantis", season=2026)
    environment = RaceEnvironment(record, 3, batch=2)
    environment.reset(1, np.arange(2, dtype=np.int64))
    assert set(environment.raw[:, COLUMN["track"]]) == {-1.0}
    encoder = Encoder("paper", UNSCALED)
    columns = [i for i, name in enumerate(encoder.names) if name.startswith("track=")]
    assert len(columns) == len(GRAND_PRIX)
    assert not encoder(environment.raw)[:, columns].any()
