"""Cells on a Ray cluster, or on Ray started on this machine: one task a cell, tried again where its worker dies.

Models travel with their cells, so that the machines share no folder; each needs the same RSRL installed.
"""

import logging
import os
import socket
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

from rsrl.errors import RsrlError
from rsrl.evaluation.study.cells import Cell, model_files
from rsrl.evaluation.study.workers import RETRIES, RunCell, worker_died

REACH_S: Final = 3.0
"""How long the head of a cluster may take to answer."""

STORE_BYTES: Final = 200 * 2**20
"""Shared memory of a Ray started here; results are small."""

HTTP2_HELLO: Final = b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n" + bytes(3) + b"\x04" + bytes(5)
"""How an HTTP/2 client begins (RFC 9113, 3.4): the preface and an empty SETTINGS frame. The server answers with SETTINGS of its own."""

_QUIET: Final = {
    "RAY_USAGE_STATS_ENABLED": "0",
    "RAY_ACCEL_ENV_VAR_OVERRIDE_ON_ZERO": "0",  # how Ray 3 will hide GPUs: leave them as they are, and say nothing of it
}


def on_ray(cells: Sequence[Cell], address: str | None, workers: int | None, run: RunCell) -> Iterator[tuple[Cell, dict[str, Any]]]:
    """Cells with their results, as they are finished.

    Args:
        address: HOST:PORT of a cluster's head, "auto" for the one this machine is part of; None starts Ray here.
        workers: cells at the same time; None for one a core.

    Raises:
        RsrlError: Ray is not installed, the cluster cannot be reached, a cell raised one or killed its worker too often.
    """
    ray = _import_ray()
    _connect(ray, address, workers)
    try:
        yield from _tasks(ray, cells, workers, run)
    finally:
        ray.shutdown()


def _import_ray() -> Any:
    for name, value in _QUIET.items():
        os.environ.setdefault(name, value)
    try:
        import ray
    except ImportError:
        raise RsrlError("the engine ray needs Ray, which is not installed; pip install 'rsrl[cluster]'") from None
    return ray


def _connect(ray: Any, address: str | None, workers: int | None) -> None:
    quiet: dict[str, Any] = {"log_to_driver": False, "logging_level": logging.CRITICAL}
    if address is None:
        ray.init(address="local", num_cpus=workers, include_dashboard=False, object_store_memory=STORE_BYTES, **quiet)
        return
    if address != "auto":
        _knock(address)
    try:
        ray.init(address=address, **quiet)
    except (ConnectionError, RuntimeError, ValueError) as error:
        told = " ".join(str(error).split()) or type(error).__name__
        hint = "start one with `ray start --head`, and set RAY_AUTH_MODE and its token here as there"
        raise RsrlError(f"Ray cluster {address}: cannot be joined ({told}); {hint}") from None


def _knock(address: str) -> None:
    """See that a server of Ray's protocol (gRPC, so HTTP/2) answers there, since Ray itself waits for minutes."""
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
    """Run a cell on whatever machine this is, its model laid out in a folder of its own."""
    if files is None:
        return run(cell)
    with tempfile.TemporaryDirectory() as folder:
        for name, content in files.items():
            (Path(folder) / name).write_bytes(content)
        return run(replace(cell, strategist=folder))
