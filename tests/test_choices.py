"""What is learned from the plans that teams chose: known tyres come back, nothing is known before its time, rules bind."""

import dataclasses

import numpy as np
import pytest
from choices_toy import FRESH_S, LAPS, PIT_S, SEVERITY, WEAR_S, managed_laps, plan_costs, toy_seasons

from rsrl.calibration.choices import SEQUENCE_INDEX, SEQUENCES, ChoiceFits, ChoiceModel, Setting, sequence_name, setting_before
from rsrl.errors import RsrlError
from rsrl.season import circuit_of

NOMINATED = {"S": "C4", "M": "C3", "H": "C2"}


@pytest.fixture(scope="module")
def fits() -> ChoiceFits:
    races = toy_seasons()
    return ChoiceFits(races, managed_laps(races))


@pytest.fixture(scope="module")
def model(fits: ChoiceFits) -> ChoiceModel:
    return fits.everything()


def setting(**changes: object) -> Setting:
    known = Setting(2025, 1, "catalunya", LAPS, NOMINATED, PIT_S)
    return dataclasses.replace(known, **changes)  # type: ignore[arg-type]


def test_sequences_keep_the_rules_and_the_sets() -> None:
    assert all(len(set(c)) > 1 and 2 <= len(c) <= 4 for c in SEQUENCES)
    assert all(c.count(0) <= 3 and c.count(1) <= 2 and c.count(2) <= 2 for c in SEQUENCES)
    assert sequence_name(SEQUENCE_INDEX[1, 2]) == "M-H"


def test_wear_is_recovered_although_drivers_hide_it(model: ChoiceModel) -> None:
    """Lap times alone would say `HIDDEN` of it: 0.4."""
    for track in SEVERITY:
        wear = np.exp(model.tyres(setting(circuit=circuit_of(track, 2023))).log_wear)
        truth = np.array([SEVERITY[track] * WEAR_S[int(NOMINATED[c][1])] for c in "SMH"])
        assert np.all(wear / truth > 0.7), track
        assert np.all(wear / truth < 1.4), track
        assert wear[0] > wear[1] > wear[2]


def test_gaps_between_compounds_are_recovered(model: ChoiceModel) -> None:
    offset = model.tyres(setting()).offset_s
    assert offset[0] == pytest.approx(FRESH_S[4], abs=0.2)
    assert offset[1] == 0.0
    assert offset[2] == pytest.approx(FRESH_S[2], abs=0.2)


def test_the_best_plan_is_the_best_plan(model: ChoiceModel) -> None:
    nominated = (2, 3, 4)
    costs = {c: plan_costs(c, nominated, SEVERITY["spain"]) for c in SEQUENCES if len(c) < 4}
    best = min(costs, key=lambda c: costs[c][1].min())
    plans = model.plans(setting())
    found = int(plans.value_s.argmin())
    assert costs[SEQUENCES[found]][1].min() < costs[best][1].min() + 1.5
    laps, cost = costs[best]
    assert plans.best_first_stop(SEQUENCE_INDEX[best]) == pytest.approx(laps[cost.argmin()][0], abs=3)


def test_it_predicts_better_than_frequencies_on_a_season_not_fitted() -> None:
    seen, unseen = toy_seasons(), [r for r in toy_seasons(seed=9) if r.key.season == 2024]
    fits = ChoiceFits([*(r for r in seen if r.key.season == 2023), *unseen])
    model = fits.before(2024, 0)
    own, frequent = [], []
    for race in unseen:
        plans = model.plans(setting_before(race, model.history))
        own += [-plans.log_probability()[0, c.sequence] for c in race.cars]
        frequent += [-plans.log_frequency[c.sequence] for c in race.cars]
    assert np.mean(own) < np.mean(frequent) - 0.1


def test_others_choices_tell_of_the_weekend(fits: ChoiceFits) -> None:
    model = fits.before(2024, 0)
    plans = model.plans(setting(circuit="losail", season=2024))
    soft, hard = SEQUENCE_INDEX[0, 1], SEQUENCE_INDEX[2, 1]
    after_soft = plans.log_probability_given([(i, soft) for i in range(1, 10)])
    after_hard = plans.log_probability_given([(i, hard) for i in range(1, 10)])
    assert after_soft[0, soft] > after_hard[0, soft]
    assert np.exp(after_soft).sum(axis=1) == pytest.approx(1.0)
    assert np.exp(plans.log_probability()).sum(axis=1) == pytest.approx(1.0)


def test_nothing_of_later_races_enters_a_fit() -> None:
    races = toy_seasons()
    late = [dataclasses.replace(r, pit_loss_s=35.0, cars=r.cars[::-1][:9]) if r.key.season_round > (2024, 4) else r for r in races]
    as_run, rewritten = ChoiceFits(races).before(2024, 5), ChoiceFits(late).before(2024, 5)
    probe = setting(season=2024, round=5)
    assert as_run.tyres(probe).log_wear == pytest.approx(rewritten.tyres(probe).log_wear, abs=0.0)
    assert as_run.plans(probe).log_frequency == pytest.approx(rewritten.plans(probe).log_frequency)


def test_a_fit_does_not_depend_on_the_fits_made_before_it() -> None:
    races = toy_seasons()[:16]
    first, second = ChoiceFits(races), ChoiceFits(races)
    first.before(2024, 4)
    assert np.array_equal(first.before(2024, 2).deviates, second.before(2024, 2).deviates)


def test_rules_bind(model: ChoiceModel) -> None:
    free = model.plans(setting())
    two_stops = model.plans(setting(min_stops=2))
    limited = model.plans(setting(max_laps_per_set=18))
    one_stop = [i for i, c in enumerate(SEQUENCES) if len(c) == 2]
    assert np.exp(free.log_probability()[0, one_stop]).sum() > 0.1
    assert np.exp(two_stops.log_probability()[0, one_stop]).sum() < 0.1
    assert np.exp(limited.log_probability()[0, one_stop]).sum() < np.exp(free.log_probability()[0, one_stop]).sum() / 2


def test_an_unknown_circuit_starts_from_the_population(model: ChoiceModel) -> None:
    known, unknown = model.tyres(setting()), model.tyres(setting(circuit="madring"))
    assert np.isfinite(unknown.log_wear).all()
    assert known.log_wear != pytest.approx(unknown.log_wear)


def test_without_a_dry_race_there_is_one_line() -> None:
    wet = [dataclasses.replace(r, wet=True) for r in toy_seasons()[:2]]
    with pytest.raises(RsrlError, match="no dry race whose choices"):
        ChoiceFits(wet)
    with pytest.raises(RsrlError, match="no dry race before 2023 round 1"):
        ChoiceFits(toy_seasons()[:3]).before(2023, 1)
