"""What all messages of the pit wall have in common: strict types, a version, and marks that say where a figure is from.

Times are in seconds, laps count from 1, gaps are None where there is none. Every figure of a message is marked: `marks` gives the origin of
a field by its path, such as `tower.sets_left`; a row has `marks` of its own where one of its figures is from elsewhere.
"""

from typing import Annotated, Final, Literal

from pydantic import BaseModel, ConfigDict, Field

VERSION: Final = 1
"""Of all messages. A page that knows another version asks for a reload."""

Mark = Literal["measured", "derived", "assumed"]
"""Where a figure is from: stated by the source (a simulated race states all it shows), worked out, or taken for want of either."""

Marks = dict[str, Mark]

Status = Literal["green", "vsc", "sc", "red"]
STATUSES: Final[tuple[Status, ...]] = ("green", "vsc", "sc", "red")
"""By the codes of `rsrl.season`."""

Call = Literal["stay", "soft", "medium", "hard"]
CALLS: Final[tuple[Call, ...]] = ("stay", "soft", "medium", "hard")
"""By the codes of `rsrl.state.Action`: stay out, or box for a compound."""

Driver = Annotated[str, Field(min_length=1, max_length=8)]


class Strict(BaseModel):
    """Strict, frozen, and without unknown fields."""

    model_config = ConfigDict(strict=True, extra="forbid", frozen=True, allow_inf_nan=False)


class Message(Strict):
    """A message in either direction; each kind has its own `type`."""

    version: Literal[1] = VERSION


class Interval(Strict):
    """A mean with its 95 % interval."""

    mean: float
    low: float
    high: float
