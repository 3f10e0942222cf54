"""A visitor without a browser, who sends what they like over viser's WebSocket and keeps all that is sent to them."""

import contextlib
import socket
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any
from urllib.parse import urlsplit

import pytest

viser = pytest.importorskip("viser", reason="viser is not installed: pip install 'hemline[view]'")
import msgspec  # noqa: E402
import zstandard  # noqa: E402
from viser import _messages  # noqa: E402
from websockets.exceptions import ConnectionClosed  # noqa: E402
from websockets.sync.client import connect  # noqa: E402

CAMERA = _messages.ViewerCameraMessage(
    wxyz=(1.0, 0.0, 0.0, 0.0),
    position=(0.0, 1.0, 4.0),
    fov=0.6,
    near=0.1,
    far=100.0,
    image_height=300,
    image_width=400,
    look_at=(0.0, 1.0, 0.0),
    up_direction=(0.0, 1.0, 0.0),
)
"""What a browser sends first."""


class Visitor:
    """Somebody at the page.

    Args:
        connection: An open WebSocket.
    """

    def __init__(self, connection: Any):
        self.connection, self.heard, self.raw = connection, [], b""
        self.thread = threading.Thread(target=self._listen, daemon=True)
        self.thread.start()
        self.send(CAMERA.as_serializable_dict())

    def send(self, message: dict[str, Any]) -> None:
        """Send a message of viser's."""
        self.connection.send(msgspec.msgpack.encode(message))

    def set(self, label: str, value: Any) -> None:
        """Set a control, or press a button, to any value."""
        control = self.until(lambda: self.control(label), f"a control '{label}'")
        self.send({"type": "GuiUpdateMessage", "uuid": control, "updates": {"value": value}})

    def control(self, label: str) -> str | None:
        """The name under which viser knows a control; the newest one of a label."""
        found = [each for each in self.heard if each.get("props", {}).get("label") == label]
        return found[-1]["uuid"] if found else None

    def html(self) -> list[str]:
        """All HTML that was sent."""
        texts = [each["props"]["content"] for each in self.heard if each["type"] == "GuiHtmlMessage"]
        changes = (each["updates"] for each in self.heard if each["type"] == "GuiUpdateMessage")
        return texts + [each["content"] for each in changes if "content" in each]

    def until(self, what, why: str):
        """Wait for something to be true; its value."""
        ends = time.monotonic() + 30
        while not (found := what()):
            assert time.monotonic() < ends, f"no {why}"
            time.sleep(0.02)
        return found

    def _listen(self) -> None:
        with contextlib.suppress(ConnectionClosed):
            while True:
                packet = self.connection.recv()
                length = int.from_bytes(packet[8:16], "little")
                text = zstandard.decompress(packet[16 : 16 + length])
                self.raw += text
                self.heard.extend(msgspec.msgpack.decode(text)["messages"])


@contextmanager
def visiting(url: str, *, origin: str | None = "", host: str = "") -> Iterator[Visitor]:
    """Come to a page by an address; from another origin, or none, or by another name of its host."""
    parts = urlsplit(url)
    host = host or parts.netloc
    with connect(
        f"ws://{host}{parts.path}",
        origin=f"http://{host}" if origin == "" else origin,  # type: ignore[arg-type]
        subprotocols=[f"viser-v{viser.__version__}"],  # type: ignore[list-item]
        compression=None,
        max_size=None,
        sock=socket.create_connection((parts.hostname, parts.port), timeout=30),  # past any proxy
    ) as connection:
        yield Visitor(connection)
