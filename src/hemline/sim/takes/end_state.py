"""Checks of the end state that the next part of a clip continues from, before kernels without bounds checks run on it.

Takes are copied from one dataset to another, so that the file of a part may come from anywhere.
"""

import functools
from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from hemline.collide.surface.box_kernels import BLOCK, GROUP
from hemline.collide.surface.patches import make_patches
from hemline.datasets.take_checks import MAKE_AGAIN, PELVIS_LIMIT, VERTEX_LIMIT
from hemline.errors import BadDataset, BadInput
from hemline.files.contents import array_of
from hemline.motions.motion import JOINT_COUNT

from .setup import Setup, shaped_body

if TYPE_CHECKING:
    from hemline.bodies import Body

EndState = Mapping[str, np.ndarray]
"""Arrays by name, as `simulate` returns them."""

MAX_SPEED = 1000.0
"""Maximum speed of a vertex, and maximum change of its velocity in a step [m/s]; a step fails at a sixteenth of it."""

MAX_LOAD = 1e6
"""Maximum force of the body on a vertex [N]."""


def check_end_state(
    end: EndState,
    count: int,
    body: "Body",
    skin_faces: int,
    *,
    owner: str,
    error: type[BadInput] = BadInput,
    cure: str = "give the 'end_state' of a take of this garment on this body",
) -> None:
    """Checks that an end state is possible for a garment on a body.

    Args:
        end: The state.
        count: Number of vertices of the garment.
        body: The body.
        skin_faces: Number of faces of its surface as the projection cuts it.
        owner: Name of the state's owner in errors.
        error: Class of error to raise.
        cure: Advice in errors.

    Raises:
        error: An array is missing, unknown, of another type or shape, names a face that does not exist, or has lengths,
            velocities or forces that are impossible for cloth.
    """
    groups, blocks = -(-count // GROUP), -(-count // BLOCK)
    numbers = {
        "translation": ("float32", (3,), PELVIS_LIMIT),
        "positions": ("float64", (count, 3), VERTEX_LIMIT),
        "velocities": ("float64", (count, 3), MAX_SPEED),
        "change": ("float64", (count, 3), MAX_SPEED),
        "load": ("float64", (count,), MAX_LOAD),
        "time": ("float64", (1,), 1e9),
        "rotations": ("float32", (JOINT_COUNT, 4), 1.1),
        "projector.heights": ("float32", (count,), PELVIS_LIMIT),
        "projector.offsets": ("float32", (count, 3), VERTEX_LIMIT),
    }
    """Type, shape and maximum size of measured values; positions are relative to the pelvis."""
    wholes = {
        "pinched": ("uint8", (count,), 0, 1),
        "contact_history": ("int32", (count, 2), -1, len(body.faces) - 1),
        "projector.frame": (("int64", "int32"), (1,), 0, 2**31),
        "projector.anchors": ("int32", (count,), 0, skin_faces - 1),
        "projector.directions": ("int8", (groups,), 0, 5),
        "projector.hidden": ("uint8", (groups,), 0, 1),
        "projector.lively": ("uint8", (blocks,), 0, 1),
    }
    """Type, shape, minimum and maximum of counted values: faces (-1 for none), axes and flags."""
    unknown = sorted(end.keys() - numbers.keys() - wholes.keys())
    if unknown:
        raise error(f"{owner} has an end state with unknown arrays", ", ".join(unknown[:5]), cure)

    def of(name: str, dtype: str | tuple[str, ...], shape: tuple[int, ...]) -> np.ndarray:
        return array_of(end, name, dtype, shape, owner=f"the end state of {owner}", error=error, cure=cure)

    pelvis = of("translation", "float32", (3,)).astype(np.float64)
    for name, (dtype, shape, most) in numbers.items():
        array = of(name, dtype, shape)
        largest = float(np.abs(array - pelvis if name == "positions" else array).max(initial=0.0))
        if largest > most:
            what = f"array '{name}' of the end state of {owner} has values that no cloth has"
            raise error(what, f"{largest:.3g}, beyond {most:g}", cure)
    if "contact_history" not in end:
        del wholes["contact_history"]  # from before cloth had one
    off = float(np.abs(np.linalg.norm(end["rotations"], axis=1) - 1).max())
    if off > 0.01:
        raise error(f"rotations of the end state of {owner} must be unit quaternions", f"one {off:.3g} off", cure)
    for name, (dtype, shape, least, most) in wholes.items():
        array = of(name, dtype, shape)
        low, high = int(array.min(initial=least)), int(array.max(initial=least))
        if low < least or high > most:
            what = f"array '{name}' of the end state of {owner} must be from {least} to {most}"
            raise error(what, f"{low} to {high}", cure)


def check_end_of_take(end: EndState, setup: Setup, betas: tuple[float, ...], path: str) -> None:
    """Checks that the end state of a stored take can be continued; see `check_end_state`.

    Raises:
        BadDataset: It does not belong to this garment on this body.
    """
    count, faces = len(setup.garment.vertices), _skin_faces(setup, betas)
    check_end_state(end, count, setup.body, faces, owner=path, error=BadDataset, cure=MAKE_AGAIN)


@functools.lru_cache(maxsize=4)
def _skin_faces(setup: Setup, betas: tuple[float, ...]) -> int:
    """Returns the number of faces of the body's surface as the projection cuts it; it depends on the shape."""
    return len(make_patches(shaped_body(setup, betas)).faces)
