"""What the numbers of the games stand for."""

from typing import Final, Literal

from rsrl.season.circuits import CIRCUITS

__all__ = ["COMPOUNDS", "OUT", "PENALTIES", "RAIN_FROM", "session_kind", "track_name"]

COMPOUNDS: Final = {16: "S", 17: "M", 18: "H", 7: "I", 8: "W"}
"""Letters of visual compounds; those of other formulae have none."""

RAIN_FROM: Final = 3
"""Weather from here on is rain: light, heavy, storm."""

OUT: Final = (4, 5, 6, 7)
"""Result status: did not finish, disqualified, not classified, retired. 0 and 1 are no car, 2 races, 3 has finished."""

PENALTIES: Final[dict[int, Literal["time penalty", "drive-through", "stop and go", "disqualified"]]] = {
    0: "drive-through",
    1: "stop and go",
    4: "time penalty",
    6: "disqualified",
}
"""Penalty types that bear on strategy."""

_TRACKS: Final = {
    0: "albert_park", 1: "ricard", 2: "shanghai", 3: "bahrain", 4: "catalunya", 5: "monaco", 6: "villeneuve", 7: "silverstone",
    8: "hockenheimring", 9: "hungaroring", 10: "spa", 11: "monza", 12: "marina_bay", 13: "suzuka", 14: "yas_marina", 15: "americas",
    16: "interlagos", 17: "red_bull_ring", 18: "sochi", 19: "rodriguez", 20: "baku", 21: "bahrain_outer", 26: "zandvoort", 27: "imola",
    28: "portimao", 29: "jeddah", 30: "miami", 31: "vegas", 32: "losail", 42: "madring",
}  # fmt: skip
"""Circuits by track; short and reversed tracks are none that races were held on."""


def track_name(track: int) -> str:
    """What a track is called, as a race can be named by it; empty for one without races."""
    return CIRCUITS[_TRACKS[track]].name if track in _TRACKS else ""


def session_kind(season: int, session_type: int) -> Literal["race", "qualifying", "practice"]:
    """Kind of session by its type, whose numbers moved in 2024: sprint qualifying came before the races. A sprint is the second race."""
    first_race = 10 if season == 2023 else 15
    if first_race <= session_type < first_race + 3:
        return "race"
    return "qualifying" if 5 <= session_type < first_race else "practice"
