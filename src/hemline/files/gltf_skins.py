"""The skins of a glTF file: where they put their vertices when the bones are in the pose that they were bound in."""

from dataclasses import dataclass

import numpy as np

from hemline.arrays import Float

from .gltf import Gltf
from .gltf_nodes import Nodes, decompose

_BONES_MAX, _SKINS_BONES_MAX = 2_000, 50_000
"""Largest number of bones of a skin, and of all skins together."""
_BLOCK_SIZE = 500_000
"""Number of points that are compared at once."""
_BIND_TOLERANCE = 1e-3
"""Bones in the bind pose move their skin by less than this, as a fraction of its size."""


@dataclass(frozen=True, eq=False)
class BindPose:
    """The pose that the skins of a file were bound in.

    Attributes:
        nodes: Transform of each node to the world in that pose.
        skins: Transform of the vertices of each skin to the world in that pose.
        is_shown: Whether the file's nodes are in that pose; otherwise they are in another one.
    """

    nodes: Float[np.ndarray, "nodes 4 4"]
    skins: tuple[Float[np.ndarray, "4 4"], ...]
    is_shown: bool


def skin_joints(gltf: Gltf, count: int) -> list[list[int]]:
    """Returns the nodes that are the bones of each skin.

    Args:
        gltf: The file.
        count: Number of its nodes.

    Raises:
        BadInput: (as `gltf.error`) A bone is no node, or there are more than 2,000 in a skin or 50,000 in all.
    """
    with gltf.readable():
        skins = [[int(joint) for joint in skin["joints"]] for skin in gltf.all("skins")]
        if any(not 0 <= joint < count for skin in skins for joint in skin):
            raise ValueError("joints")
    most = max(map(len, skins), default=0)
    if most > _BONES_MAX or sum(map(len, skins)) > _SKINS_BONES_MAX:
        what = f"a skin of {gltf.path} may have {_BONES_MAX} bones, all together {_SKINS_BONES_MAX}"
        raise gltf.error(what, max(most, sum(map(len, skins))), "export the bones of the body alone")
    return skins


def bind_pose(gltf: Gltf, nodes: Nodes, skins: list[list[int]]) -> BindPose:
    r"""Finds the pose that the skins of a file were bound in.

    If the file shows it, the vertices of a skin are at $G_j B_j v$ with the same $G_j B_j$ for all bones ($G_j$ from
    node to world, $B_j$ the inverse bind matrix). Otherwise the file shows another pose, and the bind pose is recovered
    up to scale and the nearest quarter turns.

    Args:
        gltf: The file.
        nodes: Its nodes.
        skins: The bones of each skin, see `skin_joints`.

    Raises:
        BadInput: (as `gltf.error`) A bind matrix is missing, NaN, or cannot be inverted.
    """
    local = nodes.locals
    world = nodes.to_world(local)
    # a skin without bind matrices tells nothing of its bind pose: the nodes are all that is known
    pairs = zip(gltf.all("skins"), skins, strict=True)
    skins = [bones if "inverseBindMatrices" in skin else [] for skin, bones in pairs]
    if not any(skins):
        return BindPose(world, (np.eye(4),) * len(skins), True)
    binds = [_binds(gltf, skin, len(joints)) for skin, joints in zip(gltf.all("skins"), skins, strict=True)]
    rest, known, places, shown = world.copy(), np.zeros(len(world), bool), [np.eye(4)] * len(skins), True
    for number in sorted(range(len(skins)), key=lambda each: -len(skins[each])):
        joints, bind = np.array(skins[number], int), binds[number]
        if not len(joints):
            continue
        moved = world[joints] @ bind
        shared = np.flatnonzero(known[joints])
        if _agree(moved, np.linalg.inv(bind)) and (shown or not len(shared)):
            places[number] = moved[0]
        elif len(shared):
            places[number] = rest[joints[shared[0]]] @ bind[shared[0]]
        else:
            places[number], shown = _upright(moved[0]), False
        fresh = joints[~known[joints]]
        rest[fresh] = places[number] @ np.linalg.inv(bind)[~known[joints]]
        known[joints] = True
    for node in nodes.order:
        parent = nodes.parents[node]
        if not known[node] and parent >= 0 and not shown:
            rest[node] = rest[parent] @ local[node]
    return BindPose(rest, tuple(places), shown)


def _agree(moved: np.ndarray, joints: np.ndarray) -> bool:
    """Whether all bones move the joints' positions to the same points."""
    points = np.concatenate([joints[:, :, 3], np.array([[0.0, 0, 0, 1]])])
    size = np.ptp(points[:, :3] @ moved[0, :3, :3].T, axis=0).max()
    apart, some = moved - moved[:1], max(_BLOCK_SIZE // len(points), 1)
    blocks = (apart[start : start + some] for start in range(0, len(apart), some))
    return max(np.abs(np.einsum("jrc,pc->jpr", block, points)).max() for block in blocks) <= _BIND_TOLERANCE * max(
        size, 1e-12
    )


def _binds(gltf: Gltf, skin: dict, count: int) -> np.ndarray:
    """Returns the inverse bind matrices, which act on columns."""
    if "inverseBindMatrices" not in skin:
        return np.tile(np.eye(4), (count, 1, 1))
    binds = gltf.array(skin["inverseBindMatrices"]).astype(np.float64).reshape(-1, 4, 4).swapaxes(1, 2)[:count]
    wrong = len(binds) < count or not np.isfinite(binds).all() or (np.abs(np.linalg.det(binds)) < 1e-30).any()
    if wrong:
        what = f"the bind matrices of a skin of {gltf.path} must be invertible, one a bone"
        raise gltf.error(what, f"{len(binds)} for {count} bones", "reset the bind pose, and export it again")
    return binds


def _upright(matrix: np.ndarray) -> np.ndarray:
    """Returns the scale of a transform, with the quarter turns that are nearest to its rotation."""
    from scipy.spatial.transform import Rotation

    _, turned, scale = decompose(matrix)
    rotation, axes, free = Rotation.from_quat(turned[[1, 2, 3, 0]]).as_matrix(), np.zeros((3, 3)), [0, 1, 2]
    for row in np.argsort(-np.abs(rotation).max(axis=1)):
        best = max(free, key=lambda column, at=row: abs(rotation[at, column]))
        axes[row, best] = np.sign(rotation[row, best]) or 1
        free.remove(best)
    if np.linalg.det(axes) < 0:
        axes = np.eye(3)
    result = np.eye(4)
    result[:3, :3] = axes * np.abs(scale).mean()
    return result
