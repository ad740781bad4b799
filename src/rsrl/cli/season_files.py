"""Season files written together: each is read back as it will be used, and all are moved to their place or none is."""

import shutil
from pathlib import Path
from tempfile import mkdtemp
from types import TracebackType

from rsrl.errors import RsrlError
from rsrl.season import RaceRecord, race_hash, read_race, write_race


class Together:
    """A set of season files for one folder.

    They are written to a folder beside their place, and moved there when the block ends without an error.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._apart = folder
        self._names: list[str] = []

    def __enter__(self) -> "Together":
        try:
            self._apart = Path(mkdtemp(prefix=".rsrl-", dir=self._folder))
        except OSError as error:
            raise RsrlError(f"{self._folder}: cannot be written to ({error.strerror}); choose another folder with --out") from None
        return self

    def write(self, record: RaceRecord, name: str) -> None:
        """Write a season file, and read it back.

        Raises:
            RsrlError: nothing could use the file; the message names race and figure. No file of the set is left then.
        """
        path = self._apart / name
        write_race(record, path)
        try:
            self._check(read_race(path), record)
        except RsrlError as error:
            fault = str(error).removeprefix(f"{path}: ")
            raise RsrlError(f"{record.name}: these laps give a file that cannot be used, and none is written: {fault}") from None
        self._names.append(name)

    def _check(self, read: RaceRecord, record: RaceRecord) -> None:
        from rsrl.simulator import Plan, check_plan

        if race_hash(read) != race_hash(record):
            raise RsrlError("its figures are not those that were written")
        for rival in read.rivals.plans:
            check_plan(Plan.parse(rival.plan), read)

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        try:
            if kind is None:
                for name in self._names:
                    (self._apart / name).replace(self._folder / name)
        except OSError as fault:
            raise RsrlError(f"{self._folder}: cannot be written to ({fault.strerror}); choose another folder with --out") from None
        finally:
            shutil.rmtree(self._apart, ignore_errors=True)
