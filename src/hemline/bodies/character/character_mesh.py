"""Reads the skinned meshes of a glTF file at rest and joins them, with weights of the 24 joints."""

from dataclasses import dataclass

import numpy as np

from hemline.arrays import Float, Int
from hemline.errors import BadBody
from hemline.files.gltf import Gltf
from hemline.files.gltf_triangles import PRIMITIVES_MAX, triangles
from hemline.motions import JOINT_NAMES
from hemline.motions.rigs.gltf_rig import GltfRig

_EXPORT_CURE = "normalise the weights, and export it again"
_VERTICES_MAX = 2_000_000
_LARGEST = 1e9
_VERTEX_BYTES = 8
"""Least number of bytes of a skinned vertex in a file: of its position, bones and weights."""


@dataclass(frozen=True, eq=False)
class CharacterMesh:
    """Triangles of all skinned meshes of a file.

    Attributes:
        vertices: Positions at rest, in the world of the file [file's unit].
        faces: Triangles.
        weights: Weight of each of the 24 joints.
        parts: Number of the mesh that each triangle belongs to.
        names: Names of the meshes, with those of their materials.
        notes: What is odd about them, one sentence each.
    """

    vertices: Float[np.ndarray, "verts 3"]
    faces: Int[np.ndarray, "faces 3"]
    weights: Float[np.ndarray, "verts joints"]
    parts: Int[np.ndarray, " faces"]
    names: tuple[str, ...]
    notes: tuple[str, ...]

    def only(self, parts: Int[np.ndarray, " parts"]) -> "CharacterMesh":
        """Returns some of the meshes."""
        kept = np.isin(self.parts, parts)
        return CharacterMesh(self.vertices, self.faces[kept], self.weights, self.parts[kept], self.names, self.notes)


def read_character_mesh(rig: GltfRig, owners: Int[np.ndarray, " nodes"]) -> CharacterMesh:
    """Reads all skinned triangles of a file.

    Args:
        rig: The rig.
        owners: Joint that each node of the file follows.

    Raises:
        BadBody: Weights are NaN, negative or of no bone, positions are NaN, or there are no triangles, or too many.
    """
    gltf, pieces, names, notes = rig.gltf, [], [], []
    count = SizeBudget(gltf)
    with gltf.readable(), np.errstate(all="ignore"):
        for node, node_entry in enumerate(gltf.all("nodes")):
            if "mesh" not in node_entry or "skin" not in node_entry:
                continue
            mesh, skin = gltf.all("meshes")[node_entry["mesh"]], gltf.all("skins")[node_entry["skin"]]
            joints = owners[np.array(skin["joints"], int)]
            for primitive in mesh["primitives"]:
                name = _name(gltf, rig.nodes.names[node], mesh, primitive)
                piece = _piece(rig, primitive, node_entry["skin"], joints, name, count)
                if piece is None:
                    notes.append(f"'{name}' has no triangles and is left out")
                    continue
                names.append(name)
                pieces.append(piece)
    if not pieces:
        cure = "skin its mesh to the armature, and export it with its skin"
        raise BadBody(f"{gltf.path} has no triangles that bones move", "none", cure)
    first = np.cumsum([0] + [len(piece[0]) for piece in pieces])
    weights, note = _whole(
        np.concatenate([piece[2] for piece in pieces]), np.concatenate([piece[0] for piece in pieces])
    )
    return CharacterMesh(
        np.concatenate([piece[0] for piece in pieces]),
        np.concatenate([piece[1] + start for piece, start in zip(pieces, first, strict=False)]),
        weights,
        np.repeat(np.arange(len(pieces)), [len(piece[1]) for piece in pieces]),
        tuple(names),
        tuple(notes) + note,
    )


