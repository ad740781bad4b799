"""Which races a model may train on, and which stay unseen."""

import pytest

from rsrl.errors import RsrlError
from rsrl.season import GROUPS, UNSEEN_TRACKS, group_races, held_out_races, load_race, study_races, track_of


def test_the_papers_groups_are_the_first_tracks_of_its_table() -> None:
    assert group_races("rsrl-1") == ("japan-2023",)
    assert group_races("rsrl-2") == ("japan-2023", "bahrain-2023")
    assert len(group_races("rsrl-9")) == 9
    assert len(study_races()) == 14


@pytest.mark.parametrize("group", GROUPS)
def test_no_group_holds_an_unseen_track_a_wet_race_or_the_test_season(group: str) -> None:
    for name in group_races(group):
        assert track_of(name) not in UNSEEN_TRACKS
        record = load_race(name)
        assert not record.wet
        assert record.season < 2024


def test_all_holds_every_track_that_is_not_unseen() -> None:
    tracks = {track_of(name) for name in group_races("all")}
    assert {track_of(name) for name in group_races("rsrl-9")} < tracks


def test_held_out_races_are_of_the_test_season_only() -> None:
    assert held_out_races()
    assert not set(held_out_races()) & set(group_races("all"))


def test_an_unknown_group_is_named() -> None:
    with pytest.raises(RsrlError, match="rsrl-7"):
        group_races("rsrl-7")
