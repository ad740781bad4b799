"""What people call each Grand Prix: country, circuit, town, demonym. The data behind `race_resolver`.

Words are written without accents; case, spaces and hyphens make no difference.
"""

from typing import Final, NamedTuple

from rsrl.season.vocabulary import EVENT_SLUGS


class GrandPrixNames(NamedTuple):
    """Names of one Grand Prix: the country it is held in, the circuit as people say it, and what else it is called by."""

    country: str
    circuit: str
    others: tuple[str, ...] = ()


NAMES: Final = {
    "abu-dhabi": GrandPrixNames("United Arab Emirates", "Yas Marina", ("UAE", "Emirates", "Yas Island")),
    "australia": GrandPrixNames("Australia", "Melbourne", ("Albert Park", "AUS")),
    "austria": GrandPrixNames("Austria", "Red Bull Ring", ("Spielberg", "AUT")),
    "azerbaijan": GrandPrixNames("Azerbaijan", "Baku", ("Baku City", "AZE")),
    "bahrain": GrandPrixNames("Bahrain", "Bahrain International Circuit", ("BHR", "BRN")),
    "belgium": GrandPrixNames("Belgium", "Spa-Francorchamps", ("Spa", "Francorchamps", "BEL")),
    "brazil": GrandPrixNames("Brazil", "Interlagos", ("Sao Paulo", "Brasil", "Brazilian", "Jose Carlos Pace", "BRA")),
    "canada": GrandPrixNames("Canada", "Montreal", ("Gilles Villeneuve", "CAN")),
    "china": GrandPrixNames("China", "Shanghai", ("CHN",)),
    "eifel": GrandPrixNames("Germany", "Nürburgring", ()),
    "emilia-romagna": GrandPrixNames("Italy", "Imola", ("Emilia", "Enzo e Dino Ferrari", "San Marino")),
    "france": GrandPrixNames("France", "Paul Ricard", ("Le Castellet", "FRA")),
    "germany": GrandPrixNames("Germany", "Hockenheim", ("Hockenheimring", "Deutschland")),
    "great-britain": GrandPrixNames("Great Britain", "Silverstone", ("UK", "GB", "GBR", "Britain", "United Kingdom", "England")),
    "hungary": GrandPrixNames("Hungary", "Hungaroring", ("Budapest", "Mogyorod", "HUN")),
    "italy": GrandPrixNames("Italy", "Monza", ("Italia", "ITA")),
    "japan": GrandPrixNames("Japan", "Suzuka", ("JPN",)),
    "las-vegas": GrandPrixNames("United States", "Las Vegas Strip", ("Vegas", "Las Vegas Strip", "Nevada")),
    "mexico": GrandPrixNames("Mexico", "Hermanos Rodriguez", ("Mexico City", "Ciudad de Mexico", "CDMX", "MEX")),
    "miami": GrandPrixNames("United States", "Miami", ("Miami Gardens", "Florida")),
    "monaco": GrandPrixNames("Monaco", "Monte Carlo", ("MCO",)),
    "netherlands": GrandPrixNames("Netherlands", "Zandvoort", ("Holland", "NED")),
    "portugal": GrandPrixNames("Portugal", "Portimao", ("Algarve",)),
    "qatar": GrandPrixNames("Qatar", "Lusail", ("Losail", "QAT")),
    "russia": GrandPrixNames("Russia", "Sochi", ("Sochi Autodrom",)),
    "sakhir": GrandPrixNames("Bahrain", "Bahrain Outer Circuit"),
    "saudi-arabia": GrandPrixNames("Saudi Arabia", "Jeddah", ("Jeddah Corniche", "Saudi", "KSA")),
    "singapore": GrandPrixNames("Singapore", "Marina Bay", ("SGP",)),
    "spain": GrandPrixNames("Spain", "Barcelona", ("Catalunya", "Barcelona-Catalunya", "Catalonia", "Montmelo", "Espana", "ESP")),
    "styria": GrandPrixNames("Austria", "Red Bull Ring", ()),
    "turkey": GrandPrixNames("Turkey", "Istanbul", ("Istanbul Park", "Turkiye")),
    "tuscany": GrandPrixNames("Italy", "Mugello", ("Toscana",)),
    "united-states": GrandPrixNames(
        "United States", "Circuit of the Americas", ("COTA", "Austin", "Texas", "Americas", "US Grand Prix", "USGP", "American Grand Prix")
    ),
    "seventieth-anniversary": GrandPrixNames("Great Britain", "Silverstone", ("70th Anniversary",)),
}  # fmt: skip
"""Names by the first part of a race's name, `season.GRAND_PRIX`."""

SEVERAL: Final = dict.fromkeys(("US", "USA", "America", "American", "United States of America"), "United States")
"""Words that name a country with several Grands Prix and none of them in particular."""

MAIN: Final = {"Silverstone": "great-britain", "Red Bull Ring": "austria"}
"""The Grand Prix that is meant by a circuit which also held an extra one in 2020 or 2021."""


def grands_prix_in(country: str) -> tuple[str, ...]:
    """Grands Prix held in a country."""
    return tuple(slug for slug, names in NAMES.items() if names.country == country)


def spoken_names() -> list[tuple[str, tuple[str, ...]]]:
    """Every name with the Grands Prix it stands for: several where it does not say which one."""
    pairs: list[tuple[str, tuple[str, ...]]] = [(event, (slug,)) for event, slug in EVENT_SLUGS.items()]
    for slug, names in NAMES.items():
        circuit = () if names.circuit in MAIN else (names.circuit,)
        pairs += [(word, (slug,)) for word in (slug, *circuit, *names.others)]
    pairs += [(word, (slug,)) for word, slug in MAIN.items()]
    pairs += [(word, grands_prix_in(country)) for word, country in SEVERAL.items()]
    return pairs
