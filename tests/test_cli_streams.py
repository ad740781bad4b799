"""Standard output that is closed, full or of a small alphabet; files with a byte order mark; a state from standard input."""

import ast
import codecs
import io
import json
import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from rsrl.cli import main
from rsrl.cli.output import Output
from rsrl.cli.progress import CompileNotice, brief, progress, steps
from rsrl.cli.standard_output import StandardOutputError, guarded_stdout
from rsrl.results import Evaluation, read_result
from rsrl.season import load_race
from rsrl.season.toml_io import read_race, write_race
from rsrl.strategists.tree import Tree, load_tree
from rsrl.text_files import decode_text, read_text

SOURCE = Path(__file__).parents[1] / "src"
RUN = [sys.executable, "-c", "import sys; from rsrl.cli import main; sys.exit(main())"]


class Broken(io.StringIO):
    """A stream that a given error befalls once it is written to."""

    def __init__(self, error: OSError) -> None:
        super().__init__()
        self.error = error

    def write(self, text: str) -> int:
        raise self.error


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="there is no /dev/full")
@pytest.mark.parametrize("arguments", [["races"], ["races", "--json"], ["races", "--help"]])
def test_a_full_disk_is_one_line(arguments: list[str]) -> None:
    with Path("/dev/full").open("w") as full:
        done = subprocess.run([*RUN, *arguments], stdout=full, stderr=subprocess.PIPE, text=True, check=False)
    assert done.returncode == 2
    assert done.stderr == "rsrl: error: standard output: cannot be written to (No space left on device)\n"


@pytest.mark.skipif(os.name != "posix", reason="pipes of a POSIX shell")
@pytest.mark.parametrize("arguments", [["races"], ["races", "--json"], ["--help"]])
def test_a_reader_that_has_gone_ends_it_quietly(arguments: list[str]) -> None:
    reading, writing = os.pipe()
    os.close(reading)
    done = subprocess.run([*RUN, *arguments], stdout=writing, stderr=subprocess.PIPE, text=True, check=False)
    os.close(writing)
    assert (done.returncode, done.stderr) == (141, "")


