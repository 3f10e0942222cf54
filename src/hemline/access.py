"""Access control for pages that are served on this machine, and the sockets that they listen on.

A server at 127.0.0.1 can be reached by its user, by every web page that a browser on this machine has open, and by all
other users of the machine. So each request is checked for three things: the name of the host, since a page elsewhere
may have its own name lead here; the origin, by which a browser tells which page sent the request; and a random key,
which is part of the address.
"""

import errno
import re
import secrets
import socket
import threading
from collections.abc import Sequence

from .errors import BadInput

HOST = "127.0.0.1"
"""Address on which pages listen; no other machine can reach it."""
WAITING = 32
"""Open connections without access so far, at most; for another one, the oldest is closed."""
_OURS = re.compile(r"(?:127\.0\.0\.1|localhost)(?::[0-9]{1,5})?")
_NO_KEY = "This is not the address of the page that runs now. Open the address that hemline shows in its terminal."
_ELSEWHERE = "This page answers neither other hosts nor pages of other origins."


class AccessRefused(Exception):
    """A request is refused, or redirected.

    Args:
        message: Text of the response; it contains neither parts of the request nor the address of the page.
        location: Address to redirect to, for a request to a one-time address.
    """

    def __init__(self, message: str, location: str | None = None):
        super().__init__(message)
        self.message, self.location = message, location
        self.status = 403 if location is None else 303


class AccessControl:
    """Admits requests that know the secret address of a page.

    Args:
        port: Port on which the page listens.

    Attributes:
        url: The address of the page, with its key.

    Example:
        >>> access = AccessControl(8080)
        >>> path = access.url.removeprefix("http://127.0.0.1:8080") + "clips/7"
        >>> access.admit(path, ["127.0.0.1:8080"], [])
        '/clips/7'
    """

    def __init__(self, port: int):
        self._key, self._ticket, self._lock = secrets.token_hex(16), "", threading.Lock()
        self._base = f"http://{HOST}:{port}/"
        self.url = f"{self._base}{self._key}/"

    def one_time_address(self) -> str:
        """Returns an address that leads to the page once, then never again.

        Other users of a machine can read the arguments with which a program was started, and so the address with which
        a browser is opened. By then this address is used up.
        """
        with self._lock:
            self._ticket = secrets.token_hex(16)
            return f"{self._base}{self._ticket}/"

    def admit(self, path: str, hosts: Sequence[str], origins: Sequence[str], *, script: bool = False) -> str:
        """Checks a request; returns the path after the key, such as `/viewer.js`, or nothing if the address ends there.

        Args:
            path: Path of the request, as it was sent.
            hosts: Values of all `Host` headers.
            origins: Values of all `Origin` headers.
            script: Whether only scripts send such requests; for those, browsers always send the origin.

        Raises:
            AccessRefused: The host or the origin is another one, or the key is wrong.
        """
        if len(hosts) != 1 or not _OURS.fullmatch(hosts[0]):
            raise AccessRefused(_ELSEWHERE)
        if [*origins] != [f"http://{hosts[0]}"] and (origins or script):
            raise AccessRefused(_ELSEWHERE)
        key, slash, rest = path.removeprefix("/").partition("/")
        key = key.partition("?")[0]
        if _same(key, self._key):
            return slash + rest
        if self._redeem(key):
            raise AccessRefused("The page is here.", f"/{self._key}/")
        raise AccessRefused(_NO_KEY)

    def _redeem(self, key: str) -> bool:
        with self._lock:
            valid = self._ticket != "" and _same(key, self._ticket)
            if valid:
                self._ticket = ""
            return valid


def open_listener(port: int) -> socket.socket:
    """Opens a socket that listens on this machine only.

    Args:
        port: Port number; 0: a free port.

    Raises:
        BadInput: The port number is invalid, in use, or not allowed.
    """
    if not 0 <= port <= 65535:
        raise BadInput("a port lies from 0 to 65535", port, "0 takes one that is free")
    listener = socket.socket()
    try:
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listener.bind((HOST, port))
        listener.listen(128)
    except OSError as reason:
        listener.close()
        got = "it is in use" if reason.errno == errno.EADDRINUSE else reason.strerror or reason
        raise BadInput(f"cannot listen on port {port}", got, "choose another one; 0 takes one that is free") from None
    return listener


def _same(one: str, other: str) -> bool:
    """Tells whether two keys are equal, in a time that does not depend on where they differ."""
    return secrets.compare_digest(one.encode(errors="replace"), other.encode())
