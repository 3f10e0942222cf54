"""The torch reference of the ropes moves like the kernels, and its gradients equal central differences."""

import functools
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from hemline.animators.ropes.mechanics.constants import RopeConstants
from hemline.animators.ropes.mechanics.dynamics import RopeChains
from hemline.collide.primitives.body_primitives import BodyPrimitives
from hemline.collide.primitives.distances import round_cone_shape

torch = pytest.importorskip("torch", reason="learning needs torch (extra 'learn')")
from hemline.animators.ropes.fit.gradient.differentiable import Drive, trajectory  # noqa: E402  # after the skip

FRAMES, STEPS, DT = 3, 2, 1 / 30
FORCES = {"drag": 1.5, "lateral": 50.0, "shrink": 30.0, "rest_angle": 20.0, "wind": (1.0, 0.5, 2.0), "substep": 1.0}
FORCES["balance_reach"] = 0.05


@functools.cache
def sheet():
    """Three chains of different lengths side by side, taut, two bends each, with a balance."""
    random = np.random.default_rng(1)
    lines = []
    for chain, count in enumerate((6, 5, 6)):
        steps = np.column_stack([0.1 * random.normal(size=count), np.full(count, -1), 0.3 * random.normal(size=count)])
        steps *= 0.1 / np.linalg.norm(steps, axis=1, keepdims=True)
        lines.append([0.12 * chain, 1.0, 0.0] + np.cumsum(steps, axis=0) - steps[0])
    masses = [random.uniform(0.001, 0.003, len(line)) for line in lines]
    chains = RopeChains.free(lines, RopeConstants(**FORCES), masses)
    pairs = np.array([[1, 7], [2, 8], [3, 9], [4, 10], [7, 12], [8, 13], [9, 14], [10, 15]], np.int32)
    positions = np.concatenate(lines)
    spans = np.linalg.norm(positions[pairs[:, 0]] - positions[pairs[:, 1]], axis=1)
    balance = random.normal(0, 2, positions.shape)
    balance[chains.kinematic] = 0
    chains = replace(
        chains,
        pairs=pairs,
        pair_spans=np.column_stack([spans, 1.05 * spans]),
        balance=balance,
        rest_tensions=np.where(chains.parents < 0, 0.0, 0.02),
    )
    return chains, positions


def roots_at(t):
    return sheet()[1][sheet()[0].kinematic] + np.array([0.1 * np.sin(5 * t), 0.02 * np.sin(9 * t), 0.1 * t * t])


def velocities_at(t):
    return (roots_at(t + 1e-6) - roots_at(t - 1e-6)) / 2e-6


def started(slack):
    """Two windows: at rest, and thrown; some ropes slack."""
    chains, positions = sheet()
    random = np.random.default_rng(2)
    thrown = np.stack([np.zeros_like(positions), random.normal(0, 1.0, positions.shape)])
    begun = np.stack([positions, positions])
    if slack:
        begun[1, 4] += [0, 0.02, 0]
        begun[1, 9] = 0.6 * begun[1, 9] + 0.4 * begun[1, 8]
    return chains, begun, thrown


def pose_at(t):
    turn = Rotation.from_rotvec([0.5 * t, 1.0 + 2.0 * t, 0.3]).as_matrix()
    return np.concatenate([turn, np.zeros((3, 1))], axis=1)[None].copy()


def motion_of(frame):
    a, b = frame * DT, (frame + 1) * DT
    return np.stack([roots_at(a), roots_at(b), velocities_at(a), velocities_at(b)])


@functools.cache
def driven():
    motions = np.stack([[motion_of(frame) for frame in range(FRAMES)]] * 2)
    poses = np.stack([[pose_at(frame * DT) for frame in range(FRAMES + 1)]] * 2)
    return Drive.of(sheet()[0], motions, poses, np.zeros((1, 3)), DT, STEPS)


@pytest.mark.parametrize("slack", [False, True])
def test_the_torch_reference_moves_as_the_kernels_do(slack):
    chains, begun, thrown = started(slack)
    found = trajectory(chains, driven(), begun, thrown).numpy()
    primitives = BodyPrimitives.none()
    for window in range(2):
        x, v, tensions = begun[window], thrown[window], chains.rest_tensions
        for frame in range(FRAMES):
            poses = pose_at(frame * DT), pose_at((frame + 1) * DT)
            x, v, tensions, _ = chains.advance(
                x, v, tensions, motion_of(frame), DT, colliders=primitives.colliders, frames=poses, steps=STEPS
            )
            np.testing.assert_allclose(found[window, frame], x, atol=1e-9)
    assert np.abs(found[:, -1] - begun).max() > 0.05


