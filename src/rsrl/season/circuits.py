"""Circuits and the Grands Prix held there: what lap files and people call them. The one table behind `race_resolver` and calibration.

A track is a circuit, not an event's name: figures of Barcelona come from Barcelona, whatever its race is called. Words are written without
accents; case, spaces and hyphens make no difference. A Grand Prix that is not in the table needs no code: its name is made from its
event's, and its circuit is the one that is named so, else one of its own.
"""

import re
import unicodedata
from functools import cache
from typing import Final, NamedTuple

from rsrl.season.vocabulary import GRAND_PRIX


class Circuit(NamedTuple):
    """A circuit: its name as people say it, where it is, and what else it is called."""

    name: str
    country: str
    town: str
    others: tuple[str, ...] = ()


class GrandPrix(NamedTuple):
    """A Grand Prix.

    Attributes:
        events: its names in lap files, the oldest first.
        venues: circuits with the first season of each; 1950 where it was the first one for as long as matters here.
        others: what else it is called, such as its country.
        extra: a second race at its circuit in one season, which the circuit's name alone does not mean.
    """

    events: tuple[str, ...]
    venues: tuple[tuple[int, str], ...]
    others: tuple[str, ...] = ()
    extra: bool = False


CIRCUITS: Final = {
    "albert_park": Circuit("Melbourne", "Australia", "Melbourne", ("Albert Park",)),
    "americas": Circuit("Circuit of the Americas", "United States", "Austin", ("COTA", "Texas", "Americas")),
    "bahrain": Circuit("Bahrain International Circuit", "Bahrain", "Sakhir"),
    "bahrain_outer": Circuit("Bahrain Outer Circuit", "Bahrain", "Sakhir"),
    "baku": Circuit("Baku", "Azerbaijan", "Baku", ("Baku City",)),
    "catalunya": Circuit("Barcelona", "Spain", "Montmelo", ("Catalunya", "Barcelona-Catalunya", "Catalonia")),
    "hockenheimring": Circuit("Hockenheim", "Germany", "Hockenheim", ("Hockenheimring",)),
    "hungaroring": Circuit("Hungaroring", "Hungary", "Mogyorod", ("Budapest",)),
    "imola": Circuit("Imola", "Italy", "Imola", ("Enzo e Dino Ferrari",)),
    "interlagos": Circuit("Interlagos", "Brazil", "Sao Paulo", ("Jose Carlos Pace",)),
    "istanbul": Circuit("Istanbul", "Turkey", "Istanbul", ("Istanbul Park",)),
    "jeddah": Circuit("Jeddah", "Saudi Arabia", "Jeddah", ("Jeddah Corniche",)),
    "losail": Circuit("Lusail", "Qatar", "Lusail", ("Losail",)),
    "madring": Circuit("Madring", "Spain", "Madrid", ("IFEMA",)),
    "marina_bay": Circuit("Marina Bay", "Singapore", "Singapore"),
    "miami": Circuit("Miami", "United States", "Miami Gardens", ("Florida",)),
    "monaco": Circuit("Monte Carlo", "Monaco", "Monte Carlo"),
    "monza": Circuit("Monza", "Italy", "Monza"),
    "mugello": Circuit("Mugello", "Italy", "Mugello"),
    "nurburgring": Circuit("Nürburgring", "Germany", "Nürburg"),
    "portimao": Circuit("Portimao", "Portugal", "Portimao", ("Algarve",)),
    "red_bull_ring": Circuit("Red Bull Ring", "Austria", "Spielberg"),
    "ricard": Circuit("Paul Ricard", "France", "Le Castellet"),
    "rodriguez": Circuit("Hermanos Rodriguez", "Mexico", "Mexico City", ("Ciudad de Mexico", "CDMX")),
    "sepang": Circuit("Sepang", "Malaysia", "Sepang"),
    "shanghai": Circuit("Shanghai", "China", "Shanghai"),
    "silverstone": Circuit("Silverstone", "Great Britain", "Silverstone"),
    "sochi": Circuit("Sochi", "Russia", "Sochi", ("Sochi Autodrom",)),
    "spa": Circuit("Spa-Francorchamps", "Belgium", "Spa", ("Francorchamps",)),
    "suzuka": Circuit("Suzuka", "Japan", "Suzuka"),
    "vegas": Circuit("Las Vegas Strip", "United States", "Las Vegas", ("Vegas", "Nevada")),
    "villeneuve": Circuit("Montreal", "Canada", "Montreal", ("Gilles Villeneuve",)),
    "yas_marina": Circuit("Yas Marina", "United Arab Emirates", "Yas Island"),
    "zandvoort": Circuit("Zandvoort", "Netherlands", "Zandvoort"),
}
"""Circuits by the name they have in the results tables (Ergast's `circuitRef`); two layouts raced apart are two circuits."""


