"""Backtest on real races: predict each from the races before it, score the prediction, take parts out to see what they are worth."""

from rsrl.evaluation.backtest.ablation import ABLATIONS, without
from rsrl.evaluation.backtest.forecast import Season, forecast_record, read_season
from rsrl.evaluation.backtest.observed import observe_race, race_times_s, replay_script
from rsrl.evaluation.backtest.plans import PlansBacktest, commonest, run_plans
from rsrl.evaluation.backtest.run import MODES, Backtest, RaceScores, check_request, prepare_race, run_backtest
from rsrl.evaluation.backtest.scores import MEASURES

__all__ = [
    "ABLATIONS",
    "MEASURES",
    "MODES",
    "Backtest",
    "PlansBacktest",
    "RaceScores",
    "Season",
    "check_request",
    "commonest",
    "forecast_record",
    "observe_race",
    "prepare_race",
    "race_times_s",
    "read_season",
    "replay_script",
    "run_backtest",
    "run_plans",
    "without",
]
