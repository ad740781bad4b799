"""Recorded races audited for their whole field: what was known, who would have stopped when, what calls were worth, the season's means."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
import pytest
from exported_race import Exported, export_race
from test_cli_replay import write_laps

from rsrl.audit.callers import DRAWS, _planned, audited_callers, first_box, recorded_calls, shares_within
from rsrl.audit.car import Settings
from rsrl.audit.field import follow_field, moments
from rsrl.audit.race import audit_race, recorded_field
from rsrl.audit.season import audited_races, over
from rsrl.audit.worth import CallWorth
from rsrl.cli import main
from rsrl.errors import RsrlError
from rsrl.explanation import load_any_policy
from rsrl.feeds.lap_files import lap_events
from rsrl.replay import StateCaller, follow, team_call
from rsrl.results import RaceAudit, SeasonAudit, from_plain
from rsrl.season import RaceRecord
from rsrl.simulator import Plan
from rsrl.state import ACTION_NAMES, Observer

Capture = pytest.CaptureFixture[str]
STOPS = (12, 30)
DRIVERS = ("HAM", "VER")


@pytest.fixture(scope="module")
def exported(bahrain: RaceRecord) -> Exported:
    """A simulated Bahrain 2023 with a safety car, in which HAM boxes on laps 12 and 30."""
    return export_race(bahrain, bahrain.car_index("HAM"), 5, 10, STOPS)


@pytest.fixture(scope="module")
def audited(exported: Exported, bahrain: RaceRecord) -> RaceAudit:
    """A small audit of two cars."""
    return audit_race(recorded_field("bahrain-2023", exported.table, bahrain, DRIVERS), load_any_policy("all"), Settings(16, 3))


def test_the_field_is_seen_as_each_car_of_it_is_alone(exported: Exported, bahrain: RaceRecord) -> None:
    events = lap_events(exported.table)
    known = follow_field(events, bahrain, DRIVERS)
    policy = load_any_policy("all")
    for car in known:
        alone = follow(events, bahrain, {car.driver: StateCaller(policy, bahrain, car.car)})
        tracked = next(c for c in alone.tracker.cars.values() if c.driver == car.driver)
        assert [lap.lap for lap in car.laps] == list(range(1, tracked.laps + 1))
        decisions = moments(car, bahrain, Observer(bahrain, car.car))
        same = 0
        for lap, followed in zip(car.laps, alone.cars[0].laps, strict=True):
            final = followed.final
            assert lap.team == team_call(tracked, lap.lap)
            assert lap.state is not None
            assert final.called is not None
            if final.why == "pit entry":  # else what came too late replaced the last look, of which the field keeps the one before it
                same += 1
                assert lap.state == final.tracked.state
                assert int(final.called.strategy.action) == policy.call(decisions[lap.lap])
        assert same > 0.8 * len(car.laps)
    assert [lap.lap for lap in known[0].laps if lap.stopped] == list(STOPS)


def test_every_lap_is_called_and_no_call_is_illegal(audited: RaceAudit, bahrain: RaceRecord) -> None:
    assert [car.driver for car in audited.cars] == list(dict.fromkeys(c.driver for c in bahrain.cars if c.driver in DRIVERS))
    for car in audited.cars:
        assert (car.laps_called, car.illegal, car.uncalled) == (car.laps, 0, {})
    assert audited.knows_race  # the shipped file was fitted to the race too
    ham = next(car for car in audited.cars if car.driver == "HAM")
    assert [stop.lap for stop in ham.stops] == list(STOPS)
    assert [stop.first for stop in ham.stops] == [True, False]
    for stop in ham.stops:
        assert set(stop.within_two_laps) == {"all", "best-plan-sc", "imitation"}
        assert all(0 <= share <= 1 for share in (*stop.within_two_laps.values(), *stop.same_compound.values()))


def test_the_policy_loses_nothing_to_itself(audited: RaceAudit) -> None:
    for car in audited.cars:
        assert car.differing > 0
        assert car.against_policy["all"] == 0.0
        assert car.laps - car.laps_agreed <= car.differing
        assert set(car.regret) == set(car.against_policy)


def test_a_strategist_is_asked_until_the_teams_stop(exported: Exported, bahrain: RaceRecord) -> None:
    (ham,) = follow_field(lap_events(exported.table), bahrain, ["HAM"])
    decisions = moments(ham, bahrain, Observer(bahrain, ham.car))
    callers = audited_callers(load_any_policy("all"), bahrain, ham.car, ham.laps[0].state, 0)
    by_name = {caller.name: caller for caller in callers}
    calls = {caller.name: recorded_calls(caller, bahrain, decisions) for caller in callers}
    assert {len(made) for made in calls["imitation"].values()} == {DRAWS}
    plan = _planned(Plan.parse("S-H@9"))
    planned = {plan.name: recorded_calls(plan, bahrain, decisions)}
    assert first_box(planned[plan.name], range(1, 13)).tolist() == [9]
    assert first_box(planned[plan.name], range(1, 9)).tolist() == [0]
    for team_lap, share in ((12, 0.0), (11, 1.0), (9, 1.0), (8, 1.0), (7, 1.0), (6, 0.0)):
        assert shares_within([plan], bahrain, planned, range(1, team_lap + 1), decisions[team_lap], 0) == {plan.name: share}
    compounds = by_name["imitation"].compound(decisions[12])
    assert compounds is not None
    assert sum(compounds.values()) == pytest.approx(1.0)


def test_worth_of_calls_by_hand() -> None:
    places = np.array([[5.0, 7.0], [5.0, 6.0], [6.0, 7.0], [4.0, 6.0]])
    worth = CallWorth()
    worth.add(places, {"all": 0, "team": 2}, (0, 2), 0)
    worth.add(places[:, ::-1], {"team": 2}, (0, 2), 0)
    assert worth.laps == 2
    assert worth.against_policy == {"all": 0.0, "team": 1.5 - 1.5}
    assert worth.regret == {"all": 0.0, "team": 1.5}


def test_the_best_call_is_not_chosen_by_its_own_luck() -> None:
    noise = np.random.default_rng(1).normal(10.0, 3.0, (2000, 40, 3))
    regrets = []
    for places in noise:
        worth = CallWorth()
        worth.add(places, {"all": 0}, (0, 1, 2), 0)
        regrets.append(worth.regret["all"])
    assert abs(np.mean(regrets)) < 4 * np.std(regrets) / np.sqrt(len(regrets))


def test_means_are_over_races() -> None:
    found = over([{"all": 0.5, "team": 1.0}, {"all": 1.0}])
    assert (found["all"].mean, found["all"].of, found["team"].of) == (0.75, 2, 1)
    low, high = found["all"].ci95
    assert low is not None
    assert high is not None
    assert low < 0.5 < 1.0 < high


def test_a_race_that_is_done_is_kept(audited: RaceAudit, exported: Exported, bahrain: RaceRecord, tmp_path: Path) -> None:
    from rsrl.results import to_json

    field, policy = recorded_field("bahrain-2023", exported.table, bahrain, DRIVERS), load_any_policy("all")
    (tmp_path / "bahrain-2023.json").write_text(to_json(audited), encoding="utf-8")
    (again,) = audited_races([field], policy, Settings(16, 3), tmp_path)
    assert to_json(again) == to_json(audited)
    (other,) = audited_races([field], policy, Settings(0, 3), tmp_path)  # other settings: made again
    assert other.rollouts == 0
    assert {car.differing for car in other.cars} == {0}


@pytest.fixture(scope="module")
def laps(exported: Exported, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a lap file of one race."""
    import gzip

    folder = tmp_path_factory.mktemp("laps")
    plain = write_laps(folder / "plain.csv", exported.table)
    (folder / "laps_2023.csv.gz").write_bytes(gzip.compress(plain.read_bytes()))
    return folder


