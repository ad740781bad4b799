"""The call on the wall is the call of `rsrl explain`, and the figures beside it are what they say."""

import numpy as np
import pytest
from wall_races import RACE, SEED, policy, simulated, simulated_source

from rsrl.errors import RsrlError
from rsrl.explanation import Moment, explain_what_if, reach
from rsrl.season import RaceRecord
from rsrl.simulator import layout as at
from rsrl.state import COLUMN, Observer
from rsrl.wall.ahead import Ahead, called_for, field_of
from rsrl.wall.calls import CALL_FUTURES, Caller
from rsrl.wall.card import card
from rsrl.wall.explanations import Asked, Explainer, possible
from rsrl.wall.messages import CALLS, CallMessage
from rsrl.wall.pit_window import MARGIN_S, gap_chart, window
from rsrl.wall.race_log import Look

LAP = 16


def look_at(driver: str, lap: int) -> Look:
    look = simulated().log.look_for(driver, lap, 1e9)
    assert look is not None
    return look


def moment_at(driver: str, lap: int) -> Moment:
    look = look_at(driver, lap)
    assert look.moment is not None
    return look.moment()


@pytest.fixture(scope="module")
def observer(bahrain: RaceRecord) -> Observer:
    return Observer(bahrain, bahrain.car_index("HAM"))


@pytest.fixture(scope="module")
def full() -> CallMessage:
    return Caller("s1", policy(), SEED).call("HAM", look_at("HAM", LAP), "full")


def test_the_call_is_that_of_rsrl_explain(full: CallMessage, bahrain: RaceRecord) -> None:
    car, number = bahrain.car_index("HAM"), simulated_source().head.race_number or 0
    moment = reach(policy().strategist(bahrain), bahrain, car, LAP, seed=SEED, race=number)
    decided = policy().decide(moment)
    assert full.words == "stay out"
    assert decided.call == "no pit"
    assert {o.call: o.value for o in full.options} == {
        call: round(decided.q_values[name], 3) for call, name in zip(CALLS, decided.q_values, strict=True)
    }
    found = explain_what_if(policy(), moment, races=CALL_FUTURES, seed=SEED, horizon_laps=0)
    places = [0.0 if option.places is None else option.places.mean for option in full.options]
    assert places == [round(float(value), 3) for value in found.values]
    assert [option.verdict for option in full.options] == list(found.columns["verdict"])
    assert full.options[0].verdict == "itself"


def test_the_call_compares_with_the_best_other(full: CallMessage) -> None:
    assert full.lead is not None
    assert full.lead.mean == min(o.places.mean for o in full.options[1:] if o.places is not None)
    assert full.lead.low < full.lead.mean < full.lead.high
    assert full.no_difference is (next(o for o in full.options if o.call == full.versus).verdict in ("equal", "undecided"))
    assert full.finish is not None
    assert sum(full.finish.shares) == pytest.approx(1.0, abs=0.002)


def test_the_policy_is_heard_before_its_futures() -> None:
    first = Caller("s1", policy(), SEED).call("HAM", look_at("HAM", LAP), "policy")
    assert (first.stage, first.call, first.futures, first.rejoin, first.card, first.lead) == ("policy", "stay", 0, None, None, None)
    assert first.gaps
    assert first.pit_loss is not None
    assert first.pit_loss.green_s > first.pit_loss.vsc_s > first.pit_loss.sc_s > 0


def test_a_look_without_a_decision_gives_its_reason() -> None:
    message = Caller("s1", policy(), SEED).call("ZHO", simulated().log.looks["ZHO"][-1], "policy")
    assert message.call is None
    assert message.stage == "full"
    assert "out of the race" in message.reason


def test_the_gap_chart_agrees_with_the_features(observer: Observer) -> None:
    moment = moment_at("HAM", LAP)
    chart = gap_chart(moment, observer)
    own = next(i for i, car in enumerate(chart) if car.driver == "HAM")
    row = moment.raw[-1]
    assert chart[own].gap_s == chart[own].pace_s == 0.0
    assert -chart[own - 1].gap_s == pytest.approx(float(row[COLUMN["gap_ahead_s"]]), abs=0.002)
    assert chart[own + 1].gap_s == pytest.approx(float(row[COLUMN["gap_behind_s"]]), abs=0.002)
    assert [car.position for car in chart] == list(range(1, len(chart) + 1))


def test_another_car_is_seen_as_its_own_pit_wall_sees_it(bahrain: RaceRecord) -> None:
    mine, theirs = moment_at("HAM", LAP), moment_at("VER", LAP)
    car = bahrain.car_index("VER")
    assert (theirs.driver, theirs.lap) == ("VER", LAP)
    assert theirs.arrays[1][at.K_CALLER, car] == at.CALLED
    assert np.array_equal(theirs.arrays[0], mine.arrays[0]), "the race is the same"
    place = 1 + int(np.flatnonzero(mine.arrays[1][at.K_ORDER] == car)[0])
    assert theirs.raw[-1, COLUMN["position"]] == place
    assert theirs.legal[0]


def test_odds_grow_with_the_laps(full: CallMessage) -> None:
    assert full.odds is not None
    assert {odds.driver for odds in full.odds} == {car.driver for car in full.gaps} - {"HAM"}
    assert all(0.0 <= odds.within_1 <= odds.within_3 <= odds.within_5 <= 1.0 for odds in full.odds)
    assert any(odds.within_5 > odds.within_1 for odds in full.odds)


