"""Compiled code is kept where something can be written, and nothing that happens to it ends a run. One small kernel stands for all."""

import os
import re
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import gymnasium
import pytest

import rsrl
from rsrl import compile_watch
from rsrl.cache_folder import cache_folder
from rsrl.cli.progress import CompileNotice
from rsrl.strategists.tree import tree_folders

KERNEL = """
import sys
from rsrl.cli.progress import CompileNotice
from rsrl.compile_watch import watch
watch(CompileNotice())
if "full" in sys.argv:
    import resource
    resource.setrlimit(resource.RLIMIT_FSIZE, (64, 64))
from rsrl.compiled import kernel

@kernel()
def twice(x):
    return 2 * x

print(twice(21), sum(twice.stats.cache_hits.values()))
"""
COMPILED, LOADED = "42 0\n", "42 1\n"
NOTICE = "rsrl: compiling the simulator (once, a minute or more) ...\n"


def run(folder: Path, *arguments: str, **environment: str) -> tuple[str, str]:
    """Standard output and standard error of a program with one kernel."""
    program = folder / "program.py"
    if not program.exists():  # Numba looks at the time of a change
        program.write_text(KERNEL)
    (folder / "tmp").mkdir(exist_ok=True)
    plain = {name: value for name, value in os.environ.items() if name not in ("XDG_CACHE_HOME", "NUMBA_CACHE_DIR")}
    done = subprocess.run(
        [sys.executable, str(program), *arguments],
        capture_output=True,
        text=True,
        check=True,
        cwd=folder,
        env=plain | {"HOME": str(folder), "TMPDIR": str(folder / "tmp")} | environment,
    )
    return done.stdout, done.stderr


@pytest.mark.parametrize(
    "nowhere", [{"HOME": "/dev/null"}, {"XDG_CACHE_HOME": "/dev/null/cache"}, {"NUMBA_CACHE_DIR": "/dev/null", "HOME": "/dev/null"}]
)
def test_without_a_writable_home_the_cache_is_a_temporary_folder_and_one_line_says_so(tmp_path: Path, nowhere: dict[str, str]) -> None:
    out, err = run(tmp_path, **nowhere)
    assert out == COMPILED
    warning, rest = err.split("\n", 1)
    assert warning.startswith("rsrl: cannot write to /dev/null")
    assert str(tmp_path / "tmp") in warning
    assert rest == NOTICE
    assert run(tmp_path, **nowhere) == (LOADED, warning + "\n")


@pytest.mark.parametrize("named", ["", "caches"])
def test_an_empty_or_relative_cache_home_means_unset(tmp_path: Path, named: str) -> None:
    assert run(tmp_path, XDG_CACHE_HOME=named) == (COMPILED, NOTICE)
    assert list((tmp_path / ".cache" / "rsrl").rglob("*.nbi"))
    assert {path.name for path in tmp_path.iterdir()} == {"program.py", "tmp", ".cache"}


def test_what_is_cached_is_not_compiled_again_and_nothing_is_said(tmp_path: Path) -> None:
    assert run(tmp_path) == (COMPILED, NOTICE)
    assert run(tmp_path) == (LOADED, "")


@pytest.mark.skipif(os.name != "posix", reason="a POSIX shell closes the stream")
@pytest.mark.parametrize("folder", ["", "/dev/null/cache"])
def test_with_standard_error_closed_no_notice_stands_among_the_results(tmp_path: Path, folder: str) -> None:
    program = tmp_path / "program.py"
    program.write_text(KERNEL)
    command = ["sh", "-c", 'exec "$@" 2>&-', "sh", sys.executable, str(program)]
    environment = os.environ | {"XDG_CACHE_HOME": folder or str(tmp_path), "TMPDIR": str(tmp_path)}
    assert subprocess.run(command, capture_output=True, text=True, check=True, env=environment).stdout == COMPILED


CALLS: list[Callable[[], object]] = [
    lambda: rsrl.simulate("atlantis"),
    lambda: rsrl.plan("atlantis"),
    lambda: rsrl.evaluate("atlantis"),
    lambda: rsrl.explain("atlantis"),
    lambda: rsrl.load_policy("atlantis"),
    lambda: rsrl.make_env("atlantis"),
    lambda: gymnasium.make("rsrl/Race-v0", race="atlantis"),
    lambda: gymnasium.make_vec("rsrl/Race-v0", num_envs=2, race="atlantis"),
]
"""Every function that may be the first to compile; with a race that there is not, since what is tested comes before."""


@pytest.mark.parametrize("call", CALLS)
def test_a_notebook_is_told_once_that_kernels_are_compiled(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, call: Callable[[], object]
) -> None:
    monkeypatch.setattr(compile_watch, "_watchers", [])
    for _ in range(2):
        with pytest.raises(rsrl.RsrlError, match="atlantis"):
            call()
    assert capsys.readouterr().err == "", "nothing is said before something is compiled"
    for _ in range(2):
        compile_watch.compilation_begins()
        compile_watch.compilation_ends()
    assert capsys.readouterr().err == NOTICE


