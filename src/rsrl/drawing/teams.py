"""Colours of teams, and a line for every car: team mates share a colour, the second of them is dashed."""

from collections.abc import Sequence
from typing import Final, NamedTuple

TEAM_COLOURS: Final = {
    "Red Bull Racing": "#1e3f9e",
    "Mercedes": "#00a19b",
    "Ferrari": "#dc0000",
    "McLaren": "#ff8000",
    "Aston Martin": "#00665e",
    "Racing Point": "#d6699f",
    "Force India": "#d6699f",
    "Alpine": "#ff5fa8",
    "Renault": "#c9a200",
    "Williams": "#3d9be9",
    "AlphaTauri": "#4e6a85",
    "Toro Rosso": "#4e6a85",
    "RB": "#6c7ce0",
    "Racing Bulls": "#6c7ce0",
    "Alfa Romeo": "#8f1d2c",
    "Alfa Romeo Racing": "#8f1d2c",
    "Sauber": "#8f1d2c",
    "Kick Sauber": "#3bb54a",
    "Audi": "#5c5c5c",
    "Cadillac": "#a08a4f",
    "Haas F1 Team": "#8c9196",
}
"""Near the cars' own, darkened where they could not be read on white."""

OTHER_COLOURS: Final = ("#7a5195", "#a05d2c", "#5f7a3a", "#2f6f7e", "#9b3d6b", "#44546a")
"""Of teams that are not listed, by their order in the race."""

DASHES: Final = ("-", (0, (4, 1.6)), (0, (1, 1.2)))


class CarStyle(NamedTuple):
    """How a car's line is drawn: a colour, and a dash pattern of matplotlib."""

    colour: str
    dash: str | tuple[float, tuple[float, ...]]


def team_colour(team: str, others: Sequence[str] = ()) -> str:
    """The colour of a team; `others` are the teams of the race that have none of their own, in order."""
    if team in TEAM_COLOURS:
        return TEAM_COLOURS[team]
    return OTHER_COLOURS[(list(others).index(team) if team in others else 0) % len(OTHER_COLOURS)]


def car_styles(teams: Sequence[str]) -> list[CarStyle]:
    """A style for every car, given its team: the first car of a team is drawn solid, the second dashed, a third dotted."""
    others = [team for team in dict.fromkeys(teams) if team not in TEAM_COLOURS]
    return [CarStyle(team_colour(team, others), DASHES[teams[:i].count(team) % len(DASHES)]) for i, team in enumerate(teams)]
