"""`rsrl study`: the paper's studies, each a command of its own."""

from typing import Final

import typer

from rsrl.cli.study_explanations import command as explanations
from rsrl.cli.study_generalise import generalise
from rsrl.cli.study_robustness import command as robustness

ABOUT: Final = """Run a study, on this machine or a cluster.

The study of generalisability is made of cells: one strategist calling
some races of one Grand Prix. Finished cells are kept under --out, so that
a study that was interrupted goes on where it was.

generalise   how models do on tracks they never saw (Table 3, Figure 3)
robustness   a model against other rivals and in seasons it does not know
explanations how far explanations can be trusted, beside the paper's figures

[bold]Examples[/bold]

rsrl study generalise --models all=runs/all --out runs/generalise
rsrl study generalise --models all=runs/all --out runs/generalise --json
rsrl study generalise --help
"""

app = typer.Typer(help=ABOUT)
app.command("generalise", short_help="How models do on tracks they never saw")(generalise)
app.command("robustness", short_help="A model against other rivals and in seasons it does not know")(robustness)
app.command("explanations", short_help="How far explanations can be trusted, beside the paper's figures")(explanations)


@app.callback()
def _study() -> None:
    pass
