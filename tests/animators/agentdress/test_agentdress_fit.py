"""Fit and playback of AgentDress, on a shirt that follows a formula."""

from dataclasses import replace

import numpy as np
import pytest

import hemline
from hemline import bodies
from hemline.animators.agentdress.binding import Binding
from hemline.animators.agentdress.config import AgentDressConfig
from hemline.animators.agentdress.distances import anchor_weights, axes_between, region_distances
from hemline.animators.agentdress.fit.anchor_set import AnchorSet, _shapes_of_anchors
from hemline.animators.agentdress.fit.fit import fit
from hemline.animators.agentdress.model import AnimatorAgentDress
from hemline.animators.agentdress.pose_model import kernel
from hemline.animators.agentdress.shape_model import ShapeModel
from hemline.datasets import create
from hemline.errors import BadDataset, BadInput, BadModel
from hemline.files import read_tensors, write_tensors
from hemline.motions import Pose
from hemline.motions.quaternions import from_axis_angle, multiply, to_matrix
from tests.animators import formula_garment as made

STILL = AgentDressConfig(decay_seconds=0.0)


@pytest.fixture(scope="module")
def dataset(tmp_path_factory):
    return made.make_dataset(tmp_path_factory.mktemp("anchors"), 24)


@pytest.fixture(scope="module")
def model(dataset):
    return fit(dataset, STILL)


def play_pose(model, pose, betas=()):
    posed = made.body().body.shaped(np.asarray(betas, np.float32)).posed(pose)
    return model.step(model.start(posed), posed, 1 / 30)[1]


def mean_mm(one, other):
    return 1e3 * float(np.linalg.norm(one - other, axis=1).mean())


def skin_rest(pose):
    """Returns the skinned rest garment, a baseline."""
    rest = made.formula(made.body().rest_pose, ())
    return made.binding().skin(made.body().posed(pose).transforms, made.rest_garment(), rest)


def test_new_poses_err_less_than_skinning(model):
    ours, theirs = [], []
    for number in range(100, 110):
        pose = made.random_pose(number)
        truth = made.lifted_garment(pose)
        ours.append(mean_mm(play_pose(model, pose), truth))
        theirs.append(mean_mm(skin_rest(pose), truth))
    assert np.mean(ours) < 0.5 * np.mean(theirs)
    assert np.mean(theirs) > 2
    assert model.figures["pose_left_out_mm"] < 0.6 * model.figures["pose_left_out_skinned_mm"]


def test_more_anchors_and_single_poses_reduce_the_error(model, tmp_path):
    few = fit(made.make_dataset(tmp_path / "few", 5), STILL)
    beside = fit(made.make_dataset(tmp_path / "beside", 5, singles=19), STILL)
    assert beside.figures["anchors"] == 5 and beside.figures["poses"] == 24
    poses = [made.random_pose(number) for number in range(100, 110)]
    errors = [
        np.mean([mean_mm(play_pose(each, p), made.lifted_garment(p)) for p in poses]) for each in (few, beside, model)
    ]
    assert errors[1] < 0.7 * errors[0] and errors[2] < 0.7 * errors[0]


@pytest.mark.parametrize("betas", [(1.5,), (-0.7, 1.2), (0.0, -2.0)])
def test_shapes_are_predicted_in_every_pose(model, betas):
    """Linear and square effects of the shape are predicted in new poses and on new shapes, better than by skinning."""
    for number in (3, 104):
        pose = made.random_pose(number)
        truth = made.lifted_garment(pose, betas)
        transforms = made.body().body.shaped(np.asarray(betas, np.float32)).posed(pose).transforms
        without = made.binding().skin(transforms, made.rest_garment(), made.formula(pose, ()))
        assert mean_mm(play_pose(model, pose, betas), truth) < 0.35 * mean_mm(without, truth)


def test_at_an_anchor_its_shape_model_applies(dataset):
    """Blended with one neighbour, the effect of the shape is the `ShapeModel` of the anchor, skinned (Eq. 3)."""
    model = fit(dataset, replace(STILL, shape_model="blended", neighbours=1, floor=1e-9, shape_modes=200))
    anchors = AnchorSet.of(dataset)
    betas = np.array([[0.6, -1.3]])
    for number in (0, 7):
        own = ShapeModel.fit(
            anchors.offsets[number].reshape(len(anchors.betas), -1).astype(np.float64),
            anchors.betas,
            components=5,
            ridge=0.2,
        )
        pose = Pose(anchors.rotations[number], made.body().rest_pose.translation)
        posed = made.body().body.shaped(betas[0].astype(np.float32)).posed(pose)
        state, still = model.start(posed), model.start(made.body().posed(pose))
        nearest = np.zeros((model.tables.regions.shape[1], len(model.tables.rotations)), np.float32) + 9
        nearest[:, number] = 0
        tables = model.tables
        with_shape = model._basis_coefficients(nearest, state.effects) - model._basis_coefficients(
            nearest, still.effects
        )
        digits = tables.basis.digits.reshape(-1, 3, with_shape.shape[1])
        found = np.einsum("vg,gk,vik->vi", tables.regions, with_shape, digits)
        wanted = (own.at(betas) - own.at(np.zeros((1, 2))))[0].reshape(-1, 3)
        assert np.abs(wanted).max() > 1e-3
        np.testing.assert_allclose(found, wanted, atol=6e-5)  # columns of 8 bits
        at_rest = (anchors.rest.at(betas) - anchors.rest.mean)[0].reshape(-1, 3)
        np.testing.assert_allclose(state.rest - still.rest, at_rest, atol=1e-5)  # half precision


