"""One closed surface of a character's triangles, for cloth to lie on: its own skin, or a shell around all."""

from dataclasses import dataclass

import numpy as np

from hemline.arrays import Float, Int
from hemline.bodies.smpl.smpl_holes import without_holes
from hemline.errors import BadBody, BadMesh
from hemline.meshes import coarser, components, consistent_winding, face_areas, shell
from hemline.motions import JOINT_NAMES

from .character_mesh import CharacterMesh

SPACING = 0.01
"""Grid in which a shell is found: gaps narrower than this are closed [m]."""
SHELL_VERTICES = 9000
"""Vertices of a shell."""
OWN_VERTICES = 20000
"""A character's own skin keeps so many vertices at most."""
APART = ("hair", "eye", "lash", "brow", "teeth", "tooth", "tongue", "mouth", "tear", "cornea", "beard", "glasses")
"""Words in the names of meshes that are no part of the surface that cloth lies on."""

_NEAR = 1e-5
_CAPS = 0.05
"""Holes that are closed have this share of the skin's area at most."""
_REACHED = {"a head": ("neck", "head"), "a trunk": ("pelvis", "spine1", "spine2", "spine3")}
for _side in ("left", "right"):
    _REACHED[f"a {_side} arm"] = tuple(f"{_side}_{name}" for name in ("wrist", "hand", "elbow"))
    _REACHED[f"a {_side} leg"] = tuple(f"{_side}_{name}" for name in ("ankle", "foot", "knee"))
"""A skin that is whole has vertices of one of each of these."""


@dataclass(frozen=True, eq=False)
class ClosedMesh:
    """One closed surface, and how its vertices lie between those of the character.

    Attributes:
        vertices: Positions [m].
        faces: Triangles, counter-clockwise from outside.
        weights: Share of each of our joints.
        notes: How it was made, one sentence each.
    """

    vertices: Float[np.ndarray, "verts 3"]
    faces: Int[np.ndarray, "faces 3"]
    weights: Float[np.ndarray, "verts joints"]
    notes: tuple[str, ...]


def closed_mesh(mesh: CharacterMesh, name: str) -> ClosedMesh:
    """The surface that cloth lies on.

    Where one connected part of the mesh reaches head, hands and feet, and holes of it can be closed by caps that are
    small, it is that part itself. Otherwise (clothes in place of skin, a head or hands apart) it is a shell around all
    parts but hair, eyes and the like.

    Args:
        mesh: The character [m].
        name: How errors call it.

    Raises:
        BadBody: The triangles enclose nothing.
    """
    welded, notes = _welded(mesh)
    own = _own_skin(welded)
    if isinstance(own, ClosedMesh):
        return ClosedMesh(own.vertices, own.faces, own.weights, notes + own.notes)
    body, left_out = _without(mesh, APART)
    try:
        around = shell(body.vertices, body.faces, SPACING)
        kept = coarser(around.vertices, around.faces, SHELL_VERTICES)
    except BadMesh as reason:
        raise BadBody(f"{name} cannot be closed: {reason.what}", reason.got, reason.cure) from reason
    chosen = kept.kept
    corners = body.weights[body.faces[around.sources[chosen]]]
    weights = np.einsum("vc,vcj->vj", np.maximum(around.shares[chosen], 0), corners)
    if lacking := _unreached(weights):
        cure = "close the gaps between its parts, or leave out meshes that are not the body"
        raise BadBody(f"{name} cannot be closed: {own}", f"a surface without {' and '.join(lacking)}", cure)
    told = f"closed by a shell of {len(chosen)} vertices, since {own}: gaps below {100 * SPACING:g} cm are filled"
    if left_out:
        told += f"; left out: {', '.join(left_out)}"
    return ClosedMesh(around.vertices[chosen], kept.faces, weights / weights.sum(axis=1, keepdims=True), (*notes, told))


def _without(mesh: CharacterMesh, words: tuple[str, ...]) -> tuple[CharacterMesh, list[str]]:
    """The mesh without the parts whose names have one of these words; all of it where all have."""
    apart = [any(word in name.lower() for word in words) for name in mesh.names]
    if all(apart) or not any(apart):
        return mesh, []
    kept = np.flatnonzero(~np.array(apart))
    return mesh.only(kept), [name for name, out in zip(mesh.names, apart, strict=True) if out]


