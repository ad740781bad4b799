"""Runs a learner until its budget is used up: progress, log, checkpoints, a clean stop on Ctrl-C, resuming."""

import signal
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from threadpoolctl import threadpool_limits

from rsrl.agents.checkpoint import (
    ModelMetadata,
    claim_folder,
    clear_leftovers,
    clear_run,
    load_agent,
    load_training_state,
    save_run,
)
from rsrl.agents.config import LearnerConfig, config_from_dict, config_to_dict
from rsrl.agents.factory import make_learner
from rsrl.agents.interface import EnvironmentFactory, Learner, Metrics, NetworkAgent
from rsrl.agents.run_log import RunLog, thinned
from rsrl.errors import RsrlError

CHECKPOINT_EVERY_S = 15.0
"""Training time between two checkpoints; the first is written before the first iteration."""


@dataclass(frozen=True)
class Budget:
    """How long to train: exactly one of `seconds` and `iterations`.

    `seconds` excludes the first iteration, which compiles. With `iterations` (episodes of DQN and DRQN, rounded up to a multiple of
    `races_at_once`) a run is a deterministic function of its seed. With `seconds` RSRL's schedules follow the clock, so a run does not
    repeat bit for bit; its model file records how many iterations were done.
    """

    seconds: float | None = None
    iterations: int | None = None

    def __post_init__(self) -> None:
        if (self.seconds is None) == (self.iterations is None):
            raise RsrlError("give either seconds or iterations to train for")
        if not (self.seconds or self.iterations or 0) > 0:
            raise RsrlError(
                f"nothing to train for: {self.seconds if self.iterations is None else self.iterations}; give a number above zero"
            )

    def fraction(self, iterations: int, seconds: float) -> float:
        """Share of the budget used, 0 to 1."""
        if self.iterations is not None:
            return min(iterations / self.iterations, 1.0)
        assert self.seconds is not None
        return min(seconds / self.seconds, 1.0)


@dataclass(frozen=True)
class Progress:
    """Progress of a training run.

    Attributes:
        fraction: share of the budget used.
        iteration: iterations (RSRL) or episodes (DQN, DRQN) done.
        steps: laps driven (DQN, DRQN) or rollouts from branched decisions (RSRL).
        seconds: training time, including that of earlier parts of a resumed run.
        steps_per_s: steps per second over the whole run.
        metrics: mean metrics since the report before.
    """

    fraction: float
    iteration: int
    steps: int
    seconds: float
    steps_per_s: float
    metrics: Metrics


@dataclass(frozen=True)
class TrainingResult:
    """Result of a training run.

    Attributes:
        agent: the policy.
        curve: learning curve, see `ModelMetadata.curve`.
        iterations: iterations (RSRL) or episodes (DQN, DRQN) done.
        steps: laps driven (DQN, DRQN) or rollouts from branched decisions (RSRL).
        seconds: wall-clock time.
        steps_per_s: steps per second.
        finished: whether the budget was used up; False after Ctrl-C.
    """

    agent: NetworkAgent
    curve: list[dict[str, float]]
    iterations: int
    steps: int
    seconds: float
    steps_per_s: float
    finished: bool


def train(
    make_environment: EnvironmentFactory,
    config: LearnerConfig,
    budget: Budget,
    seed: int,
    *,
    folder: Path | None = None,
    about: ModelMetadata | None = None,
    force: bool = False,
    progress: Callable[[Progress], None] | None = None,
) -> TrainingResult:
    """Train an agent from scratch.

    Args:
        make_environment: makes the environment for a learner of these settings.
        config: settings; their class determines the learner.
        budget: how long to train.
        seed: of all random numbers; the races are those of environment seed `TRAINING_SEED + seed`.
        folder: run folder for model, log and checkpoints; None keeps everything in memory.
        about: race, season hash, driver and command for the model's metadata.
        force: overwrite a model in `folder`.
        progress: called at every point of the learning curve.

    Raises:
        RsrlError: `folder` cannot be written or holds a model.
    """
    if folder is not None:
        claim_folder(folder, force)
    learner = make_learner(config, make_environment(config), seed)
    metadata = replace(about or ModelMetadata(), seed=seed, config=config_to_dict(config), budget=_budget_dict(budget))
    if folder is not None:
        clear_run(folder)
        clear_leftovers(folder)
    return _run(learner, budget, metadata, folder, RunLog(folder, [], 0), progress)


