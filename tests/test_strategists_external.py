"""Policies from elsewhere: functions, and files of Stable-Baselines3, whose library a stand-in replaces where it is not installed."""

import importlib.util
import json
import sys
import types
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from synthetic_race import synthetic_race

from rsrl.cli import main
from rsrl.environment import RaceEnv, RaceEnvironment
from rsrl.errors import RsrlError
from rsrl.evaluation import run_races
from rsrl.explanation import check_methods, explainable, load_any_policy, load_explained
from rsrl.strategists import ExternalPolicy, find_model, is_external, is_model, load_policy, of_function, strategist_of

RECORD = synthetic_race()
CAR = 3
MODULE = """
import numpy as np

def call(observation, mask):
    assert observation.dtype == np.float32 and mask.dtype == np.int8
    return 3 if mask[3] and observation.sum() % 1 < 0.1 else int(np.flatnonzero(mask)[0])

def paper(observation, mask):
    assert len(observation) == 51
    return int(np.flatnonzero(mask)[0])

paper.feature_set = "paper"

def half(observation, mask):
    return 0

half.feature_set = "half"

def seven(observation, mask):
    return 7

number = 7
"""


@pytest.fixture(autouse=True)
def working_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with a module of policies, in which the test works."""
    (tmp_path / "pit_wall_of_mine.py").write_text(MODULE, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_a_function_calls_as_it_would_in_the_environment() -> None:
    policy, about = load_policy("pit_wall_of_mine:call")
    assert isinstance(policy, ExternalPolicy)
    assert (policy.kind, policy.feature_set, about.race) == ("pit_wall_of_mine:call", "full", "")
    log = run_races(strategist_of(policy, RECORD, "mine"), RECORD, CAR, seed=5, races=4)
    function = sys.modules["pit_wall_of_mine"].call
    env = RaceEnv(RECORD, RECORD.cars[CAR].driver)
    for race in range(4):
        observation, info = env.reset(seed=5) if race == 0 else env.reset()
        terminated = False
        while not terminated:
            observation, _, terminated, _, info = env.step(function(observation, info["action_mask"]))
        assert (info["position"], info["stops"]) == (log.position[race], log.stops[race])
    assert log.stops.max() > 1
    assert "pit_wall_of_mine" in sys.modules
    assert str(Path.cwd()) not in sys.path


def test_a_function_may_read_another_feature_set() -> None:
    policy, _ = load_policy("pit_wall_of_mine:paper")
    assert run_races(strategist_of(policy, RECORD, "mine"), RECORD, CAR, seed=5, races=2).position.min() >= 1


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("nowhere_at_all:call", "nowhere_at_all:call: module nowhere_at_all cannot be imported"),
        ("pit_wall_of_mine:nobody", "module pit_wall_of_mine has no function nobody"),
        ("pit_wall_of_mine:number", "module pit_wall_of_mine has no function number"),
        ("pit_wall_of_mine:half", "its feature_set is 'half'; there are paper, full, named"),
        ("absent.zip", "absent.zip: no such file"),
        ("pit_wall_of_mine", "no model 'pit_wall_of_mine'"),
    ],
)
def test_what_is_not_there_is_one_clear_line(name: str, message: str) -> None:
    with pytest.raises(RsrlError, match=message):
        load_policy(name)


@pytest.mark.parametrize("answer", [7, -1, 1.5, None, [0, 1]])
def test_an_answer_that_is_no_call_is_refused(answer: Any) -> None:
    policy = of_function(lambda observation, mask: answer, "mine")
    with pytest.raises(RsrlError, match=r"mine: found .* it must call 0 to stay out"):
        run_races(strategist_of(policy, RECORD, "mine"), RECORD, CAR, seed=5, races=1)


def test_names_of_policies_are_told_apart() -> None:
    assert is_external("m:f")
    assert is_external("package.module:function")
    assert is_external("runs/dqn.zip")
    assert not any(is_external(name) for name in ("all", "runs/a", "C:\\runs\\a", "a:b:c", "dp"))
    assert is_model("m:f")
    with pytest.raises(RsrlError, match="only `rsrl evaluate` and `rsrl explain`"):
        find_model("m:f")
    with pytest.raises(RsrlError, match="only `rsrl evaluate` and `rsrl explain`"):
        load_explained("model.zip")


class Model:
    """Looks like a model of Stable-Baselines3: calls whatever its weights say, soft where it may be asked for an illegal call."""

    action_space = types.SimpleNamespace(n=4)
    loaded: Any = None

    def __init__(self, columns: int) -> None:
        self.observation_space = types.SimpleNamespace(shape=(columns,))
        self.asked: list[dict[str, Any]] = []

    @classmethod
    def load(cls, path: Path, device: str) -> "Model":
        """The columns stand in the file."""
        assert device == "cpu"
        with zipfile.ZipFile(path) as archive:
            cls.loaded = cls(json.loads(archive.read("data"))["columns"])
        return cls.loaded

    def predict(self, observation: NDArray[np.float32], **more: Any) -> tuple[NDArray[np.int64], Any]:
        """Hard on every lap whose observation sums to little, else stay out."""
        self.asked.append(more)
        return np.where(observation.sum(axis=1) % 1 < 0.1, 3, 0), more["state"]


def save(path: Path, module: str, columns: int = 85, **more: Any) -> str:
    """A file as Stable-Baselines3 writes them, as far as its class is read from it."""
    with zipfile.ZipFile(path, "w") as archive:
        about = {"policy_class": {":type:": "<class 'abc.ABCMeta'>", ":serialized:": "...", "__module__": module}, "columns": columns}
        archive.writestr("data", json.dumps(about | more))
    return str(path)


@pytest.fixture
def library(monkeypatch: pytest.MonkeyPatch) -> None:
    """Stand-ins for the library and its contributions."""
    for name, classes in (("stable_baselines3", ("DQN", "PPO", "A2C")), ("sb3_contrib", ("TRPO", "QRDQN", "MaskablePPO", "RecurrentPPO"))):
        module = types.ModuleType(name)
        for one in classes:
            setattr(module, one, type(one, (Model,), {}))
        monkeypatch.setitem(sys.modules, name, module)


@pytest.mark.usefixtures("library")
@pytest.mark.parametrize(
    ("module", "more", "algorithm", "recurrent"),
    [
        ("stable_baselines3.dqn.policies", {}, "DQN", False),
        ("stable_baselines3.common.policies", {"clip_range": {}}, "PPO", False),
        ("stable_baselines3.common.policies", {}, "A2C", False),
        ("stable_baselines3.common.policies", {"cg_max_steps": 15}, "TRPO", False),
        ("sb3_contrib.qrdqn.policies", {}, "QRDQN", False),
        ("sb3_contrib.common.maskable.policies", {"clip_range": {}}, "MaskablePPO", False),
        ("sb3_contrib.common.recurrent.policies", {"clip_range": {}}, "RecurrentPPO", True),
    ],
)
def test_a_file_is_loaded_by_the_algorithm_it_names(
    module: str, more: dict[str, Any], algorithm: str, recurrent: bool, tmp_path: Path
) -> None:
    name = save(tmp_path / "model.zip", module, **more)
    policy, _ = load_policy(name)
    assert isinstance(policy, ExternalPolicy)
    assert (policy.kind, policy.recurrent, policy.feature_set) == (algorithm, recurrent, "full")
    environment = RaceEnvironment(RECORD, CAR, batch=3)
    environment.reset(1, np.arange(3, dtype=np.int64))
    strategist = strategist_of(policy, RECORD, algorithm)
    strategist.begin(environment, 1, np.arange(3, dtype=np.int64))
    assert strategist.decide(environment).dtype == np.int8
    owner = "stable_baselines3" if algorithm in ("DQN", "PPO", "A2C") else "sb3_contrib"
    asked = getattr(sys.modules[owner], algorithm).loaded.asked[0]
    assert asked["deterministic"]
    assert asked["episode_start"].all()
    assert ("action_masks" in asked) == (algorithm == "MaskablePPO")
    assert (explainable(load_any_policy(name), ["what-if"]) == ()) == recurrent


@pytest.mark.usefixtures("library")
def test_a_file_that_does_not_fit_says_why(tmp_path: Path) -> None:
    with pytest.raises(RsrlError, match=r"reads observations \(4,\) and makes 4 calls; .* 85 \(full\)"):
        load_policy(save(tmp_path / "cartpole.zip", "stable_baselines3.dqn.policies", columns=4))
    with pytest.raises(RsrlError, match=r"its policy is of my.policies, which RSRL does not know"):
        load_policy(save(tmp_path / "own.zip", "my.policies"))
    for content in (b"", b"PK no"):
        (tmp_path / "broken.zip").write_bytes(content)
        with pytest.raises(RsrlError, match=r"broken.zip: not a model saved by Stable-Baselines3"):
            load_policy(str(tmp_path / "broken.zip"))
    with zipfile.ZipFile(tmp_path / "other.zip", "w") as archive:
        archive.writestr("data", "[]")
    with pytest.raises(RsrlError, match=r"other.zip: not a model saved by Stable-Baselines3"):
        load_policy(str(tmp_path / "other.zip"))


def test_without_the_library_one_line_says_what_to_install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "sb3_contrib", None)
    with pytest.raises(RsrlError, match="a QRDQN of Stable-Baselines3; install it first: pip install sb3-contrib"):
        load_policy(save(tmp_path / "model.zip", "sb3_contrib.qrdqn.policies"))


@pytest.mark.sb3
@pytest.mark.skipif(importlib.util.find_spec("stable_baselines3") is None, reason="Stable-Baselines3 is not installed")
@pytest.mark.filterwarnings("default")
@pytest.mark.parametrize("algorithm", ["DQN", "PPO", "A2C"])
def test_a_real_file_calls_as_the_model_that_was_saved(algorithm: str, tmp_path: Path) -> None:
    import stable_baselines3

    env = RaceEnv(RECORD, RECORD.cars[CAR].driver)
    model = getattr(stable_baselines3, algorithm)("MlpPolicy", env, seed=0, device="cpu")
    model.save(tmp_path / "model.zip")
    policy, _ = load_policy(str(tmp_path / "model.zip"))
    assert policy.kind == algorithm
    log = run_races(strategist_of(policy, RECORD, algorithm), RECORD, CAR, seed=5, races=1)
    observation, _ = env.reset(seed=5)
    terminated = False
    while not terminated:
        observation, _, terminated, _, info = env.step(int(model.predict(observation, deterministic=True)[0]))
    assert info["position"] == log.position[0]


def said(capsys: pytest.CaptureFixture[str], *words: str) -> dict[str, Any]:
    """What a command prints with --json."""
    assert main([*words, "--json"]) == 0
    document: dict[str, Any] = json.loads(capsys.readouterr().out)
    return document


def test_evaluate_takes_a_policy_from_elsewhere(capsys: pytest.CaptureFixture[str]) -> None:
    words = ("--race", "bahrain-2023", "--races", "4")
    document = said(capsys, "evaluate", "pit_wall_of_mine:call", *words, "--strategists", "heuristic,pit_wall_of_mine:paper")
    assert {row["strategist"] for row in document["rows"]} == {"pit_wall_of_mine:call", "heuristic", "pit_wall_of_mine:paper"}
    assert document["model"] == "pit_wall_of_mine:call"
    swapped = said(capsys, "evaluate", "bahrain-2023", *words, "--strategists", "pit_wall_of_mine:call")
    by_name = [{row["strategist"]: row["mean_position"] for row in one["rows"]} for one in (document, swapped)]
    assert by_name[0]["pit_wall_of_mine:call"] == by_name[1]["pit_wall_of_mine:call"]
    assert main(["evaluate", "pit_wall_of_mine:call"]) == 2
    assert "name one with --race" in capsys.readouterr().err


@pytest.mark.usefixtures("library")
def test_evaluate_takes_a_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    name = save(tmp_path / "model.zip", "stable_baselines3.dqn.policies")
    document = said(capsys, "evaluate", name, "--race", "bahrain-2023", "--races", "4", "--strategists", "heuristic")
    assert {row["strategist"] for row in document["rows"]} == {"DQN", "heuristic"}


def test_explain_gives_a_what_if_and_says_what_it_leaves_out(capsys: pytest.CaptureFixture[str]) -> None:
    words = ("explain", "pit_wall_of_mine:call", "--race", "bahrain-2023", "--lap", "8", "--seed", "1", "--races", "8")
    document = said(capsys, *words)
    assert {one["method"] for one in document["explanations"]} == {"what-if"}
    assert document["notes"] == [
        "Left out, because pit_wall_of_mine:call gives calls without values: attribution, tree, counterfactual, summary."
    ]
    decision = document["decision"]
    assert (decision["q_values"], decision["margin"]) == ({}, None)
    assert document["explanations"][0]["rows"][0]["value"] == 0.0
    assert main(list(words)) == 0
    shown = " ".join(capsys.readouterr().out.split())  # lines are wrapped
    assert "lap 8: the policy pit_wall_of_mine:call calls" in shown
    assert "by its own values" not in shown


def test_explain_writes_a_page_of_a_policy_without_values(capsys: pytest.CaptureFixture[str]) -> None:
    words = ["explain", "pit_wall_of_mine:call", "--race", "bahrain-2023", "--lap", "8", "--seed", "1", "--races", "8"]
    assert main([*words, "--method", "what-if", "--html", "page.html"]) == 0
    assert "The policy's value of each call" not in Path("page.html").read_text(encoding="utf-8")


@pytest.mark.parametrize("words", [("--method", "tree"), ("--method", "what-if,attribution"), ("--fit-tree",), ("--safety-car-table",)])
def test_explain_refuses_methods_that_need_values(words: tuple[str, ...], capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["explain", "pit_wall_of_mine:call", "--race", "bahrain-2023", "--lap", "8", "--seed", "1", *words]) == 2
    message = capsys.readouterr().err
    assert "gives calls without values, which" in message
    assert message.rstrip().endswith("a method for any policy: what-if")


def test_methods_are_those_of_calls_for_policies_from_elsewhere_only() -> None:
    mine, own = load_any_policy("pit_wall_of_mine:call"), load_any_policy("all")
    assert explainable(own, ["tree", "what-if"]) == ("tree", "what-if")
    assert explainable(mine, ["tree", "what-if"]) == ("what-if",)
    check_methods(own, ["tree"])
    with pytest.raises(RsrlError, match="tree needs"):
        check_methods(mine, ["what-if", "tree"])
