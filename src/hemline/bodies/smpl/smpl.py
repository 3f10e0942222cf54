"""Reads SMPL, SMPL-H and SMPL-X files, without executing anything in them."""

from pathlib import Path

import numpy as np
from jaxtyping import Float, Int

from hemline.bodies.body import Body
from hemline.bodies.model import INFLUENCES
from hemline.errors import BadBody
from hemline.files import Unreadable, npz_arrays, read_bytes
from hemline.motions import JOINT_NAMES

from .smpl_checks import CURE, check_shapes, check_values
from .smpl_families import FAMILIES, Family
from .smpl_holes import close_holes
from .smpl_pickle import read_pickled_arrays
from .smpl_stand_ins import Refused

_NEEDED = ("v_template", "shapedirs", "weights", "kintree_table", "f", "J_regressor")
_BYTES_MAX = 2**30
_BETAS_MAX = 16
_FIRST_BETAS, _EXPRESSION_FROM = 10, 400
"""SMPL-X files hold 300 coefficients of shape and 100 of expression, or 10 of each; those of shape come first."""


def read_smpl(path: str | Path) -> Body:
    r"""Reads an SMPL, SMPL-H or SMPL-X model as a body of 24 joints.

    This is kept:

    - Joints 0..21 are those of the file. The face belongs to the head; of SMPL-H and SMPL-X the thumb belongs to the
      wrist, the other fingers to the hand, which turns about the middle finger's first joint. Where fingers and
      face are at rest, the mesh is that of the whole model.
    - At most the first 16 shape coefficients, the first 10 of older SMPL-X files; none of the expression.
    - The pelvis lies at the origin in every shape: vertices and joints are moved together.
    - Pose-dependent offsets of joints 1..23; those of fingers and face are dropped.
    - The mesh, followed by triangles that close its holes (the eye sockets of SMPL-X), since only a closed surface has
      an inside.
    - The 6 largest weights of a vertex, scaled to sum to 1. A vertex that more joints move is misplaced by its dropped
      weight times the distance between the points to which the dropped and the kept joints move it.

    Args:
        path: A `.pkl` or `.npz` file, whose stem becomes the body's name. A pickle is not executed: everything in it
            but arrays, sparse matrices and chumpy variables is refused.

    Raises:
        BadBody: The file is missing, damaged or of another kind, its arrays contradict each other, or it is a pickle
            with other content than arrays.

    Source: Loper et al., "SMPL: A skinned multi-person linear model", 2015; Romero et al., "Embodied hands: Modeling
        and capturing hands and bodies together", 2017 (SMPL-H); Pavlakos et al., "Expressive body capture: 3D hands,
        face, and body from a single image", 2019 (SMPL-X).
        Differs: see above.
    """
    path = Path(path)
    arrays = _arrays(path, read_bytes(path, _BYTES_MAX, error=BadBody, cure=CURE))
    family = check_shapes(path, arrays)
    check_values(path, arrays, family)
    return _reduce(path.stem, arrays, family)


def _arrays(path: Path, content: bytes) -> dict[str, np.ndarray]:
    """Returns the arrays of the model, as they are in the file."""
    reader, wanted = (
        (read_pickled_arrays, "a pickle") if path.suffix.lower() == ".pkl" else (npz_arrays, "a zip archive")
    )
    zipped = content[:4] == b"PK\x03\x04"
    if not content or zipped != (reader is npz_arrays):
        got = "a zip archive" if zipped else "no zip archive" if content else "an empty file"
        raise BadBody(f"{path} must be {wanted}, as its ending says", got, CURE)
    try:
        arrays = reader(content, (*_NEEDED, "posedirs"))
    except (Refused, Unreadable) as reason:
        raise BadBody(f"{path} is not read", reason, CURE) from reason
    if missing := [name for name in _NEEDED if name not in arrays]:
        raise BadBody(f"{path} lacks arrays of an SMPL model", ", ".join(missing), CURE)
    return arrays


def _reduce(name: str, arrays: dict[str, np.ndarray], family: Family) -> Body:
    """Makes a body of 24 joints."""
    template = arrays["v_template"].astype(np.float64)
    shapedirs = arrays["shapedirs"][:, :, : _shape_count(arrays["shapedirs"], family)].astype(np.float64)
    shapedirs = np.moveaxis(shapedirs, 2, 0)
    regressor = arrays["J_regressor"][list(family.pivots)].astype(np.float64)
    joints = np.einsum("jv,vc->jc", regressor, template)
    joint_shapedirs = np.einsum("jv,bvc->bjc", regressor, shapedirs)
    indices, weights = _largest_weights(arrays["weights"], family)
    return Body(
        name=name,
        template=template - joints[0],
        faces=close_holes(arrays["f"].astype(np.int64)),
        shapedirs=shapedirs - joint_shapedirs[:, :1],
        joints=joints - joints[0],
        joint_shapedirs=joint_shapedirs - joint_shapedirs[:, :1],
        weight_indices=indices,
        weights=weights,
        parents=np.array((-1, *FAMILIES[len(JOINT_NAMES)].parents[1:])),
        rest_offsets=np.tile([1.0, 0, 0, 0], (len(JOINT_NAMES), 1)),
        licence=family.licence,
        posedirs=_select_posedirs(arrays["posedirs"], family) if "posedirs" in arrays else None,
    )


def _shape_count(shapedirs: np.ndarray, family: Family) -> int:
    """Returns the number of shape coefficients that are kept."""
    count = shapedirs.shape[2]
    few = family.name == "SMPL-X" and count < _EXPRESSION_FROM
    return min(count, _FIRST_BETAS if few else _BETAS_MAX)


def _largest_weights(
    weights: Float[np.ndarray, "verts joints"], family: Family
) -> tuple[Int[np.ndarray, "verts influences"], Float[np.ndarray, "verts influences"]]:
    """Returns the `INFLUENCES` largest weights after merging joints, strongest first, scaled to sum to 1."""
    dense = np.zeros((len(weights), len(JOINT_NAMES)))
    for joint, merged in enumerate(family.reduced):
        dense[:, merged] += np.maximum(weights[:, joint], 0)
    order = np.argsort(-dense, axis=1, kind="stable")[:, :INFLUENCES]
    largest = np.take_along_axis(dense, order, axis=1)
    return np.where(largest > 0, order, 0), largest / largest.sum(axis=1, keepdims=True)


def _select_posedirs(posedirs: np.ndarray, family: Family) -> Float[np.ndarray, "features verts 3"]:
    """Returns offsets by the rotations of joints 1..23, nine for each; those of hands made of fingers are zero."""
    kept = [joint for joint, pivot in enumerate(family.pivots) if joint and joint == pivot]
    by_joint = np.zeros((len(JOINT_NAMES) - 1, 9, len(posedirs), 3), np.float32)
    for joint in kept:
        by_joint[joint - 1] = np.moveaxis(posedirs[:, :, 9 * joint - 9 : 9 * joint], 2, 0)
    return by_joint.reshape(-1, len(posedirs), 3)
