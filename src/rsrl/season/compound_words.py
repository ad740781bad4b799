"""What people call a compound: S, soft, or its C-number in a race."""

from collections.abc import Mapping

from rsrl.season.records import TyreFigures
from rsrl.season.vocabulary import COMPOUND_NAMES, COMPOUNDS


def read_compound(word: str, tyres: Mapping[str, TyreFigures] | None = None) -> str | None:
    """Letter of a compound by letter, colour or C-number, in any case; None where the word names none.

    Args:
        tyres: of the race, which say what its C-numbers are; without them C-numbers name no compound.
    """
    word = word.strip().upper()
    names = {name.upper(): letter for letter, name in zip(COMPOUNDS, COMPOUND_NAMES, strict=True)}
    numbers = {tyre.c_number.upper(): letter for letter, tyre in (tyres or {}).items()}
    return word if word in COMPOUNDS else names.get(word) or numbers.get(word)


def c_numbers(tyres: Mapping[str, TyreFigures]) -> str:
    """The C-numbers of a race in words: `S is C3, M is C2, H is C1`."""
    return ", ".join(f"{letter} is {tyres[letter].c_number}" for letter in COMPOUNDS)
