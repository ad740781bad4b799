"""Running cells: resumed, side by side, on Ray and who can reach it, and with workers that are killed while they run one."""

import os
import signal
import socket
import sys
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import replace
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from rsrl.errors import RsrlError
from rsrl.evaluation.study import Cell, Store, make_cell, run_cell, run_cells
from rsrl.evaluation.study.cluster import _import_ray, _result

LOOPBACK = {"0100007F", "0000000000000000FFFF00000100007F", "00000000000000000000000001000000"}
"""127.0.0.1, the same as an IPv6 address, and ::1, as /proc/net has them."""

CELLS = [make_cell(name, "bahrain-2023", None, seed=7, races=4) for name in ("fixed", "heuristic", "imitation", "bahrain-2023")]


def told(cell: Cell) -> dict[str, Any]:
    """In place of a race."""
    return {"is": cell.race_hash, "strategist": len(cell.strategist), "timing": {"process": os.getpid()}}


def fatal(marker: Path, times: int, cell: Cell) -> dict[str, Any]:
    """Kills its own process the first `times` times that the heuristic is called; `marker` counts them."""
    if cell.driver == "HAM" and cell.first_race == 1:
        done = len(marker.read_text()) if marker.exists() else 0
        if done < times:
            marker.write_text("x" * (done + 1))
            os.kill(os.getpid(), signal.SIGKILL)
    return told(cell)


def refusing(cell: Cell) -> dict[str, Any]:
    raise RsrlError("this cell\ncannot be run")


def failing(cell: Cell) -> dict[str, Any]:
    raise ZeroDivisionError("a fault of our own")


def many() -> list[Cell]:
    return [replace(CELLS[1], first_race=i) for i in range(5)]


def untimed(results: list[dict[str, Any]]) -> list[dict[str, Any]]:
    return [{name: value for name, value in result.items() if name != "timing"} for result in results]


@pytest.fixture
def store(tmp_path: Path) -> Store:
    return Store(tmp_path / "study", {})


@pytest.fixture(scope="module")
def in_process(tmp_path_factory: pytest.TempPathFactory) -> list[dict[str, Any]]:
    return untimed(run_cells(CELLS, Store(tmp_path_factory.mktemp("here"), {}), workers=1))


@pytest.fixture
def importable(monkeypatch: pytest.MonkeyPatch) -> None:
    """Lets the workers of Ray, which are begun anew, import this module."""
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(Path(__file__).parent), *filter(None, sys.path)]))


@pytest.fixture
def token(monkeypatch: pytest.MonkeyPatch) -> None:
    """A token to join a cluster with."""
    monkeypatch.setenv("RAY_AUTH_TOKEN", "0" * 64)


def local_ray() -> Any:
    """Ray as RSRL imports it for this machine; importing it otherwise would keep other tests of this process from starting it."""
    if find_spec("ray") is None:
        pytest.skip("Ray is not installed")
    return _import_ray(local=True)


def descendants(process: int) -> Iterator[int]:
    """A process and all that it started."""
    yield process
    for task in Path(f"/proc/{process}/task").glob("*/children"):
        for child in task.read_text().split():
            yield from descendants(int(child))


def listening(process: int) -> set[str]:
    """Local addresses, as in /proc/net/tcp, at which a process and all that it started accept connections."""
    sockets = set()
    for one in descendants(process):
        for file in Path(f"/proc/{one}/fd").glob("*"):
            with suppress(OSError):  # closed in the meantime
                sockets.add(str(file.readlink()))
    found = set()
    for table in ("/proc/net/tcp", "/proc/net/tcp6"):
        for line in Path(table).read_text().splitlines()[1:]:
            _, local, _, state, *rest = line.split()
            if state == "0A" and f"socket:[{rest[5]}]" in sockets:
                found.add(local.partition(":")[0])
    return found


def test_other_processes_give_the_same_bits(store: Store, in_process: list[dict[str, Any]]) -> None:
    steps: list[tuple[int, int]] = []
    results = run_cells(CELLS, store, workers=2, progress=lambda done, total: steps.append((done, total)))
    assert untimed(results) == in_process
    assert steps == [(i, 4) for i in range(5)]


