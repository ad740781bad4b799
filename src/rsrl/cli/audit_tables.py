"""The tables of `rsrl audit`."""

from collections.abc import Mapping, Sequence

from rsrl.cli.output import Column, Shown, table
from rsrl.results import AuditedGroup, AuditMean, SeasonAudit, TeamCall, known

TEAM = "team"


def tables(result: SeasonAudit) -> list[Shown]:
    """An audit for people: the season, its teams, its races, the teams' costliest and shrewdest calls."""
    shown: list[Shown] = [_overall(result), _groups(result, "By team", result.by_team), _groups(result, "By race", result.by_race)]
    calls = _calls(result)
    if calls is not None:
        shown.append(calls)
    overall = result.overall
    shown.append(f"Call and team agree on {overall.laps_agreed} of {overall.laps_called} laps; illegal calls: {overall.illegal}.")
    knowing = sum(race.knows_race for race in result.races)
    shown.append(f"{knowing} of {len(result.races)} season files were fitted to the race that is audited among others.")
    return [*shown, *(f"Left out: {one.race}, {one.reason}." for one in result.left_out)]


def _overall(result: SeasonAudit) -> Shown:
    one = result.overall
    rows = []
    for name in (TEAM, *result.callers):
        means = (one.within_two_laps, result.more_often, one.same_compound, one.against_policy, one.regret)
        rows.append([name, *(_mean(m.get(name), sign) for m, sign in zip(means, ("", "+", "", "+", "+"), strict=True))])
    columns = (
        "",
        "first stop within 2 laps",
        Column("the policy's less it", 2),
        "same compound",
        "places lost to the policy",
        Column("regret", 1),
    )
    title = f"{result.season}, called by {result.model}: {one.races} races, {one.cars} cars, {result.rollouts} futures a lap"
    captions = ("places a car, against the policy's calls and, regret, against the best call made; [95 % over races]",)
    return table(title, columns, rows, left=1, captions=captions)


def _groups(result: SeasonAudit, title: str, groups: Sequence[AuditedGroup]) -> Shown:
    heads = [Column(f"{name} within 2", 2 if i else 0) for i, name in enumerate(result.callers)]
    columns: tuple[str | Column, ...] = ("", "cars", *heads, Column("compound", 1), "places lost by the team")
    rows = [
        [
            one.name,
            one.cars,
            *(_share(one.within_two_laps, name) for name in result.callers),
            _share(one.same_compound, result.model),
            _mean(one.against_policy.get(TEAM), "+"),
        ]
        for one in groups
    ]
    return table(title, columns, rows, left=1)


def _calls(result: SeasonAudit, most: int = 10) -> Shown | None:
    """The calls of teams that lost or gained most, of those whose interval excludes zero."""
    found: list[tuple[float, list[object]]] = []
    for race in result.races:
        for car in race.cars:
            for call in (car.costliest, car.shrewdest):
                if call is not None:
                    found.append((-abs(call.places), [race.race, car.driver, call.lap, *_told(call)]))
    if not found:
        return None
    rows = [row for _, row in sorted(found, key=lambda one: one[0])[:most]]
    title = "Calls of teams that lost or gained most by the simulator's futures"
    return table(title, ("race", "driver", "lap", "policy", "team", "places lost"), rows, left=2)


def _told(call: TeamCall) -> tuple[str, str, str]:
    return call.call, call.team, _mean(AuditMean(mean=call.places, ci95=call.ci95, of=1), "+")


def _share(means: Mapping[str, AuditMean], name: str) -> str:
    one = means.get(name)
    return "" if one is None or one.mean is None else f"{one.mean:.0%}"


def _mean(one: AuditMean | None, sign: str) -> str:
    if one is None or one.mean is None:
        return ""
    ends = known(one.ci95)
    return f"{one.mean:{sign}.2f}" + ("" if ends is None else f" [{ends[0]:{sign}.2f}, {ends[1]:{sign}.2f}]")
