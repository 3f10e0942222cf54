"""Animators to run the laws on: small, with parameters drawn by chance instead of fitted."""

from dataclasses import replace
from functools import cache

import numpy as np

from hemline import bodies, garments
from hemline.animators import lag, swingar
from hemline.animators.agentdress.binding import Binding
from hemline.animators.agentdress.config import AgentDressConfig
from hemline.animators.agentdress.fit.regions import region_weights
from hemline.animators.agentdress.model import AnimatorAgentDress
from hemline.animators.agentdress.shape_samples import ShapeSamples
from hemline.animators.agentdress.sor.rigged_tables import RiggedTables
from hemline.animators.agentdress.sor.rigging import Rigging
from hemline.animators.agentdress.tables import Tables
from hemline.animators.coarse.features.columns import DYNAMIC, STATIC
from hemline.animators.coarse.model import CoarseAnimator
from hemline.animators.coarse.relatives import Relatives
from hemline.animators.coarse.wearable import CoarseWearable
from hemline.animators.coarse.weights import Weights
from hemline.animators.lag import LagConfig
from hemline.animators.lag.lag_net import LagNet, layer_sizes
from hemline.animators.lag.lag_network import LagNetwork
from hemline.animators.live import AnimatorLive, Live
from hemline.animators.ropes import AnimatorRopes, RopesConfig
from hemline.animators.ropes.bones.body_inputs import BODY_INPUT_COUNT
from hemline.animators.ropes.bones.bone_correction import BoneCorrection
from hemline.animators.ropes.layout.layout import build_ropes
from hemline.animators.skinned import AnimatorSkinned, Skinned
from hemline.animators.swingar import SwingarConfig
from hemline.animators.swingar.estimator_config import EstimatorConfig, weight_shapes
from hemline.animators.swingar.graph_inputs import STATE_FEATURES, VERTEX
from hemline.animators.swingar.graph_network import GraphNetwork
from hemline.animators.swingar.runtime import RuntimeEstimator
from hemline.bodies import ShapedBody
from hemline.garments import coarser_garment
from hemline.garments.garment import Garment
from hemline.learning.compensated_rounding import grid
from hemline.learning.mlp import Mlp
from hemline.learning.packed_basis import pack_basis
from hemline.motions import Motion, Pose
from hemline.motions.quaternions import from_axis_angle, multiply

ROWS, COLUMNS = 15, 20


@cache
def body() -> ShapedBody:
    return bodies.load("anny24").shaped()


@cache
def small_cape() -> Garment:
    """A cape of 300 vertices with four chains by hand."""
    chains = tuple(tuple(row * COLUMNS + column for row in range(1, ROWS, 3)) for column in (2, 7, 12, 17))
    return replace(garments.make_cape(body(), rows=ROWS, columns=COLUMNS), chains=chains)


def correction_of(ropes, random: np.random.Generator) -> BoneCorrection:
    """A correction of millimetres, by four directions of the bones and all that it sees of the body."""
    free = (ropes.parents >= 0).repeat(3)
    modes, outputs = (np.linalg.qr((free * random.normal(size=(4, len(free)))).T)[0].T for _ in range(2))
    matrix = 0.01 * random.normal(size=(4, 4 + BODY_INPUT_COUNT))
    far = np.full(BODY_INPUT_COUNT, 2.0)
    arrays = (np.ascontiguousarray(each, np.float32) for each in (modes, matrix, outputs, -far, far))
    return BoneCorrection(*arrays, swing_gain=1.125)


@cache
def ropes_model() -> AnimatorRopes:
    """Smooth bases and networks small enough that the cape stays a cape."""
    random = np.random.default_rng(0)
    garment = small_cape()
    ropes = build_ropes(garment, body())
    rows, inputs, modes = garment.vertices.size, 3 * ropes.node_count, 8
    smooth = np.cumsum(random.normal(size=(2 * modes, rows)), axis=1)
    basis = np.linalg.qr(smooth.T)[0].T.astype(np.float32)

    def network(outputs: int, size: float = 1.0) -> Mlp:
        sizes = ((16, inputs), (16, 16), (outputs, 16))
        weights = [random.normal(size=s) / np.sqrt(s[1]) for s in sizes]
        biases = [0.1 * random.normal(size=s[0]) for s in sizes]
        return Mlp.from_weights([*weights[:2], size * weights[2]], [*biases[:2], size * biases[2]])

    first, second = pack_basis(basis[:modes], np.ones(modes), extra=2), pack_basis(basis[modes:], np.ones(modes))
    return AnimatorRopes(
        garment,
        ropes,
        garment.vertices,
        first,
        second,
        network(modes),
        network(modes),
        correction_of(ropes, random),
        body_name=body().body.name,
        body_hash=body().body.hash,
        config=RopesConfig(components=modes),
        figures={"test_error_mm": 1.5},
        licences=("none",),
    )


