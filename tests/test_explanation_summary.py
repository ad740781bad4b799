"""Summary of a race: the laps that mattered, sentences whose numbers can be traced, warnings, states as files."""

import dataclasses
import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rsrl.errors import RsrlError
from rsrl.explanation import Episode, ExplainedPolicy, load_explained, reach, record_episode
from rsrl.explanation.quantities import feature_text
from rsrl.explanation.state_file import check_race, parse_state, read_state, state_document, state_of
from rsrl.explanation.summary import state_warnings, summarise_race
from rsrl.explanation.summary.reasons import CLOSE_SHARE, call_margins, group_effects, key_laps, stop_advantage, turning_lap
from rsrl.season import RaceRecord
from rsrl.state import COLUMN, FEATURES, Observer

NUMBER = re.compile(r"(?<![A-OQ-Za-z])-?\d+(?:,\d{3})*(?:\.\d+)?")


@pytest.fixture(scope="module")
def policy() -> ExplainedPolicy:
    return load_explained("all")


@pytest.fixture(scope="module")
def episode(policy: ExplainedPolicy, bahrain: RaceRecord) -> Episode:
    return record_episode(policy, bahrain, bahrain.car_index("HAM"), seed=3, race=2)


@pytest.fixture(scope="module")
def document(policy: ExplainedPolicy, bahrain: RaceRecord) -> dict[str, Any]:
    """The state before lap 10, as a file has it."""
    return state_document(state_of(reach(policy.strategist(bahrain), bahrain, bahrain.car_index("HAM"), 10, seed=3)))


def test_driven_race_is_the_race_the_strategist_calls(policy: ExplainedPolicy, bahrain: RaceRecord, episode: Episode) -> None:
    moment = reach(policy.strategist(bahrain), bahrain, episode.whole.car, 30, seed=3, race=2)
    assert np.array_equal(moment.raw, episode.moment(30).raw)
    assert np.array_equal(moment.calls, episode.moment(30).calls)
    assert np.allclose(policy.q(moment), episode.q[29], atol=1e-5)


def test_margins_are_those_of_the_values(episode: Episode) -> None:
    margins, stop = call_margins(episode), stop_advantage(episode)
    for i in range(episode.laps):
        legal = episode.legal[i]
        others = [episode.q[i, a] for a in range(4) if legal[a] and a != episode.calls[i]]
        if others:
            assert margins[i] == pytest.approx(episode.q[i, episode.calls[i]] - max(others), abs=1e-5)
            assert margins[i] >= 0
        else:
            assert np.isnan(margins[i])
        if legal[0] and legal[1:].any():
            assert (stop[i] > 0) == (episode.calls[i] > 0)


def test_every_stop_matters_and_close_calls_are_close(episode: Episode) -> None:
    mattered = {lap.lap: lap.why for lap in key_laps(episode)}
    assert [lap for lap, why in mattered.items() if why == "stop"] == [i + 1 for i in np.flatnonzero(episode.calls)]
    limit = CLOSE_SHARE * np.nanmedian(call_margins(episode))
    assert all(call_margins(episode)[lap - 1] <= limit for lap, why in mattered.items() if why == "close call")
    slow = episode.raw[:, COLUMN["safety_car"]] > 0
    assert all(slow[lap - 1] for lap, why in mattered.items() if why == "safety car")


