"""`rsrl study`: the paper's studies, each a command of its own."""

from typing import Final

import typer

from rsrl.cli.study_generalise import generalise

ABOUT: Final = """Run one of the paper's studies, on this machine or a cluster.

A study is made of cells: one strategist calling some races of one Grand
Prix. Finished cells are kept under --out, so a study that was interrupted
goes on where it was.

generalise   how models do on tracks they never saw (Table 3, Figure 3)

[bold]Examples[/bold]

rsrl study generalise --models all=runs/all --out runs/generalise
rsrl study generalise --models all=runs/all --out runs/generalise --json
rsrl study generalise --help
"""

app = typer.Typer(help=ABOUT)
app.command("generalise", short_help="How models do on tracks they never saw")(generalise)


@app.callback()
def _study() -> None:
    pass
