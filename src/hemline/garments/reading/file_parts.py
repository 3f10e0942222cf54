"""Parts of a garment's file by name: `FILE.obj:Shirt`, `FILE.glb:NODE`."""

from pathlib import Path

import numpy as np

from hemline.errors import BadGarment
from hemline.meshes import MESH_ENDINGS, ReadMesh, components

_NAMES_SHOWN = 12


def split_part(path: str | Path) -> tuple[Path, str | None]:
    """Splits `FILE` or `FILE:NAME` into a file and the name of a part of it, at the first colon behind its ending."""
    text = str(path)
    for at in [place for place, letter in enumerate(text) if letter == ":"]:
        if Path(text[:at]).suffix.lower() in MESH_ENDINGS and text[at + 1 :]:
            return Path(text[:at]), text[at + 1 :]
    return Path(text), None


def only_part(mesh: ReadMesh, part: str, file: str) -> ReadMesh:
    """Returns one part of a file's mesh.

    Args:
        mesh: The mesh.
        part: Name of an object, group, node, mesh or material, or the beginning or middle of one; a number counts
            the connected parts of a mesh from 0, in the order of their first vertices.
        file: Name of the file in messages.

    Raises:
        BadGarment: No part has that name, or several do.
    """
    wanted = part.strip().lower()
    names = [tuple(name.lower() for name in label) for label in mesh.labels]
    tests = (lambda name: name == wanted, lambda name: name.startswith(wanted), lambda name: wanted in name)
    for place, test in enumerate(tests):
        rows = [row for row, label in enumerate(names) if any(name and test(name) for name in label)]
        if rows and mesh.face_labels is not None:
            found = sorted({name for row in rows for name in mesh.labels[row] if name and test(name.lower())})
            if place == 0 or len(found) == 1:
                chosen = np.flatnonzero(np.isin(mesh.face_labels, rows))
                if len(chosen):
                    return mesh.with_faces(chosen, f"part: '{found[0]}' of {file}, all else in it was left out")
                continue
            raise BadGarment(f"{file}:{part} names several parts", _list_names(found), "give the whole name of one")
    owner = components(mesh.faces, len(mesh.vertices))[mesh.faces[:, 0]]
    numbers = np.unique(owner)
    if wanted.isdecimal() and int(wanted) < len(numbers):
        rows = np.flatnonzero(owner == numbers[int(wanted)])
        return mesh.with_faces(rows, f"part: number {int(wanted)} of {len(numbers)} of {file}")
    cure = f"name one of them, or a number from 0 to {len(numbers) - 1}"
    raise BadGarment(f"{file} has no part '{part[:60]}'", _list_names(part_names(mesh)), cure)


def part_names(mesh: ReadMesh) -> list[str]:
    """Returns the first name of each part of a file, in its order."""
    return list(dict.fromkeys(next((name for name in label if name), "") for label in mesh.labels if any(label)))


def _list_names(names: list[str]) -> str:
    shown = ", ".join(f"'{name[:40]}'" for name in names[:_NAMES_SHOWN])
    return (shown + (", and more" if len(names) > _NAMES_SHOWN else "")) or "parts without names"
