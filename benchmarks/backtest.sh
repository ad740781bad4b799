#!/usr/bin/env bash
# Every figure of docs/realism.md made again: the backtests, their ablations, the season table, the pictures.
# Usage: benchmarks/backtest.sh LAPS_FOLDER FACTS_FOLDER
set -euo pipefail
laps=${1:?folder of the lap files}
facts=${2:?folder of the results}
results=benchmarks/results
for mode in forecast replay hindsight; do
    rsrl backtest --laps "$laps" --facts "$facts" --fit 2022,2023 --test 2024 --mode $mode --out $results/backtest-2024-$mode.json --force
    rsrl backtest --laps "$laps" --facts "$facts" --fit 2022 --test 2023 --mode $mode --out $results/backtest-2023-$mode.json --force
done
rsrl backtest --laps "$laps" --facts "$facts" --fit 2022,2023 --test 2024 --mode plans --races 200 --force --out $results/backtest-2024-plans.json
rsrl backtest --laps "$laps" --facts "$facts" --fit 2022 --test 2023 --mode plans --races 200 --force --out $results/backtest-2023-plans.json
for mode in replay hindsight; do
    for part in traffic safety-cars wear; do
        rsrl backtest --laps "$laps" --facts "$facts" --fit 2022,2023 --test 2024 --mode $mode --without $part \
            --out $results/backtest-2024-$mode-without-$part.json --force
    done
done
rsrl backtest --laps "$laps" --facts "$facts" --fit 2022,2023,2024 --test 2025 --mode forecast --out $results/backtest-2025-forecast.json --force
rsrl backtest --laps "$laps" --facts "$facts" --fit 2022,2023,2024 --test 2025 --mode plans --races 200 --force --out $results/backtest-2025-plans.json
python benchmarks/season_table.py 2023 --laps "$laps" --facts "$facts"
seasons="2022 2023 2024"
python benchmarks/passes.py $seasons --laps "$laps" --facts "$facts"
python benchmarks/own_race_plans.py $seasons --laps "$laps" --facts "$facts"
python benchmarks/published_plans.py 2023 --laps "$laps" --facts "$facts"
python benchmarks/late_laps.py 2024 --fit 2022 2023 --laps "$laps" --facts "$facts"
python benchmarks/how_real.py --laps "$laps" --facts "$facts"
python benchmarks/realism_tables.py
