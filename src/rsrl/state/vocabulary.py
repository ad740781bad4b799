"""What a strategist can say each lap."""

from enum import IntEnum

from rsrl.season import COMPOUND_NAMES, COMPOUNDS


class Action(IntEnum):
    """The paper's four actions; box actions fit the compound at the end of the lap."""

    NO_PIT = 0
    PIT_SOFT = 1
    PIT_MEDIUM = 2
    PIT_HARD = 3

    @property
    def compound(self) -> str | None:
        """Letter of the compound boxed for, None for staying out."""
        return COMPOUNDS[self - 1] if self else None

    def __str__(self) -> str:
        return f"box for {COMPOUND_NAMES[self - 1]}" if self else "stay out"


ACTION_NAMES = tuple(a.name.lower().replace("_", " ") for a in Action)
