"""The TOML beside a mesh: what it may say, and what is refused."""

import pytest

from hemline import garments
from hemline.errors import BadGarment
from hemline.garments import Material
from hemline.garments.pin_rules import PinGroup, select_vertices
from hemline.garments.reading.garment_toml import GarmentFile, read_garment_toml

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
        (f"mesh = 'a.obj'\nbetas = [{'1' * 5000}]", "is no TOML; got a number or a date that cannot be"),
        (f"mesh = 'a.obj'\nunit = 0x{'f' * 5000}", "is no TOML; got a whole number of more than 63 bits"),
        (f"mesh = 'a.obj'\npins = [0x{'f' * 5000}]", "is no TOML; got a whole number of more than 63 bits"),
        ("mesh = 'a.obj'\nunit = 2026-99-99", "is no TOML"),
        ("mesh = 'a.obj'\nunit = 2026-11-26", "'unit' must be text"),
        (f"mesh = 'a.obj'\na{'.a' * 99} = 1", "is no TOML of a garment; got line 2, with 99 dots"),
        (f"mesh = 'a.obj'\nx = {'[' * 300}{']' * 300}", r"unknown key 'x'; got \[\[\[\[...\]\]\]\]; did you mean"),
        (f"mesh = 'a.obj'\n{'x' * 5000} = 1", f"unknown key '{'x' * 60}'; got 1; did you mean"),
        ("mesh = '/etc/a.obj'", "names a mesh that is not beside it; got '/etc/a.obj'; put the mesh into the folder"),
        ("mesh = '../a.obj'", "names a mesh that is not beside it; got '../a.obj'"),
        ("mesh = 'C:a.obj'", "names a mesh that is not beside it; got 'C:a.obj'"),
        ('mesh = "a\\u0000.obj"', "names a mesh that is not beside it"),
    ],
)
def test_refuses(tmp_path, text, message):
    with pytest.raises(BadGarment, match=message):
        read_garment_toml(written(tmp_path, text))


def test_what_a_toml_must_not_name_is_neither_read_nor_quoted(tmp_path):
    """A service that reads what strangers send must not tell them what else is on its disk."""
    inner = tmp_path / "sent"
    inner.mkdir()
    (tmp_path / "secret.obj").write_text("v 1 2 SECRET-TOKEN-12345\n")
    (inner / "link.obj").symlink_to(tmp_path / "secret.obj")
    for name in ("../secret.obj", tmp_path / "secret.obj", "link.obj"):
        with pytest.raises(BadGarment, match="names a mesh that is not beside it") as found:
            garments.read(written(inner, f"mesh = '{name}'"))
        assert "SECRET-TOKEN" not in str(found.value)


@pytest.mark.parametrize("rule", ["boundary:1e400", "boundary:nan", "boundary:-1", "above:nan", "above:1e400"])
def test_rules_with_numbers_that_cannot_be(rule):
    sheet = garments.load("cape-light")
    with pytest.raises(BadGarment, match=f"pins '{rule}' "):
        select_vertices(rule, sheet.vertices, sheet.faces, "sheet")


@pytest.mark.parametrize("value", [10**400, -(10**400), float("nan"), True, [[[[[]]]]], "1" * 5000])
def test_a_material_whose_numbers_cannot_be(value):
    with pytest.raises(BadGarment, match="density must be a finite number") as found:
        Material.of({"base": "cotton", "density": value})
    assert len(str(found.value)) < 200


def test_refuses_a_missing_file_and_bytes(tmp_path):
    with pytest.raises(BadGarment, match="cannot read"):
        read_garment_toml(tmp_path / "none.toml")
    (tmp_path / "bytes.toml").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(BadGarment, match="is no TOML"):
        read_garment_toml(tmp_path / "bytes.toml")
