"""Plays SCENE (npz, see `scene.py`) with Blender's cloth modifier in Blender's Python, and writes OUT (npz).

Blender's cloth has no units: gravity is 0.00981 m per unit of time squared, so a unit is 1 / sqrt(1000) s. All vertices
have one mass, and all springs have one stiffness, divided by their mean length. `springs` converts it to newtons.
"""

# bpy is installed in a separate environment
# pyright: reportMissingImports=false, reportArgumentType=false

import json
import os
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

MASS_SCALE = 1000.0
"""Factor from kilograms to Blender's mass, as Blender's numbers lose digits below a gram."""


def main(scene_path: str, out: str, options: str) -> None:
    choices = json.loads(options)
    if choices["threads"] == 1:
        os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    import bpy

    with np.load(scene_path) as arrays:
        scene = dict(arrays)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    with tempfile.TemporaryDirectory() as folder:
        cloth = build_scene(bpy, scene, choices, Path(folder))
        frames, ms = play_frames(bpy, cloth, len(scene["pinned"]))
        cloth.modifiers["cloth"].show_viewport = False
        _, ms_without = play_frames(bpy, cloth, len(scene["pinned"]))
    np.savez(out, frames=frames, ms=np.array(ms), ms_without=np.array(ms_without))


def build_scene(bpy, scene: dict, choices: dict, folder: Path):
    """Makes the collider and the cloth as objects."""
    frames, fps = len(scene["pinned"]), float(scene["fps"])
    world = bpy.context.scene
    world.render.fps, world.render.fps_base = round(fps), round(fps) / fps
    world.frame_start, world.frame_end = 1, frames
    world.gravity = tuple(scene["gravity"])
    if len(scene["body_faces"]):
        body = make_object(bpy, "body", scene["body"][0], scene["body_faces"])
        add_cache(body, scene["body"], folder / "body.mdd", fps)
        body.modifiers.new("collision", "COLLISION")
        body.collision.thickness_outer = 0.001
        body.collision.cloth_friction = min(80.0, 100 * float(scene["friction"]))
    cloth = make_object(bpy, "cloth", scene["vertices"], scene["faces"])
    targets = np.repeat(scene["vertices"][None], frames, axis=0)
    targets[:, scene["pins"]] = scene["pinned"]
    cloth.shape_key_add(name="Basis")
    cloth.shape_key_add(name="rest").data.foreach_set("co", scene["rest_vertices"].astype(np.float32).ravel())
    add_cache(cloth, targets, folder / "cloth.mdd", fps)
    group = cloth.vertex_groups.new(name="pins")
    group.add(scene["pins"].tolist(), 1.0, "REPLACE")
    set_up(cloth, scene, choices)
    return cloth


def set_up(cloth, scene: dict, choices: dict) -> None:
    """Sets the options of the cloth modifier."""
    modifier = cloth.modifiers.new("cloth", "CLOTH")
    settings, contact = modifier.settings, modifier.collision_settings
    frames = len(scene["pinned"])
    modifier.point_cache.frame_start, modifier.point_cache.frame_end = 1, frames
    length, stiffness = springs(scene)
    settings.quality = choices["quality"]
    settings.time_scale = np.sqrt(1000.0) / float(scene["fps"])
    settings.mass = MASS_SCALE * float(scene["mass"].mean())
    settings.air_damping = choices["air_damping"]
    settings.rest_shape_key = cloth.data.shape_keys.key_blocks["rest"]
    settings.bending_model = "ANGULAR"
    for name in ("tension", "compression"):
        setattr(settings, f"{name}_stiffness_max", MASS_SCALE * stiffness * length / 1000)
        setattr(settings, f"{name}_stiffness", MASS_SCALE * stiffness * length / 1000)
        setattr(settings, f"{name}_damping", choices["damping"])
    settings.shear_stiffness, settings.shear_damping = 0.0, 0.0
    settings.bending_stiffness, settings.bending_damping = MASS_SCALE * hinges(scene) / 1000, 0.0
    if len(scene["pins"]):
        settings.vertex_group_mass, settings.pin_stiffness = "pins", 50.0
    contact.use_collision = bool(len(scene["body_faces"]))
    contact.collision_quality = choices["collision_quality"]
    # the distances of cloth and collider (1 mm) are added
    contact.distance_min = max(0.001, float(scene["thickness"]) - 0.001)
    contact.use_self_collision = choices["self_thickness"] > 0
    contact.self_distance_min = max(0.001, choices["self_thickness"])
    contact.self_friction = 100 * float(scene["friction"])


def springs(scene: dict) -> tuple[float, float]:
    """Returns the mean length of the edges [m], and the stiffness of springs that gives the sheet its modulus [N/m].

    A net of equal springs k with edges equally distributed over all directions has Young's modulus
    k sum(length^2) / (3 area) and Poisson's ratio 1/3.
    """
    faces, rest = scene["faces"], scene["rest_vertices"]
    pairs = np.unique(np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1), axis=0)
    length = np.linalg.norm(rest[pairs[:, 0]] - rest[pairs[:, 1]], axis=1)
    sides = rest[faces[:, 1:]] - rest[faces[:, :1]]
    area = 0.5 * np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1).sum()
    return float(length.mean()), float(3 * scene["young"] * area / (length**2).sum())


def hinges(scene: dict) -> float:
    """Returns the stiffness of Blender's angular springs [N/m].

    Blender pushes the vertex opposite an edge of length L with 0.1 k L per radian, at a height h above that edge; the
    moment of hemline is bending L / h per radian.
    """
    rest, faces = scene["rest_vertices"], scene["faces"]
    sides = rest[faces[:, [1, 2, 0]]] - rest[faces]
    length = np.linalg.norm(sides, axis=-1)
    height = np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1)[:, None] / length
    return float(10 * scene["bending"] * (length / height**2).mean() / length.mean())


def make_object(bpy, name: str, vertices: np.ndarray, faces: np.ndarray):
    """Makes a mesh as an object of the scene."""
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(vertices.tolist(), [], faces.tolist())
    new_object = bpy.data.objects.new(name, mesh)
    bpy.context.collection.objects.link(new_object)
    return new_object


def add_cache(moved, frames: np.ndarray, path: Path, fps: float) -> None:
    """Animates the vertices of an object by an MDD file."""
    with path.open("wb") as stream:
        np.array([len(frames), frames.shape[1]], ">i4").tofile(stream)
        (np.arange(len(frames)) / fps).astype(">f4").tofile(stream)
        frames.astype(">f4").tofile(stream)
    cache = moved.modifiers.new("cache", "MESH_CACHE")
    cache.cache_format, cache.filepath = "MDD", str(path)
    cache.frame_start, cache.interpolation = 1, "NONE"
    cache.forward_axis, cache.up_axis = "POS_Y", "POS_Z"


def play_frames(bpy, cloth, frames: int) -> tuple[np.ndarray, list[float]]:
    """Returns the positions and the time [ms] of each frame."""
    positions, ms = [], []
    for frame in range(1, frames + 1):
        began = time.perf_counter()
        bpy.context.scene.frame_set(frame)
        evaluated = cloth.evaluated_get(bpy.context.evaluated_depsgraph_get())
        local = np.empty(3 * len(evaluated.data.vertices), np.float32)
        evaluated.data.vertices.foreach_get("co", local)
        ms.append(1000 * (time.perf_counter() - began))
        positions.append(local.reshape(-1, 3))
    return np.array(positions), ms


main(*sys.argv[1:])
