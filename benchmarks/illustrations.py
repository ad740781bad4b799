"""Famous decisions of real races, called by the shipped policy `all` from what was known then: call, explanation and verdict.

    python benchmarks/illustrations.py --laps LAPS_FOLDER

Writes benchmarks/results/illustrations.json and docs/figures/illustration-RACE.png, a what-if of the race's first decision; the tables of
docs/illustrations.md are made of the file by benchmarks/tables.py. The decisions were chosen for being famous, before any was replayed:
a lap is that of the team's stop, or the one on which it is remembered for staying out.
"""

import argparse
from collections.abc import Iterator
from itertools import groupby
from pathlib import Path
from typing import NamedTuple

from rsrl.audit import follow_field, moments, places_of
from rsrl.audit.race import OWN_RACE
from rsrl.cli.provenance import provenance
from rsrl.drawing import new_figure, save_figure
from rsrl.explanation import ExplainedPolicy, Explanation, explain_what_if, load_explained
from rsrl.explanation.what_if import plot_what_if
from rsrl.feeds.lap_files import lap_events, read_lap_file
from rsrl.laps import season_file
from rsrl.results import Illustration, Illustrations, to_json
from rsrl.season import RaceRecord, load_race
from rsrl.state import ACTION_NAMES, Observer, UnifiedRaceState

RESULTS = Path(__file__).parent / "results" / "illustrations.json"
FIGURES = Path(__file__).parents[1] / "docs" / "figures"
HORIZON_LAPS = 5


class Decision(NamedTuple):
    """A car's call at the end of a lap."""

    race: str
    driver: str
    lap: int


DECISIONS = (
    *(Decision("bahrain-2023", driver, lap) for driver, lap in (("VER", 14), ("ALO", 14), ("HAM", 12), ("LEC", 13), ("GAS", 9))),
    *(Decision("great-britain-2022", driver, 39) for driver in ("LEC", "SAI", "HAM")),
    *(Decision("netherlands-2022", driver, lap) for driver, lap in (("HAM", 56), ("VER", 56), ("RUS", 57))),
    Decision("hungary-2022", "LEC", 39),
    *(Decision("singapore-2023", driver, 44) for driver in ("SAI", "RUS", "HAM")),
    *(Decision("italy-2024", driver, 38) for driver in ("LEC", "PIA")),
    *(Decision("canada-2025", driver, lap) for driver, lap in (("VER", 12), ("LEC", 28), ("RUS", 67))),
    *(Decision("monaco-2025", driver, lap) for driver, lap in (("NOR", 19), ("LEC", 22), ("VER", 28))),
)


def illustrate(
    policy: ExplainedPolicy, laps: Path, race: str, decisions: list[Decision], futures: int, seed: int
) -> Iterator[Illustration]:
    """The decisions of one race, and its figure."""
    table = read_lap_file(season_file(laps, int(race[-4:])), race)[1]
    record = load_race(race)
    finish = places_of(table)
    field = {car.driver: car for car in follow_field(lap_events(table), record, list(dict.fromkeys(d.driver for d in decisions)))}
    for number, decision in enumerate(decisions):
        known = field[decision.driver]
        observer = Observer(record, known.car)
        lap = next(lap for lap in known.laps if lap.lap == decision.lap)
        moment = moments(known, record, observer)[decision.lap]
        told = explain_what_if(policy, moment, races=futures, seed=seed, horizon_laps=HORIZON_LAPS, threads=1)
        if number == 0:
            figure, (axes,) = new_figure(7.0, 0.35 * len(told.labels) + 1.2)
            plot_what_if(told, axes)
            save_figure(
                figure, f"{record.event} {record.season}, {decision.driver}, lap {decision.lap}", FIGURES / f"illustration-{race}.png"
            )
        assert lap.state is not None
        yield illustration(decision, record, told, lap.state, str(lap.team), finish.get(decision.driver))


def illustration(
    decision: Decision, record: RaceRecord, told: Explanation, state: UnifiedRaceState, team: str, finish: int | None
) -> Illustration:
    """A decision as it is written."""
    now = {call: i for i, (call, ahead) in enumerate(zip(told.columns["call"], told.columns["in_laps"], strict=True)) if ahead == 0}
    row = now.get(ACTION_NAMES.index(team))
    judged = row is not None
    return Illustration(
        **decision._asdict(),
        track_status=state.track_status,
        position=next(car.position for car in state.cars if car.driver == decision.driver),
        finish=finish,
        team=team,
        call=told.decision.call,
        values={name: told.decision.q_values[name] for name in told.decision.legal},
        places=float(told.values[row]) if judged else None,
        ci95=(told.columns["low"][row], told.columns["high"][row]) if judged else None,
        verdict=told.columns["verdict"][row] if judged else "not possible",
        sentences=told.sentences,
        knows_race=OWN_RACE in record.track.base_lap_s.note,
    )


def main() -> int:
    """Make the result file and the figures; returns the exit code."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--laps", type=Path, required=True)
    parser.add_argument("--futures", type=int, default=500)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    policy = load_explained("all")
    found: list[Illustration] = []
    for race, decisions in groupby(DECISIONS, key=lambda decision: decision.race):
        found += illustrate(policy, options.laps, race, list(decisions), options.futures, options.seed)
        print(race, flush=True)
    result = Illustrations(
        model=policy.name,
        model_hash=policy.hash,
        futures=options.futures,
        seed=options.seed,
        decisions=tuple(found),
        provenance=provenance(options.seed, command=f"python benchmarks/illustrations.py --laps {options.laps}"),
    )
    RESULTS.write_text(to_json(result), encoding="utf-8")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