def test_a_study_that_was_cut_short_goes_on_where_it_was(store: Store) -> None:
    calls: list[Cell] = []

    def run(cell: Cell) -> dict[str, Any]:
        if len(calls) == 3:
            raise KeyboardInterrupt
        calls.append(cell)
        return told(cell)

    with pytest.raises(KeyboardInterrupt):
        run_cells(many(), store, workers=1, run=run)
    steps: list[tuple[int, int]] = []
    calls.clear()
    results = run_cells(many(), store, workers=1, run=run, progress=lambda done, total: steps.append((done, total)))
    assert len(results) == 5
    assert calls == many()[3:]
    assert steps == [(3, 5), (4, 5), (5, 5)]


def test_a_cell_asked_for_twice_is_run_once(store: Store) -> None:
    steps: list[tuple[int, int]] = []
    results = run_cells(
        [CELLS[0], CELLS[1], CELLS[0]], store, workers=1, run=told, progress=lambda done, total: steps.append((done, total))
    )
    assert steps == [(0, 2), (1, 2), (2, 2)]
    assert results[0] == results[2] != results[1]


def test_a_killed_worker_costs_its_cell_only(store: Store, tmp_path: Path) -> None:
    results = run_cells(many(), store, workers=2, run=partial(fatal, tmp_path / "marker", 1))
    assert (tmp_path / "marker").read_text() == "x"
    assert untimed(results) == untimed([told(cell) for cell in many()])
    assert os.getpid() not in {result["timing"]["process"] for result in results}


def test_a_cell_that_kills_every_worker_is_named_and_the_rest_is_kept(
    store: Store, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("rsrl.evaluation.study.workers.RETRIES", 1)
    with pytest.raises(RsrlError, match="heuristic on bahrain-2023, HAM: its worker died 2 times"):
        run_cells(many()[:2], store, workers=2, run=partial(fatal, tmp_path / "marker", 9))
    assert store.get(many()[0]) is not None


def test_what_goes_wrong_in_a_worker_is_told(store: Store) -> None:
    with pytest.raises(RsrlError, match="this cell\ncannot be run"):
        run_cells(CELLS[:2], store, workers=2, run=refusing)
    with pytest.raises(RuntimeError, match=r"on bahrain-2023, HAM failed in its worker:\n(.*\n)*ZeroDivisionError: a fault of our own"):
        run_cells(CELLS[:2], store, workers=2, run=failing)


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:os.fork.. was called:RuntimeWarning")  # by Ray, where another test of the process has used JAX
@pytest.mark.usefixtures("importable")
def test_ray_gives_the_same_bits_and_a_killed_worker_costs_its_cell_only(tmp_path: Path, in_process: list[dict[str, Any]]) -> None:
    local_ray()
    addresses: set[str] = set()

    def run(cell: Cell) -> dict[str, Any]:
        fatal(tmp_path / "marker", 1, cell)
        return run_cell(cell)

    def look(done: int, total: int) -> None:
        if done:  # Ray and its workers run
            addresses.update(listening(os.getpid()))

    cells = [*CELLS, replace(CELLS[1], first_race=1)]
    results = untimed(run_cells(cells, Store(tmp_path / "ray", {}), engine="ray", workers=2, run=run, progress=look))
    assert len(os.environ["RAY_AUTH_TOKEN"]) >= 32
    if sys.platform == "linux":
        assert addresses
        assert addresses <= LOOPBACK, "Ray accepts connections from other machines"
    assert (tmp_path / "marker").read_text() == "x"
    assert results[:4] == in_process
    assert results[4] == untimed([run_cell(cells[4])])[0]


def test_what_goes_wrong_on_ray_is_told() -> None:
    exceptions = local_ray().exceptions

    def result(error: BaseException) -> dict[str, Any]:
        def get(reference: object) -> None:
            raise error

        return _result(SimpleNamespace(get=get, exceptions=exceptions), None, CELLS[0])

    with pytest.raises(RsrlError, match=r"^this cell cannot be run$"):
        result(exceptions.RayTaskError("f", "its traceback", RsrlError("this cell cannot be run")))
    with pytest.raises(exceptions.RayTaskError, match="its traceback"):
        result(exceptions.RayTaskError("f", "its traceback", ZeroDivisionError()))
    with pytest.raises(RsrlError, match="fixed on bahrain-2023, HAM: its worker died 4 times"):
        result(exceptions.WorkerCrashedError())


@pytest.mark.usefixtures("token")
def test_a_cluster_that_is_not_there_is_told_at_once(store: Store) -> None:
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        address = f"127.0.0.1:{free.getsockname()[1]}"
    with pytest.raises(RsrlError, match=rf"Ray cluster {address}: nobody answers \(Connection refused\); start one with `ray start"):
        run_cells(CELLS, store, engine="ray", address=address)
    with pytest.raises(RsrlError, match="address 'here' does not parse; write HOST:PORT"):
        run_cells(CELLS, store, engine="ray", address="here")


@pytest.mark.usefixtures("token")
def test_who_answers_but_is_not_ray_is_told(store: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("rsrl.evaluation.study.cluster.REACH_S", 0.2)
    with socket.create_server(("127.0.0.1", 0)) as silent:
        address = f"127.0.0.1:{silent.getsockname()[1]}"
        with pytest.raises(RsrlError, match=f"Ray cluster {address}: nobody answers"):
            run_cells(CELLS, store, engine="ray", address=address)


def test_without_ray_it_is_told_what_to_install(store: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "ray", None)
    with pytest.raises(RsrlError, match=r"needs Ray, which is not installed; pip install 'rsrl\[cluster\]'"):
        run_cells(CELLS, store, engine="ray")


def test_a_cluster_is_not_joined_without_a_token(store: Store, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.delenv("RAY_AUTH_TOKEN", raising=False)
    monkeypatch.setenv("RAY_AUTH_TOKEN_PATH", str(tmp_path / "token"))
    for address in ("10.0.0.4:6379", "auto"):
        with pytest.raises(RsrlError, match=rf"Ray cluster {address}: no token to join it with, nor a file .*token; set RAY_AUTH_TOKEN"):
            run_cells(CELLS, store, engine="ray", address=address)
    (tmp_path / "token").write_text("0" * 64)
    with pytest.raises(RsrlError, match="address 'here' does not parse"):
        run_cells(CELLS, store, engine="ray", address="here")


def with_fake_ray(monkeypatch: pytest.MonkeyPatch, **settings: str) -> SimpleNamespace:
    """A stand-in for Ray that has been imported under these settings; they are as before after the test."""
    ray = SimpleNamespace(__version__="2.52.0", calls=[], util=SimpleNamespace(get_node_ip_address=lambda: "192.0.2.2"))
    ray.init = lambda **options: ray.calls.append(options)
    ray.shutdown = lambda: ray.calls.append("shutdown")
    for name in ("RAY_AUTH_MODE", "RAY_AUTH_TOKEN", "RAY_ENABLE_WINDOWS_OR_OSX_CLUSTER"):
        monkeypatch.setenv(name, settings.get(name, ""))
    monkeypatch.setitem(sys.modules, "ray", ray)
    return ray


LOCAL = {"RAY_AUTH_MODE": "token", "RAY_ENABLE_WINDOWS_OR_OSX_CLUSTER": "0"}


def test_ray_that_others_could_reach_is_not_used(store: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    ray = with_fake_ray(monkeypatch, **LOCAL)
    with pytest.raises(RsrlError, match=r"^Ray 2\.52\.0 listens on 192\.0\.2\.2 and not on 127\.0\.0\.1 alone"):
        run_cells(CELLS, store, engine="ray", run=told)
    started, *ended = ray.calls
    assert (started["address"], started["include_dashboard"]) == ("local", False)
    assert ended == ["shutdown"]
    assert len(os.environ["RAY_AUTH_TOKEN"]) >= 32


@pytest.mark.parametrize("other", [{"RAY_AUTH_MODE": "disabled"}, {"RAY_ENABLE_WINDOWS_OR_OSX_CLUSTER": "1"}])
def test_ray_imported_with_other_settings_is_not_used(store: Store, monkeypatch: pytest.MonkeyPatch, other: dict[str, str]) -> None:
    ray = with_fake_ray(monkeypatch, **(LOCAL | other))
    with pytest.raises(RsrlError, match="imported with other settings in this process; start a new one, or set RAY_AUTH_MODE"):
        run_cells(CELLS, store, engine="ray", run=told)
    assert ray.calls == []


def test_ray_without_token_authentication_is_not_used(store: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    ray = with_fake_ray(monkeypatch, **LOCAL)
    ray.__version__ = "2.40.0"
    with pytest.raises(RsrlError, match=r"^Ray 2\.40\.0 has no token authentication; pip install --upgrade"):
        run_cells(CELLS, store, engine="ray", run=told)
    assert ray.calls == []


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"engine": "spark"}, "unknown engine 'spark'; there are local, ray"),
        ({"address": "a:1"}, "only the engine ray has one"),
        ({"workers": 0}, "workers is 0"),
    ],
)
def test_an_engine_that_cannot_be_is_refused(store: Store, options: dict[str, Any], message: str) -> None:
    with pytest.raises(RsrlError, match=message):
        run_cells(CELLS, store, **options)
