"""Reads the rig of a glTF file: its bones at rest, as the skins bind them, matched to the 24 joints."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hemline.arrays import Float
from hemline.errors import BadInput, BadMotion
from hemline.files.gltf import Gltf, read_gltf
from hemline.files.gltf_nodes import Nodes, read_nodes
from hemline.files.gltf_skins import bind_pose, skin_joints
from hemline.motions.bvh import BvhSkeleton

from .names import JointMatch, find_joints

LARGEST = 1e9
"""Limit of positions and scales of bones, in any unit."""

_BONES_MIN = 11
"""Least number of bones of a humanoid."""


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
    skins = skin_joints(gltf, len(nodes.names))
    with gltf.readable():
        humanoid = _humanoid(gltf, len(nodes.names))
    if skinned and not any(skins):
        cure = "skin its mesh to an armature with bones, and export it with its skin"
        raise error(f"{path} has no skin", f"{len(gltf.all('meshes'))} meshes without bones", cure)
    with gltf.readable(), np.errstate(all="ignore"):
        bound = bind_pose(gltf, nodes, skins)
        if not all((np.abs(each) < LARGEST).all() for each in (bound.nodes, *bound.skins)):
            raise ValueError("places")
    bones = _bones(gltf, nodes, skins, humanoid)
    count = len({joint for skin in skins for joint in skin}) if skinned else len(bones)
    if count < _BONES_MIN:
        cure = "a body needs hips, knees, ankles, shoulders, elbows, wrists, a spine and a head"
        raise error(f"{path} is no humanoid", f"{count} bones", cure)
    skeleton = _skeleton(nodes, bones, bound.nodes)
    at = {node: index for index, node in enumerate(bones)}
    try:
        mapped = None if humanoid is None else {name: at[node] for name, node in humanoid.items() if node in at}
        found = find_joints(skeleton, Path(path).name, mapped)
    except BadMotion as reason:
        cure = "name its bones as Mixamo, Blender, Unreal, SMPL or VRM do; its tree is not that of a person, either"
        raise error(f"no humanoid was found in {path}: {reason.what}", reason.got, cure) from reason
    return GltfRig(gltf, nodes, bones, skeleton, found, bound.nodes, bound.skins, bound.is_shown)


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
