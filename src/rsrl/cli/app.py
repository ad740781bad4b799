"""Entry point: the list of commands, and errors as one line.

A command is a module `rsrl.cli.<name>` and a line in `COMMANDS`. The module has a function `command`, whose docstring is its help, or an
`app` with commands of its own. Only the module of the command typed is imported, and commands import heavy packages (jax, numba, polars)
inside their functions, so that `rsrl --help` answers at once.
"""

import os
import sys
from collections.abc import Sequence
from importlib import import_module
from typing import Annotated, Final

import typer
from typer.main import get_command

from rsrl import __version__
from rsrl.cli.interrupts import EXIT_INTERRUPTED, answer_while_compiling
from rsrl.cli.progress import CompileNotice
from rsrl.cli.provenance import remember_command_line
from rsrl.cli.standard_output import EXIT_READER_GONE, StandardOutputError, guarded_stdout
from rsrl.compile_watch import watch
from rsrl.errors import RsrlError
from rsrl.standard_error import tell

EXIT_MISUSE: Final = 2

EXTRA: Final = "extra argument"
"""What Typer says of a word too many, such as those of `rsrl simulate monza 2023`."""

COMMANDS: Final[dict[str, str]] = {
    "races": "List the races that can be simulated",
    "calibrate": "Fit season files to real lap times",
    "simulate": "Simulate a race many times and show how each car fares",
    "plan": "Search for the best pit stop plans before the race",
    "train": "Train an agent to call races",
    "evaluate": "Compare a model with other strategists on the same races",
    "explain": "Explain a call: what if, why, and what would change it",
    "wall": "Open the pit wall: a page with the race, the call, and why",
    "replay": "Replay a recorded race: the call on every lap beside what the team did",
    "live": "Follow a race as it comes, with a call whenever the race changes",
    "audit": "Audit a season: what the calls of teams were worth, by race and by team",
    "backtest": "Predict real races from earlier ones and score the predictions",
    "record": "Record live timing, or what a Formula One game sends",
    "study": "Run one of the paper's studies, on this machine or a cluster",
    "report": "Write a folder of results as one HTML page",
    "demo": "Train a policy for half a minute and compare it with baselines",
    "bench": "Measure how fast RSRL runs on this machine",
}
"""Commands and their lines in `rsrl --help`, in the order a newcomer would use them."""

ABOUT: Final = """Race strategy for Formula One: each lap, stay out or box for soft, medium or hard, and why.

Races are named by Grand Prix and season, such as bahrain-2023; rsrl races
lists them. Each command has its own help with examples: rsrl plan --help.
With --json a command prints its result as JSON on standard output, and
nothing else.
"""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command, by default from the arguments of the process, and return the exit code.

    0 is success; 2 is bad input, or standard output that cannot be written to, reported in one line on standard error; 130 is an
    interruption; 141 means that the reader of the output has gone. Any other error is a bug in RSRL and shows as a traceback. A process of
    its own says that it compiles kernels, and answers Ctrl-C meanwhile.
    """
    if arguments is None:
        if sys.stderr is None:  # closed; some packages write to it unasked
            sys.stderr = open(os.devnull, "w", encoding="utf-8")  # noqa: SIM115  # until the process ends
        watch(CompileNotice())
        answer_while_compiling()
    typed = list(sys.argv[1:] if arguments is None else arguments) or ["--help"]
    if typed[0] == "help":  # as other tools have it
        typed = [*typed[1:], "--help"]
    remember_command_line(typed)
    wanted = next((word for word in typed if not word.startswith("-")), None)
    command = get_command(build_app(wanted))
    try:
        with guarded_stdout():
            code = command.main(args=typed, prog_name="rsrl", standalone_mode=False)
    except StandardOutputError as error:
        return EXIT_READER_GONE if error.reader_gone else _complain(str(error))
    except RsrlError as error:
        return _complain(str(error))
    except typer.TyperException as error:
        return _complain(_usage_message(error, wanted))
    if code == EXIT_INTERRUPTED:
        tell("rsrl: interrupted")
    return int(code or 0)


def build_app(wanted: str | None) -> typer.Typer:
    """The application: the command `wanted` with its module imported, the others by name only."""
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
    version: Annotated[bool, typer.Option("--version", help="Show the version and exit.", is_eager=True, callback=_show_version)] = False,
) -> None:
    """Options of `rsrl` itself; each acts on its own."""


def _not_imported() -> None:
    raise AssertionError("only the command that was typed is imported, so no other can run")


def _usage_message(error: typer.TyperException, wanted: str | None) -> str:
    """What is wrong with the arguments, and where to read more."""
    path = f"rsrl {wanted}" if wanted in COMMANDS else "rsrl"
    message = error.format_message().rstrip(".")
    if EXTRA in message:
        message += "; a name of several words stands in quotes, and options begin with --"
    return f"{message}{' See' if message.endswith('?') else '; see'} `{path} --help`"


def _complain(message: str) -> int:
    tell("rsrl: error: " + " ".join(message.split()))
    return EXIT_MISUSE
