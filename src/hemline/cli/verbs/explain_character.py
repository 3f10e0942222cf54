"""The part of `hemline explain` for rigged characters: five lines, and a picture of the meshes and the joints."""

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from hemline.errors import list_names

if TYPE_CHECKING:
    from hemline.bodies import Character
    from hemline.bodies.character.character_mesh import CharacterMesh

_SIZE = (340, 460)
_BONES, _LEFT_OUT = (0.20, 0.42, 0.62), "truth"
_NAMES = 6


def explain_character(path: Path, picture: Path) -> Iterator[str]:
    """Reads a rigged character, yields five lines on what was understood of it, and draws it.

    Args:
        path: A `.glb`, `.vrm`, `.gltf` or `.fbx`.
        picture: The picture to write.

    Raises:
        BadBody: The file cannot be read, has no skin, is not a humanoid, or does not have the size of a person.
        BadOutput: The picture cannot be written.
    """
    from dataclasses import replace

    from hemline.bodies import read_skeleton
    from hemline.bodies.character.character_mesh import read_character_mesh
    from hemline.bodies.character.closed_mesh import ClosedMesh, own_skin
    from hemline.motions.rigs.gltf_clip import animation_names

    character = read_skeleton(path)
    mesh = read_character_mesh(character.rig, character.owners)
    mesh = replace(mesh, vertices=mesh.vertices @ character.to_body[:3, :3].T + character.to_body[:3, 3])
    used = mesh.vertices[np.unique(mesh.faces)]
    how, size, *others = character.notes
    count = f"{len(used)} vertices, {len(mesh.faces)} triangles, {len(mesh.names)} mesh{'es' * (len(mesh.names) > 1)}"
    yield f"character: '{path.stem}', {np.ptp(used[:, 1]):.2f} m tall, {count}; {size}"
    yield f"skeleton: {how}; {'; '.join(others)}"
    yield f"rest pose: {_describe_arms(character)}"
    own, _ = own_skin(mesh)
    if isinstance(own, ClosedMesh):
        surface = "; ".join(own.notes)
    else:
        surface = f"a shell around all parts but hair and eyes, which 'hemline body' makes in some seconds, since {own}"
    yield f"surface: {surface}"
    heads = animation_names(character.rig.gltf)
    names = list_names([f"'{name}'" for name in mesh.names], _NAMES)
    animations = f"animations: {list_names(heads, _NAMES)}" if heads else "no animations"
    yield f"meshes: {'; '.join((names, *mesh.notes, animations))}"
    _draw(picture, character, mesh)


def _describe_arms(character: "Character") -> str:
    """Describes how the arms hang at rest, and where the rest pose was taken from."""
    from hemline.motions import JOINT_NAMES

    angles = []
    for side in ("left", "right"):
        shoulder, wrist = (character.joints[JOINT_NAMES.index(f"{side}_{name}")] for name in ("shoulder", "wrist"))
        down, away = shoulder[1] - wrist[1], float(np.linalg.norm((wrist - shoulder)[[0, 2]]))
        angles.append(np.degrees(np.arctan2(down, away)))
    source = "as the file shows it" if character.rig.in_bind_pose else "the pose that its skin was bound in"
    below = round(float(np.mean(angles)))
    return f"{source}, arms {below} degrees below the horizontal; turned to the T-pose bone by bone"


def _draw(path: Path, character: "Character", mesh: "CharacterMesh") -> None:
    """Draws the meshes from two sides, hair and eyes in another colour, and the 24 joints."""
    from hemline.bodies.character.closed_mesh import NOT_SKIN
    from hemline.motions import PARENTS
    from hemline.pictures import picture_of, side_by_side, write_png
    from hemline.pictures.bones import bone_mesh

    apart = np.array([any(word in name.lower() for word in NOT_SKIN) for name in mesh.names])
    meshes = []
    for out, colour in ((False, "body"), (True, _LEFT_OUT)):
        rows, faces = np.unique(mesh.faces[apart[mesh.parts] == out], return_inverse=True)
        if len(rows):
            meshes.append((mesh.vertices[rows], faces.reshape(-1, 3).astype(np.int32), colour))
    pictures = [picture_of(meshes, view, size=_SIZE) for view in ("front", "side")]
    pictures.append(picture_of([(*bone_mesh(character.joints, PARENTS), _BONES)], "front", size=_SIZE))
    write_png(path, side_by_side(pictures, ["at rest, front", "at rest, side", "the 24 joints"]))
