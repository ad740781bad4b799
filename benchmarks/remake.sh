#!/usr/bin/env bash
# Every published number of RSRL, made again: the shipped policy, the paper's agents, the leaderboard, realism, speed.
# Usage: benchmarks/remake.sh LAPS_FOLDER   (about half an hour on two cores; results in benchmarks/results and docs/figures)
set -euo pipefail
laps=${1:?folder of the lap files}
rsrl train bahrain-2023 --agent rsrl --iterations 1000 --seed 0 --out runs/bahrain-2023
rsrl train bahrain-2023 --agent drqn --iterations 5464 --seed 0 --out runs/drqn
rsrl train bahrain-2023 --agent dqn --iterations 6799 --seed 0 --out runs/dqn
rsrl evaluate runs/bahrain-2023 --races 1920 --seed 7 \
    --strategists fixed,heuristic,best-plan,best-plan-sc,runs/drqn,runs/dqn --out runs/results
cp runs/results/evaluation.json benchmarks/results/leaderboard-bahrain-2023.json
rsrl evaluate runs/bahrain-2023 --races 16384 --seed 20230305 --json > benchmarks/results/leaderboard-fresh-seed.json
rsrl demo --out runs/demo && cp runs/demo/evaluation.json benchmarks/results/demo.json
python benchmarks/realism.py bahrain-2023 --laps "$laps"
rsrl bench --repeats 12 --train-seconds 20 --json > benchmarks/results/bench.json
taskset -c 0 rsrl bench --train-seconds 20 --json > benchmarks/results/bench-one-core.json
