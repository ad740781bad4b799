"""Run folders: `model.safetensors` (weights), `model.json` (metadata), `training.safetensors` (state to resume from).

Nothing is pickled. Files are written under temporary names, flushed to disk and then renamed, so that a run killed at any moment leaves
either its last checkpoint or the one before. `model.json` comes last: a folder without it holds no model.
"""

import hashlib
import json
import os
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from safetensors import SafetensorError
from safetensors.numpy import load_file, save

from rsrl import __version__
from rsrl.agents.config import AGENTS
from rsrl.agents.interface import NetworkAgent
from rsrl.agents.networks import NETWORKS, Network
from rsrl.errors import RsrlError
from rsrl.text_files import read_text

FORMAT: Final = 1
MODEL_FILE, METADATA_FILE, TRAINING_FILE = "model.safetensors", "model.json", "training.safetensors"
_FILES: Final = (METADATA_FILE, MODEL_FILE, TRAINING_FILE)


@dataclass(frozen=True)
class ModelMetadata:
    """Metadata of a trained model.

    Attributes:
        race: what it was trained on: a race such as `bahrain-2023`, a group such as `all`, or races separated by commas; "" for none.
        season_hash: `season.race_hash` of the race's figures, or a hash over those of several; "" for none.
        driver: the driver it was trained for; "" for all or none.
        trained_range: lowest and highest training value of each figure of track and car, by feature name.
        seed: the learner's seed.
        config: the learner's settings.
        budget: `{"seconds": s}` or `{"iterations": n}`.
        iterations: iterations (RSRL) or episodes (DQN, DRQN) done.
        steps: laps driven (DQN, DRQN) or rollouts from branched decisions (RSRL).
        seconds: wall-clock training time.
        finished: whether the budget was used up.
        curve: the learning curve, one dictionary per point (`iteration`, `steps`, `seconds`, `mean_return`, ...).
        command: that trained it.
        version: of RSRL that trained it.
    """

    race: str = ""
    season_hash: str = ""
    driver: str = ""
    trained_range: dict[str, list[float]] = field(default_factory=dict)
    seed: int = 0
    config: dict[str, Any] = field(default_factory=dict)
    budget: dict[str, float] = field(default_factory=dict)
    iterations: int = 0
    steps: int = 0
    seconds: float = 0.0
    finished: bool = True
    curve: list[dict[str, float]] = field(default_factory=list)
    command: str = ""
    version: str = __version__


def feature_hash(feature_set: str, feature_names: tuple[str, ...]) -> str:
    """First 16 hex digits of the SHA-256 of a feature schema; models with equal hashes read the same features."""
    return hashlib.sha256("\n".join((feature_set, *feature_names)).encode()).hexdigest()[:16]


def holds_model(folder: Path) -> bool:
    """Whether a folder holds a whole model: `model.json` is the last file written."""
    return (folder / METADATA_FILE).exists()


