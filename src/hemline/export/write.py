"""The ending of a path chooses the format."""

from collections.abc import Callable
from functools import partial
from pathlib import Path

from hemline.errors import BadOutput
from hemline.files import check_writable
from hemline.pictures import AUTO

from .clip import Clip
from .glb import write_glb
from .images import write_moving, write_still
from .mdd import write_mdd
from .npz import write_npz
from .obj import write_obj
from .pc2 import write_pc2
from .usd import write_usd

FORMATS: dict[str, Callable[..., tuple[Path, ...]]] = {
    ".glb": write_glb,
    ".mdd": write_mdd,
    ".npz": write_npz,
    ".obj": write_obj,
    ".pc2": write_pc2,
    ".png": write_still,
    ".usdc": write_usd,
    ".webp": write_moving,
}
"""What writes each ending."""

_SIZES = {write_still: (640, 640), write_moving: (480, 480)}


def write(path: str | Path, clip: Clip, *, view: str = AUTO, size: tuple[int, int] | None = None) -> tuple[Path, ...]:
    """Write a clip in the format that the path's ending names, whole or not at all.

    Args:
        path: Where to; its folder must exist.
        clip: What.
        view: From where pictures are taken: one of `hemline.pictures.VIEWS_DEG`, or `"auto"` for the one from which
            most of the garment is seen.
        size: Width and height of pictures [pixels]; None is 640 x 640 for a still, 480 x 480 for a moving picture.

    Returns:
        The files written: one, or more where a format holds one mesh or one frame a file.

    Raises:
        BadOutput: The ending names no format, or the path cannot be written.
        BadInput: The view has no such name.
        MissingExtra: The format needs a library that is not installed.
    """
    path = Path(path)
    check_format(path)
    writer = FORMATS[path.suffix.lower()]
    if writer in _SIZES:
        writer = partial(writer, view=view, size=size or _SIZES[writer])
    return writer(path, clip)


def check_format(path: str | Path) -> None:
    """Refuse a path that `write` could not write, before the work is done.

    Raises:
        BadOutput: The ending names no format, or the folder cannot be written.
    """
    path = Path(path)
    if path.suffix.lower() not in FORMATS:
        raise BadOutput(f"cannot write {path}", f"the ending '{path.suffix}'", f"choose one of {' '.join(FORMATS)}")
    check_writable(path)