def _at(circuit: str) -> tuple[tuple[int, str], ...]:
    return ((1950, circuit),)


GRANDS_PRIX: Final = {
    "abu-dhabi": GrandPrix(("Abu Dhabi Grand Prix",), _at("yas_marina"), ("UAE", "Emirates")),
    "australia": GrandPrix(("Australian Grand Prix",), _at("albert_park"), ("AUS",)),
    "austria": GrandPrix(("Austrian Grand Prix",), _at("red_bull_ring"), ("AUT",)),
    "azerbaijan": GrandPrix(("Azerbaijan Grand Prix",), _at("baku"), ("AZE",)),
    "bahrain": GrandPrix(("Bahrain Grand Prix",), _at("bahrain"), ("BHR", "BRN")),
    "barcelona": GrandPrix(
        ("Barcelona Grand Prix", "Barcelona-Catalunya Grand Prix", "Barcelona Catalunya Grand Prix"), ((2026, "catalunya"),)
    ),
    "belgium": GrandPrix(("Belgian Grand Prix",), _at("spa"), ("BEL",)),
    "brazil": GrandPrix(("Brazilian Grand Prix", "São Paulo Grand Prix"), _at("interlagos"), ("Brasil", "Brazilian", "BRA")),
    "canada": GrandPrix(("Canadian Grand Prix",), _at("villeneuve"), ("CAN",)),
    "china": GrandPrix(("Chinese Grand Prix",), _at("shanghai"), ("CHN",)),
    "eifel": GrandPrix(("Eifel Grand Prix",), _at("nurburgring")),
    "emilia-romagna": GrandPrix(("Emilia Romagna Grand Prix",), _at("imola"), ("Emilia", "San Marino")),
    "france": GrandPrix(("French Grand Prix",), _at("ricard"), ("FRA",)),
    "germany": GrandPrix(
        ("German Grand Prix",),
        ((1950, "hockenheimring"), (2011, "nurburgring"), (2012, "hockenheimring"), (2013, "nurburgring"), (2014, "hockenheimring")),
        ("Deutschland",),
    ),
    "great-britain": GrandPrix(
        ("British Grand Prix",), _at("silverstone"), ("UK", "GB", "GBR", "Britain", "United Kingdom", "England")
    ),
    "hungary": GrandPrix(("Hungarian Grand Prix",), _at("hungaroring"), ("HUN",)),
    "italy": GrandPrix(("Italian Grand Prix",), _at("monza"), ("Italia", "ITA")),
    "japan": GrandPrix(("Japanese Grand Prix",), _at("suzuka"), ("JPN",)),
    "las-vegas": GrandPrix(("Las Vegas Grand Prix",), _at("vegas")),
    "malaysia": GrandPrix(("Malaysian Grand Prix",), _at("sepang")),
    "mexico": GrandPrix(("Mexican Grand Prix", "Mexico City Grand Prix"), _at("rodriguez"), ("MEX",)),
    "miami": GrandPrix(("Miami Grand Prix",), _at("miami")),
    "monaco": GrandPrix(("Monaco Grand Prix",), _at("monaco"), ("MCO",)),
    "netherlands": GrandPrix(("Dutch Grand Prix",), _at("zandvoort"), ("Holland", "NED")),
    "portugal": GrandPrix(("Portuguese Grand Prix",), _at("portimao")),
    "qatar": GrandPrix(("Qatar Grand Prix",), _at("losail"), ("QAT",)),
    "russia": GrandPrix(("Russian Grand Prix",), _at("sochi")),
    "sakhir": GrandPrix(("Sakhir Grand Prix",), _at("bahrain_outer")),
    "saudi-arabia": GrandPrix(("Saudi Arabian Grand Prix",), _at("jeddah"), ("Saudi", "KSA")),
    "singapore": GrandPrix(("Singapore Grand Prix",), _at("marina_bay"), ("SGP",)),
    "spain": GrandPrix(("Spanish Grand Prix",), ((1950, "catalunya"), (2026, "madring")), ("Espana", "ESP")),
    "styria": GrandPrix(("Styrian Grand Prix",), _at("red_bull_ring"), extra=True),
    "turkey": GrandPrix(("Turkish Grand Prix",), _at("istanbul"), ("Turkiye",)),
    "tuscany": GrandPrix(("Tuscan Grand Prix",), _at("mugello"), ("Toscana",)),
    "united-states": GrandPrix(
        ("United States Grand Prix",), _at("americas"), ("US Grand Prix", "USGP", "American Grand Prix")
    ),
    "seventieth-anniversary": GrandPrix(("70th Anniversary Grand Prix",), _at("silverstone"), ("70th Anniversary",), extra=True),
}  # fmt: skip
"""Grands Prix by the first part of a race's name."""