def claim_folder(folder: Path, force: bool) -> None:
    """Make the folder and check that a model may be written there.

    Files without `model.json`, left by a run that was killed while it wrote its first checkpoint, are no model.

    Raises:
        RsrlError: it cannot be made or written to, or it holds a model and `force` is not set.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        probe = folder / f".write-test-{os.getpid()}"
        probe.write_bytes(b"")
        probe.unlink()
    except OSError as error:
        raise _unwritable(folder, error) from None
    if not force and holds_model(folder):
        raise RsrlError(f"{folder}: holds a model already; choose another folder, or overwrite it with --force")


def clear_run(folder: Path) -> None:
    """Delete a run's files, `model.json` first, so that no files of two runs are ever taken for one.

    Raises:
        RsrlError: they cannot be deleted.
    """
    try:
        for name in _FILES:
            (folder / name).unlink(missing_ok=True)
    except OSError as error:
        raise _unwritable(folder, error) from None


def clear_leftovers(folder: Path) -> None:
    """Delete the temporary files of a run that was killed while it wrote a checkpoint."""
    for name in _FILES:
        for path in folder.glob(f".{name}.*"):
            path.unlink(missing_ok=True)


def save_run(
    folder: Path,
    agent: NetworkAgent,
    metadata: ModelMetadata,
    training_state: dict[str, NDArray[Any]] | None = None,
    *,
    force: bool = False,
) -> None:
    """Write a model and, where given, the training state to resume from.

    Raises:
        RsrlError: as `claim_folder`.
    """
    claim_folder(folder, force)
    document = {
        "format": FORMAT,
        "kind": agent.kind,
        "network": {"name": agent.network.name, "n_features": agent.network.n_features, "width": agent.network.width},
        "masked": agent.masked,
        "features": {
            "set": agent.feature_set,
            "hash": feature_hash(agent.feature_set, agent.feature_names),
            "names": list(agent.feature_names),
        },
    } | asdict(metadata)
    text = json.dumps(document, indent=1) + "\n"
    weights = {name: np.ascontiguousarray(value) for name, value in agent.params.items()}
    files = {folder / MODEL_FILE: save(weights), folder / METADATA_FILE: text.encode()}
    try:
        if training_state is None:
            (folder / TRAINING_FILE).unlink(missing_ok=True)
            replace_files(files)
        else:
            replace_files({folder / TRAINING_FILE: save(training_state)} | files)
    except OSError as error:
        raise _unwritable(folder, error) from None


def load_agent(folder: Path, feature_names: tuple[str, ...] | None = None) -> tuple[NetworkAgent, ModelMetadata]:
    """Read a model.

    Args:
        folder: a run folder.
        feature_names: the features it will be given, checked against those it was trained on; None skips the check.

    Raises:
        RsrlError: the folder or a file is missing, broken, of another format version, or of other features.
    """
    folder = Path(folder)
    document = _read_metadata(folder)
    where = str(folder / METADATA_FILE)
    try:
        features = document.pop("features")
        names = tuple(str(name) for name in features["names"])
        feature_set, stored_hash = str(features["set"]), features["hash"]
        network = _network(document.pop("network"), len(names))
        kind, masked = document.pop("kind"), document.pop("masked")
        metadata = ModelMetadata(**document)
    except (KeyError, TypeError, ValueError) as error:
        raise RsrlError(f"{where}: not the metadata of a model ({error}); train the model again") from None
    if kind not in AGENTS or not isinstance(masked, bool):
        raise RsrlError(f"{where}: unknown kind of agent {kind!r}; known kinds: {', '.join(AGENTS)}")
    if stored_hash != feature_hash(feature_set, names):
        raise RsrlError(f"{where}: feature names do not match their hash, the file was edited; train the model again")
    _check_features(names, feature_names, where)
    params = _read_weights(folder / MODEL_FILE, network)
    return NetworkAgent(kind, feature_set, names, masked, network, params), metadata


def load_training_state(folder: Path) -> dict[str, NDArray[Any]]:
    """The training state written by `save_run`; raises RsrlError where it is missing or broken."""
    return _read_arrays(folder / TRAINING_FILE)


def replace_file(path: Path, content: bytes) -> None:
    """Write a file atomically; see `replace_files`."""
    replace_files({path: content})


def replace_files(contents: Mapping[Path, bytes]) -> None:
    """Write files whole or not at all: all of them to temporary files, flushed to disk, which are then renamed in the order given."""
    temporaries = {path: path.with_name(f".{path.name}.{os.getpid()}") for path in contents}
    try:
        for path, content in contents.items():
            with temporaries[path].open("wb") as file:
                file.write(content)
                file.flush()
                os.fsync(file.fileno())
        for path, temporary in temporaries.items():
            os.replace(temporary, path)
    finally:
        for temporary in temporaries.values():
            temporary.unlink(missing_ok=True)


def _read_metadata(folder: Path) -> dict[str, Any]:
    path = folder / METADATA_FILE
    if not folder.is_dir():
        raise RsrlError(f"{folder}: no such run folder; train a model with `rsrl train --out {folder}`")
    try:
        document = json.loads(read_text(path))
    except FileNotFoundError:
        raise RsrlError(f"{folder}: holds no {METADATA_FILE}; give a folder made by `rsrl train`") from None
    except (OSError, ValueError) as error:
        raise RsrlError(f"{path}: cannot be read ({error}); train the model again") from None
    if not isinstance(document, dict) or "format" not in document:
        raise RsrlError(f"{path}: not the metadata of a model; give a folder made by `rsrl train`")
    version = document.pop("format")
    if version != FORMAT:
        raise RsrlError(f"{path}: format version {version!r}, this version of RSRL reads {FORMAT}; train the model again")
    return document


def _network(described: dict[str, Any], n_features: int) -> Network:
    name, width = described["name"], described["width"]
    if name not in NETWORKS or described["n_features"] != n_features or not isinstance(width, int) or not 1 <= width <= 4096:
        raise ValueError(f"network {described!r} with {n_features} features")
    return NETWORKS[name](n_features, width)


def _check_features(names: tuple[str, ...], expected: tuple[str, ...] | None, where: str) -> None:
    if expected is None or tuple(expected) == names:
        return
    odd = sorted(set(names) ^ set(expected))
    what = f"{len(odd)} differ, such as {odd[0]}" if odd else "their order differs"
    raise RsrlError(f"{where}: trained on other features than are given now ({what}); train the model again")


def _read_weights(path: Path, network: Network) -> dict[str, NDArray[Any]]:
    params = _read_arrays(path)
    wanted = {name: np.shape(value) for name, value in network.init(np.random.default_rng(0)).items()}
    if {name: value.shape for name, value in params.items()} != wanted or any(v.dtype != np.float32 for v in params.values()):
        raise RsrlError(f"{path}: weights of another network than {METADATA_FILE} describes; train the model again")
    if not all(np.isfinite(value).all() for value in params.values()):
        raise RsrlError(f"{path}: weights that are not finite; train the model again")
    return params


def _read_arrays(path: Path) -> dict[str, NDArray[Any]]:
    if not path.is_file():
        raise RsrlError(f"{path.parent}: holds no {path.name}; give a folder made by `rsrl train`")
    try:
        return load_file(path)
    except (OSError, SafetensorError, ValueError, KeyError) as error:
        raise RsrlError(f"{path}: not a readable safetensors file ({error}); train the model again") from None


def _unwritable(folder: Path, error: OSError) -> RsrlError:
    return RsrlError(f"{folder}: cannot be written ({error.strerror}); choose another folder with --out")
