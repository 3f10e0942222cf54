"""The rig of a glTF file: its bones at rest, as the skins bind them, and which of them is which of ours."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hemline.arrays import Float
from hemline.errors import BadInput, BadMotion
from hemline.files.gltf import Gltf, read_gltf
from hemline.files.gltf_nodes import Nodes, decomposed, read_nodes
from hemline.motions.bvh import Skeleton
from hemline.motions.quaternions import to_matrix

from .names import Found, find_joints

LARGEST = 1e9
"""Places of bones are below it, in any unit, and so are their scales."""

_FEWEST = 11
"""Bones of a humanoid, at least."""
_BONES_MAX, _SKINS_BONES_MAX = 2_000, 50_000
"""Bones of a skin, and those of all skins together, at most."""
_COMPARED = 500_000
"""Places that are compared at once."""
_AGREE = 1e-3
"""Bones that move their skin by so much, as a share of its size, are not where the skin was bound."""


@dataclass(frozen=True, eq=False)
class GltfRig:
    """A rig at rest.

    Attributes:
        gltf: The file.
        nodes: Its tree.
        bones: The node of each joint of the skeleton, parents before their children.
        skeleton: The bones, their zero pose the rest pose, along the axes of the file's world [file's unit].
        found: Which bone is which joint, as indices into the skeleton.
        rest: From each node to the world at rest.
        skins: From the vertices of each skin to the world at rest.
        bound: Whether the file's nodes stand as the skins are bound; otherwise they are posed.
    """

    gltf: Gltf
    nodes: Nodes
    bones: tuple[int, ...]
    skeleton: Skeleton
    found: Found
    rest: Float[np.ndarray, "nodes 4 4"]
    skins: tuple[Float[np.ndarray, "4 4"], ...]
    bound: bool

    @property
    def bound_bones(self) -> set[int]:
        """Nodes of bones that a skin names."""
        return {int(joint) for skin in self.gltf.all("skins") for joint in skin["joints"]}

    @property
    def how(self) -> str:
        """How the joints were found, in a sentence."""
        return f"joints found by {self.found.how or 'the names of the bones'}"


def read_rig(path: str | Path, *, error: type[BadInput], skinned: bool) -> GltfRig:
    """The rig of a GLB, VRM or glTF file.

    Args:
        path: The file.
        error: What is raised where it cannot be read, or is no humanoid.
        skinned: Whether it must have a skin; otherwise the nodes as they stand will do.

    Raises:
        BadInput: (as `error`) Damaged, without a skin, too few bones, or no humanoid.
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
    if count < _FEWEST:
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
    """The node of each of VRM's bones, by the map that VRM 1.0, VRM 0.x and VRM animations hold."""
    said: dict[str, int] | None = None
    for name in ("VRMC_vrm", "VRMC_vrm_animation"):
        if name in gltf.extensions:
            said = {bone: each["node"] for bone, each in gltf.extensions[name]["humanoid"]["humanBones"].items()}
    if said is None and "VRM" in gltf.extensions:
        said = {each["bone"]: each["node"] for each in gltf.extensions["VRM"]["humanoid"]["humanBones"]}
    if said is not None and any(not 0 <= node < count for node in said.values()):
        raise ValueError("humanBones")
    return said


def _rest(gltf: Gltf, nodes: Nodes, skins: list[list[int]]) -> tuple[np.ndarray, tuple[np.ndarray, ...], bool]:
    r"""Where nodes are at rest, what takes each skin's vertices there, and whether the nodes stand so by themselves.

    A skin's vertices are at $G_j B_j v$ where all bones stand as they were bound ($G_j$ from node to world, $B_j$ the
    inverse bind matrix), with the same $G_j B_j$ for all. Otherwise the file shows a pose: the rest is put where it is
    up to scale and the nearest quarter turns.
    """
    local = nodes.locals
    world = nodes.placed(local)
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
    """Whether all bones take the places of the joints to the same points."""
    points = np.concatenate([joints[:, :, 3], np.array([[0.0, 0, 0, 1]])])
    size = np.ptp(points[:, :3] @ moved[0, :3, :3].T, axis=0).max()
    apart, some = moved - moved[:1], max(_COMPARED // len(points), 1)
    blocks = (apart[start : start + some] for start in range(0, len(apart), some))
    return max(np.abs(np.einsum("jrc,pc->jpr", block, points)).max() for block in blocks) <= _AGREE * max(size, 1e-12)


def _binds(gltf: Gltf, skin: dict, count: int) -> np.ndarray:
    """Inverse bind matrices that act on columns."""
    if "inverseBindMatrices" not in skin:
        return np.tile(np.eye(4), (count, 1, 1))
    binds = gltf.array(skin["inverseBindMatrices"]).astype(np.float64).reshape(-1, 4, 4).swapaxes(1, 2)[:count]
    wrong = len(binds) < count or not np.isfinite(binds).all() or (np.abs(np.linalg.det(binds)) < 1e-30).any()
    if wrong:
        what = f"the bind matrices of a skin of {gltf.path} must be invertible, one a bone"
        raise gltf.error(what, f"{len(binds)} for {count} bones", "reset the bind pose, and export it again")
    return binds


def _upright(matrix: np.ndarray) -> np.ndarray:
    """Its scale, and the quarter turns that are nearest to its rotation."""
    _, turned, scale = decomposed(matrix)
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
    """The nodes that are bones: those of skins and of the map, what is between and above them, and what hangs below."""
    named = {joint for skin in skins for joint in skin} | set((humanoid or {}).values())
    shown = {node for node, said in enumerate(gltf.all("nodes")) if "mesh" in said or "camera" in said}
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


def _skeleton(nodes: Nodes, bones: tuple[int, ...], rest: np.ndarray) -> Skeleton:
    at = {node: index for index, node in enumerate(bones)}
    parents = [at.get(nodes.parents[node], -1) for node in bones]
    places = rest[list(bones)][:, :3, 3]
    first = parents.index(-1)  # of several trees, the others are joined to the first one's root
    parents = [first if parent < 0 and index != first else parent for index, parent in enumerate(parents)]
    above = np.array([places[parent] if parent >= 0 else np.zeros(3) for parent in parents])
    names = tuple(nodes.names[node] for node in bones)
    return Skeleton(names, tuple(parents), places - above, {}, tuple(() for _ in bones))
