"""Accessories: closed parts that follow one joint, found at their place in any unit, or refused with the reason."""

from pathlib import Path

import numpy as np
import pytest
import trimesh

from hemline import bodies
from hemline.errors import BadBody
from hemline.motions import JOINT_NAMES


@pytest.fixture(scope="module")
def body():
    return bodies.load("anny24")


def ball(place, radius, *, open_at_top=False, inside_out=False):
    """A ball of 162 vertices."""
    mesh = trimesh.creation.icosphere(2)
    faces = mesh.faces[mesh.triangles_center[:, 1] < 0.8] if open_at_top else mesh.faces
    vertices = radius * mesh.vertices + place
    return trimesh.Trimesh(vertices, faces[:, ::-1] if inside_out else faces, process=False)


def joint(body, name):
    return body.joints[JOINT_NAMES.index(name)]


def attached(body, path, where):
    return bodies.attach(body, [bodies.Accessory(path, where)])


def part_of(body):
    """The accessories of a body at rest as a mesh of trimesh, which judges it."""
    faces = body.faces[body.faces[:, 0] >= len(body.bare.template)]
    return trimesh.Trimesh(body.template, faces, process=False)


@pytest.mark.parametrize("fault", [{}, {"open_at_top": True}, {"inside_out": True}])
def test_an_accessory_becomes_a_closed_part_with_its_outside_out(tmp_path, body, fault):
    ball(joint(body, "left_hip") + [0.12, 0, 0], 0.07, **fault).export(tmp_path / "pouch.obj")
    carrying, _ = attached(body, tmp_path / "pouch.obj", "pelvis")
    part = part_of(carrying)
    assert part.is_watertight and 0.85 < part.volume / (4 / 3 * np.pi * 0.07**3) < 1
    assert (carrying.faces[: len(body.faces)] == body.faces).all()
    assert carrying.bare.hash == body.hash and carrying.bare.name == "anny24"


def test_what_cannot_be_closed_by_fans_gets_a_shell(tmp_path, body):
    """Two balls that share one triangle edge three times: an edge of more than two triangles."""
    one = ball(joint(body, "head") + [0, 0.15, 0], 0.08)
    flap = one.vertices[one.faces[0][:2]].tolist() + [(one.vertices[one.faces[0][0]] + [0, 0.03, 0]).tolist()]
    vertices = np.concatenate([one.vertices, flap[2:]])
    faces = np.concatenate([one.faces, [[*one.faces[0][:2], len(one.vertices)]]])
    trimesh.Trimesh(vertices, faces, process=False).export(tmp_path / "hat.obj")
    carrying, notes = attached(body, tmp_path / "hat.obj", "head")
    part = part_of(carrying)
    assert part.is_watertight and abs(part.volume / one.volume - 1) < 0.1
    assert "1 of 1 parts were closed by a shell around them" in notes


@pytest.mark.parametrize(("ending", "unit"), [("obj", 1.0), ("obj", 0.01), ("obj", 0.001), ("glb", 1.0)])
@pytest.mark.parametrize("origin", ["pelvis", "floor", "joint"])
def test_unit_and_origin_are_found(tmp_path, body, ending, unit, origin):
    pads = ball(joint(body, "left_shoulder") + [0, 0.06, 0], 0.08)
    shift = {
        "pelvis": np.zeros(3),
        "floor": np.array([0, body.template[:, 1].min(), 0]),
        "joint": joint(body, "spine3"),
    }[origin]
    file = trimesh.Trimesh((pads.vertices - shift) / unit, pads.faces, process=False)
    if origin == "joint":  # a bag on the back, as its maker modelled it
        file = ball([0, 0, -0.12], 0.08)
        file.apply_scale(1 / unit)
        pads = ball(shift + [0, 0, -0.12], 0.08)
    file.export(tmp_path / f"pads.{ending}")
    carrying, notes = attached(body, tmp_path / f"pads.{ending}", "spine3")
    assert np.allclose(part_of(carrying).bounds, pads.bounds, atol=1e-4), notes


def test_an_accessory_follows_its_joint_rigidly_in_pose_and_shape(tmp_path, body):
    ball(joint(body, "left_elbow") + [0.1, 0, 0], 0.06).export(tmp_path / "shield.obj")
    carrying, _ = attached(body, tmp_path / "shield.obj", "left_elbow")
    own = slice(len(body.template), None)
    betas = [1.5, -1.0, 0.5]
    posed = carrying.shaped(betas).posed(motion_pose())
    turned = posed.transforms[JOINT_NAMES.index("left_elbow")]
    rest = carrying.shaped(betas).vertices[own]
    assert np.allclose(posed.vertices[own], rest @ turned[:, :3].T + turned[:, 3], atol=1e-5)
    moved = rest - carrying.template[own]
    assert np.ptp(moved, axis=0).max() < 1e-6 and 0.005 < np.linalg.norm(moved[0]) < 0.2
    assert (posed.vertices[: own.start] == body.shaped(betas).posed(motion_pose()).vertices).all()


def motion_pose():
    from hemline import motions

    return motions.load("kick")[60]


def test_a_body_file_keeps_accessories_and_the_bits_of_the_body(tmp_path, body):
    ball(joint(body, "left_hip") + [0.12, 0, 0], 0.07).export(tmp_path / "pouch.obj")
    carrying, _ = attached(body, tmp_path / "pouch.obj", "pelvis")
    bodies.write(tmp_path / "hero.safetensors", carrying)
    again = bodies.load(str(tmp_path / "hero.safetensors"))
    assert again.accessory_vertices == carrying.accessory_vertices == 162
    assert again.bare.hash == body.hash and again.bare.name == "anny24"


def test_what_is_no_accessory_is_refused(tmp_path, body):
    sheet = trimesh.Trimesh([[0, 0, 0], [0.3, 0, 0], [0, 0.3, 0]], [[0, 1, 2]], process=False)
    sheet.export(tmp_path / "sheet.obj")
    ball([0.0, 3.0, 0.0], 0.1).export(tmp_path / "away.obj")
    ball([0.0, 0.0, 0.0], 900.0).export(tmp_path / "house.obj")
    (tmp_path / "torn.obj").write_text("v 0 0 0\nv 1 nan 0\nv 0 1 0\nf 1 2 3\n")
    for name, reason in {
        "sheet.obj": "encloses nothing",
        "away.obj": "must lie within 10 cm of the skin at the joint 'head'",
        "house.obj": "an accessory is 0.02 to 1.5 m large",
        "torn.obj": "an accessory cannot be made of torn.obj",
        "missing.obj": "an accessory cannot be made of missing.obj",
    }.items():
        with pytest.raises(BadBody, match=reason):
            attached(body, tmp_path / name, "head")


@pytest.mark.parametrize("text", ["pads.glb", "pads.glb:chest", ":head", "pads.glb:head:ft"])
def test_a_joint_must_be_named(text):
    with pytest.raises(BadBody, match="FILE:JOINT"):
        bodies.Accessory.parse(text)


def test_a_path_may_hold_colons():
    assert bodies.Accessory.parse("C:\\a:b.glb:head:mm") == bodies.Accessory(Path("C:\\a:b.glb"), "head", "mm")