def test_the_garment_moves_rigidly_with_the_root(model):
    pose = made.random_pose(101)
    turn, shift = from_axis_angle(np.array([0.0, 1.1, 0.0])), np.array([0.3, 0.2, -1.0])
    rotations = pose.rotations.astype(np.float64)
    rotations[0] = multiply(turn, rotations[0])
    there = Pose(rotations, pose.translation + shift)
    wanted = (play_pose(model, pose) - pose.translation) @ to_matrix(turn).T + pose.translation + shift
    np.testing.assert_allclose(play_pose(model, there), wanted, atol=2e-5)


def test_decay_does_not_depend_on_the_frame_rate(dataset):
    model = fit(dataset, replace(STILL, decay_seconds=0.1))
    first, second = (made.body().posed(made.random_pose(number)) for number in (100, 101))
    begun, _ = model.step(model.start(first), first, 1 / 30)
    once, vertices = model.step(begun, second, 1 / 15)
    half, _ = model.step(begun, second, 1 / 30)
    twice, other = model.step(half, second, 1 / 30)
    np.testing.assert_allclose(twice.axes, once.axes, rtol=1e-4, atol=1e-6)
    np.testing.assert_allclose(other, vertices, atol=1e-5)
    target = model._axes(made.anchor_pose(made.random_pose(101)).rotations)
    moved = np.abs(begun.axes - target) > 0.01
    kept = (once.axes - target)[moved] / (begun.axes - target)[moved]
    np.testing.assert_allclose(kept, np.exp(-2 / 3), rtol=1e-2)


def test_decay_leads_between_the_poses(dataset):
    """A midpoint has the mean squared distance of both poses, less a quarter of that between them (Apollonius)."""
    model = fit(dataset, replace(STILL, decay_seconds=0.1))
    ends = [made.body().posed(made.random_pose(number)) for number in (100, 101)]
    begun, _ = model.step(model.start(ends[0]), ends[0], 1 / 30)
    between, _ = model.step(begun, ends[1], 0.1 * np.log(2))
    arrived, _ = model.step(begun, ends[1], 1e3)
    turns = axes_between(*(made.anchor_pose(made.random_pose(number)).rotations[None] for number in (100, 101)))
    apart = region_distances(turns, model.tables.axes.astype(np.float64))[0]
    plain = (begun.distances + arrived.distances) / 2 - apart / 4
    np.testing.assert_allclose(between.distances, plain, rtol=1e-3, atol=1e-5)


def test_drape_is_a_step_without_history(model):
    """In a pose with lifted arms, it is the garment that anchors have."""
    pose = made.anchor_pose(made.random_pose(102))
    posed = made.body().posed(pose)
    truth = made.garment_in_pose(pose)
    assert mean_mm(model.drape(posed), truth) < 0.6 * mean_mm(skin_rest(pose), truth)
    # it equals playback in the original pose, except for the lifted arms
    tables = model.tables
    binding = Binding(tables.indices, tables.weights, tables.nearest)
    lifted = binding.offsets(posed.transforms, tables.rest, model.drape(posed))
    hanging = made.random_pose(102)
    handed_back = binding.offsets(made.body().posed(hanging).transforms, tables.rest, play_pose(model, hanging))
    np.testing.assert_allclose(lifted, handed_back, atol=2e-5)


def test_joints_that_move_nothing_do_not_count(dataset, model):
    """A knee counts less than a shoulder, as sensitivities are relative to the skin."""
    influence = model.tables.axes.reshape(-1, 24, 3).sum(axis=2)
    knee, shoulder = influence[:, 4].max(), influence[:, made.SHOULDER].max()
    assert knee < 0.03 * shoulder  # Q to the power 3/4
    whole, beside = AnchorSet.of(dataset).sensitivity
    assert whole[:, 0].mean() > 0.2 > beside[:, 0].mean()


