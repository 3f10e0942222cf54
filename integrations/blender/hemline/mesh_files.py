"""Files that hemline and the extension exchange: meshes, garments and point caches."""

import json
from pathlib import Path

import bpy
import numpy as np

from .refused import Refused

PINNED = 0.5
"""Weight in a vertex group above which a vertex is pinned."""


def z_up(vertices: np.ndarray) -> np.ndarray:
    """Converts vertices from y up to Blender's axes."""
    return np.stack([vertices[..., 0], -vertices[..., 2], vertices[..., 1]], axis=-1)


def y_up(vertices: np.ndarray) -> np.ndarray:
    """Converts vertices from Blender's axes to y up."""
    return np.stack([vertices[..., 0], vertices[..., 2], -vertices[..., 1]], axis=-1)


def write_garment(chosen, folder: Path, context) -> Path:
    """Writes a mesh of the scene as a garment for hemline.

    Args:
        chosen: The object. Its modifiers are applied, and its vertex group `hemline.pins` holds the pins.
        folder: Folder of the files.
        context: The context, for scene and depsgraph.

    Returns:
        An OBJ, y up, in metres of the world; with pins a TOML that names their vertices in this OBJ.

    Raises:
        Refused: The object is no mesh, or its pins are no vertex group or have no vertices.
    """
    if chosen.type != "MESH":
        raise Refused(f"the garment must be a mesh; got '{chosen.name}', a {chosen.type.lower()}; choose one")
    evaluated = chosen.evaluated_get(context.evaluated_depsgraph_get())
    mesh, matrix = evaluated.to_mesh(), np.array(evaluated.matrix_world)
    try:
        places = y_up(positions(mesh) @ matrix[:3, :3].T + matrix[:3, 3]) * context.scene.unit_settings.scale_length
        lines = [f"v {x:.6f} {y:.6f} {z:.6f}\n" for x, y, z in places]
        lines += ["f " + " ".join(str(vertex + 1) for vertex in face.vertices) + "\n" for face in mesh.polygons]
        pins = find_pins(chosen, mesh) if chosen.hemline.pins else None
    finally:
        evaluated.to_mesh_clear()
    path = folder / f"{bpy.path.clean_name(chosen.name)}.obj"
    path.write_text("".join(lines), encoding="utf-8")
    if pins is None:
        return path
    table = path.with_suffix(".toml")
    content = f'mesh = {json.dumps(path.name, ensure_ascii=False)}\nup = "y"\npins = {json.dumps(pins)}\n'
    table.write_text(content, encoding="utf-8")
    return table


def find_pins(chosen, mesh) -> list[int]:
    """Returns the vertices of an evaluated mesh whose weight in the group of the pins is above `PINNED`.

    Raises:
        Refused: There is no such group, or no such vertex.
    """
    name, groups = chosen.hemline.pins, chosen.vertex_groups
    if name not in groups:
        has = ", ".join(group.name for group in groups) or "no vertex groups"
        raise Refused(f"the pins must be a vertex group of '{chosen.name}'; got '{name}', it has {has}; choose one")
    index = groups[name].index
    pins = [
        vertex.index
        for vertex in mesh.vertices
        if any(each.group == index and each.weight > PINNED for each in vertex.groups)
    ]
    if not pins:
        raise Refused(f"the pins must have vertices; got none above {PINNED} in '{name}'; give them weight 1")
    return pins


def positions(mesh) -> np.ndarray:
    """Returns the vertices (verts, 3) of a mesh in its own axes."""
    places = np.empty(3 * len(mesh.vertices), np.float32)
    mesh.vertices.foreach_get("co", places)
    return places.reshape(-1, 3)


def read_obj(path: Path) -> tuple[np.ndarray, np.ndarray, str]:
    """Reads vertices (verts, 3) [m], y up, triangles (faces, 3), and notices of an OBJ that hemline wrote."""
    lines = path.read_text(encoding="utf-8").splitlines()
    vertices = np.array([line.split()[1:4] for line in lines if line.startswith("v ")], np.float32)
    faces = np.array([line.split()[1:4] for line in lines if line.startswith("f ")], np.int32) - 1
    return vertices, faces, "\n".join(line[2:] for line in lines if line.startswith("# "))


def read_frames(path: str) -> np.ndarray:
    """Reads vertices (frames, verts, 3) of a PC2 file, in Blender's axes [m]."""
    header = np.fromfile(path, np.dtype("<i4"), 8)
    points, frames = int(header[4]), int(header[7])
    return z_up(np.memmap(path, np.dtype("<f4"), "r", 32, (frames, points, 3)))


def read_garment(path: Path) -> dict[str, np.ndarray]:
    """Reads `vertices` [m], y up, `faces` and `pin_vertices` of a garment file (safetensors) that hemline wrote."""
    content = path.read_bytes()
    size = int.from_bytes(content[:8], "little")
    header, kinds = json.loads(content[8 : 8 + size]), {"F32": "<f4", "I32": "<i4"}
    arrays = {}
    for name in ("vertices", "faces", "pin_vertices"):
        about, (begin, end) = header[name], header[name]["data_offsets"]
        array = np.frombuffer(content[8 + size + begin : 8 + size + end], kinds[about["dtype"]])
        arrays[name] = array.reshape(about["shape"])
    return arrays
