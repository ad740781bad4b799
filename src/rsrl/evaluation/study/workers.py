"""Cells in processes of this machine. If a worker dies, only its cell is lost, and run again."""

import signal
import traceback
from collections import Counter, deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from multiprocessing import connection, get_context
from typing import Any, Final

from rsrl.errors import RsrlError
from rsrl.evaluation.study.cells import Cell

RunCell = Callable[[Cell], dict[str, Any]]

RETRIES: Final = 3
"""How often a cell is run again after its worker died."""


def in_processes(cells: Sequence[Cell], workers: int, run: RunCell) -> Iterator[tuple[Cell, dict[str, Any]]]:
    """Cells with their results, as they are finished, from `workers` new processes.

    Raises:
        RsrlError: a cell raised one, or its worker died more than `RETRIES` times.
    """
    waiting, deaths = deque(cells), Counter[Cell]()
    idle = [_Worker(run) for _ in range(workers)]
    busy: dict[connection.Connection, _Worker] = {}
    try:
        while waiting or busy:
            while waiting and idle:
                worker = idle.pop()
                worker.give(waiting.popleft())
                busy[worker.line] = worker
            ready = connection.wait(list(busy))
            for line in [line for line in busy if line in ready]:
                worker = busy.pop(line)
                cell = worker.cell
                answer = worker.answer()
                if answer is None:
                    deaths[cell] += 1
                    if deaths[cell] > RETRIES:
                        raise worker_died(cell)
                    waiting.appendleft(cell)
                    idle.append(_Worker(run))
                else:
                    idle.append(worker)
                    yield cell, answer
    finally:
        for worker in (*idle, *busy.values()):
            worker.stop()


def worker_died(cell: Cell) -> RsrlError:
    """The error for a cell whose worker died every time."""
    return RsrlError(f"{cell.text}: its worker died {RETRIES + 1} times, out of memory perhaps; run again with fewer --workers")


class _Worker:
    """A process and the pipe to it."""

    cell: Cell

    def __init__(self, run: RunCell) -> None:
        context = get_context("spawn")
        self.line, far_end = context.Pipe()
        self._process = context.Process(target=_serve, args=(far_end, run), daemon=True)
        self._process.start()
        far_end.close()  # else this process would hold the pipe open, and a worker's death would go unnoticed

    def give(self, cell: Cell) -> None:
        self.cell = cell
        with suppress(OSError):  # the worker has died already: `answer` handles it
            self.line.send(cell)

    def answer(self) -> dict[str, Any] | None:
        """The result, None if the worker died; raises RsrlError or RuntimeError if the cell failed."""
        try:
            how, content = self.line.recv()
        except (EOFError, OSError):
            self.stop()
            return None
        if how == "refused":
            raise RsrlError(content)
        if how == "failed":
            raise RuntimeError(f"{self.cell.text} failed in its worker:\n{content}")
        return dict(content)

    def stop(self) -> None:
        self._process.kill()
        self._process.join()
        self.line.close()


def _serve(line: connection.Connection, run: RunCell) -> None:
    """The worker process: run cells until the pipe closes, as it does when the parent dies."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent handles Ctrl-C
    while True:
        try:
            cell = line.recv()
        except (EOFError, OSError):
            return
        line.send(_tried(cell, run))


def _tried(cell: Cell, run: RunCell) -> tuple[str, Any]:
    try:
        return "done", run(cell)
    except RsrlError as error:
        return "refused", str(error)
    except Exception:
        return "failed", traceback.format_exc()
