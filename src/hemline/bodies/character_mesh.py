"""The skinned meshes of a glTF file at rest, joined, with the joints of ours that move their vertices."""

from dataclasses import dataclass

import numpy as np

from hemline.arrays import Float, Int
from hemline.errors import BadBody
from hemline.files.gltf import Gltf
from hemline.motions import JOINT_NAMES
from hemline.motions.gltf_rig import GltfRig

_AGAIN = "normalise the weights, and export it again"
_VERTICES_MAX = 2_000_000


@dataclass(frozen=True, eq=False)
class CharacterMesh:
    """Triangles of all skinned meshes of a file.

    Attributes:
        vertices: Where they are at rest, in the world of the file [file's unit].
        faces: Triangles.
        weights: Share of each of our joints.
        parts: Of each triangle, the number of the mesh that it is of.
        names: Names of the meshes, with that of the material.
        notes: What was odd, one sentence each.
    """

    vertices: Float[np.ndarray, "verts 3"]
    faces: Int[np.ndarray, "faces 3"]
    weights: Float[np.ndarray, "verts joints"]
    parts: Int[np.ndarray, " faces"]
    names: tuple[str, ...]
    notes: tuple[str, ...]

    def only(self, parts: Int[np.ndarray, " parts"]) -> "CharacterMesh":
        """Some of its meshes."""
        kept = np.isin(self.parts, parts)
        return CharacterMesh(self.vertices, self.faces[kept], self.weights, self.parts[kept], self.names, self.notes)


def read_character_mesh(rig: GltfRig, owners: Int[np.ndarray, " nodes"]) -> CharacterMesh:
    """All skinned triangles of a file.

    Args:
        rig: The rig.
        owners: Which of our joints each node of the file goes with.

    Raises:
        BadBody: Weights that are NaN, negative or of no bone, positions that are NaN, no triangles, or too many.
    """
    gltf, pieces, names, notes = rig.gltf, [], [], []
    with gltf.readable():
        for node, said in enumerate(gltf.all("nodes")):
            if "mesh" not in said or "skin" not in said:
                continue
            mesh, skin = gltf.all("meshes")[said["mesh"]], gltf.all("skins")[said["skin"]]
            joints = owners[np.array(skin["joints"], int)]
            for primitive in mesh["primitives"]:
                name = _name(gltf, rig.nodes.names[node], mesh, primitive)
                piece = _piece(rig, primitive, said["skin"], joints, name)
                if piece is None:
                    notes.append(f"'{name}' has no triangles and is left out")
                    continue
                names.append(name)
                pieces.append(piece)
    if not pieces:
        cure = "skin its mesh to the armature, and export it with its skin"
        raise BadBody(f"{gltf.path} has no triangles that bones move", "none", cure)
    first = np.cumsum([0] + [len(piece[0]) for piece in pieces])
    if first[-1] > _VERTICES_MAX:
        raise BadBody(f"{gltf.path} has too many vertices", int(first[-1]), f"reduce it to {_VERTICES_MAX} or less")
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


def _name(gltf: Gltf, node: str, mesh: dict, primitive: dict) -> str:
    name = str(mesh.get("name") or node)
    if "material" in primitive and len(mesh["primitives"]) > 1:
        material = gltf.all("materials")[primitive["material"]].get("name")
        return f"{name} / {material}" if material else name
    return name


def _piece(
    rig: GltfRig, primitive: dict, skin: int, joints: np.ndarray, name: str
) -> tuple[np.ndarray, np.ndarray, np.ndarray] | None:
    """Vertices at rest, triangles and weights of one primitive, vertices that no triangle has left out."""
    gltf, attributes = rig.gltf, primitive["attributes"]
    points = gltf.array(attributes["POSITION"]).astype(np.float64)
    if points.ndim != 2 or points.shape[1] != 3:
        raise ValueError("POSITION")
    indices = gltf.array(primitive["indices"]).astype(np.int64) if "indices" in primitive else np.arange(len(points))
    faces = _triangles(indices, primitive.get("mode", 4))
    if not len(faces) or "JOINTS_0" not in attributes:
        return None
    if faces.max() >= len(points):
        raise ValueError("indices")
    used, faces = np.unique(faces, return_inverse=True)
    faces, points = faces.reshape(-1, 3), points[used]
    if not np.isfinite(points).all():
        raise BadBody(f"{gltf.path}: '{name}' must have finite positions", "NaN or infinity", "export it again")
    weights = np.zeros((len(points), len(JOINT_NAMES)))
    for number in range(len(attributes)):
        if f"JOINTS_{number}" not in attributes:
            break
        bones = gltf.array(attributes[f"JOINTS_{number}"])[used].astype(np.int64)
        shares = gltf.array(attributes[f"WEIGHTS_{number}"])[used].astype(np.float64)
        if bones.shape != shares.shape:
            raise ValueError("WEIGHTS")
        if not np.isfinite(shares).all():
            raise BadBody(f"{gltf.path}: weights of '{name}' must be finite", "NaN or infinity", _AGAIN)
        if shares.min() < -1e-3:
            raise BadBody(f"{gltf.path}: weights of '{name}' must not be negative", f"{shares.min():.3g}", _AGAIN)
        bones = np.where(shares > 0, bones, 0)
        if bones.max() >= len(joints):
            got = f"bone {bones.max()} of {len(joints)}"
            raise BadBody(f"{gltf.path}: a weight of '{name}' is of no bone of its skin", got, "export it again")
        np.add.at(weights, (np.arange(len(points))[:, None], joints[bones]), np.maximum(shares, 0))
    place = rig.skins[skin]
    if np.linalg.det(place[:3, :3]) < 0:
        faces = faces[:, [0, 2, 1]]
    return points @ place[:3, :3].T + place[:3, 3], faces, weights


def _triangles(indices: np.ndarray, mode: int) -> np.ndarray:
    """Triangles of a list, a strip or a fan."""
    if mode == 4:
        return indices[: len(indices) // 3 * 3].reshape(-1, 3)
    if mode in (5, 6) and len(indices) >= 3:
        first = indices[:-2] if mode == 5 else np.full(len(indices) - 2, indices[0])
        faces = np.stack([first, indices[1:-1], indices[2:]], 1)
        if mode == 5:
            faces[1::2] = faces[1::2][:, [1, 0, 2]]
        return faces[(faces != np.roll(faces, 1, axis=1)).all(axis=1)]
    return np.zeros((0, 3), np.int64)


def _whole(weights: np.ndarray, places: np.ndarray) -> tuple[np.ndarray, tuple[str, ...]]:
    """Weights that sum to 1; a vertex without any takes those of the nearest one that has some."""
    from scipy.spatial import KDTree

    sums = weights.sum(axis=1)
    bare = sums < 1e-6
    if bare.all():
        raise BadBody("a character must have weights", "none above 0", "skin it to its bones, and export it again")
    notes = []
    if bare.any():
        nearest = np.flatnonzero(~bare)[KDTree(places[~bare]).query(places[bare])[1]]
        weights[bare] = weights[nearest]
        notes.append(f"{bare.sum()} vertices without weights follow the nearest one that has some")
    off = np.abs(sums[~bare] - 1) > 0.01
    if off.any():
        notes.append(f"the weights of {off.sum()} vertices did not sum to 1: normalised")
    return weights / weights.sum(axis=1, keepdims=True), tuple(notes)