@cache
def agentdress_model() -> AnimatorAgentDress:
    """A shirt of 630 vertices, five poses, three of them anchors; it grows as the skin under it does."""
    random = np.random.default_rng(2)
    garment, _ = coarser_garment(garments.load("tshirt-light"), 0.2)
    binding = Binding.of(garment.vertices, garment.faces, body().posed(body().rest_pose))
    regions = region_weights(binding).astype(np.float32)
    count, poses, modes = regions.shape[1], 5, 6
    rotations = np.repeat(body().rest_pose.rotations[None], poses, axis=0).astype(np.float64)
    rotations = multiply(rotations, from_axis_angle(0.3 * random.normal(size=(poses, 24, 3))))
    smooth = np.cumsum(random.normal(size=(modes, garment.vertices.size)), axis=1)
    pose_basis = np.linalg.qr(smooth.T)[0].T
    drawn = np.linalg.qr(np.cumsum(random.normal(size=(4, garment.vertices.size)), axis=1).T)[0].T
    grown = np.concatenate([body().body.shapedirs[:4, binding.nearest], 1e-3 * drawn.reshape(4, -1, 3)])
    digits = random.integers(-127, 128, (count, 7, 4))
    sizes = random.uniform(0.2, 1, (count, 7)).astype(np.float16)
    steps = random.uniform(1e-4, 2e-4, (count, 4)).astype(np.float32)
    tables = Tables(
        indices=binding.indices,
        weights=binding.weights,
        nearest=binding.nearest,
        regions=regions,
        axes=random.uniform(size=(count, 72)).astype(np.float32),
        rotations=rotations.astype(np.float32),
        rest=garment.vertices,
        rest_effects=grown.astype(np.float16).astype(np.float32),
        offset=np.full_like(garment.vertices, 1e-3),
        basis=pack_basis(np.concatenate([pose_basis, drawn]), np.full(modes + 4, 0.05), extra=3),
        pose_weights=(0.05 * random.normal(size=(count, poses, modes))).astype(np.float16).astype(np.float32),
        shapes=ShapeSamples(
            np.int32([0, 0, 1, 2, 2, 2, 2]),
            random.normal(size=(7, 5)).astype(np.float32),
            digits * grid(sizes, steps),
            np.diag(np.float32([1.5, 0.5, 1, 1, 1])),
            sizes=sizes,
            steps=steps,
        ),
    )
    return AnimatorAgentDress(
        garment,
        tables,
        body_name=body().body.name,
        body_hash=body().body.hash,
        config=AgentDressConfig(),
        width=1.5,
        shape_width=1.2,
        figures={"pose_left_out_mm": 1.5},
        licences=("none",),
    )


@cache
def rigged_model() -> AnimatorAgentDress:
    """The same with rigged anchors as its pose model: skinned shirts, their weights shaken."""
    random, model = np.random.default_rng(3), agentdress_model()
    tables, count = model.tables, 3
    binding = Binding(tables.indices, tables.weights, tables.nearest)
    rest = body().rest_pose
    posed = [body().posed(Pose(turned, rest.translation)) for turned in tables.rotations[:count]]
    worn = np.array([binding.skin(each.transforms, tables.rest, tables.offset) for each in posed])
    weights = binding.dense_weights() * random.uniform(0.5, 1.5, (count, 1, 24))
    rigging = Rigging(
        np.array([each.transforms for each in posed], np.float64), worn, weights / weights.sum(axis=2, keepdims=True)
    )
    return replace(
        model,
        tables=replace(tables, rigged=RiggedTables.pack(rigging, np.arange(count))),
        config=AgentDressConfig(pose_model="sor"),
    )


@cache
def live_model() -> AnimatorLive:
    """The small cape, simulated as it is."""
    return Live().animator_for(small_cape(), body())


@cache
def skinned_model() -> AnimatorSkinned:
    """The small cape, skinned."""
    return Skinned().animator_for(small_cape(), body())


