"""Tables of docs/illustrations.md and docs/audit.md: famous decisions, and audited seasons."""

from collections.abc import Callable, Mapping
from pathlib import Path

from season_tables import ends
from table_text import markdown

from rsrl.results import AuditedGroup, AuditMean, Illustration, Illustrations, SeasonAudit, read_result

RESULTS = Path(__file__).parent / "results"
SHORT = {"no pit": "stay out", "pit soft": "box, soft", "pit medium": "box, medium", "pit hard": "box, hard"}
STATUS = ("", "VSC", "SC", "red")
SEASONS = (2023,)
RACES = (
    "bahrain-2023", "great-britain-2022", "netherlands-2022", "hungary-2022", "singapore-2023", "italy-2024", "canada-2025", "monaco-2025",
)  # fmt: skip


def illustrations(race: str) -> str:
    """The decisions of a race: calls, verdict, and the explanation of each."""
    result = read_result(RESULTS / "illustrations.json", Illustrations, "benchmarks/illustrations.py")
    decisions = [one for one in result.decisions if one.race == race]
    heads = ("", "lap", "track", "place", "team", "`all`", "its margin", "the team's call is", "places lost by it [95 %]", "finished")
    rows = [
        [
            one.driver,
            str(one.lap),
            STATUS[one.track_status],
            f"P{one.position}",
            SHORT[one.team],
            SHORT[one.call],
            _margin(one),
            "the same" if one.verdict == "itself" else one.verdict,
            "" if one.places is None or one.verdict == "itself" else f"{one.places:+.2f} {ends(one.ci95, 2, '+') if one.ci95 else ''}",
            "out" if one.finish is None else f"P{one.finish}",
        ]
        for one in decisions
    ]
    told = "\n".join(f"- {' '.join(one.sentences)}" for one in decisions)
    return f"{markdown(heads, rows)}\n{told}\n"


def _margin(one: Illustration) -> str:
    others = [value for name, value in one.values.items() if name != one.call]
    return f"{one.values[one.call] - max(others):.2f}" if others else ""


def audit(season: int) -> str:
    """An audited season: the team and each caller."""
    result = _audit(season)
    one = result.overall
    rows = []
    for name in ("team", *result.callers):
        means = ((one.within_two_laps, ""), (result.more_often, "+"), (one.same_compound, ""), (one.against_policy, "+"), (one.regret, "+"))
        rows.append([name if name == "team" else f"`{name}`", *(_mean(by_name.get(name), sign) for by_name, sign in means)])
    heads = (
        f"{season}, {one.races} races, {one.cars} cars", "first stop within two laps", "`all` less it", "same compound",
        "places lost to `all`", "regret, places",
    )  # fmt: skip
    return markdown(heads, rows)


def audit_groups(season: int, of: Callable[[SeasonAudit], tuple[AuditedGroup, ...]]) -> str:
    """An audited season by race or by team."""
    result = _audit(season)
    rows = [
        [
            one.name,
            str(one.cars),
            f"{one.laps_called}",
            *(_share(one.within_two_laps, name) for name in result.callers),
            _share(one.same_compound, result.model),
            *(_mean(one.against_policy.get(name), "+") for name in ("team", *result.callers[1:])),
        ]
        for one in of(result)
    ]
    heads = (
        "", "cars", "laps called", *(f"`{name}` within two" for name in result.callers), "`all`, compound",
        *(f"{name} lost, places" for name in ("team", *(f"`{name}`" for name in result.callers[1:]))),
    )  # fmt: skip
    return markdown(heads, rows)


def _audit(season: int) -> SeasonAudit:
    return read_result(RESULTS / f"audit-{season}.json", SeasonAudit, "rsrl audit")


def _share(means: Mapping[str, AuditMean], name: str) -> str:
    one = means.get(name)
    return "" if one is None or one.mean is None else f"{one.mean:.0%}"


def _mean(one: AuditMean | None, sign: str) -> str:
    return "" if one is None or one.mean is None else f"{one.mean:{sign}.2f} {ends(one.ci95, 2, sign)}".strip()


TABLES: dict[str, Callable[[], str]] = {
    **{f"illustrations-{race}": (lambda race=race: illustrations(race)) for race in RACES},
    **{f"audit-{season}": (lambda season=season: audit(season)) for season in SEASONS},
    **{f"audit-races-{season}": (lambda season=season: audit_groups(season, lambda one: one.by_race)) for season in SEASONS},
    **{f"audit-teams-{season}": (lambda season=season: audit_groups(season, lambda one: one.by_team)) for season in SEASONS},
}
"""Tables of docs that are made here, by name."""