def test_the_kernel_equals_plain_numpy(dataset):
    model = fit(dataset, STILL)
    pose = made.random_pose(100)
    posed = made.body().body.shaped(np.float32([0.8, -1.1])).posed(pose)
    state = model.start(posed)
    after, vertices = model.step(state, posed, 1 / 30)
    tables, mixed = model.tables, model._basis_coefficients(after.distances, state.effects)
    digits = tables.basis.digits.reshape(-1, 3, mixed.shape[1])
    offsets = tables.offset + np.einsum("vg,gk,vik->vi", tables.regions, mixed, digits)
    binding = Binding(tables.indices, tables.weights, tables.nearest)
    plain = binding.skin(posed.transforms, state.rest, offsets)
    assert ((tables.regions > 1e-4).sum(axis=1) > 3).any()
    np.testing.assert_allclose(vertices, plain, atol=2e-5)


@pytest.mark.parametrize("way", ["kernel", "blended"])
@pytest.mark.parametrize("posing", [True, False])
def test_basis_coefficients_equal_plain_numpy(dataset, way, posing):
    model = fit(dataset, replace(STILL, shape_model=way))
    effects = model.start(made.body().posed(made.random_pose(3))).effects
    distances = model._distances(model._axes(made.anchor_pose(made.random_pose(104)).rotations))
    exact = distances.astype(np.float64)
    pose = np.einsum("gp,gpk->gk", kernel(exact, model.width), model.tables.pose_weights.astype(np.float64)) * posing
    anchors = exact[:, : effects.shape[1]]
    if way == "kernel":
        weights = kernel(anchors, model.shape_width)
    else:
        weights = anchor_weights(anchors, **model.config.blending)
    shape = np.einsum("gs,gsk->gk", weights, np.broadcast_to(effects, (len(weights), *effects.shape[1:])))
    basis = model.tables.basis
    plain = np.concatenate([pose, shape], axis=1)[:, basis.modes] * basis.scales
    np.testing.assert_allclose(
        model._basis_coefficients(distances, effects, posing=posing), plain, rtol=1e-5, atol=1e-9
    )


def test_distances_in_a_frame_equal_those_of_the_fit(model):
    pose = made.anchor_pose(made.random_pose(103))
    turns = axes_between(pose.rotations[None].astype(np.float64), model.tables.rotations.astype(np.float64))
    plain = region_distances(turns, model.tables.axes.astype(np.float64))[0]
    np.testing.assert_allclose(model._distances(model._axes(pose.rotations)), plain, rtol=1e-4, atol=1e-6)


def test_the_garment_follows_the_skin_for_betas_without_anchors(model):
    pose, betas = made.body().rest_pose, np.zeros(16, np.float32)
    betas[9] = 3.0
    shaped = made.body().body.shaped(betas)
    moved = play_pose(model, pose, betas) - play_pose(model, pose)
    skin = (shaped.posed(pose).vertices - made.body().posed(pose).vertices)[model.tables.nearest]
    assert np.linalg.norm(skin, axis=1).max() > 5e-3
    assert np.linalg.norm(moved - skin, axis=1).mean() < 0.5 * np.linalg.norm(skin, axis=1).mean()


def test_random_bodies_teach_the_effect_of_the_other_betas(tmp_path):
    """The mean error on new bodies in new poses is halved."""
    few, more = (
        fit(made.make_dataset(tmp_path / name, 8, random_bodies=count), replace(STILL, mirror=False))
        for name, count in (("few", 0), ("more", 40))
    )
    errors = np.array(
        [
            [mean_mm(play_pose(model, pose, betas), made.lifted_garment(pose, betas)) for model in (few, more)]
            for pose, betas in ((made.random_pose(n), made.random_body(n)) for n in range(100, 110))
        ]
    )
    assert errors[:, 1].mean() < 0.5 * errors[:, 0].mean()
    assert few.figures["shapes"] == more.figures["shapes"] == len(made.SHAPES)


def test_random_bodies_in_single_poses_teach_too(tmp_path):
    data = made.make_dataset(tmp_path / "beside", 8, singles=8)
    few = fit(data, STILL)
    for number in range(40):
        data.add(made.anchor(made.anchor_pose(made.random_pose(8 + number % 8)), made.random_body(number)))
    anchors, more = AnchorSet.of(data), fit(data, STILL)
    assert sorted(anchors.other_poses) == list(anchors.other_poses) == sorted(8 + number % 8 for number in range(40))
    errors = [
        np.mean([mean_mm(play_pose(model, p, b), made.lifted_garment(p, b)) for p, b in unseen])
        for model in (few, more)
        for unseen in [[(made.random_pose(n), made.random_body(n)) for n in range(100, 110)]]
    ]
    assert errors[1] < 0.5 * errors[0]


