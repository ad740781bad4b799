"""Result files for tests of the report: a study whose cells are made up, and the other files it may lie beside."""

import json
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np

from rsrl.evaluation.study import Cell, Entrant, Study, generalise, plan_cells
from rsrl.report import Report, make_report
from rsrl.results import Provenance, from_plain, to_json
from rsrl.season import load_race

RACES = 40
PROVENANCE: dict[str, Any] = {
    "command": "rsrl study generalise --out runs/g", "seed": 7, "version": "0.1.0", "date": "2026-11-24T15:57:21+00:00",
    "machine": {"cpu": "a processor", "cores": 2, "python": "3.11.7", "platform": "Linux x86_64"},
}  # fmt: skip
ADVANTAGE = {"all": 0.0, "fixed": 0.8, "heuristic": -0.2, "hindsight": -1.5}


def study(*, model: bool = True, held_out: bool = False, cars: bool = False, name: str = "all") -> dict[str, Any]:
    """What `rsrl study generalise` could have written: Japan, Spain and Qatar, where `fixed` is left out."""
    entrants = [Entrant("fixed", "fixed", False, (), RACES), Entrant("heuristic", "heuristic", False, (), RACES // 2)]
    entrants += [Entrant("hindsight", "imitation", False, (), RACES)]
    entrants = [Entrant(name, "best-plan", True, ("japan-2022",), RACES), *entrants] if model else entrants
    asked = Study(
        tuple(entrants), ("japan-2023", "qatar-2023", "spain-2023"), held_out=("spain-2024", "monaco-2024") if held_out else (),
        cars_at=("japan-2023",) if cars else (), cars_by=(name, "heuristic") if cars else (),
    )  # fmt: skip
    cells = plan_cells(asked)
    results = {cell: _called(*slot, cell) for slot, cell in cells.items()}
    written: dict[str, Any] = json.loads(to_json(generalise(asked, cells, results, from_plain(PROVENANCE, Provenance))))
    return written


def _called(name: str, race: str, driver: str, cell: Cell) -> dict[str, Any]:
    if name == "fixed" and race not in ("japan-2023", "spain-2023"):
        return {"left_out": "no published strategies"}
    rng = np.random.default_rng([ord(letter) for letter in race + driver])
    luck = rng.normal(8, 3, RACES)
    drawn = luck + ADVANTAGE.get(name, 0.0) + np.random.default_rng([ord(letter) for letter in name + race]).normal(0, 0.7, RACES)
    zeros, third = [0] * cell.races, load_race(race).laps // 3
    common = [
        {
            "plan": f"M-H@{third}", "share": 0.625, "races": 25, "compounds": [1, 2], "laps": [third], "windows": [[third - 4, third + 3]],
            "mean_position": 7.25,
        }
    ]  # fmt: skip
    return {
        "laps": load_race(race).laps, "position": np.clip(np.round(drawn), 1, 20).astype(int).tolist()[: cell.races], "points": zeros,
        "stops": [1] * cell.races, "invalid": zeros, "retired": zeros, "driven": [f"M-H@{third}"] * cell.races, "common": common,
        "timing": {"decision_ms": 0.5},
    }  # fmt: skip


def evaluation() -> dict[str, Any]:
    """What `rsrl evaluate --out` could have written."""
    rest = {"mean_points": 9.75, "mean_stops": 1.5, "invalid_share": 0.0, "retired_share": 0.125, "decision_ms": 0.25}
    rows = [
        {"strategist": name, "mean_position": 6.0 + d, "ci95": [5.7 + d, 6.3 + d], "difference": d, "difference_ci95": ends, "p_better": p}
        | rest
        | {"gap_closed": gap, "gap_closed_ci95": [gap - 0.04, gap + 0.04]}
        for name, d, ends, p, gap in (
            ("hindsight", -1.25, [-1.5, -1.0], 0.25, 1.0), ("rsrl", 0.0, [0.0, 0.0], 0.5, 0.37), ("fixed", 0.75, [0.5, 1.0], 0.625, 0.0),
        )
    ]  # fmt: skip
    strategy = {"strategist": "rsrl", "share": 0.5, "races": 960, "compounds": [0, 2, 2], "laps": [16, 34], "windows": [[12, 19], [31, 39]]}
    return {
        "race": "bahrain-2023", "driver": "HAM", "races": 1920, "seed": 7, "rows": rows, "warnings": ["rsrl: never saw this track"],
        "strategies": [strategy | {"mean_position": 4.25, "plan": "S-H@16-H@34"}], "provenance": PROVENANCE,
    }  # fmt: skip


def robustness() -> dict[str, Any]:
    """What `rsrl study robustness --out` could have written."""
    against = {"strategist": "heuristic", "mean_position": 6.5, "difference": 0.3, "difference_ci95": [0.1, 0.5], "p_better": 0.55}
    row = {"draws": 1, "races": 960, "mean_position": 6.2, "ci95": [5.9, 6.5]}
    rows = [
        row
        | {
            "rivals": rivals,
            "scale": scale,
            "against": [against | {"difference": 0.3 - scale, "difference_ci95": [0.1 - scale, 0.5 - scale]}],
        }
        for rivals in ("reactive", "itself")
        for scale in (0.0, 1.0)
    ]
    plan = {"rivals": ["reactive", "itself"], "scales": [0, 1], "draws": 8, "races": 960, "first_race": 0, "informed": False}
    about = {"race": "bahrain-2023", "driver": "HAM", "model": "all", "seed": 7}
    return about | {"plan": plan, "rows": rows, "provenance": PROVENANCE}


def report_of(folder: Path, **files: dict[str, Any]) -> Report:
    """Write result files by their names without the end, and make the report of them."""
    for name, document in files.items():
        (folder / f"{name}.json").write_text(json.dumps(document), encoding="utf-8")
    return make_report(folder, "rsrl report runs/g", "2026-11-25T08:00:00+00:00")


class Page(HTMLParser):
    """A page taken apart: nesting, tables, texts of sections, links and where they may lead."""

    def __init__(self, html: str) -> None:
        super().__init__()
        self.open: list[tuple[str, dict[str, str | None]]] = []
        self.wrong: list[str] = []
        self.tables: dict[str, list[list[str]]] = {}
        self.heads: list[dict[str, str | None]] = []
        self.images: list[str | None] = []
        self.texts: dict[str, str] = {}
        self.links: list[str] = []
        self.ids: list[str] = []
        self._rows: list[list[str]] = []
        self._caption = ""
        self.feed(html)
        self.close()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        named = dict(attrs)
        self.ids += [value for name, value in attrs if name == "id" and value]
        self.links += [value for name, value in attrs if name == "href" and value]
        if tag == "svg":
            self.images.append(named.get("aria-label") if named.get("role") == "img" else None)
        if tag == "table":
            self._rows, self._caption = [], ""
        elif tag == "tr":
            self._rows.append([])
        elif tag in ("th", "td"):
            self._rows[-1].append("")
            self.heads += [named] if tag == "th" else []
        if tag not in ("meta", "br"):
            self.open.append((tag, named))

    def handle_endtag(self, tag: str) -> None:
        if not self.open or self.open[-1][0] != tag:
            self.wrong.append(tag)
            return
        self.open.pop()
        self.texts.setdefault(self._section(), "")
        if tag in ("td", "th", "caption", "text", "li"):
            self.texts[self._section()] += " "
        if tag == "table":
            assert self._caption not in self.tables, "two tables of one caption"
            self.tables[self._caption] = self._rows

    def handle_data(self, data: str) -> None:
        tags = [tag for tag, _ in self.open]
        self.texts[self._section()] = self.texts.get(self._section(), "") + data
        if "caption" in tags:
            self._caption += data
        elif "td" in tags or "th" in tags:
            self._rows[-1][-1] += data

    def _section(self) -> str:
        return next((str(named["id"]) for tag, named in self.open if tag == "section"), "front")

    def table(self, caption: str) -> list[list[str]]:
        """The one table whose caption begins so."""
        (found,) = [rows for title, rows in self.tables.items() if title.startswith(caption)]
        return found