@pytest.mark.parametrize("race", range(4))
def test_every_number_of_a_sentence_can_be_traced(policy: ExplainedPolicy, bahrain: RaceRecord, race: int) -> None:
    summary = summarise_race(policy, bahrain, bahrain.car_index("HAM"), seed=3, race=race)
    told = summary.details["sentences"]
    assert [one["text"] for one in told] == list(summary.sentences)
    again = record_episode(policy, bahrain, bahrain.car_index("HAM"), seed=3, race=race)
    for one in told:
        shown = [reference["shown"].lstrip("-+") for reference in one["references"]]
        text = one["text"]
        for feature in FEATURES:  # "cars within 4 s ahead": part of a name, not a value
            text = text.replace(feature_text(feature), feature.name)
        assert sorted(n.lstrip("-") for n in NUMBER.findall(text)) == sorted(shown), text
        for reference in one["references"]:
            assert float(reference["shown"]) == pytest.approx(reference["value"], abs=0.51)
            if reference["column"] in COLUMN:
                in_row = float(again.raw[reference["lap"] - 1, COLUMN[reference["column"]]])
                assert abs(reference["value"]) == pytest.approx(abs(in_row))


def test_what_is_put_back_whole_undoes_the_change(policy: ExplainedPolicy, episode: Episode) -> None:
    """With one group only, all of it, the part is the whole change."""
    lap = int(np.flatnonzero(episode.calls)[0]) + 1
    before, call = turning_lap(stop_advantage(episode), lap), int(episode.calls[lap - 1])
    assert before == lap - 1
    found = group_effects(policy, episode, lap, before, call)
    assert {effect.group for effect in found} == {f.group for f in FEATURES if f.name != "track"}
    fixed = {effect.group: effect.effect for effect in found}
    assert fixed["track"] == pytest.approx(0, abs=1e-5), "the track is the same on every lap"
    assert max(fixed.values()) > 0


def test_summary_is_the_same_each_time_and_plots(policy: ExplainedPolicy, bahrain: RaceRecord) -> None:
    first, second = (summarise_race(policy, bahrain, bahrain.car_index("HAM"), seed=3, race=2) for _ in range(2))
    assert first.to_json() == second.to_json()
    assert len(json.loads(first.to_json())["rows"]) == len(first.labels) == first.to_frame().height
    axes = first.plot()
    assert axes.get_xlabel() == "lap"
    assert len(axes.lines) >= 2 + len(first.details["stops"])


def test_warnings_name_what_the_policy_does_not_know(policy: ExplainedPolicy, bahrain: RaceRecord, episode: Episode) -> None:
    moment = episode.moment(10)
    raw = moment.raw.copy()
    raw[-1, COLUMN["tyre_age_laps"]] = 70
    raw[-1, COLUMN["gap_ahead_s"]] = 90
    odd = dataclasses.replace(moment, raw=raw)
    usual = state_warnings(policy, moment)
    warned = [line for line in state_warnings(policy, odd) if line not in usual]
    assert len(warned) == 2
    assert any(line.startswith("gap to the car one place ahead is 90.0 s") for line in warned)
    assert any(line.startswith("laps on the set fitted is 70 laps; the policy cannot tell values apart outside 0 to ") for line in warned)
    raw[-1, COLUMN["gap_ahead_s"]] = 100.0  # no car ahead
    assert len([line for line in state_warnings(policy, odd) if line not in usual]) == 1
    single = dataclasses.replace(policy, about=dataclasses.replace(policy.about, race="spain-2023", driver="ALO", trained_range={}))
    assert state_warnings(single, moment)[:2] == [
        "the policy was trained on spain-2023 alone, not on bahrain-2023",
        "the policy was trained to call ALO, not HAM",
    ]


def test_a_tyre_older_than_the_policy_ever_drives_is_warned_of(policy: ExplainedPolicy, episode: Episode) -> None:
    moment = episode.moment(10)
    assert not [line for line in state_warnings(policy, moment, drive_races=True) if "simulated races" in line]
    raw = moment.raw.copy()
    raw[-1, COLUMN["tyre_age_laps"]] = 30
    warned = state_warnings(policy, dataclasses.replace(moment, raw=raw), drive_races=True)
    assert any(line.startswith("laps on the set fitted is 30 laps; in 256 simulated races") for line in warned)


