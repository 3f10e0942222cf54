"""Web pages and names that mean harm, in a real browser: none reaches the page, none runs in it."""

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from urllib.parse import urlsplit

import pytest

from hemline.view.browser.requests import Request
from tests.view.view_samples import catalog, clip, serving, shirt

viser = pytest.importorskip("viser", reason="viser is not installed: pip install 'hemline[view]'")
from hemline.view import Catalog, Page  # noqa: E402
from tests.study.browser import browsing  # noqa: E402
from tests.view.test_view_page import until  # noqa: E402

RAN = "window.ran = []; window.alert = (text) => window.ran.push(text);"
NAME = (
    """{alert(document.domain)}<img src=x onerror="alert('image')"><script>alert('script')</script>![x](/etc/hosts)"""
)
ATTACK = """
const [address, protocol, done] = arguments;
const socket = new WebSocket(address, [protocol]);
socket.onopen = () => done("open");
socket.onerror = () => done("refused");
"""
FRAME = """
const [address, done] = arguments;
const frame = Object.assign(document.createElement("iframe"), { src: address });
frame.onload = () => done(frame.contentWindow.length);
document.body.append(frame);
"""
FETCH = """
const [address, done] = arguments;
fetch(address).then(async (reply) => done(await reply.text()), () => done("refused"));
"""

CHOSEN = "return [...document.querySelectorAll('input')].find((each) => each.value === arguments[0])"
TEXT_AS_PROGRAM = """
const [done] = arguments;
setTimeout(() => {
  try {
    new Function("return 1")();
    done("ran");
  } catch (error) {
    done(error.name);
  }
});
"""


@pytest.fixture(scope="module")
def driver() -> Iterator:
    with browsing() as driver:
        driver.set_window_size(1000, 700)
        driver.set_script_timeout(30)
        driver.execute_cdp_cmd("Page.addScriptToEvaluateOnNewDocument", {"source": RAN})
        yield driver
        driver.get("about:blank")


class _Nothing(BaseHTTPRequestHandler):
    def do_GET(self) -> None:
        self.send_response(200)
        self.send_header("Content-Type", "text/html")
        self.end_headers()
        self.wfile.write(b"<!doctype html><title>Free shirts</title><body>")

    def log_message(self, format: str, *args) -> None:
        """Nothing."""


@contextmanager
def elsewhere() -> Iterator[str]:
    """A web page of another origin, on this machine."""
    with ThreadingHTTPServer(("127.0.0.1", 0), _Nothing) as server:
        thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.02})
        thread.start()
        try:
            yield f"127.0.0.1:{server.server_port}"
        finally:
            server.shutdown()
            thread.join()


def connected(driver) -> bool:
    """Whether the page shows its controls."""
    return "Worst frames" in driver.find_element("tag name", "body").text


def test_a_page_of_another_origin_reaches_nothing(driver):
    """Not even one that knows the address; a script of the page itself opens the same WebSocket."""
    with serving(Page(catalog(), playing=False)) as page, elsewhere() as host:
        parts, protocol = urlsplit(page.url), f"viser-v{viser.__version__}"
        for place in (host, host.replace("127.0.0.1", "localhost")):
            driver.get(f"http://{place}/")
            assert driver.title == "Free shirts"
            for path in ("", "/", parts.path, parts.path.rstrip("/")):
                assert driver.execute_async_script(ATTACK, f"ws://{parts.netloc}{path}", protocol) == "refused"
            for address in (f"http://{parts.netloc}/", page.url):
                assert driver.execute_async_script(FETCH, address) == "refused"
            driver.execute_async_script(FRAME, page.url)
            assert driver.execute_script("return document.querySelector('iframe').contentDocument") is None
            driver.switch_to.frame(0)
            assert "Worst frames" not in driver.page_source
            driver.switch_to.default_content()
        driver.get(page.url)
        until(lambda: connected(driver), "the page works for who has the address")
        assert driver.execute_async_script(ATTACK, f"ws://{parts.netloc}{parts.path}", protocol) == "open"


def test_the_browser_is_led_to_the_page_by_an_address_that_works_once(driver):
    with serving(Page(catalog(), playing=False)) as page:
        once = page.door.one_time_address()
        driver.get(once)
        until(lambda: connected(driver), "the page")
        assert driver.current_url.startswith(page.url)
        driver.get(once)
        refusal = "Open the address that hemline shows in its terminal"
        until(lambda: refusal in driver.page_source, "the refusal")


def test_names_and_errors_run_nothing_and_are_shown_as_they_are(driver):
    stock = Catalog({"shirt": shirt, NAME: shirt}, {"walk": clip, NAME: clip})
    with serving(Page(stock, playing=False)) as page, elsewhere() as host:
        driver.get(page.url)
        until(lambda: connected(driver), "the page")
        page.requests.put(Request.MODEL, NAME)
        page.requests.put(Request.CLIP, NAME)
        until(lambda: page.choice.model == page.choice.clip == NAME, "a garment and a motion of that name")
        page.requests.put(Request.MATERIAL, NAME)
        until(lambda: page.error, "what is refused")
        seen = "return document.body.innerText"
        until(lambda: f"{NAME}, 3,150 vertices" in driver.execute_script(seen), "the name, as it is")
        until(lambda: "no such material; got" in driver.execute_script(seen), "what was refused")
        driver.execute_script(CHOSEN, "shirt").click()
        until(lambda: driver.execute_script(seen).count("{alert(document.domain)}") >= 3, "the names in the list")
        assert driver.execute_script("return window.ran") == []
        assert driver.find_elements("css selector", "img[src=x]") == []
        # the page's own rules: no text is taken for a program, and nothing comes from elsewhere or goes there
        assert driver.execute_async_script(TEXT_AS_PROGRAM) == "EvalError"
        assert driver.execute_async_script(FETCH, f"http://{host}/") == "refused"
