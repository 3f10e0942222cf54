"""The page's server: this machine alone reaches it, it serves what it must and nothing else, and tells no name."""

import contextlib
import json
import re
import socket
import threading
import time
from dataclasses import replace
from urllib.parse import quote, urlsplit

import pytest

from hemline.access import WAITING
from hemline.errors import BadInput
from hemline.study import Study, Viewer, pairs_of, server
from tests.study.study_samples import BLUE, RED, knocked, make_clip, make_folders, sent, serving

CODE = {"participant": "P1"}


@pytest.fixture
def study(tmp_path) -> Study:
    return Study(pairs_of(make_folders(tmp_path)), tmp_path / "answers.csv")


def asked(viewer: Viewer, path: str, body=None, **headers: str):
    """Status, and the JSON that came back."""
    status, content, _ = sent(viewer, path, body, **headers)
    return status, json.loads(content)


def test_it_listens_on_this_machine_only(study):
    with serving(study) as viewer:
        assert viewer.server_address[0] == "127.0.0.1"
        assert re.fullmatch(rf"http://127\.0\.0\.1:{viewer.server_address[1]}/[0-9a-f]{{32}}/", viewer.url)


@pytest.mark.parametrize(
    "path, kind", [("/", "text/html"), ("/viewer.css", "text/css"), ("/viewer.js", "text/javascript")]
)
def test_the_page_and_its_rules(path, kind, study):
    with serving(study) as viewer:
        status, content, headers = sent(viewer, path)
    assert status == 200 and len(content) > 500 and headers["Content-Type"].startswith(kind)
    assert headers["Cache-Control"] == "no-store" and headers["X-Content-Type-Options"] == "nosniff"
    assert "default-src 'none'" in headers["Content-Security-Policy"]
    assert b"http://" not in content and b"https://" not in content, "nothing comes from elsewhere"


def test_a_whole_study_over_the_wire(study):
    with serving(study) as viewer:
        status, reply = asked(viewer, "/next", CODE)
        seen = []
        while reply["item"]:
            assert status == 200 and reply["total"] == 9
            item = reply["item"]
            seen.append((item["pair"], item["ordinal"]))
            a_left = study.next_item("P1").shown.a_left
            pair = study.next_item("P1").shown.pair
            _, left, headers = sent(viewer, item["left"])
            assert left == (pair.a if a_left else pair.b).read_bytes() and headers["Content-Type"] == "image/webp"
            assert sent(viewer, item["right"])[1] == (pair.b if a_left else pair.a).read_bytes()
            answer = CODE | {"token": item["token"], "point": 1, "seconds": 2.5}
            status, reply = asked(viewer, "/answer", answer)
    assert seen == [(pair, ordinal) for pair in (1, 2, 3) for ordinal in (1, 2, 3)]
    assert [answer.preference == 1 for answer in study.all_answers()] == [
        answer.left == "A" for answer in study.all_answers()
    ]


def test_nothing_that_is_sent_tells_a_from_b(study):
    """No name of a clip or pair, no seed; addresses are drawn anew at each start, whichever clip is on the left."""
    addresses = set()
    for _ in range(2):
        with serving(study) as viewer:
            status, begun = asked(viewer, "/study")
            assert (status, begun) == (200, {"blind": True})
            _, reply = asked(viewer, "/next", CODE)
            item = reply["item"]
            assert set(reply) == {"total", "item"}
            both = {"left", "right"}
            told = {"pair", "pairs", "token", "question", "ordinal", "questions", "video"}
            assert set(item) == both | told
            for side in both:
                _, _, headers = sent(viewer, item[side])
                assert set(headers) <= {
                    *("Server", "Date", "Content-Type", "Content-Length", "Cache-Control"),
                    *("Content-Security-Policy", "X-Content-Type-Options", "Referrer-Policy"),
                }
            names = ("ours", "skinned", "walk", "turn", "kick", "webp", "answers")
            assert not any(name in json.dumps(item) for name in names)
            assert len(viewer.addresses) == 6 and not addresses & set(viewer.clips)
            addresses |= set(viewer.clips)
    assert all(len(address) == len("/clips/") + 24 for address in addresses)


NOWHERE = [
    "/answers.csv",
    "/clips/",
    "/clips/../answers.csv",
    "/clips/..%2fanswers.csv",
    "/../../../etc/passwd",
    "//etc/passwd",
    "/page/viewer.html",
    "/viewer.html",
    "/ours/walk.webp",
    "/next",
    "/?x",
]


@pytest.mark.parametrize("path", NOWHERE)
def test_no_other_file_is_served(path, study):
    with serving(study) as viewer:
        assert asked(viewer, path) == (404, {"error": "there is no such page"})
        assert asked(viewer, path.replace("/next", "/study"), {}) == (404, {"error": "there is no such page"})


