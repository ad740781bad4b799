"""Entry point: which commands there are, and how anything that goes wrong is told in one line.

A command is a module `rsrl.cli.<name>` with a function `command`, whose docstring is its help, or with an `app` of commands
of its own, and a line in `COMMANDS`. Only the module of the command that was typed is imported, and commands import what is
heavy (jax, numba, polars) inside their functions, so that `rsrl --help` answers at once.
"""

import sys
from collections.abc import Sequence
from importlib import import_module
from typing import Annotated, Final

import typer
from typer.main import get_command

from rsrl import __version__
from rsrl.cli.provenance import remember_command_line
from rsrl.errors import RsrlError

EXIT_MISUSE: Final = 2
EXIT_INTERRUPTED: Final = 130

COMMANDS: Final[dict[str, str]] = {
    "races": "List the races there are figures for",
    "calibrate": "Fit a race's figures to real laps and write its season file",
    "simulate": "Run a race many times over and show how everybody fares",
    "plan": "Find the best plans before the race, by brute force",
    "train": "Train an agent to call races",
    "evaluate": "Compare a model with other strategists on the same races",
    "explain": "Explain a call: what if, why, and what would change it",
    "backtest": "Predict real races from those before them, and score it",
    "study": "Run one of the paper's studies, on this machine or a cluster",
    "report": "Write a study's tables and figures as one page to read and print",
    "demo": "Watch RSRL learn to call a race and beat the baselines",
    "bench": "Measure how fast everything runs on this machine",
}
"""Name of each command, in the order of use, and its line in `rsrl --help`."""

ABOUT: Final = """Call a Formula One race, lap by lap: stay out, or box for soft, medium or hard, and why.

A race is named by Grand Prix and season: bahrain-2023. Every command
explains itself: rsrl simulate --help. With --json a command prints its
result, and nothing else, as JSON on standard output.
"""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command; arguments of the process by default. Returns the exit code.

    0 is success, 2 input that cannot be used (told in one line on standard error), 130 an interruption. Anything
    else is a fault of RSRL and shows as a traceback.
    """
    typed = list(sys.argv[1:] if arguments is None else arguments) or ["--help"]
    remember_command_line(typed)
    wanted = next((word for word in typed if not word.startswith("-")), None)
    command = get_command(build_app(wanted))
    try:
        code = command.main(args=typed, prog_name="rsrl", standalone_mode=False)
    except RsrlError as error:
        return _complain(str(error))
    except typer.TyperException as error:
        return _complain(_usage_message(error, wanted))
    if code == EXIT_INTERRUPTED:
        print("rsrl: interrupted", file=sys.stderr)
    return int(code or 0)


def build_app(wanted: str | None) -> typer.Typer:
    """The application, with the module of the command `wanted` imported and the others by name only."""
    app = typer.Typer(help=ABOUT, add_completion=False, context_settings={"help_option_names": ["-h", "--help"]})
    app.callback()(_common)
    for name, summary in COMMANDS.items():
        module = import_module(f"rsrl.cli.{name}") if name == wanted else None
        if module and hasattr(module, "app"):
            app.add_typer(module.app, name=name, short_help=summary)
        else:
            app.command(name, short_help=summary)(module.command if module else _not_imported)
    return app


def _show_version(asked: bool) -> None:
    if asked:
        print(f"rsrl {__version__}")
        raise typer.Exit


def _common(
    version: Annotated[bool, typer.Option("--version", help="Show the version and stop.", is_eager=True, callback=_show_version)] = False,
) -> None:
    """Options of `rsrl` itself; each acts on its own."""


def _not_imported() -> None:
    raise AssertionError("a command that was not typed was run")


def _usage_message(error: typer.TyperException, wanted: str | None) -> str:
    """What was wrong with the words typed, and where to read more."""
    path = f"rsrl {wanted}" if wanted in COMMANDS else "rsrl"
    return f"{error.format_message().rstrip('.')}; see `{path} --help`"


def _complain(message: str) -> int:
    print("rsrl: error: " + " ".join(message.split()), file=sys.stderr)
    return EXIT_MISUSE
