"""Cells on Ray, on this machine or on a cluster: one task a cell, run again if its worker dies.

Models travel with their cells, so the machines need no shared folder; each needs the same RSRL installed.

Whoever reaches Ray's ports can run code as its user. So Ray started here listens on loopback alone, and every connection, here or to a
cluster, is made with a token (https://docs.ray.io/en/latest/ray-security/token-auth.html).
"""

import logging
import os
import secrets
import socket
import sys
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

from rsrl.errors import RsrlError
from rsrl.evaluation.study.cells import Cell, model_files
from rsrl.evaluation.study.workers import RETRIES, RunCell, worker_died

OLDEST_RAY: Final = (2, 52)
"""The first version with token authentication."""

LOOPBACK: Final = "127.0.0.1"

REACH_S: Final = 3.0
"""How long the head of a cluster may take to answer."""

STORE_BYTES: Final = 200 * 2**20
"""Shared memory of a Ray started here; results are small."""

HTTP2_HELLO: Final = b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n" + bytes(3) + b"\x04" + bytes(5)
"""First bytes of an HTTP/2 client (RFC 9113, 3.4): the preface and an empty SETTINGS frame. A server answers with its own SETTINGS."""

_QUIET: Final = {
    "RAY_USAGE_STATS_ENABLED": "0",
    "RAY_ACCEL_ENV_VAR_OVERRIDE_ON_ZERO": "0",  # as Ray 3 will treat GPUs: leaves them visible, and silences a warning
}

_SECURE: Final = {
    True: {"RAY_AUTH_MODE": "token", "RAY_ENABLE_WINDOWS_OR_OSX_CLUSTER": "0"},
    False: {"RAY_AUTH_MODE": "token", "RAY_ENABLE_WINDOWS_OR_OSX_CLUSTER": "1"},
}
"""Ray's settings, which it reads once, when it is imported: for a Ray of this machine alone (True), and to join a cluster.

The second name speaks of Windows and macOS, where 0 is the default; on any system 0 makes Ray take 127.0.0.1 as the node's address and
listen there only. `ray.init(_node_ip_address="127.0.0.1")` does not: Ray replaces loopback by the address of the network.
"""


def on_ray(cells: Sequence[Cell], address: str | None, workers: int | None, run: RunCell) -> Iterator[tuple[Cell, dict[str, Any]]]:
    """Cells with their results, as they are finished.

    Args:
        address: HOST:PORT of a cluster's head, "auto" for the one this machine is part of; None starts Ray here, on loopback.
        workers: cells at the same time; None for one a core.
        run: what runs a cell.

    Raises:
        RsrlError: Ray is not installed or too old, the cluster cannot be reached or there is no token for it, a cell raised one or killed
            its worker too often.
    """
    if address is not None:
        _check_token(address)
        if address != "auto":
            _knock(address)
    ray = _import_ray(local=address is None)
    _connect(ray, address, workers)
    try:
        yield from _tasks(ray, cells, workers, run)
    finally:
        ray.shutdown()


def _import_ray(*, local: bool) -> Any:
    """Ray, with token authentication on; `local`: to be started on this machine, for this machine alone."""
    secure = _SECURE[local]
    if sys.modules.get("ray") and any(os.environ.get(name) != value for name, value in secure.items()):
        settings = " ".join(f"{name}={value}" for name, value in secure.items())
        raise RsrlError(f"Ray was imported with other settings in this process; start a new one, or set {settings} before it is imported")
    for name, value in _QUIET.items():
        os.environ.setdefault(name, value)
    os.environ.update(secure)
    if local and not os.environ.get("RAY_AUTH_TOKEN"):
        os.environ["RAY_AUTH_TOKEN"] = secrets.token_hex(32)  # for this process and Ray's, which inherit it; never written to a file
    try:
        import ray
    except ImportError:
        raise RsrlError("the engine ray needs Ray, which is not installed; pip install 'rsrl[cluster]'") from None
    if tuple(int(part) for part in ray.__version__.split(".")[:2]) < OLDEST_RAY:
        raise RsrlError(f"Ray {ray.__version__} has no token authentication; pip install --upgrade 'rsrl[cluster]'")
    return ray