@pytest.mark.parametrize(
    "headers",
    [
        {"Host": "evil.example"},
        {"Host": ""},
        {"Origin": "http://evil.example"},
        {"Origin": "null"},
        {"Origin": "http://127.0.0.1:1"},
        {"Host": "127.0.0.1.evil.example"},
        {"Host": "evil.example", "Origin": "http://evil.example"},
    ],
    ids=str,
)
def test_pages_of_other_origins_are_refused(headers, study):
    with serving(study) as viewer:
        for path, body in (("/", None), ("/study", None), ("/next", CODE)):
            status, reply = asked(viewer, path, body, **headers)
            assert (status, reply) == (
                403,
                {"error": "This page answers neither other hosts nor pages of other origins."},
            )
        port = viewer.server_address[1]
        own = {"Host": f"localhost:{port}", "Origin": f"http://localhost:{port}"}
        assert asked(viewer, "/next", CODE, **own)[0] == 200


@pytest.mark.parametrize("key", ["", "/", "/0123", "/..", "/\u00e9", "/{other}", "/{half}", "/?{key}", "x{key}"])
def test_who_has_not_the_address_is_turned_away(key, study):
    """Another user of this machine finds the port, but not the key; nothing that is answered tells it."""
    with serving(study) as viewer, serving(study) as other:
        ours, theirs = (urlsplit(each.url).path.strip("/") for each in (viewer, other))
        start = key.format(key=ours, half=ours[:31], other=theirs)
        for path, body in (("/", None), ("/viewer.js", None), ("/study", None), ("/next", CODE), ("/answer", CODE)):
            place = quote(start + path, safe="/?")
            status, content, headers = knocked(viewer, place if place.startswith("/") else f"/{place}", body)
            assert status == 403 and b"Open the address that hemline shows in its terminal" in content
            assert ours not in content.decode() + str(headers)
    assert not study.answers.exists()


def test_an_address_for_once_leads_to_the_page_once(study):
    with serving(study) as viewer:
        path = urlsplit(viewer.door.one_time_address()).path
        elsewhere, _, _ = knocked(viewer, path, Origin="http://evil.example")
        assert elsewhere == 403, "a page of another origin does not use it up"
        status, _, headers = knocked(viewer, path)
        assert (status, headers["Location"]) == (303, urlsplit(viewer.url).path)
        assert knocked(viewer, path)[0] == 403
        status, _, headers = knocked(viewer, urlsplit(viewer.url).path.rstrip("/"))
        assert (status, headers["Location"]) == (303, viewer.url), "the page's parts lie beneath its address"


def half_open(viewer: Viewer) -> socket.socket:
    """A request that does not end."""
    connection = socket.create_connection(viewer.server_address)
    connection.sendall(b"GET / HTTP/1.1\r\nHost: ")
    return connection


def test_requests_that_do_not_end_hold_few_threads_and_keep_nobody_out(study):
    with serving(study) as viewer, contextlib.ExitStack() as held:
        before = threading.active_count()
        connections = [held.enter_context(half_open(viewer)) for _ in range(300)]
        assert sent(viewer, "/study")[0] == 200
        until = time.monotonic() + 10
        while threading.active_count() > before + WAITING and time.monotonic() < until:
            time.sleep(0.02)
        assert threading.active_count() <= before + WAITING
        for connection in connections[: 300 - WAITING - 2]:
            connection.settimeout(10)
            assert connection.recv(1) == b"", "the oldest are closed"


def test_a_request_that_trickles_in_is_given_up(study, monkeypatch):
    monkeypatch.setattr(server, "REQUEST_TIMEOUT", 0.5)
    with serving(study) as viewer, half_open(viewer) as connection:
        connection.settimeout(0.05)
        began = time.monotonic()
        with contextlib.suppress(ConnectionError):
            while time.monotonic() - began < 10:
                with contextlib.suppress(TimeoutError):
                    if not connection.recv(1):
                        break
                connection.sendall(b"a")
        assert 0.4 < time.monotonic() - began < 5


BODIES = {
    "no JSON": (b"point=3", "what the page sent cannot be read; got"),
    "no text": (b"\xff\xfe", "what the page sent cannot be read; got"),
    "too deep": (b"[" * 9000, "what the page sent cannot be read; got"),
    "too long": (b" " * 10_001, "what the page sent cannot be read; got too long; load the page again"),
    "a list": (b"[1]", "the page must send an object; got list; load the page again"),
    "nothing": (b"{}", "that is no participant code; got None"),
    "a code of another sort": (b'{"participant": {"a": 1}}', "that is no participant code"),
}


