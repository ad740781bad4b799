"""The interface of a source of races (the paper's translator layer): a policy works with any source that has it."""

from typing import Protocol

from rsrl.state import UnifiedRaceState, UnifiedRaceStrategy


class Translator(Protocol):
    """One race of one car, decision by decision.

    The caller asks for the state, answers with a strategy, and asks again, until there is no state. A source that can
    carry out a call (a simulator, a game) does so; a recorded race ignores it and continues as it happened.
    """

    def state(self) -> UnifiedRaceState | None:
        """The race before the next decision; None after the flag or the car's retirement."""
        ...

    def apply(self, strategy: UnifiedRaceStrategy) -> None:
        """Carry out the call for the coming lap and advance to the next decision.

        Raises:
            RsrlError: there is nothing left to decide, or the source refuses the call.
        """
        ...
