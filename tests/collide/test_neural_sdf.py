"""The neural signed distance at run time: kernels beside their twins, values, gradients, rigid motion, files."""

from functools import cache

import numpy as np
import pytest

from hemline import bodies
from hemline.collide import inside
from hemline.collide.neural_sdf.capsules import BoneCapsules, axis_distances
from hemline.collide.neural_sdf.distance import Distance
from hemline.collide.neural_sdf.exact import ExactDistance
from hemline.collide.neural_sdf.inputs import NEAREST, TEMPERATURE, WIDTHS, PointInputs, condition
from hemline.collide.neural_sdf.neural_sdf import LAYERS, NeuralSdf, load_neural_sdf
from hemline.collide.neural_sdf.neural_sdf_kernels import softplus
from hemline.errors import BadModel, BadOutput
from hemline.files import read_tensors, write_tensors
from hemline.motions import Pose
from hemline.motions.quaternions import from_axis_angle, multiply, to_matrix

torch = pytest.importorskip("torch", reason="learning needs torch (extra 'learn')")
from hemline.learning.fit.distance_network import DistanceNetwork  # noqa: E402  # after the skip


@cache
def posed(seed: int = 0):
    """A random shape in a random pose."""
    random = np.random.default_rng(seed)
    shaped = bodies.load("anny24").shaped(random.normal(size=16))
    turns = from_axis_angle(random.normal(scale=0.3, size=(24, 3)))
    return shaped.posed(Pose(turns, random.normal(size=3)))


@cache
def network(inputs, width: int = 32) -> NeuralSdf:
    """One that nobody trained; its last layer is large, so that all layers are seen in the result."""
    body = bodies.load("anny24")
    drawn = DistanceNetwork.initialize(inputs, width=width, condition=154, seed=3)
    with torch.no_grad():
        drawn.layers["fusion1"][0].normal_(0, 0.3, generator=torch.Generator().manual_seed(1))
        for name in LAYERS:
            drawn.layers[name][1].normal_(0, 0.05, generator=torch.Generator().manual_seed(2))
    return drawn.to_neural_sdf((body.name, body.hash), (-2.5, 2.5), {})


def around(body, count: int = 200, seed: int = 5) -> np.ndarray:
    random = np.random.default_rng(seed)
    which = random.integers(len(body.vertices), size=count)
    return body.vertices[which] + random.normal(scale=0.05, size=(count, 3)).astype(np.float32)


def plain_features(inputs: PointInputs, points: np.ndarray) -> np.ndarray:
    """Plain NumPy, float64, as `PointInputs` documents them."""
    capsules, back = inputs.capsules, inputs.to_rest.astype(np.float64)
    rest = np.einsum("jab,nb->nja", back[:, :, :3], points) + back[:, :, 3]
    starts, ends = capsules.starts.astype(np.float64), capsules.ends.astype(np.float64)
    heights = axis_distances(rest, starts, ends)[0] - capsules.radii
    shares = np.exp((heights.min(axis=1, keepdims=True) - heights) / TEMPERATURE)
    nearest = heights.min(axis=1) - TEMPERATURE * np.log(shares.sum(axis=1))
    shares /= shares.sum(axis=1, keepdims=True)
    local = 5 * shares[..., None] * (rest - starts)
    girth = 10 * shares @ capsules.radii
    own = (rest - starts)[:, 0]
    return np.concatenate([own, local.reshape(len(points), -1), shares, 5 * nearest[:, None], girth[:, None]], 1)


def test_softplus_and_its_slope_are_those_of_numpy():
    given = np.concatenate([np.linspace(-0.5, 0.5, 5001), [-1e4, -30, 0, 30, 1e4]]).astype(np.float32)
    values, slopes = given.copy(), np.empty_like(given)
    softplus(values, slopes)
    wide = given.astype(np.float64)
    np.testing.assert_allclose(values, np.logaddexp(0, 100 * wide) / 100, rtol=2e-7, atol=1e-8)
    np.testing.assert_allclose(slopes, 1 / (1 + np.exp(-np.clip(100 * wide, -80, 80))), atol=2e-6)


def test_features_are_those_of_plain_numpy_and_their_derivatives_those_of_differences():
    body = posed()
    inputs, points = PointInputs.of("bones", body), around(body)
    features, derivatives = inputs.features(points, jacobians=True)
    assert features.shape == (len(points), WIDTHS["bones"])
    np.testing.assert_allclose(features, plain_features(inputs, points.astype(np.float64)), atol=3e-5)
    step, wide = 1e-6, points.astype(np.float64)
    for axis, unit in enumerate(np.eye(3)):
        change = plain_features(inputs, wide + step * unit) - plain_features(inputs, wide - step * unit)
        np.testing.assert_allclose(derivatives[:, :, axis], change / (2 * step), atol=5e-3)


