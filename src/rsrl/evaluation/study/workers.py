"""Cells in processes of this machine. A worker that dies costs its own cell, which is run again, and nothing else."""

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
"""How often a cell is tried again after its worker died."""


def in_processes(cells: Sequence[Cell], workers: int, run: RunCell) -> Iterator[tuple[Cell, dict[str, Any]]]:
    """Cells with their results, as they are finished, by `workers` processes begun anew.

    Raises:
        RsrlError: a cell raised one, or its worker died `RETRIES` times more than once.
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
    """What is said of a cell that kills every worker."""
    return RsrlError(f"{cell.text}: its worker died {RETRIES + 1} times, out of memory perhaps; run again with fewer --workers")


class _Worker:
    """A process and the line to it."""

    cell: Cell

    def __init__(self, run: RunCell) -> None:
        context = get_context("spawn")
        self.line, far_end = context.Pipe()
        self._process = context.Process(target=_serve, args=(far_end, run), daemon=True)
        self._process.start()
        far_end.close()  # so that the line is seen to close when the worker dies

    def give(self, cell: Cell) -> None:
        self.cell = cell
        with suppress(OSError):  # died already: `answer` finds out
            self.line.send(cell)

    def answer(self) -> dict[str, Any] | None:
        """The result, None where the worker died; raises what went wrong in the cell."""
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
    """A worker's life: cells until the line closes, which it does too when the parent dies."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the parent's to answer
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
