"""Small files of strangers that ask for far more memory or time than they are long, by the reader that gets them."""

import base64
import copy
import json
import pickle
import struct
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

from tests.bodies.character_samples import Sample, write_character

BONES = {"Hips": (None, (0, 0, 0)), "Spine": ("Hips", (0, 20, 0)), "Head": ("Spine", (0, 40, 0))}
for _side, _x in (("Left", 1), ("Right", -1)):
    BONES |= {
        f"{_side}UpLeg": ("Hips", (10 * _x, 0, 0)),
        f"{_side}Leg": (f"{_side}UpLeg", (0, -42, 0)),
        f"{_side}Foot": (f"{_side}Leg", (0, -40, 0)),
        f"{_side}Arm": ("Spine", (20 * _x, 25, 0)),
        f"{_side}ForeArm": (f"{_side}Arm", (30 * _x, 0, 0)),
        f"{_side}Hand": (f"{_side}ForeArm", (25 * _x, 0, 0)),
    }
MHCLO = b"basemesh hm08\nobj_file a.obj\nx_scale 1 2 1.4\ny_scale 1 2 2.0\nz_scale 1 2 1.8\nverts 0\n"
TRIANGLE = b"v 0 0 0\nv 1 0 0\nv 0 1 0\n"
JOINT = "JOINT {} {{ OFFSET 0 1 0 }}\n"


def bvh(more: str, frames: int, numbers: int, *, time: str = "0.0083333", channel: str = "") -> bytes:
    """A humanoid; each joint has `channel`, or only the first has one; `more` joints hang from its hips."""

    def joint(name: str) -> str:
        below = "".join(joint(each) for each, (parent, _) in BONES.items() if parent == name)
        first = name == "Hips"
        channels = "CHANNELS 1 Xrotation" if first or channel else ""
        sort, offset = "ROOT" if first else "JOINT", " ".join(map(str, BONES[name][1]))
        return f"{sort} {name}\n{{\nOFFSET {offset}\n{channels}\n{below}{more if first else ''}}}\n"

    rows = (" ".join(["1"] * numbers) + "\n") * frames
    return f"HIERARCHY\n{joint('Hips')}MOTION\nFrames: {frames}\nFrame Time: {time}\n{rows}".encode()


def amass(folder: Path, frames: int, dtype: str, padding: int = 0) -> bytes:
    arrays = {"poses": np.zeros((frames, 66), dtype), "trans": np.zeros((frames, 3), dtype)}
    path = folder / "made.npz"
    noise = np.random.default_rng(0).bytes(padding)
    np.savez_compressed(path, **arrays, mocap_framerate=np.array(120.0), other=np.frombuffer(noise, np.uint8))
    return path.read_bytes()


def encoded(times: int, length: int) -> bytes:
    """A pickle that has one text encoded many times."""
    text = b"X" + struct.pack("<I", length) + b"x" * length
    call = b"c_codecs\nencode\nq\0" + text + b"q\1X\6\0\0\0latin1q\2h\1h\2\x86q\3"
    return b"\x80\2" + call + b"](" + b"h\0h\3R" * times + b"e."


def equal_keys(count: int) -> bytes:
    """A pickled dictionary whose keys have one hash."""
    keys = (pickle.LONG1 + b"\12" + (k * (2**61 - 1)).to_bytes(10, "little") + b"N" for k in range(1, count))
    return b"\x80\2}(" + b"".join(keys) + b"u."


def parts(path: Path) -> tuple[dict, bytes]:
    """Document and binary chunk of a GLB."""
    content = path.read_bytes()
    (length,) = struct.unpack_from("<I", content, 12)
    return json.loads(content[20 : 20 + length]), content[28 + length :]


