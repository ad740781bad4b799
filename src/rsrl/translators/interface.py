"""What every source of races offers, so that a policy never knows where a race comes from (the paper's translator layer)."""

from typing import Protocol

from rsrl.state import UnifiedRaceState, UnifiedRaceStrategy


class Translator(Protocol):
    """One race of one car, seen decision by decision.

    A caller asks for the state, answers with a strategy, and asks again, until there is no state. A source that can
    carry a call out (a simulator, a game) does so; one that can only be watched (a recorded race) goes on as it was.
    """

    def state(self) -> UnifiedRaceState | None:
        """The race before the next decision; None where there is nothing left to decide: flag or retirement."""
        ...

    def apply(self, strategy: UnifiedRaceStrategy) -> None:
        """Carry out the call for the coming lap and go on to the next decision.

        Raises:
            RsrlError: there is nothing left to decide, or the source refuses the call.
        """
        ...
