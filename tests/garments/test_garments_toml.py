"""The TOML beside a mesh: what it may say, and what is refused."""

import pytest

from hemline.errors import BadGarment
from hemline.garments.garment_toml import GarmentFile, read_garment_toml
from hemline.garments.pin_rules import PinGroup

FULL = """
mesh = "skirt.obj"
name = "twirl"
unit = "cm"
up = "z"
origin = "floor"
body = "anny24"
betas = [0.5, -1]
material = { base = "cotton", density = 0.2 }
pins = [0, 1, 2]
chains = [[0, 10, 20], [1, 11, 21]]
key_joint = "pelvis"
pattern = false
flat_rest = true
"""


def written(folder, text):
    path = folder / "garment.toml"
    path.write_text(text)
    return path


def test_reads_all_that_may_be_said(tmp_path):
    said = read_garment_toml(written(tmp_path, FULL))
    assert said == GarmentFile(
        mesh="skirt.obj",
        name="twirl",
        unit="cm",
        up="z",
        origin="floor",
        body="anny24",
        betas=(0.5, -1),
        material={"base": "cotton", "density": 0.2},
        pins=(0, 1, 2),
        chains=((0, 10, 20), (1, 11, 21)),
        key_joint="pelvis",
        pattern=False,
        flat_rest=True,
    )


GROUPS = """
mesh = "skirt.obj"
[[pins]]
vertices = "top_rim"
to = "pelvis"
[[pins]]
vertices = [4, 5]
stiffness = 200
"""


def test_pins_may_be_tables(tmp_path):
    said = read_garment_toml(written(tmp_path, GROUPS))
    assert said.pins == (PinGroup("top_rim", to="pelvis"), PinGroup((4, 5), stiffness=200))


def test_all_but_the_mesh_may_be_left_out(tmp_path):
    assert read_garment_toml(written(tmp_path, "mesh = 'a.obj'")) == GarmentFile(mesh="a.obj")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("mesh = 'a.obj'\nmaterail = 'silk'", "unknown key 'materail'; got 'silk'; did you mean 'material'"),
        ("name = 'a'", "must name its mesh"),
        ("mesh = a.obj", "is no TOML"),
        ("mesh = 3", "'mesh' must be text; got 3"),
        ("mesh = 'a.obj'\npins = [1.5]", "'pins' must be a list of vertex ids or a rule"),
        (
            "mesh = 'a.obj'\npins = [{ to = 'pelvic' }]",
            "a joint that does not exist; got 'pelvic'; did you mean 'pelvis'",
        ),
        ("mesh = 'a.obj'\npins = [{ too = 'pelvis' }]", "pins: unknown key 'too'; got 'pelvis'; did you mean 'to'"),
        ("mesh = 'a.obj'\npins = [{ stiffness = 0 }]", "stiffness must be positive; got 0; leave it out"),
        ("mesh = 'a.obj'\npins = [{ stiffness = nan }]", "stiffness must be positive; got nan"),
        ("mesh = 'a.obj'\npins = [{ stiffness = '5' }]", "'stiffness' must be a number"),
        ("mesh = 'a.obj'\npins = [{ vertices = [1.5] }]", "'vertices' must be a list of vertex ids or a rule"),
        ("mesh = 'a.obj'\npins = [true]", "'pins' must be a list of vertex ids or a rule"),
        ("mesh = 'a.obj'\nchains = [1, 2]", "'chains' must be a list of lists of vertex ids"),
        ("mesh = 'a.obj'\nbetas = ['tall']", "'betas' must be a list of numbers"),
        ("mesh = 'a.obj'\nmaterial = 4", "'material' must be a name or a table"),
        ("mesh = 'a.obj'\nup = 'x'", "'up' must be 'y' or 'z'"),
        ("mesh = 'a.obj'\norigin = 'head'", "'origin' must be 'pelvis' or 'floor'"),
        ("mesh = 'a.obj'\npattern = 1", "'pattern' must be true or false"),
        ("mesh = 'a.obj'\nunit = 0.01", "'unit' must be text"),
    ],
)
def test_refuses(tmp_path, text, message):
    with pytest.raises(BadGarment, match=message):
        read_garment_toml(written(tmp_path, text))


def test_refuses_a_missing_file_and_bytes(tmp_path):
    with pytest.raises(BadGarment, match="cannot read"):
        read_garment_toml(tmp_path / "none.toml")
    (tmp_path / "bytes.toml").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(BadGarment, match="is no TOML"):
        read_garment_toml(tmp_path / "bytes.toml")
