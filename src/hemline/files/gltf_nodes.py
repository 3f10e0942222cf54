"""The nodes of a glTF file: their tree and their transforms."""

from dataclasses import dataclass

import numpy as np

from hemline.arrays import Float

from .gltf import Gltf

_NODES_MAX = 10_000


@dataclass(frozen=True, eq=False)
class Nodes:
    """The tree of nodes.

    Attributes:
        names: Name of each node; `node 3` for one without a name.
        parents: Parent of each node, -1 for a root.
        order: All nodes, parents before their children.
        translations: Position of each node relative to its parent [unit of the file].
        rotations: Rotation of each node, unit quaternions wxyz.
        scales: Scale of each node along its own axes [1].
    """

    names: tuple[str, ...]
    parents: tuple[int, ...]
    order: tuple[int, ...]
    translations: Float[np.ndarray, "nodes 3"]
    rotations: Float[np.ndarray, "nodes 4"]
    scales: Float[np.ndarray, "nodes 3"]

    @property
    def locals(self) -> Float[np.ndarray, "nodes 4 4"]:
        """Matrices from each node to its parent."""
        return matrices(self.translations, self.rotations, self.scales)

    def to_world(self, local: Float[np.ndarray, "... nodes 4 4"]) -> Float[np.ndarray, "... nodes 4 4"]:
        """Returns matrices from each node to the world, given those from each node to its parent."""
        world = np.array(local)
        for node in self.order:
            if self.parents[node] >= 0:
                world[..., node, :, :] = world[..., self.parents[node], :, :] @ local[..., node, :, :]
        return world


def read_nodes(gltf: Gltf) -> Nodes:
    """Reads the nodes of a file.

    Raises:
        BadInput: (as `gltf.error`) A node is its own ancestor or has two parents, a number is invalid, or there are
            more than 10,000 nodes.
    """
    with gltf.readable():
        entries = gltf.all("nodes")
        if len(entries) > _NODES_MAX:
            raise gltf.error(f"{gltf.path} may have {_NODES_MAX} nodes", len(entries), "export one object alone")
        parents = [-1] * len(entries)
        for node, entry in enumerate(entries):
            for child in entry.get("children", []):
                if not 0 <= child < len(entries) or parents[child] >= 0 or child == node:
                    raise ValueError("parents")
                parents[child] = node
        order = _parents_first(parents)
        parts = [_parts(entry) for entry in entries]
        moved, turned, scaled = (np.array([each[k] for each in parts]).reshape(len(entries), -1) for k in range(3))
        names = tuple(str(entry.get("name") or f"node {node}") for node, entry in enumerate(entries))
        return Nodes(names, tuple(parents), order, moved.reshape(-1, 3), turned.reshape(-1, 4), scaled.reshape(-1, 3))


def matrices(
    translations: Float[np.ndarray, "... 3"], rotations: Float[np.ndarray, "... 4"], scales: Float[np.ndarray, "... 3"]
) -> Float[np.ndarray, "... 4 4"]:
    """Returns matrices that act on columns from translation, rotation (unit quaternions wxyz) and scale [1]."""
    w, x, y, z = np.moveaxis(rotations, -1, 0)
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    result = np.zeros((*np.shape(w), 4, 4))
    result[..., :3, :3] = np.stack([np.stack(row, -1) for row in rows], -2) * scales[..., None, :]
    result[..., :3, 3] = translations
    result[..., 3, 3] = 1
    return result


def _parts(entry: dict) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Returns translation, rotation wxyz and scale of one node."""
    if "matrix" in entry:
        moved, turned, scaled = decompose(np.array(entry["matrix"], np.float64).reshape(4, 4).T)
    else:
        moved = np.array(entry.get("translation", [0, 0, 0]), np.float64)
        turned = np.array(entry.get("rotation", [0, 0, 0, 1]), np.float64)[[3, 0, 1, 2]]
        scaled = np.array(entry.get("scale", [1, 1, 1]), np.float64)
    length = np.linalg.norm(turned)
    if moved.shape != (3,) or scaled.shape != (3,) or not (np.isfinite([*moved, *scaled]).all() and length > 1e-6):
        raise ValueError("numbers")
    return moved, turned / length, scaled


def decompose(matrix: Float[np.ndarray, "4 4"]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Returns translation, rotation (wxyz) and scale of a matrix without shear."""
    from scipy.spatial.transform import Rotation

    scale = np.linalg.norm(matrix[:3, :3], axis=0)
    scale[0] *= np.sign(np.linalg.det(matrix[:3, :3])) or 1
    if not np.isfinite(scale).all() or (np.abs(scale) < 1e-12).any():
        raise ValueError("scale")
    return matrix[:3, 3], Rotation.from_matrix(matrix[:3, :3] / scale).as_quat()[[3, 0, 1, 2]], scale


def _parents_first(parents: list[int]) -> tuple[int, ...]:
    """Returns the nodes with parents before children, roots in their order."""
    children: dict[int, list[int]] = {}
    for node, parent in enumerate(parents):
        children.setdefault(parent, []).append(node)
    order, stack = [], children.get(-1, [])[::-1]
    while stack:
        node = stack.pop()
        order.append(node)
        stack += children.get(node, [])[::-1]
    if len(order) != len(parents):
        raise ValueError("a circle of parents")
    return tuple(order)
