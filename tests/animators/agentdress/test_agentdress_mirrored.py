"""Mirror images of drapes: their poses and offsets, their effect on a fit, and garments without them."""

from dataclasses import replace

import numpy as np
import pytest

from hemline import bodies, garments
from hemline.animators.agentdress.binding import Binding
from hemline.animators.agentdress.config import AgentDressConfig
from hemline.animators.agentdress.fit.anchor_set import AnchorSet
from hemline.animators.agentdress.fit.fit import fit
from hemline.animators.agentdress.fit.material_fit import MaterialChanges
from hemline.animators.agentdress.fit.mirror_images import add_mirror_images, add_mirrored_changes, mirror_image
from hemline.animators.agentdress.fit.pose_fit import PoseModelFit, best_pose_fit
from hemline.animators.agentdress.fit.regions import region_weights
from hemline.animators.agentdress.shape_model import ShapeModel
from hemline.learning.mirror import MirrorImage, mirror_rotations, partners
from hemline.motions import Pose
from tests.animators import formula_garment as made

PLAIN = AgentDressConfig(decay_seconds=0.0, mirror=False)
MIRRORED = replace(PLAIN, mirror=True)
SIGNS = np.array([-1.0, 1.0, 1.0])


@pytest.fixture(scope="module")
def dataset(tmp_path_factory):
    return made.make_dataset(tmp_path_factory.mktemp("anchors"), 12, random_bodies=6)


def mirror_pose(pose):
    return Pose(mirror_rotations(pose.rotations), pose.translation)


def errors_mm(model, betas=()):
    """Returns the error on the arm that no anchor moves, in poses that move it [mm]."""
    errors, arm = [], made.binding().dense_weights()[:, made.RIGHT_SHOULDER] > 0.3
    for number in range(100, 106):
        pose = made.anchor_pose(mirror_pose(made.random_pose(number)))
        posed = made.body().body.shaped(np.asarray(betas, np.float32)).posed(pose)
        errors.append(1e3 * np.linalg.norm(model.drape(posed) - made.garment_in_pose(pose, betas), axis=1)[arm].mean())
    return np.mean(errors)


def test_the_image_of_the_image_is_the_field_itself():
    skirt = garments.load("skirt-light")
    image = MirrorImage.on(skirt.vertices, skirt.faces)
    assert np.abs(image.of(skirt.vertices) - skirt.vertices).max() < 1e-5
    field = np.random.default_rng(0).normal(size=(2, 3, *skirt.vertices.shape))
    assert np.abs(image.of(image.of(field)) - field).max() < 0.01
    assert np.abs(image.of(field) - field).max() > 1


def test_rotations_of_a_mirrored_body_move_it_to_the_mirror_image():
    pose = made.random_pose(3)
    here, there = (bodies.load("anny24").shaped().posed(each).joints for each in (pose, mirror_pose(pose)))
    left, right = (made.JOINT_NAMES.index(f"{side}_wrist") for side in ("left", "right"))
    assert np.abs(here[left] * SIGNS - there[right]).max() < 0.01
    assert np.abs(here[left] * SIGNS - there[left]).max() > 0.1


