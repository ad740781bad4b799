"""Named groups of races: the training sets of the paper's models and of ours, and the tracks of its generalisability study.

`all` is every dry race of 2022 and 2023 except those of the five tracks on which no model of the study trains.
"""

from typing import Final

from rsrl.errors import RsrlError
from rsrl.season.library import race_heads

STUDY_TRACKS: Final = (
    "japan", "bahrain", "azerbaijan", "great-britain", "hungary", "italy", "singapore", "qatar", "abu-dhabi",
    "spain", "saudi-arabia", "austria", "mexico", "united-states",
)  # fmt: skip
"""The 14 Grands Prix of the paper's Table 3 in its order; no model trains on the last five."""

UNSEEN_TRACKS: Final = STUDY_TRACKS[9:]
STUDY_SEASON: Final = 2023
TRAINING_SEASONS: Final = (2022, 2023)
HELD_OUT_SEASON: Final = 2024

_PAPER_GROUPS: Final = {"rsrl-1": 1, "rsrl-2": 2, "rsrl-9": 9}
GROUPS: Final = (*_PAPER_GROUPS, "all")
"""Names of the groups of races to train on."""


def group_races(name: str) -> tuple[str, ...]:
    """Names of the races of a group. Raises RsrlError for an unknown group."""
    if name in _PAPER_GROUPS:
        return study_races()[: _PAPER_GROUPS[name]]
    if name != "all":
        raise RsrlError(f"unknown group of races {name!r}; there are {', '.join(GROUPS)}")
    heads = [head for head in race_heads() if head.season in TRAINING_SEASONS and not head.wet]
    return tuple(head.name for head in heads if track_of(head.name) not in UNSEEN_TRACKS)


def study_races() -> tuple[str, ...]:
    """Names of the 14 races of the study."""
    return tuple(f"{track}-{STUDY_SEASON}" for track in STUDY_TRACKS)


def held_out_races() -> tuple[str, ...]:
    """Names of the dry races of the held-out season, on which nothing is trained or tuned."""
    return tuple(head.name for head in race_heads() if head.season == HELD_OUT_SEASON and not head.wet)


def track_of(race: str) -> str:
    """Grand Prix in a race's name: `spain` for `spain-2023`."""
    return race.rpartition("-")[0]