def glb(document: dict, binary: bytes) -> bytes:
    text = json.dumps(document, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    binary += b"\0" * (-len(binary) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(binary), b"BIN\0") + binary
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


class Changed:
    """A rigged character, to be changed in one way and written."""

    def __init__(self, document: dict, binary: bytes) -> None:
        self.document, self.binary = copy.deepcopy(document), binary

    def view(self, content: bytes) -> int:
        """A view of more bytes."""
        self.binary += b"\0" * (-len(self.binary) % 4)
        self.document["bufferViews"].append({"buffer": 0, "byteOffset": len(self.binary), "byteLength": len(content)})
        self.binary += content
        return len(self.document["bufferViews"]) - 1

    def accessor(self, kind: str, component: int, count: int, view: int | None = None, **more: object) -> int:
        said = {"type": kind, "componentType": component, "count": count} | more
        self.document["accessors"].append(said if view is None else said | {"bufferView": view})
        return len(self.document["accessors"]) - 1

    def written(self) -> bytes:
        self.document["buffers"][0]["byteLength"] = len(self.binary)
        return glb(self.document, self.binary)


def bare_vertices(it: Changed, count: int) -> None:
    """Vertices without any bytes."""
    place, bones = it.accessor("VEC3", 5126, count), it.accessor("VEC4", 5121, count)
    weights = it.accessor("VEC4", 5126, count)
    attributes = {"POSITION": place, "JOINTS_0": bones, "WEIGHTS_0": weights}
    it.document["meshes"][0]["primitives"] = [{"attributes": attributes}]


def shared_vertices(it: Changed, times: int) -> None:
    """The same bytes as places, bones and weights of many primitives."""
    count = 150_000
    view = it.view(np.tile(np.array([1, 0, 0, 0], np.uint8), count).tobytes())
    place, bones = it.accessor("VEC3", 5121, count, view), it.accessor("VEC4", 5121, count, view)
    weights = it.accessor("VEC4", 5121, count, view, normalized=True)
    attributes = {"POSITION": place, "JOINTS_0": bones, "WEIGHTS_0": weights}
    it.document["meshes"][0]["primitives"] = [{"attributes": attributes}] * times


def empty_nodes(it: Changed, count: int, *, skinned: bool = False, chained: bool = False) -> None:
    first = len(it.document["nodes"])
    it.document["nodes"] += [{"children": [first + n + 1]} if chained and n < count - 1 else {} for n in range(count)]
    if skinned:
        it.document["skins"][0]["joints"] += range(first, first + count)
        del it.document["skins"][0]["inverseBindMatrices"]


def animated(it: Changed, seconds: float, keys: int, tracks: int, *, own: bool = False) -> None:
    """An animation of many nodes, whose keys are the same bytes; with an accessor of its own each."""
    times = it.view(np.linspace(0, seconds, keys, dtype="<f4").tobytes())
    turns = it.view(np.tile(np.array([0, 0, 0, 1], "<f4"), (keys, 1)).tobytes())
    outputs = [it.accessor("VEC4", 5126, keys, turns) for _ in range(tracks if own else 1)]
    start = it.accessor("SCALAR", 5126, keys, times)
    samplers = [{"input": start, "output": output} for output in outputs]
    channels = [{"sampler": n % len(samplers), "target": {"node": n, "path": "rotation"}} for n in range(tracks)]
    it.document["animations"] = [{"channels": channels, "samplers": samplers}]


def instances(it: Changed, count: int) -> None:
    """One mesh at many places of the scene."""
    first = len(it.document["nodes"])
    it.document["nodes"] += [{"mesh": 0} for _ in range(count)]
    it.document["scenes"][0]["nodes"] += range(first, first + count)


CHARACTERS: dict[str, tuple[str, Callable[[Changed], None]]] = {
    "bare.glb": ("character", lambda it: bare_vertices(it, 1_990_000)),
    "barest.glb": ("character", lambda it: bare_vertices(it, 19_000_000)),
    "shared.glb": ("character", lambda it: shared_vertices(it, 500)),
    "nodes.glb": ("character", lambda it: empty_nodes(it, 250_000)),
    "chain.glb": ("character", lambda it: empty_nodes(it, 9_900, chained=True)),
    "skin.glb": ("character", lambda it: empty_nodes(it, 9_900, skinned=True)),
    "bones.glb": ("character", lambda it: empty_nodes(it, 1_900, skinned=True)),
    "slow.glb": ("motion", lambda it: animated(it, 6000, 3, 29)),
    "long.glb": ("motion", lambda it: animated(it, 230, 3, 29)),
    "keys.glb": ("motion", lambda it: (empty_nodes(it, 1000), animated(it, 0, 40_000, 1000, own=True))),
    "instances.glb": ("mesh", lambda it: instances(it, 9_000)),
}
"""Changes of a character, each with its reader."""


def characters(folder: Path) -> Iterator[tuple[str, str, bytes]]:
    write_character(folder / "made.glb", Sample(loose=3))
    document, binary = parts(folder / "made.glb")
    for name, (reader, change) in CHARACTERS.items():
        it = Changed(document, binary)
        change(it)
        yield name, reader, it.written()
    said = {"asset": {"version": "2.0"}}
    selves = [{"byteLength": 9, "uri": "./" * n + "selves.gltf"} for n in range(1, 700)]
    yield "selves.gltf", "mesh", json.dumps(said | {"buffers": selves}).encode()
    held = {"byteLength": 9, "uri": "data:;base64," + base64.b64encode(bytes(9)).decode()}
    yield "lists.gltf", "mesh", json.dumps(said | {"buffers": [held], "nodes": [[]] * 250_000}).encode()
    yield "deep.gltf", "mesh", b"[" * 500_000


def texts() -> Iterator[tuple[str, str, bytes]]:
    """Clips, meshes and garments as text."""
    fan = "".join(
        f"JOINT f{n} {{ OFFSET 0 1 0 JOINT g{n} {{ OFFSET 1 1 0 {JOINT.format(f'h{n}')} }} }}\n" for n in range(1600)
    )
    nameless = bvh(fan, 1, 1).replace(b"LeftLeg", b"x").replace(b"Head", b"y")
    flat = "".join(JOINT.format(f"j{n}") for n in range(4900))
    yield "numbers.bvh", "motion", bvh("", 33_000, len(BONES), channel="x")
    yield "joints.bvh", "motion", bvh(flat, 100_000, 1)
    yield "nameless.bvh", "motion", nameless
    yield "twice.bvh", "motion", bvh(flat + JOINT.format("j4899"), 1, 1)
    yield "seldom.bvh", "motion", bvh("", 2, 1, time="1000000")
    yield "often.bvh", "motion", bvh("", 2, 1, time="1e-320")
    yield "faces.obj", "mesh", TRIANGLE + b"f 1 2 3\n" * 125_000
    yield "polygon.obj", "mesh", TRIANGLE + b"f " + b"1 " * 500_000 + b"\n"
    yield "far.obj", "mesh", TRIANGLE + b"f 1000000000 2 3\n"
    yield "digits.obj", "mesh", TRIANGLE + b"f " + b"1" * 5000 + b" 2 3\n"
    yield "dots.toml", "toml", b'mesh = "a.obj"\na' + b".a" * 50_000 + b" = 1\n"
    lines = "".join(f"k{n}" + ".a" * 30 + " = 1\n" for n in range(15_000))
    yield "keys.toml", "toml", b'mesh = "a.obj"\n' + lines.encode()
    yield "hexadecimal.toml", "toml", b'mesh = "a.obj"\nunit = 0x' + b"f" * 500_000
    yield "deep.toml", "toml", b'mesh = "a.obj"\nbetas = ' + b"[" * 100_000 + b"]" * 100_000
    yield "long.toml", "toml", b'mesh = "a.obj"\n' + b"abcdefghij" * 90_000 + b" = 1\n"
    yield "rows.mhclo", "mhclo", MHCLO + b"1\n" * 450_000
    ply = (
        "ply\nformat {} 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\nelement face {}\n"
    )
    ply += "property list uchar int vertex_indices\nend_header\n"
    yield "vertices.ply", "mesh", ply.format("binary_little_endian", 10**12, 1).encode() + bytes(100)
    yield "faces.ply", "mesh", ply.format("binary_little_endian", 3, 10**12).encode() + bytes(100)
    yield "rows.ply", "mesh", ply.format("ascii", 160_000, 1).encode() + b"0 0 0\n" * 160_000 + b"3 0 1 2\n"
    yield "triangles.stl", "mesh", bytes(80) + struct.pack("<I", 2**32 - 1) + bytes(50)


def hostile_files(folder: Path) -> Iterator[tuple[str, str, bytes]]:
    """Name, reader and content of each; all are shorter than 1.7 MB.

    Args:
        folder: Where files are written that others are made of.
    """
    yield "encoded.pkl", "body", encoded(27_000, 110_000)
    yield "encoded_more.pkl", "body", encoded(70_000, 380_000)
    yield "equal_keys.pkl", "body", equal_keys(50_000)
    yield "sets.pkl", "body", b"\x80\4}(" + pickle.EMPTY_SET * 290_000 + b"1}."
    yield "zeros.npz", "motion", amass(folder, 200_000, "f2")
    yield "integers.npz", "motion", amass(folder, 60_000, "i1")
    yield "most.npz", "motion", amass(folder, 59_000, "f2", 1_000_000)
    yield from texts()
    yield from characters(folder)