def _check_token(address: str) -> None:
    """Raise RsrlError where Ray has no token for a cluster: neither in the environment, nor in a file it names, nor in Ray's own."""
    if os.environ.get("RAY_AUTH_TOKEN"):
        return
    path = Path(os.environ.get("RAY_AUTH_TOKEN_PATH") or Path.home() / ".ray" / "auth_token")
    if not path.is_file():
        hint = "set RAY_AUTH_TOKEN to what `ray get-auth-token` says on its head"
        raise RsrlError(f"Ray cluster {address}: no token to join it with, nor a file {path}; {hint}")


def _connect(ray: Any, address: str | None, workers: int | None) -> None:
    quiet: dict[str, Any] = {"log_to_driver": False, "logging_level": logging.CRITICAL}
    if address is None:
        ray.init(address="local", num_cpus=workers, include_dashboard=False, object_store_memory=STORE_BYTES, **quiet)
        if (found := ray.util.get_node_ip_address()) != LOOPBACK:
            ray.shutdown()
            raise RsrlError(f"Ray {ray.__version__} listens on {found} and not on {LOOPBACK} alone; take the version of requirements.txt")
        return
    try:
        ray.init(address=address, **quiet)
    except (ConnectionError, RuntimeError, ValueError) as error:
        told = " ".join(str(error).split()) or type(error).__name__
        hint = "start it with RAY_AUTH_MODE=token, `ray start --head`, and set RAY_AUTH_TOKEN here to its token"
        raise RsrlError(f"Ray cluster {address}: cannot be joined ({told}); {hint}") from None


def _knock(address: str) -> None:
    """Raise RsrlError unless a server of Ray's protocol (gRPC, so HTTP/2) answers there; Ray itself would wait for minutes."""
    host, _, port = address.rpartition(":")
    if not host or not port.isdecimal() or int(port) > 65535 or "/" in host:
        raise RsrlError(f"address {address!r} does not parse; write HOST:PORT of the cluster's head, or auto")
    try:
        with socket.create_connection((host.strip("[]"), int(port)), timeout=REACH_S) as line:
            line.sendall(HTTP2_HELLO)
            spoken = line.recv(9)
    except OSError as error:
        told = error.strerror or str(error)
        raise RsrlError(f"Ray cluster {address}: nobody answers ({told}); start one with `ray start --head --port={port}`") from None
    if spoken[3:4] != b"\x04":
        raise RsrlError(f"Ray cluster {address}: what answers there is not Ray; start one with `ray start --head`")


def _tasks(ray: Any, cells: Sequence[Cell], workers: int | None, run: RunCell) -> Iterator[tuple[Cell, dict[str, Any]]]:
    task = ray.remote(num_cpus=1, max_retries=RETRIES)(_run_there)
    models = {cell.strategist: ray.put(model_files(cell.strategist)) for cell in cells if cell.model_hash}
    waiting = list(reversed(cells))
    running: dict[Any, Cell] = {}
    try:
        while waiting or running:
            while waiting and len(running) < (workers or len(cells)):
                cell = waiting.pop()
                running[task.remote(run, cell, models.get(cell.strategist))] = cell
            done, _ = ray.wait(list(running), num_returns=1)
            for reference in done:
                cell = running.pop(reference)
                yield cell, _result(ray, reference, cell)
    finally:
        for reference in running:
            ray.cancel(reference, force=True)


def _result(ray: Any, reference: Any, cell: Cell) -> dict[str, Any]:
    try:
        return dict(ray.get(reference))
    except ray.exceptions.RayTaskError as error:
        if isinstance(error.cause, RsrlError):
            raise error.cause from None
        raise
    except (ray.exceptions.WorkerCrashedError, ray.exceptions.NodeDiedError, ray.exceptions.OutOfMemoryError):
        raise worker_died(cell) from None


def _run_there(run: RunCell, cell: Cell, files: Mapping[str, bytes] | None) -> dict[str, Any]:
    """Run a cell on the machine of the task, its model unpacked into a temporary folder."""
    if files is None:
        return run(cell)
    with tempfile.TemporaryDirectory() as folder:
        for name, content in files.items():
            (Path(folder) / name).write_bytes(content)
        return run(replace(cell, strategist=folder))
