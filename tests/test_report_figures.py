"""Building blocks of the report: markup, numbers, scales, stint bars."""

import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rsrl.report.differences import tint
from rsrl.report.dots import Dot, DotRow, dot_plot
from rsrl.report.markup import Markup, element, together
from rsrl.report.numbers import counted, half_percent, half_width, percent, percent_range, place_range, race_title, signed, verdict
from rsrl.report.stints import Bar, stint_bars
from rsrl.report.svg import Scale, scale_over
from rsrl.results import DrivenStrategy, Interval

MINUS = "\N{MINUS SIGN}"


def test_elements_escape_text_and_attributes_but_not_markup() -> None:
    assert element("p", "a<b", element("b", "&"), class_="x", aria_label='"', hidden=True, id=None) == (
        '<p class="x" aria-label="&quot;" hidden>a&lt;b<b>&amp;</b></p>'
    )
    assert element("br") == "<br>"
    assert together("<", [Markup("<i>"), "'"]) == "&lt;<i>&#x27;"


ENDS: tuple[Interval | None, ...] = ((0.1, 0.2), (-0.2, -0.1), (-0.1, 0.1), (0.0, 0.0), None, (None, 1.0))


def test_numbers() -> None:
    assert [signed(x) for x in (0.126, -0.126, 0.004, -0.004)] == ["+0.13", f"{MINUS}0.13", "0.00", "0.00"]
    assert [percent(x) for x in (0.355, -0.3, -0.001, None)] == ["36 %", f"{MINUS}30 %", "0 %", "\N{EN DASH}"]
    assert percent_range((-0.4, 0.2)) == f"{MINUS}40 to 20 %"
    assert (half_width(6.0, (5.5, 6.75)), half_width(6.0, None), half_width(6.0, (None, None))) == ("±0.75", "", "")
    assert (half_percent(0.3, (0.2, 0.45)), half_percent(None, (0.2, 0.4))) == ("±15 %", "")
    assert (place_range((5.5, 6.754)), place_range(None)) == ("5.50 to 6.75", "\N{EN DASH}")
    assert [verdict(ends) for ends in ENDS] == [1, -1, 0, 0, 0, 0]
    assert race_title("great-britain-2023") == "Great Britain 2023"
    assert (counted(1, "track"), counted(1400, "track")) == ("1 track", "1,400 tracks")


@given(st.floats(-50, 50), st.floats(0.01, 100), st.integers(2, 12))
def test_ticks_are_round_evenly_spaced_and_within(low: float, span: float, most: int) -> None:
    scale = Scale(low, low + span, 0.0, 100.0)
    ticks = scale.ticks(most)
    assert len(ticks) <= most + 1
    assert all(-1e-6 <= scale(tick) <= 100 + 1e-6 for tick in ticks)
    steps = {round(b - a, 8) for a, b in zip(ticks, ticks[1:], strict=False)}
    assert len(steps) <= 1
    assert all(f"{step:.2e}"[0] in "125" for step in steps)


@given(st.lists(st.floats(-20, 20), min_size=1))
def test_a_scale_holds_all_values(values: list[float]) -> None:
    scale = scale_over(values, 10.0, 20.0)
    assert all(10 < scale(value) < 20 for value in values)


def test_stints_fill_the_race_from_end_to_end() -> None:
    strategy = DrivenStrategy(0.5, 25, (0, 1, 2), (10, 30), ((8, 13), (25, 34)), 5.0, "S-M@10-H@30")
    svg = stint_bars([Bar("all", "50 %", strategy)], 50, "alt")
    boxes = [(float(x), float(w)) for x, w in re.findall(r'<rect x="([\d.]+)" y="32" width="([\d.]+)"', svg)]
    assert [round(width / sum(w for _, w in boxes), 3) for _, width in boxes] == [0.2, 0.4, 0.4]
    assert all(a + w == pytest.approx(b, abs=0.01) for (a, w), (b, _) in zip(boxes, boxes[1:], strict=False))
    assert [text for text in ("S 10", "M 20", "H 20", ">50<") if text in svg] == ["S 10", "M 20", "H 20", ">50<"]


def test_dots_lie_in_the_order_of_their_values_and_zero_is_drawn() -> None:
    rows = [DotRow("a", [Dot(0.5, (0.4, 0.6))]), DotRow("b", [None]), DotRow("c", [Dot(1.5, None)])]
    svg = dot_plot(rows, "places", "alt", zero=True)
    places = [float(x) for x in re.findall(r'<circle cx="([\d.]+)"', svg)]
    zero = float(re.search(r'<line x1="([\d.]+)"[^>]*stroke-width="1.4"', svg).group(1))  # type: ignore[union-attr]
    assert zero < places[0] < places[1]
    assert (places[1] - zero) / (places[0] - zero) == pytest.approx(3, rel=1e-3)


def test_backgrounds_deepen_and_stay_bright_enough_for_black_text() -> None:
    assert tint(0.0) == "#ffffff"
    assert tint(3.0) == tint(1.0) != tint(0.5)
    for colour in (tint(1.0), tint(-1.0)):
        red, green, blue = (int(colour[i : i + 2], 16) / 255 for i in (1, 3, 5))
        assert 0.2126 * red**2.2 + 0.7152 * green**2.2 + 0.0722 * blue**2.2 > 0.3, "a contrast of 7 to 1 with black"