@pytest.mark.parametrize("name", BODIES)
@pytest.mark.parametrize("path", ["/next", "/answer"])
def test_what_the_page_does_not_send_is_refused(path, name, study):
    body, said = BODIES[name]
    with serving(study) as viewer:
        status, reply = asked(viewer, path, body)
        assert status == 400 and reply["error"].startswith(said)
        assert asked(viewer, path, b"", **{"Content-Length": "x"})[0] == 400
    assert not study.answers.exists()


def test_pressing_often_answers_once(study):
    """As many threads as a hand that drums on a key, and another participant meanwhile."""
    with serving(study) as viewer:
        token = asked(viewer, "/next", CODE)[1]["item"]["token"]
        other = asked(viewer, "/next", {"participant": "P2"})[1]["item"]["token"]
        statuses = []

        def press(participant: str, token: str) -> None:
            body = {"participant": participant, "token": token, "point": 4, "seconds": 1}
            statuses.append((participant, asked(viewer, "/answer", body)[0]))

        threads = [threading.Thread(target=press, args=one) for one in [("P1", token), ("P2", other)] * 4]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
    for person in ("P1", "P2"):
        assert sorted(status for who, status in statuses if who == person) == [200, 400, 400, 400]
    assert sorted(answer.participant for answer in study.all_answers()) == ["P1", "P2"]


def test_what_stops_a_study_is_told_to_who_runs_it_and_not_to_the_participant(study):
    told: list[str] = []
    with serving(study, report=told.append) as viewer:
        item = asked(viewer, "/next", CODE)[1]["item"]
        make_clip(study.pairs[0].a, (0, 200, 0))
        study.answers.write_text("spilt ours")
        paths = [address for address, (pair, _) in viewer.clips.items() if pair == study.pairs[0]]
        answer = CODE | {"token": item["token"], "point": 1, "seconds": 1}
        for path, body in (("/next", CODE), ("/answer", answer), (paths[0], None), (paths[1], None)):
            status, reply = asked(viewer, path, body)
            assert status == 500
            assert reply["error"].startswith("The study cannot go on. Please tell") and "ours" not in reply["error"]
    assert len(told) == 4 and all("\n" not in line for line in told)
    assert "is no CSV of answers; got the first line 'spilt ours'" in told[0]
    assert f"the clips of the pair '{study.pairs[0].name}' have changed; got" in told[2]


def test_a_clip_that_is_gone_is_told(study):
    told: list[str] = []
    with serving(study, report=told.append) as viewer:
        study.pairs[0].b.unlink()
        (path,) = [address for address, (pair, side) in viewer.clips.items() if (pair, side) == (study.pairs[0], "B")]
        assert asked(viewer, path)[0] == 500
    assert told[0].endswith("got No such file or directory; name a clip that can be read")


def test_without_questions_names_are_shown_and_nothing_is_asked(tmp_path):
    a, b = make_clip(tmp_path / "ours.gif", RED), make_clip(tmp_path / "skinned.gif", BLUE)
    with serving(pairs_of([a, b])) as viewer:
        _, shown = asked(viewer, "/study")
        assert shown["blind"] is False
        (pair,) = shown["pairs"]
        assert (pair["name"], pair["labels"], pair["video"]) == ("ours vs skinned", [str(a), str(b)], False)
        assert sent(viewer, pair["left"])[1] == a.read_bytes() and sent(viewer, pair["right"])[1] == b.read_bytes()
        for path in ("/next", "/answer"):
            assert asked(viewer, path, CODE) == (404, {"error": "there is no such page"})


def test_ports_that_cannot_be_had_are_said(study):
    for port in (-1, 65536):
        with pytest.raises(BadInput, match=f"a port lies from 0 to 65535; got {port}; 0 takes one that is free"):
            Viewer(study, port=port)
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        with pytest.raises(BadInput, match=f"cannot listen on port {port}; got it is in use; choose another one"):
            Viewer(study, port=port)


def test_only_a_browser_that_goes_away_is_no_error(study, capsys):
    with Viewer(study) as viewer:
        for error, said in ((ConnectionResetError(), False), (ZeroDivisionError(), True)):
            try:
                raise error
            except Exception:
                viewer.handle_error(None, ("127.0.0.1", 1))
            assert ("ZeroDivisionError" in capsys.readouterr().err) == said


def test_the_same_clip_twice_has_two_addresses(tmp_path):
    a = make_clip(tmp_path / "a.webp", RED)
    (pair,) = pairs_of([a, a])
    with Viewer((pair, replace(pair, name="again"))) as viewer:
        assert len(viewer.clips) == len(viewer.addresses) == 4
