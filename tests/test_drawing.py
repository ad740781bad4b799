"""Figures: labels that do not overlap, team colours, race traces that stay in their frame, pages of strategies."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rsrl.drawing import (
    StintBar,
    TracePanel,
    car_styles,
    gaps_to_reference,
    new_figure,
    pages_of,
    plot_race_trace,
    plot_strategies,
    save_figure,
    spread,
)
from rsrl.drawing.race_trace import MOST_LAPS_BEHIND
from rsrl.errors import RsrlError
from rsrl.season import SC, load_race, race_names

STATUS = np.array([0, 0, 0, SC, SC, 0, 0, 0, 0, 0])


def race_times() -> np.ndarray:
    """Three cars over ten laps of 90 s, two of them behind a safety car at 130 s: car 1 loses 2 s a lap and closes up, car 2 retires."""
    lap_s = np.where(STATUS == SC, 130.0, 90.0)
    leader = np.cumsum(lap_s)
    second = np.cumsum(np.where(STATUS == 0, 92.0, 130.0 - 2.5))
    third = leader + 5.0
    third[6:] = np.nan
    return np.stack([leader, second, third], axis=1)


@given(st.lists(st.floats(-100, 100), min_size=1, max_size=24), st.floats(0.1, 5.0))
def test_labels_keep_their_distance_and_their_order(values: list[float], gap: float) -> None:
    places = spread(values, gap)
    order = np.argsort(values, kind="stable")
    assert (np.diff(places[order]) >= gap - 1e-6).all()


def test_labels_move_no_further_than_they_must() -> None:
    np.testing.assert_allclose(spread([0.0, 10.0, 20.0], 3.0), [0.0, 10.0, 20.0])
    np.testing.assert_allclose(spread([5.0, 5.0], 2.0), [4.0, 6.0])
    np.testing.assert_allclose(spread([0.0, 0.0, 9.0], 2.0, low=0.0, high=10.0), [0.0, 2.0, 9.0])


def test_team_mates_share_a_colour_and_differ_in_dash() -> None:
    styles = car_styles(["Ferrari", "McLaren", "Ferrari", "Some New Team", "Some New Team", "Another"])
    assert styles[0].colour == styles[2].colour
    assert styles[0].dash != styles[2].dash
    assert styles[3].colour == styles[4].colour != styles[5].colour


def test_every_team_of_the_shipped_races_has_a_colour_of_its_own() -> None:
    for name in ("bahrain-2022", "bahrain-2023", "bahrain-2024"):
        assert name in race_names()
        teams = {car.team for car in load_race(name).cars}
        assert len({style.colour for style in car_styles(sorted(teams))}) == len(teams)


def test_the_reference_ends_level_with_the_winner_and_waits_behind_the_safety_car() -> None:
    gaps = gaps_to_reference(race_times(), STATUS)
    assert gaps[-1, 0] == pytest.approx(0.0)
    assert np.abs(gaps[:, 0]).max() < 1e-9  # a steady leader is the reference, safety car or not
    assert gaps[4, 1] - gaps[2, 1] == pytest.approx(-5.0)  # the field closes up


def test_a_lap_missing_for_the_winner_is_bridged() -> None:
    times = race_times()
    whole = gaps_to_reference(times, STATUS)
    times[1, 0] = np.nan
    np.testing.assert_allclose(gaps_to_reference(times, STATUS)[:, 1], whole[:, 1])


def test_no_line_of_a_trace_leaves_the_frame(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    kept = []
    monkeypatch.setattr("rsrl.drawing.race_trace.save_figure", lambda figure, title, path: kept.append(figure))
    times = race_times()
    times[5:, 1] += 400.0  # four laps in the garage
    plot_race_trace([TracePanel("race", ("AAA", "BBB", "CCC"), ("x", "y", "z"), times, STATUS)] * 2, "title", tmp_path / "a.png")
    for axes in kept[0].axes:
        bottom, top = axes.get_ylim()
        for line in axes.lines:
            y = np.asarray(line.get_ydata(), float)
            assert ((y[np.isfinite(y)] <= bottom) & (y[np.isfinite(y)] >= top)).all()
        assert bottom < MOST_LAPS_BEHIND * 100 + 20
        assert {text.get_text() for text in axes.texts} == {"AAA", "BBB \u2193", "CCC"}


def test_at_most_six_strategists_stand_on_a_page(tmp_path: Path) -> None:
    bars = [StintBar(f"{g}", "", (0, 2), (20,), [(18, 22)], group=f"group {g}") for g in range(8) for _ in range(2)]
    assert [len({bar.group for bar in page}) for page in pages_of(bars)] == [6, 2]
    paths = plot_strategies(bars, 57, "title", "window", tmp_path / "s.png")
    assert [path.name for path in paths] == ["s.png", "s-2.png"]
    assert all(path.read_bytes().startswith(b"\x89PNG") for path in paths)


def test_a_folder_that_is_not_there_is_named(tmp_path: Path) -> None:
    figure, _ = new_figure(2.0, 2.0)
    with pytest.raises(RsrlError, match="none"):
        save_figure(figure, "title", tmp_path / "none" / "a.png")


def test_dollar_signs_in_names_are_no_formula(tmp_path: Path) -> None:
    figure, (axes,) = new_figure(3, 2)
    axes.plot([0, 1], label="runs/$x_{$")
    axes.text(0, 0, "$\\nothing{$")
    axes.legend()
    save_figure(figure, "runs/$a_{$", tmp_path / "a.png")
    assert (tmp_path / "a.png").stat().st_size > 0
