import json
import os
import random
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from agents_toys import Bandit, LittleRaces
from safetensors.numpy import load_file

from rsrl.agents import (
    Budget,
    DqnConfig,
    LearnerConfig,
    ModelMetadata,
    Progress,
    RsrlConfig,
    TrainingResult,
    holds_model,
    load_agent,
    resume,
    train,
    training,
)
from rsrl.agents.run_log import CURVE_POINTS, RunLog, thinned
from rsrl.errors import RsrlError

SMALL = RsrlConfig(width=24, races=32, minibatch=64, epochs=2, branch_most=1.0, branch_least=0.3, pit_chance=0.2)
DQN = DqnConfig(batch=4, races_at_once=10, validation_races=10, validation_episodes=20)


def toy(config: LearnerConfig) -> Any:
    return LittleRaces() if config.kind == "rsrl" else Bandit()


def stop_at(iteration: int) -> Any:
    def progress(at: Progress) -> None:
        if at.iteration == iteration:
            signal.raise_signal(signal.SIGINT)

    return progress


def assert_equal_runs(one: Path, two: Path) -> None:
    """Weights, training state and learning curve of two runs are equal to the bit; the clock apart."""
    for name in ("model.safetensors", "training.safetensors"):
        a, b = load_file(one / name), load_file(two / name)
        assert sorted(a) == sorted(b)
        assert all(np.array_equal(a[key], b[key]) for key in a)
    curves = [[json.loads(line) | {"seconds": 0} for line in (run / "log.jsonl").read_text().splitlines()] for run in (one, two)]
    assert curves[0] == curves[1]
    assert len(curves[0]) > 0


@pytest.mark.parametrize(("config", "iterations", "stop"), [(SMALL, 6, 3), (DQN, 60, 40)])
def test_interrupted_and_resumed_equals_uninterrupted_bit_by_bit(tmp_path: Path, config: Any, iterations: int, stop: int) -> None:
    about = ModelMetadata(race="toy", driver="HAM", command="rsrl train toy")
    whole = train(toy, config, Budget(iterations=iterations), 3, folder=tmp_path / "whole", about=about)
    half = train(toy, config, Budget(iterations=iterations), 3, folder=tmp_path / "half", about=about, progress=stop_at(stop))
    assert whole.finished
    assert not half.finished
    assert half.iterations == stop
    assert not load_agent(tmp_path / "half")[1].finished
    rest = resume(toy, tmp_path / "half")
    assert (rest.finished, rest.iterations, rest.steps) == (True, whole.iterations, whole.steps)
    assert_equal_runs(tmp_path / "whole", tmp_path / "half")
    without_clock = [[{k: v for k, v in point.items() if k != "seconds"} for point in run.curve] for run in (whole, rest)]
    assert without_clock[0] == without_clock[1]
    assert load_agent(tmp_path / "half")[1].command == "rsrl train toy"


class Killed(BaseException):
    """Stands for the end of the process: nothing in the program catches it."""


def begin_or_resume(folder: Path, config: LearnerConfig, iterations: int) -> TrainingResult:
    """What a user does with a run that may have been killed."""
    if holds_model(folder):
        return resume(toy, folder)
    return train(toy, config, Budget(iterations=iterations), 3, folder=folder)


@pytest.mark.parametrize(("config", "iterations"), [(SMALL, 2), (DQN, 20)])
def test_a_run_killed_at_any_step_of_a_checkpoint_goes_on_to_the_same_bits(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, config: Any, iterations: int
) -> None:
    train(toy, config, Budget(iterations=iterations), 3, folder=tmp_path / "whole")
    monkeypatch.setattr(training, "CHECKPOINT_EVERY_S", -1.0)  # after every iteration
    steps_left = [0]

    def dies(step: Any) -> Any:
        def counted(*arguments: Any) -> Any:
            steps_left[0] -= 1
            if steps_left[0] == 0:
                raise Killed
            return step(*arguments)

        return counted

    for name in ("fsync", "replace"):
        monkeypatch.setattr(os, name, dies(getattr(os, name)))
    last = 1 + 1 + 6 * (2 + 2)  # the log, the first checkpoint, one for each of two advances, the last
    for step in (*range(1, 22), last - 3, last - 2, last - 1, last):
        folder = tmp_path / str(step)
        steps_left[0] = step
        with pytest.raises(Killed):
            begin_or_resume(folder, config, iterations)
        assert begin_or_resume(folder, config, iterations).finished
        assert_equal_runs(tmp_path / "whole", folder)


KILLED_IN_RACE = """
import os, random, signal, sys, threading
from pathlib import Path
from agents_toys import Bandit
from rsrl.agents import Budget, DqnConfig, holds_model, resume, train, training

folder, seed = Path(sys.argv[1]), int(sys.argv[2])
training.CHECKPOINT_EVERY_S = 0.0
moment = random.Random(seed)
last = moment.randint(2, 12)

class Doomed(Bandit):
    driven = 0
    def reset(self, seed, races):
        self.driven += 1
        if self.driven == last:
            threading.Timer(moment.uniform(0.0, 0.03), os.kill, (os.getpid(), signal.SIGKILL)).start()
        return super().reset(seed, races)

if holds_model(folder):
    resume(lambda config: Doomed(), folder)
else:
    config = DqnConfig(batch=4, races_at_once=10, validation_races=10, validation_episodes=20)
    train(lambda config: Doomed(), config, Budget(iterations=400), 3, folder=folder)
"""


