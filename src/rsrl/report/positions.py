"""The paper's Table 3: mean finishing positions by track and averaged over tracks, and the share of the gap closed."""

from rsrl.report.dots import Dot, DotRow, dot_plot
from rsrl.report.markup import Child, Markup, element, together, unseen
from rsrl.report.numbers import MISSING, half_percent, half_width, percent, percent_range, place, place_range
from rsrl.report.scored import OVER, find, grid, of_tracks, spans, strategists
from rsrl.report.svg import figure
from rsrl.report.tables import table
from rsrl.results import RaceRow, Scored


def standing(scored: Scored, where: str) -> Markup:
    """Strategists over all tracks, best first; those that called fewer tracks come last, since their means are over other races."""
    over = spans(scored)
    gaps = {row.strategist: row for row in scored.gap_closed if row.race == "all"}
    heads = ["strategist", *(OVER[name] for name in over), *(["gap closed"] if gaps else []), "stops", "invalid", "out"]
    rows = []
    for name in _ranked(scored):
        cells: list[Child] = [name, *(_average(scored, name, which) for which in over)]
        if gaps:
            gap = gaps.get(name)
            cells.append(_stacked(together(percent(gap.share)), percent_range(gap.ci95)) if gap else MISSING)
        own = [row for row in scored.table if row.strategist == name]
        stops, invalid, out = (sum(getattr(row, key) for row in own) / len(own) for key in ("mean_stops", "invalid_share", "retired_share"))
        rows.append([*cells, f"{stops:.2f}", percent(invalid, 1), percent(out, 1)])
    caption = f"Mean finishing position over {where}, with 95 % intervals"
    return table(caption, heads, rows, note=_standing_note(scored, bool(gaps)), class_="grid")


def _standing_note(scored: Scored, gaps: bool) -> str:
    parts = ["Invalid: finished out of the rules. Out: did not finish, counted where classified."]
    if any(row.over == "all" and row.tracks < len(scored.races) for row in scored.averages):
        parts.append("(n): over n tracks only, those it could call; not to be compared with the others directly, so listed last.")
    if gaps:
        parts.append("Gap closed: share of the way from fixed strategies to hindsight, which knows each race in advance.")
    return " ".join(parts)


def _ranked(scored: Scored) -> list[str]:
    rows = {row.strategist: row for row in scored.averages if row.over == "all"}
    return sorted((name for name in strategists(scored) if name in rows), key=lambda n: (-rows[n].tracks, rows[n].mean_position))


def _average(scored: Scored, name: str, over: str) -> Markup:
    row = find(scored.averages, strategist=name, over=over)
    if row is None:
        return together(MISSING)
    return _stacked(together(of_tracks(place(row.mean_position), row, scored, over)), place_range(row.ci95))


def positions_table(scored: Scored, caption: str, *, by_race: bool) -> Markup:
    """Mean positions with half the width of their intervals: the best of a race in bold, tracks trained on underlined."""

    def cell(name: str, race: str) -> Markup:
        row = find(scored.table, strategist=name, race=race)
        return _position(row) if row else together(MISSING)

    def average(name: str, over: str) -> Markup:
        row = find(scored.averages, strategist=name, over=over)
        if row is None:
            return together(MISSING)
        return _stacked(together(of_tracks(place(row.mean_position), row, scored, over)), half_width(row.mean_position, row.ci95))

    summaries = [(OVER[over], lambda name, over=over: average(name, over)) for over in spans(scored)]
    note = "Bold: the best mean of a track. Underlined: a track the model trained on. Small: half the width of the 95 % interval."
    if any(row.tracks < len(scored.races) for row in scored.averages if row.over == "all"):
        note += " (n): over n tracks only."
    return grid(scored, caption, cell, summaries, note=note, by_race=by_race)


def _position(row: RaceRow) -> Markup:
    shown = together(place(row.mean_position))
    if row.trained:
        shown = together(element("u", shown), unseen(" trained on"))
    if row.best:
        shown = together(element("strong", shown), unseen(" best"))
    return _stacked(shown, half_width(row.mean_position, row.ci95))


def _stacked(value: Markup, small: str) -> Markup:
    return together(value, " ", element("small", small)) if small else value


def averages_figure(scored: Scored, where: str) -> Markup:
    """Average finishing positions over all, seen and unseen tracks, best above."""
    over = spans(scored)
    rows = []
    for name in _ranked(scored):
        found = [find(scored.averages, strategist=name, over=which) for which in over]
        label = of_tracks(name, found[0], scored, "all") if found[0] else name
        note = "P" + place(found[0].mean_position) if found[0] else ""
        rows.append(DotRow(label, [Dot(row.mean_position, row.ci95) if row else None for row in found], note))
    told = "; ".join(f"{row.label} {row.note}" for row in rows)
    drawn = dot_plot(
        rows, "mean finishing position (left is better)", f"Dot plot of average finishing positions over {where}: {told}.",
        series=[OVER[which] for which in over] if len(over) > 1 else (),
    )  # fmt: skip
    note = "Right: the average over all tracks. All strategists call the same races, so compare them by their paired differences."
    return figure(f"Average finishing positions over {where}, with 95 % intervals", drawn, note)


def gap_table(scored: Scored, where: str, *, by_race: bool) -> Markup:
    """Share of the gap closed by track; nothing where `fixed` or `hindsight` did not run."""
    if not scored.gap_closed:
        return Markup("")

    def cell(name: str, race: str) -> Markup:
        row = find(scored.gap_closed, strategist=name, race=race)
        if row is None:
            return together(MISSING)
        return _stacked(together(percent(row.share)), half_percent(row.share, row.ci95))

    note = "Share of the way from fixed strategies to hindsight; small: half the width of the 95 % interval, in percent."
    return grid(
        scored, f"Share of the gap closed by track, {where}", cell, [(OVER["all"], lambda n: cell(n, "all"))], note=note, by_race=by_race
    )
