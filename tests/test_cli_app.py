"""The frame of the command line: help, errors in one line, exit codes, and a quick start."""

import subprocess
import sys
from collections.abc import Callable

import pytest

from rsrl import __version__
from rsrl.cli import app, main, races
from rsrl.errors import RsrlError

Capture = pytest.CaptureFixture[str]
HEAVY = ("jax", "numba", "numpy", "polars", "scipy", "sklearn", "matplotlib", "gymnasium")


def complaint(capsys: Capture, *arguments: str) -> str:
    """The one line a refused command prints, without its beginning."""
    assert main(arguments) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err.count("\n") == 1
    assert err.startswith("rsrl: error: ")
    return err.removeprefix("rsrl: error: ").strip()


@pytest.fixture
def races_raises(monkeypatch: pytest.MonkeyPatch) -> Callable[[BaseException], None]:
    """Makes `rsrl races` raise what is given."""

    def arrange(error: BaseException) -> None:
        def command() -> None:
            raise error

        monkeypatch.setattr(races, "command", command)

    return arrange


def test_python_m_is_the_same_command() -> None:
    done = subprocess.run([sys.executable, "-m", "rsrl", "--version"], capture_output=True, text=True, check=True)
    assert (done.stdout, done.stderr) == (f"rsrl {__version__}\n", "")


@pytest.mark.parametrize("words", [["races"], []])
def test_help_is_a_word_too(capsys: Capture, words: list[str]) -> None:
    assert main(["help", *words]) == 0
    told = capsys.readouterr().out
    assert main([*words, "--help"]) == 0
    assert capsys.readouterr().out == told != ""


def test_a_name_of_two_words_without_quotes_is_told_of_quotes(capsys: Capture) -> None:
    assert complaint(capsys, "simulate", "monza", "2023") == (
        "Got unexpected extra argument(s) (2023); a name of several words stands in quotes, and options begin with --; "
        "see `rsrl simulate --help`"
    )


def test_a_command_misspelt_is_told_of_the_right_one(capsys: Capture) -> None:
    assert complaint(capsys, "simulte") == "No such command 'simulte'. Did you mean 'simulate'? See `rsrl --help`"


@pytest.mark.parametrize("arguments", [[], ["--help"], ["-h"]])
def test_help_lists_every_command(capsys: Capture, arguments: list[str]) -> None:
    assert main(arguments) == 0
    text = capsys.readouterr().out
    for name, summary in app.COMMANDS.items():
        assert name in text
        assert summary[:30] in text


@pytest.mark.parametrize("name", app.COMMANDS)
def test_each_command_teaches_by_example(capsys: Capture, name: str) -> None:
    assert main([name, "--help"]) == 0
    text = capsys.readouterr().out
    assert "Examples" in text
    assert text.count(f"rsrl {name}") >= 3
    assert "--json" in text


def test_version(capsys: Capture) -> None:
    assert main(["--version"]) == 0
    assert capsys.readouterr().out == f"rsrl {__version__}\n"


def test_misuse_is_one_line_and_exit_code_2(capsys: Capture) -> None:
    assert complaint(capsys, "fly") == "No such command 'fly'; see `rsrl --help`"
    assert complaint(capsys, "--fast") == "No such option: --fast; see `rsrl --help`"
    assert complaint(capsys, "races", "--fast") == "No such option: --fast; see `rsrl races --help`"
    assert complaint(capsys, "simulate") == "Missing argument 'RACE'; see `rsrl simulate --help`"
    assert complaint(capsys, "simulate", "bahrain-2023", "--seed") == "Option '--seed' requires an argument; see `rsrl simulate --help`"
    assert "races" in complaint(capsys, "race"), "a near miss is told what was meant"


def test_unusable_input_is_one_line_whatever_its_message(capsys: Capture, races_raises: Callable[[BaseException], None]) -> None:
    races_raises(RsrlError("laps.csv: empty\n  give another"))
    assert complaint(capsys, "races") == "laps.csv: empty give another"


def test_interruption_is_quiet(capsys: Capture, races_raises: Callable[[BaseException], None]) -> None:
    races_raises(KeyboardInterrupt())
    assert main(["races"]) == 130
    assert capsys.readouterr() == ("", "rsrl: interrupted\n")


def test_a_fault_of_our_own_is_not_dressed_up(races_raises: Callable[[BaseException], None]) -> None:
    races_raises(ZeroDivisionError())
    with pytest.raises(ZeroDivisionError):
        main(["races"])


@pytest.mark.parametrize("arguments", [["--help"], ["races", "--json"], *([name, "--help"] for name in app.COMMANDS)])
def test_nothing_heavy_is_imported_before_it_is_needed(arguments: list[str]) -> None:
    program = (
        "import sys\nfrom rsrl.cli import main\n"
        f"assert main({arguments!r}) == 0\n"
        "print(*(m for m in sys.modules if '.' not in m or m.startswith('rsrl.cli.')), file=sys.stderr)"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    loaded = done.stderr.split()
    assert not set(HEAVY) & set(loaded)
    commands = {f"rsrl.cli.{name}" for name in app.COMMANDS} & set(loaded)
    assert commands <= {f"rsrl.cli.{arguments[0]}"}
