"""Runs inside Blender's Python: the cloth of SCENE (npz, see `scene.py`) by Blender's cloth modifier, to OUT (npz).

Blender's cloth has no units: gravity is 0.00981 m per unit of time squared, so that a unit is 1 / sqrt(1000) s; mass is
one number for all vertices, stiffness one for all springs, divided by their mean length. What a number means in newtons
is in `springs`.
"""

# bpy is in an environment of its own
# pyright: reportMissingImports=false, reportArgumentType=false

import json
import os
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

MASS_SCALE = 1000.0
"""Blender's kilograms in ours: the numbers of its sliders lose digits below a gram."""


def main(scene_path: str, out: str, options: str) -> None:
    asked = json.loads(options)
    if asked["threads"] == 1:
        os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    import bpy

    with np.load(scene_path) as arrays:
        scene = dict(arrays)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    with tempfile.TemporaryDirectory() as folder:
        cloth = built(bpy, scene, asked, Path(folder))
        frames, ms = played(bpy, cloth, len(scene["pinned"]))
        cloth.modifiers["cloth"].show_viewport = False
        _, ms_without = played(bpy, cloth, len(scene["pinned"]))
    np.savez(out, frames=frames, ms=np.array(ms), ms_without=np.array(ms_without))


def built(bpy, scene: dict, asked: dict, folder: Path):
    """Collider and cloth, as objects."""
    frames, fps = len(scene["pinned"]), float(scene["fps"])
    world = bpy.context.scene
    world.render.fps, world.render.fps_base = round(fps), round(fps) / fps
    world.frame_start, world.frame_end = 1, frames
    world.gravity = tuple(scene["gravity"])
    if len(scene["body_faces"]):
        body = made(bpy, "body", scene["body"][0], scene["body_faces"])
        animated(body, scene["body"], folder / "body.mdd", fps)
        body.modifiers.new("collision", "COLLISION")
        body.collision.thickness_outer = 0.001
        body.collision.cloth_friction = min(80.0, 100 * float(scene["friction"]))
    cloth = made(bpy, "cloth", scene["vertices"], scene["faces"])
    targets = np.repeat(scene["vertices"][None], frames, axis=0)
    targets[:, scene["pins"]] = scene["pinned"]
    cloth.shape_key_add(name="Basis")
    cloth.shape_key_add(name="rest").data.foreach_set("co", scene["rest_vertices"].astype(np.float32).ravel())
    animated(cloth, targets, folder / "cloth.mdd", fps)
    group = cloth.vertex_groups.new(name="pins")
    group.add(scene["pins"].tolist(), 1.0, "REPLACE")
    set_up(cloth, scene, asked)
    return cloth


def set_up(cloth, scene: dict, asked: dict) -> None:
    """The cloth modifier's numbers."""
    modifier = cloth.modifiers.new("cloth", "CLOTH")
    settings, contact = modifier.settings, modifier.collision_settings
    frames = len(scene["pinned"])
    modifier.point_cache.frame_start, modifier.point_cache.frame_end = 1, frames
    length, stiffness = springs(scene)
    settings.quality = asked["quality"]
    settings.time_scale = np.sqrt(1000.0) / float(scene["fps"])
    settings.mass = MASS_SCALE * float(scene["mass"].mean())
    settings.air_damping = asked["air_damping"]
    settings.rest_shape_key = cloth.data.shape_keys.key_blocks["rest"]
    settings.bending_model = "ANGULAR"
    for name in ("tension", "compression"):
        setattr(settings, f"{name}_stiffness_max", MASS_SCALE * stiffness * length / 1000)
        setattr(settings, f"{name}_stiffness", MASS_SCALE * stiffness * length / 1000)
        setattr(settings, f"{name}_damping", asked["damping"])
    settings.shear_stiffness, settings.shear_damping = 0.0, 0.0
    settings.bending_stiffness, settings.bending_damping = MASS_SCALE * hinges(scene) / 1000, 0.0
    if len(scene["pins"]):
        settings.vertex_group_mass, settings.pin_stiffness = "pins", 50.0
    contact.use_collision = bool(len(scene["body_faces"]))
    contact.collision_quality = asked["collision_quality"]
    # distances of the cloth and of the collider (1 mm) add up
    contact.distance_min = max(0.001, float(scene["thickness"]) - 0.001)
    contact.use_self_collision = asked["self_thickness"] > 0
    contact.self_distance_min = max(0.001, asked["self_thickness"])
    contact.self_friction = 100 * float(scene["friction"])


def springs(scene: dict) -> tuple[float, float]:
    """Mean length of the edges [m], and the stiffness [N/m] of each as a spring that gives the sheet its modulus.

    A net of equal springs k with edges in all directions alike has Young's modulus k sum(length^2) / (3 area) and
    Poisson's ratio 1/3.
    """
    faces, rest = scene["faces"], scene["rest_vertices"]
    pairs = np.unique(np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1), axis=0)
    length = np.linalg.norm(rest[pairs[:, 0]] - rest[pairs[:, 1]], axis=1)
    sides = rest[faces[:, 1:]] - rest[faces[:, :1]]
    area = 0.5 * np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1).sum()
    return float(length.mean()), float(3 * scene["young"] * area / (length**2).sum())


def hinges(scene: dict) -> float:
    """Stiffness of Blender's angular springs [N/m].

    Blender pushes the vertex across an edge of length L with 0.1 k L per radian, at a height h above that edge; our
    moment there is bending L / h per radian.
    """
    rest, faces = scene["rest_vertices"], scene["faces"]
    sides = rest[faces[:, [1, 2, 0]]] - rest[faces]
    length = np.linalg.norm(sides, axis=-1)
    height = np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1)[:, None] / length
    return float(10 * scene["bending"] * (length / height**2).mean() / length.mean())


def made(bpy, name: str, vertices: np.ndarray, faces: np.ndarray):
    """A mesh as an object of the scene."""
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(vertices.tolist(), [], faces.tolist())
    made_object = bpy.data.objects.new(name, mesh)
    bpy.context.collection.objects.link(made_object)
    return made_object


def animated(moved, frames: np.ndarray, path: Path, fps: float) -> None:
    """Let an object's vertices follow frames, by an MDD file."""
    with path.open("wb") as stream:
        np.array([len(frames), frames.shape[1]], ">i4").tofile(stream)
        (np.arange(len(frames)) / fps).astype(">f4").tofile(stream)
        frames.astype(">f4").tofile(stream)
    cache = moved.modifiers.new("cache", "MESH_CACHE")
    cache.cache_format, cache.filepath = "MDD", str(path)
    cache.frame_start, cache.interpolation = 1, "NONE"
    cache.forward_axis, cache.up_axis = "POS_Y", "POS_Z"


def played(bpy, cloth, frames: int) -> tuple[np.ndarray, list[float]]:
    """Positions in each frame, and milliseconds it took."""
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