def resume(make_environment: EnvironmentFactory, folder: Path, *, progress: Callable[[Progress], None] | None = None) -> TrainingResult:
    """Continue a run that was interrupted or killed, from its last checkpoint, with its own settings, budget and seed.

    With a budget of iterations the result equals that of an uninterrupted run bit for bit.

    Raises:
        RsrlError: `folder` has no run, the run is finished, or the features have changed since.
    """
    agent, metadata = load_agent(folder)
    if metadata.finished:
        raise RsrlError(f"{folder}: this run has used up its budget; train a new one")
    config = config_from_dict(agent.kind, metadata.config, str(folder))
    environment = make_environment(config)
    load_agent(folder, environment.feature_names)  # raises where the features have changed
    learner = make_learner(config, environment, metadata.seed)
    state = load_training_state(folder)
    pending = RunLog.take_pending(state)
    learner.restore(state)
    clear_leftovers(folder)
    log = RunLog(folder, metadata.curve, learner.iteration, pending)
    return _run(learner, Budget(**metadata.budget), metadata, folder, log, progress)  # type: ignore[arg-type]


def _run(
    learner: Learner,
    budget: Budget,
    metadata: ModelMetadata,
    folder: Path | None,
    log: RunLog,
    progress: Callable[[Progress], None] | None,
) -> TrainingResult:
    clock = _Clock(metadata.seconds)
    saved_at = clock.seconds
    # Idle BLAS threads spin, on the core that computes the update.
    with closing(log), _interrupts() as interrupted, threadpool_limits(1, "blas"):
        if folder is not None and learner.iteration == 0:
            _save(learner, metadata, folder, log, saved_at, finished=False)
        while (fraction := budget.fraction(learner.iteration, clock.seconds)) < 1.0 and not interrupted():
            log.add(learner.advance(fraction))
            clock.begin()
            _report(learner, budget, clock, log, progress)
            if folder is not None and clock.seconds - saved_at > CHECKPOINT_EVERY_S:
                saved_at = clock.seconds
                _save(learner, metadata, folder, log, saved_at, finished=False)
        seconds = clock.seconds
        finished = budget.fraction(learner.iteration, seconds) >= 1.0
        if folder is not None:
            _save(learner, metadata, folder, log, seconds, finished)
    rate = learner.steps / max(seconds, 1e-9)
    return TrainingResult(learner.agent(), log.curve, learner.iteration, learner.steps, seconds, rate, finished)


class _Clock:
    """Training time in seconds, including that of earlier parts of a resumed run.

    Starts after the first iteration, which is mostly compilation: up to a minute on a machine that has never run RSRL.
    """

    def __init__(self, before: float) -> None:
        self._before = before
        self._start: float | None = None

    def begin(self) -> None:
        """Start the clock if it is not running."""
        if self._start is None:
            self._start = time.perf_counter()

    @property
    def seconds(self) -> float:
        return self._before if self._start is None else self._before + time.perf_counter() - self._start


def _report(learner: Learner, budget: Budget, clock: _Clock, log: RunLog, progress: Callable[[Progress], None] | None) -> None:
    seconds = clock.seconds
    metrics = log.point(learner.iteration, learner.steps, seconds)
    if progress is not None:
        fraction = budget.fraction(learner.iteration, seconds)
        progress(Progress(fraction, learner.iteration, learner.steps, seconds, learner.steps / max(seconds, 1e-9), metrics))


def _save(learner: Learner, metadata: ModelMetadata, folder: Path, log: RunLog, seconds: float, finished: bool) -> None:
    done = replace(
        metadata,
        iterations=learner.iteration,
        steps=learner.steps,
        seconds=round(seconds, 3),
        finished=finished,
        curve=thinned(log.curve),
    )
    save_run(folder, learner.agent(), done, learner.state() | log.state(), force=True)


def _budget_dict(budget: Budget) -> dict[str, Any]:
    return {name: value for name, value in vars(budget).items() if value is not None}


@contextmanager
def _interrupts() -> Iterator[Callable[[], bool]]:
    """Turn the first Ctrl-C into a flag, so that training stops between two iterations; a second one interrupts at once."""
    pressed = threading.Event()
    if threading.current_thread() is not threading.main_thread():
        yield pressed.is_set
        return
    previous = signal.getsignal(signal.SIGINT)

    def on_interrupt(number: int, frame: Any) -> None:
        pressed.set()
        signal.signal(signal.SIGINT, previous)

    signal.signal(signal.SIGINT, on_interrupt)
    try:
        yield pressed.is_set
    finally:
        signal.signal(signal.SIGINT, previous)
