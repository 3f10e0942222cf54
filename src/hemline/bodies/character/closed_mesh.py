"""Makes one closed surface of a character, for cloth to lie on: its own skin, or a shell around everything."""

from dataclasses import dataclass, replace

import numpy as np

from hemline.arrays import Float, Int
from hemline.bodies.smpl.smpl_holes import close_holes
from hemline.errors import BadBody, BadMesh, list_names
from hemline.meshes import coarsen, components, consistent_winding, face_areas, shell
from hemline.motions import JOINT_NAMES

from .character_mesh import CharacterMesh

SPACING = 0.01
"""Spacing of the grid in which a shell is found: gaps narrower than this are closed [m]."""
SHELL_VERTICES = 9000
"""Number of vertices of a shell."""
SKIN_VERTICES_MAX = 20000
"""Largest number of vertices of a character's own skin; more are reduced."""
NOT_SKIN = ("hair", "eye", "lash", "brow", "teeth", "tooth", "tongue", "mouth", "tear", "cornea", "beard", "glasses")
"""Words in the names of meshes that are not part of the surface that cloth lies on."""

_WELD_DISTANCE = 1e-5
"""Vertices nearer than this are welded, as a fraction of the size of the mesh."""
_CAP_FRACTION = 0.05
"""Largest area of caps that close the holes of a skin, as a fraction of its area."""
_LIMBS = {"a head": ("neck", "head"), "a trunk": ("pelvis", "spine1", "spine2", "spine3")}
for _side in ("left", "right"):
    _LIMBS[f"a {_side} arm"] = tuple(f"{_side}_{name}" for name in ("wrist", "hand", "elbow"))
    _LIMBS[f"a {_side} leg"] = tuple(f"{_side}_{name}" for name in ("ankle", "foot", "knee"))
"""Joints of each limb; a whole skin has vertices that follow one joint of each."""


@dataclass(frozen=True, eq=False)
class ClosedMesh:
    """A closed surface, with the weights that it takes from the character.

    Attributes:
        vertices: Positions [m].
        faces: Triangles, counter-clockwise from outside.
        weights: Weight of each of the 24 joints.
        notes: How the surface was made, one sentence each.
    """

    vertices: Float[np.ndarray, "verts 3"]
    faces: Int[np.ndarray, "faces 3"]
    weights: Float[np.ndarray, "verts joints"]
    notes: tuple[str, ...]


def close_mesh(mesh: CharacterMesh, name: str) -> ClosedMesh:
    """Makes the surface that cloth lies on.

    If one connected part of the mesh reaches head, hands and feet, and small caps close its holes, the surface is that
    part. Otherwise (clothes in place of skin, a separate head or hands) it is a shell around all parts but hair, eyes
    and the like.

    Args:
        mesh: The character [m].
        name: Name of the character in error messages.

    Raises:
        BadBody: The triangles enclose nothing.
    """
    own, notes = own_skin(mesh)
    if isinstance(own, ClosedMesh):
        return own
    body, excluded = _without(mesh, NOT_SKIN)
    try:
        around = shell(body.vertices, body.faces, SPACING)
        reduced = coarsen(around.vertices, around.faces, SHELL_VERTICES)
    except BadMesh as reason:
        raise BadBody(f"{name} cannot be closed: {reason.what}", reason.got, reason.cure) from reason
    chosen = reduced.kept
    corners = body.weights[body.faces[around.sources[chosen]]]
    weights = np.einsum("vc,vcj->vj", np.maximum(around.weights[chosen], 0), corners)
    if missing := _missing_limbs(weights):
        cure = "close the gaps between its parts, or leave out meshes that are not the body"
        raise BadBody(f"{name} cannot be closed: {own}", f"a surface without {' and '.join(missing)}", cure)
    note = f"closed by a shell of {len(chosen)} vertices, since {own}: gaps below {100 * SPACING:g} cm are filled"
    if excluded:
        note += f"; left out: {', '.join(excluded)}"
    weights = weights / weights.sum(axis=1, keepdims=True)
    return ClosedMesh(around.vertices[chosen], reduced.faces, weights, (*notes, note))


def _without(mesh: CharacterMesh, words: tuple[str, ...]) -> tuple[CharacterMesh, list[str]]:
    """Returns a mesh without the parts whose names have one of these words, and the names of these parts."""
    apart = [any(word in name.lower() for word in words) for name in mesh.names]
    if all(apart) or not any(apart):
        return mesh, []
    indices = np.flatnonzero(~np.array(apart))
    return mesh.only(indices), [name for name, out in zip(mesh.names, apart, strict=True) if out]


def _weld(mesh: CharacterMesh) -> tuple[CharacterMesh, tuple[str, ...]]:
    """Welds vertices at one place, across meshes, and drops triangles that are degenerate or duplicates."""
    size = float(np.ptp(mesh.vertices, axis=0).max())
    place = np.round(mesh.vertices / max(_WELD_DISTANCE * size, 1e-300)).astype(np.int64)
    _, first, inverse = np.unique(place, axis=0, return_index=True, return_inverse=True)
    first, inverse = _in_order(first, inverse.reshape(-1))
    faces = inverse[mesh.faces]
    good = (faces != np.roll(faces, 1, axis=1)).all(axis=1)
    _, once = np.unique(np.sort(faces, axis=1), axis=0, return_index=True)
    good[np.setdiff1d(np.arange(len(faces)), once)] = False
    removed = len(mesh.vertices) - len(first)
    notes = (f"{removed} vertices that lay on another one (seams of texture, creases) were welded",) if removed else ()
    welded = CharacterMesh(
        mesh.vertices[first], faces[good], mesh.weights[first], mesh.parts[good], mesh.names, mesh.notes
    )
    return welded, notes


