"""Which vertices a rule pins, and which joint they hang on."""

from typing import TYPE_CHECKING

import numpy as np

from hemline.arrays import Faces, Int, Vertices
from hemline.errors import BadGarment
from hemline.meshes import boundary_loops
from hemline.motions.motion import JOINT_NAMES

from .pins import Pins

if TYPE_CHECKING:
    from hemline.bodies import ShapedBody

_CURE = "use vertex ids, 'top_rim', 'boundary:0', 'above:0.4' or 'none'"


def pinned_vertices(
    rule: tuple[int, ...] | str | None, vertices: Vertices, faces: Faces, name: str
) -> tuple[Int[np.ndarray, " pins"], tuple[str, ...]]:
    """Vertices that a rule names, and a note where it was guessed.

    Args:
        rule: Vertex ids; `top_rim`: the open rim that is highest on average; `boundary:N`: the N-th longest rim;
            `above:H`: all vertices higher than H metres above the pelvis; `none`; None guesses `top_rim`.
        vertices: Positions [m].
        faces: Triangles.
        name: How errors call the garment.

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
                f"{name}: pins '{rule}' must name vertices",
                f"the highest is at {vertices[:, 1].max():.3f} m",
                "lower it",
            )
        return found, ()
    if kind not in ("top_rim", "boundary"):
        raise BadGarment(f"{name}: unknown rule for pins", f"'{rule}'", _CURE)
    loops = boundary_loops(faces)
    if kind == "boundary":
        number = int(_number(value, rule, name))
        if not 0 <= number < len(loops):
            raise BadGarment(
                f"{name}: pins '{rule}' names a rim that does not exist", f"{len(loops)} rims", "count from 0"
            )
        return loops[number], ()
    if not loops:
        raise BadGarment(f"{name}: pins cannot be guessed", "a closed mesh without a rim", "name 'pins' in its TOML")
    highest = max(loops, key=lambda loop: vertices[loop, 1].mean())
    guessed = f"pins: the highest of {len(loops)} open rims, {len(highest)} vertices"
    return highest, (guessed,) if rule is None else ()


def guessed_key_joint(pins: Pins, shaped: "ShapedBody") -> tuple[str, tuple[str, ...]]:
    """The joint that the pinned body points follow most, by their skin weights, and a note that says so.

    Args:
        pins: Bound pins; without any it is the pelvis.
        shaped: The body.
    """
    if not len(pins):
        return "pelvis", ("key joint: pelvis, as nothing is pinned",)
    body = shaped.body
    corner = body.faces[pins.body_faces]
    share = body.weights[corner] * pins.barycentric[:, :, None]
    total = np.bincount(body.weight_indices[corner].reshape(-1), share.reshape(-1), len(JOINT_NAMES))
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
        raise BadGarment(f"{name}: unknown rule for pins", f"'{rule}'", _CURE) from error
