"""`rsrl backtest --mode plans`: its result file and its tables."""

from typing import TYPE_CHECKING

from rsrl.cli.output import Column, FittedTable, table
from rsrl.cli.provenance import provenance
from rsrl.results import PlanOverall, PlansResult

if TYPE_CHECKING:
    from rsrl.evaluation.backtest import PlansBacktest

SHARES = ("start_match", "compounds_match", "sequence_match", "stops_match")
HEADS = (
    "start", "compounds", Column("sequence", 3), "stops", Column("regret, places", 2), Column("regret, s", 4),
    Column("1st stop +-, laps", 5), Column("log-loss", 1), Column("log-loss, others known", 6),
)  # fmt: skip


def document(result: "PlansBacktest", seed: int) -> PlansResult:
    """The result as it is written."""
    return PlansResult(
        mode="plans",
        fit=result.fit,
        test=result.test,
        simulated_races=result.simulated_races,
        overall=result.overall,
        difference_to_frequency=result.difference_to_frequency,
        baselines=result.baselines,
        races=result.races,
        provenance=provenance(seed),
    )


def summary_table(result: "PlansBacktest") -> FittedTable:
    """Agreement with the cars' own plans: the simulation's best plans, and the baselines."""
    rows = [
        _row("best in the race", result.overall),
        _row("choice model", result.baselines.choice_model),
        _row("frequency", result.baselines.frequency),
        _row("published", result.baselines.published),
    ]
    lead = result.difference_to_frequency
    against = f"; log-loss less frequency's {lead.mean:+.2f} [{lead.low:+.2f}, {lead.high:+.2f}]" if lead else ""
    title = f"plans of {result.test}: {result.overall.races} races, {result.overall.cars} cars{against}"
    return table(title, ("", *HEADS), rows)


def _row(name: str, scores: PlanOverall) -> list[str]:
    shares = [_percent(getattr(scores, key)) for key in SHARES]
    rest = ("regret_places", "regret_s", "first_stop_error_laps", "choice_logloss", "choice_logloss_given_others")
    return [name, *shares, *(_number(getattr(scores, key)) for key in rest)]


def races_table(result: "PlansBacktest") -> FittedTable:
    """Race by race: what most cars ran, what is best for most, and the scores."""
    from rsrl.evaluation.backtest import commonest

    rows = []
    for race in result.races:
        cells = ["-"] * 5
        if race.apart is None:
            cells = [
                _percent(race.compounds_match), _number(race.regret_places), _number(race.regret_s),
                _number(race.choice_logloss), _number(race.frequency_logloss),
            ]  # fmt: skip
        name = race.race + (f" ({race.apart})" if race.apart else "")
        rows.append([name, commonest(race, "ran"), commonest(race, "best"), *cells])
    heads = (
        "most ran",
        "best for most",
        "compounds",
        Column("regret, places", 2),
        Column("regret, s", 3),
        "log-loss",
        Column("frequency", 1),
    )
    return table("Race by race", ("", *heads), rows)


def _percent(value: float | None) -> str:
    return "-" if value is None or value != value else f"{100 * value:.0f} %"


def _number(value: float | None) -> str:
    return "-" if value is None or value != value else f"{value:.2f}"
