"""The ending of a path chooses the format."""

from collections.abc import Callable
from functools import partial
from pathlib import Path

from hemline.errors import BadInput, BadOutput
from hemline.export.glb.glb import write_glb
from hemline.export.usd.usd import write_usd
from hemline.export.vrm.vrm import VRM_ENDING
from hemline.files import check_writable
from hemline.pictures import AUTO

from .clip import Clip
from .images import write_moving, write_still
from .mdd import write_mdd
from .npz import write_npz
from .obj import write_obj
from .pc2 import write_pc2
from .textures import write_textures

FORMATS: dict[str, Callable[..., tuple[Path, ...]]] = {
    ".glb": write_glb,
    ".mdd": write_mdd,
    ".npz": write_npz,
    ".obj": write_obj,
    ".pc2": write_pc2,
    ".png": write_still,
    ".usdc": write_usd,
    ".vat": write_textures,
    ".webp": write_moving,
}
"""What writes each ending."""

PAGE_ENDING = ".html"
"""Ending of a page, which the room `web` writes."""
SKINNED_ENDINGS = (".glb", ".usdc")
"""Formats that hold a garment as a skinned mesh."""
QUANTIZED_ENDINGS = (".glb",)
"""Formats that can be written in fewer bytes a number."""
_PICTURE_SIZES = {write_still: (640, 640), write_moving: (480, 480)}


def write(
    path: str | Path,
    clip: Clip,
    *,
    view: str = AUTO,
    size: tuple[int, int] | None = None,
    quantized: bool = False,
) -> tuple[Path, ...]:
    """Write a clip in the format that the path's ending names, whole or not at all.

    Args:
        path: Where to; its folder must exist.
        clip: What. With a skin (`skinned`), the garment follows bones in GLB and USD.
        view: From where pictures are taken: one of `hemline.pictures.VIEWS_DEG`, or `"auto"` for the one from which
            most of the garment is seen.
        size: Width and height of pictures [pixels]; None is 640 x 640 for a still, 480 x 480 for a moving picture.
        quantized: Use fewer bytes a number (GLB).

    Returns:
        The files written: one, or more where a format holds one mesh or one frame a file.

    Raises:
        BadOutput: The ending names no format, or the path cannot be written.
        BadInput: The view has no such name; the format holds no skinned garment, or cannot be quantised.
        MissingExtra: The format needs a library that is not installed.
    """
    path = Path(path)
    check_format(path, skinned=clip.skin is not None, quantized=quantized)
    writer = FORMATS[path.suffix.lower()]
    if writer in _PICTURE_SIZES:
        writer = partial(writer, view=view, size=size or _PICTURE_SIZES[writer])
    if quantized:
        writer = partial(writer, quantized=True)
    return writer(path, clip)


def check_format(path: str | Path, *, skinned: bool = False, quantized: bool = False) -> None:
    """Refuse a path that `write` could not write, before the work is done.

    Raises:
        BadOutput: The ending names no format, or the folder cannot be written.
        BadInput: The format holds no skinned garment, or cannot be quantised, where that is asked for.
    """
    path = Path(path)
    ending = path.suffix.lower()
    if ending == VRM_ENDING:
        cure = f"write one with 'hemline character MODEL -o {path.name}'"
        raise BadOutput(f"{VRM_ENDING} holds a character at rest and no motion", path.name, cure)
    if ending == PAGE_ENDING:
        cure = f"write one with 'hemline page MODEL -o {path.name}'"
        raise BadOutput(f"{PAGE_ENDING} is a page that plays models, no clip", path.name, cure)
    if ending not in FORMATS:
        raise BadOutput(f"cannot write {path}", f"the ending '{path.suffix}'", f"choose one of {' '.join(FORMATS)}")
    if skinned and ending not in SKINNED_ENDINGS:
        raise BadInput("the format holds no skinned garment", path.name, f"choose one of {' '.join(SKINNED_ENDINGS)}")
    if quantized and ending not in QUANTIZED_ENDINGS:
        raise BadInput("the format cannot be quantised", path.name, f"choose {' '.join(QUANTIZED_ENDINGS)}")
    check_writable(path)