def behind(choice, radius, pose):
    """A ball 2 mm behind a node of the sheet, which one window is thrown into."""
    chains, begun, thrown = started(slack=False)
    thrown = np.stack([np.zeros_like(begun[0]), np.tile([0.1, 0.2, -2.0], (len(begun[0]), 1))])
    middle = pose[0, :, :3].T @ (begun[0][9] - [0, 0, radius + chains.constants.margin + 0.002])
    primitives = BodyPrimitives.from_primitives(
        [(0, round_cone_shape(middle, middle, radius, radius))], np.zeros((1, 3))
    )
    constants = replace(chains.constants, position_push=choice, velocity_push=choice, friction=0.0)
    return replace(chains, constants=constants), begun, thrown, primitives.colliders


@pytest.mark.parametrize("choice", ["gradient", "history"])
def test_the_torch_reference_touches_as_the_kernels_do(choice):
    chains, begun, thrown, colliders = behind(choice, 0.3, pose_at(0))
    found = trajectory(chains, driven(), begun, thrown, colliders=colliders).numpy()
    hits = 0
    for window in range(2):
        x, v, tensions = begun[window], thrown[window], chains.rest_tensions
        for frame in range(FRAMES):
            poses = pose_at(frame * DT), pose_at((frame + 1) * DT)
            x, v, tensions, touched = chains.advance(
                x, v, tensions, motion_of(frame), DT, colliders=colliders, frames=poses, steps=STEPS
            )
            hits += touched.sum()
            np.testing.assert_allclose(found[window, frame], x, atol=1e-9)
    assert hits > 2


def test_on_a_flat_surface_gradients_are_those_of_central_differences():
    """This holds nearly: nodes slide along a ball as large as a house, and their friction has no gradient."""
    chains, begun, thrown, colliders = behind("gradient", 30.0, np.eye(4)[None, :3])
    weights = torch.as_tensor(np.random.default_rng(3).normal(size=begun.shape))
    still = replace(driven(), bodies=np.broadcast_to(np.eye(4)[:3], driven().bodies.shape))

    def error(drag, colliders):
        return (trajectory(chains, still, begun, thrown, {"drag": drag}, colliders)[:, -1] * weights).sum()

    def slope(colliders):
        drag = torch.tensor(1.5, dtype=torch.float64, requires_grad=True)
        return float(torch.autograd.grad(error(drag, colliders), drag)[0])

    with torch.no_grad():
        above, below = (error(torch.tensor(1.5 + side * 1e-4), colliders) for side in (1, -1))
    expected = float(above - below) / 2e-4
    assert slope(colliders) == pytest.approx(expected, rel=0.2)
    assert slope(None) != pytest.approx(expected, rel=0.3)  # it matters that they touch


PARAMETERS = ("masses", "lengths", "rest_spans", "rest_directions", "balance")
CONSTANTS = ("drag", "air_drag", "air_lift", "lateral", "lateral_stretch", "shrink", "rest_angle")
DAMPING = ("parent_damping", "root_damping", "bend_damping", "lateral_damping", "wind")


@functools.cache
def gradients():
    """The derivative of an error of the trajectory for every parameter, and that error as a function of them."""
    chains, begun, thrown = started(slack=False)
    # away from the kinks where a rope becomes taut and a spring begins to push
    chains = replace(chains, lengths=1.004 * chains.lengths, rest_spans=1.05 * chains.rest_spans)
    weights = torch.as_tensor(np.random.default_rng(3).normal(size=begun.shape))
    owners = {name: chains if name in PARAMETERS else chains.constants for name in PARAMETERS + CONSTANTS + DAMPING}
    values = {
        name: torch.tensor(np.asarray(getattr(owner, name), np.float64), requires_grad=True)
        for name, owner in owners.items()
    }

    def error(given):
        return (trajectory(chains, driven(), begun, thrown, given)[:, -1] * weights).sum()

    found = torch.autograd.grad(error(values), list(values.values()))
    return values, dict(zip(values, found, strict=True)), error


@pytest.mark.parametrize("name", PARAMETERS + CONSTANTS + DAMPING)
def test_gradients_are_those_of_central_differences(name):
    values, found, error = gradients()
    direction = torch.as_tensor(np.random.default_rng(4).normal(size=values[name].shape))
    if name in ("masses", "lengths", "rest_spans"):
        direction = direction * values[name].detach()
    step = 1e-7 if name in PARAMETERS else 1e-6 * max(1.0, float(values[name].detach().abs().max()))
    with torch.no_grad():
        above, below = (error({name: values[name] + side * step * direction}) for side in (1, -1))
    along = float((found[name] * direction).sum())
    assert along == pytest.approx(float(above - below) / (2 * step), rel=2e-4, abs=1e-7)
    assert along != 0
