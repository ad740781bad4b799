"""The report's page: every number stands where it should, nothing from outside is needed, no text of a file becomes markup."""

import re
from pathlib import Path
from typing import Any

import pytest
from report_study import PROVENANCE, Page, evaluation, report_of, robustness, study

from rsrl.report import Report

MINUS = "\N{MINUS SIGN}"


@pytest.fixture(scope="module")
def full() -> dict[str, Any]:
    return study(held_out=True, cars=True)


@pytest.fixture(scope="module")
def report(full: dict[str, Any], tmp_path_factory: pytest.TempPathFactory) -> Report:
    return report_of(tmp_path_factory.mktemp("full"), generalise=full, evaluation=evaluation(), robustness=robustness())


@pytest.fixture(scope="module")
def page(report: Report) -> Page:
    return Page(report.html)


def test_sections_of_all_files_in_order(report: Report, page: Page) -> None:
    assert [section.id for section in report.sections] == [
        "leaderboard", "positions", "differences", "strategies", "criteria", "cars", "held-out", "left-out", "robustness",
        "reading", "again",
    ]  # fmt: skip
    assert report.files == ("generalise.json", "evaluation.json", "robustness.json")
    for number, section in enumerate(report.sections, 1):
        assert page.texts[section.id].startswith(f"{number}. {section.title}")


def test_every_number_of_table_3_stands_in_its_row_and_column(full: dict[str, Any], page: Page) -> None:
    _, heads, *rows = page.table("Mean finishing position by track, 3 tracks")
    assert heads == ["strategist", "JPN", "QAT", "SPN", "all", "seen", "unseen"]
    cells = {row[0]: row for row in rows}
    column = {race["race"]: i for i, race in enumerate(full["tracks"]["races"], 1)}
    for row in full["tracks"]["table"]:
        cell = cells[row["strategist"]][column[row["race"]]]
        assert cell.startswith(f"{row['mean_position']:.2f}")
        assert cell.endswith(f"±{row['ci95'][1] - row['mean_position']:.2f}")
        assert (" best" in cell) == row["best"]
        assert (" trained on" in cell) == row["trained"]
    for row in full["tracks"]["averages"]:
        if row["over"] in heads:
            assert cells[row["strategist"]][heads.index(row["over"])].startswith(f"{row['mean_position']:.2f}")
    assert cells["fixed"][2] == "\N{EN DASH}"
    assert "(2)" in cells["fixed"][4], "an average over fewer tracks is marked"


def test_best_is_bold_and_trained_is_underlined(full: dict[str, Any], report: Report) -> None:
    for row in full["tracks"]["table"]:
        shown = f"{row['mean_position']:.2f}"
        if row["best"]:
            assert re.search(rf"<strong>(<u>)?{shown}", report.html)
        if row["trained"]:
            assert f"<u>{shown}</u>" in report.html


def test_standing_over_tracks_has_intervals_and_who_ran_fewer_comes_last(full: dict[str, Any], page: Page) -> None:
    heads, *rows = page.table("Mean finishing position over 3 tracks of 2023")
    assert heads[:5] == ["strategist", "all tracks", "seen tracks", "unseen tracks", "gap closed"]
    assert rows[0][0] == "hindsight"
    assert rows[-1][0] == "fixed"
    for row in full["tracks"]["averages"]:
        if row["over"] == "all":
            (cell,) = [cells[1] for cells in rows if cells[0] == row["strategist"]]
            assert cell.endswith(f"{row['ci95'][0]:.2f} to {row['ci95'][1]:.2f}")


def signed(value: float) -> str:
    text = f"{abs(value):.2f}"
    return text if text == "0.00" else ("+" if value > 0 else MINUS) + text


def test_who_took_part(page: Page) -> None:
    _, model, fixed, heuristic, _ = page.table("Who took part")
    assert model[:4] == ["all", "model", "40", "Japan 2022"]
    assert (fixed[:4], heuristic[2]) == (["fixed", "baseline", "40", ""], "20")


def test_heat_map_says_in_words_who_is_surely_ahead(full: dict[str, Any], page: Page) -> None:
    heads, *rows, last = page.table("Models against the best baseline of each track, in places, 3 tracks")
    assert heads == ["Grand Prix", "best baseline", "all"]
    for row, wanted in zip(rows, full["tracks"]["best_baselines"], strict=True):
        (model,) = wanted["models"]
        low, high = model["ci95"]
        told = "surely ahead" if low > 0 else "surely behind" if high < 0 else "too close to call"
        assert row[1] == wanted["baseline"]
        assert row[2].endswith(f"{told}: {signed(model['difference'])} {signed(low)} to {signed(high)}")
    assert sum(int(count) for count in last[2].split(", ")) == 3