def test_a_stop_rejoins_behind_the_cars_within_its_loss(full: CallMessage) -> None:
    assert full.rejoin is not None
    assert full.pit_loss is not None
    place = next(i for i, car in enumerate(full.gaps, 1) if car.driver == "HAM")
    within = sum(0 < car.gap_s < full.pit_loss.green_s for car in full.gaps)
    assert abs(full.rejoin.position - (place + within)) <= 1
    assert full.rejoin.low <= full.rejoin.position <= full.rejoin.high
    assert full.rejoin.traffic_s.low <= full.rejoin.traffic_s.mean <= full.rejoin.traffic_s.high


@pytest.mark.parametrize(("worn_laps", "won"), [(28.0, True), (2.0, False)])
def test_an_undercut_works_against_worn_tyres_alone(bahrain: RaceRecord, observer: Observer, worn_laps: float, won: bool) -> None:
    moment = moment_at("HAM", LAP)
    own, ahead = moment.car, field_of(moment).cars[0]
    f = moment.arrays[0].copy()
    f[at.F_TIME, own] = f[at.F_TIME, ahead] + 0.6
    f[at.F_WEAR, ahead] = worn_laps
    near = Moment(bahrain, own, moment.lap, moment.raw, moment.legal, moment.calls, (f, *moment.arrays[1:]))
    undercut = next(duel for duel in Ahead(near, observer, 0).duels(3) if duel.kind == "undercut")
    assert undercut.rival == bahrain.cars[ahead].driver
    assert undercut.gap_s == pytest.approx(0.6, abs=0.001)
    assert (undercut.chance.mean > 0.5) is won
    assert undercut.chance.low <= undercut.chance.mean <= undercut.chance.high


def test_the_window_holds_the_cheapest_lap(observer: Observer) -> None:
    found = window(moment_at("HAM", LAP), observer)
    assert found.first_lap is not None
    assert found.best_lap is not None
    assert found.last_lap is not None
    assert LAP <= found.first_lap <= found.best_lap <= found.last_lap < 57
    assert found.margin_s == MARGIN_S


def test_no_stop_pays_at_the_end(observer: Observer) -> None:
    assert window(moment_at("HAM", 55), observer).best_lap is None


def test_the_card_covers_all_that_may_come(full: CallMessage) -> None:
    assert full.card is not None
    assert [entry.status for entry in full.card] == ["vsc", "sc", "red"]
    safety_car = full.card[1]
    assert safety_car.call != "stay", "sixteen laps old softs are changed under a safety car"
    assert safety_car.verdict == "box"
    assert safety_car.places is not None
    assert safety_car.places.high < 0
    assert all(entry.holds_until is None or LAP <= entry.holds_until <= entry.looked_until for entry in full.card)


def test_no_card_while_a_safety_car_is_out(observer: Observer) -> None:
    moment = moment_at("HAM", 3)
    assert moment.arrays[2][at.R_STATUS] != 0
    assert card(policy(), moment, observer, 0) == ()


def test_the_car_that_is_called_can_be_changed(bahrain: RaceRecord) -> None:
    moment = moment_at("HAM", LAP)
    other = (moment.car + 1) % len(bahrain.cars)
    arrays = called_for(moment.arrays, moment.car, other, reactive=True)
    assert arrays[1][at.K_CALLER, moment.car] == at.REACTIVE
    assert arrays[1][at.K_CALLER, other] == at.CALLED
    assert moment.arrays[1][at.K_CALLER, moment.car] == at.CALLED, "the moment itself stays"


@pytest.fixture(scope="module")
def explainer() -> Explainer:
    return Explainer(policy(), SEED, simulated_source().head.race_number)


def nothing(done: int, of: int, words: str) -> None:
    assert 0 <= done <= of
    assert words


@pytest.mark.parametrize("method", ["attribution", "tree", "counterfactual"])
def test_an_explanation_has_rows_and_words(explainer: Explainer, method: str) -> None:
    asked = Asked("s1", 7, method, "HAM", LAP, None)  # type: ignore[arg-type]
    told = explainer.explain(asked, moment_at("HAM", LAP), nothing)
    assert (told.request, told.method, told.lap, told.call) == (7, method, LAP, "stay")
    assert told.rows
    assert told.sentences
    if method == "tree":
        assert len(told.details["tree"]["left"]) == len(told.details["tree"]["call"]) > 1


def test_a_summary_does_not_tell_the_end_of_the_race(explainer: Explainer) -> None:
    asked = Asked("s1", 1, "summary", "HAM", LAP, None)
    whole, part = (explainer.explain(asked, moment_at("HAM", LAP), nothing, until) for until in (None, LAP))
    assert len(whole.rows) == 57
    assert whole.details["position"] == 1
    assert [row.columns["lap"] for row in part.rows] == list(range(1, LAP + 1))
    assert "position" not in part.details
    assert set(part.sentences) < set(whole.sentences)
    assert whole.sentences[0] not in part.sentences


def test_a_summary_is_of_the_car_that_the_policy_drives(explainer: Explainer) -> None:
    with pytest.raises(RsrlError, match="policy drives"):
        explainer.explain(Asked("s1", 1, "summary", "VER", LAP, None), moment_at("VER", LAP), nothing)
    assert "summary" not in possible(policy(), simulated=False)


def test_a_car_without_a_tree_says_how_to_fit_one(explainer: Explainer) -> None:
    told = explainer.explain(Asked("s1", 1, "tree", "VER", LAP, None), moment_at("VER", LAP), nothing)
    assert not told.rows
    assert f"--race {RACE} --driver VER --fit-tree" in told.notes[0]