def test_a_subset_keeps_the_bodies_in_its_poses(tmp_path):
    data = made.make_dataset(tmp_path / "some", 4, singles=4)
    for number in range(12):
        data.add(made.anchor(made.anchor_pose(made.random_pose(number % 8)), made.random_body(number)))
    anchors = AnchorSet.of(data)
    some = anchors.subset(np.array([2, 0]), np.array([3, 1]))
    rotations = np.concatenate([some.rotations, some.single_rotations])
    whole = np.concatenate([anchors.rotations, anchors.single_rotations])
    assert list(some.other_poses) == sorted(some.other_poses) and len(some.other_poses) < 12
    for pose, betas, offsets in zip(some.other_poses, some.other_betas, some.other_offsets, strict=True):
        (same,) = np.flatnonzero((anchors.other_betas == betas).all(axis=1))
        np.testing.assert_array_equal(rotations[pose], whole[anchors.other_poses[same]])
        np.testing.assert_array_equal(offsets, anchors.other_offsets[same])


def test_repeated_random_bodies_are_not_shapes_of_anchors(tmp_path):
    """After two runs of `hemline drape`, a folder has each random body in two poses."""
    data = made.make_dataset(tmp_path / "again", 5, random_bodies=4)
    for number in range(4):
        data.add(made.anchor(made.anchor_pose(made.random_pose((number + 1) % 5)), made.random_body(number)))
    assert AnchorSet.of(data).offsets.shape[:2] == (5, len(made.SHAPES))


def test_many_single_poses_do_not_outweigh_a_few_anchors():
    """A budget of minutes gives two anchors on all bodies, and dozens of poses on the mean one."""
    mean, others = (), [(float(number),) for number in range(1, 17)]
    poses = [[mean, *others]] * 2 + [[mean]] * 24 + [[mean, (0.1 * number,)] for number in range(1, 12)]
    assert _shapes_of_anchors(poses) == [mean, *others]


def test_a_model_file_changes_no_bit_of_playback(model, tmp_path):
    model.save(tmp_path / "shirt.safetensors")
    once = hemline.load(tmp_path / "shirt.safetensors")
    once.save(tmp_path / "again.safetensors")
    assert isinstance(once, AnimatorAgentDress) and once.name == "agentdress"
    assert (tmp_path / "shirt.safetensors").read_bytes() == (tmp_path / "again.safetensors").read_bytes()
    pose = made.random_pose(100)
    np.testing.assert_allclose(
        play_pose(once, pose), play_pose(model, pose), atol=1e-5
    )  # effects at rest are stored in half precision
    assert once.figures == model.figures


@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        (lambda arrays, metadata: arrays.pop("tables.rest"), "lacks array 'rest'"),
        (
            lambda arrays, metadata: arrays.update({"tables.nearest": arrays["tables.nearest"] + 10**6}),
            "body that does",
        ),
        (
            lambda arrays, metadata: arrays.update({"tables.indices": arrays["tables.indices"] + 99}),
            "bone that does not",
        ),
        (lambda arrays, metadata: arrays.update({"tables.rest": arrays["tables.rest"] * np.nan}), "must be finite"),
        (
            lambda arrays, metadata: metadata["agentdress"].update(version=1),
            "versions 5 and 6 of AgentDress; got version 1",
        ),
        (lambda arrays, metadata: metadata["agentdress"].update(width=-1.0), "positive width"),
    ],
)
def test_damaged_models_are_refused(model, tmp_path, change, complaint):
    model.save(tmp_path / "shirt.safetensors")
    arrays, metadata = read_tensors(tmp_path / "shirt.safetensors", "model", error=BadModel)
    arrays, metadata = dict(arrays), dict(metadata)
    change(arrays, metadata)
    write_tensors(tmp_path / "bad.safetensors", arrays, metadata)
    with pytest.raises(BadModel, match=complaint):
        hemline.load(tmp_path / "bad.safetensors")


def test_another_body_and_datasets_without_anchors_are_refused(model, tmp_path):
    stranger = replace(bodies.load("anny24"), name="stranger", template=1.01 * bodies.load("anny24").template)
    with pytest.raises(BadInput, match="was fitted on body anny24"):
        model.start(stranger.shaped().posed(stranger.shaped().rest_pose))
    empty = create(tmp_path / "empty", made.shirt())
    with pytest.raises(BadDataset, match="no anchor in the T-pose with derivatives"):
        fit(empty)
    empty.add(made.anchor(made.t_pose(), (), made.derivatives()))
    with pytest.raises(BadDataset, match="fewer than two anchors on all shapes; got 0"):
        fit(empty)
    with pytest.raises(BadInput, match="neighbours"):
        AgentDressConfig(neighbours=0)
