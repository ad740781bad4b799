"""Pictures of the pit wall for README and docs, by Debian's Chromium at the real server.

    python page/screenshots.py

The race in the middle, and why its call is what it is. Needs /usr/bin/chromium, and Pillow of matplotlib to make the files small.
"""

import re
import subprocess
import sys
from io import BytesIO
from pathlib import Path
from typing import Literal

from PIL import Image
from playwright.sync_api import Browser, Page, sync_playwright

FIGURES = Path(__file__).parents[1] / "docs/figures"
CHROMIUM = "/usr/bin/chromium"
LINK = "#race=bahrain-2023&driver=HAM&seed=0&lap="
WAIT_MS = 90_000


def save(page: Page, name: str) -> None:
    """The page as it is, in 256 colours: it has few others."""
    picture = Image.open(BytesIO(page.screenshot())).convert("RGB")
    picture = picture.quantize(256, method=Image.Quantize.FASTOCTREE, dither=Image.Dither.NONE)
    path = FIGURES / f"wall-{name}.png"
    picture.save(path, optimize=True)
    print(f"{path.name}: {path.stat().st_size / 1000:.0f} kB")


def shown(chromium: Browser, base: str, lap: int, scheme: Literal["dark", "light"]) -> Page:
    """A page that stands still on a lap, with everything that its futures tell."""
    page = chromium.new_context(viewport={"width": 1440, "height": 900}, color_scheme=scheme, reduced_motion="reduce").new_page()
    page.set_default_timeout(WAIT_MS)
    page.goto(base + LINK + str(lap))
    page.get_by_role("button", name="Pause").click()
    page.locator("section.rejoin .place").wait_for()
    page.mouse.move(0, 0)
    page.wait_for_timeout(2000)
    return page


def main() -> None:
    """Draw both pictures."""
    command = [sys.executable, "-u", "-m", "rsrl", "wall", "--no-browser", "--port", "0"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as server, sync_playwright() as playwright:
        try:
            assert server.stdout is not None
            found = re.search(r"http://\S+:\d+/", server.stdout.readline())
            assert found, "rsrl wall told no address"
            base = found[0].replace("localhost", "127.0.0.1")
            chromium = playwright.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox", "--disable-gpu"])
            save(shown(chromium, base, 33, "dark"), "race")
            page = shown(chromium, base, 11, "light")
            page.keyboard.press("w")
            page.get_by_role("dialog").locator(".foot").wait_for()
            save(page, "why")
            chromium.close()
        finally:
            server.terminate()


if __name__ == "__main__":
    main()
