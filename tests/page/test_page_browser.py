"""The page in a real browser at the real server: a race to its flag, explanations, the clock, what goes wrong, small screens, axe."""

import json
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Literal

import pytest
from axe_playwright_python.sync_playwright import Axe  # type: ignore[import-untyped]
from playwright.sync_api import Browser, Page, expect
from wall_browser import RACE, WAIT_MS, Line, Watched, browser, wall

pytestmark = pytest.mark.slow
expect.set_options(timeout=WAIT_MS)

Opener = Callable[..., Watched]


@pytest.fixture(scope="module")
def chromium() -> Iterator[Browser]:
    with browser() as launched:
        yield launched


@pytest.fixture(scope="module")
def port(chromium: Browser) -> Iterator[int]:
    with wall() as port:
        yield port


@pytest.fixture
def opener(chromium: Browser, port: int) -> Iterator[Opener]:
    """Makes pages; none of them may have had an error or asked another server when the test ends."""
    watched = []
    contexts = []

    def make(at: int = port, width: int = 1440, height: int = 900, scheme: Literal["light", "dark"] = "dark") -> Watched:
        context = chromium.new_context(viewport={"width": width, "height": height}, color_scheme=scheme, reduced_motion="reduce")
        contexts.append(context)
        watched.append(Watched(context.new_page(), at))
        return watched[-1]

    yield make
    for context in contexts:
        context.close()
    assert [wrong for one in watched for wrong in one.wrong] == []


def shown_lap(page: Page) -> int:
    return int(page.locator("header.top .lap b").inner_text())


def pause(page: Page) -> None:
    page.get_by_role("button", name="Pause").click()
    expect(page.get_by_role("button", name="Play")).to_be_visible()


def test_a_race_runs_to_its_flag_on_one_screen(opener: Opener) -> None:
    page = opener().open(f"#{RACE}&driver=HAM&lap=50")
    assert page.evaluate("[document.documentElement.scrollHeight <= innerHeight, document.documentElement.scrollWidth <= innerWidth]") == [
        True,
        True,
    ]
    assert page.locator("table tbody tr", has=page.locator("th button")).count() == 20
    expect(page.locator("section.call footer")).to_contain_text("futures")
    page.locator(".transport select").select_option("200×")
    expect(page.locator("section.call")).to_contain_text("Finished P")
    expect(page.locator(".strip")).to_contain_text("Chequered flag")
    assert shown_lap(page) == 57


def test_every_explanation_opens(opener: Opener) -> None:
    page = opener().open(f"#{RACE}&driver=HAM&lap=12")
    pause(page)
    page.keyboard.press("w")
    dialog = page.get_by_role("dialog")
    tabs = dialog.get_by_role("tab")
    expect(dialog.locator(".foot")).to_contain_text("simulated races")
    assert tabs.count() == 6
    for i in range(tabs.count()):
        tabs.nth(i).click()
        expect(dialog.locator(".foot")).to_contain_text("Took")
        assert dialog.get_by_role("tabpanel").inner_text().strip()
        if tabs.nth(i).inner_text() == "Decision path":
            assert dialog.locator("line.lit").count() >= 1, "the way through the tree is drawn"
    dialog.get_by_role("button", name="The call of the lap before").click()
    expect(dialog.get_by_role("heading", name=re.compile("lap 1[01]$"))).to_be_visible()
    expect(dialog.locator(".foot")).to_contain_text("Took")
    page.keyboard.press("Escape")
    expect(dialog).to_have_count(0)


def test_scrubbing_goes_to_a_lap_and_back(opener: Opener) -> None:
    page = opener().open(f"#{RACE}&driver=HAM&lap=20")
    pause(page)
    slider = page.get_by_role("slider", name="Timeline")
    slider.focus()
    lap = shown_lap(page)
    slider.press("PageUp")
    expect(page.locator("header.top .lap b")).to_have_text(str(lap + 10))
    slider.press("ArrowLeft")
    expect(page.locator("header.top .lap b")).to_have_text(str(lap + 9))
    page.locator("body").press("ArrowRight")
    expect(page.locator("section.call h2")).to_contain_text(re.compile(f"lap {lap + 10}|lap {lap + 9}"))


