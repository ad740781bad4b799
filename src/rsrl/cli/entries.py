"""What a model is trained on: races and cars from command-line arguments, and the environments made of them."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from rsrl.cli.options import assumed
from rsrl.errors import RsrlError
from rsrl.season import GROUPS, RaceRecord, find_car, group_races, load_race, race_hash

if TYPE_CHECKING:
    from rsrl.agents import EnvironmentFactory, LearnerConfig, ModelMetadata

ALL_CARS = "all"


@dataclass(frozen=True)
class Entries:
    """Pairs of a race and a car to train on.

    Attributes:
        name: a race, a group, or several races separated by commas.
        records, cars: race and car of each entry; a race is entered with one car or with all of them.
        driver: code of the one driver, "" for all.
    """

    name: str
    records: tuple[RaceRecord, ...]
    cars: tuple[int, ...]
    driver: str

    @property
    def pairs(self) -> list[tuple[RaceRecord, int]]:
        """Record and car of each entry."""
        return list(zip(self.records, self.cars, strict=True))

    def about(self, command: str, config: "LearnerConfig") -> "ModelMetadata":
        """Metadata of a model trained on these entries."""
        import hashlib

        from rsrl.agents import ModelMetadata

        hashes = [race_hash(record) for record in {r.name: r for r in self.records}.values()]
        digest = hashes[0] if len(hashes) == 1 else hashlib.sha256("\n".join(hashes).encode()).hexdigest()[:16]
        return ModelMetadata(
            race=self.name, season_hash=digest, driver=self.driver, command=command, trained_range=trained_range(self, config)
        )


def read_entries(races: str, driver: str | None, changes: list[str] | None = None, sets: list[str] | None = None) -> Entries:
    """The entries that two command-line arguments name.

    Args:
        races: a race, a season file, a group of races (`season.GROUPS`), or several races separated by commas.
        driver: a driver by code, number or surname, or `all`; None means the default driver of a single race, and all of several.
        changes, sets: assumptions of every race, as --set and --sets give them.

    Raises:
        RsrlError: a race or driver is unknown, a race is wet, or no race is named.
    """
    names = group_races(races) if races in GROUPS else tuple(dict.fromkeys(word.strip() for word in races.split(",") if word.strip()))
    if not names:
        raise RsrlError(f"no race in {races!r}; name one such as bahrain-2023, several with commas between, or {', '.join(GROUPS)}")
    records = [assumed(record, changes, sets) for record in {r.name: r for r in map(load_race, names)}.values()]
    if wet := [record.name for record in records if record.wet]:
        raise RsrlError(f"{wet[0]} was a wet race and there is no wet-weather model; choose dry ones (see `rsrl races`)")
    every = driver == ALL_CARS or (driver is None and (len(records) > 1 or races in GROUPS))
    pairs = [(r, car) for r in records for car in (range(len(r.cars)) if every else (find_car(r, driver),))]
    code = "" if every else pairs[0][0].cars[pairs[0][1]].driver
    name = races if races in GROUPS else ",".join(r.name for r in records)
    return Entries(name, tuple(r for r, _ in pairs), tuple(c for _, c in pairs), code)


def environment_factory(entries: Entries) -> "EnvironmentFactory":
    """Makes the environment a learner needs: branching races for RSRL's, one race and car for the paper's agents."""
    from rsrl.agents import PaperConfig, RsrlConfig
    from rsrl.environment import RaceEnvironment
    from rsrl.rollouts import BranchingRaces
    from rsrl.simulator import available_cores

    def make(config: "LearnerConfig") -> Any:
        if isinstance(config, RsrlConfig):
            uncertainty = _uncertainty(entries, config)
            return BranchingRaces(
                entries.pairs, feature_set=config.feature_set, uncertainty=uncertainty, contests=config.contests, threads=available_cores()
            )
        if len(entries.pairs) > 1:
            raise RsrlError(f"{config.kind} learns one race for one car, as in the paper; name one race and one driver, or --agent rsrl")
        assert isinstance(config, PaperConfig)
        return RaceEnvironment(*entries.pairs[0], feature_set=config.feature_set, batch=config.races_at_once)

    return make


def trained_range(entries: Entries, config: "LearnerConfig") -> dict[str, list[float]]:
    """Lowest and highest value of each figure over the entries, perturbed as in training."""
    import numpy as np

    from rsrl.season import perturbed
    from rsrl.state import FIGURES, context_figures

    uncertainty = _uncertainty(entries, config)
    rng = np.random.default_rng(0)
    rows = [context_figures(record, car) for record, car in entries.pairs]
    if uncertainty:
        rows += [context_figures(perturbed(record, rng, uncertainty), car) for record, car in entries.pairs]
    low, high = np.min(rows, axis=0), np.max(rows, axis=0)
    return {f.name: [float(low[i]), float(high[i])] for i, f in enumerate(FIGURES)}


def _uncertainty(entries: Entries, config: "LearnerConfig") -> float:
    """Scale of the perturbation of figures: none for a single race, the learner's setting for several."""
    return float(getattr(config, "uncertainty", 0.0)) if len({r.name for r in entries.records}) > 1 else 0.0
