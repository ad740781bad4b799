"""Numbers that stand for "none" inside the simulator never leave it: states, their files, explanations and the environments' info."""

import io
import json
from collections.abc import Iterator
from typing import Any

import gymnasium
import numpy as np
import pytest
from synthetic_race import synthetic_race

import rsrl.environment  # noqa: F401  # registers the environment
from rsrl.cli import main
from rsrl.environment import RaceEnvironment
from rsrl.explanation import moment_from_state
from rsrl.explanation.state_file import parse_state, state_document
from rsrl.state import Observer
from rsrl.translators import simulated_state

LARGEST = 1e6
"""A race lasts under 1e4 s; what stands for none is 1e6 and 1e9."""

RACES = 6


def numbers(value: Any) -> Iterator[float]:
    """Every number in parsed JSON or a NumPy array."""
    if isinstance(value, dict):
        for part in value.values():
            yield from numbers(part)
    elif isinstance(value, list | tuple):
        for part in value:
            yield from numbers(part)
    elif isinstance(value, np.ndarray | np.generic):
        yield from np.asarray(value, np.float64).ravel().tolist()
    elif isinstance(value, int | float):
        yield float(value)


def test_states_of_whole_races_have_no_sentinels_and_read_back_to_the_same_bits() -> None:
    record = synthetic_race(cars=20, retire_per_lap=0.02)
    led = retired = 0
    for car in (0, 12):
        environment = RaceEnvironment(record, car, batch=RACES)
        observer = Observer(record, car)
        environment.reset(5, np.arange(RACES, dtype=np.int64))
        rng = np.random.default_rng(car)
        while not environment.done.all():
            for row in np.flatnonzero(~environment.done):
                state = simulated_state(record, environment.races, int(row), car)
                document = json.loads(json.dumps(state_document(state)))
                assert max(map(abs, numbers(document))) < LARGEST
                assert [c["gap_to_leader_s"] is None for c in document["cars"]] == [not c["running"] for c in document["cars"]]
                read = parse_state(document, "state")
                assert read == state
                assert np.array_equal(observer.row(read).view(np.int32), environment.raw[row].view(np.int32))
                moment = moment_from_state(record, car, read)
                assert np.array_equal(moment.raw[-1].view(np.int32), environment.raw[row].view(np.int32))
                led += document["previous_gap_ahead_s"] is None
                retired += any(not c["running"] for c in document["cars"])
            choice = np.where(environment.legal, rng.random((RACES, 4)), -1.0)
            choice[:, 0] += np.where(environment.legal[:, 0] & (rng.random(RACES) < 5 / 6), 2.0, 0.0)
            environment.step(choice.argmax(axis=1).astype(np.int8))
    assert led > 10
    assert retired > 10


def test_the_environments_tell_no_sentinels() -> None:
    made = gymnasium.make("rsrl/Race-v0", race="bahrain-2023", driver="VER")
    seen, info = made.reset(seed=1)
    over = False
    while not over:
        seen, reward, over, _, info = made.step(int(np.flatnonzero(info["action_mask"])[0]))
        assert max(map(abs, numbers([seen, info, float(reward)]))) < LARGEST


def test_the_explanation_of_a_leader_has_no_sentinels(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    methods = ["--method", "what-if,attribution,summary", "--races", "32"]
    led = ["explain", "--race", "bahrain-2023", "--driver", "VER", "--lap", "6", "--race-number", "2", *methods]
    assert main([*led, "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert next(car for car in document["state"]["cars"] if car["driver"] == "VER")["position"] == 1
    assert document["state"]["previous_gap_ahead_s"] is None
    assert max(map(abs, numbers(document | {"seed": 0}))) < LARGEST
    assert main(led) == 0
    text = capsys.readouterr().out
    assert "1000000" not in text.replace(",", "")
    standard_input = io.TextIOWrapper(io.BytesIO(json.dumps(document["state"]).encode("utf-8-sig")))
    monkeypatch.setattr("sys.stdin", standard_input)
    assert main(["explain", "--state", "-", "--method", "attribution", "--json"]) == 0
    again = json.loads(capsys.readouterr().out)
    assert again["state"] == document["state"]
    for name, value in document["decision"]["q_values"].items():
        assert again["decision"]["q_values"][name] == pytest.approx(value, abs=1e-3)