def test_point_features_are_the_point_in_the_frame_of_the_pelvis():
    body = posed()
    points = around(body)
    features, derivatives = PointInputs.of("point", body).features(points, jacobians=True)
    turn = body.transforms[0, :, :3]
    np.testing.assert_allclose(features, (points - body.joints[0]) @ turn, atol=1e-5)
    np.testing.assert_allclose(derivatives[7], turn.T, atol=1e-6)
    assert not len(PointInputs.of("point", body).features(points, jacobians=False)[1])


@pytest.mark.parametrize("inputs", ["bones", "point"])
def test_run_time_and_torch_give_the_same_distances_and_gradients(inputs):
    model, body = network(inputs), posed()
    around_it, points = model.at(body), around(body, 700)
    twin = DistanceNetwork.of(model)
    read = torch.from_numpy(condition(body.shaped.betas, body.pose.rotations))[None]
    features, derivatives = (
        torch.from_numpy(np.array(each)) for each in around_it.inputs.features(points, jacobians=True)
    )
    codes = twin.code(read).expand(len(points), -1)
    distances, gradients = twin.with_gradients(features, derivatives, codes)
    found = around_it.with_gradients(points)
    np.testing.assert_allclose(found[0], distances.numpy(), atol=1e-5)
    np.testing.assert_allclose(found[1], gradients.numpy(), atol=1e-4)
    np.testing.assert_array_equal(found[0], around_it.signed_distances(points))
    np.testing.assert_allclose(twin.distances(features, codes).numpy(), found[0], atol=1e-5)
    features.requires_grad_()  # a second route to the gradient: torch's own
    (to_features,) = torch.autograd.grad(twin.distances(features, codes).sum(), features)
    np.testing.assert_allclose((to_features[:, None] @ derivatives)[:, 0].numpy(), found[1], atol=1e-4)


@pytest.mark.parametrize("inputs", ["bones", "point"])
def test_gradients_are_those_of_differences(inputs):
    body = posed(1)
    around_it, points = network(inputs).at(body), around(body)
    gradients = around_it.with_gradients(points)[1]
    step = 2e-4
    for axis, unit in enumerate(np.eye(3, dtype=np.float32)):
        change = around_it.signed_distances(points + step * unit) - around_it.signed_distances(points - step * unit)
        off = np.abs(change / (2 * step) - gradients[:, axis])
        assert np.median(off) < 0.01 and np.percentile(off, 95) < 0.1  # float32, and softplus bends within a step


@pytest.mark.parametrize("inputs", ["bones", "point"])
def test_rigid_motion_of_body_and_points_changes_no_distance(inputs):
    body, points = posed(), around(posed())
    turn, shift = from_axis_angle(np.array([0.4, 2.0, -0.3])), np.array([3.0, -1.0, 0.5])
    rotations = body.pose.rotations.copy()
    rotations[0] = multiply(turn, rotations[0])
    moved = body.shaped.posed(Pose(rotations, to_matrix(turn) @ body.pose.translation + shift))
    before = network(inputs).at(body).with_gradients(points)
    after = network(inputs).at(moved).with_gradients((points @ to_matrix(turn).T + shift).astype(np.float32))
    np.testing.assert_allclose(after[0], before[0], atol=2e-4)
    off = np.abs(after[1] - before[1] @ to_matrix(turn).T)
    assert np.median(off) < 1e-3