def test_long_compiling_is_told_of_again(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(compile_watch, "REMIND_S", 1.5)
    line = compile_watch.Line()
    for _ in range(4):  # four kernels, none of which takes so long
        line.begin()
        time.sleep(1.1)
        line.end()
    first, *more = capsys.readouterr().err.splitlines(keepends=True)
    assert first == NOTICE
    assert 1 <= len(more) <= 2
    assert re.fullmatch(r"rsrl: still compiling, [2-4] s so far \.\.\.\n", more[0])
    time.sleep(2.0)
    assert capsys.readouterr().err == "", "what is not compiling is not told of"


def test_a_command_says_it_in_its_own_way(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(compile_watch, "_watchers", [])
    compile_watch.watch(CompileNotice())
    compile_watch.announce()
    compile_watch.compilation_begins()
    compile_watch.compilation_ends()
    assert capsys.readouterr().err == NOTICE


@pytest.mark.slow
def test_the_first_simulation_of_a_notebook_says_so_at_once(tmp_path: Path) -> None:
    program = "import rsrl; rsrl.simulate('bahrain-2023', races=1)"
    environment = os.environ | {"XDG_CACHE_HOME": str(tmp_path)}
    with subprocess.Popen([sys.executable, "-c", program], stderr=subprocess.PIPE, text=True, env=environment) as process:
        assert process.stderr is not None
        assert process.stderr.readline() == NOTICE
        process.kill()


def test_damaged_files_are_removed_and_compiled_again(tmp_path: Path) -> None:
    run(tmp_path)
    for suffix, damage in ((".nbi", b""), (".nbi", b"no pickle at all"), (".nbc", bytes(4096)), (".nbc", None)):
        (path,) = (tmp_path / ".cache").rglob(f"*twice*{suffix}")
        path.write_bytes(path.read_bytes()[: path.stat().st_size // 2] if damage is None else damage)
        out, err = run(tmp_path)
        assert out == COMPILED
        assert err.splitlines()[0].startswith("rsrl: removed damaged files of compiled code from ")
        assert err.count("\n") == 2
    assert run(tmp_path) == (LOADED, "")


def test_a_full_disk_costs_the_cache_and_nothing_else(tmp_path: Path) -> None:
    out, err = run(tmp_path, "full")
    assert out == COMPILED
    assert [line[:32] for line in err.splitlines()] == [NOTICE[:32], "rsrl: cannot keep compiled code "]
    assert run(tmp_path) == (COMPILED, NOTICE)


def test_a_temporary_folder_that_others_may_write_to_is_not_trusted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", "/dev/null/cache")
    monkeypatch.setenv("MPLCONFIGDIR", str(tmp_path))  # and so given back after the test
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    theirs = tmp_path / f"rsrl-{os.getuid()}"
    theirs.mkdir()
    theirs.chmod(0o777)
    ours = cache_folder()
    assert ours is not None
    assert ours.is_dir()
    assert theirs not in ours.parents
    assert ours.parent.stat().st_mode & 0o777 == 0o700


def test_where_nothing_can_be_written_nothing_is_kept(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", "/dev/null/cache")
    monkeypatch.setattr(tempfile, "tempdir", "/dev/null")
    assert cache_folder() is None
    assert capsys.readouterr().err.count("\n") == 1


def test_fitted_trees_are_kept_in_the_same_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    own = tmp_path / "policy"
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    assert tree_folders(own, "abc") == (own, tmp_path / "cache" / "rsrl" / "trees" / "abc")
    monkeypatch.setenv("XDG_CACHE_HOME", "/dev/null/cache")
    monkeypatch.setattr(tempfile, "tempdir", "/dev/null")
    assert tree_folders(own, "abc") == (own,)


def test_at_a_terminal_the_seconds_run_and_then_vanish(tmp_path: Path) -> None:
    program = tmp_path / "program.py"
    program.write_text(KERNEL)
    terminal, end = os.openpty()
    environment = os.environ | {"XDG_CACHE_HOME": str(tmp_path), "TERM": "xterm", "COLUMNS": "100"}
    with subprocess.Popen([sys.executable, str(program)], stdout=subprocess.DEVNULL, stderr=end, env=environment) as process:
        os.close(end)
        shown = b""
        while True:
            try:
                shown += os.read(terminal, 4096)
            except OSError:  # the other end is closed
                break
        assert process.wait() == 0
    os.close(terminal)
    assert re.search(rb"compiling the simulator \(once, a minute or more\) \.\.\. \S*0:00:00", shown)
    hidden, shown_again = shown.rindex(b"\x1b[?25l"), shown.rindex(b"\x1b[?25h")
    assert hidden < shown_again, "the cursor is given back"
    assert shown.endswith(b"\x1b[2K"), "the line is wiped"