def test_state_file_reads_back_to_the_same_features(tmp_path: Path, bahrain: RaceRecord, document: dict[str, Any]) -> None:
    path = tmp_path / "state.json"
    path.write_text(json.dumps(document))
    state = read_state(path)
    car = check_race(state, bahrain, "state")
    row = Observer(bahrain, car).row(state)
    again = Observer(bahrain, car).row(parse_state(state_document(state), "again"))
    assert np.array_equal(row, again)
    assert row[COLUMN["laps_left"]] == bahrain.laps - 9


@pytest.mark.parametrize(
    ("field", "value", "message"),
    [
        ("laps_completed", -1, "laps_completed is -1; it must be a whole number from 0 up"),
        ("laps_completed", 57, "laps_completed is 57 of 57: the race is over"),
        ("track_status", 7, "track_status is 7; it must be one of 0 none"),
        ("track_status", "rain", 'track_status is "rain"'),
        ("status_laps", 30, "status_laps is 30; it must be at most laps_completed"),
        ("driver", "XXX", "driver is XXX, who is not among the cars"),
        ("compounds_used", [], "compounds_used is []; it must be a list of S, M, H"),
        ("sets_left", [1, 2], "sets_left is [1, 2]; it must be three whole numbers"),
        ("previous_gap_ahead_s", "far", 'previous_gap_ahead_s is "far"; it must be a number'),
        ("cars", [], "cars is []; it must be a list of cars"),
        ("weather", "dry", "unknown field weather"),
    ],
)
def test_an_impossible_field_is_named(document: dict[str, Any], field: str, value: object, message: str) -> None:
    with pytest.raises(RsrlError, match=re.escape(message)):
        parse_state(document | {field: value}, "state.json")


@pytest.mark.parametrize(
    ("field", "value", "message"),
    [
        ("compound", "W", 'compound is "W"; it must be one of S, M, H'),
        ("tyre_age_laps", 40, "tyre_age_laps is 40; it must be at most laps_completed, 9, and 30 before the race"),
        ("tyre_age_laps", 1.5, "tyre_age_laps is 1.5; it must be a whole number"),
        ("gap_to_leader_s", None, "gap_to_leader_s is null; it must be a number, since the car is running"),
        ("gap_to_leader_s", -2.0, "gap_to_leader_s is -2.0; it must be a number from 0 up"),
        ("gap_to_leader_s", 900.0, "is ahead"),
        ("last_lap_s", 0.0, "last_lap_s is 0.0; it must be above 0"),
        ("position", 7, "position of"),
        ("running", "yes", 'running is "yes"; it must be true or false'),
        ("driver", "nobody", "cars[2].driver is nobody, who did not start"),
    ],
)
def test_an_impossible_car_is_named(bahrain: RaceRecord, document: dict[str, Any], field: str, value: object, message: str) -> None:
    cars = [dict(car) for car in document["cars"]]
    cars[2][field] = value
    with pytest.raises(RsrlError, match=re.escape(message)):
        check_race(parse_state(document | {"cars": cars}, "state.json"), bahrain, "state.json")


@pytest.mark.parametrize("field", ["race", "laps_completed", "cars", "sets_left"])
def test_a_missing_field_is_named(document: dict[str, Any], field: str) -> None:
    with pytest.raises(RsrlError, match=f"^state.json: field {field} is missing$"):
        parse_state({name: value for name, value in document.items() if name != field}, "state.json")
    cars = [{name: value for name, value in document["cars"][0].items() if name != "last_lap_s"}]
    with pytest.raises(RsrlError, match=re.escape("state.json: cars[0]: field last_lap_s is missing")):
        parse_state(document | {"cars": cars}, "state.json")


def test_a_retired_car_has_nothing_to_call(document: dict[str, Any]) -> None:
    cars = [car | {"running": car["driver"] != "HAM"} for car in document["cars"]]
    with pytest.raises(RsrlError, match="the race of HAM is over"):
        parse_state(document | {"cars": cars}, "state.json")
