"""The tables of a study of generalisability, as text and as Markdown."""

from collections.abc import Sequence
from typing import Final

from rich.style import Style
from rich.text import Text

from rsrl.cli.output import Column, FittedTable, table
from rsrl.results import Cars, RaceRow, Scored, StudyResult, TrackDifference, half_width

OVER: Final = {"seen": "seen", "unseen": "unseen", "all": "all tracks"}
"""Averages that every strategist has, and what the tables call them."""

FEW: Final = 4
"""Races that are named one by one."""


def tables(result: StudyResult) -> list[FittedTable]:
    """What the command shows: positions by track, differences and criteria, every car, the held-out races."""
    built = [_positions("Mean finishing position", result.tracks), _summary(result, result.tracks)]
    if result.cars:
        built.append(_cars(result.cars))
    if result.held_out:
        season = result.held_out.races[0].season
        built += [_positions(f"Mean finishing position, {season}", result.held_out), _summary(result, result.held_out)]
    built[-1].captions += _left_out(result)
    return built


def markdown(result: StudyResult) -> str:
    """Table 3 as the paper has it: a row for each strategist, the best of a track in bold, tracks trained on underlined."""
    scored = result.tracks
    heads = ["", *(race.code for race in scored.races), *OVER.values()]
    lines = ["| " + " | ".join(heads) + " |", "|---" * len(heads) + "|"]
    for name in _names(scored):
        cells = [_in_markdown(_row(scored.table, name, race.race)) for race in scored.races]
        averages = [_average(scored, name, over) for over in OVER]
        lines.append("| " + " | ".join([name, *cells, *averages]) + " |")
    notes = [
        f"Mean finishing position ± 95 % interval, {_told_races(result)} of seed {result.seed} at each track, the same for all.",
        "Bold: the best mean of a track. Underlined: a track the model trained on. (n): an average over n tracks only.",
    ]
    notes += [f"{note}." for note in _left_out(result)] + ([result.provenance.note] if result.provenance.note else [])
    return "\n".join([*lines, "", *notes]) + "\n"


def _left_out(result: StudyResult) -> list[str]:
    """Who was left out where and why, a line for each strategist and reason."""
    races: dict[tuple[str, str], list[str]] = {}
    for row in result.left_out:
        races.setdefault((row.strategist, row.reason), []).append(row.race)
    return [
        f"{name} left out of {', '.join(where) if len(where) <= FEW else f'{len(where)} races'}: {reason}"
        for (name, reason), where in races.items()
    ]


def _told_races(result: StudyResult) -> str:
    counts = {row.strategist: row.races for row in result.strategists}
    most = max(counts.values())
    fewer = [f"{name} {count:,}" for name, count in counts.items() if count != most]
    return f"{most:,} races" + (f" ({', '.join(fewer)})" if fewer else "")


def _names(scored: Scored) -> list[str]:
    return list(dict.fromkeys(row.strategist for row in scored.table))


def _row(rows: Sequence[RaceRow], name: str, race: str) -> RaceRow | None:
    return next((row for row in rows if row.strategist == name and row.race == race), None)


def _position(row: RaceRow | None) -> str:
    return "-" if row is None else f"{row.mean_position:.2f} ± {half_width(row.mean_position, row.ci95):.2f}"


def _in_markdown(row: RaceRow | None) -> str:
    text = _position(row)
    text = f"<u>{text}</u>" if row and row.trained else text
    return f"**{text}**" if row and row.best else text


def _styled(row: RaceRow | None) -> Text:
    return Text(_position(row), Style(bold=bool(row and row.best), underline=bool(row and row.trained)))


def _average(scored: Scored, name: str, over: str) -> str:
    row = next((row for row in scored.averages if row.strategist == name and row.over == over), None)
    if row is None:
        return "-"
    full = sum(over == "all" or race.unseen == (over == "unseen") for race in scored.races)
    text = f"{row.mean_position:.2f} ± {half_width(row.mean_position, row.ci95):.2f}"
    return text if row.tracks == full else f"{text} ({row.tracks})"


def _positions(title: str, scored: Scored) -> FittedTable:
    names = _names(scored)
    rows = [[race.track, *(_styled(_row(scored.table, name, race.race)) for name in names)] for race in scored.races]
    rows += [[told, *(_average(scored, name, over) for name in names)] for over, told in OVER.items()]
    columns: list[str | Column] = ["", *(Column(name, number) for number, name in enumerate(names))]
    return table(f"{title}, +- 95 % interval", columns, rows)


def _summary(result: StudyResult, scored: Scored) -> FittedTable:
    columns = (
        Column("strategist", words=True), "behind", "seen", "unseen", Column("ahead %", 1), Column("stops", 4), Column("invalid %", 6),
        Column("out %", 5), Column("reasonable", 2), Column("races %", 3), Column("ms", 7),
    )  # fmt: skip
    rows = []
    for name in _names(scored):
        own = [row for row in scored.table if row.strategist == name]
        judged = [row for row in scored.criteria if row.strategist == name and row.reasonable is not None]
        behind = {row.race: row for row in scored.differences if row.strategist == name}
        met = f"{sum(bool(row.reasonable) for row in judged)} of {len(judged)}" if judged else ""
        share = _percent([share for row in judged if (share := row.shares.reasonable) is not None])
        rows.append(
            (
                name, *(_behind(behind.get(over)) for over in ("all", "seen", "unseen")),
                f"{100 * behind['all'].p_ahead:.0f}" if behind else "",
                f"{_mean([row.mean_stops for row in own]):.2f}", _percent([row.invalid_share for row in own]),
                _percent([row.retired_share for row in own]), met, share, f"{_mean([row.decision_ms for row in own]):.2f}",
            )
        )  # fmt: skip
    return table(f"Places behind {result.reference} on the same races, criteria of a reasonable strategy", columns, rows)


def _behind(row: TrackDifference | Cars | None) -> str:
    return "" if row is None else f"{row.difference:+.2f}±{half_width(row.difference, row.ci95):.2f}"


def _cars(rows: Sequence[Cars]) -> FittedTable:
    columns = (
        "race", Column("strategist", words=True), "cars", "model better", "surely ahead", "surely behind", Column("places behind", 1),
    )  # fmt: skip
    cells = [(r.race, r.strategist, r.cars, r.ahead, r.surely_ahead, r.surely_behind, _behind(r)) for r in rows]
    return table(f"Every car called in turn: {rows[0].against} against others", columns, cells, left=2)


def _mean(values: Sequence[float]) -> float:
    return sum(values) / len(values)


def _percent(shares: Sequence[float]) -> str:
    return f"{100 * _mean(shares):.1f}" if shares else ""
