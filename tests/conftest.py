"""What tests share: one race record, the real laps where they are, and property tests that do the same every time."""

from pathlib import Path

import pytest
from hypothesis import settings

from rsrl.compile_watch import watch
from rsrl.season import RaceRecord, load_race

ROOT = Path(__file__).parents[1]

# Derandomised: a test passes or fails for the code's sake alone. No deadline: machines differ.
settings.register_profile("rsrl", derandomize=True, deadline=None, max_examples=50)
settings.load_profile("rsrl")


class Silent:
    """Lets tests compile without a word, so that what they find on standard error does not depend on the cache."""

    def begin(self) -> None:
        pass

    def end(self) -> None:
        pass


watch(Silent())


@pytest.fixture(scope="session")
def bahrain() -> RaceRecord:
    """The shipped figures of the 2023 Bahrain Grand Prix."""
    return load_race("bahrain-2023")


@pytest.fixture(scope="session")
def real_data() -> Path:
    """Folder of the real laps and facts, beside the project; a test that asks for it is skipped where it is absent."""
    folder = ROOT.parent / "shared" / "data"
    if not folder.is_dir():
        pytest.skip("real laps are not here: ../shared/data is absent")
    return folder
