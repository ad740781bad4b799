"""`rsrl study`: the paper's studies, each a command of its own."""

from typing import Final

import typer

from rsrl.cli.study_explanations import command as explanations
from rsrl.cli.study_generalise import generalise
from rsrl.cli.study_robustness import command as robustness

ABOUT: Final = """Run one of the paper's studies, on this machine or a cluster.

generalise compares models on tracks they were not trained on (the paper's
Table 3 and Figure 3). robustness tests a model against other rivals and in
seasons whose figures differ from those it believes in. explanations measures
how well explanations match the policy, beside the paper's figures.

A study of generalisation can be interrupted: finished parts are kept under
--out, and the same command continues where it stopped.

[bold]Examples[/bold]

rsrl study generalise --models all=runs/all --out runs/generalise
rsrl study generalise --models all=runs/all --out runs/generalise --json
rsrl study generalise --help
"""

app = typer.Typer(help=ABOUT)
app.command("generalise", short_help="Compare models on tracks they were not trained on")(generalise)
app.command("robustness", short_help="Test a model against other rivals and in other seasons")(robustness)
app.command("explanations", short_help="Measure how well explanations match the policy")(explanations)


@app.callback()
def _study() -> None:
    pass
