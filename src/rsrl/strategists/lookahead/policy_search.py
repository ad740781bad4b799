"""A trained policy with lookahead: where the network's best two calls are close, both are simulated to the flag.

Between close calls the network's estimate is off by a tenth of a place on green laps, and by several tenths behind a safety car, of which
training has few laps. So every call that may be the best is rolled out in futures drawn from what a pit wall knows (`rollouts.policy`), the
network making the later calls, for as long as further futures are worth their time (`value_of_information`). Most decisions are clear and
need no future at all.
"""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rsrl.agents import NetworkAgent
from rsrl.environment import RaceEnvironment
from rsrl.errors import RsrlError
from rsrl.rollouts import PaceFilter, PolicyRollouts, compiled_network
from rsrl.rollouts.hashing import stream_seed
from rsrl.season import GREEN, RaceRecord
from rsrl.simulator import available_cores, compile_figures
from rsrl.simulator import layout as at
from rsrl.state import Encoder, Observer
from rsrl.strategists.interface import Strategist
from rsrl.strategists.lookahead.value_of_information import ErrorModel, choose_call

SEED_SALT: Final = 0x5EEC
"""Keeps the random numbers of the search's futures apart from those of the races it calls."""

TASKS_PER_CORE: Final = 4

GREEN_ERRORS: Final = ErrorModel(network_sd=0.15, future_sd=1.0)
CAUTION_ERRORS: Final = ErrorModel(network_sd=0.4, future_sd=1.5)
"""On a green lap, and behind a safety car or virtual safety car; rounded from Bahrain, Singapore and Japan 2023 (docs/learning.md)."""


@dataclass(frozen=True)
class SearchSettings:
    """How network and rollouts are weighed, and when sampling stops.

    Attributes:
        green, caution: errors of network and rollouts on a green lap, and behind a safety car or virtual safety car.
        min_value: places; a call is simulated further only while that is expected to gain more.
        batch: futures simulated between two decisions to stop.
        max_futures: limit for one decision.
    """

    green: ErrorModel = GREEN_ERRORS
    caution: ErrorModel = CAUTION_ERRORS
    min_value: float = 0.002
    batch: int = 64
    max_futures: int = 512


class PolicySearchStrategist(Strategist):
    """Calls with a trained agent and, where its call is not clear, with rollouts as well.

    Attributes:
        futures: int64 [B], futures simulated for the last decision.

    Raises:
        RsrlError: the agent's network has no compiled form.
    """

    def __init__(
        self, agent: NetworkAgent, record: RaceRecord, car: int, seed: int, settings: SearchSettings | None = None, *, name: str = "search"
    ) -> None:
        if agent.network.name != "duelling":
            raise RsrlError(f"{name}: a {agent.kind} network has no compiled form to search with; give a policy of the agent rsrl")
        self.name, self._agent, self._car, self._own_seed = name, agent, car, seed
        self.settings = settings or SearchSettings()
        self._encoder = Encoder(agent.feature_set, record.scaling)
        self._figures, self._context = compile_figures(record), Observer(record, car).context
        self._network = compiled_network(agent.params)

    def begin(self, environment: RaceEnvironment, seed: int, races: NDArray[np.int64]) -> None:
        """Start these races with no knowledge of the cars' form."""
        self._seed, self._races = seed, races
        self._pace_filter = PaceFilter(self._figures, len(races))
        self.futures = np.zeros(len(races), np.int64)

    def rollouts(self) -> PolicyRollouts:
        """A simulator of the rest of this car's races under the network; one for each running thread."""
        return PolicyRollouts(self._figures, self._car, self._network, self._context, self._encoder)

    def decide(self, environment: RaceEnvironment) -> NDArray[np.int8]:
        """The best call by network and rollouts together; the network's own where it is clear."""
        b = environment.races
        self._pace_filter.update(b.f, b.k, b.r)
        features = self._encoder(environment.raw)
        q = self._agent.q_values(features, self._agent.initial_memory(len(features)))[0]
        calls = np.where(environment.legal, q, -np.inf).argmax(axis=1).astype(np.int8)
        self.futures[:] = 0
        rows = np.flatnonzero(~environment.done & (environment.legal.sum(axis=1) > 1))

        def search_some(part: NDArray[np.int64]) -> None:
            rollouts = self.rollouts()
            for i in part:
                calls[i], self.futures[i] = self._search(environment, int(i), q[i], rollouts)

        if len(rows) == 1:
            search_some(rows)
        elif len(rows):
            with ThreadPoolExecutor(available_cores()) as pool:
                list(pool.map(search_some, np.array_split(rows, min(len(rows), TASKS_PER_CORE * available_cores()))))
        return calls

    def _search(self, environment: RaceEnvironment, i: int, q: NDArray[np.float32], rollouts: PolicyRollouts) -> tuple[int, int]:
        """Call of race `i` and the futures it took; a pure function of the race's state, its number and the seeds."""
        s, b = self.settings, environment.races
        seed = stream_seed(SEED_SALT, self._own_seed, self._seed, int(self._races[i]), int(b.r[i, at.R_LAP]))
        belief = self._pace_filter.belief[i]

        def simulate(calls: NDArray[np.int64], first: int, futures: int) -> NDArray[np.float32]:
            return rollouts.run((b.f[i], b.k[i], b.r[i]), belief, calls, seed=seed, first=first, futures=futures)

        errors = s.green if b.r[i, at.R_STATUS] == GREEN else s.caution
        return choose_call(q, environment.legal[i], simulate, errors, min_value=s.min_value, batch=s.batch, max_futures=s.max_futures)
