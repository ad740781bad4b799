"""Looking things up in the scored races of a study, and tables that have its strategists on one side and its races on the other."""

from collections.abc import Callable, Sequence
from itertools import groupby
from typing import Final, TypeVar

from rsrl.report.markup import Child, Markup, element
from rsrl.report.numbers import race_title
from rsrl.report.tables import Body, Cell, Group, table
from rsrl.results import Average, Race, Scored, TrackDifference

T = TypeVar("T")

OVER: Final = {"all": "all tracks", "seen": "seen tracks", "unseen": "unseen tracks"}
"""Averages every strategist has: tracks some model of the study trains on, and those none does."""

ByTrack = Callable[[str, str], Child | Cell]
"""A cell by names of strategist and race."""

BySummary = Sequence[tuple[str, Callable[[str], Child | Cell]]]
"""Heads after the tracks, with their cell by strategist."""


def find(rows: Sequence[T], **wanted: object) -> T | None:
    """The first row whose fields are these."""
    return next((row for row in rows if all(getattr(row, name) == value for name, value in wanted.items())), None)


def strategists(scored: Scored) -> list[str]:
    """Names of those that ran, in the order of the study."""
    return list(dict.fromkeys(row.strategist for row in scored.table))


def tracks_over(scored: Scored, over: str) -> int:
    """How many tracks an average is over where nobody was left out."""
    return sum(over == "all" or race.unseen == (over == "unseen") for race in scored.races)


def spans(scored: Scored) -> list[str]:
    """Of `OVER`, the averages that say more than that over all tracks."""
    return ["all", *(over for over in ("seen", "unseen") if 0 < tracks_over(scored, over) < len(scored.races))]


def of_tracks(text: str, row: Average | TrackDifference, scored: Scored, over: str) -> str:
    """`text` of an average, marked `(5)` where that is over fewer tracks than there are."""
    return text if row.tracks == tracks_over(scored, over) else f"{text} ({row.tracks})"


def track_head(race: Race) -> Markup:
    """A race as the head of a narrow column."""
    return element("abbr", race.code, title=f"{race.event} {race.season}")


def grid(
    scored: Scored, caption: Child, cell: ByTrack, summaries: BySummary, *, note: Child = "", by_race: bool = False, class_: str = "grid"
) -> Markup:
    """A table of strategists by races, as the paper has it, or with `by_race` of races by strategists, for many races.

    Args:
        scored: races of a study and their scores.
        caption: stands above it.
        cell: of a strategist at a race.
        summaries: of a strategist over races.
        note: stands below it.
        by_race: a row for each race.
        class_: of the table.
    """
    names, races = strategists(scored), scored.races
    if by_race:
        rows = [[race_title(race.track), *(cell(name, race.race) for name in names)] for race in races]
        last = [[head, *(total(name) for name in names)] for head, total in summaries]
        return table(caption, ["Grand Prix", *names], [Body("", rows), Body("", last)], note=note, class_=class_)
    rows = [[name, *(cell(name, race.race) for race in races), *(total(name) for _, total in summaries)] for name in names]
    kinds = [(bool(unseen), len(list(group))) for unseen, group in groupby(races, key=lambda race: race.unseen)]
    groups = [Group("", 1), *(Group("unseen tracks" if unseen else "seen tracks", count) for unseen, count in kinds)]
    groups += [Group("over tracks", len(summaries))] if summaries else []
    heads = ["strategist", *(track_head(race) for race in races), *(head.removesuffix(" tracks") for head, _ in summaries)]
    return table(caption, heads, rows, groups=groups, note=note, class_=class_)
