"""A policy that calls one car of one race from states, as a feed delivers them."""

from collections.abc import Sequence
from typing import NamedTuple

from rsrl.explanation import AnyPolicy, ExplainedPolicy, Moment, moment_from_state
from rsrl.season import RaceRecord
from rsrl.state import ACTION_NAMES, Action, Observer, UnifiedRaceState, UnifiedRaceStrategy


class Called(NamedTuple):
    """A call and the calls that the rules allowed."""

    strategy: UnifiedRaceStrategy
    legal: tuple[str, ...]


class StateCaller:
    """Calls of a policy for a car; what a race and car have in common is prepared once.

    Args:
        car: index in the record.
    """

    def __init__(self, policy: AnyPolicy, record: RaceRecord, car: int) -> None:
        self.policy, self.record, self.car = policy, record, car
        self._observer = Observer(record, car)
        self._remembers = isinstance(policy, ExplainedPolicy) and policy.recurrent

    def moment(self, state: UnifiedRaceState, history: Sequence[UnifiedRaceState]) -> Moment:
        """The decision that a state asks for; `history` as of `moment_from_state`. Raises RsrlError for an impossible state."""
        return moment_from_state(self.record, self.car, state, history, observer=self._observer)

    def call(self, state: UnifiedRaceState, history: Sequence[UnifiedRaceState] = ()) -> Called:
        """The policy's call, with its values where it has them.

        Args:
            history: states of the laps before, one a lap; only a policy with a memory reads them.

        Raises:
            RsrlError: the state is impossible; the message names the field.
        """
        moment = self.moment(state, history if self._remembers else ())
        legal = tuple(name for name, allowed in zip(ACTION_NAMES, moment.legal, strict=True) if allowed)
        if not isinstance(self.policy, ExplainedPolicy):
            return Called(UnifiedRaceStrategy(Action(self.policy.call(moment))), legal)
        q = self.policy.q(moment)
        call = int(self.policy.chosen(q[None], moment.legal[None])[0])
        values = {name: float(value) for name, value in zip(ACTION_NAMES, q, strict=True)}
        return Called(UnifiedRaceStrategy(Action(call), values), legal)