@pytest.mark.slow
def test_a_run_killed_at_random_moments_goes_on_to_the_same_bits(tmp_path: Path) -> None:
    train(toy, DQN, Budget(iterations=400), 3, folder=tmp_path / "whole")
    seeds = random.Random(12)
    here = {"PYTHONPATH": os.pathsep.join((str(Path(__file__).parent), os.environ.get("PYTHONPATH", "")))}
    for _ in range(4):
        command = [sys.executable, "-c", KILLED_IN_RACE, str(tmp_path / "killed"), str(seeds.randrange(1000))]
        ended = subprocess.run(command, env=os.environ | here, capture_output=True, text=True, check=False)
        assert ended.returncode == -signal.SIGKILL, ended.stderr
    assert begin_or_resume(tmp_path / "killed", DQN, 400).finished
    assert_equal_runs(tmp_path / "whole", tmp_path / "killed")
    left = {path.name for path in (tmp_path / "killed").iterdir()}
    assert left == {"model.safetensors", "model.json", "training.safetensors", "log.jsonl"}


def test_ctrl_c_is_given_back(tmp_path: Path) -> None:
    before = signal.getsignal(signal.SIGINT)
    train(toy, DQN, Budget(iterations=60), 0, progress=stop_at(20))
    assert signal.getsignal(signal.SIGINT) is before


def test_the_log_has_one_line_a_point(tmp_path: Path) -> None:
    seen: list[Progress] = []
    result = train(toy, DQN, Budget(iterations=60), 0, folder=tmp_path, progress=seen.append)
    lines = [json.loads(line) for line in (tmp_path / "log.jsonl").read_text().splitlines()]
    assert lines == result.curve
    assert [point["iteration"] for point in lines] == [10, 20, 30, 40, 50, 60] == [at.iteration for at in seen]
    assert [at.fraction for at in seen] == pytest.approx([k / 6 for k in range(1, 7)])
    assert seen[-1].steps == result.steps == 180
    assert 0 <= lines[-1]["mean_return"] <= 30


def test_a_budget_of_seconds_ends_and_says_how_far_it_came(tmp_path: Path) -> None:
    result = train(toy, DQN, Budget(seconds=0.5), 0, folder=tmp_path)
    about = load_agent(tmp_path)[1]
    assert result.finished
    assert about.seconds >= 0.5
    assert about.iterations == result.iterations > 0
    assert about.budget == {"seconds": 0.5}


def test_a_finished_run_is_not_resumed_and_not_overwritten(tmp_path: Path) -> None:
    train(toy, DQN, Budget(iterations=2), 0, folder=tmp_path)
    with pytest.raises(RsrlError, match="used up its budget"):
        resume(toy, tmp_path)
    with pytest.raises(RsrlError, match="holds a model already"):
        train(toy, DQN, Budget(iterations=2), 0, folder=tmp_path)
    train(toy, DQN, Budget(iterations=3), 0, folder=tmp_path, force=True)
    assert load_agent(tmp_path)[1].iterations == 10  # races come in tens


def test_a_run_with_other_features_or_settings_is_not_resumed(tmp_path: Path) -> None:
    train(toy, DQN, Budget(iterations=60), 0, folder=tmp_path, progress=stop_at(20))

    class Renamed(Bandit):
        feature_names = ("soft", "medium", "hard", "other")

    with pytest.raises(RsrlError, match="other features"):
        resume(lambda config: Renamed(), tmp_path)
    document = json.loads((tmp_path / "model.json").read_text())
    document["config"]["momentum"] = 0.5
    (tmp_path / "model.json").write_text(json.dumps(document))
    with pytest.raises(RsrlError, match="momentum"):
        resume(toy, tmp_path)


@pytest.mark.parametrize("arguments", [{}, {"seconds": 1.0, "iterations": 1}, {"seconds": 0.0}, {"iterations": -3}])
def test_budgets_that_are_none(arguments: dict[str, Any]) -> None:
    with pytest.raises(RsrlError):
        Budget(**arguments)


def test_a_half_written_log_line_is_dropped_on_resuming(tmp_path: Path) -> None:
    log = RunLog(tmp_path, [], 0)
    for iteration in (1, 2, 3):
        log.add({"mean_return": float(iteration)})
        log.point(iteration, iteration, 0.0)
    log.close()
    with (tmp_path / "log.jsonl").open("a") as file:
        file.write('{"iteration": 4, "mea')
    again = RunLog(tmp_path, [], 2)
    again.close()
    assert [point["iteration"] for point in again.curve] == [1, 2]


def test_a_long_curve_is_thinned_to_its_last_point() -> None:
    curve = [{"iteration": float(k)} for k in range(1, 1001)]
    assert len(thinned(curve)) == CURVE_POINTS
    assert thinned(curve)[-1] == {"iteration": 1000.0}
