"""What the scripts have in common that hold figures against real races: options, the command in the result, errors in one line."""

import argparse
import shlex
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from rsrl.cli.files import write_json
from rsrl.cli.provenance import provenance
from rsrl.errors import RsrlError
from rsrl.evaluation.backtest.shipped_races import ShippedRace, shipped_races
from rsrl.results import Provenance

RESULTS = Path(__file__).parent / "results"
Measure = Callable[[argparse.Namespace, Provenance], Any]


def folder_options(script: str, about: str | None) -> argparse.ArgumentParser:
    """Folders of laps and facts, and the result file of a script."""
    parser = argparse.ArgumentParser(description=about, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--laps", type=Path, required=True, metavar="LAPS_FOLDER")
    parser.add_argument("--facts", type=Path, required=True, metavar="FACTS_FOLDER")
    parser.add_argument("--out", type=Path, default=RESULTS / f"{script.replace('_', '-')}.json", metavar="FILE")
    return parser


def options_of(script: str, about: str | None, simulated: int) -> argparse.ArgumentParser:
    """The same with seasons, races to simulate and seed; `simulated` is how many races it simulates by default."""
    parser = folder_options(script, about)
    parser.add_argument("seasons", type=int, nargs="+", metavar="SEASON")
    parser.add_argument("--races", type=int, default=simulated, metavar="N", help=f"simulated races (default {simulated})")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--only", nargs="+", metavar="RACE", help="such as italy-2023; all races of the seasons by default")
    parser.add_argument("--files", type=Path, metavar="FILES_FOLDER", help="season files; the shipped ones by default")
    return parser


def races_of(options: argparse.Namespace) -> Iterator[ShippedRace]:
    """The races that a script is asked for; each is named on stderr as its turn comes."""
    if options.races < 2:
        raise RsrlError(f"--races {options.races}: simulate two at least, an error needs them")
    for race in shipped_races(options.laps, options.facts, options.seasons, options.only or (), options.files):
        print(f"{race.record.name} ...", file=sys.stderr)
        yield race


def run(script: str, parser: argparse.ArgumentParser, measure: Measure, table: Callable[[Any], str]) -> int:
    """Measure, write the result, print its table; returns the exit code: 2 with one line on stderr for bad input."""
    options = parser.parse_args()
    try:
        result = measure(options, provenance(getattr(options, "seed", None), command=command(script, parser, options)))
        write_json(options.out, result)
    except RsrlError as error:
        print(f"{script}: {error}", file=sys.stderr)
        return 2
    print(table(result), end="")
    return 0


def command(script: str, parser: argparse.ArgumentParser, options: argparse.Namespace) -> str:
    """The command as it can be typed again; folders by what they hold, the result file left out."""
    positional, named = [], []
    for action in parser._actions:
        value = getattr(options, action.dest, None)
        if value is None or action.dest == "out":
            continue
        words = [str(action.metavar)] if isinstance(value, Path) else list(map(str, value if isinstance(value, list) else [value]))
        named += [action.option_strings[0], *words] if action.option_strings else []
        positional += [] if action.option_strings else words
    return shlex.join(["python", f"benchmarks/{script}.py", *positional, *named])
