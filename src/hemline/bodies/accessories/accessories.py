"""Joins rigid meshes to a body, each to a joint, so that cloth is kept out of them as out of the skin."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from hemline.arrays import Float
from hemline.bodies.body import Body
from hemline.bodies.model import INFLUENCES
from hemline.errors import BadBody
from hemline.meshes import ClosestTree
from hemline.motions import JOINT_NAMES

from .solid import Solid, read_solid

NEAR = 0.1
"""An accessory lies within this distance of the skin of its joint [m]."""

SIZES = (0.02, 1.5)
"""Least and largest size of an accessory [m]."""

TOUCHING = 0.02
"""Distance from the skin within which an accessory counts as touching it [m]."""

UNITS = {"m": 1.0, "cm": 0.01, "mm": 0.001}
"""Units of an accessory's file, in metres."""

_JOINT_WEIGHT = 0.3


@dataclass(frozen=True)
class Accessory:
    """A rigid mesh and the joint that carries it.

    Attributes:
        path: The mesh, y up, the body facing z: at its place on the body at rest, with the pelvis or the floor at the
            origin, or around an origin that is the joint's.
        joint: Name of the joint.
        unit: `m`, `cm` or `mm`; None: m in a GLB or glTF, otherwise the largest in which the mesh is at most 1.5 m.
    """

    path: Path
    joint: str
    unit: str | None = None

    @classmethod
    def parse(cls, text: str) -> "Accessory":
        """Reads `FILE:JOINT` or `FILE:JOINT:UNIT`.

        Args:
            text: For example `pads.glb:spine3` or `bag.obj:pelvis:cm`.

        Raises:
            BadBody: No joint is named, or there is none of that name.
        """
        rest, _, last = text.rpartition(":")
        unit = last if last in UNITS else None
        path, _, joint = rest.rpartition(":") if unit else (rest, ":", last)
        if not path or joint not in JOINT_NAMES:
            got = f"joint '{joint}'" if path else repr(text)
            raise BadBody("an accessory is named FILE:JOINT", got, f"use one of {', '.join(JOINT_NAMES)}")
        return cls(Path(path), joint, unit)


def attach(body: Body, accessories: Sequence[Accessory]) -> tuple[Body, tuple[str, ...]]:
    """Returns a body with accessories, and notes on where each was taken to lie.

    They become closed parts of its surface. Each follows its joint rigidly, and is carried along with the skin beneath
    where a shape coefficient moves that. Garments go over them. The vertices of the body come first and are unchanged,
    so that models that were fitted on the body play on it with its accessories, too (`Body.bare`).

    The origin of the mesh is that of the body's pelvis, of the floor beneath it, or of the joint: the one with which
    the mesh lies nearest to the skin that the joint moves, the first of them where several touch it.

    Args:
        body: The body.
        accessories: What it carries.

    Raises:
        BadBody: A file cannot be read or closed, or its mesh is too large, too small or far from its joint.
    """
    notes = []
    for accessory in accessories:
        solid = read_solid(accessory.path)
        placed, how = _place(body.bare, solid, accessory)
        body = _joined(body, placed, solid, accessory)
        notes += [f"accessory {accessory.path.name} on {accessory.joint}: {how}", *solid.notes]
    return body, tuple(notes)


def _place(body: Body, solid: Solid, accessory: Accessory) -> tuple[Float[np.ndarray, "verts 3"], str]:
    """Returns the positions of an accessory on the body at rest [m], and how they were found."""
    joint = JOINT_NAMES.index(accessory.joint)
    skin = _skin_of(body, joint)
    origins = {
        "the pelvis of the body at rest": np.zeros(3),
        "the floor beneath the body at rest": np.array([0, body.template[:, 1].min(), 0]),
        "the joint": body.joints[joint],
    }
    unit, size = _unit_of(solid, accessory)
    tried = {name: UNITS[unit] * solid.vertices + origin for name, origin in origins.items()}
    away = {name: float(skin.closest(placed).distances.min()) for name, placed in tried.items()}
    touching = [name for name in tried if away[name] < TOUCHING]
    best = touching[0] if touching else min(away, key=lambda name: away[name])
    if away[best] > NEAR:
        raise BadBody(
            f"{accessory.path.name} must lie within {100 * NEAR:.0f} cm of the skin at the joint '{accessory.joint}'",
            f"{100 * away[best]:.0f} cm, in {unit}, with {best} as its origin",
            "place it on the body at rest, y up and facing z, or name another joint, or the unit (FILE:JOINT:cm)",
        )
    return tried[best], f"{size:.2f} m large, its origin is {best}"


def _unit_of(solid: Solid, accessory: Accessory) -> tuple[str, float]:
    """Returns the unit of an accessory, and its size in metres."""
    size = float(np.ptp(solid.vertices, axis=0).max())
    given = accessory.unit or ("m" if accessory.path.suffix.lower() in (".glb", ".gltf", ".vrm") else None)
    for unit in (given,) if given else UNITS:
        if SIZES[0] <= size * UNITS[unit] <= SIZES[1]:
            return unit, size * UNITS[unit]
    raise BadBody(
        f"an accessory is {SIZES[0]:g} to {SIZES[1]:g} m large",
        f"{accessory.path.name}, {size:.4g} {given or 'units'}",
        "scale it, or name its unit (FILE:JOINT:mm)",
    )


def _skin_of(body: Body, joint: int) -> ClosestTree:
    """Returns the skin that a joint moves, or the neighbourhood of the joint if it moves none."""
    share = np.where(body.weight_indices == joint, body.weights, 0).sum(axis=1)
    away = np.linalg.norm(body.template - body.joints[joint], axis=1)
    own = (share > _JOINT_WEIGHT) | (away <= away.min() + 0.02)
    return ClosestTree(body.template.astype(np.float64), body.faces[own[body.faces].any(axis=1)])


def _joined(body: Body, placed: np.ndarray, solid: Solid, accessory: Accessory) -> Body:
    """Returns a body with one more rigid part, and a name of its own."""
    count, bare, joint = len(placed), body.bare, JOINT_NAMES.index(accessory.joint)
    near = np.unique(bare.faces[ClosestTree(bare.template.astype(np.float64), bare.faces).closest(placed).faces])
    # rigid: the whole part goes with the mean of the skin beneath it
    shift = bare.shapedirs[:, near].mean(axis=1, keepdims=True) if len(bare.shapedirs) else bare.shapedirs[:, :1]
    weights = np.zeros((count, INFLUENCES), np.float32)
    weights[:, 0] = 1
    rigid = None
    if body.posedirs is not None:
        rigid = np.concatenate([body.posedirs, np.zeros((len(body.posedirs), count, 3), np.float32)], axis=1)
    return replace(
        body,
        name=f"{body.name}+{accessory.path.stem}",
        template=np.concatenate([body.template, placed]),
        faces=np.concatenate([body.faces, solid.faces + len(body.template)]),
        shapedirs=np.concatenate([body.shapedirs, np.repeat(shift, count, axis=1)], axis=1),
        weight_indices=np.concatenate([body.weight_indices, np.full((count, INFLUENCES), joint)]),
        weights=np.concatenate([body.weights, weights]),
        posedirs=rigid,
        accessory_vertices=body.accessory_vertices + count,
        bare_name=body.bare_name or body.name,
    )
