"""The strategist `search`: network and rollouts together, sampled while it pays; blind to hidden state, the same in any batch."""

import numpy as np
import pytest
from synthetic_race import synthetic_race
from test_strategists_interface import random_agent
from test_strategists_planner import scramble_hidden

from rsrl.environment import RaceEnvironment
from rsrl.errors import RsrlError
from rsrl.season import GREEN, RaceRecord
from rsrl.simulator import layout as at
from rsrl.strategists import PolicySearchStrategist, PolicyStrategist, SearchSettings
from rsrl.strategists.lookahead.value_of_information import ErrorModel, choose_call, value_of_sampling

CAR = 9
UNSURE = ErrorModel(network_sd=5.0, future_sd=1.5)
LEVEL = SearchSettings(green=UNSURE, caution=UNSURE, max_futures=64)  # a network so unsure that futures decide


def slow_race() -> RaceRecord:
    """A race with many safety cars."""
    return synthetic_race(laps=20, sc_per_lap=0.15, vsc_per_lap=0.1, stint_sd_s=0.15)


def played(
    strategist: PolicySearchStrategist | PolicyStrategist, races: list[int], scramble: bool = False
) -> tuple[np.ndarray, np.ndarray]:
    """Calls int8 [races, laps] and whether each lap was slow."""
    environment = RaceEnvironment(slow_race(), CAR, batch=len(races))
    numbers = np.array(races, np.int64)
    environment.reset(4, numbers)
    strategist.begin(environment, 4, numbers)
    calls, slow = np.zeros((len(races), environment.laps), np.int8), np.zeros((len(races), environment.laps), np.bool_)
    b = environment.races
    for lap in range(environment.laps):
        slow[:, lap] = (b.r[:, at.R_STATUS] != GREEN) & ~environment.done
        kept = [part.copy() for part in (b.f, b.k, b.r)]
        if scramble:
            scramble_hidden(b.f, b.k, b.r, lap)
        calls[:, lap] = np.where(environment.done, 0, strategist.decide(environment))
        for part, before in zip((b.f, b.k, b.r), kept, strict=True):
            part[:] = before
        environment.step(calls[:, lap])
    return calls, slow


def test_a_network_that_is_sure_is_not_overruled() -> None:
    record, agent = slow_race(), random_agent()
    certain = ErrorModel(network_sd=1e-9, future_sd=1.5)
    racing, slow = played(
        PolicySearchStrategist(agent, record, CAR, 0, SearchSettings(green=certain, caution=UNSURE, max_futures=64)), list(range(24))
    )
    alone, _ = played(PolicyStrategist(agent, record), list(range(24)))
    before = np.cumsum(slow, axis=1) == 0
    assert before.any()
    assert (racing[before] == alone[before]).all(), "until the first slow lap the network calls"
    assert (racing != alone).any()
    searching = PolicySearchStrategist(agent, record, CAR, 0, SearchSettings(green=certain, caution=certain))
    assert (played(searching, [0, 1, 2, 3])[0] == alone[:4]).all()
    assert (searching.futures == 0).all()


def test_it_sees_nothing_hidden_and_is_the_same_in_any_batch() -> None:
    record, agent = slow_race(), random_agent()
    whole, _ = played(PolicySearchStrategist(agent, record, CAR, 0, LEVEL), [3, 5, 8])
    assert (played(PolicySearchStrategist(agent, record, CAR, 0, LEVEL), [3, 5, 8], scramble=True)[0] == whole).all()
    assert (played(PolicySearchStrategist(agent, record, CAR, 0, LEVEL), [5])[0] == whole[1:2]).all()


def test_a_network_that_does_not_run_in_the_race_is_refused() -> None:
    with pytest.raises(RsrlError, match="has no compiled form to search with"):
        PolicySearchStrategist(random_agent("drqn"), slow_race(), CAR, 0)


def test_value_of_sampling_is_the_mean_of_what_is_won() -> None:
    rng = np.random.default_rng(0)
    for behind, sd in ((0.0, 0.1), (0.1, 0.1), (0.3, 0.1)):
        won = np.maximum(rng.normal(-behind, sd, 400_000), 0.0).mean()
        assert value_of_sampling(behind, sd) == pytest.approx(won, abs=4 * sd / np.sqrt(400_000))
    assert value_of_sampling(0.1, 0.0) == 0.0


def chosen(
    truth: list[float], q: list[float], seed: int, *, network_sd: float = 0.2, min_value: float = 1e-4
) -> tuple[int, int, list[int]]:
    """Call, futures, and how many calls each round ran, of a decision whose true places are known."""
    rng, rounds = np.random.default_rng(seed), []

    def run(calls: np.ndarray, first: int, futures: int) -> np.ndarray:
        rounds.append(len(calls))
        return (np.array(truth)[calls] + rng.normal(0, 1, (futures, len(calls)))).astype(np.float32)

    errors = ErrorModel(network_sd=network_sd, future_sd=1.4)
    call, futures = choose_call(
        np.array(q, np.float32), np.array([1, 1, 0, 1], np.bool_), run, errors, min_value=min_value, batch=64, max_futures=4096
    )
    return call, futures, rounds


def test_futures_put_a_network_right_and_stop_when_it_is_clear() -> None:
    right = [chosen([5.0, 4.8, 0.0, 5.5], [-5.0, -5.1, 0.0, -5.4], seed) for seed in range(20)]
    assert np.mean([call == 1 for call, _, _ in right]) > 0.9
    assert all(rounds[0] == 3 and rounds[-1] < 3 for _, _, rounds in right), "what is clearly worse is dropped on the way"
    close = np.mean([chosen([5.0, 5.0, 0.0, 9.0], [-5.0, -5.0, 0.0, -9.0], seed)[1] for seed in range(20)])
    clear = np.mean([chosen([5.0, 4.0, 0.0, 9.0], [-5.0, -5.0, 0.0, -9.0], seed)[1] for seed in range(20)])
    assert clear < close / 4, "what is soon clear takes few futures"
    assert chosen([5.0, 4.0, 0.0, 9.0], [-5.0, -8.0, 0.0, -9.0], 0)[1:] == (0, []), "a network that is clear is not looked into"


def test_it_wins_what_its_error_model_says() -> None:
    """Truth drawn about the network as `ErrorModel` has it: sampling gains nearly all there is, and stops sooner at a higher threshold."""
    rng = np.random.default_rng(1)
    won, least, most = [], [], []
    for seed in range(150):
        truth = [5.0, 5.0 + rng.normal(0.05, 0.2), 0.0, 9.0]
        q = [-5.0, -5.05, 0.0, -9.0]
        call, futures, _ = chosen(truth, q, seed)
        quick = chosen(truth, q, seed, min_value=0.02)[1]
        won.append(truth[0] - truth[call])
        least.append(truth[0] - min(truth[0], truth[1]))
        most.append((futures, quick))
    assert np.mean(won) > 0.8 * np.mean(least) > 0.03
    assert np.mean([quick for _, quick in most]) < np.mean([futures for futures, _ in most]) / 3
