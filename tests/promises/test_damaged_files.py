"""Every reader of files on files that are damaged: a value, or an error in our own words, and nothing besides."""

import re

import numpy as np
import pytest

from hemline import bodies, garments, motions
from hemline.bodies.character.character_mesh import read_character_mesh
from hemline.cli import main
from hemline.datasets import create, open_dataset, read_take
from hemline.errors import BadInput
from hemline.garments.reading.garment_toml import read_garment_toml
from hemline.garments.reading.mhclo import read_mhclo
from hemline.meshes import read_mesh
from tests.bodies.character_samples import Sample, write_character
from tests.bodies.smpl_samples import small_arrays

MUTATIONS = 250
SPECIAL = (
    b"",
    b"\0" * 64,
    "Grüße".encode("latin1"),
    b"PK\x03\x04",
    b"\x80\x04}.",
    b"{}",
    b"[[[[",
    b"glTF",
    b"ply\n",
    b"solid\n",
)
NUMBERS = (
    *(b"0", b"-1", b"nan", b"1e999", b"-1e308", b"1e-320", b"2147483648", b"18446744073709551616"),
    *(b"9" * 400, b"1" * 5000, b"0x" + b"f" * 5000),
)
"""What a number of a text is replaced by."""
JARGON = re.compile(
    r"codec|decode|tokeni|struct\.|unpack \(|NoneType|__|Traceback|KeyError|Error -?\d|errno|dtype|serializ|deserial|"
    r"invalid literal|could not convert|out of range|No module|not in list|pop from|CRC|magic|usize|JSON|ast\.|numpy|"
    r"trimesh|safetensors header|object at 0x|index \d+ is out|unexpected keyword|charmap|broadcast|delimiter",
)
"""Words of the libraries that read for us."""

BVH = b"""HIERARCHY
ROOT Hips
{
  OFFSET 0 0 0
  CHANNELS 6 Xposition Yposition Zposition Zrotation Yrotation Xrotation
  JOINT Chest { OFFSET 0 1 0 CHANNELS 3 Zrotation Yrotation Xrotation End Site { OFFSET 0 1 0 } }
}
MOTION
Frames: 2
Frame Time: 0.0083333
0 0 0 0 0 0 1 2 3
0 1 0 0 0 0 1 2 3
"""
OBJ = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nf 1/1 2/2 3/3\nf -1 -2 -3\n"
TOML = b"""mesh = "skirt.obj"
unit = "cm"
betas = [0.5, 1]
material = {base = "cotton", density = 0.2}
chains = [[1, 2, 3]]
pattern = true
[[pins]]
vertices = [1, 2]
to = "neck"
stiffness = 2.0
"""
MHCLO = b"""basemesh hm08
name skirt
obj_file skirt.obj
x_scale 5399 11998 1.4
y_scale 791 881 2.0
z_scale 962 5320 1.8
verts 0
1 2 3 0.2 0.3 0.5 0.1 0 0
4
7 8 9 0.5 0.25 0.25 0 0 0.1
"""


def _amass(path):
    poses = np.random.default_rng(0).normal(size=(5, 156))
    np.savez_compressed(path, poses=poses, trans=np.zeros((5, 3)), mocap_framerate=np.array(60.0))


def _mesh(path, **options):
    import trimesh

    trimesh.creation.box().export(path, **options)


def _gltf(path):
    from trimesh import Scene, creation
    from trimesh.exchange.gltf import export_gltf

    path.write_bytes(export_gltf(Scene(creation.box()), embed_buffers=True)["model.gltf"])


def _character(path, **clips):
    write_character(path, Sample(loose=3, clips=clips))


def _animation(path):
    turns = np.tile([1.0, 0, 0, 0], (4, 24, 1))
    _character(path, walk=(np.arange(4) / 30, turns))


def _bones_and_mesh(path):
    """All of a character but the surface that cloth lies on, which takes a second each."""
    found = bodies.read_skeleton(path)
    return read_character_mesh(found.rig, found.owners)


def _napkin():
    return garments.make_cape(bodies.load().shaped(), rows=6, columns=10, name="napkin")


def _take(path):
    from dataclasses import replace

    from hemline.datasets import Take, write_take

    motion, garment = motions.load("run")[:2], _napkin()
    rows = np.zeros(2, np.int32)
    vertices = np.stack([garment.vertices] * 2)
    take = Take("clip", vertices, replace(motion, notes=()), np.zeros(2, np.float32), rows > 0, rows, {}, {"clip": "a"})
    write_take(path, take)


