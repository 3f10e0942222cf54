"""Measures the page of `hemline view` in a browser: `python -m benchmarks.page [MODEL] [--unpainted]`.

Starts the page in an installed chromium with chromedriver (selenium), and prints pictures per second and the time from
a click to a change. It counts uploads of the garment's vertices to the graphics card within the page, so neither sent
frames nor repaints of the screen are counted. Without a graphics card, chromium paints on the processor, as `renderer`
shows; `--unpainted` then skips the painting of triangles alone.
"""

import argparse
import json
import shutil
import statistics
import sys
import threading
import time
from itertools import pairwise

from selenium import webdriver

from hemline.cli.verbs.view import ViewOptions, open_catalog
from hemline.view import Page
from hemline.view.browser.requests import Request
from hemline.view.stage import stage

SECONDS = 6.0  # shorter than the clip, whose restart is not counted
CLICKS = 6
FLAGS = ("--headless", "--no-sandbox", "--no-first-run", "--window-size=1366,900", "--disable-background-networking")
COUNT = """
window.uploads = [];
for (const name of ['bufferSubData', 'bufferData']) {
  const plain = WebGL2RenderingContext.prototype[name];
  WebGL2RenderingContext.prototype[name] = function (...given) {
    const data = given[1]?.length === undefined ? given[2] : given[1];
    if (data?.length === window.sought) window.uploads.push([performance.now(), data[0], data[1], data[2]]);
    return plain.apply(this, given);
  };
}
"""
UNPAINTED = "WebGL2RenderingContext.prototype.drawElements = () => {};"
RENDERER = """
const gl = document.createElement('canvas').getContext('webgl2');
return gl.getParameter(gl.getExtension('WEBGL_debug_renderer_info').UNMASKED_RENDERER_WEBGL)
"""


def measure(model: str, *, painted: bool) -> dict:
    """Returns pictures per second, gaps between them [ms] and the latency of a click [ms]."""
    stage.STORED_FRAMES = 2  # every frame is computed; otherwise the second round comes from memory
    options = webdriver.ChromeOptions()
    options.binary_location = shutil.which("chromium") or ""
    for flag in FLAGS:
        options.add_argument(flag)
    with Page(open_catalog(ViewOptions(models=(model,), motion=("dance",)))) as page:
        threading.Thread(target=page.serve_forever, daemon=True).start()
        driver = webdriver.Chrome(options=options, service=webdriver.ChromeService(shutil.which("chromedriver")))
        try:
            vertices = 3 * len(page.stage.source.garment.vertices)
            source = f"window.sought = {vertices};{COUNT}{'' if painted else UNPAINTED}"
            driver.execute_cdp_cmd("Page.addScriptToEvaluateOnNewDocument", {"source": source})
            driver.get(page.url)
            _until(driver, "return window.uploads.length > 4")
            time.sleep(4)  # the page adapts its resolution
            print("measuring", file=sys.stderr, flush=True)
            page.requests.put(Request.FRAME, 0)
            time.sleep(0.5)  # the garment settles again
            driver.execute_script("window.uploads = []")
            time.sleep(SECONDS)
            rows = _pictures(driver)
            gaps = [after - before for before, after in pairwise(rows)]
            clicks = _latency(driver)
            figures = page.throttle.figures()
            _click(driver, "Pause")
            return {
                "model": model,
                "painted": painted,
                "renderer": driver.execute_script(RENDERER),
                "page_says": figures,
                "pictures_a_second": round(len(rows) / SECONDS, 1),
                "gap_median_ms": round(statistics.median(gaps)),
                "gap_p95_ms": round(sorted(gaps)[int(0.95 * len(gaps))]),
                "click_ms": clicks,
            }
        finally:
            driver.quit()


def _latency(driver) -> dict[str, int]:
    """Returns the time from a click on Play to the first moved frame, starting from a paused page [ms]."""
    delays = []
    for _ in range(CLICKS):
        _click(driver, "Pause")
        time.sleep(1.0)
        _click(driver, "Play")
        _until(driver, "return window.uploads.length")
        delays.append(driver.execute_script("return window.uploads[0][0] - window.clicked"))
    return {"median": round(statistics.median(delays)), "worst": round(max(delays))}


def _click(driver, words: str) -> None:
    button = f"[...document.querySelectorAll('button')].find(each => each.innerText.trim() === '{words}')"
    _until(driver, f"return {button} !== undefined")
    driver.execute_script(f"window.uploads = []; window.clicked = performance.now(); {button}.click()")


def _pictures(driver) -> list[float]:
    """Returns the times of uploads of different vertices; unit vectors are normals and do not count."""
    seen, times = set(), []
    for moment, *first in driver.execute_script("return window.uploads"):
        if abs(sum(part * part for part in first) - 1) > 1e-3 and tuple(first) not in seen:
            seen.add(tuple(first))
            times.append(moment)
    return times


def _until(driver, script: str) -> None:
    ends = time.monotonic() + 60
    while not driver.execute_script(script):
        if time.monotonic() > ends:
            raise TimeoutError(script)
        time.sleep(0.02)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("model", nargs="?", default="cape", help="Model to play (default: cape).")
    parser.add_argument("--unpainted", action="store_true", help="Skip the painting of triangles.")
    options = parser.parse_args()
    print(json.dumps(measure(options.model, painted=not options.unpainted), indent=1))
