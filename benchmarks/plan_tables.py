"""Tables of `rsrl backtest --mode plans`: agreement of predicted plans with those that were run, over a season and race by race."""

from pathlib import Path

from table_text import markdown

from rsrl.evaluation.backtest import commonest
from rsrl.results import PlanOverall, PlansResult, read_result

RESULTS = Path(__file__).parent / "results"
HEADS = (
    "", "start, %", "compounds, %", "stops, %", "regret, places", "regret, s", "1st stop, bias", "1st stop, error", "log-loss",
    "log-loss, others known",
)  # fmt: skip


def plans(season: int) -> str:
    """Agreement of each predictor over a season; one that says nothing is left out."""
    told = _result(season)
    rows = [("**best in the race**", told.overall), *((name.replace("_", " "), b) for name, b in _baselines(told))]
    return markdown(HEADS, [_row(name, scores) for name, scores in rows if scores.start_match is not None])


def plan_races(season: int) -> str:
    """Race by race: what most cars ran, what is best for most."""
    rows = [
        [
            race.race,
            commonest(race, "ran"),
            commonest(race, "best"),
            *map(_two, (race.regret_places, race.choice_logloss, race.frequency_logloss)),
        ]
        for race in _result(season).races
        if race.apart is None
    ]
    return markdown(["", "most ran", "best for most", "regret, places", "log-loss", "frequency's"], rows)


def _result(season: int) -> PlansResult:
    return read_result(RESULTS / f"backtest-{season}-plans.json", PlansResult, "rsrl backtest --mode plans")


def _baselines(told: PlansResult) -> list[tuple[str, PlanOverall]]:
    return [(name, getattr(told.baselines, name)) for name in told.baselines.__struct_fields__]


def _row(name: str, scores: PlanOverall) -> list[str]:
    shares = [f"{100 * (share or 0.0):.0f}" for share in (scores.start_match, scores.compounds_match, scores.stops_match)]
    stops = (scores.first_stop_bias_laps, scores.first_stop_error_laps)
    rest = (scores.regret_places, scores.regret_s, *stops, scores.choice_logloss, scores.choice_logloss_given_others)
    return [name, *shares, *map(_two, rest)]


def _two(value: float | None) -> str:
    return "" if value is None else f"{value:.2f}"
