"""How long a call takes: from the last event of a lap, or of any other change, to the state and the call that it brings about.

    python benchmarks/call_latency.py SOURCE --driver HAM [--race RACE] [--season-from RACE]

SOURCE is any that `rsrl replay` reads. CPU time of taking in each event that makes at least one look at the race, compilation left out;
and of every other event.
"""

import argparse
import statistics
import sys
import time

from rsrl.explanation import load_any_policy
from rsrl.feeds.anomalies import Anomalies
from rsrl.feeds.recordings import open_source
from rsrl.replay import Asked, CarWatch
from rsrl.replay.follow import Look

WARM = 3
"""Events with a look that are left out, since kernels are compiled on them."""


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("source")
    parser.add_argument("--driver", required=True)
    parser.add_argument("--race")
    parser.add_argument("--season-from")
    arguments = parser.parse_args()
    looks: list[Look] = []
    source = open_source(arguments.source, Anomalies(), arguments.race)
    asked = Asked(None if source.kind == "lap file" else arguments.race, arguments.driver, arguments.season_from)
    watch = CarWatch(asked, load_any_policy("all"), source.stale_after_s, lambda _driver, _lap, look: looks.append(look))
    with_call, without = [], []
    for event in list(source.events):
        looks.clear()
        begun = time.process_time()
        watch.take(event)
        took_ms = 1000 * (time.process_time() - begun)
        if any(look.called for look in looks):
            with_call.append(took_ms)
        elif not looks:
            without.append(took_ms)
    with_call = with_call[WARM:]
    for name, times in (("events with a call", with_call), ("other events", without)):
        ordered = sorted(times)
        worst = ordered[int(0.99 * (len(ordered) - 1))]
        print(f"{name:20} {len(times):7,}  median {statistics.median(times):8.3f} ms  99 % {worst:8.3f} ms  most {ordered[-1]:8.3f} ms")
    return 0


if __name__ == "__main__":
    sys.exit(main())
