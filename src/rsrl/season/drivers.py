"""Drivers of 2022-2025 by code, surname and car number: season files hold codes alone."""

import re
import unicodedata
from collections.abc import Sequence
from typing import Final, NamedTuple


class Driver(NamedTuple):
    """A driver; `numbers` are all the car numbers driven with in 2022-2025, the champion's 1 apart."""

    code: str
    given: str
    surname: str
    numbers: tuple[int, ...]


DRIVERS: Final = (
    Driver("ALB", "Alexander", "Albon", (23,)),
    Driver("ALO", "Fernando", "Alonso", (14,)),
    Driver("ANT", "Kimi", "Antonelli", (12,)),
    Driver("BEA", "Oliver", "Bearman", (38, 50, 87)),
    Driver("BOR", "Gabriel", "Bortoleto", (5,)),
    Driver("BOT", "Valtteri", "Bottas", (77,)),
    Driver("COL", "Franco", "Colapinto", (43,)),
    Driver("DEV", "Nyck", "de Vries", (21, 45)),
    Driver("DOO", "Jack", "Doohan", (7, 61)),
    Driver("GAS", "Pierre", "Gasly", (10,)),
    Driver("HAD", "Isack", "Hadjar", (6,)),
    Driver("HAM", "Lewis", "Hamilton", (44,)),
    Driver("HUL", "Nico", "Hülkenberg", (27,)),
    Driver("LAT", "Nicholas", "Latifi", (6,)),
    Driver("LAW", "Liam", "Lawson", (30, 40)),
    Driver("LEC", "Charles", "Leclerc", (16,)),
    Driver("MAG", "Kevin", "Magnussen", (20,)),
    Driver("MSC", "Mick", "Schumacher", (47,)),
    Driver("NOR", "Lando", "Norris", (4,)),
    Driver("OCO", "Esteban", "Ocon", (31,)),
    Driver("PER", "Sergio", "Pérez", (11,)),
    Driver("PIA", "Oscar", "Piastri", (81,)),
    Driver("RIC", "Daniel", "Ricciardo", (3,)),
    Driver("RUS", "George", "Russell", (63,)),
    Driver("SAI", "Carlos", "Sainz", (55,)),
    Driver("SAR", "Logan", "Sargeant", (2,)),
    Driver("STR", "Lance", "Stroll", (18,)),
    Driver("TSU", "Yuki", "Tsunoda", (22,)),
    Driver("VER", "Max", "Verstappen", (33,)),
    Driver("VET", "Sebastian", "Vettel", (5,)),
    Driver("ZHO", "Guanyu", "Zhou", (24,)),
)

CHAMPION_WITH_1: Final = {2022: "VER", 2023: "VER", 2024: "VER", 2025: "VER"}
"""Who drives with the number 1, the last season's champion, by season."""


def drivers_called(text: str, season: int) -> tuple[Driver, ...]:
    """Drivers that a text may mean: a code, a car number such as `44` or `#44`, a surname or a whole name, with or without accents."""
    number = re.fullmatch(r"#?(\d{1,2})", text.strip())
    if number:
        champion = CHAMPION_WITH_1.get(season) if int(number[1]) == 1 else None
        return tuple(driver for driver in DRIVERS if int(number[1]) in driver.numbers or driver.code == champion)
    name = _letters(text)
    return tuple(driver for driver in DRIVERS if name in _names_of(driver))


def codes_called(text: str, started: Sequence[str], season: int) -> tuple[str, ...]:
    """Codes among those that started in a race which a text may mean; a code of the race itself goes before anything else."""
    code = text.strip().upper()
    if code in started:
        return (code,)
    return tuple(driver.code for driver in drivers_called(text, season) if driver.code in started)


def _names_of(driver: Driver) -> set[str]:
    given, surname = _letters(driver.given), _letters(driver.surname)
    return {driver.code.casefold(), surname, given + surname, surname + given}


def _letters(text: str) -> str:
    """The letters of a text in lower case, without accents, spaces and signs."""
    return "".join(c for c in unicodedata.normalize("NFKD", text.casefold()) if c.isalpha())
