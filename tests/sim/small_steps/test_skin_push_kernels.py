"""Contact of small steps beside plain NumPy and a search through all faces."""

import numpy as np
import pytest

from hemline import bodies, garments, motions
from hemline.collide.surface.garment_on_body import GarmentOnBody
from hemline.collide.surface.posed_surface import PosedSurface
from hemline.meshes import ClosestTree
from hemline.sim.small_steps.skin_push_kernels import MovingBody, PushSettings, SkinPlaces, find_contact, push_out
from hemline.sim.small_steps.spring_sheet import spring_sheet
from hemline.sim.small_steps.step_kernels import StepCloth
from hemline.sim.step.dressed_body import make_garment_sheet

NEAR = np.float32(0.1)
SETTINGS = PushSettings(np.float32(0.003), NEAR, np.float32(np.inf))
HERE = np.eye(4, dtype=np.float32)[:3]


@pytest.fixture(scope="module")
def dressed():
    """A T-shirt on a body in a walk: its layout, and the skin in two poses."""
    body, shirt = bodies.load("anny24").shaped(), garments.load("tshirt-light")
    on_body = GarmentOnBody.of(body, shirt.vertices)
    sheet = spring_sheet(make_garment_sheet(shirt), shirt.pins.vertices, shirt.pins.stiffness, on_body.order)
    motion = body.placed(motions.load("walk"))
    poses = [body.posed(motion[frame]) for frame in (10, 11)]
    return body, on_body, sheet, poses


def moving(on_body, before, after):
    first, second = (PosedSurface.at(on_body.patches, HERE, each.vertices).skin for each in (before, after))
    return MovingBody(first, second, second._replace(body=second.body.copy()))


def no_places(count):
    return SkinPlaces(
        np.full(count, -1, np.int32),
        np.zeros((count, 2), np.float32),
        np.zeros(count, np.float32),
        np.zeros((count, 3), np.float32),
        np.zeros(count, np.int32),
    )


def test_the_faces_that_are_found_are_as_near_as_any(dressed):
    """Above, on, and 5 mm inside all parts of the body: a walk from the nearest vertex may stop a little too early."""
    _, on_body, _, (before, _) = dressed
    skin, apart, tree = moving(on_body, before, before).before, [], ClosestTree(before.vertices, before.faces)
    for first in range(0, 12000, 2000):
        contact, at = no_places(400), slice(first, first + 400)
        heights = np.random.default_rng(0).uniform(-0.005, 0.05, (400, 1))
        points = (before.vertices[at] + heights * before.normals[at]).astype(np.float32)
        count = find_contact(skin, np.zeros(400, np.int32), points, NEAR, contact)
        assert sorted(contact.listed[:count]) == list(range(400))
        corners = skin.body[skin.faces[contact.faces]]
        weights = np.concatenate([1 - contact.weights.sum(axis=1, keepdims=True), contact.weights], axis=1)
        found = np.linalg.norm((weights[:, :, None] * corners).sum(axis=1) - points, axis=1)
        apart.append(found - tree.closest(points).distances)
    assert np.percentile(np.concatenate(apart), 95) < 1e-4
    assert np.percentile(np.concatenate(apart), 99) < 1e-3


def test_what_is_far_has_no_face(dressed):
    _, on_body, _, (before, _) = dressed
    skin, contact = moving(on_body, before, before).before, no_places(64)
    far = np.random.default_rng(0).uniform(2.0, 2.1, (64, 3)).astype(np.float32)
    assert find_contact(skin, np.zeros(64, np.int32), far, NEAR, contact) == 0
    assert (contact.faces == -1).all()


def test_cloth_inside_the_skin_is_pushed_out_and_slips_by_what_friction_leaves(dressed):
    """The body stands still; every vertex begins 1 mm over the skin and is carried 3 mm along and 2 mm down."""
    _, on_body, sheet, (before, _) = dressed
    count = len(sheet.inverse_masses)
    vertices = np.arange(2000, 2000 + count) % len(before.vertices)
    normals = before.normals[vertices]
    start = (before.vertices[vertices] + 0.001 * normals).astype(np.float32)
    along = np.cross(normals, [0.3, 1.0, 0.2])
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    moved = (start + 0.003 * along - 0.002 * normals).astype(np.float32)
    still, contact = moving(on_body, before, before), no_places(count)
    listed = find_contact(still.before, np.zeros(count, np.int32), start, NEAR, contact)
    cloth = StepCloth(moved.copy(), np.zeros_like(moved), start.copy())
    push_out(sheet, still, contact, listed, (0, 1), SETTINGS, cloth)
    height = ((cloth.positions - moved) * contact.normals).sum(axis=1)
    free = height > 1e-6
    assert free.mean() > 0.95
    # where the plane says how deep a vertex was, that far it went
    change = cloth.positions - moved
    across = change - height[:, None] * contact.normals
    slip = moved - start
    slip -= (slip * contact.normals).sum(axis=1, keepdims=True) * contact.normals
    most = sheet.friction * height
    held = np.linalg.norm(across, axis=1)
    np.testing.assert_allclose(held[free], np.minimum(most, np.linalg.norm(slip, axis=1))[free], atol=2e-6)
    assert (contact.heights[free] < SETTINGS.thickness).all()
    np.testing.assert_allclose(height[free], (SETTINGS.thickness - contact.heights)[free], atol=1e-6)


def test_cloth_that_lies_on_moving_skin_is_carried_along(dressed):
    """With friction enough, in one step from one pose to the next."""
    _, on_body, sheet, (before, after) = dressed
    count = len(sheet.inverse_masses)
    vertices = np.arange(2000, 2000 + count) % len(before.vertices)
    start = (before.vertices[vertices] + 0.002 * before.normals[vertices]).astype(np.float32)
    rough = sheet._replace(friction=np.full(count, 1e3, np.float32))
    skin, contact = moving(on_body, before, after), no_places(count)
    listed = find_contact(skin.before, np.zeros(count, np.int32), start, NEAR, contact)
    cloth = StepCloth(start.copy(), np.zeros_like(start), start.copy())
    push_out(rough, skin, contact, listed, (0, 1), SETTINGS, cloth)
    there = after.vertices[vertices] + 0.003 * after.normals[vertices]
    touched = contact.heights < SETTINGS.thickness
    assert touched.mean() > 0.25
    carried = np.linalg.norm(after.vertices[vertices] - before.vertices[vertices], axis=1)
    missed = np.linalg.norm(cloth.positions - there, axis=1)
    assert np.median(missed[touched]) < 0.15 * np.median(carried[touched])
