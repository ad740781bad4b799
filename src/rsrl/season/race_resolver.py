"""From what people call a race to its name: `monza-2023`, "2023 São Paulo Grand Prix" and `COTA` alone all name one race or none.

A race is named by a Grand Prix, circuit, town or country and a season; without a season the latest one with a season file is meant.
Letters that merely look alike never decide: a word is known or it is refused.
"""

import re
import unicodedata
from collections.abc import Mapping, Sequence
from functools import cache
from typing import Final, NamedTuple

from rsrl.errors import RsrlError
from rsrl.season.circuits import GRANDS_PRIX, SEVERAL, circuit_name, country_of, is_held, spoken_names

SEASONS: Final = range(1950, 2101)
_TOKEN: Final = re.compile(r"[^\W\d_]+|\d+")
_FORMULA: Final = re.compile(r"\bf(?:ormula)?[\s_-]*(?:1|one)\b")
_FILLERS: Final = frozenset({"grand", "prix", "gp", "the", "of", "circuit", "international", "street", "race"})
"""Words that do not tell one race from another."""

_LONGEST: Final = 6
"""Words in a name at most."""


_Races = Mapping[str, Mapping[int, str]]
"""Names of races by Grand Prix and season."""


class _Asked(NamedTuple):
    """The words of a text that name a Grand Prix, and the season."""

    words: tuple[str, ...]
    season: int | None


def resolve_race(text: str, known: Sequence[str]) -> str:
    """The race that a text names.

    Args:
        text: what was typed, such as `bahrain-2023`, `Monza 2023` or `2023 British Grand Prix`.
        known: names of the races there are, such as `bahrain-2023`.

    Raises:
        RsrlError: the text names no race there is, or does not say which of several; the message names those that may be meant.
    """
    if text in known:
        return text
    races = _by_grand_prix(known)
    asked = _asked(text)
    found, season = _meant(asked, races) if asked is not None and not re.search(r"[/\\]", text) else ((), None)
    if asked is None or not found:
        raise RsrlError(f"unknown race {text!r}; {_known_races(races)}")
    if len(found) > 1:
        raise RsrlError(f"race {text!r} may be {_listed(found, races, asked.season) or ', '.join(found)}; name one of them")
    (grand_prix,) = found
    if season in races.get(grand_prix, {}):
        return races[grand_prix][season]
    raise RsrlError(f"unknown race {text!r}; {_not_shipped(grand_prix, asked.season, races)}")


def _meant(asked: _Asked, races: _Races) -> tuple[tuple[str, ...], int]:
    """Grands Prix that the words may name, and the season: that asked for, else the latest in which one of them has a season file.

    Words mean what they mean in that season: Barcelona held the Spanish Grand Prix until 2025, its own from 2026.
    """
    if asked.season is not None:
        return _grands_prix(asked.words, asked.season, races), asked.season
    seasons = sorted({season for of_one in races.values() for season in of_one}, reverse=True) or [SEASONS[-1]]
    meanings = [(_grands_prix(asked.words, season, races), season) for season in seasons]
    return next((m for m in meanings if any(m[1] in races.get(slug, {}) for slug in m[0])), meanings[0])


def _asked(text: str) -> _Asked | None:
    """Words and season of a text; None where it names two seasons."""
    tokens = _TOKEN.findall(_FORMULA.sub(" ", _folded(text)))
    years = [int(token) for token in tokens if len(token) == 4 and token.isdecimal() and int(token) in SEASONS]
    if not years and tokens and len(tokens) > 1 and re.fullmatch(r"\d\d", tokens[-1]):
        years, tokens = [2000 + int(tokens[-1])], tokens[:-1]  # monza-23
    if len(set(years)) > 1:
        return None
    words = tuple(token for token in tokens if token not in {str(year) for year in years})
    return _Asked(words, years[0] if years else None)


def _folded(text: str) -> str:
    """Lower case, without accents."""
    return "".join(c for c in unicodedata.normalize("NFKD", text.casefold()) if not unicodedata.combining(c))


def _key(words: Sequence[str]) -> str:
    return "".join(words)


def _significant(words: Sequence[str]) -> tuple[str, ...]:
    return tuple(word for word in words if word not in _FILLERS)


