"""Tables of the scripts that hold season files against real races; their results are in benchmarks/results."""

import math

from table_text import markdown

from rsrl.results import Interval, PassesRatio, PassesResult, known


def passes_table(result: PassesResult) -> str:
    """Passes by season: real, with the real stops, with rivals that decide; simulated ones with their ratio to real ones."""
    heads = ("dry races", "races", "real", "with the real stops", "ratio [95 %]", "rivals decide", "ratio [95 %]")
    rows = [[s.season, str(s.races), f"{s.real:.1f}", *_passes(s.real_stops), *_passes(s.rivals_decide)] for s in result.seasons]
    return markdown(heads, rows)


def _passes(simulated: PassesRatio) -> tuple[str, str]:
    ratio = math.nan if simulated.ratio is None else simulated.ratio
    return f"{simulated.passes:.1f}", f"{ratio:.2f} {ends(simulated.ci95)}".strip()


def ends(ci95: Interval, digits: int = 2, sign: str = "") -> str:
    """Both ends of an interval in brackets; nothing where they cannot be told."""
    both = known(ci95)
    return "" if both is None else f"[{both[0]:{sign}.{digits}f}, {both[1]:{sign}.{digits}f}]"
