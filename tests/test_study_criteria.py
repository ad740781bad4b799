"""The paper's criteria of a reasonable strategy, on cases worked by hand; its own examples among them."""

import numpy as np
import pytest

from rsrl.evaluation.study.criteria import Reference, few_stops, harder_longer, harder_longer_a_set, judge, similar, window_text
from rsrl.evaluation.study.estimates import Run
from rsrl.results import CriteriaShares, DrivenStrategy
from rsrl.simulator import Plan


def plan(text: str) -> Plan:
    return Plan.parse(text)


def strategy(text: str) -> DrivenStrategy:
    compounds, laps = plan(text).compounds, plan(text).laps
    return DrivenStrategy(0.5, 1, compounds, laps, tuple((lap, lap) for lap in laps), 5.0, text)


def run_of(driven: list[str], common: list[str], retired: list[int] | None = None, laps: int = 57, position: float = 6.5) -> Run:
    """A run of these strategies whose finishing positions alternate around `position`."""
    zeros = np.zeros(len(driven))
    told = tuple(strategy(text) for text in common)
    return Run(around(position, len(driven)), zeros, zeros, zeros, np.array(retired or zeros), tuple(driven), laps, told, 0.1)


def around(position: float, races: int) -> np.ndarray:
    return position + 0.5 * (-1.0) ** np.arange(races)


def reference(name: str, strategies: list[str], position: float, races: int = 5) -> Reference:
    return Reference(name, tuple(map(plan, strategies)), around(position, races))


@pytest.mark.parametrize(("text", "met"), [("S", False), ("S-H@20", True), ("S-H@10-S@20-H@30", True), ("S-H@5-S@15-H@25-M@40", False)])
def test_between_one_and_three_stops(text: str, met: bool) -> None:
    assert few_stops(plan(text)) == met


@pytest.mark.parametrize(
    ("text", "laps", "met", "a_set"),
    [
        ("S-H@20", 57, True, True),  # 20 soft, 37 hard
        ("M-S@19", 53, False, False),  # the paper's RSRL-1 in Japan, M[16,22]S: "the soft tyre is used for longer than the medium"
        ("M-S@29", 57, True, True),  # 29 medium, 28 soft
        ("M-H@28", 56, False, False),  # as many laps are not more
        ("S-H@18-S@38", 57, False, True),  # 18 + 19 soft, 20 hard: more soft in all, yet the hard set runs longest
        ("S-M@10-H@40", 60, True, True),  # hardest 20, softest 10; the medium's 30 do not matter
        ("M-M@20", 57, False, False),  # one compound alone
    ],
)
def test_a_harder_compound_for_more_laps(text: str, laps: int, met: bool, a_set: bool) -> None:
    assert harder_longer(plan(text), laps) == met
    assert harder_longer_a_set(plan(text), laps) == a_set


@pytest.mark.parametrize(
    ("one", "other", "alike"),
    [
        ("S-H@15", "S-H@20", True),
        ("S-H@15", "S-H@21", False),
        ("S-H@15", "H-S@17", True),  # whatever the order
        ("S-H@15", "M-H@15", False),
        ("S-H@15-S@40", "S-H@15", False),
        ("S-H@15-S@40", "S-H@16-H@44", True),  # the same two compounds
        ("S-H@15-S@40", "S-H@16-H@46", False),
    ],
)
def test_likeness_of_strategies(one: str, other: str, alike: bool) -> None:
    assert similar(plan(one), plan(other)) == alike
    assert similar(plan(other), plan(one)) == alike


def test_a_run_is_judged_on_its_commonest_strategy_and_race_by_race() -> None:
    fixed = reference("fixed", ["S-H@18", "M-H@25"], 6.0)
    best = reference("planner", ["S-H@30-H@40"], 5.0)
    run = run_of(["S-H@20", "S-H@20", "S-H@40", "M-S@28-H@29-S@30-H@31", "S-H@1"], ["S-H@20"], [0, 0, 0, 0, 1])
    verdict = judge(run, [fixed, best])
    assert verdict is not None
    assert verdict.strategy == "S-H@20"
    assert (verdict.few_stops, verdict.harder_longer, verdict.like_or_better, verdict.reasonable) == (True, True, True, True)
    assert (verdict.similar_to, verdict.better_than) == (("fixed",), ())
    # of four finished: three with one stop; hard longer in two (20/37, 20/37), soft in one, and in the last hard 27, soft 2;
    # the first two are like fixed's
    assert verdict.shares == CriteriaShares(
        few_stops=0.75, harder_longer=0.75, like_or_better=0.5, reasonable=0.5, harder_longer_a_set=0.75
    )


@pytest.mark.parametrize(
    ("position", "better_than", "met"),
    [
        (6.5, [], False),
        (5.5, ["fixed"], False),  # ahead of the worst baseline is not enough: nearly everybody is
        (4.5, ["fixed", "planner"], True),
    ],
)
def test_a_strategy_unlike_the_baselines_must_finish_ahead_of_all_of_them(position: float, better_than: list[str], met: bool) -> None:
    references = [reference("fixed", ["S-H@18"], 6.0), reference("planner", [], 5.0)]
    verdict = judge(run_of(["M-H@20"] * 5, ["M-H@20"], position=position), references)
    assert verdict is not None
    assert (verdict.similar_to, verdict.better_than, verdict.like_or_better) == ((), tuple(better_than), met)
    assert (verdict.reasonable, verdict.shares.like_or_better, verdict.shares.reasonable) == (met, met, met)


def test_a_lead_within_the_noise_is_none() -> None:
    noisy = np.array([3.0, 9.0, 5.0, 8.0, 4.0])
    run = run_of(["M-H@20"] * 5, ["M-H@20"], position=5.5)
    assert run.position.mean() < noisy.mean()
    verdict = judge(run, [Reference("fixed", (), noisy)])
    assert verdict is not None
    assert (verdict.better_than, verdict.like_or_better) == ((), False)


def test_without_references_the_third_criterion_is_not_judged() -> None:
    verdict = judge(run_of(["M-H@20"], ["M-H@20"]), [])
    assert verdict is not None
    assert verdict.like_or_better is verdict.reasonable is verdict.shares.reasonable is None
    assert verdict.harder_longer is True
    assert judge(run_of(["M-H@20"], [], [1]), []) is None, "no race finished"


def test_strategies_are_written_as_in_the_paper() -> None:
    assert window_text("S-M@15", [[10, 20]]) == "S[10,20]M"
    assert window_text("M-S@38-S@41-S@42", [[38, 39], [41, 41], [42, 42]]) == "M[38,39]S[41]S[42]S"
