"""The result of `rsrl backtest`: real races predicted, and how wrong that was."""

from rsrl.results.base import Number, Provenance, Result


class Measures(Result, frozen=True):
    """Scores of a predictor, of one race or a mean over races; None where it says nothing about one."""

    mae_position: Number
    mae_rank_classified: Number
    spearman: Number
    brier_points: Number
    logloss_winner: Number
    mae_green_lap_s: Number
    mae_lap_position: Number
    stops_mae: Number
    first_stop_within_3: Number
    sc_laps_predicted: Number
    sc_laps_actual: Number


class Averages(Measures, frozen=True):
    """Means over so many races, those left out that lack a measure."""

    races: float


class MeanInterval(Result, frozen=True):
    """A mean over races with the interval of a bootstrap over them."""

    mean: float
    low: float
    high: float


class Overall(Averages, frozen=True):
    """Means with their differences to the prediction that the grid is the result, by measure."""

    difference_to_grid: dict[str, MeanInterval]


class Baselines(Result, frozen=True):
    """The two baselines over the dry races."""

    grid: Overall
    regression: Overall


class AllRaces(Averages, frozen=True):
    """Means over all races, wet ones included: the simulation's own, and the baselines'."""

    grid: Averages
    regression: Averages


class Car(Result, frozen=True):
    """One car of one race: the prediction and the official result.

    Attributes:
        position: official.
        predicted: mean simulated position.
        p_points, p_win: chances of points and of a win.
        stops: official; None for a car that was not classified.
        first_stop: its lap; None where there was none.
    """

    driver: str
    team: str
    grid: int
    position: int
    predicted: float
    p_points: float
    p_win: float
    stops: Number
    stops_predicted: Number
    first_stop: Number
    first_stop_predicted: Number


class BacktestRace(Measures, frozen=True):
    """One race: scores of the simulation, of the baselines, and its cars."""

    race: str
    season: int
    round: int
    wet: bool
    grid: Measures
    regression: Measures
    cars: tuple[Car, ...]


class BacktestResult(Result, frozen=True):
    """The whole file; `mode` is forecast, replay or hindsight. `overall` and `baselines` are over the dry races.

    Attributes:
        without: the part taken out of the simulator; None for none.
    """

    mode: str
    fit: tuple[int, ...]
    test: int
    simulated_races: int
    without: str | None
    overall: Overall
    baselines: Baselines
    all_races: AllRaces
    races: tuple[BacktestRace, ...]
    provenance: Provenance