def test_criteria_are_told_to_who_cannot_see_the_marks(full: dict[str, Any], page: Page) -> None:
    _, heads, *rows = page.table("Is the commonest strategy reasonable? 3 tracks")
    japan = next(row for row in full["tracks"]["criteria"] if row["strategist"] == "all" and row["race"] == "japan-2023")
    marks = "".join("\N{CHECK MARK}" if japan[name] else "\N{BALLOT X}" for name in ("few_stops", "harder_longer", "like_or_better"))
    (own,) = [row for row in rows if row[0] == "all"]
    assert own[heads.index("JPN")].startswith(f"{marks}{japan['strategy']}: one to three stops: met; hardest compound")
    met = sum(bool(row["reasonable"]) for row in full["tracks"]["criteria"] if row["strategist"] == "all")
    assert own[-1] == f"{met} of 3"


def test_every_car_has_its_number_in_table_and_plot(full: dict[str, Any], page: Page) -> None:
    (row,) = full["cars"]
    rows = {cells[0]: cells for cells in page.table("Japan 2023: places behind all by car")[1:]}
    assert len(rows) == 20
    for car in row["by_car"]:
        assert rows[car["driver"]][1] == f"P{car['grid']}"
        assert signed(car["difference"]) in rows[car["driver"]][2]
        assert f"P{car['grid']} {car['driver']} {signed(car['difference'])}" in " ".join(filter(None, page.images))


def test_leaderboard_with_gap_closed_and_warnings(page: Page) -> None:
    heads, *rows = page.table("Leaderboard: HAM at Bahrain 2023, 1,920 races of seed 7")
    assert heads[:5] == ["strategist", "position", "behind rsrl", "rsrl ahead", "gap closed"]
    assert rows[1][:5] == ["rsrl", "6.00 ±0.30", "", "", "37 % 33 to 41 %"]
    assert rows[2][2].endswith("surely ahead: +0.75 +0.50 to +1.00")
    assert rows[2][3] == "62 %"
    assert "Warning: rsrl: never saw this track" in page.texts["leaderboard"]
    assert page.table("Strategies driven most often")[1] == ["rsrl", "S-H@16-H@34 50 %, P4.2; 12 to 19, 31 to 39"]


def test_robustness_by_rivals_and_scale(page: Page) -> None:
    rows = page.table("HAM at Bahrain 2023: other rivals")
    assert rows[2] == ["Rivals called lap by lap as teams call (reactive)"]
    assert rows[3][:4] == ["0", "960", "6.20 ±0.30", "6.50"]
    assert rows[3][4].endswith("surely ahead: +0.30 ±0.20")
    assert rows[4][4].endswith(f"surely behind: {MINUS}0.70 ±0.20")
    assert "Of 4 comparisons the model is surely ahead in 2, surely behind in 2, and 0 are open." in page.texts["robustness"]


def test_every_number_of_the_summary_stands_in_the_section_it_points_to(report: Report, page: Page) -> None:
    lines = re.findall(r'<li>([^<]*)((?:,? <a href="#[\w-]+">Section \d+</a>)+)</li>', report.html)
    pointed = [re.findall(r'"#([\w-]+)">Section (\d+)', links) for _, links in lines]
    assert [[section for section, _ in links] for links in pointed] == [
        ["leaderboard"], ["positions", "differences"], ["differences"], ["criteria"], ["held-out"], ["robustness"],
    ]  # fmt: skip
    for (text, _), links in zip(lines, pointed, strict=True):
        assert all(report.sections[int(number) - 1].id == section for section, number in links)
        there = " ".join(page.texts[section] for section, _ in links)
        for figure in re.findall(rf"[+{MINUS}]?\d[\d,.]*\d|\d", text):
            assert re.search(rf"(?<![\d.]){re.escape(figure)}(?![\d.]*\d)", there), (figure, text)


def test_nothing_from_outside_is_needed(report: Report, page: Page) -> None:
    for word in ("http:", "https:", "//", "src=", "url(", "@import", "<script", "<link", "<img", "<iframe", "javascript:"):
        assert word not in report.html.replace("<!DOCTYPE html>", ""), word
    assert page.links
    assert all(link.startswith("#") and link[1:] in page.ids for link in page.links)
    assert len(set(page.ids)) == len(page.ids)


def test_elements_nest_tables_have_heads_and_figures_words(page: Page) -> None:
    assert (page.wrong, page.open) == ([], [])
    assert page.tables
    assert "" not in page.tables, "a table without a caption"
    assert {head.get("scope") for head in page.heads} == {"col", "row", "colgroup", "rowgroup"}
    assert page.images
    assert all(label and len(label) > 30 for label in page.images)


def test_rows_are_as_wide_as_their_table(report: Report) -> None:
    for table in re.findall(r"<table.*?</table>", report.html, flags=re.DOTALL):
        widths = [
            sum(int(span or 1) for span in re.findall(r'<t[hd](?: scope="\w+")?(?: colspan="(\d+)")?[^>]*>', row))
            for row in re.findall(r"<tr.*?</tr>", table, flags=re.DOTALL)
        ]
        assert len(set(widths)) == 1, table[:200]


