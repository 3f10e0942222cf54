"""The local page: a server of the standard library that this machine alone can reach."""

import errno
import json
import secrets
import sys
from collections.abc import Callable
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from importlib.resources import files
from socketserver import TCPServer
from typing import Any

from hemline.errors import BadAnswer, BadInput

from .clip_files import KINDS
from .pairs import Pair, Side
from .study import Item, Study

HOST = "127.0.0.1"
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
    """A page on which clips are compared, at `url`. Clips have random names there, new ones at each start.

    Args:
        asked: A study, whose page shows no name of a clip; or pairs only, shown with their names, A on the left, and
            nothing is asked.
        port: Where to listen; 0: a port that is free.
        report: Told in a line what stops the study; the page says only that something does, as the line may name clips.

    Raises:
        BadInput: The port is none, in use, or not allowed.

    Example:
        >>> with Viewer((), port=0) as viewer:
        ...     viewer.url.startswith("http://127.0.0.1:")
        True
    """

    daemon_threads = True

    def __init__(
        self, asked: Study | tuple[Pair, ...], *, port: int = 0, report: Callable[[str], None] = lambda line: None
    ):
        if not 0 <= port <= 65535:
            raise BadInput("a port lies from 0 to 65535", port, "0 takes one that is free")
        self.study, self.pairs = (asked, asked.pairs) if isinstance(asked, Study) else (None, asked)
        self.report = report
        try:
            super().__init__((HOST, port), _Handler)
        except OSError as reason:
            said = "it is in use" if reason.errno == errno.EADDRINUSE else reason.strerror or reason
            raise BadInput(
                f"cannot listen on port {port}", said, "choose another one; 0 takes one that is free"
            ) from None
        self.url = f"http://{HOST}:{self.server_address[1]}/"
        sides: tuple[Side, ...] = ("A", "B")
        self.clips: dict[str, tuple[Pair, Side]] = {
            f"/clips/{secrets.token_hex(12)}": (pair, side) for pair in self.pairs for side in sides
        }
        self.addresses = {(pair.name, side): address for address, (pair, side) in self.clips.items()}

    def server_bind(self) -> None:
        """Bind without asking a name server for the name of this machine, which may take seconds."""
        TCPServer.server_bind(self)
        self.server_name, self.server_port = HOST, self.server_address[1]

    def handle_error(self, request: Any, client_address: Any) -> None:
        """A browser that goes away while it is answered is no error."""
        if not isinstance(sys.exception(), ConnectionError):
            super().handle_error(request, client_address)

    def labelled(self) -> dict[str, Any]:
        """What the page shows where nothing is asked: all pairs with their names; of a study, that it is one."""
        if self.study is not None:
            return {"blind": True}
        pairs = [{"name": pair.name, "labels": [str(pair.a), str(pair.b)]} | self._sides(pair) for pair in self.pairs]
        return {"blind": False, "pairs": pairs}

    def following(self, study: Study, participant: Any) -> dict[str, Any]:
        """What the page shows next to a participant; nothing in it tells A from B."""
        item = study.following(participant)
        total = len(study.pairs) * len(study.questions)
        return {"total": total, "item": None if item is None else self._item(item, len(study.questions))}

    def _item(self, item: Item, questions: int) -> dict[str, Any]:
        place = {"pair": item.number // questions + 1, "pairs": len(self.pairs), "token": item.token}
        asked = {"question": item.question, "ordinal": item.number % questions + 1, "questions": questions}
        return place | asked | self._sides(item.shown.pair, a_left=item.shown.a_left)

    def _sides(self, pair: Pair, *, a_left: bool = True) -> dict[str, Any]:
        left, right = ("A", "B") if a_left else ("B", "A")
        both = {"left": self.addresses[pair.name, left], "right": self.addresses[pair.name, right]}
        return both | {"video": KINDS[pair.a.suffix.lower()].startswith("video/")}


class _Handler(BaseHTTPRequestHandler):
    server: Viewer
    server_version, sys_version = "hemline", ""
    timeout = 60

    def do_GET(self) -> None:
        if not self._is_local():
            return
        if self.path in _PAGE:
            name, kind = _PAGE[self.path]
            self._send(200, files("hemline.study").joinpath("page", name).read_bytes(), kind)
        elif self.path == "/study":
            self._say(200, self.server.labelled())
        elif self.path in self.server.clips:
            self._send_clip(*self.server.clips[self.path])
        else:
            self._say(404, {"error": "there is no such page"})

    def do_POST(self) -> None:
        study = self.server.study
        if not self._is_local():
            return
        if study is None or self.path not in ("/next", "/answer"):
            self._say(404, {"error": "there is no such page"})
            return
        try:
            asked = self._body()
            if self.path == "/answer":
                study.answer(*(asked.get(name) for name in ("participant", "token", "point", "seconds")))
            self._say(200, self.server.following(study, asked.get("participant")))
        except BadAnswer as error:
            self._say(400, {"error": str(error)})
        except BadInput as error:
            self.server.report(str(error))
            self._say(500, _STOPPED)

    def _is_local(self) -> bool:
        """Refuse what a page of another origin sends: it has another host's name, or says where it comes from."""
        host, origin = self.headers.get("Host", ""), self.headers.get("Origin")
        local = host.split(":")[0] in (HOST, "localhost") and origin in (None, f"http://{host}")
        if not local:
            self._say(403, {"error": f"this page is at {self.server.url}"})
        return local

    def _body(self) -> dict[str, Any]:
        try:
            length = int(self.headers.get("Content-Length", ""))
            if not 0 <= length <= _LONGEST_BODY:
                raise ValueError("too long")
            asked = json.loads(self.rfile.read(length))
        except (ValueError, RecursionError) as reason:
            raise BadAnswer("what the page sent cannot be read", reason, "load the page again") from reason
        if not isinstance(asked, dict):
            raise BadAnswer("the page must send an object", type(asked).__name__, "load the page again")
        return asked

    def _send_clip(self, pair: Pair, side: Side) -> None:
        try:
            content = pair.read(side)
        except BadInput as error:
            self.server.report(str(error))
            self._say(500, _STOPPED)
        else:
            self._send(200, content, KINDS[pair.a.suffix.lower()])

    def _say(self, status: int, content: dict[str, Any]) -> None:
        self._send(status, json.dumps(content).encode(), "application/json")

    def _send(self, status: int, content: bytes, kind: str) -> None:
        self.send_response(status)
        for name, value in {"Content-Type": kind, "Content-Length": str(len(content)), **_RULES}.items():
            self.send_header(name, value)
        self.end_headers()
        self.wfile.write(content)

    def log_message(self, format: str, *args: Any) -> None:
        """Nothing: what there is to see is in the CSV."""