class SizeBudget:
    """Counts what was read of a file, and refuses more than a file of its size can rightly hold."""

    def __init__(self, gltf: Gltf) -> None:
        self.gltf, self.primitives, self.corners, self.vertices = gltf, 0, 0, 0

    def triangles(self, primitive: dict) -> np.ndarray:
        """Returns the triangles of a primitive, and counts them."""
        self.primitives += 1
        if self.primitives > PRIMITIVES_MAX:
            raise BadBody(f"{self.gltf.path} may have {PRIMITIVES_MAX} meshes", "more", "join them")
        faces = triangles(self.gltf, primitive)
        self.corners += faces.size
        self.gltf.refuse_more(self.corners)
        return faces

    def compact(self, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Returns the vertices that triangles use, and the triangles in terms of these; counts the vertices."""
        used, faces = np.unique(faces, return_inverse=True)
        self.vertices += len(used)
        if self.vertices > _VERTICES_MAX:
            cure = f"reduce it to {_VERTICES_MAX} or less"
            raise BadBody(f"{self.gltf.path} has too many vertices", self.vertices, cure)
        self.gltf.refuse_more(_VERTEX_BYTES * self.vertices)
        return used, faces.reshape(-1, 3)


def _name(gltf: Gltf, node: str, mesh: dict, primitive: dict) -> str:
    name = str(mesh.get("name") or node)
    if "material" in primitive and len(mesh["primitives"]) > 1:
        material = gltf.all("materials")[primitive["material"]].get("name")
        return f"{name} / {material}" if material else name
    return name


def _piece(
    rig: GltfRig, primitive: dict, skin: int, joints: np.ndarray, name: str, count: SizeBudget
) -> tuple[np.ndarray, np.ndarray, np.ndarray] | None:
    """Returns vertices at rest, triangles and weights of a primitive, without vertices that no triangle uses."""
    gltf, attributes = rig.gltf, primitive["attributes"]
    faces = count.triangles(primitive)
    points = gltf.array(attributes["POSITION"])
    if points.ndim != 2 or points.shape[1] != 3:
        raise ValueError("POSITION")
    if not len(faces) or "JOINTS_0" not in attributes:
        return None
    used, faces = count.compact(faces)
    points = points[used].astype(np.float64)
    if not np.isfinite(points).all():
        raise BadBody(f"{gltf.path}: '{name}' must have finite positions", "NaN or infinity", "export it again")
    weights = np.zeros((len(points), len(JOINT_NAMES)))
    for number in range(len(attributes)):
        if f"JOINTS_{number}" not in attributes:
            break
        bones = gltf.array(attributes[f"JOINTS_{number}"])
        if bones.dtype.kind != "u":
            raise ValueError("JOINTS")
        bones = bones[used].astype(np.int64)
        shares = gltf.array(attributes[f"WEIGHTS_{number}"])[used].astype(np.float64)
        if bones.shape != shares.shape:
            raise ValueError("WEIGHTS")
        if not np.isfinite(shares).all():
            raise BadBody(f"{gltf.path}: weights of '{name}' must be finite", "NaN or infinity", _EXPORT_CURE)
        if shares.min() < -1e-3:
            raise BadBody(f"{gltf.path}: weights of '{name}' must not be negative", f"{shares.min():.3g}", _EXPORT_CURE)
        bones = np.where(shares > 0, bones, 0)
        if bones.max() >= len(joints):
            got = f"bone {bones.max()} of {len(joints)}"
            raise BadBody(f"{gltf.path}: a weight of '{name}' is of no bone of its skin", got, "export it again")
        np.add.at(weights, (np.arange(len(points))[:, None], joints[bones]), np.maximum(shares, 0))
    place = rig.skins[skin]
    if np.linalg.det(place[:3, :3]) < 0:
        faces = faces[:, [0, 2, 1]]
    points = points @ place[:3, :3].T + place[:3, 3]
    if not (np.abs(points) < _LARGEST).all():
        raise BadBody(f"{gltf.path}: '{name}' must lie within {_LARGEST:g} of its units", "more", "export it again")
    return points, faces, weights


def _whole(weights: np.ndarray, places: np.ndarray) -> tuple[np.ndarray, tuple[str, ...]]:
    """Scales weights to sum to 1; a vertex without any takes those of the nearest vertex that has some."""
    from scipy.spatial import KDTree

    sums = weights.sum(axis=1)
    bare = sums < 1e-6
    if bare.all():
        raise BadBody("a character must have weights", "none above 0", "skin it to its bones, and export it again")
    notes = []
    if bare.any():
        # only the first of several vertices at one place, since the tree would search through all of them
        there, first = np.unique(places[~bare], axis=0, return_index=True)
        nearest = np.flatnonzero(~bare)[first[KDTree(there).query(places[bare])[1]]]
        weights[bare] = weights[nearest]
        notes.append(f"{bare.sum()} vertices without weights follow the nearest one that has some")
    off = np.abs(sums[~bare] - 1) > 0.01
    if off.any():
        notes.append(f"the weights of {off.sum()} vertices did not sum to 1: normalised")
    return weights / weights.sum(axis=1, keepdims=True), tuple(notes)
