"""The result of `benchmarks/illustrations.py`: famous decisions of real races, called by the policy."""

from rsrl.results.base import Interval, Number, Provenance, Result


class Illustration(Result, frozen=True, kw_only=True):
    """A decision of a real race.

    Attributes:
        race, driver, lap: the call is carried out at the end of the lap.
        track_status: 0 green, 1 virtual safety car, 2 safety car, 3 red flag, when it was called.
        position: as the lap began; finish: in the real race, None for a car that did not.
        team: what the team did; call: the policy's, with its values by call.
        places: mean change in finishing position by the team's call against the policy's, in the same futures; above zero is lost.
        verdict: on the team's call: better, worse, equal, undecided, itself where both are the same; "not possible" where the state does
            not allow it.
        sentences: the explanation by what-if.
        knows_race: whether the figures of the season file were fitted with this race among others.
    """

    race: str
    driver: str
    lap: int
    track_status: int
    position: int
    finish: int | None = None
    team: str
    call: str
    values: dict[str, float]
    places: Number = None
    ci95: Interval | None = None
    verdict: str
    sentences: tuple[str, ...]
    knows_race: bool


class Illustrations(Result, frozen=True, kw_only=True):
    """The whole file; `futures` of each decision."""

    model: str
    model_hash: str
    futures: int
    seed: int
    decisions: tuple[Illustration, ...]
    provenance: Provenance