READERS = {
    "amass.npz": (_amass, motions.read),
    "clip.bvh": (BVH, motions.read),
    "motion.safetensors": (lambda path: motions.write(path, motions.load("run")[:2]), motions.read),
    "garment.safetensors": (lambda path: _napkin().save(path), garments.read),
    "take.safetensors": (_take, read_take),
    "mesh.obj": (OBJ, read_mesh),
    "mesh.ply": (_mesh, read_mesh),
    "text.ply": (lambda path: _mesh(path, encoding="ascii"), read_mesh),
    "mesh.stl": (_mesh, read_mesh),
    "text.stl": (lambda path: _mesh(path, file_type="stl_ascii"), read_mesh),
    "mesh.glb": (_mesh, read_mesh),
    "mesh.gltf": (_gltf, read_mesh),
    "character.glb": (_character, _bones_and_mesh),
    "animation.glb": (_animation, motions.read),
    "garment.toml": (TOML, read_garment_toml),
    "clothes.mhclo": (MHCLO, lambda path: read_mhclo(path, 19158)),
    "smpl.npz": (lambda path: np.savez_compressed(path, **small_arrays()), bodies.read),
}
"""Files by name: their content, or what writes them; and what reads them."""


def damaged(content: bytes, random: np.random.Generator) -> bytes:
    """Cut off, with bits turned over, a byte changed near an end, bytes left out or put in, or another number."""
    kind, data = random.integers(7), bytearray(content)
    place = int(random.integers(len(data)))
    near = int(random.integers(min(len(data), 400)))
    if kind == 0:
        return content[:place]
    if kind == 1:
        for _ in range(random.integers(1, 5)):
            data[random.integers(len(data))] ^= 1 << random.integers(8)
    elif kind in (2, 3):
        data[near if kind == 2 else -1 - near] = random.integers(256)
    elif kind == 4:
        del data[place : place + random.integers(1, 40)]
    elif kind == 5:
        number = re.search(rb"-?\d[\d.e-]*", content[near:])
        if number:
            first, last = (near + end for end in number.span())
            data[first:last] = NUMBERS[random.integers(len(NUMBERS))]
    else:
        data[place:place] = random.bytes(random.integers(1, 20))
    return bytes(data)


def whole(folder, name: str) -> bytes:
    content = READERS[name][0]
    if callable(content):
        content(folder / name)
        return (folder / name).read_bytes()
    return content


def judged(error: BadInput) -> None:
    """An error in our own words, of one line."""
    assert all((str(error.what), str(error.got), error.cure)), error
    assert str(error).isprintable() and not JARGON.search(str(error)), error


@pytest.mark.filterwarnings(
    "ignore:.*declares .* frames:hemline.errors.HemlineWarning"
)  # a clip with rows too few or many
@pytest.mark.parametrize("name", READERS)
def test_a_damaged_file_is_read_or_refused_in_our_own_words(name, tmp_path, capfd):
    content, read, refused = whole(tmp_path, name), READERS[name][1], 0
    path = tmp_path / f"damaged_{name}"
    random = np.random.default_rng(0)
    for number in range(MUTATIONS):
        path.write_bytes(SPECIAL[number] if number < len(SPECIAL) else damaged(content, random))
        try:
            read(path)
        except BadInput as error:
            judged(error)
            refused += 1
    assert refused > len(SPECIAL)
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("name", READERS)
def test_what_is_no_file_is_refused(name, tmp_path):
    read = READERS[name][1]
    (tmp_path / name).mkdir()
    for path in (tmp_path / name, tmp_path / f"absent_{name}", tmp_path / "no" / name):
        with pytest.raises(BadInput, match="cannot read .*; got .*; name") as found:
            read(path)
        judged(found.value)


def test_a_damaged_index_is_made_again(tmp_path):
    dataset = create(tmp_path / "data", _napkin())
    folder, rows = tmp_path / "data", dataset.rows()
    index = folder / "manifest.json"
    index.write_text("{}")
    random = np.random.default_rng(0)
    content = b'{"version": 1, "takes": [{"name": [1], "betas": 3, "kind": {}}], "garment": "a"}'
    for number in range(MUTATIONS):
        index.write_bytes(SPECIAL[number] if number < len(SPECIAL) else damaged(content, random))
        assert open_dataset(folder).rows() == rows


@pytest.mark.parametrize("name", [name for name in READERS if not name.startswith("take")])
def test_at_the_command_line_it_is_one_line_and_status_two(name, tmp_path, monkeypatch, capfd):
    monkeypatch.chdir(tmp_path)
    (tmp_path / name).write_bytes(whole(tmp_path, name)[:20])
    clip = READERS[name][1] is motions.read
    words = ["cape-light", "-m", name] if clip else [name, "-m", "run"]
    assert main(["simulate", *words, "-o", "data"]) == 2
    out, err = capfd.readouterr()
    *_, error = err.splitlines()  # after the line that says what is being done
    assert out == "" and error.startswith("hemline: ") and not JARGON.search(error), err
    assert not (tmp_path / "data").exists()
