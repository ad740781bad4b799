import json
import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from safetensors.numpy import save_file

from rsrl.agents import ModelMetadata, NetworkAgent, feature_hash, load_agent, load_training_state, save_run
from rsrl.agents.networks import NETWORKS
from rsrl.errors import RsrlError

NAMES = ("speed", "gap", "tyre")


def an_agent(kind: str = "rsrl", network: str = "duelling") -> NetworkAgent:
    shape = NETWORKS[network](len(NAMES), 6)
    return NetworkAgent(kind, "full", NAMES, kind == "rsrl", shape, shape.init(np.random.default_rng(8)))


@pytest.fixture
def run(tmp_path: Path) -> Path:
    save_run(tmp_path / "run", an_agent(), ModelMetadata(race="bahrain-2023", driver="HAM", seed=4), {"x": np.arange(3)})
    return tmp_path / "run"


@pytest.mark.parametrize(("kind", "network"), [("dqn", "feed-forward"), ("drqn", "lstm"), ("rsrl", "duelling")])
def test_a_model_comes_back_as_it_was(tmp_path: Path, kind: str, network: str) -> None:
    agent = an_agent(kind, network)
    metadata = ModelMetadata(
        race="bahrain-2023",
        season_hash="abc",
        driver="HAM",
        trained_range={"grid": [1.0, 20.0]},
        seed=4,
        config={"width": 6},
        budget={"iterations": 9},
        iterations=9,
        steps=99,
        seconds=1.5,
        finished=False,
        curve=[{"iteration": 1.0}],
        command="rsrl train",
        version="9.9",
    )
    assert all(value != ModelMetadata.__dict__.get(name) for name, value in vars(metadata).items())
    save_run(tmp_path / "a" / "b", agent, metadata)
    back, about = load_agent(tmp_path / "a" / "b", NAMES)
    assert about == metadata
    assert replace(back, params={}) == replace(agent, params={})
    features, memory = np.ones((2, 3), np.float32), agent.initial_memory(2)
    assert all((a == b).all() for a, b in zip(agent.q_values(features, memory), back.q_values(features, memory), strict=True))


def test_training_state_comes_back(run: Path) -> None:
    assert load_training_state(run)["x"].tolist() == [0, 1, 2]


def test_a_model_is_overwritten_only_by_force(run: Path) -> None:
    before = (run / "model.json").read_bytes()
    with pytest.raises(RsrlError, match="holds a model already"):
        save_run(run, an_agent(), ModelMetadata())
    assert (run / "model.json").read_bytes() == before
    save_run(run, an_agent(), ModelMetadata(seed=5), force=True)
    assert load_agent(run)[1].seed == 5
    with pytest.raises(RsrlError, match="holds no training"):
        load_training_state(run)


def test_no_temporary_file_stays(run: Path) -> None:
    assert sorted(p.name for p in run.iterdir()) == ["model.json", "model.safetensors", "training.safetensors"]


def test_missing_folder_and_files(run: Path, tmp_path: Path) -> None:
    with pytest.raises(RsrlError, match="no such run folder"):
        load_agent(tmp_path / "nothing")
    (run / "model.safetensors").unlink()
    with pytest.raises(RsrlError, match=r"holds no model\.safetensors"):
        load_agent(run)
    (run / "model.json").unlink()
    with pytest.raises(RsrlError, match=r"holds no model\.json"):
        load_agent(run)


@pytest.mark.parametrize("keep", [0, 4, 30, 400])
def test_a_truncated_weights_file(run: Path, keep: int) -> None:
    path = run / "model.safetensors"
    path.write_bytes(path.read_bytes()[:keep])
    with pytest.raises(RsrlError, match="not a readable safetensors file"):
        load_agent(run)


def test_weights_of_another_network(run: Path) -> None:
    save_file({"something.else": np.zeros(3, np.float32)}, run / "model.safetensors")
    with pytest.raises(RsrlError, match="weights of another network"):
        load_agent(run)


def test_weights_that_are_no_numbers(run: Path) -> None:
    params = an_agent().params
    save_file(params | {"q.bias": np.full(4, np.nan, np.float32)}, run / "model.safetensors")
    with pytest.raises(RsrlError, match="not finite"):
        load_agent(run)


@pytest.mark.parametrize("text", ["", "{", "[]", "{}", '{"weights": 3}', '{"format": 1}', '{"format": 1, "features": 3}', "\udcff"])
def test_foreign_metadata(run: Path, text: str) -> None:
    (run / "model.json").write_bytes(text.encode("utf-8", "surrogateescape"))
    with pytest.raises(RsrlError, match=r"model\.json"):
        load_agent(run)


def edit(run: Path, **changes: object) -> None:
    path = run / "model.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | changes))


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"format": 2}, "format version 2"),
        ({"kind": "ppo"}, "unknown kind of agent 'ppo'"),
        ({"network": {"name": "transformer", "n_features": 3, "width": 6}}, "transformer"),
        ({"network": {"name": "duelling", "n_features": 4, "width": 6}}, "with 3 features"),
        ({"features": {"set": "full", "hash": "0" * 16, "names": ["a", "b", "c"]}}, "do not match their hash"),
        ({"surprise": 1}, "surprise"),
    ],
)
def test_metadata_that_does_not_fit(run: Path, changes: dict[str, object], message: str) -> None:
    edit(run, **changes)
    with pytest.raises(RsrlError, match=message):
        load_agent(run)


def test_another_feature_schema_is_named(run: Path) -> None:
    with pytest.raises(RsrlError, match="2 differ, such as age"):
        load_agent(run, ("speed", "gap", "age"))
    with pytest.raises(RsrlError, match="order differs"):
        load_agent(run, ("gap", "speed", "tyre"))


def test_the_feature_hash_sees_set_names_and_order() -> None:
    hashes = {feature_hash(s, n) for s, n in [("full", NAMES), ("paper", NAMES), ("full", NAMES[::-1]), ("full", NAMES[:2])]}
    assert len(hashes) == 4


def test_a_folder_that_cannot_be_written(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(RsrlError, match="cannot be written"):
        save_run(tmp_path / "file", an_agent(), ModelMetadata())
    with pytest.raises(RsrlError, match="cannot be written"):
        save_run(tmp_path / "file" / "below", an_agent(), ModelMetadata())


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write everywhere")
def test_a_folder_without_write_permission(tmp_path: Path) -> None:
    tmp_path.chmod(0o500)
    with pytest.raises(RsrlError, match="cannot be written"):
        save_run(tmp_path / "run", an_agent(), ModelMetadata())