_NO_NAME: Final = ("grand", "prix", "gp", "of", "the")
"""Words of an event that are no part of a race's name."""

_NAMED_IN: Final = 2024
"""Season in which the categories of `GRAND_PRIX` mean their tracks."""

SEVERAL: Final = dict.fromkeys(("US", "USA", "America", "American", "United States of America"), "United States")
"""Words that name a country with several Grands Prix and none of them in particular."""


def grand_prix_of(event: str) -> str:
    """First part of a race's name, from its event's name in a lap file: `spain` for the Spanish Grand Prix; any event has one."""
    known = _by_event().get(_letters(event))
    return known or "-".join(word for word in _words(event) if word not in _NO_NAME) or "unknown"


def circuit_of(grand_prix: str, season: int) -> str:
    """The circuit on which a Grand Prix is held in a season: a key of `CIRCUITS`, or for a circuit not in it the Grand Prix's own name."""
    if grand_prix in GRANDS_PRIX:
        venues = GRANDS_PRIX[grand_prix].venues
        return next((circuit for since, circuit in reversed(venues) if season >= since), venues[0][1])
    return _by_circuit().get(_letters(grand_prix), grand_prix)


def is_held(grand_prix: str, season: int) -> bool:
    """Whether the name was in use in a season, as far as the table knows: `barcelona` from 2026."""
    return grand_prix not in GRANDS_PRIX or season >= GRANDS_PRIX[grand_prix].venues[0][0]


def circuit_name(grand_prix: str, season: int) -> str:
    """The circuit of a Grand Prix as people say it."""
    circuit = circuit_of(grand_prix, season)
    return CIRCUITS[circuit].name if circuit in CIRCUITS else grand_prix


def country_of(grand_prix: str, season: int) -> str | None:
    """The country in which a Grand Prix is held; None where that is not known."""
    circuit = circuit_of(grand_prix, season)
    return CIRCUITS[circuit].country if circuit in CIRCUITS else None


def spoken_names(grand_prix: str, season: int) -> list[str]:
    """Whatever a Grand Prix is called in a season, its country left out unless it is named after it."""
    names = [grand_prix]
    if grand_prix in GRANDS_PRIX:
        names += [*GRANDS_PRIX[grand_prix].events, *GRANDS_PRIX[grand_prix].others]
        if GRANDS_PRIX[grand_prix].extra:
            return names
    circuit = CIRCUITS.get(circuit_of(grand_prix, season))
    return names if circuit is None else [*names, circuit.name, *_town(circuit), *circuit.others]


def track_code(grand_prix: str, season: int) -> int:
    """Code of a race's track in `GRAND_PRIX`, the categories of a policy that knows tracks by name; -1 for a track that is none of them."""
    circuit = circuit_of(grand_prix, season)
    named = [slug for slug in (grand_prix, *GRAND_PRIX) if slug in GRAND_PRIX and circuit_of(slug, _NAMED_IN) == circuit]
    return GRAND_PRIX.index(named[0]) if named else -1


def _town(circuit: Circuit) -> tuple[str, ...]:
    """The town, where it means one circuit only."""
    return (circuit.town,) if sum(other.town == circuit.town for other in CIRCUITS.values()) == 1 else ()


@cache
def _by_event() -> dict[str, str]:
    return {_letters(event): slug for slug, grand_prix in GRANDS_PRIX.items() for event in grand_prix.events}


@cache
def _by_circuit() -> dict[str, str]:
    return {_letters(name): key for key, c in CIRCUITS.items() for name in (key, c.name, *_town(c), *c.others)}


def _letters(text: str) -> str:
    return "".join(_words(text))


def _words(text: str) -> list[str]:
    """Words in small letters, without accents."""
    return re.findall(r"[a-z0-9]+", unicodedata.normalize("NFKD", text).encode("ascii", "ignore").decode().lower())
