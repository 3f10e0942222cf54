"""The viser server of the page, behind a door: it takes nobody in who did not come by the page's address.

viser hands all requests to `serve` of the library websockets, and has no way of its own to say whom to refuse. So while
our server starts, `serve` is replaced by one that knows our server by the host that it is given, and adds what is
missing. Where viser does not call it as expected, nothing is served.
"""

import contextlib
import inspect
import io
import logging
import threading
from collections.abc import Callable
from functools import partial
from typing import Any

from hemline.doors import HOST, WAITING, Door, TurnedAway, listening
from hemline.errors import HemlineError, MissingExtra

from .html_text import one_line

LONGEST_MESSAGE = 1_000_000
"""The longest message that a browser may send [bytes]."""
REQUEST_TIMEOUT = 10.0
"""How long a request may take to arrive [s]."""
RULES = {
    "Cache-Control": "no-store",
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
}
CONTENT = (
    "default-src 'none'; script-src 'unsafe-inline' 'wasm-unsafe-eval' blob:; worker-src blob: data:; "
    "style-src 'unsafe-inline'; img-src data: blob:; font-src data:; connect-src data: blob: ws://{host}; "
    "frame-ancestors 'none'; base-uri 'none'; form-action 'none'"
)
"""What the page of viser needs: scripts that it brings itself, nothing from elsewhere, no text run as a script."""
_starting = threading.Lock()


def start_server(port: int, report: Callable[[str], None]) -> tuple[Any, Door]:
    """A viser server that listens on this machine, and the door before it.

    Args:
        port: Where to listen; 0: a port that is free.
        report: Told in a line what went wrong in the server.

    Raises:
        MissingExtra: viser is not installed.
        BadInput: The port is none, in use, or not allowed.
        HemlineError: This version of viser starts its server in a way that is not known.
    """
    try:
        import viser
    except ImportError:
        raise MissingExtra("viser", "view", "a page in the browser") from None
    sockets = _sockets_of(viser)

    class LocalServer(viser.ViserServer):
        def request_share_url(self, verbose: bool = True) -> str | None:
            """None: the page stays on this machine, whatever a browser asks for."""
            return None

    listener = listening(port)
    door, host, plain = Door(listener.getsockname()[1]), _Host(HOST), sockets.serve
    guarded: list[bool] = []

    def serve(handler: Any, at: Any, *place: Any, **options: Any) -> Any:
        if at is not host:  # a server of somebody else, who starts it meanwhile
            return plain(handler, at, *place, **options)
        inner = options.get("process_request")
        guarded.append(callable(inner))
        waiting: dict[Any, Any] = {}
        ours = {
            "process_request": _guard(door, inner, waiting),
            "create_connection": _limit_connections(sockets.ServerConnection, waiting),
            "max_size": LONGEST_MESSAGE,
            "open_timeout": REQUEST_TIMEOUT,
            "logger": _logger(report),
        }
        return plain(handler, sock=listener, **(options | ours))

    with _starting, contextlib.redirect_stdout(io.StringIO()):
        sockets.serve = serve
        try:
            server = LocalServer(host, listener.getsockname()[1], label="hemline", verbose=False)
        except BaseException:
            listener.close()
            raise
        finally:
            sockets.serve = plain
        if guarded != [True]:
            server.stop()
            listener.close()
            raise _unknown(viser)
    loop = server.get_event_loop()
    loop.call_soon_threadsafe(loop.set_exception_handler, partial(_report_exception, report))
    return server, door


def _sockets_of(viser: Any) -> Any:
    """The module with `serve`, as viser itself finds it."""
    try:
        from viser.infra import _infra

        return vars(_infra)["websockets"].asyncio.server
    except (ImportError, KeyError, AttributeError):
        raise _unknown(viser) from None


def _unknown(viser: Any) -> HemlineError:
    return HemlineError(
        f"viser {viser.__version__} starts its server in a way that hemline does not know, so the page could not be "
        "guarded, and is not served; install a version that is known: pip install 'viser==1.1.1'"
    )


def _report_exception(report: Callable[[str], None], _: Any, context: dict[str, Any]) -> None:
    """A message that could be read, and asks for what there is not."""
    if context.get("exception") is not None:
        report(one_line(context["exception"]))


class _Host(str):
    """A host; by being this very one it marks the server that is started here."""


def _guard(door: Door, inner: Any, waiting: dict[Any, Any]) -> Any:
    """What `websockets` asks before it answers, page and WebSocket alike: nobody reaches viser who is not let in."""

    async def process_request(connection: Any, request: Any) -> Any:
        hosts, origins = (request.headers.get_all(name) for name in ("Host", "Origin"))
        rules = {**RULES, "Content-Security-Policy": "default-src 'none'"}
        try:
            path = door.entered(request.path, hosts, origins, script="Upgrade" in request.headers)
        except TurnedAway as why:
            response = connection.respond(why.status, f"{why.said}\n")
            if why.location is not None:
                response.headers["Location"] = why.location
        else:
            waiting.pop(connection, None)
            request.path = path or "/"
            response = inner(connection, request)
            if inspect.isawaitable(response):
                response = await response
            rules["Content-Security-Policy"] = CONTENT.format(host=hosts[0])
        if response is not None:
            for name, value in rules.items():
                response.headers[name] = value
        return response

    return process_request


def _limit_connections(base: Any, waiting: dict[Any, Any]) -> Any:
    """Connections, of which only so many may be open that were not let in."""

    class Connection(base):
        def connection_made(self, transport: Any) -> None:
            super().connection_made(transport)
            waiting[self] = transport
            if len(waiting) > WAITING:
                waiting.pop(next(iter(waiting))).abort()

        def connection_lost(self, exc: Exception | None) -> None:
            waiting.pop(self, None)
            super().connection_lost(exc)

    return Connection


def _logger(report: Callable[[str], None]) -> logging.Logger:
    """Tells in a line when a connection ended since a message could not be read; who is turned away is not told."""

    class Told(logging.Handler):
        def emit(self, record: logging.LogRecord) -> None:
            if record.getMessage() == "connection handler failed" and record.exc_info:
                report(one_line(record.exc_info[1]))

    logger = logging.Logger("hemline.view")
    logger.addHandler(Told(logging.ERROR))
    return logger
