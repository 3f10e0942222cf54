"""What the next part of a clip goes on from, checked before kernels without bounds run on it.

Takes are copied from one dataset to another, so that the file of a part may be anybody's.
"""

import functools
from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from hemline.collide.surface.box_kernels import BLOCK, GROUP
from hemline.collide.surface.patches import make_patches
from hemline.datasets.take_checks import FARTHEST, FARTHEST_PELVIS, MAKE_AGAIN
from hemline.errors import BadDataset, BadInput
from hemline.files.contents import array_of
from hemline.motions.motion import JOINT_COUNT

from .setup import Setup, shaped

if TYPE_CHECKING:
    from hemline.bodies import Body

EndState = Mapping[str, np.ndarray]
"""Arrays by name, as `simulate` returns them."""

FASTEST = 1000.0
"""No vertex is faster, nor changes its velocity by more in a step [m/s]; a step fails at a sixteenth of it."""

HEAVIEST = 1e6
"""The body presses on no vertex with more force [N]."""


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
    """Refuse an end state that no simulation of a garment on a body can have.

    Args:
        end: The state.
        count: Vertices of the garment.
        body: The body.
        skin_faces: Faces of its surface as the projection cuts it.
        owner: What an error calls it.
        error: The class to raise.
        cure: What to do about it.

    Raises:
        error: An array is missing, or unknown, or of another type or shape, names a face that there is not, or has
            lengths, velocities or forces that no cloth has.
    """
    groups, blocks = -(-count // GROUP), -(-count // BLOCK)
    numbers = {
        "translation": ("float32", (3,), FARTHEST_PELVIS),
        "positions": ("float64", (count, 3), FARTHEST),
        "velocities": ("float64", (count, 3), FASTEST),
        "change": ("float64", (count, 3), FASTEST),
        "load": ("float64", (count,), HEAVIEST),
        "time": ("float64", (1,), 1e9),
        "rotations": ("float32", (JOINT_COUNT, 4), 1.1),
        "projector.heights": ("float32", (count,), FARTHEST_PELVIS),
        "projector.offsets": ("float32", (count, 3), FARTHEST),
    }
    """Type, shape and largest size of what is measured; positions are measured from the pelvis."""
    wholes = {
        "pinched": ("uint8", (count,), 0, 1),
        "contact_history": ("int32", (count, 2), -1, len(body.faces) - 1),
        "projector.frame": (("int64", "int32"), (1,), 0, 2**31),
        "projector.anchors": ("int32", (count,), 0, skin_faces - 1),
        "projector.directions": ("int8", (groups,), 0, 5),
        "projector.hidden": ("uint8", (groups,), 0, 1),
        "projector.lively": ("uint8", (blocks,), 0, 1),
    }
    """Type, shape, least and largest of what is counted: faces, where -1 is none, axes, and whether or not."""
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
    """Refuse the end state of a take on disk that cannot be gone on from; see `check_end_state`.

    Raises:
        BadDataset: It cannot be one of this garment on this body.
    """
    count, faces = len(setup.garment.vertices), _skin_faces(setup, betas)
    check_end_state(end, count, setup.body, faces, owner=path, error=BadDataset, cure=MAKE_AGAIN)


@functools.lru_cache(maxsize=4)
def _skin_faces(setup: Setup, betas: tuple[float, ...]) -> int:
    """Faces of the body's surface as the projection cuts it; how many depends on the shape."""
    return len(make_patches(shaped(setup, betas)).faces)
