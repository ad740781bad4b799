"""How much rollouts improve on the network, by their number: what the strategist `search` bases its weights on.

    python benchmarks/worth_of_thinking.py [--races 64] [--futures 2048] [--seed 1000033] [--out FILE]

`all` drives; at each of its decisions with a close second call the race is run on with every call near the best. One half of the futures
chooses, by the rule of the strategist `search` with so many of them at most; the other half tells what the choice is worth. So no future
is judged by itself, and what is measured is the gain of one changed call with the network calling the rest, summed over the race.
"""

import argparse
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rsrl.agents import load_agent
from rsrl.cli.files import write_json
from rsrl.cli.provenance import provenance
from rsrl.environment import RaceEnvironment
from rsrl.results import CloseDecisions, RolloutGain, WorthOfThinking
from rsrl.rollouts import PaceFilter
from rsrl.season import GREEN, find_car, load_race
from rsrl.simulator import compile_figures
from rsrl.simulator import layout as at
from rsrl.state import Encoder
from rsrl.statistics import half_width
from rsrl.strategists import PolicySearchStrategist, SearchSettings, find_model
from rsrl.strategists.lookahead.value_of_information import choose_call

RACES = ("bahrain-2023", "singapore-2023", "japan-2023")
MOST = (64, 256, 512, 1024)
NEAR = {"racing": 0.4, "slow": 1.2}
"""Calls further behind the network's best, in places, are not run on."""


@dataclass
class Decision:
    """One decision looked into: how the network's best two calls differ; and by number of futures, places won and rollouts."""

    kind: str
    network: float
    futures: float
    variance: float
    won: list[float]
    rollouts: list[int]


def look_into(q: NDArray[np.float32], near: NDArray[np.bool_], places: NDArray[np.float32], kind: str) -> Decision:
    """Decide by the first half of `places` [futures, 4], judge by the second; `q` [4] are minus places."""
    half = len(places) // 2
    settings, judge = SearchSettings(), places[half:].mean(axis=0, dtype=np.float64)
    own = int(np.where(near, q, -np.inf).argmax())
    second = int(np.where(near & (np.arange(4) != own), q, -np.inf).argmax())
    difference = (places[:, second] - places[:, own]).astype(np.float64)
    won, rollouts = [], []
    for most in MOST:
        ran = 0

        def run(calls: NDArray[np.int64], first: int, futures: int) -> NDArray[np.float32]:
            nonlocal ran
            ran += futures * len(calls)
            return places[first : first + futures, calls]

        errors = settings.green if kind == "racing" else settings.caution
        call, _ = choose_call(q, near, run, errors, min_value=settings.min_value, batch=settings.batch, max_futures=min(most, half))
        won.append(float(judge[own] - judge[call]))
        rollouts.append(ran)
    return Decision(kind, float(q[own] - q[second]), float(difference.mean()), float(difference.var()), won, rollouts)


def decisions_of(name: str, races: int, futures: int, seed: int) -> list[Decision]:
    """Every decision with a close second call in so many races of a track, called by `all` for the default car."""
    record = load_race(name)
    car, agent = find_car(record, None), load_agent(find_model("all"))[0]
    rollouts, figures = PolicySearchStrategist(agent, record, car, 0).rollouts(), compile_figures(record)
    encoder, environment = Encoder(agent.feature_set, record.scaling), RaceEnvironment(record, car, batch=races)
    environment.reset(seed, np.arange(races, dtype=np.int64))
    b, found, watch = environment.races, [], PaceFilter(figures, races)
    for lap in range(record.laps):
        watch.update(b.f, b.k, b.r)
        q = agent.q_values(encoder(environment.raw), agent.initial_memory(races))[0]
        legal = np.where(environment.legal, q, -np.inf)
        for i in np.flatnonzero(~environment.done):
            kind = "racing" if b.r[i, at.R_STATUS] == GREEN else "slow"
            near = legal[i] >= legal[i].max() - NEAR[kind]
            if near.sum() > 1:
                calls, places = np.flatnonzero(near), np.zeros((futures, 4), np.float32)
                own_seed = seed + 1_000 * int(i) + lap
                places[:, calls] = rollouts.run((b.f[i], b.k[i], b.r[i]), watch.belief[i], calls, seed=own_seed, first=0, futures=futures)
                found.append(look_into(q[i], near, places, kind))
        environment.step(legal.argmax(axis=1).astype(np.int8))
        print(f"{name}: lap {lap + 1} of {record.laps}, {len(found)} decisions", end="\r", file=sys.stderr)
    return found


def figures_of(found: list[Decision], races: int, futures: int) -> CloseDecisions:
    """Figures of the decisions of one kind."""
    network, mean, variance = (np.array([getattr(d, name) for d in found]) for name in ("network", "futures", "variance"))
    error = mean - network
    won = np.array([d.won for d in found])
    return CloseDecisions(
        decisions_a_race=len(found) / races,
        network_sd=float(np.sqrt(max(error.var() - (variance / futures).mean(), 0.0))),
        network_bias=float(error.mean()),
        future_sd=float(np.sqrt(variance.mean())),
        by_futures={
            str(most): RolloutGain(
                places_won_a_race=float(won[:, j].sum() / races),
                half_width=float(half_width(won[:, j])) * len(found) / races,
                rollouts_a_race=sum(d.rollouts[j] for d in found) / races,
            )
            for j, most in enumerate(MOST)
        },
    )


def main() -> None:
    """Measure, print, write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--races", type=int, default=64)
    parser.add_argument("--futures", type=int, default=2048)
    parser.add_argument("--seed", type=int, default=1_000_033)
    parser.add_argument("--out", type=Path, default=Path("benchmarks/results/worth-of-thinking.json"))
    options = parser.parse_args()
    tracks: dict[str, dict[str, CloseDecisions]] = {}
    for name in RACES:
        found = decisions_of(name, options.races, options.futures, options.seed)
        kinds = {kind: [d for d in found if d.kind == kind] for kind in NEAR}
        tracks[name] = {kind: figures_of(some, options.races, options.futures) for kind, some in kinds.items() if some}
        for kind, figures in tracks[name].items():
            gains = ", ".join(f"{most}: {row.places_won_a_race:.3f} ± {row.half_width:.3f}" for most, row in figures.by_futures.items())
            off = f"network off by {figures.network_sd:.2f}, a future by {figures.future_sd:.2f}"
            print(f"{name} {kind}: {off}; places won a race by futures at most: {gains}")
    command = f"python benchmarks/worth_of_thinking.py --races {options.races} --futures {options.futures} --seed {options.seed}"
    write_json(options.out, WorthOfThinking(options.races, options.futures, tracks, provenance(options.seed, command=command)))


if __name__ == "__main__":
    main()
