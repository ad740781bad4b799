#!/usr/bin/env bash
# The published numbers of RSRL, made again: the shipped policy, the leaderboard, rivals, backtests, speed.
# Usage: benchmarks/remake.sh LAPS_FOLDER FACTS_FOLDER   (over an hour on two cores; results in benchmarks/results and docs/figures)
set -euo pipefail
laps=${1:?folder of the lap files}
facts=${2:?folder of the results}
rsrl train bahrain-2023 --agent rsrl --iterations 1000 --seed 0 --out runs/bahrain-2023
rsrl evaluate runs/bahrain-2023 --races 1920 --seed 7 \
    --strategists fixed,heuristic,imitation,best-plan,best-plan-sc --out runs/results
cp runs/results/evaluation.json benchmarks/results/leaderboard-bahrain-2023.json
rsrl evaluate runs/bahrain-2023 --races 16384 --seed 20230305 --json > benchmarks/results/leaderboard-fresh-seed.json
rsrl demo --out runs/demo && cp runs/demo/evaluation.json benchmarks/results/demo.json
python benchmarks/rivals.py --laps "$laps" --facts "$facts"
benchmarks/backtest.sh "$laps" "$facts"
python benchmarks/engine_ratio.py --rounds 120
rsrl bench --repeats 12 --train-seconds 20 --json > benchmarks/results/bench.json
taskset -c 0 rsrl bench --train-seconds 20 --json > benchmarks/results/bench-one-core.json
python benchmarks/dp_regained.py
python benchmarks/gap_parts.py --out benchmarks/results/gap-parts.json
