"""Rules of garment files that say which vertices are pinned, and to what."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from hemline.arrays import Faces, Int, Vertices
from hemline.errors import BadGarment
from hemline.meshes import open_rims
from hemline.motions.motion import JOINT_NAMES

from .dressing import body_tree
from .pins import Pins
from .quote import quote
from .upper_rim import upper_rim

if TYPE_CHECKING:
    from hemline.bodies import ShapedBody

SURFACE = "surface"
"""Value of `PinGroup.to` for pins that follow the skin."""

NO_PINS = Pins(np.empty(0, np.int32), np.empty(0, np.int32), np.empty((0, 3), np.float32), np.empty(0, np.float32))
"""Pins of a garment without any."""

_CURE = "use vertex ids, 'top_rim', 'boundary:0', 'above:0.4' or 'none'"


@dataclass(frozen=True)
class PinGroup:
    """Vertices that are pinned in the same way, as a garment file describes them.

    Raises:
        BadGarment: An unknown joint, or a stiffness that is not positive.
    """

    vertices: tuple[int, ...] | str | None = None
    """Vertex ids or a rule, see `select_vertices`; None: guessed."""
    to: str = SURFACE
    """`surface`: each vertex follows the point of the skin nearest to it; or the name of a joint that carries them."""
    stiffness: float = math.inf
    """Stiffness of the spring that pulls each vertex [N/m]; infinite for hard pins."""

    def __post_init__(self) -> None:
        if self.to not in (SURFACE, *JOINT_NAMES):
            near = get_close_matches(str(self.to)[:60], (SURFACE, *JOINT_NAMES), 1, 0.0)[0]
            raise BadGarment("pins hang on a joint that does not exist", quote(self.to), f"did you mean '{near}'")
        if not self.stiffness > 0:
            raise BadGarment("a pin's stiffness must be positive", self.stiffness, "leave it out for a hard pin")

    @classmethod
    def of(cls, table: dict[str, Any]) -> "PinGroup":
        """Makes the group that a TOML table describes.

        Raises:
            BadGarment: An unknown key, or a value of the wrong kind or out of range.
        """
        kinds = {"vertices": "a list of vertex ids or a rule", "to": "'surface' or a joint", "stiffness": "a number"}
        for key, value in table.items():
            if key not in kinds:
                near = get_close_matches(key[:60], kinds, 1, 0.0)[0]
                raise BadGarment(f"pins: unknown key '{key[:60]}'", quote(value), f"did you mean '{near}'")
            fits = {
                "vertices": isinstance(value, str) or is_ids(value),
                "to": isinstance(value, str),
                "stiffness": isinstance(value, int | float) and not isinstance(value, bool),
            }
            if not fits[key]:
                raise BadGarment(f"pins: '{key}' must be {kinds[key]}", quote(value), "correct it")
        values = dict(table)
        if isinstance(values.get("vertices"), list):
            values["vertices"] = tuple(values["vertices"])
        return cls(**values)


def is_ids(value: Any) -> bool:
    """Whether a value from a TOML file is a list of vertex ids."""
    return isinstance(value, list) and all(isinstance(each, int) and not isinstance(each, bool) for each in value)


PinRule = tuple[int, ...] | str | tuple[PinGroup, ...] | None
"""Pins as a TOML may describe them: vertex ids, a rule, or groups; None: they are guessed."""


def bind_pins(
    rule: PinRule, vertices: Vertices, faces: Faces, shaped: "ShapedBody", name: str
) -> tuple[Pins, tuple[str, ...]]:
    """Binds the pins that a garment's file describes, and returns them with notes on what was guessed.

    Args:
        rule: Groups, or vertex ids or a rule for a single group of hard pins on the surface.
        vertices: Positions on the body at rest [m].
        faces: Triangles.
        shaped: The body.
        name: Name of the garment in error messages.

    Raises:
        BadGarment: A rule is wrong, see `select_vertices`, or a vertex is in two groups.
    """
    parts: list[Pins] = []
    notes: tuple[str, ...] = ()
    for group in _groups(rule):
        ids, group_notes = select_vertices(group.vertices, vertices, faces, name)
        parts.append(_bind_group(ids, vertices[ids], group, shaped))
        notes += group_notes
    pins = Pins.concatenate(parts)
    pinned, times = np.unique(pins.vertices, return_counts=True)
    if (times > 1).any():
        got = f"vertex {pinned[times > 1][0]} in two groups"
        raise BadGarment(f"{name}: each vertex must be pinned once", got, "name it in one group")
    return pins, notes


def _groups(rule: PinRule) -> Sequence[PinGroup]:
    if isinstance(rule, tuple) and rule and isinstance(rule[0], PinGroup):
        return cast(tuple[PinGroup, ...], rule)
    return (PinGroup(cast(tuple[int, ...] | str | None, rule)),)


def _bind_group(ids: np.ndarray, positions: np.ndarray, group: PinGroup, shaped: "ShapedBody") -> Pins:
    if group.to == SURFACE:
        pins = Pins.bind(ids, positions, body_tree(shaped), shaped.normals)
    else:
        pins = Pins.on_joint(ids, positions, JOINT_NAMES.index(group.to), shaped.joints)
    return pins.with_stiffness(group.stiffness)


def select_vertices(
    rule: tuple[int, ...] | str | None, vertices: Vertices, faces: Faces, name: str
) -> tuple[Int[np.ndarray, " pins"], tuple[str, ...]]:
    """Returns the vertices that a rule names, and a note where they were guessed.

    Args:
        rule: Vertex ids; `top_rim`: the open rim that reaches highest, see `upper_rim`; `boundary:N`: the N-th longest
            rim; `above:H`: all vertices higher than H metres above the pelvis; `none`; None guesses `top_rim`.
        vertices: Positions [m].
        faces: Triangles.
        name: Name of the garment in error messages.

    Raises:
        BadGarment: An unknown rule, a rim or vertex that does not exist, or a rule that names no vertex.
    """
    if isinstance(rule, tuple):
        return _by_hand(rule, len(vertices), name), ()
    kind, _, value = (rule or "top_rim").partition(":")
    if kind == "none":
        return np.empty(0, np.int32), ()
    if kind == "above":
        found = np.flatnonzero(vertices[:, 1] > _number(value, rule, name)).astype(np.int32)
        if not len(found):
            raise BadGarment(
                f"{name}: pins {quote(rule)} must name vertices",
                f"the highest is at {vertices[:, 1].max():.3f} m",
                "lower it",
            )
        return found, ()
    if kind not in ("top_rim", "boundary"):
        raise BadGarment(f"{name}: unknown rule for pins", quote(rule), _CURE)
    loops = open_rims(faces)
    if kind == "boundary":
        number = _number(value, rule, name)
        if not 0 <= number < len(loops):
            raise BadGarment(
                f"{name}: pins {quote(rule)} names a rim that does not exist", f"{len(loops)} rims", "count from 0"
            )
        return loops[int(number)], ()
    if not loops:
        raise BadGarment(f"{name}: pins cannot be guessed", "a closed mesh without a rim", "name 'pins' in its TOML")
    highest = upper_rim(vertices, faces)
    guessed = f"pins: the highest of {len(loops)} open rims, {len(highest)} vertices"
    return highest, (guessed,) if rule is None else ()


def guess_key_joint(pins: Pins, shaped: "ShapedBody") -> tuple[str, tuple[str, ...]]:
    """Returns the joint that the pins follow most, and a note that names it. Pins on the skin count by skin weights.

    Args:
        pins: Pins of the garment; if there are none, the joint is the pelvis.
        shaped: The body.
    """
    if not len(pins):
        return "pelvis", ("key joint: pelvis, as nothing is pinned",)
    body = shaped.body
    corner = body.faces[pins.body_faces]
    on_joint = pins.joints >= 0
    weights = body.weights[corner] * pins.barycentric[:, :, None] * ~on_joint[:, None, None]
    total = np.bincount(body.weight_indices[corner].reshape(-1), weights.reshape(-1), len(JOINT_NAMES))
    total += np.bincount(pins.joints[on_joint], minlength=len(JOINT_NAMES))
    joint = int(total.argmax())
    share_percent = 100 * total[joint] / total.sum()
    return JOINT_NAMES[joint], (f"key joint: {JOINT_NAMES[joint]}, {share_percent:.0f} % of the pins' skin weights",)


def _by_hand(ids: tuple[int, ...], count: int, name: str) -> np.ndarray:
    for vertex in ids:
        if not 0 <= vertex < count:
            raise BadGarment(f"{name}: pins name vertex {vertex}", f"a mesh of {count} vertices", "count from 0")
    return np.unique(np.array(ids, np.int32))


def _number(text: str, rule: str | None, name: str) -> float:
    try:
        return float(text)
    except ValueError as error:
        raise BadGarment(f"{name}: unknown rule for pins", quote(rule), _CURE) from error