def _in_order(first: np.ndarray, inverse: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Sorts the result of `np.unique` by first occurrence."""
    order = np.argsort(first)
    number = np.empty_like(order)
    number[order] = np.arange(len(order))
    return first[order], number[inverse]


def own_skin(mesh: CharacterMesh) -> tuple[ClosedMesh | str, tuple[str, ...]]:
    """Returns the part of a character that is a whole skin, closed; or the reason why there is none, for a shell.

    Args:
        mesh: The character [m].

    Returns:
        The skin or the reason, and notes on seams that were welded; a skin has them among its own notes.
    """
    welded, notes = _weld(mesh)
    own = _skin_of(welded)
    if isinstance(own, ClosedMesh):
        own = replace(own, notes=notes + own.notes)
    return own, notes


def _skin_of(mesh: CharacterMesh) -> ClosedMesh | str:
    part = components(mesh.faces.astype(np.int32), len(mesh.vertices))[mesh.faces[:, 0]]
    areas = np.bincount(part, face_areas(mesh.vertices, mesh.faces))
    largest = np.argsort(-areas)[:8]
    weights = {each: mesh.weights[np.unique(mesh.faces[part == each])] for each in largest}
    feet = _own_feet(mesh.weights[np.unique(mesh.faces)])
    bodies = [each for each in largest if not _missing_limbs(weights[each]) and _own_feet(weights[each]) == feet]
    if not bodies:
        return "no connected part of it reaches head, hands and feet"
    faces = mesh.faces[part == bodies[0]]
    if _edge_counts(faces).max() > 2:
        return "its skin has edges of three triangles"
    faces = consistent_winding(faces.astype(np.int32))[0]
    if _volume(mesh.vertices, faces) < 0:
        faces = faces[:, [0, 2, 1]]
    whole = close_holes(faces)
    counts = _edge_counts(whole)
    if counts.min() < 2 or counts.max() > 2:
        return "its skin has holes that touch each other"
    caps = face_areas(mesh.vertices, whole[len(faces) :]).sum() / areas[bodies[0]]
    if caps > _CAP_FRACTION:
        return f"its skin is open: caps would be {100 * caps:.0f} % of it"
    return _limit_skin(mesh, faces, whole, _describe_skin(mesh, part, bodies[0], len(whole) - len(faces)))


def _limit_skin(mesh: CharacterMesh, faces: np.ndarray, whole: np.ndarray, notes: list[str]) -> ClosedMesh:
    """Returns the skin alone, with at most `SKIN_VERTICES_MAX` vertices."""
    used, whole = np.unique(whole, return_inverse=True)
    vertices, weights, whole = mesh.vertices[used], mesh.weights[used], whole.reshape(-1, 3).astype(np.int32)
    if len(vertices) > SKIN_VERTICES_MAX:
        fewer = coarsen(vertices, whole, SKIN_VERTICES_MAX)
        notes.append(f"{len(vertices)} vertices of the skin were reduced to {len(fewer.kept)}")
        vertices, weights, whole = vertices[fewer.kept], weights[fewer.kept], fewer.faces
    return ClosedMesh(vertices, whole, weights, tuple(notes))


def _describe_skin(mesh: CharacterMesh, part: np.ndarray, body: int, caps: int) -> list[str]:
    """Describes how the skin was closed, and which meshes it excludes."""
    notes = [f"cloth lies on its own skin, '{mesh.names[mesh.parts[part == body][0]]}'"]
    notes[0] += f", holes closed by {caps} triangles" if caps else ", which is closed"
    others = np.unique(mesh.parts[part != body])
    if len(others):
        count = len(np.unique(part)) - 1
        named = list_names([f"'{mesh.names[each]}'" for each in others], 8)
        notes.append(f"left out of it: {count} other part{'s' if count > 1 else ''}, of {named}")
    return notes


def _missing_limbs(weights: Float[np.ndarray, "verts joints"]) -> list[str]:
    """Returns the limbs that no vertex follows."""
    most = set(np.unique(weights.argmax(axis=1)).tolist())
    return [part for part, names in _LIMBS.items() if not most & {JOINT_NAMES.index(name) for name in names}]


def _own_feet(weights: Float[np.ndarray, "verts joints"]) -> set[str]:
    """Returns the sides on which some vertex follows the foot alone: a skin without its boots has none."""
    of_side = {side: [JOINT_NAMES.index(f"{side}_{name}") for name in ("ankle", "foot")] for side in ("left", "right")}
    return {side for side, joints in of_side.items() if (weights[:, joints].sum(axis=1) > 0.99).any()}


def _edge_counts(faces: np.ndarray) -> np.ndarray:
    """Returns the number of triangles at each edge."""
    edges = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    return np.unique(edges, axis=0, return_counts=True)[1]


def _volume(vertices: np.ndarray, faces: np.ndarray) -> float:
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6)
