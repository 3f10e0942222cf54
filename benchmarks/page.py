"""How fast the page of `hemline view` is in a real browser: pictures a second, and the time from a click to a change.

`python -m benchmarks.page [MODEL [unpainted]]` starts the page and an installed chromium with chromedriver
(selenium), and counts in the page itself which frames of the garment reach the graphics card: each upload of its
vertices, so what is counted is neither what was sent nor how often the screen was painted.
Where no graphics card is, chromium paints with the processor: `renderer` says so, and `unpainted` leaves out the
painting of triangles, which a graphics card would take over, and nothing else.
"""

import json
import shutil
import statistics
import sys
import threading
import time
from itertools import pairwise

from selenium import webdriver

from hemline.cli.view import ViewOptions, open_catalog
from hemline.view import Page, stage

SECONDS = 6.0  # less than the clip: its start anew is not counted
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


def measured(model: str, *, painted: bool) -> dict:
    """Pictures a second, gaps between them [ms], latency of a click [ms]."""
    stage.STORED_FRAMES = 2  # each frame is made; on a page that one looks at, the second round comes out of memory
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
            time.sleep(4)  # its scale of resolution settles
            print("measuring", file=sys.stderr, flush=True)
            page.wishes.put("frame", 0)
            time.sleep(0.5)  # settled anew there
            driver.execute_script("window.uploads = []")
            time.sleep(SECONDS)
            rows = _pictures(driver)
            gaps = [after - before for before, after in pairwise(rows)]
            clicks = _latency(driver)
            figures = page.pace.figures()
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
    """From a click on Play to the first frame that moved, the page at rest before."""
    found = []
    for _ in range(CLICKS):
        _click(driver, "Pause")
        time.sleep(1.0)
        _click(driver, "Play")
        _until(driver, "return window.uploads.length")
        found.append(driver.execute_script("return window.uploads[0][0] - window.clicked"))
    return {"median": round(statistics.median(found)), "worst": round(max(found))}


def _click(driver, words: str) -> None:
    button = f"[...document.querySelectorAll('button')].find(each => each.innerText.trim() === '{words}')"
    _until(driver, f"return {button} !== undefined")
    driver.execute_script(f"window.uploads = []; window.clicked = performance.now(); {button}.click()")


def _pictures(driver) -> list[float]:
    """Times of uploads of different vertices; normals have as many numbers, and lie between -1 and 1 with length 1."""
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
    print(json.dumps(measured((sys.argv[1:] or ["cape"])[0], painted="unpainted" not in sys.argv), indent=1))
