"""Small moving clips, and answers to them."""

import http.client
import json
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from urllib.parse import urlsplit

from PIL import Image, ImageDraw

from hemline.study import Answer, Viewer

RED, BLUE = (220, 30, 30), (30, 30, 220)
"""Clip A is red and clip B blue, so that a picture of the page tells which is where."""


def make_clip(
    path: Path, colour: tuple[int, int, int], *, frames: int = 20, size: int = 64, frame_ms: int = 50
) -> Path:
    """A bar that moves over a coloured ground, one step a frame."""
    pictures = []
    for frame in range(frames):
        picture = Image.new("RGB", (size, size), colour)
        at = frame * size // frames
        ImageDraw.Draw(picture).rectangle((at, 0, at + size // frames, size), fill=(255, 255, 255))
        pictures.append(picture)
    path.parent.mkdir(exist_ok=True)
    how = {"lossless": True} if path.suffix == ".webp" else {}
    pictures[0].save(path, save_all=True, append_images=pictures[1:], duration=frame_ms, loop=0, **how)
    return path


def make_folders(where: Path, names: tuple[str, ...] = ("walk", "turn", "kick")) -> tuple[Path, Path]:
    """Two folders of clips of the same names, one of each method."""
    for name in names:
        make_clip(where / "ours" / f"{name}.webp", RED)
        make_clip(where / "skinned" / f"{name}.webp", BLUE)
    return where / "ours", where / "skinned"


def answer(**changes) -> Answer:
    """One row."""
    values = {
        "participant": "P1",
        "pair": "walk",
        "question": 'Which, "a" or b?',
        "a": "ours/walk.webp",
        "b": "skinned/walk.webp",
        "left": "B",
        "preference": 2,
        "seconds": 3.25,
        "time": "2026-01-01T10:00:00+00:00",
        "seed": 0,
        "clips": "sha256:0123456789ab",
    }
    return Answer(**(values | changes))


@contextmanager
def serving(asked, **options) -> Iterator[Viewer]:
    """A page that answers, on a free port."""
    with Viewer(asked, **options) as viewer:
        thread = threading.Thread(target=viewer.serve_forever, kwargs={"poll_interval": 0.02})
        thread.start()
        try:
            yield viewer
        finally:
            viewer.shutdown()
            thread.join()


def sent(viewer: Viewer, path: str, body=None, **headers: str) -> tuple[int, bytes, dict[str, str]]:
    """What is answered to one request beneath the page's address: status, content and headers.

    With a body, it is a POST of it as JSON, or as it is where it is bytes.
    """
    return knocked(viewer, urlsplit(viewer.url).path.rstrip("/") + path, body, **headers)


def knocked(viewer: Viewer, path: str, body=None, **headers: str) -> tuple[int, bytes, dict[str, str]]:
    """The same, of a whole path."""
    connection = http.client.HTTPConnection("127.0.0.1", viewer.server_address[1], timeout=30)
    try:
        content = body if body is None or isinstance(body, bytes) else json.dumps(body).encode()
        connection.request("GET" if body is None else "POST", path, content, headers)
        reply = connection.getresponse()
        return reply.status, reply.read(), dict(reply.getheaders())
    finally:
        connection.close()
