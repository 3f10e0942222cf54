"""A real browser without a window, and what a participant does on the page."""

import io
import shutil
from collections.abc import Iterator
from contextlib import contextmanager

import pytest
from PIL import Image

CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
DRIVER = shutil.which("chromedriver")
FLAGS = (
    *("--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run"),
    *("--disable-background-networking", "--disable-component-update", "--disable-sync", "--window-size=1366,900"),
)


@contextmanager
def browsing() -> Iterator:
    """A browser, or a skip that says what is missing."""
    webdriver = pytest.importorskip(
        "selenium.webdriver", reason="selenium is not installed: pip install 'hemline[dev]'"
    )
    if CHROMIUM is None or DRIVER is None:
        pytest.skip("chromium and chromedriver are not installed (Debian: apt install chromium chromium-driver)")
    options = webdriver.ChromeOptions()
    options.binary_location = CHROMIUM
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    for flag in FLAGS:
        options.add_argument(flag)
    driver = webdriver.Chrome(options=options, service=webdriver.ChromeService(DRIVER))
    try:
        yield driver
    finally:
        driver.quit()


class Page:
    """The page as a participant sees it.

    Args:
        driver: The browser.
    """

    def __init__(self, driver):
        self.driver = driver

    def until(self, script: str):
        """Wait until a line of JavaScript is true; its value. The page's script may not have run yet."""
        from selenium.webdriver.support.ui import WebDriverWait

        ready = f"return typeof state !== 'undefined' && ({script})"
        return WebDriverWait(self.driver, 30, 0.05).until(lambda driver: driver.execute_script(ready))

    def text(self, name: str) -> str:
        """What stands in an element."""
        return self.driver.find_element("id", name).text

    def begin(self, url: str, code: str) -> None:
        """Load the page and type a participant's code."""
        self.driver.get(url)
        self.until("!document.getElementById('welcome').hidden")
        self.driver.find_element("id", "code").send_keys(code + "\n")
        self.until("state.code !== null && !state.busy")

    def press(self, keys: str) -> None:
        """Type, wherever the focus is."""
        self.driver.switch_to.active_element.send_keys(keys)

    def answer(self, point: int) -> None:
        """Choose a point by its key and confirm; wait for what comes next."""
        before = self.driver.execute_script("return state.item.token")
        self.press(f"{point}")
        self.press("\n")
        self.until(f"state.item?.token !== '{before}' && !state.busy")

    def colours(self) -> tuple[str, str]:
        """Which clip is seen on the left and on the right: in pictures of the page, A is red and B blue."""
        return tuple(self._colour(name) for name in ("left", "right"))

    def _colour(self, name: str) -> str:
        picture = Image.open(io.BytesIO(self.driver.find_element("id", name).screenshot_as_png)).convert("RGB")
        pixels = [picture.getpixel((picture.width * n // 8, picture.height // 2)) for n in range(1, 8)]
        reds = sum(red > 2 * blue for red, _, blue in pixels)
        blues = sum(blue > 2 * red for red, _, blue in pixels)
        assert max(reds, blues) >= 5 and min(reds, blues) == 0, pixels
        return "A" if reds else "B"

    def bars(self, steps: int) -> list[int]:
        """Where the white bar of each clip is, in one picture of the page."""
        page = Image.open(io.BytesIO(self.driver.get_screenshot_as_png())).convert("RGB")
        found = []
        for name in ("left", "right"):
            place = self.driver.find_element("id", name).rect
            row = place["y"] + place["height"] / 2
            columns = [place["x"] + place["width"] * (step + 0.5) / steps for step in range(steps)]
            found.append(max(range(steps), key=lambda step: page.getpixel((int(columns[step]), int(row)))[1]))
        return found

    def complaints(self) -> list[str]:
        """What the browser's console says since it was last asked, but for replies that refuse."""
        lines = [entry["message"] for entry in self.driver.get_log("browser")]
        return [line for line in lines if "Failed to load resource" not in line]
