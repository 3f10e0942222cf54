"""The door of a page on this machine: where it listens, and whom it lets in.

What listens at 127.0.0.1 is reached by more than its user: by every web page that a browser on this machine has open,
and by all other users of the machine. So a door asks three things of each request: the name of the host, since a page
elsewhere may have its own name lead here; the origin, which a browser tells of the page that asks; and a key that is
drawn at random and stands in the address.
"""

import errno
import re
import secrets
import socket
import threading
from collections.abc import Sequence

from .errors import BadInput

HOST = "127.0.0.1"
"""Where pages listen: no other machine reaches it."""
WAITING = 32
"""How many connections may be open that were not let in yet; for one more, the oldest of them is closed."""
_OURS = re.compile(r"(?:127\.0\.0\.1|localhost)(?::[0-9]{1,5})?")
_NO_KEY = "This is not the address of the page that runs now. Open the address that hemline shows in its terminal."
_ELSEWHERE = "This page answers neither other hosts nor pages of other origins."


class TurnedAway(Exception):
    """Somebody is not let in.

    Args:
        said: What they are told; it holds nothing that they sent, and not the address of the page.
        location: Where they are sent on to, for one who came by an address that works once.
    """

    def __init__(self, said: str, location: str | None = None):
        super().__init__(said)
        self.said, self.location = said, location
        self.status = 403 if location is None else 303


class Door:
    """Lets in whoever comes by the address of a page.

    Args:
        port: Where the page listens.

    Attributes:
        url: The address of the page, with its key.

    Example:
        >>> door = Door(8080)
        >>> path = door.url.removeprefix("http://127.0.0.1:8080") + "clips/7"
        >>> door.entered(path, ["127.0.0.1:8080"], [])
        '/clips/7'
    """

    def __init__(self, port: int):
        self._key, self._ticket, self._lock = secrets.token_hex(16), "", threading.Lock()
        self._base = f"http://{HOST}:{port}/"
        self.url = f"{self._base}{self._key}/"

    def address_for_once(self) -> str:
        """An address that leads to the page once, then never again.

        Other users of a machine can read with which words a program was started, and so the address that a browser is
        opened with. What they read there is used up.
        """
        with self._lock:
            self._ticket = secrets.token_hex(16)
            return f"{self._base}{self._ticket}/"

    def entered(self, path: str, hosts: Sequence[str], origins: Sequence[str], *, script: bool = False) -> str:
        """The path behind the key, such as `/viewer.js`; empty where the address ends with the key.

        Args:
            path: What is asked for, as it was sent.
            hosts: All headers `Host`.
            origins: All headers `Origin`.
            script: Whether only scripts ask so, of which browsers always tell the origin.

        Raises:
            TurnedAway: Another host, a page of another origin, or not the key.
        """
        if len(hosts) != 1 or not _OURS.fullmatch(hosts[0]):
            raise TurnedAway(_ELSEWHERE)
        if [*origins] != [f"http://{hosts[0]}"] and (origins or script):
            raise TurnedAway(_ELSEWHERE)
        key, slash, rest = path.removeprefix("/").partition("/")
        key = key.partition("?")[0]
        if _same(key, self._key):
            return slash + rest
        if self._redeemed(key):
            raise TurnedAway("The page is here.", f"/{self._key}/")
        raise TurnedAway(_NO_KEY)

    def _redeemed(self, key: str) -> bool:
        with self._lock:
            good = self._ticket != "" and _same(key, self._ticket)
            if good:
                self._ticket = ""
            return good


def listening(port: int) -> socket.socket:
    """A socket that listens on this machine alone.

    Args:
        port: Where; 0: a port that is free.

    Raises:
        BadInput: The port is none, in use, or not allowed.
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
        said = "it is in use" if reason.errno == errno.EADDRINUSE else reason.strerror or reason
        raise BadInput(f"cannot listen on port {port}", said, "choose another one; 0 takes one that is free") from None
    return listener


def _same(one: str, other: str) -> bool:
    """Whether two keys are alike, in a time that does not tell how alike they are."""
    return secrets.compare_digest(one.encode(errors="replace"), other.encode())
