"""Runs inside Blender: open FILE, play FRAMES frames at FPS, write each mesh's vertices in the world to OUT (npz)."""

# bpy is in an environment of its own
# pyright: reportMissingImports=false, reportArgumentType=false

import sys

import bpy
import numpy as np


def opened(path: str) -> None:
    ending = path.rsplit(".", 1)[1]
    if ending == "glb":
        bpy.ops.import_scene.gltf(filepath=path)
    elif ending == "usdc":
        bpy.ops.wm.usd_import(filepath=path)
    elif ending == "obj":
        bpy.ops.wm.obj_import(filepath=path)
    else:
        bpy.ops.wm.obj_import(filepath=path[: -len(ending)] + "obj")
        cache = bpy.context.selected_objects[0].modifiers.new("cache", "MESH_CACHE")
        cache.cache_format, cache.filepath = ending.upper(), path
        cache.frame_start, cache.interpolation = 0, "NONE"


def in_the_world(mesh_object, graph) -> np.ndarray:
    evaluated = mesh_object.evaluated_get(graph)
    mesh = evaluated.to_mesh()
    local = np.empty(3 * len(mesh.vertices), np.float32)
    mesh.vertices.foreach_get("co", local)
    matrix = np.array(evaluated.matrix_world)
    evaluated.to_mesh_clear()
    x, y, z = (local.reshape(-1, 3) @ matrix[:3, :3].T + matrix[:3, 3]).T
    return np.stack([x, z, -y], axis=1)  # Blender's z is up


def main(path: str, frames: str, fps: str, out: str) -> None:
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.fps, scene.render.fps_base = int(fps), 1.0
    opened(path)
    meshes = [each for each in scene.objects if each.type == "MESH"]
    played = {each.name: [] for each in meshes}
    for frame in range(int(frames)):
        scene.frame_set(frame)
        graph = bpy.context.evaluated_depsgraph_get()
        for each in meshes:
            played[each.name].append(in_the_world(each, graph))
    triangles = {f"faces of {each.name}": np.array([p.vertices[:] for p in each.data.polygons]) for each in meshes}
    np.savez(out, **{name: np.array(vertices) for name, vertices in played.items()}, **triangles)


main(*sys.argv[1:])
