"""Figures of README and docs that need no real laps; `how_real.py` draws those that do.

    python benchmarks/figures.py

What-if: every option of lap 10 of Bahrain 2023, what it is worth and where its time goes. Strategies: from the result files of the
leaderboard and of the study. Trace: one simulated race.
"""

from pathlib import Path

import numpy as np

from rsrl.drawing import StintBar, TracePanel, new_figure, plot_race_trace, plot_strategies, save_figure
from rsrl.evaluation.study import plot_figure3
from rsrl.explanation import explain_what_if, load_explained, reach
from rsrl.explanation.what_if import plot_time_split, plot_what_if
from rsrl.results import Evaluation, StudyResult, read_result
from rsrl.season import find_car, load_race
from rsrl.simulator import trace_races

RESULTS, FIGURES = Path("benchmarks/results"), Path("docs/figures")
RACE, LAP, SEED = "bahrain-2023", 10, 0


def draw_what_if() -> None:
    """Options of one lap, beside what their time is made of."""
    record, policy = load_race(RACE), load_explained("all")
    moment = reach(policy.strategist(record), record, find_car(record, None), LAP, seed=SEED)
    explanation = explain_what_if(policy, moment, races=2000, seed=SEED)
    figure, (left, right) = new_figure(12.0, 4.6, 2)
    plot_what_if(explanation, left)
    plot_time_split(explanation, right)
    right.set_yticklabels([])
    right.set_title("where the time goes", loc="left", fontsize=9)
    title = f"{record.event} {record.season}, {record.default_driver}, before lap {LAP}: what each call would lead to"
    save_figure(figure, title, FIGURES / f"what-if-{RACE.rsplit('-', 1)[0]}-lap-{LAP}.png")


def draw_strategies() -> None:
    """Most common strategies of the leaderboard's strategists, and the paper's Figure 3 for Japan."""
    board = read_result(RESULTS / f"leaderboard-{RACE}.json", Evaluation, "rsrl evaluate")
    record = load_race(RACE)
    bars = [
        StintBar(s.plan, f"{100 * s.share:.0f} %  P{s.mean_position:.1f}", s.compounds, s.laps, s.windows, s.strategist)
        for s in board.strategies or ()
    ]
    title = f"Strategies driven: {record.event} {record.season}, {board.driver}"
    plot_strategies(bars, record.laps, title, "10-90 % of stops", FIGURES / f"strategies-{RACE}.png")
    study = read_result(RESULTS / "generalise.json", StudyResult, "rsrl study generalise")
    for path in plot_figure3(study.tracks, FIGURES):
        if path.name != "strategies-japan-2023.png":  # one track, its first page
            path.unlink()


def draw_trace() -> None:
    """One simulated race."""
    record = load_race(RACE)
    trace, cars = trace_races(record, 1, SEED), len(record.cars)
    times = np.where(trace.running[0, :, :cars], trace.race_time_s[0, :, :cars], np.nan)
    drivers, teams = [car.driver for car in record.cars], [car.team for car in record.cars]
    panel = TracePanel("", drivers, teams, times, trace.track_status[0].astype(np.int64))
    title = f"{record.event} {record.season}, race 0 of seed {SEED}, simulated"
    plot_race_trace([panel], title, FIGURES / f"trace-{RACE}-simulated.png")


if __name__ == "__main__":
    draw_strategies()
    draw_trace()
    draw_what_if()
