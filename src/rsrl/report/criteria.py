"""The paper's three criteria of a reasonable strategy, by strategist and track."""

from typing import Final, NamedTuple

from rsrl.report.markup import Child, Markup, element, together, unseen
from rsrl.report.numbers import MISSING
from rsrl.report.scored import find, grid
from rsrl.report.tables import Cell
from rsrl.results import Criteria, Scored

CRITERIA: Final = {
    "few_stops": "one to three stops",
    "harder_longer": "hardest compound longer than the softest",
    "like_or_better": "like a common strategy of a baseline, or ahead of the best",
}
"""What each asks of the commonest strategy of the races finished, in the order of the marks."""

MARKS: Final = {True: "\N{CHECK MARK}", False: "\N{BALLOT X}", None: MISSING}
WORDS: Final = {True: "met", False: "not met", None: "nobody to compare with"}


class Met(NamedTuple):
    """At how many tracks a strategist meets all three criteria, of those where that can be told."""

    met: int
    judged: int


def met(scored: Scored, name: str) -> Met:
    """How often a strategist's commonest strategy is reasonable."""
    verdicts = [row.reasonable for row in scored.criteria if row.strategist == name and row.reasonable is not None]
    return Met(sum(verdicts), len(verdicts))


def criteria_table(scored: Scored, where: str, *, by_race: bool) -> Markup:
    """Three marks a strategist and track, with words for who hears them; nothing where no race was finished."""
    if not scored.criteria:
        return Markup("")

    def cell(name: str, race: str) -> Child | Cell:
        row = find(scored.criteria, strategist=name, race=race)
        return _marks(row) if row else MISSING

    def total(name: str) -> str:
        count = met(scored, name)
        return f"{count.met} of {count.judged}" if count.judged else MISSING

    told = "; ".join(f"{i}. {text}" for i, text in enumerate(CRITERIA.values(), 1))
    note = f"Marks in this order: {told}. {MARKS[True]} met, {MARKS[False]} not met, {MISSING} nobody to compare with. Grey: not all met."
    return grid(
        scored,
        f"Is the commonest strategy reasonable? {where}",
        cell,
        [("all three", total)],
        note=note,
        by_race=by_race,
        class_="grid criteria",
    )


def _marks(row: Criteria) -> Cell:
    words = f"{row.strategy}: " + "; ".join(f"{text}: {WORDS[getattr(row, name)]}" for name, text in CRITERIA.items())
    shown = element("span", [_mark(getattr(row, name)) for name in CRITERIA], aria_hidden="true", title=row.strategy)
    return Cell(together(shown, unseen(words)), "missed" if row.reasonable is False else None)


def _mark(value: bool | None) -> Markup:
    return element("b", MARKS[value], class_="cross") if value is False else together(MARKS[value])
