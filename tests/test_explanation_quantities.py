"""Features in words: as many digits as a number bears, and its unit as people say it."""

import pytest

from rsrl.explanation.quantities import bare, quantity
from rsrl.state import COLUMN, FEATURES


@pytest.mark.parametrize(
    ("name", "value", "words"),
    [
        ("gap_ahead_s", 0.594, "0.6 s"),
        ("gap_to_leader_s", 123.456, "123.5 s"),
        ("expected_hard_s", -0.04, "0.0 s"),
        ("tyre_loss_behind_s", -0.2217, "-0.22 s"),
        ("wear_soft_s", 0.0534, "0.05 s/lap"),
        ("tyre_age_laps", 9.0, "9 laps"),
        ("tyre_age_laps", 1.0, "1 lap"),
        ("stops_to_come_ahead", 0.3333, "0.3 stops"),
        ("position", 6.0, "P6"),
        ("projected_place", 6.41, "P6.4"),
        ("projected_hard_places", -0.521, "-0.5 places"),
        ("race_progress", 0.1579, "15.8 %"),
        ("last_lap_ratio", 1.05, "105 %"),
    ],
)
def test_a_feature_reads_as_people_say_it(name: str, value: float, words: str) -> None:
    assert quantity(FEATURES[COLUMN[name]], value) == words


def test_every_feature_of_the_registry_has_words() -> None:
    for feature in FEATURES:
        for value in (0.0, -0.001, 1.0, 12.3456):
            assert float(bare(feature, value)) == pytest.approx(value * (100 if feature.unit in ("share", "ratio") else 1), abs=0.06)
            assert not bare(feature, value).startswith("-0.0")
