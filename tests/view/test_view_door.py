"""Who gets in at the page, tried by those who should not: web pages, other users of the machine, and noise."""

import contextlib
import http.client
import socket
import time
from urllib.parse import urlsplit

import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus

from hemline.access import WAITING
from hemline.errors import HemlineError
from hemline.view import Page
from hemline.view.browser import server
from tests.view.view_samples import catalog, serving
from tests.view.visitor import connect, viser, visiting


@pytest.fixture(scope="module")
def told() -> list[str]:
    return []


@pytest.fixture(scope="module")
def page(told):
    with serving(Page(catalog(), playing=True, report=told.append)) as page:
        yield page


@pytest.fixture(autouse=True)
def plays_on(page):
    yield
    index = page.stage.index
    until(lambda: page.stage.index != index, "whatever came, it plays on")


def until(what, why: str) -> None:
    ends = time.monotonic() + 60
    while not what():
        assert time.monotonic() < ends, why
        time.sleep(0.02)


def got(page: Page, path: str, **headers: str) -> tuple[int, bytes, dict[str, str]]:
    """What is answered to a request, without a browser."""
    connection = http.client.HTTPConnection("127.0.0.1", urlsplit(page.url).port, timeout=30)
    try:
        connection.request("GET", path, headers=headers)
        reply = connection.getresponse()
        return reply.status, reply.read(), dict(reply.getheaders())
    finally:
        connection.close()


def test_who_comes_by_the_address_is_let_in(page):
    key = urlsplit(page.url).path
    status, content, headers = got(page, key)
    assert status == 200 and b"<!doctype html>" in content.lower()
    assert headers["Referrer-Policy"] == "no-referrer" and headers["Cache-Control"] == "no-store"
    assert "frame-ancestors 'none'" in headers["Content-Security-Policy"]
    assert "unsafe-eval'" not in headers["Content-Security-Policy"].replace("wasm-unsafe-eval'", "")
    for url in (page.url, page.url.replace("127.0.0.1", "localhost"), page.url.rstrip("/")):
        with visiting(url) as visitor:
            visitor.until(lambda: visitor.control("Garment"), "the page's controls")


def test_the_other_end_of_a_tunnel_may_be_another_port(page):
    """As in `ssh -L 9000:127.0.0.1:8080`: the page's own scripts come from there, too."""
    with visiting(page.url, host="localhost:9000") as visitor:
        visitor.until(lambda: visitor.control("Garment"), "the page's controls")
    _, _, headers = got(page, urlsplit(page.url).path, Host="localhost:9000")
    assert "ws://localhost:9000;" in headers["Content-Security-Policy"]


EVIL = "http://evil.example"
STRANGERS = {
    "a page elsewhere": {"Origin": EVIL},
    "a page of no origin": {"Origin": "null"},
    "a page of another port": {"Origin": "http://127.0.0.1:1"},
    "a page of this port by another name": {"Origin": "http://localhost:{port}"},
    "a name that leads here": {"Host": "evil.example:{port}"},
    "a name that leads here, and its page": {"Host": "evil.example:{port}", "Origin": "http://evil.example:{port}"},
    "a name that begins like ours": {"Host": "127.0.0.1.evil.example"},
    "a page over TLS": {"Origin": "https://127.0.0.1:{port}"},
}


@pytest.mark.parametrize("stranger", STRANGERS)
def test_pages_of_other_origins_and_hosts_are_turned_away(page, stranger):
    """With the right key, too: not even where the address got about."""
    parts = urlsplit(page.url)
    headers = {name: value.format(port=parts.port) for name, value in STRANGERS[stranger].items()}
    for path in ("/", parts.path):
        status, content, _ = got(page, path, **headers)
        assert status == 403 and parts.path.strip("/").encode() not in content
        origin, host = headers.get("Origin", ""), headers.get("Host", "")
        with pytest.raises(InvalidStatus, match="403"), visiting(page.url, origin=origin, host=host):
            pass


@pytest.mark.parametrize("origin", ["", None], ids=["its own", "none"])
@pytest.mark.parametrize("path", ["", "/0123", "/{half}", "/x{key}", "/?{key}", "/..", "//{key}", "/index.html"])
def test_who_has_not_the_key_is_turned_away(page, path, origin):
    parts = urlsplit(page.url)
    key = parts.path.strip("/")
    place = path.format(key=key, half=key[:31])
    status, content, headers = got(page, place or "/")
    assert status == 403 and b"Open the address that hemline shows in its terminal" in content
    assert key not in content.decode() + str(headers)
    with pytest.raises(InvalidStatus, match="403"), visiting(f"http://{parts.netloc}{place}", origin=origin):
        pass


def test_a_program_that_tells_no_origin_is_turned_away(page):
    with pytest.raises(InvalidStatus, match="403"), visiting(page.url, origin=None):
        pass


def test_two_hosts_are_none(page):
    parts = urlsplit(page.url)
    with socket.create_connection((parts.hostname, parts.port), timeout=30) as connection:
        request = f"GET {parts.path} HTTP/1.1\r\nHost: {parts.netloc}\r\nHost: evil.example\r\n\r\n"
        connection.sendall(request.encode())
        assert b" 403 " in connection.recv(100)