@pytest.mark.parametrize("hostile", ["<b>x", '"><script>alert(1)</script>', "</td>&amp;'"])
def test_texts_of_a_file_are_escaped(tmp_path: Path, hostile: str) -> None:
    document = study(cars=True, name=hostile)
    document["provenance"] = PROVENANCE | {"command": hostile, "version": hostile}
    document["left_out"][0]["reason"] = hostile
    evaluated = evaluation()
    evaluated["rows"][0]["strategist"] = evaluated["strategies"][0]["plan"] = evaluated["warnings"][0] = hostile
    html = report_of(tmp_path, generalise=document, evaluation=evaluated).html
    page = Page(html)
    assert hostile not in html
    assert (page.wrong, page.open) == ([], [])
    assert hostile in page.texts["positions"]
    assert hostile in page.texts["leaderboard"]
    assert hostile in page.texts["front"]
    assert any(hostile in str(label) for label in page.images)


def test_parts_that_are_missing_leave_no_gap(tmp_path: Path) -> None:
    report = report_of(tmp_path, generalise=study(model=False))
    page = Page(report.html)
    assert [section.id for section in report.sections] == ["positions", "strategies", "criteria", "left-out", "reading", "again"]
    assert "Held-out" not in report.html
    assert "Best baseline" not in page.texts["reading"], "nothing is explained that is not there"
    assert [page.texts[s.id].partition(".")[0] for s in report.sections] == ["1", "2", "3", "4", "5", "6"]
    assert "Section 1" in page.texts["front"]
    assert (page.wrong, page.open) == ([], [])


@pytest.mark.parametrize(
    ("name", "document", "section"), [("evaluation", evaluation(), "leaderboard"), ("robustness", robustness(), "robustness")]
)
def test_a_folder_with_one_other_file(tmp_path: Path, name: str, document: dict[str, Any], section: str) -> None:
    report = report_of(tmp_path, **{name: document})
    assert [s.id for s in report.sections] == [section, "reading", "again"]


def test_several_training_seeds(tmp_path: Path) -> None:
    document = evaluation()
    comparison = {"strategist": "fixed", "difference": 0.7, "difference_ci95": [0.3, 1.1], "p_better": 0.6, "p_better_ci95": [0.5, 0.7]}
    document["aggregate"] = {
        "seeds": 3, "mean_position": 6.05, "mean_position_ci95": [5.8, 6.3], "iqm_position": 6.04, "iqm_position_ci95": [5.9, 6.2],
        "comparisons": [comparison],
    }  # fmt: skip
    page = Page(report_of(tmp_path, evaluation=document).html)
    rows = page.table("3 training seeds together: P6.05 (5.80 to 6.30), interquartile mean P6.04 (5.90 to 6.20)")
    assert rows[1][1].endswith("surely ahead: +0.70 +0.30 to +1.10")
    assert rows[1][2] == "60 % 50 to 70 %"
    assert "behind the mean of 3 seeds" in page.table("Leaderboard")[0]
    assert "the mean of 3 seeds finishes at P6.05 on average; it is surely ahead of fixed" in page.texts["front"]


def test_an_older_evaluation_without_gaps_and_warnings(tmp_path: Path) -> None:
    document = evaluation()
    del document["warnings"], document["strategies"]
    document["rows"] = [{k: v for k, v in row.items() if not k.startswith("gap")} for row in document["rows"]]
    page = Page(report_of(tmp_path, evaluation=document).html)
    assert "gap closed" not in page.table("Leaderboard")[0]


def test_files_of_another_version_of_the_same_format_are_told_of(tmp_path: Path) -> None:
    document = evaluation()
    document["provenance"] = PROVENANCE | {"version": "0.0.1"}
    assert "results also by 0.0.1" in Page(report_of(tmp_path, evaluation=document).html).texts["front"]


def test_the_note_of_an_older_result_is_shown(tmp_path: Path) -> None:
    document = evaluation()
    document["provenance"] = PROVENANCE | {"note": "Measured with a former search."}
    assert "evaluation.json: Measured with a former search." in Page(report_of(tmp_path, evaluation=document).html).texts["front"]


def test_an_interval_that_includes_zero_is_neither_ahead_nor_behind(tmp_path: Path) -> None:
    document = evaluation()
    document["rows"] = document["rows"][1:]  # without hindsight, which is no competitor
    document["rows"][1] |= {"difference": 0.2, "difference_ci95": [-0.01, 0.41]}
    page = Page(report_of(tmp_path, evaluation=document).html)
    assert page.table("Leaderboard")[2][2].startswith("\N{MIDDLE DOT}too close to call: ")
    assert "it is too close to call against fixed" in page.texts["front"]
    assert "surely" not in page.texts["leaderboard"]
