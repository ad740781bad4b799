"""What calls were worth: each call that anybody made on a lap, rolled out in the same simulated futures, the policy calling afterwards.

Of the value Q(s, a) of a call and V(s) of the policy's own, Q - V along the laps that a car drove sums to the difference between its team's
calls and the policy's over the race, in expectation (the performance difference lemma, Kakade & Langford 2002). It is measured in places,
on the same luck, which takes out what no call changes (as duplicate play does at cards).
"""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from rsrl import rollouts as out
from rsrl.explanation import AnyPolicy, Moment
from rsrl.explanation.what_if import Continuation
from rsrl.rollouts import Option
from rsrl.state import Observer


@dataclass
class CallWorth:
    """Sums over the laps of one car, in places; above zero is lost.

    Attributes:
        against_policy: what each caller's calls lost against the policy's, by name.
        regret: what they lost against the best call that anybody made on the lap, chosen on one half of the futures and valued on the
            other, so that luck does not choose it.
        laps: on which callers differed.
    """

    against_policy: dict[str, float] = field(default_factory=dict)
    regret: dict[str, float] = field(default_factory=dict)
    laps: int = 0

    def add(self, places: NDArray[np.float64], calls: Mapping[str, int], tried: tuple[int, ...], own: int) -> None:
        """Add a lap: finishing places [futures, calls] after each of the calls tried, the call of each caller, and the policy's own."""
        self.laps += 1
        half = len(places) // 2
        means, first, second = places.mean(axis=0), places[:half].mean(axis=0), places[half:].mean(axis=0)
        best = (second[first.argmin()] * (len(places) - half) + first[second.argmin()] * half) / len(places)
        reference = float(means[tried.index(own)])
        for name, call in calls.items():
            mean = float(means[tried.index(call)])
            self.against_policy[name] = self.against_policy.get(name, 0.0) + mean - reference
            self.regret[name] = self.regret.get(name, 0.0) + mean - float(best)


def rolled_out(
    policy: AnyPolicy, moment: Moment, observer: Observer, calls: tuple[int, ...], futures: int, seed: int
) -> NDArray[np.float64]:
    """Finishing places after each of some calls, float64 [futures, calls], all in the same futures.

    Every lap of a car has futures of its own, so that errors do not add up over laps.
    """
    options = [Option(0, call) for call in calls]
    run = Continuation(policy, [moment], observer).run(options, futures, seed, first=moment.lap * futures, threads=1)
    return np.asarray(run[:, :, out.O_POSITION])