def test_an_address_for_once_leads_to_the_page_once(page):
    once = urlsplit(page.door.one_time_address()).path
    assert got(page, once, Origin=EVIL)[0] == 403, "a page elsewhere does not use it up"
    status, _, headers = got(page, once)
    assert (status, headers["Location"]) == (303, urlsplit(page.url).path)
    assert got(page, once)[0] == 403


def test_the_server_listens_on_this_machine_alone(page):
    port = urlsplit(page.url).port
    for address in {info[4][0] for info in socket.getaddrinfo(socket.gethostname(), None, socket.AF_INET)}:
        if not address.startswith("127."):
            with pytest.raises(OSError), socket.create_connection((address, port), timeout=2):
                pass


def test_requests_that_do_not_end_are_few_and_keep_nobody_out(page):
    parts = urlsplit(page.url)
    with contextlib.ExitStack() as held:
        connections = []
        for _ in range(200):
            each = held.enter_context(socket.create_connection((parts.hostname, parts.port)))
            each.settimeout(server.REQUEST_TIMEOUT / 3)
            each.sendall(b"GET / HTTP/1.1\r\nHost: ")
            connections.append(each)
        assert got(page, parts.path)[0] == 200
        for connection in connections[: 200 - WAITING - 2]:
            with contextlib.suppress(ConnectionError):
                assert connection.recv(1) == b"", "the oldest are closed"


NOISE = {
    "no MessagePack": b"\xc1\xff",
    "text": "hello",
    "a number": b"\x01",
    "no type": b"\x80",
    "no such type": b"\x81\xa4type\xa3Foo",
    "a type that is none": b"\x81\xa4type\xc0",
    "deep": b"\x91" * 100_000 + b"\x01",
    "too long": b"\x00" * (server.LONGEST_MESSAGE + 1),
    "a camera that is none": b"\x82\xa4type\xb3ViewerCameraMessage\xa4wxyz\x01",
}


@pytest.mark.parametrize("name", NOISE)
def test_noise_ends_its_own_connection_and_nothing_else(page, told, name, capfd, caplog):
    """Of somebody who came by the address."""
    parts = urlsplit(page.url)
    origin, protocol = f"http://{parts.netloc}", f"viser-v{viser.__version__}"
    place, plain = f"ws://{parts.netloc}{parts.path}", socket.create_connection((parts.hostname, parts.port))
    told.clear()
    with connect(place, sock=plain, origin=origin, subprotocols=[protocol], max_size=None) as visitor:
        visitor.send(NOISE[name])
        with contextlib.suppress(ConnectionClosed):
            while True:
                visitor.recv(timeout=30)
    assert got(page, parts.path)[0] == 200
    assert name == "too long" or len(told) == 1, "told in a line"
    assert all(line.isprintable() and len(line) <= 600 for line in told)
    assert "Traceback" not in capfd.readouterr().err and caplog.records == []


def test_nobody_shares_the_page_with_the_world(page, monkeypatch):
    import requests

    calls = []
    monkeypatch.setattr(requests, "request", lambda *given, **more: calls.append(given))
    with visiting(page.url) as visitor:
        visitor.send({"type": "ShareUrlRequest"})
        visitor.set("Speed", "2")
        visitor.until(lambda: page.speed == 2.0, "the next message is heard")
        assert page._server.request_share_url() is None
    assert calls == [] and page._server._share_tunnel is None


def test_a_viser_that_starts_otherwise_serves_nothing(monkeypatch):
    from viser.infra import _infra

    plain = _infra.websockets.asyncio.server.serve

    class Elsewhere:
        """As if viser had taken `serve` before hemline could put another in its place."""

        asyncio = type("", (), {"server": type("", (), {"serve": staticmethod(plain)})})
        exceptions, datastructures = _infra.websockets.exceptions, _infra.websockets.datastructures

    sockets = _infra.websockets.asyncio.server
    monkeypatch.setattr(server, "_sockets_of", lambda viser: sockets)
    monkeypatch.setattr(_infra, "websockets", Elsewhere)
    with pytest.raises(HemlineError, match=rf"viser {viser.__version__} .* is not served; install a version"):
        Page(catalog())
    assert sockets.serve is plain


def test_a_viser_without_what_is_guarded_serves_nothing(monkeypatch):
    from viser.infra import _infra

    monkeypatch.delattr(_infra, "websockets")
    with pytest.raises(HemlineError, match="install a version that is known: pip install 'viser==1.1.1'"):
        Page(catalog())


def test_a_viser_server_of_somebody_else_is_left_alone(page):
    import viser

    other = viser.ViserServer("127.0.0.1", 0, verbose=False)
    try:
        connection = http.client.HTTPConnection("127.0.0.1", other.get_port(), timeout=30)
        connection.request("GET", "/")
        assert connection.getresponse().status == 200
        connection.close()
    finally:
        other.stop()
