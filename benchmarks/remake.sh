#!/usr/bin/env bash
# The published numbers of RSRL, made again: the shipped policy, the leaderboard, rivals, backtests, speed.
# Usage: benchmarks/remake.sh LAPS_FOLDER FACTS_FOLDER   (over an hour on two cores; results in benchmarks/results and docs/figures)
set -euo pipefail
laps=${1:?folder of the lap files}
facts=${2:?folder of the results}
rsrl train all --iterations 900 --seed 0 --out runs/all
rsrl train bahrain-2023 --iterations 250 --seed 0 --out runs/bahrain-2023
for agent in dqn drqn; do
    rsrl train bahrain-2023 --agent $agent --iterations 50000 --seed 0 --out runs/$agent
    cp runs/$agent/log.jsonl benchmarks/results/training/$agent.jsonl
done
rsrl evaluate bahrain-2023 --races 1920 --seed 7 \
    --strategists all,fixed,heuristic,imitation,dp,best-plan,best-plan-sc,planner,hindsight --out runs/results
cp runs/results/evaluation.json benchmarks/results/leaderboard-bahrain-2023.json
rsrl evaluate bahrain-2023 --races 16384 --seed 20230305 --strategists all,fixed,heuristic,dp,best-plan,best-plan-sc --json \
    > benchmarks/results/leaderboard-fresh-seed.json
rsrl evaluate runs/drqn --races 1920 --seed 7 --strategists runs/dqn,fixed --json > benchmarks/results/leaderboard-paper-agents.json
rsrl study generalise --models all=all --strategists fixed,heuristic,imitation,dp,hindsight --races 960 --seed 7 --out runs/study
cp runs/study/generalise.json runs/study/table3.md benchmarks/results/
rsrl study generalise --models all=all --strategists heuristic,imitation,dp --races 960 --seed 7 --tracks bahrain,spain \
    --cars bahrain,spain --cars-by all,heuristic,imitation,dp --held-out --out runs/held-out
cp runs/held-out/generalise.json benchmarks/results/held-out-and-cars.json
rsrl study robustness all --race bahrain-2023 --races 960 --draws 8 --strategists heuristic,dp --seed 7 --out runs/robustness
cp runs/robustness/robustness.json benchmarks/results/
rsrl demo --out runs/demo && cp runs/demo/evaluation.json benchmarks/results/demo.json
python benchmarks/rivals.py --laps "$laps" --facts "$facts"
benchmarks/backtest.sh "$laps" "$facts"
python benchmarks/engine_ratio.py --rounds 120
rsrl bench --repeats 6 --train-seconds 12 --json > benchmarks/results/bench.json
taskset -c 0 rsrl bench --repeats 4 --train-seconds 10 --json > benchmarks/results/bench-one-core.json
python benchmarks/dp_regained.py
python benchmarks/gap_parts.py --out benchmarks/results/gap-parts.json