def _welded(mesh: CharacterMesh) -> tuple[CharacterMesh, tuple[str, ...]]:
    """Vertices at one place made one, across meshes; triangles without area or twice there are gone."""
    size = float(np.ptp(mesh.vertices, axis=0).max())
    place = np.round(mesh.vertices / max(_NEAR * size, 1e-300)).astype(np.int64)
    _, first, inverse = np.unique(place, axis=0, return_index=True, return_inverse=True)
    first, inverse = _in_order(first, inverse.reshape(-1))
    faces = inverse[mesh.faces]
    good = (faces != np.roll(faces, 1, axis=1)).all(axis=1)
    _, once = np.unique(np.sort(faces, axis=1), axis=0, return_index=True)
    good[np.setdiff1d(np.arange(len(faces)), once)] = False
    gone = len(mesh.vertices) - len(first)
    notes = (f"{gone} vertices that lay on another one (seams of texture, creases) were welded",) if gone else ()
    welded = CharacterMesh(
        mesh.vertices[first], faces[good], mesh.weights[first], mesh.parts[good], mesh.names, mesh.notes
    )
    return welded, notes


def _in_order(first: np.ndarray, inverse: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """What `np.unique` found, in the order in which it came."""
    order = np.argsort(first)
    number = np.empty_like(order)
    number[order] = np.arange(len(order))
    return first[order], number[inverse]


def _own_skin(mesh: CharacterMesh) -> ClosedMesh | str:
    """The part of the mesh that is a whole skin, closed; or why there is none."""
    part = components(mesh.faces.astype(np.int32), len(mesh.vertices))[mesh.faces[:, 0]]
    areas = np.bincount(part, face_areas(mesh.vertices, mesh.faces))
    largest = np.argsort(-areas)[:8]
    bodies = [each for each in largest if not _unreached(mesh.weights[np.unique(mesh.faces[part == each])])]
    if not bodies:
        return "no connected part of it reaches head, hands and feet"
    faces = mesh.faces[part == bodies[0]]
    if _edge_counts(faces).max() > 2:
        return "its skin has edges of three triangles"
    faces = consistent_winding(faces.astype(np.int32))[0]
    if _volume(mesh.vertices, faces) < 0:
        faces = faces[:, [0, 2, 1]]
    whole = without_holes(faces)
    counts = _edge_counts(whole)
    if counts.min() < 2 or counts.max() > 2:
        return "its skin has holes that touch each other"
    caps = face_areas(mesh.vertices, whole[len(faces) :]).sum() / areas[bodies[0]]
    if caps > _CAPS:
        return f"its skin is open: caps would be {100 * caps:.0f} % of it"
    return _kept(mesh, faces, whole, _told(mesh, part, bodies[0], len(whole) - len(faces)))


def _kept(mesh: CharacterMesh, faces: np.ndarray, whole: np.ndarray, told: list[str]) -> ClosedMesh:
    """The skin alone, with at most `OWN_VERTICES` vertices."""
    used, whole = np.unique(whole, return_inverse=True)
    vertices, weights, whole = mesh.vertices[used], mesh.weights[used], whole.reshape(-1, 3).astype(np.int32)
    if len(vertices) > OWN_VERTICES:
        fewer = coarser(vertices, whole, OWN_VERTICES)
        told.append(f"{len(vertices)} vertices of the skin were reduced to {len(fewer.kept)}")
        vertices, weights, whole = vertices[fewer.kept], weights[fewer.kept], fewer.faces
    return ClosedMesh(vertices, whole, weights, tuple(told))


def _told(mesh: CharacterMesh, part: np.ndarray, body: int, caps: int) -> list[str]:
    """What was closed and what is left out."""
    told = [f"cloth lies on its own skin, '{mesh.names[mesh.parts[part == body][0]]}'"]
    told[0] += f", holes closed by {caps} triangles" if caps else ", which is closed"
    others = np.unique(mesh.parts[part != body])
    if len(others):
        count = len(np.unique(part)) - 1
        named = ", ".join(f"'{mesh.names[each]}'" for each in others[:8]) + (", ..." if len(others) > 8 else "")
        told.append(f"left out of it: {count} other part{'s' if count > 1 else ''}, of {named}")
    return told


def _unreached(weights: Float[np.ndarray, "verts joints"]) -> list[str]:
    """Parts of a person that no vertex follows."""
    most = set(np.unique(weights.argmax(axis=1)).tolist())
    return [part for part, names in _REACHED.items() if not most & {JOINT_NAMES.index(name) for name in names}]


def _edge_counts(faces: np.ndarray) -> np.ndarray:
    """Triangles at each edge."""
    edges = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    return np.unique(edges, axis=0, return_counts=True)[1]


def _volume(vertices: np.ndarray, faces: np.ndarray) -> float:
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6)
