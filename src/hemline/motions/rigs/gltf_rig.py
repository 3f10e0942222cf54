"""Reads the rig of a glTF file: its bones at rest, as the skins bind them, matched to the 24 joints."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hemline.arrays import Float
from hemline.errors import BadInput, BadMotion
from hemline.files.gltf import Gltf, read_gltf
from hemline.files.gltf_nodes import Nodes, decompose, read_nodes
from hemline.motions.bvh import BvhSkeleton
from hemline.motions.quaternions import to_matrix

from .names import JointMatch, find_joints

LARGEST = 1e9
"""Limit of positions and scales of bones, in any unit."""

_BONES_MIN = 11
"""Least number of bones of a humanoid."""
_BONES_MAX, _SKINS_BONES_MAX = 2_000, 50_000
"""Largest number of bones of a skin, and of all skins together."""
_BLOCK_SIZE = 500_000
"""Number of points that are compared at once."""
_BIND_TOLERANCE = 1e-3
"""Bones in the bind pose move their skin by less than this, as a fraction of its size."""


@dataclass(frozen=True, eq=False)
class GltfRig:
    """A rig at rest, matched to the 24 joints.

    Attributes:
        gltf: The file.
        nodes: Tree of the file's nodes.
        bones: The node of each joint of the skeleton, parents before their children.
        skeleton: The bones along the axes of the file's world; their zero pose is the rest pose [file's unit].
        match: Bones of the joints, as indices into the skeleton.
        rest: Transform of each node to the world at rest.
        skins: Transform of the vertices of each skin to the world at rest.
        in_bind_pose: Whether the file's nodes are in the bind pose of the skins; otherwise they are in another pose.
    """

    gltf: Gltf
    nodes: Nodes
    bones: tuple[int, ...]
    skeleton: BvhSkeleton
    match: JointMatch
    rest: Float[np.ndarray, "nodes 4 4"]
    skins: tuple[Float[np.ndarray, "4 4"], ...]
    in_bind_pose: bool

    @property
    def skin_bones(self) -> set[int]:
        """Nodes of the bones that skins name."""
        return {int(joint) for skin in self.gltf.all("skins") for joint in skin["joints"]}

    @property
    def how(self) -> str:
        """A sentence that says how the joints were found."""
        return f"joints found by {self.match.how or 'the names of the bones'}"


def read_rig(path: str | Path, *, error: type[BadInput], skinned: bool) -> GltfRig:
    """Reads the rig of a GLB, VRM or glTF file.

    Args:
        path: The file.
        error: Class of the errors that are raised.
        skinned: Whether the file must have a skin; otherwise the pose of the nodes is the rest pose if there is none.

    Raises:
        BadInput: (as `error`) The file is damaged, has no skin or too few bones, or is not a humanoid.
    """
    gltf = read_gltf(path, error=error)
    nodes = read_nodes(gltf)
    with gltf.readable():
        skins = [[int(joint) for joint in skin["joints"]] for skin in gltf.all("skins")]
        if any(not 0 <= joint < len(nodes.names) for skin in skins for joint in skin):
            raise ValueError("joints")
        most = max(map(len, skins), default=0)
        if most > _BONES_MAX or sum(map(len, skins)) > _SKINS_BONES_MAX:
            what = f"a skin of {path} may have {_BONES_MAX} bones, all together {_SKINS_BONES_MAX}"
            raise error(what, max(most, sum(map(len, skins))), "export the bones of the body alone")
        humanoid = _humanoid(gltf, len(nodes.names))
    if skinned and not any(skins):
        cure = "skin its mesh to an armature with bones, and export it with its skin"
        raise error(f"{path} has no skin", f"{len(gltf.all('meshes'))} meshes without bones", cure)
    with gltf.readable(), np.errstate(all="ignore"):
        rest, binds, bound = _rest(gltf, nodes, skins)
        if not all((np.abs(each) < LARGEST).all() for each in (rest, *binds)):
            raise ValueError("places")
    bones = _bones(gltf, nodes, skins, humanoid)
    count = len({joint for skin in skins for joint in skin}) if skinned else len(bones)
    if count < _BONES_MIN:
        cure = "a body needs hips, knees, ankles, shoulders, elbows, wrists, a spine and a head"
        raise error(f"{path} is no humanoid", f"{count} bones", cure)
    skeleton = _skeleton(nodes, bones, rest)
    at = {node: index for index, node in enumerate(bones)}
    try:
        mapped = None if humanoid is None else {name: at[node] for name, node in humanoid.items() if node in at}
        found = find_joints(skeleton, Path(path).name, mapped)
    except BadMotion as reason:
        cure = "name its bones as Mixamo, Blender, Unreal, SMPL or VRM do; its tree is not that of a person, either"
        raise error(f"no humanoid was found in {path}: {reason.what}", reason.got, cure) from reason
    return GltfRig(gltf, nodes, bones, skeleton, found, rest, binds, bound)


def _humanoid(gltf: Gltf, count: int) -> Mapping[str, int] | None:
    """Returns the node of each of VRM's bones, by the map in VRM 1.0, VRM 0.x and VRM animations."""
    entries: dict[str, int] | None = None
    for name in ("VRMC_vrm", "VRMC_vrm_animation"):
        if name in gltf.extensions:
            entries = {bone: each["node"] for bone, each in gltf.extensions[name]["humanoid"]["humanBones"].items()}
    if entries is None and "VRM" in gltf.extensions:
        entries = {each["bone"]: each["node"] for each in gltf.extensions["VRM"]["humanoid"]["humanBones"]}
    if entries is not None and any(not 0 <= node < count for node in entries.values()):
        raise ValueError("humanBones")
    return entries


