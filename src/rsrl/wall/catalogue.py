"""What there is to watch, by name: season files, lap files of one folder, live sources. A viewer chooses from these lists, so no text of a
viewer ever becomes a path."""

import threading
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Final, NamedTuple

from rsrl.errors import RsrlError
from rsrl.season import race_heads
from rsrl.wall.messages import RaceChoice, RecordingChoice
from rsrl.wall.settings import Settings, View

if TYPE_CHECKING:
    from rsrl.explanation import AnyPolicy
    from rsrl.wall.sources import Source

SIMULATED: Final = "simulated"
LAP_FILES: Final = ("*.csv", "*.csv.gz")


class LiveSource(NamedTuple):
    """A source that the server was started with: how it is listed, and how it is opened: once, where it is live."""

    choice: RecordingChoice
    open: Callable[["AnyPolicy"], "Source"]


class Catalogue:
    """The lists of one server. Lap files are read by a thread as the server starts, since each takes a second.

    Attributes:
        ready: the lap files have been read.
    """

    def __init__(self, settings: Settings) -> None:
        self._settings = settings
        self._files: dict[tuple[str, str], tuple[Path, RecordingChoice]] = {}
        self.races = tuple(
            RaceChoice(name=h.name, event=h.event, season=h.season, laps=h.laps, wet=h.wet, default_driver=h.default_driver)
            for h in race_heads()
        )
        self.ready = threading.Event()

    @property
    def recordings(self) -> tuple[RecordingChoice, ...]:
        """Recorded races and live sources known so far."""
        return (*(live.choice for live in self._settings.live), *(choice for _, choice in self._files.values()))

    def read(self) -> None:
        """Read the lap files of the folder; a file that is none is left out. For a thread."""
        folder = self._settings.laps
        for path in sorted({path for pattern in LAP_FILES for path in folder.glob(pattern)}) if folder else []:
            self._read(path)
        self.ready.set()

    def _read(self, path: Path) -> None:
        from rsrl.laps import read_lap_csv
        from rsrl.season import grand_prix_of

        try:
            heads = read_lap_csv(path).select("season", "round", "event").unique().sort("season", "round")
        except RsrlError:
            return
        name = path.name.removesuffix(".gz").removesuffix(".csv")
        for season, _, event in heads.iter_rows():
            race = f"{grand_prix_of(event)}-{season}"
            self._files[name, race] = (path, RecordingChoice(name=name, race=race, event=event, season=season, kind="recorded"))

    def source(self, view: View, policy: "AnyPolicy") -> "Source":
        """The source of a view; slow, for a thread. Raises RsrlError for a name that is in none of the lists."""
        from rsrl.wall.sources import SimulatedSource, recorded_source

        if view.source == SIMULATED:
            if view.race not in {race.name for race in self.races}:
                raise RsrlError(f"unknown race {view.race!r}: choose one of the list")
            return SimulatedSource(policy, view.race, view.driver, view.seed)
        for live in self._settings.live:
            if (live.choice.name, live.choice.race) == (view.source, view.race):
                return live.open(policy)
        self.ready.wait()
        found = self._files.get((view.source, view.race))
        if found is None:
            raise RsrlError(f"unknown recording {view.race!r} of {view.source!r}: choose one of the list")
        return recorded_source(policy, found[0], view.race)
