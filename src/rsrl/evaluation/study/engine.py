"""Running the cells of a study: what is on disk is taken from there, the rest is run here or on a cluster."""

from collections.abc import Callable, Iterator, Sequence
from typing import Any, Final

from rsrl.errors import RsrlError
from rsrl.evaluation.study.cells import Cell, run_cell
from rsrl.evaluation.study.cluster import on_ray
from rsrl.evaluation.study.store import Store
from rsrl.evaluation.study.workers import RunCell, in_processes
from rsrl.simulator import available_cores

ENGINES: Final = ("local", "ray")

Progress = Callable[[int, int], None]
"""Called with (cells done, cells in all)."""


def run_cells(
    cells: Sequence[Cell],
    store: Store,
    *,
    engine: str = "local",
    address: str | None = None,
    workers: int | None = None,
    progress: Progress | None = None,
    run: RunCell = run_cell,
) -> list[dict[str, Any]]:
    """Results of cells, in their order; each is stored as soon as it is finished, so an interrupted run loses only the cells in progress.

    Args:
        engine: "local", processes of this machine, or "ray".
        address: of a Ray cluster, HOST:PORT of its head or "auto"; None starts Ray on this machine.
        workers: cells run side by side; None for one a core, of the cluster where there is one. 1 runs here, in this process.
        run: what runs a cell.

    Raises:
        RsrlError: unknown engine, a cluster that cannot be reached, a cell that cannot be run.
    """
    check_engine(engine, address, workers)
    distinct = list(dict.fromkeys(cells))
    results = {cell: result for cell in distinct if (result := store.get(cell)) is not None}
    lacking = [cell for cell in distinct if cell not in results]
    if progress:
        progress(len(results), len(distinct))
    for cell, result in _finished(lacking, engine, address, workers, run):
        store.put(cell, result)
        results[cell] = result
        if progress:
            progress(len(results), len(distinct))
    return [results[cell] for cell in cells]


def check_engine(engine: str, address: str | None, workers: int | None) -> None:
    """Raise RsrlError for an engine there is not, or an address where none is asked for."""
    if engine not in ENGINES:
        raise RsrlError(f"unknown engine {engine!r}; there are {', '.join(ENGINES)}")
    if address is not None and engine != "ray":
        raise RsrlError(f"address {address}: only the engine ray has one; add --engine ray")
    if workers is not None and workers < 1:
        raise RsrlError(f"workers is {workers}; ask for one at least")


def _finished(
    cells: list[Cell], engine: str, address: str | None, workers: int | None, run: RunCell
) -> Iterator[tuple[Cell, dict[str, Any]]]:
    if not cells:
        return
    if engine == "ray":
        yield from on_ray(cells, address, workers, run)
    elif (count := min(workers or available_cores(), len(cells))) == 1:
        for cell in cells:
            yield cell, run(cell)
    else:
        yield from in_processes(cells, count, run)
