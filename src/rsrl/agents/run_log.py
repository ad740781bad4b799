"""The learning curve of a run: in memory, as JSON lines in the run folder, and in TensorBoard where it is installed."""

import importlib
import importlib.util
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from rsrl.agents.checkpoint import replace_file
from rsrl.agents.interface import Metrics
from rsrl.errors import RsrlError
from rsrl.text_files import read_text

LOG_FILE: Final = "log.jsonl"
CURVE_POINTS: Final = 200
_PENDING: Final = "log/pending"
_TENSORBOARD_MODULES: Final = ("tensorboardX", "torch.utils.tensorboard")


class RunLog:
    """Averages a learner's metrics over iterations and writes them as points of its learning curve.

    Attributes:
        curve: the points so far, each with `iteration`, `steps`, `seconds` and the mean metrics since the point before.
    """

    def __init__(self, folder: Path | None, curve: list[dict[str, float]], iteration: int, pending: Sequence[Metrics] = ()) -> None:
        """A resumed run gives its `curve`, `iteration` and `pending` (`take_pending`), a new one [], 0 and nothing.

        Points of an existing log after `iteration` are dropped.
        """
        self._pending = list(pending)
        self._file: Any = None
        self._board: Any = None
        self.curve = [point for point in curve if point["iteration"] <= iteration]
        if folder is not None:
            path = folder / LOG_FILE
            if iteration:
                self.curve = _read_log(path, iteration) or self.curve
            try:
                replace_file(path, "".join(json.dumps(point) + "\n" for point in self.curve).encode())
                self._file = path.open("a", encoding="utf-8", buffering=1)
            except OSError as error:
                raise RsrlError(f"{path}: cannot be written ({error.strerror}); choose another folder with --out") from None
            self._board = _tensorboard(folder)

    def state(self) -> dict[str, NDArray[np.uint8]]:
        """Metrics of the iterations since the last point, as an array of the training state."""
        return {_PENDING: np.frombuffer(json.dumps(self._pending).encode(), np.uint8)}

    @staticmethod
    def take_pending(state: dict[str, NDArray[Any]]) -> list[Metrics]:
        """Take what `state()` gave out of a training state; raises RsrlError where it is missing or broken."""
        try:
            pending: list[Metrics] = json.loads(state.pop(_PENDING).tobytes())
        except (KeyError, ValueError):
            raise RsrlError(f"training state lacks {_PENDING}, or it is broken; start training anew") from None
        return pending

    def add(self, metrics: Metrics) -> None:
        """Add the metrics of one iteration to the next point."""
        self._pending.append(metrics)

    def point(self, iteration: int, steps: int, seconds: float) -> Metrics:
        """Write the next point and return its mean metrics."""
        means = {name: sum(m[name] for m in self._pending) / len(self._pending) for name in self._pending[0]}
        self._pending.clear()
        self.curve.append({"iteration": iteration, "steps": steps, "seconds": round(seconds, 3)} | means)
        if self._file is not None:
            self._file.write(json.dumps(self.curve[-1]) + "\n")
        if self._board is not None:
            for name, value in means.items():
                self._board.add_scalar(name, value, steps)
        return means

    def close(self) -> None:
        """Close the files."""
        for sink in (self._file, self._board):
            if sink is not None:
                sink.close()


def thinned(curve: list[dict[str, float]]) -> list[dict[str, float]]:
    """At most `CURVE_POINTS` points of a curve, evenly spaced, the last one included."""
    if len(curve) <= CURVE_POINTS:
        return curve
    return [curve[round((k + 1) * len(curve) / CURVE_POINTS) - 1] for k in range(CURVE_POINTS)]


def _read_log(path: Path, iteration: int) -> list[dict[str, float]]:
    """Points of an existing log up to an iteration; a half-written last line is ignored."""
    points: list[dict[str, float]] = []
    if not path.is_file():
        return points
    for line in read_text(path).splitlines():
        try:
            point = json.loads(line)
        except ValueError:
            break
        if point["iteration"] > iteration:
            break
        points.append(point)
    return points


def _tensorboard(folder: Path) -> Any:
    """A TensorBoard writer from the library that is installed, or None."""
    for name in _TENSORBOARD_MODULES:
        if importlib.util.find_spec(name.split(".")[0]) is not None:
            try:
                return importlib.import_module(name).SummaryWriter(str(folder))
            except ImportError:  # torch is installed, but not the tensorboard package it needs
                continue
    return None
