"""Objects of a scene: one with the settings, and below it garment and body, each with a point cache."""

import os
from pathlib import Path

import bpy
import numpy as np

from .mesh_files import read_obj, z_up
from .program import rate

PARTS = {"garment": (0.72, 0.23, 0.17), "body": (0.70, 0.68, 0.66)}
"""Names of the parts, and the colours of their first material (sRGB)."""
MODIFIER = "hemline"


def root_of(chosen):
    """Returns the object with the settings for itself or one of its parts; None for other objects."""
    while chosen is not None and not chosen.hemline.is_root:
        chosen = chosen.parent
    return chosen


def part_of(root, part: str):
    """Returns the garment or the body of an object, or None."""
    return next((child for child in root.children if child.hemline.part == part), None)


def show_part(root, part: str, path: Path, cache: Path, timing: dict) -> None:
    """Gives a part its mesh and its cache; an existing object keeps all other changes."""
    vertices, faces, notices = read_obj(path)
    found = part_of(root, part) or add_part(root, part)
    if found.data.shape_keys:
        found.shape_key_clear()
    mesh = found.data
    old = np.empty(3 * len(mesh.polygons), np.int32)
    if len(mesh.loops) == old.size:
        mesh.polygons.foreach_get("vertices", old)
    if len(mesh.vertices) != len(vertices) or not np.array_equal(old.reshape(-1, 3), faces):
        mesh.clear_geometry()
        mesh.from_pydata(vertices.tolist(), [], faces.tolist())
        mesh.shade_smooth()
    mesh.vertices.foreach_set("co", z_up(vertices).ravel())
    mesh.update()
    found["notices"] = notices
    set_cache(found, str(cache), timing)


def add_part(root, part: str):
    """Adds a part of an object, with a plain material."""
    mesh = bpy.data.meshes.new(f"{root.name} {part}")
    found = bpy.data.objects.new(mesh.name, mesh)
    for collection in root.users_collection:
        collection.objects.link(found)
    found.parent, found.hemline.part = root, part
    mesh.materials.append(plain_material(part))
    return found


def plain_material(part: str):
    """Returns the plain material of a part, which is made once per file."""
    name = f"hemline {part}"
    if name in bpy.data.materials:
        return bpy.data.materials[name]
    material = bpy.data.materials.new(name)
    linear = [((each + 0.055) / 1.055) ** 2.4 for each in PARTS[part]]
    material.diffuse_color = [*linear, 1.0]
    material.use_nodes = True
    for node in material.node_tree.nodes:
        if node.type == "BSDF_PRINCIPLED":
            node.inputs["Base Color"].default_value, node.inputs["Roughness"].default_value = [*linear, 1.0], 0.8
    return material


def set_cache(part, path: str, timing: dict) -> None:
    """Makes a part read a y-up cache, with its first modifier."""
    modifier = part.modifiers.get(MODIFIER) or part.modifiers.new(MODIFIER, "MESH_CACHE")
    part.modifiers.move(part.modifiers.find(MODIFIER), 0)
    modifier.cache_format, modifier.filepath = "PC2", path
    modifier.forward_axis, modifier.up_axis, modifier.interpolation = "POS_Z", "NEG_Y", "LINEAR"
    modifier.frame_scale, modifier.frame_start = timing["scale"], timing["start"]


def cache_timing(root, scene) -> dict:
    """Returns scale and start of the modifier: sample = `scale` x frame - `start`."""
    scale = (root.hemline.fps or rate(scene)) / rate(scene)
    return {"scale": scale, "start": scale * root.hemline.first_frame}


def move_start(settings, context) -> None:
    """Applies a change of the first frame, which does not require playing again."""
    root = settings.id_data
    for part in root.children:
        modifier = part.modifiers.get(MODIFIER)
        if modifier is not None:
            modifier.frame_start = cache_timing(root, context.scene)["start"]


def cache_of(root) -> str:
    """Returns the path of the garment's cache, or "" if it does not exist."""
    garment = part_of(root, "garment")
    modifier = garment.modifiers.get(MODIFIER) if garment else None
    path = bpy.path.abspath(modifier.filepath) if modifier else ""
    return path if os.path.isfile(path) else ""


def is_in_use(folder: Path) -> bool:
    """Whether some object, such as a copy of ours, reads a cache of a folder."""
    modifiers = (modifier for each in bpy.data.objects for modifier in each.modifiers if modifier.type == "MESH_CACHE")
    return any(Path(bpy.path.abspath(modifier.filepath)).resolve().parent == folder for modifier in modifiers)
