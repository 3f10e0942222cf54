"""What a stranger's small file may cost, and what is read in its place: measured in a process of its own."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from hemline import bodies, garments, motions
from hemline.errors import BadInput
from hemline.garments.reading.garment_toml import read_garment_toml
from hemline.garments.reading.mhclo import read_mhclo
from hemline.meshes import read_mesh
from tests.promises.hostile_files import hostile_files

MEGABYTES, SECONDS = 300, 6
"""At most, for files of about 1 MB; the seconds are of a processor that others use too."""
READ = {
    "body": bodies.read,
    "mesh": read_mesh,
    "mhclo": lambda path: read_mhclo(path, 19158),
    "motion": motions.read,
    "toml": read_garment_toml,
}
ENDINGS = {
    "motion": ("bvh", "npz", "glb", "gltf"),
    "body": ("pkl", "npz", "glb", "vrm"),
    "mesh": ("obj", "ply", "stl", "glb", "gltf"),
    "toml": ("toml",),
    "mhclo": ("mhclo",),
}
KINDS = [(reader, ending) for reader, endings in ENDINGS.items() for ending in endings]

CHILD = """
import json, resource, sys, time, warnings
resource.setrlimit(resource.RLIMIT_AS, (6 * 2**30, 6 * 2**30))
from hemline import bodies, garments, motions
from hemline.bodies.character.character_mesh import read_character_mesh
from hemline.errors import BadInput, HemlineWarning
from hemline.garments.reading.garment_toml import read_garment_toml
from hemline.garments.reading.mhclo import read_mhclo
from hemline.meshes import read_mesh
import scipy.spatial.transform, trimesh.exchange.load
warnings.simplefilter("ignore", HemlineWarning)  # that a clip is odd, which it is

def character(path):
    found = bodies.read_skeleton(path)
    return read_character_mesh(found.rig, found.owners)

READ = {"body": bodies.read, "character": character, "mesh": read_mesh, "motion": motions.read,
        "mhclo": lambda path: read_mhclo(path, 19158), "toml": read_garment_toml}
peak = lambda: resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / (1e6 if sys.platform == "darwin" else 1e3)
for line in sys.stdin:
    name, reader = line.split()
    begun, before = time.process_time(), peak()
    try:
        READ[reader](name)
        said = "read"
    except BadInput as error:
        said = f"refused: {error}"
    except BaseException as error:
        said = f"{type(error).__name__}: {error}"
    print(json.dumps([name, reader, time.process_time() - begun, before, peak(), said]), flush=True)
"""
"""Reads files whose names and readers it is told, a line each, and tells what became of them."""


@pytest.fixture(scope="module")
def told(tmp_path_factory):
    """What became of each file: seconds, and by how many megabytes the process had grown by then."""
    folder = tmp_path_factory.mktemp("hostile")
    asked = []
    for name, reader, content in hostile_files(folder):
        (folder / name).write_bytes(content)
        asked.append(f"{name} {reader}\n")
    done = subprocess.run(
        [sys.executable, "-c", CHILD], cwd=folder, input="".join(asked), capture_output=True, text=True, timeout=600
    )
    lines = [json.loads(line) for line in done.stdout.splitlines()]
    assert len(lines) == len(asked), f"the process ended at {asked[len(lines)]}: {done.stderr[-500:]}"
    assert done.stderr == ""
    return lines


@pytest.mark.skipif(not sys.platform.startswith(("linux", "darwin")), reason="the memory is measured as POSIX does")
def test_a_small_file_takes_little_memory_and_time_and_is_read_or_refused(told):
    start = told[0][3]
    for name, reader, seconds, _, peak, said in told:
        assert said == "read" or said.startswith("refused: "), (name, reader, said)
        assert seconds < SECONDS, (name, reader, seconds, said)
        assert peak - start < MEGABYTES, (name, reader, peak - start, said)


@pytest.mark.parametrize(
    ("name", "reason"),
    [
        ("encoded.pkl", "a pickle that makes more bytes than it has"),
        ("equal_keys.pkl", "a pickle of far more objects than a body has"),
        ("zeros.npz", "that unpacks to"),
        ("joints.bvh", "has more joints than channels"),
        ("seldom.bvh", "must be the seconds of a frame, at most 1; got 1e.06; export it again"),
        ("often.bvh", "must have from 1 to 1000 frames a second; got 1e.06"),
        ("bare.glb", "asks for more numbers than it can hold"),
        ("barest.glb", "may have 2000000 entries; got 19000000"),
        ("shared.glb", "asks for more numbers than it can hold"),
        ("slow.glb", "the animation is too long for its few keys"),
        ("nodes.glb", "may have 10000 nodes; got 2500"),
        ("nameless.bvh", "lacks the joint 'head'"),
        ("instances.glb", "asks for more numbers than it can hold"),
        ("selves.gltf", "has one file, or its own end, for two buffers"),
    ],
)
def test_the_reason_is_the_true_one(told, name, reason):
    said = next(each[-1] for each in told if each[0] == name)
    assert re.search(reason, said), said


@pytest.mark.parametrize(("reader", "ending"), KINDS)
def test_a_file_of_twenty_gigabytes_is_not_read(reader, ending, tmp_path):
    path = tmp_path / f"large.{ending}"
    with path.open("wb") as stream:
        stream.truncate(20 * 10**9)
    with pytest.raises(
        BadInput, match=r"large.* is too large; got 20000000000 bytes; name a file of at most \d+ bytes"
    ):
        READ[reader](path)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="pipes and devices as POSIX has them")
@pytest.mark.parametrize(("reader", "ending"), KINDS)
def test_what_is_no_file_is_refused_with_the_true_reason_and_not_waited_for(reader, ending, tmp_path):
    pipe, device, folder = (tmp_path / f"{name}.{ending}" for name in ("pipe", "device", "folder"))
    os.mkfifo(pipe)
    device.symlink_to("/dev/zero")
    folder.mkdir()
    for path, sort in ((pipe, "a pipe"), (device, "a device"), (folder, "a folder")):
        with pytest.raises(BadInput, match=f"cannot read .*{path.name}; got {sort}; name "):
            READ[reader](path)


def test_a_garment_names_neither_pipes_nor_devices(tmp_path):
    (tmp_path / "it.toml").write_text('mesh = "pipe.obj"\n')
    os.mkfifo(tmp_path / "pipe.obj")
    with pytest.raises(BadInput, match="cannot read .*pipe.obj; got a pipe"):
        garments.read(Path(tmp_path / "it.toml"))
