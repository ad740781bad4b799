"""Paired differences: models against the best baseline of each track, and all strategists against the reference model."""

from collections.abc import Sequence
from typing import Final, NamedTuple

from rsrl.report.dots import Dot, DotRow, dot_plot
from rsrl.report.markup import Child, Markup, element, together, unseen
from rsrl.report.numbers import MISSING, half_width, percent, race_title, signed, signed_range, verdict
from rsrl.report.scored import OVER, find, of_tracks, spans
from rsrl.report.svg import figure
from rsrl.report.tables import Body, Cell, table
from rsrl.results import Interval, Scored

SIGNS: Final = {1: "\N{BLACK UP-POINTING TRIANGLE}", 0: "\N{MIDDLE DOT}", -1: "\N{BLACK DOWN-POINTING TRIANGLE}"}
TOLD: Final = {1: "surely ahead: ", 0: "too close to call: ", -1: "surely behind: "}
AHEAD, BEHIND, WHITE = (111, 163, 214), (238, 160, 84), (255, 255, 255)
"""Backgrounds of a place or more ahead and behind; what is between is mixed. The signs say it in grey."""


def tint(difference: float) -> str:
    """Background of a difference: the further from nil, the stronger."""
    share = min(abs(difference), 1.0)
    red, green, blue = (round(w + share * (c - w)) for w, c in zip(WHITE, AHEAD if difference > 0 else BEHIND, strict=True))
    return f"#{red:02x}{green:02x}{blue:02x}"


def difference_cell(difference: float, ends: Interval | None, *, whole_range: bool = True) -> Cell:
    """A difference with its sign in words and as a mark, its interval or half its width, and its background."""
    sure = verdict(ends)
    small = signed_range(ends) if whole_range else half_width(difference, ends)
    mark = element("span", SIGNS[sure], aria_hidden="true", class_="sign")
    return Cell(together(mark, unseen(TOLD[sure]), signed(difference), " ", element("small", small)), "heat", tint(difference))


class Tally(NamedTuple):
    """Races in which a model is surely ahead of the best baseline, surely behind it, or neither."""

    ahead: int
    behind: int
    open: int

    @property
    def races(self) -> int:
        """All of them."""
        return sum(self)


def tally(scored: Scored, model: str) -> Tally:
    """How a model stands against the best baselines of the races of a study."""
    rows = [row for race in scored.best_baselines for row in race.models if row.strategist == model]
    signs = [verdict(row.ci95) for row in rows]
    return Tally(signs.count(1), signs.count(-1), signs.count(0))


def heat_map(scored: Scored, where: str) -> Markup:
    """Models against the best baseline of each race; nothing without models."""
    models = list(dict.fromkeys(row.strategist for race in scored.best_baselines for row in race.models))
    if not models:
        return Markup("")
    heads = {race.race: race for race in scored.races}
    rows: list[list[Child | Cell]] = []
    for row in scored.best_baselines:
        race = heads.get(row.race)
        told = [race_title(race.track if race else row.race), " (unseen)" if race and race.unseen else ""]
        found = [find(row.models, strategist=model) for model in models]
        cells = [difference_cell(one.difference, one.ci95) if one else MISSING for one in found]
        rows.append([told, row.baseline, *cells])
    tallies = [tally(scored, model) for model in models]
    last: list[list[Child | Cell]] = [["surely ahead, surely behind, open", "", *(f"{t.ahead}, {t.behind}, {t.open}" for t in tallies)]]
    note = (
        "Mean of the places by which the model finishes ahead of the best baseline on the same races, and its 95 % interval. "
        f"{SIGNS[1]} surely ahead, {SIGNS[-1]} surely behind, {SIGNS[0]} the interval includes zero, so neither; "
        "the deeper the colour, up to a place, the more. "
        "The best baseline was chosen by its mean in these same races, which favours it slightly."
    )
    caption = f"Models against the best baseline of each track, in places, {where}"
    return table(caption, ["Grand Prix", "best baseline", *models], [Body("", rows), Body("", last)], note=note, class_="heated")


def against_reference(scored: Scored, reference: str, where: str) -> Markup:
    """All strategists against the reference model, over tracks; nothing where it is alone."""
    names = _others(scored)
    if not names:
        return Markup("")
    over = spans(scored)
    rows: list[list[Child | Cell]] = [[name, *(cell for which in over for cell in _behind(scored, name, which))] for name in names]
    heads = ["strategist", *(head for which in over for head in (OVER[which], f"{reference} ahead"))]
    caption = f"Places behind {reference} on the same races, {where}"
    note = f"Above zero {reference} has the better mean. Ahead: share of races in which it finishes ahead, a tie counting half."
    return table(caption, heads, rows, note=note, class_="heated")


def _behind(scored: Scored, name: str, over: str) -> list[Child | Cell]:
    row = find(scored.differences, strategist=name, race=over)
    if row is None:
        return [MISSING, MISSING]
    return [difference_cell(row.difference, row.ci95), of_tracks(percent(row.p_ahead), row, scored, over)]


def _others(scored: Scored) -> list[str]:
    return list(dict.fromkeys(row.strategist for row in scored.differences))


def differences_figure(scored: Scored, reference: str, where: str) -> Markup:
    """The differences over tracks as a dot plot."""
    names, over = _others(scored), spans(scored)
    if not names:
        return Markup("")
    rows = []
    for name in names:
        found = [find(scored.differences, strategist=name, race=which) for which in over]
        dots = [Dot(row.difference, row.ci95) if row else None for row in found]
        rows.append(DotRow(name, dots, signed(found[0].difference) if found[0] else ""))
    return difference_plot(rows, [OVER[which] for which in over], reference, f"Places behind {reference} over {where}")


def difference_plot(rows: Sequence[DotRow], series: Sequence[str], reference: str, caption: str) -> Markup:
    """A dot plot of differences to a model, right of zero where it has the better mean."""
    told = "; ".join(f"{row.label} {row.note}".rstrip() for row in rows)
    axis = f"places behind {reference} (right of zero: {reference} has the better mean)"
    drawn = dot_plot(rows, axis, f"Dot plot: {caption}. {told}.", series=series if len(series) > 1 else (), zero=True)
    return figure(f"{caption}, with 95 % intervals", drawn)
