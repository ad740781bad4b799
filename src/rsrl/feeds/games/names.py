"""Who is in which slot of a game's packets: car numbers and driver codes."""

from collections.abc import Iterator

import numpy as np

from rsrl.season.drivers import drivers_called

__all__ = ["CarNames"]

SLOT_NUMBERS_FROM = 100
"""Cars whose race number is missing or another's too, as in a lobby, go by their slot from here on."""


class CarNames:
    """Cars and drivers by slot.

    Attributes:
        cars: car numbers by slot; each number once.
        drivers: three-letter codes by slot: of the season's drivers by surname, else the first letters of the name.
    """

    def __init__(self) -> None:
        self.cars: dict[int, int] = {}
        self.drivers: dict[int, str] = {}

    def update(self, cars: np.ndarray, active: int, season: int) -> Iterator[tuple[int, str]]:
        """Take in a packet of participants; slots whose driver is new, with the code. A slot keeps its number for the session."""
        for slot in range(min(active, len(cars))):
            number, name = int(cars["race_number"][slot]), bytes(cars["name"][slot]).decode(errors="replace")
            if slot not in self.cars:
                free = number and number not in self.cars.values()
                self.cars[slot] = number if free else SLOT_NUMBERS_FROM + slot
            code = self._code(slot, name, season)
            if self.drivers.get(slot) != code:
                self.drivers[slot] = code
                yield slot, code

    def _code(self, slot: int, name: str, season: int) -> str:
        called = drivers_called(name, season) if len(name) > 2 else ()
        letters = "".join(letter for letter in name.upper() if letter.isascii() and letter.isalpha())
        code = called[0].code if len(called) == 1 else letters[:3] if len(letters) > 2 else f"C{slot:02}"
        taken = any(other == code for at, other in self.drivers.items() if at != slot)
        return f"C{slot:02}" if taken else code
