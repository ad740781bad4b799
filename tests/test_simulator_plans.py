"""Plans: text there and back, and every way a plan can be wrong, each in one line."""

import dataclasses

import pytest
from hypothesis import given
from hypothesis import strategies as st
from synthetic_race import synthetic_race

from rsrl.errors import RsrlError
from rsrl.season import COMPOUNDS, RaceRecord
from rsrl.simulator import Plan, check_plan, simulate


@given(st.lists(st.tuples(st.integers(0, 2), st.integers(0, 999)), max_size=8), st.integers(0, 2))
def test_text_there_and_back(stops: list[tuple[int, int]], start: int) -> None:
    plan = Plan((start, *(c for c, _ in stops)), tuple(lap for _, lap in stops))
    assert Plan.parse(str(plan)) == plan
    assert Plan.parse(f"  {str(plan).lower()} ") == plan
    assert plan.stops == len(stops)


@given(st.text(max_size=12) | st.text(alphabet="SMH@-0123456789 ", max_size=14))
def test_any_text_is_a_plan_or_refused(text: str) -> None:
    try:
        plan = Plan.parse(text)
    except RsrlError:
        return
    assert set(plan.compounds) <= set(range(len(COMPOUNDS)))
    assert len(plan.compounds) == plan.stops + 1
    assert Plan.parse(str(plan)) == plan


@pytest.mark.parametrize(
    "text", ["", "-", "S-", "S-H", "S-H@", "S-@5", "S-H@5-", "SH@5", "S-HH@5", "S-H@-5", "S-H@5.5", "S-H@1000", "S H@5"]
)
def test_what_is_no_plan_does_not_parse(text: str) -> None:
    with pytest.raises(RsrlError, match="does not parse; write it as S-H@14-S@36") as caught:
        Plan.parse(text)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("text", "plan"),
    [
        ("S(14)-H(22)-S(21)", "S-H@14-S@36"),
        ("s(14)-h(22)-s(21)", "S-H@14-S@36"),
        ("S(14)-H(22)-S", "S-H@14-S@36"),
        ("Soft(14) - Hard(22) - C3(21)", "S-H@14-S@36"),
        ("SOFT-HARD@14", "S-H@14"),
        ("medium-hard@14", "M-H@14"),
        ("C3-C1@14", "S-H@14"),
        ("c3-c1@14-c2@40", "S-H@14-M@40"),
        ("S-C1@14", "S-H@14"),
        ("s - h@14", "S-H@14"),
    ],
)
def test_other_forms_are_the_same_plan(bahrain: RaceRecord, text: str, plan: str) -> None:
    assert str(Plan.parse(text, bahrain)) == plan
    check_plan(Plan.parse(text, bahrain), bahrain)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("S(14)-H(22)-S(20)", "its stints are 56 laps together, bahrain-2023 has 57"),
        ("S(57)-H(22)-S(21)", "its stints are 100 laps together, bahrain-2023 has 57"),
        ("S(14)-H-S(20)", r"does not parse; write it as S-H@14-S@36 .*or S\(14\)-H\(22\)-S\(21\)"),
        ("S(14)-H@36", "does not parse"),
        ("S(14)H(22)", "does not parse"),
        ("S()-H(2)", "does not parse"),
        ("SOFTT-H@14", "does not parse.*a tyre is S, soft, or a C-number of the race"),
        ("C5-C1@14", "unknown compound 'C5'; at bahrain-2023 S is C3, M is C2, H is C1"),
    ],
)
def test_what_does_not_fit_the_race_is_one_line(bahrain: RaceRecord, text: str, message: str) -> None:
    with pytest.raises(RsrlError, match=message) as caught:
        Plan.parse(text, bahrain)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("text", ["S(14)-H(22)-S(21)", "C3-C1@14"])
def test_forms_that_need_the_race_say_so(text: str) -> None:
    with pytest.raises(RsrlError, match=r"Plan.parse\(text, record\)"):
        Plan.parse(text)
    assert str(Plan.parse("S(14)-H(22)-S")) == "S-H@14-S@36", "the last stint needs no length"


@pytest.mark.parametrize("text", ["X-H@5", "S-W@5", "I-S@3"])
def test_unknown_compounds_are_named(text: str) -> None:
    with pytest.raises(RsrlError, match=r"unknown compound '[XWI]'; compounds are S, M, H"):
        Plan.parse(text)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("S-H@0", "stops must come in order, on laps 1 to 15"),
        ("S-H@16", "stops must come in order, on laps 1 to 15"),
        ("S-H@9-M@9", "stops must come in order"),
        ("S-H@9-M@4", "stops must come in order"),
        ("S", "needs two compounds"),
        ("S-S@8", "needs two compounds"),
        ("S-H@4-S@7-S@9", r"needs 3 sets of S, (a car|C00) has 2 at bahrain-2099; if there were more, say --sets (C00=)?S3M2H2$"),
        ("S-M@2-S@3-M@4-H@5-H@6-S@7-M@8-S@9-H@10", "9 stops; at most 8"),
    ],
)
def test_plans_against_the_rules_are_refused(text: str, message: str) -> None:
    record = synthetic_race()
    for check in (lambda p: check_plan(p, record), lambda p: simulate(record, 1, 1, plans={0: p})):
        with pytest.raises(RsrlError, match=message) as caught:
            check(Plan.parse(text))
        assert "\n" not in str(caught.value)


def test_a_stint_beyond_what_a_set_may_run_is_refused() -> None:
    record = synthetic_race(max_laps_per_set=9, plans=("S-H@8",))
    check_plan(Plan.parse("S-H@7"), record)
    check_plan(Plan.parse("S-H@9"), record)
    for text in ("S-H@6", "S-H@10", "S-H@3-M@13"):
        with pytest.raises(RsrlError, match="a set may run 9 laps at most"):
            check_plan(Plan.parse(text), record)


def test_a_plan_on_fewer_sets_than_the_rules_ask_for_is_refused() -> None:
    record = dataclasses.replace(synthetic_race(plans=("S-H@6-M@11",)), min_sets=3)
    check_plan(Plan.parse("S-H@7-S@12"), record)
    with pytest.raises(RsrlError, match=r"^plan S-H@6: bahrain-2099 asks for 3 sets at least, that is 2 stops$"):
        check_plan(Plan.parse("S-H@6"), record)
    with pytest.raises(RsrlError, match="S-H@6: bahrain-2099 asks for 3 sets"):
        simulate(dataclasses.replace(synthetic_race(plans=("S-H@6",)), min_sets=3), 1, 1)


def test_a_field_beyond_the_compiled_one_is_refused() -> None:
    with pytest.raises(RsrlError, match=r"^bahrain-2099: 25 cars; the simulated race has room for 24$"):
        simulate(synthetic_race(cars=25), 1, 1)


def test_a_rival_plan_against_the_rules_is_refused() -> None:
    with pytest.raises(RsrlError, match="S-S@8: a dry race needs two compounds"):
        simulate(synthetic_race(plans=("S-H@6", "S-S@8")), 1, 1)
