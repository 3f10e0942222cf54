"""Common parts of the glTF documents that hemline writes, and the binary file around them."""

import json
import struct

from hemline.pictures import linear
from hemline.version import VERSION


def asset(notices: tuple[str, ...]) -> dict:
    """Returns the generator of the file and its copyright notices."""
    made = {"version": "2.0", "generator": f"hemline {VERSION}"}
    return made | ({"copyright": "; ".join(notices)} if notices else {})


def material(name: str, colour: tuple[float, float, float], *, both_sides: bool) -> dict:
    """Returns a rough material of an sRGB colour."""
    surface = {"baseColorFactor": [*linear(colour).tolist(), 1.0], "metallicFactor": 0.0, "roughnessFactor": 0.9}
    return {"name": name, "pbrMetallicRoughness": surface, "doubleSided": both_sides}


def pack_glb(document: dict, content: bytes) -> bytes:
    """Returns the bytes of a GLB file."""
    text = json.dumps(document, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(content), b"BIN\0") + content
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks
