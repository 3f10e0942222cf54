"""Tries a mesh of the scene on, and shows how it is worn."""

from pathlib import Path

import bpy
import numpy as np

from .job import Job, make_folder, remove_folder
from .mesh_files import read_garment, write_garment, z_up
from .program import executable, try_on_words
from .refused import Refused

PINS = "pins"
"""Name of the vertex group of a garment that was tried on with pins."""


def start_try_on(context, chosen) -> Job:
    """Starts `hemline tryon` with a mesh of the scene.

    Raises:
        Refused: There is no program, or the mesh cannot be written.
    """
    program, folder = executable(context), make_folder()
    try:
        words = try_on_words(chosen.hemline, write_garment(chosen, folder, context))
        words += ["--output", str(folder / "worn.safetensors"), "--picture", str(folder / "worn.png")]
        return Job(program, words, folder, chosen, show_worn)
    except Refused:
        remove_folder(folder)
        raise


def show_worn(job: Job, chosen) -> str:
    """Adds the garment as it is worn beside the mesh that was tried on; returns the messages of hemline.

    Raises:
        Refused: The program wrote no garment.
    """
    path = job.folder / "worn.safetensors"
    if not path.is_file():
        raise job.no_result()
    arrays, (scene, *_) = read_garment(path), chosen.users_scene or [bpy.context.scene]
    mesh = mesh_as_worn(chosen, arrays, scene)
    worn = bpy.data.objects.new(mesh.name, mesh)
    worn.scale = [1 / scene.unit_settings.scale_length] * 3
    for collection in chosen.users_collection:
        collection.objects.link(worn)
    worn.hemline.body, worn.hemline.betas = chosen.hemline.body, chosen.hemline.betas
    if len(arrays["pin_vertices"]):
        if PINS in worn.vertex_groups:
            worn.vertex_groups.remove(worn.vertex_groups[PINS])
        worn.vertex_groups.new(name=PINS).add(arrays["pin_vertices"].tolist(), 1.0, "REPLACE")
        worn.hemline.pins = PINS
    load_picture(job.folder / "worn.png", mesh.name)
    job.clear()
    return "\n".join([*job.messages, job.output.strip()])


def mesh_as_worn(chosen, arrays: dict[str, np.ndarray], scene):
    """Returns the mesh of a garment as it is worn.

    It keeps faces, UV maps and vertex groups unless hemline left a vertex out, and materials in any case.
    """
    vertices, depsgraph = z_up(arrays["vertices"]), scene.view_layers[0].depsgraph
    depsgraph.update()
    evaluated = chosen.evaluated_get(depsgraph)
    mesh = bpy.data.meshes.new_from_object(evaluated, preserve_all_data_layers=True, depsgraph=depsgraph)
    mesh.name = f"{chosen.name} worn"
    if has_triangles(mesh, arrays["faces"], len(vertices)):
        mesh.vertices.foreach_set("co", vertices.ravel())
    else:
        mesh.clear_geometry()
        mesh.from_pydata(vertices.tolist(), [], arrays["faces"].tolist())
    mesh.update()
    return mesh


def has_triangles(mesh, faces: np.ndarray, vertex_count: int) -> bool:
    """Whether a mesh has this number of vertices, and each of the triangles (faces, 3) lies in one of its polygons."""
    if len(mesh.vertices) != vertex_count:
        return False
    around = [set() for _ in range(vertex_count)]
    for polygon in mesh.polygons:
        for vertex in polygon.vertices:
            around[vertex].add(polygon.index)
    return all(around[a] & around[b] & around[c] for a, b, c in faces.tolist())


def load_picture(path: Path, name: str) -> None:
    """Loads a picture into the file, where the Image Editor shows it; an older one of this name is replaced."""
    if name in bpy.data.images:
        bpy.data.images.remove(bpy.data.images[name])
    picture = bpy.data.images.load(str(path))
    picture.name = name
    picture.use_fake_user = True
    picture.pack()