@pytest.mark.skipif(os.name != "posix", reason="a POSIX shell closes the stream")
def test_standard_output_closed_from_the_start_is_one_line() -> None:
    done = subprocess.run(["sh", "-c", 'exec "$@" >&-', "sh", *RUN, "races"], capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert done.stderr == "rsrl: error: standard output: cannot be written to (it is closed)\n"


@pytest.mark.parametrize("encoding", ["cp1252", "ascii"])
@pytest.mark.parametrize("arguments", [["races"], ["--help"], ["explain", "--help"]])
def test_output_to_a_file_of_another_code_page(tmp_path: Path, encoding: str, arguments: list[str]) -> None:
    path = tmp_path / "out.txt"
    with path.open("w") as file:
        done = subprocess.run(
            [*RUN, *arguments], stdout=file, stderr=subprocess.PIPE, env=os.environ | {"PYTHONIOENCODING": encoding}, check=False
        )
    assert (done.returncode, done.stderr) == (0, b"")
    text = path.read_bytes().decode(encoding)
    assert ("Paulo Grand Prix" in text) if arguments == ["races"] else "Usage" in text


def test_failures_of_the_stream_are_told_apart(monkeypatch: pytest.MonkeyPatch) -> None:
    for error, reader_gone in ((BrokenPipeError(32, "Broken pipe"), True), (OSError(28, "No space left on device"), False)):
        monkeypatch.setattr(sys, "stdout", Broken(error))
        with pytest.raises(StandardOutputError) as raised, guarded_stdout():
            print("text")
        assert raised.value.reader_gone == reader_gone


def test_a_note_that_cannot_be_printed_is_lost_and_never_stands_among_the_results(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    for stream in (None, Broken(OSError(28, "No space left on device"))):
        monkeypatch.setattr(sys, "stderr", stream)
        Output(True).note("by the way")
    assert capsys.readouterr().out == ""


@pytest.mark.skipif(os.name != "posix", reason="a POSIX shell closes the stream")
def test_with_standard_error_closed_an_error_is_an_exit_code_and_nothing_more() -> None:
    closed = ["sh", "-c", 'exec "$@" 2>&-', "sh", *RUN]
    assert subprocess.run([*closed, "simulate", "atlantis-2023"], capture_output=True, check=False).stdout == b""
    assert subprocess.run([*closed, "simulate", "atlantis-2023"], capture_output=True, check=False).returncode == 2
    assert subprocess.run([*closed, "races"], capture_output=True, check=True).stdout.startswith(b"Races")


@pytest.mark.parametrize("as_json", [True, False])
def test_with_standard_error_closed_long_tasks_run_in_silence(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, as_json: bool
) -> None:
    monkeypatch.setattr(sys, "stderr", None)
    output = Output(as_json)
    with progress(output, "Counting") as report:
        report(1, 2)
    with steps(output, "Counting") as step:
        step("on")
    with brief(output, "Counting") as step:
        step("on")
    notice = CompileNotice()
    notice.begin()
    notice.end()
    assert capsys.readouterr().out == ""


def test_lines_for_people_go_through_one_function() -> None:
    """`print` would put them among the results where standard error is closed."""
    told = [path.name for path in SOURCE.rglob("*.py") if "file=sys.stderr" in path.read_text(encoding="utf-8")]
    assert told == []


MARKS: list[Callable[[str], bytes]] = [
    lambda text: text.encode(),
    lambda text: codecs.BOM_UTF8 + text.encode(),
    lambda text: text.encode("utf-16"),
    lambda text: codecs.BOM_UTF16_BE + text.encode("utf-16-be"),
]


@pytest.mark.parametrize("encode", MARKS)
def test_text_is_read_with_and_without_a_byte_order_mark(tmp_path: Path, encode: Callable[[str], bytes]) -> None:
    path = tmp_path / "text"
    path.write_bytes(encode("São Paulo\n"))
    assert read_text(path) == decode_text(encode("São Paulo\n")) == "São Paulo\n"


@pytest.mark.parametrize("encode", MARKS)
def test_season_files_results_and_trees_are_read_with_a_byte_order_mark(tmp_path: Path, encode: Callable[[str], bytes]) -> None:
    import numpy as np
    from report_study import evaluation

    from rsrl.strategists.tree import save_tree

    record = load_race("bahrain-2023")
    season, result, tree = (tmp_path / name for name in ("bahrain-2023.toml", "evaluation.json", "tree.json"))
    write_race(record, season)
    result.write_text(json.dumps(evaluation()))
    nothing = np.array([-1], np.int32)
    save_tree(
        Tree(
            nothing,
            np.zeros(1, np.float32),
            nothing,
            nothing,
            np.zeros(1, np.int8),
            np.ones((1, 4), np.int64),
            ("laps_left",),
            "a",
            "b",
            "c",
        ),
        tree,
    )
    for path in (season, result, tree):
        path.write_bytes(encode(path.read_text(encoding="utf-8")))
    assert read_race(season) == record
    assert read_result(result, Evaluation, "rsrl evaluate").race == "bahrain-2023"
    assert load_tree(tree).columns == ("laps_left",)


def literals(path: Path) -> Iterator[str]:
    """Texts of a module but for docstrings."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    told = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in told:
            yield node.value


def test_no_message_points_to_a_document_that_an_installation_lacks() -> None:
    assert [text for path in SOURCE.rglob("*.py") for text in literals(path) if "docs/" in text or ".md" in text.split()] == []


def test_races_are_listed_after_a_failure_as_before(capsys: pytest.CaptureFixture[str]) -> None:
    before = sys.stdout
    assert main(["races", "--fast"]) == 2
    assert sys.stdout is before
    assert main(["races"]) == 0
    assert "bahrain-2023" in capsys.readouterr().out