def lag_weights(width: int = 16, seed: int = 3, beginning: float = 0.0) -> Weights:
    """Weights drawn by chance, so small that no vertex moves by more than some centimetres."""
    random, config = np.random.default_rng(seed), LagConfig(width=width, beginning=beginning)
    sizes = layer_sizes(STATIC.count + DYNAMIC.count, width)
    drawn = {name: random.normal(size=size).astype(np.float32) * (2 / size[0]) ** 0.5 for name, size in sizes.items()}
    drawn["fourth"] *= 0.02
    biases = {name: np.zeros(size[1], np.float32) for name, size in sizes.items()}
    known = Relatives(["a", "b"], random.normal(size=(2, 256)).astype(np.float32))
    network = LagNetwork(LagNet(drawn, biases))
    return Weights(lag.KIND, config, network, known, {"train_mm": 1.0}, ["a licence"]).as_stored()


@cache
def lag_model() -> CoarseAnimator:
    """The small cape, moved by weights that were drawn by chance."""
    return CoarseWearable(lag_weights()).animator_for(small_cape(), body())


@cache
def begun_model() -> CoarseAnimator:
    """The same, simulated for a fifth of a second first."""
    return CoarseWearable(lag_weights(beginning=0.2)).animator_for(small_cape(), body())


@cache
def swingar_model() -> CoarseAnimator:
    """The small cape, moved by a small estimator whose weights were drawn by chance."""
    random = np.random.default_rng(4)
    sizes = {"graph": 8, "motion": 8, "state": 8, "blend": 8, "blend_last": 8, "corrective": 8, "corrective_heads": 1}
    estimator = EstimatorConfig(**sizes, body=88, told=VERTEX.count, state_told=STATE_FEATURES, displacement=8)
    drawn = {name: 0.1 * random.normal(size=shape) for name, shape in weight_shapes(estimator).items()}
    drawn |= {
        "told_spread": np.ones(VERTEX.count),
        "blend_scale": np.full(1, 0.01),
        "corrective_scale": np.full(1, 0.01),
    }
    arrays = {name: each.astype(np.float32) for name, each in drawn.items()}
    network = GraphNetwork(RuntimeEstimator.of(estimator, arrays, "float32"))
    known = Relatives(["a", "b"], random.normal(size=(2, 256)).astype(np.float32))
    made = Weights(swingar.KIND, SwingarConfig(beginning=0.0), network, known, {}, ["a licence"])
    return CoarseWearable(made.as_stored()).animator_for(small_cape(), body())


ANIMATORS = {
    "agentdress": agentdress_model,
    "agentdress, rigged": rigged_model,
    "lag": lag_model,
    "lag, simulated first": begun_model,
    "live": live_model,
    "ropes": ropes_model,
    "skinned": skinned_model,
    "swingar": swingar_model,
}
"""Every animator; each runs through every law."""


def walk(frames: int = 40, fps: float = 30.0) -> Motion:
    """The body turns, bends and moves about."""
    t = np.arange(frames) / fps
    rest = body().rest_pose
    rotations = np.repeat(rest.rotations[None], frames, axis=0).astype(np.float64)
    for joint, axis, swing in ((0, 1, 0.6), (3, 0, 0.2), (12, 2, 0.3), (16, 0, 0.4)):
        half = 0.5 * swing * np.sin(4 * t + joint)
        turn = np.zeros((frames, 4))
        turn[:, 0], turn[:, 1 + axis] = np.cos(half), np.sin(half)
        rotations[:, joint] = multiply(turn, rotations[:, joint])
    travel = np.stack([0.3 * np.sin(2 * t), 0.05 * np.sin(7 * t), 0.8 * t], axis=1)
    return Motion(
        rotations.astype(np.float32),
        (rest.translation + travel).astype(np.float32),
        fps=fps,
        leg_length=body().leg_length,
    )


def turned_about_the_vertical(pose: Pose, angle: float, shift: np.ndarray) -> Pose:
    """The same pose elsewhere in the world."""
    turn = np.array([np.cos(angle / 2), 0, np.sin(angle / 2), 0])
    rotations = pose.rotations.astype(np.float64).copy()
    rotations[0] = multiply(turn, rotations[0])
    return Pose(rotations.astype(np.float32), (vertical(angle) @ pose.translation + shift).astype(np.float32))


def vertical(angle: float) -> np.ndarray:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])
