"""Results of `rsrl bench` and of the scripts in `benchmarks/`."""

from collections.abc import Mapping

from rsrl.results.base import Interval, Number, Provenance, Result


class SimulatorSpeed(Result, frozen=True):
    """Races a second with all cores and with one, and the peak memory of the process in MB."""

    races_per_s: float
    races_per_s_one_thread: float
    peak_memory_mb: float


class EnvironmentSpeed(Result, frozen=True):
    """Steps a second on one core."""

    steps_per_s: float


class TrainingSpeed(Result, frozen=True):
    """Training branches a second, and the cores used on average."""

    branches_per_s: float
    cores_used: float


class DecisionSpeed(Result, frozen=True):
    """Time of one decision."""

    ms: float


class Bench(Result, frozen=True):
    """Of `rsrl bench`."""

    race: str
    simulator: SimulatorSpeed
    environment: EnvironmentSpeed
    training: TrainingSpeed
    decision: DecisionSpeed
    provenance: Provenance


class EngineRatio(Result, frozen=True):
    """Of `benchmarks/engine_ratio.py`: CPU time a race by kind of rivals, against an older revision."""

    race: str
    old: str
    new: str
    rounds: int
    races_a_round: int
    us_per_race: dict[str, float]
    us_per_race_lower_quartile: dict[str, float]
    time_ratio_to_old: dict[str, float]
    provenance: Provenance


class GapPart(Result, frozen=True):
    """A strategist in `benchmarks/gap_parts.py`; slow laps are those under a safety car or a virtual one."""

    strategist: str
    mean_position: float
    gap_closed: float
    gap_closed_ci95: Interval
    mean_position_with_slow_laps: float
    mean_position_without: float
    ahead_of_hindsight: float


class GapParts(Result, frozen=True):
    """Of `benchmarks/gap_parts.py`."""

    race: str
    races: int
    seed: int
    races_with_slow_laps: float
    rows: tuple[GapPart, ...]
    provenance: Provenance


class PaperAgentTrial(Result, frozen=True):
    """A training run in `benchmarks/paper_agents.py`: mean positions on the validation races after so many races of training."""

    agent: str
    trial: str
    seed: int
    cpu_s: float
    gradient_steps: int
    races: tuple[int, ...]
    mean_position: tuple[float, ...]


class PaperAgents(Result, frozen=True):
    """Of `benchmarks/paper_agents.py`; `references` are mean positions of strategists on the same validation races."""

    race: str
    references: dict[str, float]
    trials: tuple[PaperAgentTrial, ...]
    provenance: Provenance


class PaperAgentCurve(Result, frozen=True):
    """Learning curve of a training run: mean positions on the races it set aside after so many races, and those of strategists there.

    `steps` are laps driven in training.
    """

    agent: str
    seed: int
    steps: int
    races: tuple[int, ...]
    mean_position: tuple[float, ...]
    references: dict[str, float]


class PaperAgentCurves(Result, frozen=True):
    """Of `benchmarks/paper_agent_curves.py`."""

    race: str
    curves: tuple[PaperAgentCurve, ...]
    provenance: Provenance


class RivalMeasure(Result, frozen=True):
    """A score of the model of real calls and of two baselines, and the intervals of its lead on them."""

    model: float
    constant: float
    plans: float
    model_less_constant_ci95: Interval
    model_less_plans_ci95: Interval


class RivalsOverall(Result, frozen=True):
    """Scores over all calls of the test season."""

    logloss: RivalMeasure
    first_stop_mae: RivalMeasure
    first_stop_within_3: RivalMeasure
    stops_mae: RivalMeasure


class RivalsRace(Result, frozen=True):
    """One race of the test season; `stops` are means of a car, by model."""

    race: str
    real_stops: Number
    stops: dict[str, float]
    within_3: float
    first_stop_error_laps: float
    logloss: float


class RivalsResult(Result, frozen=True):
    """Of `benchmarks/rivals.py`: the model of real calls on a season it was not fitted to."""

    fit: tuple[int, ...]
    test: int
    calls: int
    stops: int
    overall: RivalsOverall
    races: tuple[RivalsRace, ...]
    provenance: Provenance


class SeasonRow(Result, frozen=True):
    """One race: real counts, and of simulated races the mean, its standard error, and the 5 % and 95 % quantiles."""

    race: str
    real: Mapping[str, float]
    simulated: Mapping[str, tuple[float, float, float, float]]


class SeasonTable(Result, frozen=True):
    """Of `benchmarks/season_table.py`."""

    season: int
    rows: tuple[SeasonRow, ...]
    provenance: Provenance


class RolloutGain(Result, frozen=True):
    """Places won a race with so many futures at most, half the width of its interval, and the rollouts it takes."""

    places_won_a_race: float
    half_width: float
    rollouts_a_race: float


class CloseDecisions(Result, frozen=True):
    """Decisions of one kind: how far the network is off, the spread of one future, and the gain by number of futures."""

    decisions_a_race: float
    network_sd: float
    network_bias: float
    future_sd: float
    by_futures: dict[str, RolloutGain]


class WorthOfThinking(Result, frozen=True):
    """Of `benchmarks/worth_of_thinking.py`: close decisions by track and kind."""

    races: int
    futures: int
    tracks: dict[str, dict[str, CloseDecisions]]
    provenance: Provenance