def test_command(laps: Path, tmp_path: Path, capsys: Capture) -> None:
    typed = ["audit", "--season", "2023", "--laps", str(laps), "--drivers", "hamilton", "--rollouts", "4", "--out", str(tmp_path / "a")]
    assert main([*typed, "--json"]) == 0
    document: dict[str, Any] = json.loads(capsys.readouterr().out)
    result = from_plain(document, SeasonAudit)
    assert json.loads((tmp_path / "a" / "audit.json").read_text(encoding="utf-8")) == document
    assert (tmp_path / "a" / "audit.png").stat().st_size > 10_000
    assert (tmp_path / "a" / "races" / "bahrain-2023.json").exists()
    assert result.callers[0] == "all"
    assert (result.overall.races, result.overall.cars, result.overall.illegal) == (1, 1, 0)
    assert [one.name for one in result.by_team] == ["Mercedes"]
    assert result.overall.laps_called == sum(car.laps_called for race in result.races for car in race.cars)
    assert main([*typed, "--force", "--wide"]) == 0
    shown = capsys.readouterr().out
    assert "first stop within 2 laps" in shown
    assert "Mercedes" in shown
    assert ACTION_NAMES[0] == "no pit"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--drivers", "XYZ"], "driver 'XYZ' drove no race in 2023"),
        (["--races", "monza"], "unknown race 'monza 2023'"),
        (["--model", "nobody"], "no model 'nobody'"),
        (["--season", "2019"], "laps_2019.csv.gz: cannot be read"),
        (["--season-files", "/nowhere"], "holds no dry race with a season file"),
    ],
)
def test_unusable_input_is_one_line_and_exit_code_2(laps: Path, capsys: Capture, arguments: list[str], message: str) -> None:
    assert main(["audit", "--season", "2023", "--laps", str(laps), *arguments]) == 2
    said = [line for line in capsys.readouterr().err.splitlines() if line.startswith("rsrl: error: ")]
    assert len(said) == 1
    assert message in said[0]


def test_a_race_without_laps_of_the_season_is_refused(laps: Path, tmp_path: Path) -> None:
    from rsrl.audit import season_races

    with pytest.raises(RsrlError, match="holds no dry race with a season file"):
        season_races(laps / "laps_2023.csv.gz", 2022, None, None, None)
    assert pl.read_csv(laps / "plain.csv").height > 0
    assert not list(tmp_path.iterdir())


def test_an_interrupted_season_goes_on_where_it_was(
    audited: RaceAudit, exported: Exported, bahrain: RaceRecord, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from msgspec.structs import replace

    from rsrl.audit import season

    one = recorded_field("bahrain-2023", exported.table, bahrain, DRIVERS)
    asked: list[str] = []

    def audit(field: Any, *_: Any) -> RaceAudit:
        asked.append(field.name)
        if asked.count("other-2023") == 1 and field.name == "other-2023":
            raise KeyboardInterrupt
        return replace(audited, race=field.name)

    monkeypatch.setattr(season, "audit_race", audit)
    races = [one, one._replace(name="other-2023"), one._replace(name="third-2023")]
    policy, settings = load_any_policy("all"), Settings(16, 3)
    with pytest.raises(KeyboardInterrupt):
        list(audited_races(races, policy, settings, tmp_path / "races"))
    found = list(audited_races(races, policy, settings, tmp_path / "races"))
    assert [race.race for race in found] == ["bahrain-2023", "other-2023", "third-2023"]
    assert asked == ["bahrain-2023", "other-2023", "other-2023", "third-2023"]
