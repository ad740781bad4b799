"""A trained policy that looks ahead while a safety car is out: what its network thinks of the calls, and what the race run on says of them.

Laps behind a safety car are few, so a network has seen few of them, and much hangs on each. There the race is run on with every call that
may be right, in futures drawn from what a pit wall knows (`rollouts`), the network calling the laps after; both sources count by how far
off each is known to be. On all other laps the network calls alone: there it is as good as some hundred futures.
"""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rsrl.agents import NetworkAgent
from rsrl.environment import RaceEnvironment
from rsrl.environment.compiled_policy import compiled_policy
from rsrl.errors import RsrlError
from rsrl.season import GREEN, RaceRecord
from rsrl.simulator import available_cores, compile_figures
from rsrl.simulator import layout as at
from rsrl.state import REGAINED, Encoder, Observer, expectation_table
from rsrl.strategists.belief import belief_of
from rsrl.strategists.interface import Strategist
from rsrl.strategists.luck import word_of
from rsrl.strategists.rollouts import Rollouts

LUCK: Final = 0x5EEC
"""Sets a search's futures apart from the races it calls."""

TASKS_PER_CORE: Final = 4


@dataclass(frozen=True)
class SearchSettings:
    """How a searching policy weighs its network against the race run on; places, between two calls under a safety car.

    Attributes:
        network_sd: how far off the network is.
        future_sd: how far one future is off the mean of many.
        reach: a call worse by more of `network_sd` is out of the question.
        clear: standard errors by which a call is ahead for good.
        round: futures at a time.
        most: futures of a decision at most.
    """

    network_sd: float = 0.25
    future_sd: float = 1.8
    reach: float = 2.5
    clear: float = 2.5
    round: int = 32
    most: int = 64


class SearchingPolicy(Strategist):
    """Calls with a trained agent and, behind a safety car, with futures too.

    Attributes:
        futures: int64 [B], futures of the last decision.

    Raises:
        RsrlError: the agent's network is not one that runs inside the compiled race.
    """

    def __init__(
        self, agent: NetworkAgent, record: RaceRecord, car: int, seed: int, settings: SearchSettings | None = None, *, name: str = "search"
    ) -> None:
        if agent.network.name != "duelling":
            raise RsrlError(f"{name}: a {agent.kind} network does not run inside the compiled race; search with a policy of `rsrl train`")
        self.name, self._agent, self._car, self._own_seed = name, agent, car, seed
        self.settings = settings or SearchSettings()
        self._encoder = Encoder(agent.feature_set, record.scaling)
        self._figures, self._known = compile_figures(record), Observer(record, car).known
        self._policy, self._expectation = compiled_policy(agent.params), expectation_table(self._figures, car, regained=REGAINED)

    def begin(self, environment: RaceEnvironment, seed: int, races: NDArray[np.int64]) -> None:
        """Remember which races these are."""
        self._seed, self._races = seed, races
        self.futures = np.zeros(len(races), np.int64)

    def decide(self, environment: RaceEnvironment) -> NDArray[np.int8]:
        """The network's call; behind a safety car that of the best mean of network and futures."""
        features = self._encoder(environment.raw)
        q = np.where(environment.legal, self._agent.q_values(features, self._agent.initial_memory(len(features)))[0], -np.inf)
        calls = q.argmax(axis=1).astype(np.int8)
        self.futures[:] = 0
        slow = ~environment.done & (environment.races.r[:, at.R_STATUS] != GREEN)
        close = q >= (q.max(axis=1) - self.settings.reach * self.settings.network_sd)[:, None]
        rows = np.flatnonzero(slow & (close.sum(axis=1) > 1))

        def search_some(part: NDArray[np.int64]) -> None:
            rollouts = Rollouts(self._figures, self._car, self._policy, self._known, self._encoder, self._expectation)
            for i in part:
                calls[i] = self._search(environment, int(i), q[i], np.flatnonzero(close[i]), rollouts)

        if len(rows) == 1:
            search_some(rows)
        elif len(rows):
            with ThreadPoolExecutor(available_cores()) as pool:
                list(pool.map(search_some, np.array_split(rows, min(len(rows), TASKS_PER_CORE * available_cores()))))
        return calls

    def _search(self, environment: RaceEnvironment, i: int, q: NDArray[np.float32], calls: NDArray[np.int64], rollouts: Rollouts) -> int:
        s, b = self.settings, environment.races
        belief = belief_of(self._figures, b.f[i])
        seed = word_of(LUCK, self._own_seed, self._seed, int(self._races[i]), int(b.r[i, at.R_LAP]))
        weight = (s.future_sd / s.network_sd) ** 2  # the network's, in futures
        prior = q[calls].mean(dtype=np.float64) - q[calls]
        total, done = np.zeros(len(calls)), 0
        while True:
            places = rollouts.run((b.f[i], b.k[i], b.r[i]), belief, calls, seed=seed, first=done, futures=s.round)
            total += (places - places.mean(axis=1, keepdims=True)).sum(axis=0, dtype=np.float64)
            done += s.round
            mean = (total + weight * prior) / (done + weight)
            second = np.partition(mean, 1)[1]
            if done >= s.most or second - mean.min() > s.clear * s.future_sd / np.sqrt(done + weight):
                self.futures[i] = done
                return int(calls[mean.argmin()])
