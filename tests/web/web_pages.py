"""A page in a real browser, and what Python plays in its place."""

import base64
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

import numpy as np

from hemline.bodies import ShapedBody
from hemline.motions import Motion
from hemline.playback import Frame, play
from tests.study.browser import browsing

FRAMES = """
const [model, clip, count, betas, pushing] = arguments, stage = window.hemline;
stage.choose(model, clip, betas);
const text = (array) => {
  const bytes = new Uint8Array(array.buffer);
  let found = "";
  for (let i = 0; i < bytes.length; i += 32768) found += String.fromCharCode(...bytes.subarray(i, i + 32768));
  return btoa(found);
};
return stage.frames(count, { pushing }).map((each) => [text(each.vertices), text(each.body), each.milliseconds]);
"""


class Opened:
    """A page that is open.

    Args:
        driver: The browser.
    """

    def __init__(self, driver):
        self.driver = driver

    def until(self, script: str):
        """Wait until a line of JavaScript is true; its value."""
        ends = time.monotonic() + 60
        while not (found := self.driver.execute_script(f"return {script}")):
            assert time.monotonic() < ends, script
            time.sleep(0.05)
        return found

    def frames(
        self, model: int, count: int, *, clip: int = 0, betas: Sequence[float] = (), pushing: bool = False
    ) -> tuple[np.ndarray, np.ndarray, list[dict[str, float]]]:
        """Vertices of garment and body in a clip's first frames (frames, verts, 3) [m], and times by stage [ms]."""
        found = self.driver.execute_script(FRAMES, model, clip, count, list(betas), pushing)
        meshes = ([_points(each[place]) for each in found] for place in (0, 1))
        return *map(np.array, meshes), [each[2] for each in found]


@contextmanager
def opened(address: str, *, playing: bool = False) -> Iterator[Opened]:
    """A page in Chromium; without it, a skip that says so.

    Args:
        address: Where it is.
        playing: It plays at once; else it waits, as for who asked their system for less motion.
    """
    with browsing() as driver:
        driver.set_script_timeout(300)
        driver.command_executor.client_config.timeout = 300  # else the connection gives up first
        wish = {"name": "prefers-reduced-motion", "value": "no-preference" if playing else "reduce"}
        driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": [wish]})
        driver.get(address)
        page = Opened(driver)
        page.until("window.hemline !== undefined && document.getElementById('loading').hidden")
        yield page


def played(model, body: ShapedBody, clip: Motion, count: int) -> list[Frame]:
    """The same frames in Python; what comes after the animator does not change its own vertices."""
    return [
        frame for frame, _ in zip(play(model, body, clip, whole=False, guarantee="fast"), range(count), strict=False)
    ]


def farthest_mm(found: np.ndarray, frames: Sequence[Frame]) -> float:
    """The largest distance of a vertex to what the animator made in Python."""
    return 1e3 * max(
        float(np.linalg.norm(one - other.animated, axis=1).max()) for one, other in zip(found, frames, strict=True)
    )


def _points(text: str) -> np.ndarray:
    return np.frombuffer(base64.b64decode(text), np.float32).reshape(-1, 3)
