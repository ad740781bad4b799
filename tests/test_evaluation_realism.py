"""The simulated race beside the real one."""

from pathlib import Path

import numpy as np
import pytest

from rsrl.errors import RsrlError
from rsrl.evaluation.realism import compare, plot_traces, real_race
from rsrl.laps import LAP_SCHEMA, read_seasons
from rsrl.season import RaceRecord
from rsrl.simulator import simulate, trace_races


@pytest.mark.real_data
def test_bahrain_2023_is_read_as_it_was_and_simulated_alike(real_data: Path, bahrain: RaceRecord, tmp_path: Path) -> None:
    real = real_race(read_seasons(real_data / "laps", (2023,)), bahrain)
    winner = int(np.argmin(real.place))
    assert bahrain.cars[winner].driver == "VER"
    assert real.stops[winner] == 2
    assert real.laps_done[winner] == 57
    assert real.race_time_s[-1, winner] == pytest.approx(5636.7, abs=1.0)  # official 1:33:56.736
    trace = trace_races(bahrain, 40, seed=1)
    rows = {name: (was, simulated) for name, was, simulated in compare(bahrain, real, simulate(bahrain, 200, 1), trace)}
    assert float(rows["cost of a green stop with cold tyres, s"][1]) == pytest.approx(real.stop_loss_s, abs=2.0)
    plot_traces(bahrain, real, trace, tmp_path / "trace.png")
    assert (tmp_path / "trace.png").stat().st_size > 10_000


def test_a_race_that_is_not_in_the_laps_is_named(bahrain: RaceRecord) -> None:
    import polars as pl

    with pytest.raises(RsrlError, match="no Bahrain Grand Prix 2023"):
        real_race(pl.DataFrame(schema=LAP_SCHEMA), bahrain)