def _rest(gltf: Gltf, nodes: Nodes, skins: list[list[int]]) -> tuple[np.ndarray, tuple[np.ndarray, ...], bool]:
    r"""Returns transforms of nodes and of skins to the world at rest, and whether the file is in its bind pose.

    If it is, the vertices of a skin are at $G_j B_j v$ with the same $G_j B_j$ for all bones ($G_j$ from node to
    world, $B_j$ the inverse bind matrix). Otherwise the file is in another pose, and the rest pose is recovered up to
    scale and the nearest quarter turns.
    """
    local = nodes.locals
    world = nodes.to_world(local)
    if not any(skins):
        return world, (), True
    binds = [_binds(gltf, skin, len(joints)) for skin, joints in zip(gltf.all("skins"), skins, strict=True)]
    rest, known, places, bound = world.copy(), np.zeros(len(world), bool), [np.eye(4)] * len(skins), True
    for number in sorted(range(len(skins)), key=lambda each: -len(skins[each])):
        joints, bind = np.array(skins[number], int), binds[number]
        if not len(joints):
            continue
        moved = world[joints] @ bind
        shared = np.flatnonzero(known[joints])
        if _agree(moved, np.linalg.inv(bind)) and (bound or not len(shared)):
            places[number] = moved[0]
        elif len(shared):
            places[number] = rest[joints[shared[0]]] @ bind[shared[0]]
        else:
            places[number], bound = _upright(moved[0]), False
        fresh = joints[~known[joints]]
        rest[fresh] = places[number] @ np.linalg.inv(bind)[~known[joints]]
        known[joints] = True
    for node in nodes.order:
        parent = nodes.parents[node]
        if not known[node] and parent >= 0 and not bound:
            rest[node] = rest[parent] @ local[node]
    return rest, tuple(places), bound


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
    _, turned, scale = decompose(matrix)
    rotation, axes, free = to_matrix(turned), np.zeros((3, 3)), [0, 1, 2]
    for row in np.argsort(-np.abs(rotation).max(axis=1)):
        best = max(free, key=lambda column, at=row: abs(rotation[at, column]))
        axes[row, best] = np.sign(rotation[row, best]) or 1
        free.remove(best)
    if np.linalg.det(axes) < 0:
        axes = np.eye(3)
    result = np.eye(4)
    result[:3, :3] = axes * np.abs(scale).mean()
    return result


def _bones(gltf: Gltf, nodes: Nodes, skins: list[list[int]], humanoid: Mapping[str, int] | None) -> tuple[int, ...]:
    """Returns the nodes that are bones: those of skins and of the map, and the nodes between, above and below them."""
    named = {joint for skin in skins for joint in skin} | set((humanoid or {}).values())
    shown = {node for node, entries in enumerate(gltf.all("nodes")) if "mesh" in entries or "camera" in entries}
    kept = set(named or (set(range(len(nodes.names))) - shown))
    for node in named:
        above = nodes.parents[node]
        while above >= 0 and above not in kept:
            kept.add(above)
            above = nodes.parents[above]
    under = set(named)
    for node in nodes.order:
        parent = nodes.parents[node]
        if parent in under:
            under.add(node)
        if named and parent in kept and node not in shown and node in under:
            kept.add(node)
    return tuple(node for node in nodes.order if node in kept)


def _skeleton(nodes: Nodes, bones: tuple[int, ...], rest: np.ndarray) -> BvhSkeleton:
    at = {node: index for index, node in enumerate(bones)}
    parents = [at.get(nodes.parents[node], -1) for node in bones]
    places = rest[list(bones)][:, :3, 3]
    first = parents.index(-1)  # further trees are joined to the root of the first one
    parents = [first if parent < 0 and index != first else parent for index, parent in enumerate(parents)]
    above = np.array([places[parent] if parent >= 0 else np.zeros(3) for parent in parents])
    names = tuple(nodes.names[node] for node in bones)
    return BvhSkeleton(names, tuple(parents), places - above, {}, tuple(() for _ in bones))
