#!/usr/bin/env bash
# The published numbers of RSRL, made again: the shipped policy, the leaderboard, rivals, backtests, speed, and the tables of README and docs.
# Usage: benchmarks/remake.sh LAPS_FOLDER FACTS_FOLDER   (over an hour on two cores; results in benchmarks/results and docs/figures)
set -euo pipefail
laps=${1:?folder of the lap files}
facts=${2:?folder of the results}
rsrl train all --iterations 900 --seed 0 --out runs/all
for seed in 1 2; do rsrl train all --iterations 900 --seed $seed --out runs/all-$seed; done
rsrl train bahrain-2023 --iterations 250 --seed 0 --out runs/bahrain-2023
for seed in 1 2 3 4; do rsrl train bahrain-2023 --iterations 250 --seed $seed --out runs/bahrain-2023-$seed; done
for name in rsrl-1 rsrl-2 rsrl-9; do rsrl train $name --iterations 300 --seed 0 --out runs/$name; done
for agent in dqn drqn; do
    rsrl train bahrain-2023 --agent $agent --iterations 50000 --seed 0 --out runs/$agent
    for seed in 1 2 3 4; do rsrl train bahrain-2023 --agent $agent --iterations 50000 --seed $seed --out runs/$agent-$seed; done
    cp runs/$agent/log.jsonl benchmarks/results/training/$agent.jsonl
done
python benchmarks/paper_agent_curves.py runs/drqn runs/drqn-1 runs/drqn-2 runs/drqn-3 runs/drqn-4
cp runs/all/log.jsonl benchmarks/results/training/all.jsonl
cp runs/bahrain-2023/log.jsonl benchmarks/results/training/rsrl.jsonl
rsrl evaluate bahrain-2023 --races 1920 --seed 7 \
    --strategists all,search,tree,fixed,heuristic,imitation,dp,best-plan,best-plan-sc,planner,hindsight --out runs/results
cp runs/results/evaluation.json benchmarks/results/leaderboard-bahrain-2023.json
seeds=bahrain-2023,runs/bahrain-2023-1,runs/bahrain-2023-2,runs/bahrain-2023-3,runs/bahrain-2023-4
rsrl evaluate $seeds --races 1920 --seed 7 --strategists fixed,heuristic,dp,best-plan-sc --json > benchmarks/results/seeds-bahrain-2023.json
rsrl evaluate all,runs/all-1,runs/all-2 --race bahrain-2023 --races 1920 --seed 7 --strategists fixed,heuristic,dp,best-plan-sc --json \
    > benchmarks/results/seeds-all.json
rsrl evaluate bahrain-2023 --races 16384 --seed 20230305 --strategists all,tree,fixed,heuristic,dp,best-plan,best-plan-sc --json \
    > benchmarks/results/leaderboard-fresh-seed.json
rsrl evaluate runs/drqn --races 1920 --seed 7 --strategists runs/dqn,fixed --json > benchmarks/results/leaderboard-paper-agents.json
for agent in dqn drqn; do
    rsrl evaluate runs/$agent,runs/$agent-1,runs/$agent-2,runs/$agent-3,runs/$agent-4 --races 1920 --seed 424243 \
        --strategists fixed,best-plan,heuristic,dp --json > benchmarks/results/seeds-$agent.json
done
rsrl evaluate bahrain-2023 --races 96 --seed 7 --strategists all,planner-1s,planner,dp --json > benchmarks/results/planner-1s.json
rsrl study generalise --models rsrl-1=runs/rsrl-1,rsrl-2=runs/rsrl-2,rsrl-9=runs/rsrl-9,all=all \
    --strategists fixed,heuristic,imitation,dp,best-plan,best-plan-sc,planner,hindsight --races 960 --races-of planner=480 --seed 7 --out runs/study2
cp runs/study2/generalise.json benchmarks/results/
cp runs/study2/strategies-japan-2023.png docs/figures/
rsrl study generalise --models all=all,all-1=runs/all-1,all-2=runs/all-2 \
    --strategists fixed,heuristic,imitation,dp,search,best-plan,best-plan-sc,planner,hindsight --races 960 --races-of planner=480 --seed 7 --out runs/study3
cp runs/study3/generalise.json benchmarks/results/generalise-search.json
python benchmarks/worth_of_thinking.py
rsrl study generalise --models all=all --strategists heuristic,imitation,dp --races 960 --seed 7 --tracks bahrain,spain \
    --cars bahrain,spain --cars-by all,heuristic,imitation,dp --held-out --out runs/held-out2
cp runs/held-out2/generalise.json benchmarks/results/held-out-and-cars.json
rsrl study explanations all --race bahrain-2023 --races 100 --seed 880301 --json > benchmarks/results/explanations.json
python benchmarks/figures.py
rsrl study robustness all --race bahrain-2023 --races 960 --draws 8 --strategists heuristic,dp --seed 7 --out runs/robustness
cp runs/robustness/robustness.json benchmarks/results/
rsrl demo --out runs/demo && cp runs/demo/evaluation.json benchmarks/results/demo.json
python benchmarks/rivals.py --laps "$laps" --facts "$facts"
benchmarks/backtest.sh "$laps" "$facts"
rsrl audit --season 2023 --laps "$laps" --out runs/audit-2023
cp runs/audit-2023/audit.json benchmarks/results/audit-2023.json
cp runs/audit-2023/audit.png docs/figures/audit-2023.png
python benchmarks/illustrations.py --laps "$laps"
python benchmarks/engine_ratio.py --rounds 120
rsrl bench --repeats 6 --train-seconds 12 --json > benchmarks/results/bench.json
taskset -c 0 rsrl bench --repeats 4 --train-seconds 10 --json > benchmarks/results/bench-one-core.json
python benchmarks/dp_regained.py
python benchmarks/gap_parts.py --out benchmarks/results/gap-parts.json
python benchmarks/tables.py
