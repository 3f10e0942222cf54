"""Translates what a garment's file says about vertices into vertices of its cloth: ids, groups and colours."""

from dataclasses import replace

import numpy as np

from hemline.arrays import Int
from hemline.errors import BadGarment, list_names
from hemline.garments.pin_rules import PinGroup, PinRule
from hemline.garments.quote import quote
from hemline.meshes import ReadMesh

from .garment_toml import GarmentFile

COLOURS = {"red": (1, 0, 0), "green": (0, 1, 0), "blue": (0, 0, 1), "white": (1, 1, 1), "black": (0, 0, 0)}
"""Colours by name, besides `#rrggbb`."""

PIN_NAMES = ("pin", "pins", "pinned", "pin_group")
"""Names of vertex groups that are pins, unless the TOML says otherwise."""

_COLOUR_DISTANCE = 0.25
"""Largest difference of a colour in red, green or blue."""


def on_cloth(description: GarmentFile, mesh: ReadMesh, name: str) -> tuple[GarmentFile, tuple[str, ...]]:
    """Returns a description whose pins and chains name vertices of the cloth, and a note where pins were found.

    Args:
        description: What the TOML says; its ids are those of the vertices in the mesh's file.
        mesh: The cloth.
        name: Name of the garment in messages.

    Raises:
        BadGarment: A vertex is not in the file or no cloth, or a group or colour has no vertices.
    """
    pins, notes = description.pins, ()
    if pins is None:
        found = next((group for group in PIN_NAMES if len(_in_group(mesh, group))), None)
        if found:
            pins, notes = f"group:{found}", (f"pins: the vertices of the group '{found}' of the file",)
    if isinstance(pins, tuple) and pins and isinstance(pins[0], PinGroup):
        groups = tuple(each for each in pins if isinstance(each, PinGroup))
        pins = tuple(replace(each, vertices=_ids(each.vertices, mesh, name)) for each in groups)
    else:
        pins = _ids(pins, mesh, name)  # type: ignore[arg-type]
    chains = tuple(_translate(chain, mesh, f"{name}: chains name") for chain in description.chains)
    return replace(description, pins=pins, chains=chains), notes


def _ids(rule: tuple[int, ...] | str | None, mesh: ReadMesh, name: str) -> PinRule:
    if isinstance(rule, tuple):
        return tuple(dict.fromkeys(_translate(rule, mesh, f"{name}: pins name")))
    kind, _, value = (rule or "").partition(":")
    if kind not in ("group", "colour", "color"):
        return rule
    ids = _in_group(mesh, value) if kind == "group" else _of_colour(mesh, value, rule or "", name)
    if not len(ids):
        known = sorted({*mesh.marks, *(each for label in mesh.labels for each in label if each)})
        has = list_names([each[:40] for each in known]) or "none"
        got = (
            f"groups: {has}" if kind == "group" else "colours without it" if mesh.colours is not None else "no colours"
        )
        cure = "name one of these, or export it with the mesh"
        raise BadGarment(f"{name}: pins {quote(rule)} must name vertices", got, cure)
    return tuple(ids.tolist())


def _translate(ids: tuple[int, ...], mesh: ReadMesh, what: str) -> tuple[int, ...]:
    count = len(mesh.vertices) if mesh.file_ids is None else len(mesh.file_ids)
    result = []
    for vertex in ids:
        if not 0 <= vertex < count:
            raise BadGarment(f"{what} vertex {vertex}", f"a mesh of {count} vertices", "count from 0")
        new = vertex if mesh.file_ids is None else int(mesh.file_ids[vertex])
        if new < 0:
            cure = "name a vertex of the cloth, or the part with FILE:NAME"
            raise BadGarment(f"{what} vertex {vertex}", "one that was left out, as no cloth has it", cure)
        result.append(new)
    return tuple(result)


def _in_group(mesh: ReadMesh, group: str) -> Int[np.ndarray, " verts"]:
    """Returns the vertices that an attribute marks, or those of an object, group or material."""
    wanted = group.strip().lower()
    if wanted in mesh.marks:
        return np.flatnonzero(mesh.marks[wanted])
    rows = [row for row, label in enumerate(mesh.labels) if wanted in (each.lower() for each in label if each)]
    if mesh.face_labels is None or not rows:
        return np.empty(0, np.int64)
    return np.unique(mesh.faces[np.isin(mesh.face_labels, rows)])


def _of_colour(mesh: ReadMesh, colour: str, rule: str, name: str) -> Int[np.ndarray, " verts"]:
    wanted = COLOURS.get(colour.strip().lower())
    if wanted is None:
        text = colour.strip().lstrip("#")
        try:
            wanted = tuple(int(text[at : at + 2], 16) / 255 for at in (0, 2, 4))
        except ValueError as error:
            cure = f"use one of {', '.join(COLOURS)}, or #rrggbb"
            raise BadGarment(f"{name}: pins {quote(rule)} name no colour", quote(colour), cure) from error
    if mesh.colours is None:
        return np.empty(0, np.int64)
    return np.flatnonzero(np.abs(mesh.colours - np.array(wanted)).max(axis=1) < _COLOUR_DISTANCE)