def test_a_reload_and_a_lost_connection_take_up_where_they_were(opener: Opener, port: int) -> None:
    line = Line(port)
    watched = opener(at=line.port)
    page = watched.open(f"#{RACE}&driver=VER&lap=30")
    before = shown_lap(page)
    assert before >= 29
    page.reload()
    expect(page.locator("header.top .lap b")).to_be_visible()
    expect(page.locator("section.call h2")).to_contain_text("VER")
    assert shown_lap(page) >= before
    line.cut()
    expect(page.get_by_role("alert")).to_contain_text("Connection lost")
    before = shown_lap(page)
    line.mend()
    expect(page.get_by_role("alert")).to_be_empty()
    expect(page.locator("section.call h2")).to_contain_text("VER")
    expect(page.locator("header.top .lap b")).not_to_have_text(str(before))  # it moves again
    assert shown_lap(page) > before
    line.close()
    assert all("WebSocket" in wrong for wrong in watched.wrong), watched.wrong
    watched.wrong.clear()


def test_two_viewers_each_with_car_and_clock(opener: Opener) -> None:
    one, other = opener().open(f"#{RACE}&driver=HAM&lap=10"), opener().open(f"#{RACE}&driver=HAM&lap=40")
    pause(one)
    pause(other)
    other.get_by_role("button", name=re.compile("^LEC$")).click()
    expect(other.locator("section.call h2")).to_contain_text("LEC")
    expect(one.locator("section.call h2")).to_contain_text("HAM")
    assert shown_lap(one) < 20 < shown_lap(other)


def test_a_phone_shows_the_call_first_and_needs_no_sideways_scrolling(opener: Opener) -> None:
    page = opener(width=390, height=844).open(f"#{RACE}&driver=HAM&lap=15")
    call, tower = page.locator("section.call").bounding_box(), page.locator("section.tower").bounding_box()
    assert call is not None
    assert tower is not None
    assert call["y"] + call["height"] <= tower["y"]
    assert call["y"] < 400, "the call is in sight"
    assert page.evaluate("document.documentElement.scrollWidth") <= 390


def test_one_press_at_lights_out_delays_everything(opener: Opener) -> None:
    page = opener().open(f"#{RACE}&driver=HAM&lap=2")
    page.keyboard.press("d")
    page.get_by_role("button", name="Lights out now").click()
    page.keyboard.press("Escape")
    expect(page.locator("nav")).to_contain_text(re.compile(r"Delay \d+ s"))
    assert shown_lap(page) == 1
    assert "lap 1" in page.locator("section.call h2").inner_text() or "Waiting" in page.locator("section.call").inner_text()


def test_exports_hold_the_race(opener: Opener, tmp_path: Path) -> None:
    page = opener().open(f"#{RACE}&driver=HAM&lap=9")
    page.get_by_role("button", name="Export").click()
    saved = {}
    for kind in ("PNG", "CSV", "JSON"):
        with page.expect_download() as waiting:
            page.get_by_role("dialog").get_by_role("button", name=kind).click()
        saved[kind] = tmp_path / waiting.value.suggested_filename
        waiting.value.save_as(saved[kind])
    assert saved["PNG"].read_bytes().startswith(b"\x89PNG")
    assert saved["CSV"].read_text().splitlines()[1].startswith("1,green,")
    document = json.loads(saved["JSON"].read_text())
    assert document["session"]["race"] == "bahrain-2023"
    assert len(document["race"]["tower"]) == 20


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_axe_finds_nothing(opener: Opener, scheme: Literal["light", "dark"]) -> None:
    page = opener(scheme=scheme).open(f"#{RACE}&driver=HAM&lap=12")
    pause(page)
    expect(page.locator("section.call footer")).to_contain_text("futures")
    found = {"wall": Axe().run(page)}
    for key, name in (("w", "why"), ("r", "race"), ("d", "delay"), ("?", "help")):
        page.keyboard.press(key)
        if name == "why":
            expect(page.get_by_role("dialog").locator(".foot")).to_be_visible()
        found[name] = Axe().run(page)
        page.keyboard.press("Escape")
        expect(page.get_by_role("dialog")).to_have_count(0)
    assert {name: one.generate_report() for name, one in found.items() if one.violations_count} == {}