def test_each_drape_is_followed_by_its_mirror_image_in_the_mirrored_pose():
    """A garment anywhere on a body, and its mirror image on the mirrored body, agree in the world."""
    garment, random = garments.load("longsleeve-light"), np.random.default_rng(0)
    body, partner = bodies.load("anny24"), partners(garment.vertices, garment.faces)
    tpose = body.shaped().posed(made.t_pose())
    rest = garment.vertices + random.normal(0, 0.003, garment.vertices.shape)
    binding = Binding.of(Binding.of(rest, garment.faces, tpose).skin(tpose.transforms, rest), garment.faces, tpose)
    numbers = range(6)
    poses = [made.anchor_pose(made.random_pose(number)) for number in numbers]
    betas = np.array([[0.0, 0.0], [1.5, -1.0]])
    offsets = random.normal(0, 0.01, (4, 2, *rest.shape)).astype(np.float32)
    plain = AnchorSet(
        rotations=np.array([pose.rotations for pose in poses[:4]]),
        betas=betas,
        rest=ShapeModel(rest.reshape(-1), np.zeros((4, rest.size)), 1.0),
        offsets=offsets,
        single_rotations=np.array([pose.rotations for pose in poses[4:]]),
        single_offsets=offsets[:2, 0],
        other_poses=np.array([1, 4]),
        other_betas=betas[[1, 1]],
        other_offsets=offsets[2:, 1],
        sensitivity=(np.zeros(0), np.zeros(0)),
        binding=binding,
        body=body,
        groups=np.arange(6),
    )
    both = add_mirror_images(plain, MirrorImage.on(garment.vertices, garment.faces), rest_too=True)
    assert both.groups.tolist() == [0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 5, 5]
    np.testing.assert_array_equal(both.offsets[::2], offsets)
    images = [(2 * n + 1, betas[s], both.offsets[2 * n + 1, s], offsets[n, s]) for n in range(4) for s in range(2)]
    images += [(2 * n + 9, betas[0], both.single_offsets[2 * n + 1], plain.single_offsets[n]) for n in range(2)]
    images += [(each, betas[1], both.other_offsets[2 * k + 1], plain.other_offsets[k]) for k, each in enumerate((3, 9))]
    rotations = np.concatenate([both.rotations, both.single_rotations])
    for pose, shape, image, before in images:
        own, other = (
            body.shaped(shape.astype(np.float32)).posed(Pose(rotations[at], tpose.pose.translation)).transforms
            for at in (pose - 1, pose)
        )
        mirrored = binding.skin(own, rest, before)[partner] * SIGNS
        truth = binding.offsets(other, rest, mirrored)
        error, plain_error = (np.linalg.norm(truth - each, axis=1).mean() for each in (image, before))
        assert error < 0.1 * plain_error
    assert both.other_poses.tolist() == [2, 3, 8, 9] and both.other_betas.tolist() == betas[[1, 1, 1, 1]].tolist()


@pytest.mark.parametrize("betas", [(), (1.5,)])
def test_a_fit_learns_from_one_arm_about_the_other(dataset, betas):
    plain, both = fit(dataset, PLAIN), fit(dataset, MIRRORED)
    assert plain.figures["mirrored_poses"] == 0
    assert both.figures["mirrored_poses"] == both.figures["poses"] == plain.figures["poses"] == 12
    assert len(both.tables.rotations) == 24
    assert errors_mm(both, betas) < 0.6 * errors_mm(plain, betas)


def test_changes_in_another_material_are_mirrored_with_their_pose():
    skirt, random = garments.load("skirt-light"), np.random.default_rng(1)
    image, count = MirrorImage.on(skirt.vertices, skirt.faces), skirt.vertices.size
    added = random.normal(size=(3, count))
    coordinates = random.normal(size=(3, 3))
    plain = MaterialChanges(skirt.material, ("silk",), np.array([0, 2, 2]), coordinates, added)
    both = add_mirrored_changes(plain, image)
    assert both.poses.tolist() == [0, 1, 4, 4, 5, 5]
    np.testing.assert_array_equal(both.coordinates, coordinates[[0, 0, 1, 2, 1, 2]])
    np.testing.assert_array_equal(both.added[[0, 2, 3]], added)
    images = image.of(added.reshape(3, -1, 3)).reshape(3, -1)
    np.testing.assert_allclose(both.added[[1, 4, 5]], images)
    assert np.abs(images - added).max() > 1


def test_the_mirroring_with_less_leave_one_out_error_is_taken(dataset):
    anchors, garment = AnchorSet.of(dataset), made.shirt()
    regions, axes = region_weights(anchors.binding), np.ones((1, 72))
    axes = np.repeat(axes, regions.shape[1], axis=0)
    image = mirror_image(garment, dataset.body)
    errors = [
        PoseModelFit.search(
            add_mirror_images(anchors, image, rest_too=rest_too), axes, regions, MIRRORED
        ).leave_one_out_mm
        for rest_too in (False, True)
    ]
    assert best_pose_fit(anchors, image, axes, regions, MIRRORED).leave_one_out_mm == min(errors) < max(errors)
    plain = best_pose_fit(anchors, None, axes, regions, PLAIN)
    assert len(plain.rotations) == len(anchors.groups)


def test_an_asymmetric_garment_has_no_mirror_image():
    shirt = made.shirt()
    wide = np.where(shirt.vertices[:, :1] > 0.1, shirt.vertices + np.float32([0.05, 0.0, 0.0]), shirt.vertices)
    body = bodies.load("anny24")
    assert mirror_image(shirt, body) is not None
    assert mirror_image(replace(shirt, vertices=wide), body) is None
