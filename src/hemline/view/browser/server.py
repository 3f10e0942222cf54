"""The viser server of the page, with access control: it refuses everyone who does not use the address of the page.

viser passes all connections to `serve` of the library websockets and offers no hook to refuse one. So while our server
starts, `serve` is replaced by a function that recognises our server by its host object and adds the checks. If viser
does not call it as expected, nothing is served.
"""

import contextlib
import inspect
import io
import logging
import threading
from collections.abc import Callable
from concurrent.futures import Future
from functools import partial
from typing import Any

from hemline.access import HOST, WAITING, AccessControl, AccessRefused, open_listener
from hemline.errors import HemlineError, MissingExtra

from .html_text import one_line

LONGEST_MESSAGE = 1_000_000
"""Longest message that a browser may send [bytes]."""
REQUEST_TIMEOUT = 10.0
"""Longest time that a request may take to arrive [s]."""
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
"""Content Security Policy of viser's page: its own scripts, nothing from elsewhere, no text run as a script."""
_starting = threading.Lock()


def start_server(port: int, report: Callable[[str], None]) -> tuple[Any, AccessControl]:
    """Starts a viser server that listens on this machine, and returns it with its access control.

    Args:
        port: The port to listen on; 0: any free port.
        report: Called with each error of the server, as one line.

    Raises:
        MissingExtra: viser is not installed.
        BadInput: The port does not exist, is in use or is not allowed.
        HemlineError: This version of viser starts its server in an unknown way.
    """
    try:
        import viser
    except ImportError:
        raise MissingExtra("viser", "view", "a page in the browser") from None
    sockets = _sockets_of(viser)

    class LocalServer(viser.ViserServer):
        def request_share_url(self, verbose: bool = True) -> str | None:
            """Returns None, whatever a browser asks for: the page stays on this machine."""
            return None

    listener = open_listener(port)
    door, host, plain = AccessControl(listener.getsockname()[1]), _Host(HOST), sockets.serve
    guarded: list[bool] = []

    def serve(handler: Any, at: Any, *place: Any, **options: Any) -> Any:
        if at is not host:  # a server that other code starts in the meantime
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


def in_loop(server: Any, do: Callable[[], None]) -> Future[None]:
    """Runs a function in the event loop of a server, between two messages of browsers.

    Args:
        server: The viser server.
        do: What to run.

    Returns:
        A future that is done when the function has run.
    """
    done: Future[None] = Future()

    def run() -> None:
        try:
            done.set_result(do())
        except BaseException as error:
            done.set_exception(error)

    server.get_event_loop().call_soon_threadsafe(run)
    return done


def _sockets_of(viser: Any) -> Any:
    """Returns the module that holds `serve`, as viser itself finds it."""
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
    """Reports a message that is readable but asks for something that does not exist."""
    if context.get("exception") is not None:
        report(one_line(context["exception"]))


class _Host(str):
    """A host name whose identity marks the server that is started here."""


def _guard(door: AccessControl, inner: Any, waiting: dict[Any, Any]) -> Any:
    """Returns the hook that websockets calls before each answer, for page and WebSocket: it admits or refuses."""

    async def process_request(connection: Any, request: Any) -> Any:
        hosts, origins = (request.headers.get_all(name) for name in ("Host", "Origin"))
        rules = {**RULES, "Content-Security-Policy": "default-src 'none'"}
        try:
            path = door.admit(request.path, hosts, origins, script="Upgrade" in request.headers)
        except AccessRefused as why:
            response = connection.respond(why.status, f"{why.message}\n")
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
    """Returns a connection class that limits how many connections may be open before they are admitted."""

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
    """Returns a logger that reports, in one line, connections that ended since a message could not be read."""

    class Reporter(logging.Handler):
        def emit(self, record: logging.LogRecord) -> None:
            if record.getMessage() == "connection handler failed" and record.exc_info:
                report(one_line(record.exc_info[1]))

    logger = logging.Logger("hemline.view")
    logger.addHandler(Reporter(logging.ERROR))
    return logger
