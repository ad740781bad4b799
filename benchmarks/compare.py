"""Two revisions side by side: `rsrl bench` of each in turn, several rounds, and the ratios.

    python benchmarks/compare.py OLD NEW [--rounds 3] [--out FILE]

OLD and NEW are anything git can name; `.` is the working tree as it stands. Both run in this Python environment, each
from its own checkout, A B A B ..., so that a drift of the machine's speed meets both.
"""

import argparse
import json
import os
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parent.parent
FIGURES = (
    ("simulator", "races_per_s"),
    ("simulator", "races_per_s_one_thread"),
    ("environment", "steps_per_s"),
    ("training", "steps_per_s"),
    ("decision", "ms"),
)


def checkout(revision: str, folder: Path) -> Path:
    """Sources of a revision: the working tree for `.`, else an archive of it in `folder`."""
    if revision == ".":
        return ROOT
    folder.mkdir()
    archive = subprocess.run(["git", "archive", revision], cwd=ROOT, check=True, capture_output=True).stdout
    subprocess.run(["tar", "-x", "-C", str(folder)], input=archive, check=True)
    return folder


def measure(source: Path) -> dict[str, Any]:
    """One `rsrl bench --json` of a checkout."""
    environment = os.environ | {"PYTHONPATH": str(source / "src")}
    command = [sys.executable, "-c", "from rsrl.cli import main; raise SystemExit(main())", "bench", "--json"]
    done = subprocess.run(command, env=environment, check=True, capture_output=True, text=True)
    result: dict[str, Any] = json.loads(done.stdout)
    return result


def main() -> int:
    """Measure both and print the medians and ratios; returns the exit code."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("old")
    parser.add_argument("new")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--out", type=Path)
    options = parser.parse_args()
    names = (options.old, options.new)
    with tempfile.TemporaryDirectory() as folder:
        sources = [checkout(name, Path(folder) / str(i)) for i, name in enumerate(names)]
        runs: list[list[dict[str, Any]]] = [[], []]
        for _ in range(options.rounds):
            for i in (0, 1):
                runs[i].append(measure(sources[i]))
    rows = []
    for group, figure in FIGURES:
        values = [[run[group][figure] for run in side] for side in runs]
        ratios = [new / old for old, new in zip(*values, strict=True)]
        row = {"figure": f"{group}.{figure}", "old": statistics.median(values[0]), "new": statistics.median(values[1])}
        rows.append(row | {"ratio": statistics.median(ratios), "ratio_min": min(ratios), "ratio_max": max(ratios)})
        print(f"{group + '.' + figure:38} {row['old']:14,.3f} {row['new']:14,.3f}   new/old {statistics.median(ratios):.3f}")
    if options.out:
        machine = runs[1][0]["provenance"]["machine"]
        content = {"old": names[0], "new": names[1], "rounds": options.rounds, "rows": rows, "machine": machine}
        options.out.write_text(json.dumps(content, indent=2) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
