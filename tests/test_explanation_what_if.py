"""What-if: paired futures, a split that sums exactly, bits that no thread count changes, states restaged."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from synthetic_race import quiet, synthetic_race

from rsrl.agents import ModelMetadata, NetworkAgent
from rsrl.agents.networks import Duelling, Lstm, Network
from rsrl.errors import RsrlError
from rsrl.explanation import ExplainedPolicy, Moment, reach
from rsrl.explanation.fidelity.what_if import measure_what_if
from rsrl.explanation.from_state import observed
from rsrl.explanation.what_if import (
    Continuation,
    Option,
    compare,
    explain_what_if,
    label,
    moment_from_state,
    options_at,
    plot_time_split,
    plot_what_if,
    safety_car_table,
    under_status,
)
from rsrl.explanation.what_if.comparison import PARTS, estimate, split, verdict
from rsrl.explanation.what_if.sentences import sentences_of
from rsrl.rollouts import O_COLUMNS, O_FINISHED, O_PIT, O_POSITION, O_SLOW, O_STOP_LAP, O_TIME, O_TYRE
from rsrl.season import SC, VSC, RaceRecord
from rsrl.simulator import Plan, simulate
from rsrl.simulator import layout as at
from rsrl.state import Observer, UnifiedRaceState, UnifiedRaceStrategy, input_names
from rsrl.translators import SimulatedRace

CAR = 6
RACE = synthetic_race(laps=14, sets=(2, 2, 2), stint_sd_s=0.1)


def policy_of(network: Network, params: dict[str, np.ndarray], feature_set: str = "full", *, masked: bool = True) -> ExplainedPolicy:
    agent = NetworkAgent("rsrl", feature_set, input_names(feature_set), masked, network, params)
    return ExplainedPolicy(agent, ModelMetadata(), "toy", Path("toy"), "0" * 16)


def stays() -> ExplainedPolicy:
    """Stays out until the rules say otherwise, and fits the hard then."""
    network = Duelling(len(input_names("full")), 4)
    params = network.init(np.random.default_rng(0))
    params["q.bias"] = np.array([0, -3, -2, -1], np.float32)
    return policy_of(network, params)


def whimsical(seed: int = 1) -> ExplainedPolicy:
    """Calls by random weights, so that it stops here and there."""
    network = Duelling(len(input_names("full")), 8)
    params = network.init(np.random.default_rng(seed))
    params["q.weight"] = np.random.default_rng(seed).normal(0, 0.3, (8, 4)).astype(np.float32)
    params["q.bias"] = np.array([0, -0.6, -0.6, -0.6], np.float32)
    return policy_of(network, params)


@pytest.fixture(scope="module")
def moment() -> Moment:
    return reach(stays().strategist(RACE), RACE, CAR, 5, seed=2)


def test_toy_without_luck_is_what_plans_bring() -> None:
    """One set of plans, no luck: the difference between options is that between the races of the two plans, by hand to a millisecond."""
    record = synthetic_race(laps=14, plans=("M-H@7",), **quiet(stint_sd_s=0.0, pass_scale_s=0.0))
    policy = stays()
    moment = reach(policy.strategist(record), record, CAR, 4)
    options = (Option(0, 0), Option(0, 3), Option(3, 1))
    results = Continuation(policy, [moment]).run(options, 3, 0)
    plans = [Plan.parse(text) for text in ("M-H@13", "M-H@4", "M-S@7")]  # left alone, it stops when it must
    for j, plan in enumerate(plans):
        driven = simulate(record, 1, 0, plans={CAR: plan}, rivals="plans")
        assert (results[:, j, O_POSITION] == driven.positions[0, CAR]).all()
        first = simulate(record, 1, 0, plans={CAR: plans[0]}, rivals="plans")
        expected = float(driven.race_time_s[0, CAR]) - float(first.race_time_s[0, CAR])
        assert results[0, j, O_TIME] - results[0, 0, O_TIME] == pytest.approx(expected, abs=2e-3)
    early = compare(results, 0)[1]
    assert early.parts[0] == pytest.approx(0.0, abs=1e-3)  # a stop each
    medium = [0.06 * age + 0.001 * age**2 for age in range(3, 13)]  # laps 4 to 13
    hard = [0.4 + 0.03 * age + 0.0005 * age**2 for age in range(10)]
    assert early.parts[1] == pytest.approx(medium[0] + sum(hard) - sum(medium) - hard[0], abs=1e-4)  # a cold lap each
    assert early.places.se == 0


def test_split_sums_exactly(moment: Moment) -> None:
    explanation = explain_what_if(whimsical(), moment, races=64, seed=5, horizon_laps=3)
    c = explanation.columns
    assert all(sum(c[part][i] for part in PARTS) == c["time_s"][i] for i in range(len(explanation.labels)))
    assert all(c["safety_car_s"][i] + c["traffic_s"][i] + c["tyre_s"][i] + c["pit_s"][i] == c["time_s"][i] for i in range(len(c["call"])))
    assert any(abs(c["safety_car_s"][i]) > 0 for i in range(len(c["call"])))


def test_later_stops_that_beat_the_call_are_told_once_in_full(moment: Moment) -> None:
    options = (Option(0, 0), Option(1, 3), Option(2, 3), Option(3, 3))
    results = np.full((200, len(options), O_COLUMNS), np.nan)
    results[:, :, O_STOP_LAP] = (0, 6, 7, 8)
    results[:, :, O_FINISHED] = 0
    results[:, :, O_POSITION] = np.array((10, 9, 7, 8)) + np.random.default_rng(0).integers(0, 2, (200, 1))
    told = sentences_of(moment, stays().decide(moment), options, compare(results, 0), 200, "")
    (in_full,) = [line for line in told if line.startswith("Boxing in ")]
    assert in_full.startswith("Boxing in 2 laps for hard gains 3.00 places")
    assert "Also better than the call: box in 1 lap for hard, box in 3 laps for hard." in told
    assert "After staying out, the policy does not box again." in told


def test_when_the_policy_boxes_after_staying_out_is_told(moment: Moment) -> None:
    explanation = explain_what_if(whimsical(), moment, races=64, seed=5, horizon_laps=1)
    stay = explanation.columns["call"].index(0)
    mean, (first, last) = explanation.columns["stop_lap"][stay], explanation.columns["stop_laps"][stay]
    assert moment.lap < first <= last <= RACE.laps
    assert moment.lap < mean <= RACE.laps
    (told,) = [sentence for sentence in explanation.sentences if sentence.startswith("After staying out")]
    assert told.startswith(f"After staying out, the policy next boxes on lap {mean:.0f} on average")
    for option, stop in zip(explanation.columns["in_laps"][1:], explanation.columns["stop_laps"][1:], strict=True):
        if option:
            assert stop == [moment.lap + option] * 2, "a stop that is settled is made then"


@given(st.lists(st.lists(st.floats(-3000, 3000), min_size=8, max_size=8), min_size=1, max_size=5))
def test_split_sums_exactly_whatever_the_times(rows: list[list[float]]) -> None:
    option, reference = np.zeros((len(rows), O_COLUMNS)), np.zeros((len(rows), O_COLUMNS))
    for i, column in enumerate((O_TIME, O_PIT, O_TYRE, O_SLOW)):
        option[:, column] = [row[i] for row in rows]
        reference[:, column] = [row[4 + i] for row in rows]
    parts = split(option, reference)
    total = parts[:, 0] + parts[:, 1] + parts[:, 2] + parts[:, 3]
    assert (total == parts[:, 3] + parts[:, 2] + parts[:, 1] + parts[:, 0]).all()
    assert np.abs(total - (option[:, O_TIME] - reference[:, O_TIME])).max() <= 2.0**-21


def test_threads_and_chunks_change_no_bit(moment: Moment) -> None:
    policy = whimsical()
    continuation, options = Continuation(policy, [moment]), options_at(policy, moment, 4)
    one = continuation.run(options, 70, 3, threads=1)
    assert one.tobytes() == continuation.run(options, 70, 3, threads=3).tobytes()
    later = continuation.run(options, 20, 3, first=32, threads=1)
    np.testing.assert_array_equal(later, one[32:52])
    assert (continuation.run(options, 70, 4)[:, 0, O_POSITION] != one[:, 0, O_POSITION]).any()


def test_sharing_laps_changes_nothing(moment: Moment, monkeypatch: pytest.MonkeyPatch) -> None:
    """The laps that options share are driven once; driven by each of them, and asked about on every lap, they end the same."""
    policy = whimsical()
    options = options_at(policy, moment, 4)
    shared, apart = Continuation(policy, [moment]), Continuation(policy, [moment])
    monkeypatch.setattr(apart, "_always", True)
    np.testing.assert_array_equal(shared.run(options, 40, 3), apart.run(options, 40, 3))


def test_the_policys_own_call_followed_by_it_is_the_reference(moment: Moment) -> None:
    policy = whimsical()
    explanation = explain_what_if(policy, moment, races=40, seed=1, horizon_laps=2)
    assert explanation.values[0] == 0
    assert explanation.columns["time_s"][0] == 0
    assert explanation.columns["verdict"][0] == "itself"
    assert explanation.labels[0].endswith("(its call)")
    assert explanation.decision.call == policy.decide(moment).call
    assert '"rejoin_gap_ahead_s"' in explanation.to_json()
    assert explanation.summary().startswith("C06, lap 5: the policy's call is to ")


def test_a_network_with_memory_is_followed_too(moment: Moment) -> None:
    names = input_names("paper")
    network = Lstm(len(names), 6)
    params = network.init(np.random.default_rng(3))
    policy = policy_of(network, params, "paper", masked=False)
    results = Continuation(policy, [moment]).run((Option(0, 0), Option(2, 3)), 24, 0)
    assert np.isfinite(results[:, :, O_POSITION]).all()
    assert results.tobytes() == Continuation(policy, [moment]).run((Option(0, 0), Option(2, 3)), 24, 0, threads=2).tobytes()
    assert ((results[:, :, O_POSITION] >= 1) & (results[:, :, O_POSITION] <= 20)).all()


def test_options_are_legal_and_the_policys_comes_first(moment: Moment) -> None:
    policy = stays()
    options = options_at(policy, moment, 8)
    assert options[0] == Option(0, 0)
    assert [o.call for o in options if o.offset == 0] == [0, *(a for a in (1, 2, 3) if moment.legal[a])]
    assert [o.offset for o in options if o.offset > 0] == list(range(1, 9))
    assert {o.call for o in options if 0 < o.offset < 8} == {3}  # it values the hard most; at last the second compound must come
    assert label(options[-2]) == "box in 7 laps for hard"
    limited = synthetic_race(laps=14, max_laps_per_set=8, sets=(2, 2, 2), plans=("M-H@7",))
    late = reach(policy.strategist(limited), limited, CAR, 5, seed=2)
    assert max(o.offset for o in options_at(policy, late, 8)) == 3  # on lap 8 the set must come off


def test_one_legal_call_is_explained_as_such() -> None:
    policy = stays()
    last = reach(policy.strategist(RACE), RACE, CAR, RACE.laps, seed=2)
    explanation = explain_what_if(policy, last, races=16)
    assert explanation.labels == ("stay out (its call)",)
    assert "No other call is legal" in explanation.summary()


def test_verdicts() -> None:
    rng = np.random.default_rng(0)
    nothing = estimate(rng.permutation(np.repeat([-1.0, 0.0, 1.0], [100, 1800, 100])))
    assert verdict(nothing, (nothing.low, nothing.high)) == "equal"
    assert verdict(estimate(np.array([-3.0, 3.0, 0.0, 0.0])), (-4.0, 4.0)) == "undecided"
    assert verdict(estimate(np.full(9, 0.5)), (0.2, 0.8)) == "worse"
    assert verdict(estimate(np.full(9, -0.5)), (-0.8, -0.2)) == "better"
    assert verdict(nothing, (-0.01, 0.3)) == "equal"


def test_a_safety_car_makes_a_stop_cheaper(moment: Moment) -> None:
    policy = stays()
    behind = under_status(moment, SC)
    assert behind.arrays[2][at.R_STATUS] == SC
    assert moment.arrays[2][at.R_STATUS] != SC
    np.testing.assert_array_equal(behind.raw[:-1], moment.raw[:-1])
    now = explain_what_if(policy, moment, races=200, horizon_laps=0)
    then = explain_what_if(policy, moment, races=200, horizon_laps=0, status=SC)
    assert then.details["track_status"] == "full"
    assert then.values[-1] < now.values[-1]
    with pytest.raises(RsrlError, match="lap 1"):
        under_status(reach(policy.strategist(RACE), RACE, CAR, 1), SC)
    with pytest.raises(RsrlError, match="track status 7"):
        under_status(moment, 7)


def test_bad_input_is_named(moment: Moment) -> None:
    for wrong, says in (({"races": 1}, "races"), ({"seed": -1}, "seed"), ({"horizon_laps": 99}, "horizon_laps")):
        with pytest.raises(RsrlError, match=says):
            explain_what_if(stays(), moment, **wrong)  # type: ignore[arg-type]


def driven_states(record: RaceRecord, seed: int, laps: int, stop: int) -> tuple[SimulatedRace, list[UnifiedRaceState]]:
    race, states = SimulatedRace(record, CAR, seed), []
    for lap in range(laps):
        state = race.state()
        if state is None:
            break
        states.append(state)
        if lap < laps - 1:
            race.apply(UnifiedRaceStrategy(action=3 if lap == stop else 0))  # type: ignore[arg-type]
    return race, states


@given(st.integers(0, 30), st.integers(1, 12), st.sampled_from([1, 2]))
def test_a_restaged_state_shows_the_same_observation(seed: int, laps: int, drs_off_laps: int) -> None:
    record = dataclasses.replace(RACE, drs_off_laps=drs_off_laps)
    race, states = driven_states(record, seed, laps, 4)
    state = states[-1]
    moment = moment_from_state(record, CAR, state, states[:-1])
    observer = Observer(record, CAR)
    np.testing.assert_array_equal(observed(moment.arrays, observer), observer.row(state))
    np.testing.assert_array_equal(moment.raw[-1], observer.row(state))
    if race.state() is not None:
        f, k, r = race.batch.f[0], race.batch.k[0], race.batch.r[0]
        running = k[at.K_ORDER, : r[at.R_RUNNING]]
        for row in (at.K_COMPOUND, at.K_AGE, at.K_STOPS, at.K_STOPPED, at.K_PLACE):
            np.testing.assert_array_equal(moment.arrays[1][row, running], k[row, running])
        for row in (at.F_LAP, at.F_WEAR, at.F_FORM, at.F_LUCK, at.F_LINEAR, at.F_QUADRATIC):
            np.testing.assert_array_equal(moment.arrays[0][row, running], f[row, running])
        for i in (at.R_LAP, at.R_STATUS, at.R_SINCE, at.R_RUNNING, at.R_NO_DRS, at.R_RESTART):
            assert moment.arrays[2][i] == r[i]
        np.testing.assert_array_equal(moment.arrays[1][at.K_USED, running], k[at.K_USED, running])


def test_a_restaged_state_can_be_rolled_out() -> None:
    _, states = driven_states(RACE, 3, 7, 2)
    policy = stays()
    explanation = explain_what_if(policy, moment_from_state(RACE, CAR, states[-1], states[:-1]), races=32, horizon_laps=1)
    alone = moment_from_state(RACE, CAR, states[-1])
    assert len(alone.raw) == 1
    assert len(alone.calls) == 0
    assert len(explanation.labels) > 2
    assert 1 <= explanation.columns["mean_position"][0] <= 20


def test_impossible_states_are_named() -> None:
    _, states = driven_states(RACE, 3, 6, 2)
    state = states[-1]

    def with_car(place: int, **changed: object) -> UnifiedRaceState:
        cars = list(state.cars)
        cars[place] = dataclasses.replace(cars[place], **changed)  # type: ignore[arg-type]
        return dataclasses.replace(state, cars=tuple(cars))

    wrong = {
        "race is": dataclasses.replace(state, race="spain-2023"),
        "total_laps": dataclasses.replace(state, total_laps=50),
        "tyre_age_laps": with_car(3, tyre_age_laps=40),
        "stops is 9": with_car(3, stops=9),
        "position of": with_car(3, position=9),
        "gap_to_leader_s": with_car(3, gap_to_leader_s=-4.0),
        "last_lap_s": with_car(3, last_lap_s=float("nan")),
        "sets_left": dataclasses.replace(state, sets_left=(9, 0, 0)),
        "compounds_used": dataclasses.replace(state, compounds_used=frozenset()),
        "worn_laps": with_car(3, worn_laps=-1.0),
    }
    for says, bad in wrong.items():
        with pytest.raises(RsrlError, match=says):
            moment_from_state(RACE, CAR, bad)
    with pytest.raises(RsrlError, match="history goes from lap"):
        moment_from_state(RACE, CAR, state, states[:2])


def test_safety_car_table_lists_laps_compounds_and_both_cars() -> None:
    table = safety_car_table(whimsical(), RACE, CAR, seed=1, races=32)
    assert set(table.columns["track_status"]) == {"safety car", "virtual safety car"}
    assert min(table.columns["lap"]) == 2
    assert max(table.columns["lap"]) < RACE.laps
    assert table.details["plan"]
    assert table.to_frame().height == len(table.labels)


def test_pictures(moment: Moment) -> None:
    explanation = explain_what_if(stays(), moment, races=16, horizon_laps=1, status=VSC)
    assert len(plot_what_if(explanation).get_yticklabels()) == len(explanation.labels)
    assert plot_time_split(explanation).get_legend() is not None
    with pytest.raises(RsrlError, match="not a what-if"):
        plot_what_if(dataclasses.replace(explanation, method="tree"))


def test_fidelity_figures_are_measured() -> None:
    figures = measure_what_if(stays(), [RACE], races=8, draws=4, long_futures=50)
    assert 0 <= figures["coverage"] <= 1
    assert figures["seconds_most"] > 0
    assert len(figures["moments"]) == 3
