"""Garments worn together are one garment: layered, stored, dressed and simulated piece by piece."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from hemline import bodies, datasets, garments, motions, sim
from hemline.errors import BadGarment
from hemline.garments import Garment, Piece, Pins, wear_together
from hemline.meshes import ClosestTree
from hemline.motions.motion import JOINT_NAMES
from hemline.sim.step.dressed_body import make_garment_sheet


def tube(shaped, *, radius=0.28, rows=8, columns=28, top=0.0, length=0.35, material="cotton", name="skirt"):
    """A cylinder around the pelvis, pinned to that joint by its upper rim."""
    angle = 2 * np.pi * np.arange(columns) / columns
    ring = np.stack([radius * np.sin(angle), 0 * angle, radius * np.cos(angle)], axis=1)
    vertices = np.concatenate([ring + [0, top - length * row / (rows - 1), 0] for row in range(rows)])
    number = np.arange(rows * columns).reshape(rows, columns)
    a, b = number[:-1], np.roll(number[:-1], -1, axis=1)
    c, d = number[1:], np.roll(number[1:], -1, axis=1)
    faces = np.concatenate([np.stack([a, c, b], -1).reshape(-1, 3), np.stack([b, c, d], -1).reshape(-1, 3)])
    one, two = vertices[faces[:, 1]] - vertices[faces[:, 0]], vertices[faces[:, 2]] - vertices[faces[:, 0]]
    length_one = np.linalg.norm(one, axis=1)
    along = (one * two).sum(1) / length_one
    across = np.sqrt((two * two).sum(1) - along**2)
    rest = np.stack([np.stack([length_one, along], 1), np.stack([0 * along, across], 1)], axis=1)
    return Garment(
        name=name,
        vertices=vertices,
        faces=faces,
        rest_edges=rest,
        material=garments.MATERIALS[material],
        pins=Pins.on_joint(np.arange(columns), vertices[:columns], 0, shaped.joints),
        key_joint="pelvis",
        body_betas=shaped.betas,
        flat_rest=False,
    )


def test_pieces_follow_each_other_with_their_own_materials(shaped):
    inner, outer = tube(shaped), tube(shaped, radius=0.33, columns=30, material="silk", name="over")
    both = wear_together([inner, outer])
    assert both.name == "skirt+over"
    assert [(p.name, p.vertex_count, p.material.name) for p in both.pieces] == [
        ("skirt", 224, "cotton"),
        ("over", 240, "silk"),
    ]
    np.testing.assert_array_equal(both.vertices, np.concatenate([inner.vertices, outer.vertices]))
    assert both.pins.vertices.tolist() == [*range(28), *range(224, 254)]
    sheet = make_garment_sheet(both)
    assert np.bincount(sheet.piece).tolist() == [224, 240]
    density = [garments.MATERIALS[name].density for name in ("cotton", "silk")]
    np.testing.assert_allclose(sheet.density, np.repeat(density, [len(inner.faces), len(outer.faces)]))
    np.testing.assert_allclose(both.densities, sheet.density)
    assert sheet.mass.sum() == pytest.approx(
        make_garment_sheet(inner).mass.sum() + make_garment_sheet(outer).mass.sum()
    )
    assert "material cotton, silk" in garments.explain(both)


def test_a_piece_that_starts_within_another_is_moved_out_with_its_pins(shaped):
    inner = tube(shaped, radius=0.30)
    outer = tube(shaped, radius=0.295, columns=30, top=-0.02, name="over")
    both = wear_together([inner, outer])
    tree = ClosestTree(inner.vertices.astype(float), inner.faces)
    closest = tree.closest(both.vertices[224:])
    height = ((both.vertices[224:] - closest.positions) * tree.outward(closest)).sum(axis=1)
    # the hem of the outer one hangs below that of the inner one
    assert height[:-30].min() > 0.0029
    np.testing.assert_array_equal(both.vertices[:224], inner.vertices)
    at_rest = both.pins.positions(shaped.vertices, shaped.normals, shaped.body.faces, shaped.joints)
    np.testing.assert_allclose(at_rest, both.vertices[both.pins.vertices], atol=1e-6)


def test_three_garments_in_one_go_or_one_after_the_other(shaped):
    parts = [tube(shaped, radius=r, name=n) for r, n in ((0.28, "a"), (0.30, "b"), (0.32, "c"))]
    once = wear_together(parts, name="all")
    twice = wear_together([wear_together(parts[:2]), parts[2]], name="all")
    assert once.hash == twice.hash
    assert [piece.name for piece in twice.pieces] == ["a", "b", "c"]


def test_pieces_come_back_from_disk_and_count_in_the_hash(shaped, tmp_path):
    both = wear_together([tube(shaped), tube(shaped, radius=0.33, material="wool", name="over")])
    both.save(tmp_path / "both.safetensors")
    again = Garment.load(tmp_path / "both.safetensors")
    assert again.pieces == both.pieces
    assert again.hash == both.hash
    silk = replace(both.pieces[1], material=garments.MATERIALS["silk"])
    assert replace(both, pieces=(both.pieces[0], silk)).hash != both.hash


def test_dressed_on_another_shape_they_stay_layered(shaped):
    both = wear_together([tube(shaped), tube(shaped, radius=0.284, name="over")])
    worn = both.dressed(shaped.body.shaped([1.5, 1.0]))
    tree = ClosestTree(worn.vertices[:224].astype(float), worn.faces[: len(worn.faces) // 2])
    closest = tree.closest(worn.vertices[224:])
    height = ((worn.vertices[224:] - closest.positions) * tree.outward(closest)).sum(axis=1)
    assert (height > 0).mean() > 0.95


@pytest.mark.parametrize(
    ("pieces", "message"),
    [
        ((3, 2), r"pieces must make up its 4 vertices; got \[3, 2\]"),
        ((4, 0), r"pieces must make up its 4 vertices; got \[4, 0\]"),
        ((2, 2), "faces must follow each other piece by piece"),
    ],
)
def test_pieces_that_are_not_its_mesh_are_refused(patch, pieces, message):
    made = tuple(Piece(str(count), count, patch["material"], True) for count in pieces)
    with pytest.raises(BadGarment, match=message):
        Garment(**patch | {"pieces": made})


def test_another_material_than_the_innermost_pieces_is_refused(shaped):
    both = wear_together([tube(shaped), tube(shaped, radius=0.33, name="over")])
    with pytest.raises(BadGarment, match="material must be that of the innermost piece; got denim, the innermost is c"):
        replace(both, material=garments.MATERIALS["denim"])


def test_nothing_and_garments_of_several_bodies_are_refused(shaped):
    with pytest.raises(BadGarment, match="no garments to wear together"):
        wear_together([])
    wide = shaped.body.shaped([2.0])
    with pytest.raises(BadGarment, match=r"must be on one body; got 'skirt' on anny24, 'w' on anny24 with betas \[2.0"):
        wear_together([tube(shaped), tube(wide, name="w")])


def test_a_file_with_a_piece_that_lacks_a_key_is_refused(shaped):
    both = wear_together([tube(shaped), tube(shaped, radius=0.33, name="over")])
    metadata = both.metadata()
    del metadata["pieces"][1]["material"]
    with pytest.raises(BadGarment, match="readable metadata; got values of the wrong kind"):
        Garment.of(both.arrays(), metadata)


def test_simulated_apart_and_together_they_move_alike_and_the_dataset_keeps_them(shaped, tmp_path):
    # narrow enough for the hands to swing past: cloth that they catch is not solved to the tolerance
    inner, outer = tube(shaped, radius=0.30), tube(shaped, radius=0.32, material="denim", name="over")
    both = wear_together([inner, outer])
    settings = sim.SimSettings(settle=0.3, lead_in=0.2, self_contact=False, residual_share=1e-3, newton_steps=20)
    walk = motions.load("walk")[:6]
    rows = sim.produce(tmp_path / "data", both, [sim.ClipRequest(walk, "someone")], settings=settings)
    dataset = datasets.open_dataset(tmp_path / "data")
    assert dataset.garment.pieces == both.pieces
    take = dataset.take(rows[0])
    placed = bodies.load("anny24").shaped().placed(walk.resample(30))
    motion = bodies.load("anny24").shaped().untangle_motion(placed)
    alone = [sim.simulate(garment, shaped, motion, settings) for garment in (inner, outer)]
    wanted = np.concatenate([each.vertices for each in alone], axis=1)
    assert np.abs(take.vertices[-1] - take.vertices[0]).max() > 0.05
    # the solver stops at the mean residual of all vertices, so that both sides differ within its tolerance, and cloth
    # that buckles enlarges that here and there
    off = np.linalg.norm(take.vertices - wanted, axis=2)
    assert off.mean() < 2e-4
    assert np.percentile(off, 99) < 3e-3


def test_cloth_between_thighs_and_belly_is_marked_pinched_and_the_take_goes_on(shaped):
    settings = sim.SimSettings(lead_in=0.2, settle=0.5, self_contact=False)
    walk = shaped.placed(motions.load("walk").resample(30))[:13]
    rotations = walk.rotations.copy()
    for joint, degrees in (
        ("left_hip", -150),
        ("right_hip", -150),
        ("spine1", 60),
        ("left_knee", 150),
        ("right_knee", 150),
    ):
        bent = Rotation.from_euler("x", degrees * np.linspace(0, 1, len(walk))[:, None], degrees=True).as_quat()
        rotations[:, JOINT_NAMES.index(joint)] = bent[:, [3, 0, 1, 2]]
    skirt = tube(shaped, radius=0.24, rows=14, columns=56, top=0.06, length=0.40)
    take = sim.simulate(skirt, shaped, replace(walk, rotations=rotations), settings)
    assert take.failed is None
    assert take.pinched[:6].max() == 0
    assert take.pinched.max() > 10
    assert take.figures["inside"] == 0
    assert np.isfinite(take.vertices).all()
