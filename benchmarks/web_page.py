"""Measures pages of `hemline page` in a browser: `python -m benchmarks.web_page [MODEL ...]`.

Prints size, frame time on one core, and the distance from the Python implementation. Plays 300 frames, the shipped
dance forwards and backwards, six times in an installed chromium (with chromedriver and selenium) on one core. The time
of a part of a frame is its minimum over the rounds, without the first one, in which the browser compiles. Nothing is
drawn.
"""

import argparse
import base64
import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np
from selenium import webdriver

from hemline import bodies, load, motions, web
from hemline.collide import inside
from hemline.motions import Motion
from hemline.playback import play

MODELS = ("cape", "skirt", "tshirt-light", "longsleeve-light", "trousers-light")
FRAMES, ROUNDS, EVERY = 300, 6, 10
FLAGS = ("--headless", "--no-sandbox", "--no-first-run", "--disable-background-networking", "--disable-gpu")
TIMES = """
const [count, pushing] = arguments;
return hemline.frames(count, { pushing }).map(({ milliseconds }) => milliseconds);
"""
VERTICES = """
const [count, pushing] = arguments;
return hemline.frames(count, { pushing }).map(({ vertices }) => {
  const bytes = new Uint8Array(vertices.buffer);
  let found = "";
  for (let i = 0; i < bytes.length; i += 32768) found += String.fromCharCode(...bytes.subarray(i, i + 32768));
  return btoa(found);
});
"""


def there_and_back() -> Motion:
    """Returns the shipped dance, forwards and then backwards, cut to FRAMES."""
    dance = motions.load("dance")
    arrays = {name: getattr(dance, name) for name in ("rotations", "translations")}
    return replace(dance, **{name: np.concatenate([each, each[-2:0:-1]])[:FRAMES] for name, each in arrays.items()})


@contextmanager
def browsing(page: Path) -> Iterator[webdriver.Chrome]:
    """Yields a browser on one core that shows the page at rest."""
    options = webdriver.ChromeOptions()
    options.binary_location = shutil.which("chromium") or ""
    for flag in FLAGS:
        options.add_argument(flag)
    cores = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {max(cores)})
    try:
        driver = webdriver.Chrome(options=options, service=webdriver.ChromeService(shutil.which("chromedriver")))
    finally:
        os.sched_setaffinity(0, cores)
    try:
        driver.set_script_timeout(600)
        driver.command_executor.client_config.timeout = 600
        feature = {"name": "prefers-reduced-motion", "value": "reduce"}
        driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": [feature]})
        driver.get(page.as_uri())
        while not driver.execute_script("return document.getElementById('loading').hidden"):
            pass
        yield driver
    finally:
        driver.quit()


def figures(name: str) -> str:
    """Measures a model and returns its row of the table."""
    model, body, clip = load(name), bodies.load("anny24").shaped(), there_and_back()
    shipped = {each: motions.load(each) for each in ("walk", "dance")}
    with tempfile.TemporaryDirectory() as folder:
        (page,) = web.write_page(
            Path(folder) / "page.html", web.page_contents({name: model}, shipped, body), title=name
        )
        size = page.stat().st_size / 1e6
        web.write_page(page, web.page_contents({name: model}, {"clip": clip}, body), title=name)
        with browsing(page) as driver:
            rounds = [driver.execute_script(TIMES, FRAMES, True) for _ in range(ROUNDS)][1:]
            animated, pushed = (_points(driver.execute_script(VERTICES, FRAMES, pushing)) for pushing in (False, True))
    errors, ends, counts = [], [], []
    for index, frame in enumerate(play(model, body, clip)):
        errors.append(np.linalg.norm(animated[index] - frame.animated, axis=1).max())
        ends.append(np.linalg.norm(pushed[index] - frame.vertices, axis=1).mean())
        if index % EVERY == 0:
            skin, faces = frame.body.vertices, frame.body.faces
            free = np.ones(len(frame.vertices), bool)
            free[frame.report.pinched] = False
            counts.append([100 * (inside(skin, faces, each[index]) & free).mean() for each in (animated, pushed)])
    times = {stage: np.min([[each[stage] for each in frames] for frames in rounds], axis=0) for stage in rounds[0][0]}
    parts = ", ".join(f"{stage} {np.median(times[stage]):.1f}" for stage in ("body", "animator", "push"))
    before, after = np.mean(counts, axis=0)
    median, late = np.percentile(times["body"] + times["animator"] + times["push"], [50, 95])
    return (
        f"| {name} | {size:.1f} MB | {median:.1f}; {late:.1f} ms ({parts}) | "
        f"{1e3 * max(errors):.4f} mm | {1e3 * np.mean(ends):.1f} mm | {before:.1f}; {after:.1f} % |"
    )


def _points(frames: list[str]) -> list[np.ndarray]:
    return [np.frombuffer(base64.b64decode(each), np.float32).reshape(-1, 3) for each in frames]


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("models", nargs="*", default=MODELS, help="Models. Defaults to all shipped models.")
    options = parser.parse_args()
    ends = "from its finished frame, mean | inside, not pinched: before the push; after |"
    print("| model | size | frame: median; p95 | farthest from the animator in Python |", ends)
    print("|---|---|---|---|---|---|")
    for name in options.models:
        print(figures(name), flush=True)
