"""The whole page: a summary, then numbered sections of the results there are."""

from collections.abc import Mapping, Sequence
from importlib.resources import files as package_files
from pathlib import Path
from typing import Any, NamedTuple

from rsrl import __version__
from rsrl.report import cars, criteria, differences, explained, leaderboard, notes, positions, robustness, strategies
from rsrl.report.markup import Markup, element, together
from rsrl.report.numbers import counted, date, race_title
from rsrl.report.results import Results, read_results
from rsrl.report.strategies import told_races
from rsrl.report.summary import summary
from rsrl.results import Explained, LeftOut, Scored, StudyResult, from_plain, plain

POLICY = "default-src 'none'; style-src 'unsafe-inline'; img-src data:"
"""Content security policy for the browser: nothing is fetched, no script runs."""


class Section(NamedTuple):
    """A part of the page with its heading; `id` is its place in links."""

    id: str
    title: str
    body: Markup


class Report(NamedTuple):
    """The finished page, its sections, and the names of the files it was made of."""

    html: str
    sections: tuple[Section, ...]
    files: tuple[str, ...]


def make_report(folder: Path, command: str, made: str) -> Report:
    """Make the report of a study folder, one file that needs no other.

    Args:
        folder: holds what `rsrl study` and `rsrl evaluate` wrote.
        command: that makes the report, to be told in it.
        made: date and time, ISO.

    Raises:
        RsrlError: no such folder, nothing in it to report, a file that cannot be read, or another version's.
    """
    results = read_results(folder)
    sections = _sections(results, command)
    return Report(_page(results, sections, made), tuple(sections), tuple(results.files()))


def explanation_page(document: Mapping[str, Any], command: str, made: str) -> str:
    """One decision explained as a page that needs no other file.

    Args:
        document: what `rsrl explain` makes, as its JSON has it.
        command: that makes the page, to be told in it.
        made: date and time, ISO.
    """
    results = Results(None, None, None, from_plain(plain(document), Explained))
    return _page(results, _sections(results, command), made)


def _sections(results: Results, command: str) -> list[Section]:
    found: list[Section] = []
    if results.evaluation:
        title = f"Leaderboard: {race_title(results.evaluation.race)}"
        found.append(Section("leaderboard", title, leaderboard.leaderboard(results.evaluation)))
    if results.generalise:
        found += _study(results.generalise)
    if results.robustness:
        title = f"Robustness: {race_title(results.robustness.race)}"
        found.append(Section("robustness", title, robustness.robustness(results.robustness)))
    if results.explanation:
        found += [Section(*part) for part in explained.explained(results.explanation)]
    found = [section for section in found if section.body]
    files = results.files()
    return [
        *found,
        Section("reading", "How to read it", notes.how_to_read([section.id for section in found])),
        Section("again", "How to make it again", notes.how_to_make_again(files, command)),
    ]


def _study(study: StudyResult) -> list[Section]:
    scored, reference = study.tracks, study.reference
    count = told_races(study.strategists)
    found = []
    if scored.table:
        found = [
            Section("positions", "Finishing positions by track", _positions(scored, _where(scored), count, by_race=False)),
            Section("differences", "Differences on the same races", _differences(scored, reference)),
            Section("strategies", "Strategies driven", strategies.figure3(scored)),
            Section("criteria", "Three criteria of a reasonable strategy", criteria.criteria_table(scored, _where(scored), by_race=False)),
        ]
    if study.cars:
        found.append(Section("cars", "Every car called in turn", cars.cars(study.cars)))
    held_out = study.held_out
    if held_out and held_out.table:
        body = together(
            _positions(held_out, _where(held_out), count, by_race=True),
            _differences(held_out, reference),
            criteria.criteria_table(held_out, _where(held_out), by_race=True),
        )
        found.append(Section("held-out", f"Held-out season {held_out.races[0].season}", body))
    if study.left_out:
        found.append(Section("left-out", "Who was left out", _left_out(study.left_out)))
    return found


def _where(scored: Scored) -> str:
    seasons = sorted({race.season for race in scored.races})
    return f"{counted(len(scored.races), 'track')} of {', '.join(map(str, seasons))}"


def _positions(scored: Scored, where: str, count: str, *, by_race: bool) -> Markup:
    caption = f"Mean finishing position by track, {where}: {count} at each, the same for all"
    return together(
        positions.standing(scored, where),
        positions.averages_figure(scored, where),
        positions.positions_table(scored, caption, by_race=by_race),
        positions.gap_table(scored, where, by_race=by_race),
    )


def _differences(scored: Scored, reference: str | None) -> Markup:
    """Nothing without a model."""
    if reference is None:
        return Markup("")
    return together(
        differences.heat_map(scored, _where(scored)),
        differences.differences_figure(scored, reference, _where(scored)),
        differences.against_reference(scored, reference, _where(scored)),
    )


def _left_out(rows: Sequence[LeftOut]) -> Markup:
    """A line for each strategist and reason."""
    races: dict[tuple[str, str], list[str]] = {}
    for row in rows:
        races.setdefault((row.strategist, row.reason), []).append(race_title(row.race))
    lines = [element("li", f"{name}: {reason} ({', '.join(where)})") for (name, reason), where in races.items()]
    return element("ul", lines)


def _page(results: Results, sections: Sequence[Section], made: str) -> str:
    title = "RSRL: " + _title(results)
    head = element(
        "head",
        element("meta", charset="utf-8"),
        element("meta", name="viewport", content="width=device-width, initial-scale=1"),
        element("meta", http_equiv="Content-Security-Policy", content=POLICY),
        element("title", title),
        element("style", Markup(package_files("rsrl.report").joinpath("report.css").read_text(encoding="utf-8"))),
    )
    body = element("body", _front(results, sections, title, made), element("main", [_section(i, s) for i, s in enumerate(sections, 1)]))
    return f"<!DOCTYPE html>\n{element('html', head, body, lang='en-GB')}\n"


def _title(results: Results) -> str:
    if results.generalise:
        return "how strategists do on tracks seen and unseen"
    if results.evaluation:
        return f"who calls {race_title(results.evaluation.race)} best"
    if results.explanation and not results.robustness:
        document = results.explanation
        lap = f", lap {document.lap}" if document.lap else ""
        return f"{document.driver} at {race_title(document.race)}{lap}, called and explained"
    return "a model among other rivals and with other figures"


def _front(results: Results, sections: Sequence[Section], title: str, made: str) -> Markup:
    numbers = {section.id: i for i, section in enumerate(sections, 1)}
    sentences = [element("li", one.text, _pointers(one.sections, numbers)) for one in summary(results)]
    contents = [element("li", _link(section.id, section.title)) for section in sections]
    return element(
        "header",
        element("h1", title),
        element("p", f"Report of {date(made)}, RSRL {__version__}.", class_="made"),
        [element("h2", "Summary"), element("ul", sentences, class_="summary")] if sentences else "",
        element("h2", "What was run"),
        notes.what_was_run(results.files()),
        notes.who_took_part(results.generalise.strategists) if results.generalise else "",
        element("nav", element("h2", "Contents"), element("ol", contents), aria_label="Contents"),
    )


def _pointers(names: Sequence[str], numbers: Mapping[str, int]) -> list[Markup]:
    return [together(", " if i else " ", _link(name, f"Section {numbers[name]}")) for i, name in enumerate(names) if name in numbers]


def _link(section: str, text: str) -> Markup:
    return element("a", text, href=f"#{section}")


def _section(number: int, section: Section) -> Markup:
    heading = element("h2", f"{number}. {section.title}")
    return element("section", heading, section.body, id=section.id)
