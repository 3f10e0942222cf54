"""The local page of a study: a server of the standard library that admits users of its address."""

import contextlib
import io
import json
import secrets
import socket
import sys
import threading
from collections.abc import Callable
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from importlib.resources import files
from typing import Any

from hemline.access import WAITING, AccessControl, AccessRefused, open_listener
from hemline.errors import BadAnswer, BadInput

from .clip_files import KINDS
from .pairs import Pair, Side
from .study import Item, Study
from .timed_reads import TimedReads

REQUEST_TIMEOUT = 10.0
"""Longest time that a request may take to arrive [s]."""
_PAGE = {
    "/": ("viewer.html", "text/html; charset=utf-8"),
    "/viewer.css": ("viewer.css", "text/css; charset=utf-8"),
    "/viewer.js": ("viewer.js", "text/javascript; charset=utf-8"),
}
_RULES = {
    "Cache-Control": "no-store",
    "Content-Security-Policy": "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; "
    "img-src blob: data:; media-src blob:; frame-ancestors 'none'",
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
}
_LONGEST_BODY = 10_000
_STOPPED = {"error": "The study cannot go on. Please tell the person who runs it; all that you answered is kept."}


class Viewer(ThreadingHTTPServer):
    """A page on which clips are compared, under random names that change with each start.

    Whoever has the address `url` is admitted; it contains a key that changes with each start. Others are turned away,
    and only a few connections are kept open before they are admitted, for ten seconds.

    Args:
        content: A study, whose page hides the names of clips; or pairs, shown with their names, A on the left, without
            questions.
        port: The port to listen on; 0: any free port.
        report: Called with each error that stops the study, as one line. The page does not show it, since it may name
            clips.

    Raises:
        BadInput: The port does not exist, is in use or is not allowed.

    Attributes:
        url: The address, with the key that grants access.
        door: The access control; it also gives an address that works once.

    Example:
        >>> with Viewer((), port=0) as viewer:
        ...     viewer.url.startswith("http://127.0.0.1:")
        True
    """

    daemon_threads = True

    def __init__(
        self, content: Study | tuple[Pair, ...], *, port: int = 0, report: Callable[[str], None] = lambda line: None
    ):
        self.study, self.pairs = (content, content.pairs) if isinstance(content, Study) else (None, content)
        self.report = report
        self._waiting: dict[socket.socket, None] = {}
        self._lock = threading.Lock()
        listener = open_listener(port)
        super().__init__(listener.getsockname(), _Handler, bind_and_activate=False)
        self.socket.close()
        self.socket, self.server_address = listener, listener.getsockname()
        self.door = AccessControl(self.server_address[1])
        self.url = self.door.url
        sides: tuple[Side, ...] = ("A", "B")
        self.clips: dict[str, tuple[Pair, Side]] = {
            f"/clips/{secrets.token_hex(12)}": (pair, side) for pair in self.pairs for side in sides
        }
        self.addresses = {(pair.name, side): address for address, (pair, side) in self.clips.items()}

    def process_request(self, request: Any, client_address: Any) -> None:
        """Answers in a thread; if too many connections wait to be admitted, the oldest of them is closed."""
        with self._lock:
            self._waiting[request] = None
            oldest = next(iter(self._waiting)) if len(self._waiting) > WAITING else None
        if oldest is not None:
            self.let_in(oldest)
            with contextlib.suppress(OSError):  # it may be closed already
                oldest.shutdown(socket.SHUT_RDWR)
        super().process_request(request, client_address)

    def let_in(self, request: Any) -> None:
        """Marks a connection as admitted."""
        with self._lock:
            self._waiting.pop(request, None)

    def shutdown_request(self, request: Any) -> None:
        """Closes a connection that was answered."""
        self.let_in(request)
        super().shutdown_request(request)

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Ignores browsers that leave while they are answered."""
        if not isinstance(sys.exception(), ConnectionError):
            super().handle_error(request, client_address)

    def labels(self) -> dict[str, Any]:
        """Returns all pairs with their names for a page without questions; for a study, only that it is blind."""
        if self.study is not None:
            return {"blind": True}
        pairs = [{"name": pair.name, "labels": [str(pair.a), str(pair.b)]} | self._sides(pair) for pair in self.pairs]
        return {"blind": False, "pairs": pairs}

    def next_item(self, study: Study, participant: Any) -> dict[str, Any]:
        """Returns the next item for a participant; nothing in it distinguishes A from B."""
        item = study.next_item(participant)
        total = len(study.pairs) * len(study.questions)
        return {"total": total, "item": None if item is None else self._item(item, len(study.questions))}

    def _item(self, item: Item, questions: int) -> dict[str, Any]:
        place = {"pair": item.number // questions + 1, "pairs": len(self.pairs), "token": item.token}
        texts = {"question": item.question, "ordinal": item.number % questions + 1, "questions": questions}
        return place | texts | self._sides(item.shown.pair, a_left=item.shown.a_left)

    def _sides(self, pair: Pair, *, a_left: bool = True) -> dict[str, Any]:
        left, right = ("A", "B") if a_left else ("B", "A")
        both = {"left": self.addresses[pair.name, left], "right": self.addresses[pair.name, right]}
        return both | {"video": KINDS[pair.a.suffix.lower()].startswith("video/")}


class _Handler(BaseHTTPRequestHandler):
    server: Viewer
    server_version, sys_version = "hemline", ""
    timeout = 60

    def setup(self) -> None:
        """Limits the time of reading a request."""
        super().setup()
        self.rfile = io.BufferedReader(TimedReads(self.connection, REQUEST_TIMEOUT))

    def do_GET(self) -> None:
        path = self._path_behind_key()
        if path is None:
            return
        if path in _PAGE:
            name, kind = _PAGE[path]
            self._send(200, files("hemline.study").joinpath("page", name).read_bytes(), kind)
        elif path == "/study":
            self._say(200, self.server.labels())
        elif path in self.server.clips:
            self._send_clip(*self.server.clips[path])
        else:
            self._say(404, {"error": "there is no such page"})

    def do_POST(self) -> None:
        study, path = self.server.study, self._path_behind_key()
        if path is None:
            return
        if study is None or path not in ("/next", "/answer"):
            self._say(404, {"error": "there is no such page"})
            return
        try:
            sent = self._body()
            if path == "/answer":
                study.answer(*(sent.get(name) for name in ("participant", "token", "point", "seconds")))
            self._say(200, self.server.next_item(study, sent.get("participant")))
        except BadAnswer as error:
            self._say(400, {"error": str(error)})
        except BadInput as error:
            self.server.report(str(error))
            self._say(500, _STOPPED)

    def _path_behind_key(self) -> str | None:
        """Returns the path after the key; None if the request was turned away, which was answered."""
        hosts, origins = (self.headers.get_all(name, []) for name in ("Host", "Origin"))
        try:
            path = self.server.door.admit(self.path, hosts, origins)
            if not path:  # without the last slash, the page would look for its parts in another place
                raise AccessRefused("The page is here.", self.server.url)
        except AccessRefused as why:
            self._say(why.status, {"error": why.message}, why.location)
            return None
        self.server.let_in(self.connection)
        return path

    def _body(self) -> dict[str, Any]:
        try:
            length = int(self.headers.get("Content-Length", ""))
            if not 0 <= length <= _LONGEST_BODY:
                raise ValueError("too long")
            sent = json.loads(self.rfile.read(length))
        except (ValueError, RecursionError) as reason:
            raise BadAnswer("what the page sent cannot be read", reason, "load the page again") from reason
        if not isinstance(sent, dict):
            raise BadAnswer("the page must send an object", type(sent).__name__, "load the page again")
        return sent

    def _send_clip(self, pair: Pair, side: Side) -> None:
        try:
            content = pair.read(side)
        except BadInput as error:
            self.server.report(str(error))
            self._say(500, _STOPPED)
        else:
            self._send(200, content, KINDS[pair.a.suffix.lower()])

    def _say(self, status: int, content: dict[str, Any], location: str | None = None) -> None:
        self._send(status, json.dumps(content).encode(), "application/json", location)

    def _send(self, status: int, content: bytes, kind: str, location: str | None = None) -> None:
        self.connection.settimeout(self.timeout)
        self.send_response(status)
        place = {} if location is None else {"Location": location}
        for name, value in {"Content-Type": kind, "Content-Length": str(len(content)), **place, **_RULES}.items():
            self.send_header(name, value)
        self.end_headers()
        self.wfile.write(content)

    def log_message(self, format: str, *args: Any) -> None:
        """Logs nothing; the CSV has all there is to know."""
