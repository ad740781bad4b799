"""A trained policy that looks ahead: what its network thinks of the calls, and what the race run on says of them.

A network is off by a tenth of a place between close calls on racing laps, and by several behind a safety car, laps it has seen few of. So
the race is run on with every call that may be right, in futures drawn from what a pit wall knows (`rollouts`), the network calling the laps
after, for as long as that is worth it (`deliberation`). Most laps are clear, and take no future at all.
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
from rsrl.season import GREEN, RaceRecord
from rsrl.simulator import available_cores, compile_figures
from rsrl.simulator import layout as at
from rsrl.state import Encoder, Observer
from rsrl.strategists.hashing import word_of
from rsrl.strategists.interface import Strategist
from rsrl.strategists.lookahead.value_of_information import Doubt, deliberate

LUCK: Final = 0x5EEC
"""Sets a search's futures apart from the races it calls."""

TASKS_PER_CORE: Final = 4


RACING: Final = Doubt(network_sd=0.15, future_sd=1.0)
SLOW: Final = Doubt(network_sd=0.4, future_sd=1.5)
"""On a racing lap, and behind a safety car or a virtual one; about as measured at Bahrain, Singapore and Japan 2023 (docs/learning.md)."""


@dataclass(frozen=True)
class SearchSettings:
    """How a searching policy weighs its network against the race run on, and how long it thinks.

    Attributes:
        racing, slow: how far off network and futures are on a racing lap, and behind a safety car or virtual one.
        worth: places that looking into a call must be expected to win.
        round, most: futures at a time, and of a decision at most.
    """

    racing: Doubt = RACING
    slow: Doubt = SLOW
    worth: float = 0.002
    round: int = 64
    most: int = 512


class SearchingPolicy(Strategist):
    """Calls with a trained agent and, where the call is not clear, with futures too.

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
        self._figures, self._context = compile_figures(record), Observer(record, car).context
        self._network = compiled_network(agent.params)

    def begin(self, environment: RaceEnvironment, seed: int, races: NDArray[np.int64]) -> None:
        """Remember which races these are, and know nothing of their cars' form."""
        self._seed, self._races = seed, races
        self._watch = PaceFilter(self._figures, len(races))
        self.futures = np.zeros(len(races), np.int64)

    def rollouts(self) -> PolicyRollouts:
        """What runs this car's races on with the network; one a running thread."""
        return PolicyRollouts(self._figures, self._car, self._network, self._context, self._encoder)

    def decide(self, environment: RaceEnvironment) -> NDArray[np.int8]:
        """The best call by network and futures together; where the network is clear, its own."""
        b = environment.races
        self._watch.update(b.f, b.k, b.r)
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
        """Call and futures of race `i`, a pure function of its state, its number and the seeds."""
        s, b = self.settings, environment.races
        seed = word_of(LUCK, self._own_seed, self._seed, int(self._races[i]), int(b.r[i, at.R_LAP]))
        belief = self._watch.belief[i]

        def run(calls: NDArray[np.int64], first: int, futures: int) -> NDArray[np.float32]:
            return rollouts.run((b.f[i], b.k[i], b.r[i]), belief, calls, seed=seed, first=first, futures=futures)

        doubt = s.racing if b.r[i, at.R_STATUS] == GREEN else s.slow
        return deliberate(q, environment.legal[i], run, doubt, worth=s.worth, step=s.round, most=s.most)