@cache
def _spoken(season: int) -> Mapping[str, tuple[str, ...]]:
    """Grands Prix of a season by what they are called, written together: whole names, and those without fillers that are no other's."""
    named: list[tuple[str, tuple[str, ...]]] = [
        (name, (slug,)) for slug in GRANDS_PRIX if is_held(slug, season) for name in spoken_names(slug, season)
    ]
    named += [(word, _held_in(country, season)) for word, country in SEVERAL.items()]
    pairs = [(tuple(_TOKEN.findall(_folded(name))), slugs) for name, slugs in named]
    whole = {_key(words): slugs for words, slugs in pairs}
    return {_key(_significant(words)): slugs for words, slugs in pairs} | whole


@cache
def _countries(season: int) -> Mapping[str, tuple[str, ...]]:
    """Grands Prix of a season by the country they are held in, written together."""
    countries = dict.fromkeys(country for slug in GRANDS_PRIX if (country := country_of(slug, season)))
    return {_key(_TOKEN.findall(_folded(country))): _held_in(country, season) for country in countries}


def _held_in(country: str, season: int) -> tuple[str, ...]:
    """Grands Prix held in a country."""
    return tuple(slug for slug in GRANDS_PRIX if is_held(slug, season) and country_of(slug, season) == country)


def _grands_prix(words: tuple[str, ...], season: int, races: _Races) -> tuple[str, ...]:
    """Grands Prix that all words together may name; none where a word is unknown or they contradict one another.

    A race that is in no table goes by the name of its file.
    """
    bare = _significant(words)
    own = {_key(slug.split("-")): (slug,) for slug in races if slug not in GRANDS_PRIX}
    for key in (_key(words), _key(bare)):
        if key in _spoken(season) or key in own:
            return _spoken(season).get(key) or own[key]
    found = _combined(bare, season)
    return tuple(slug for slug in GRANDS_PRIX if slug in found)


def _combined(words: tuple[str, ...], season: int) -> frozenset[str]:
    """Grands Prix named by every part of `Imola Italy` or `Silverstone Great Britain`; a country stands for all that are held in it."""
    named = [frozenset(GRANDS_PRIX)]  # by all parts of the last words, none, one, two ...
    for begin in range(len(words) - 1, -1, -1):
        found: frozenset[str] = frozenset()
        for end in range(begin + 1, min(begin + _LONGEST, len(words)) + 1):
            key = _key(words[begin:end])
            part = {*_spoken(season).get(key, ()), *_countries(season).get(key, ())}
            found |= named[len(words) - end] & part
        named.append(found)
    return named[-1] if words else frozenset()


def _by_grand_prix(known: Sequence[str]) -> dict[str, dict[int, str]]:
    """Names of the races there are, by Grand Prix and season."""
    races: dict[str, dict[int, str]] = {}
    for name in known:
        grand_prix, _, season = name.rpartition("-")
        if grand_prix and season.isdecimal() and int(season) in SEASONS:
            races.setdefault(grand_prix, {})[int(season)] = name
    return races


def _listed(grands_prix: Sequence[str], races: _Races, season: int | None) -> str:
    """Races of some Grands Prix in a season, in the latest one of each for None: `italy-2023 (Monza)`."""
    names = []
    for slug in grands_prix:
        seasons = races.get(slug, {})
        chosen = max(seasons, default=None) if season is None else season
        if chosen is not None and chosen in seasons:
            names.append(f"{seasons[chosen]} ({circuit_name(slug, chosen)})")
    return ", ".join(names)


def _not_shipped(grand_prix: str, season: int | None, races: _Races) -> str:
    """What there is instead of a Grand Prix that has no season file: its other seasons, others in the country."""
    meant = SEASONS[-1] if season is None else season
    country = country_of(grand_prix, meant)
    hints = [", ".join(races[grand_prix].values())] if grand_prix in races else []
    others = _listed([slug for slug in _held_in(country, meant) if slug != grand_prix], races, season) if country else ""
    hints += [f"in {country}: {others}"] if others else []
    missing = f"no season file of {grand_prix} ({circuit_name(grand_prix, meant)}){'' if season is None else f' in {season}'}"
    return f"{missing}; there are {'; '.join(hints)}" if hints else f"{missing}; {_known_races(races)}"


def _known_races(races: _Races) -> str:
    if not races:
        return "known races: none (see `rsrl races`)"
    seasons = sorted({season for of_one in races.values() for season in of_one})
    return f"known races: {', '.join(sorted(races))}, each with a season such as {seasons[-1]} (see `rsrl races`)"
