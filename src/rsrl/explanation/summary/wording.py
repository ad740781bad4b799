"""Sentences that keep the source of each of their numbers."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rsrl.season import COMPOUND_NAMES, TRACK_STATUS_NAMES
from rsrl.state import COLUMN, NO_CAR_GAP_S

STATUS_WORDS: Final = dict(zip(TRACK_STATUS_NAMES, ("green flag", "virtual safety car", "safety car", "red flag"), strict=True))

SMALL: Final = 0.095
"""Smaller differences are written with three decimals."""

CALL_WORDS: Final = ("staying out", *(f"boxing for {name}" for name in COMPOUND_NAMES))
"""A call as the subject of a sentence."""


class Reference(NamedTuple):
    """Where a number of a sentence comes from.

    Attributes:
        shown: as written in the sentence.
        lap: the lap of the decision it belongs to.
        column: a feature (`state.FEATURES`), `q: <call>`, or the formula, such as `q: pit soft - q: no pit`.
        value: unrounded, natural units.
    """

    shown: str
    lap: int
    column: str
    value: float

    def document(self) -> dict[str, Any]:
        """In types that JSON has."""
        return self._asdict()


@dataclass(frozen=True)
class Sentence:
    """A sentence, and a reference for each number in it."""

    text: str
    references: tuple[Reference, ...]

    def document(self) -> dict[str, Any]:
        """In types that JSON has."""
        return {"text": self.text, "references": [reference.document() for reference in self.references]}


class SentenceBuilder:
    """Writes the numbers of one sentence and records their sources."""

    def __init__(self) -> None:
        self._references: list[Reference] = []

    def number(self, value: float, lap: int, column: str, form: str = ".2f") -> str:
        """A number as text."""
        shown = f"{value:{form}}"
        if not any(shown.strip("-+0.,")):  # a rounded zero has no sign
            shown = shown.lstrip("-+")
        self._references.append(Reference(shown, lap, column, float(value)))
        return shown

    def worth(self, value: float, lap: int, column: str) -> str:
        """A difference of action values: two decimals, three if it is small."""
        return self.number(value, lap, column, ".2f" if abs(value) >= SMALL else ".3f")

    def lap(self, lap: int) -> str:
        """The number of a lap."""
        return self.number(lap, lap, "lap", ".0f")

    def feature(self, row: NDArray[np.float32], lap: int, name: str, form: str = ".1f") -> str:
        """A feature of a raw row."""
        return self.number(float(row[COLUMN[name]]), lap, name, form)

    def sentence(self, text: str) -> Sentence:
        """The finished sentence, its first letter a capital."""
        return Sentence(text[:1].upper() + text[1:], tuple(self._references))


def feature(row: NDArray[np.float32], name: str) -> float:
    """A feature of a raw row in its natural unit."""
    return float(row[COLUMN[name]])


def compound(row: NDArray[np.float32]) -> str:
    """Name of the compound fitted."""
    return COMPOUND_NAMES[int(feature(row, "tyre"))]


def status(row: NDArray[np.float32]) -> str:
    """Track status in words; a red flag is shown to a policy as a safety car."""
    return STATUS_WORDS[TRACK_STATUS_NAMES[int(feature(row, "safety_car"))]]


def has_car(gap_s: float) -> bool:
    """Whether there is a car at the end of a gap."""
    return gap_s < NO_CAR_GAP_S


def many(count: str, word: str) -> str:
    """`1 car`, `2 cars`."""
    return f"{count} {word}{'' if count == '1' else 's'}"


def documents(sentences: list[Sentence]) -> list[Mapping[str, Any]]:
    """Sentences in types that JSON has."""
    return [sentence.document() for sentence in sentences]