def test_the_network_of_the_paper_begins_as_a_sphere():
    network = DistanceNetwork.initialize("point", width=512, condition=154, seed=0)
    random = np.random.default_rng(0)
    directions = random.normal(size=(200, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    codes = network.code(torch.zeros(1, 154)).expand(200, -1)
    values = []
    for radius in (0.25, 0.5, 0.75):
        points = torch.from_numpy((radius * directions).astype(np.float32))
        values.append(network.distances(points, codes).detach().numpy())
    middle, spread = np.mean(values, axis=1), np.std(values, axis=1)
    np.testing.assert_allclose(middle, [-0.25, 0, 0.25], atol=0.04)
    assert spread.max() < 0.08
    assert [len(network.layers[name][1]) for name in LAYERS] == 7 * [512] + [1]  # 3 + 3 + 2 layers


def test_the_capsules_follow_the_shape_and_the_start_is_the_distance_to_them():
    capsules = BoneCapsules.of(posed().shaped)
    assert capsules.radii.min() > 0.01 and capsules.radii.max() < 0.3
    drawn = DistanceNetwork.initialize("bones", width=32, condition=154, seed=0)
    model = drawn.to_neural_sdf(("anny24", bodies.load("anny24").hash), (-2, 2), {})
    body, points = posed(), around(posed())
    features, _ = model.at(body).inputs.features(points, jacobians=False)
    assert np.abs(model.at(body).signed_distances(points) - features[:, NEAREST] / 5).mean() < 0.03


def test_the_exact_distance_is_signed_by_the_winding_number_and_lipschitz():
    body = posed()
    exact, points = ExactDistance.of(body), around(body, 500)
    distances, gradients = exact.with_gradients(points)
    assert isinstance(exact, Distance) and isinstance(network("bones").at(body), Distance)
    np.testing.assert_array_equal(distances < 0, inside(body.vertices, body.faces, points))
    np.testing.assert_allclose(np.linalg.norm(gradients, axis=1), 1, atol=1e-6)
    onto = exact.signed_distances(points - distances[:, None] * gradients)
    assert np.abs(onto).max() < 1e-5
    step = np.random.default_rng(0).normal(scale=0.01, size=points.shape)
    free = ~exact_in_overlap(body, points) & ~exact_in_overlap(body, points + step)
    change = np.abs(exact.signed_distances(points + step) - distances)
    assert (change <= np.linalg.norm(step, axis=1) + 2e-3)[free].all()


def exact_in_overlap(body, points) -> np.ndarray:
    """Where two parts of the body overlap."""
    from hemline.collide import winding_numbers

    return winding_numbers(body.vertices, body.faces, points) > 1


def test_a_point_on_the_skin_gets_the_normal_of_the_skin():
    body = posed()
    exact = ExactDistance.of(body)
    middle = body.vertices.astype(np.float64)[exact.tree.faces[:100]].mean(axis=1)
    distances, gradients = exact.with_gradients(middle)
    corners = body.vertices.astype(np.float64)[exact.tree.faces[:100]]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert np.abs(distances).max() < 1e-6
    assert ((gradients * normals).sum(1) / np.linalg.norm(normals, axis=1)).min() > 0.999


def test_saved_and_loaded_it_is_the_same_to_the_bit(tmp_path):
    model, body = network("bones"), posed()
    model.save(tmp_path / "it.safetensors")
    again = load_neural_sdf(tmp_path / "it.safetensors")
    points = around(body)
    for one, other in zip(model.at(body).with_gradients(points), again.at(body).with_gradients(points), strict=True):
        np.testing.assert_array_equal(one, other)
    assert again.width == 32 and again.beta_range == (-2.5, 2.5) and again.inputs == "bones"
    assert again.flops() == (2 * (101 * 32 + 3 * 32**2 + 32), 4 * (101 * 32 + 3 * 32**2 + 32))


@pytest.mark.parametrize(
    "damage, words",
    [
        (lambda arrays, data: arrays.pop("point1.weight"), "the model lacks array 'point1.weight'"),
        (lambda arrays, data: arrays.update({"fusion0.bias": np.zeros(5, np.float32)}), "array 'fusion0.bias'"),
        (lambda arrays, data: data.update(inputs="heads"), "inputs of a neural distance are 'bones' or 'point'"),
        (lambda arrays, data: data.update(inputs="point"), "array 'point0.weight' of the model must be"),
        (lambda arrays, data: data.update(beta_range=["low", 2]), "'beta_range' of a neural distance"),
        (lambda arrays, data: data.pop("body"), "the model lacks metadata 'body'"),
        (lambda arrays, data: arrays["fusion1.bias"].fill(np.nan), "must be finite"),
    ],
)
def test_damaged_files_are_refused(tmp_path, damage, words):
    network("bones").save(tmp_path / "it.safetensors")
    arrays, metadata = read_tensors(tmp_path / "it.safetensors", "distance")
    damage(arrays, metadata)
    write_tensors(tmp_path / "damaged.safetensors", arrays, metadata)
    with pytest.raises(BadModel, match=words):
        load_neural_sdf(tmp_path / "damaged.safetensors")


def test_other_bodies_missing_files_and_paths_that_cannot_be_written_are_refused(tmp_path):
    from dataclasses import replace

    with pytest.raises(BadModel, match="is of the body 'anny24' with hash other"):
        replace(network("bones"), body_hash="other").at(posed())
    with pytest.raises(BadModel, match="cannot read"):
        load_neural_sdf(tmp_path / "nothing.safetensors")
    with pytest.raises(BadOutput):
        network("bones").save(tmp_path / "no folder" / "it.safetensors")


def test_no_points_no_distances():
    around_it = network("bones").at(posed())
    distances, gradients = around_it.with_gradients(np.zeros((0, 3), np.float32))
    assert distances.shape == (0,) and gradients.shape == (0, 3)


def test_the_shipped_distance_holds_around_a_body_that_it_has_not_seen():
    """2.3 mm is the mean around posed bodies of validation subjects; around this kick it misses 4.7."""
    from hemline import motions

    shaped = bodies.load("anny24").shaped((0.8, -1.0, 0.5, 0.3))
    body = shaped.posed(motions.load("kick")[30])
    points = around(body, 1500)
    truth, found = ExactDistance.of(body).signed_distances(points), load_neural_sdf().at(body).signed_distances(points)
    near = np.abs(truth) < 0.01
    assert np.abs(found - truth)[near].mean() < 0.006
    clear = near & (np.abs(truth) > 0.002)
    assert ((found < 0) == (truth < 0))[clear].mean() > 0.8
