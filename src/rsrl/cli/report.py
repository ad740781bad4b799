"""`rsrl report`: a study folder as one page, to read offline and to print."""

from pathlib import Path
from typing import Annotated

import typer

from rsrl.cli.files import make_folder, refuse_overwrite, write_text
from rsrl.cli.options import ForceOption, JsonOption
from rsrl.cli.output import Column, Output, table
from rsrl.cli.provenance import command_line, provenance

REPORT_FILE = "report.html"

FolderArgument = Annotated[Path, typer.Argument(metavar="DIR", help="A folder of results: of rsrl study, or of rsrl evaluate --out.")]
OutOption = Annotated[Path | None, typer.Option("--out", metavar="FILE", help=f"The page to write; else DIR/{REPORT_FILE}.")]


def command(folder: FolderArgument, out: OutOption = None, force: ForceOption = False, json: JsonOption = False) -> None:
    """Write the results of a folder as one HTML page, to read and to print.

    The page has a section for each result file in the folder:
    generalise.json and robustness.json of rsrl study, and evaluation.json of
    rsrl evaluate --out. It needs no other file, no network and no script.

    [bold]Examples[/bold]

    rsrl report runs/generalise
    rsrl report runs/generalise --out report.html --force
    rsrl report runs/generalise --json
    """
    from rsrl.report import make_report

    output = Output(json)
    path = out or folder / REPORT_FILE
    about = provenance(None)
    report = make_report(folder, command_line(), about.date)
    refuse_overwrite(path, force)
    make_folder(path.parent)
    write_text(path, report.html)
    sections = [{"id": section.id, "title": section.title} for section in report.sections]
    result = {"path": str(path), "files": list(report.files), "sections": sections, "provenance": about}
    rows = [("page", path), ("made of", ", ".join(report.files)), ("sections", "; ".join(section.title for section in report.sections))]
    output.result(result, table("Report", ("", Column("", words=True)), rows))
