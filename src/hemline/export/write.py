"""The table of export formats, and the function that writes any of them by the ending of a path."""

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
"""Writer of each format, by the ending of its files. Help, README and docs are tested against this table."""

PAGE_ENDING = ".html"
"""Ending of a page, which the package `hemline.web` writes."""
SKINNED_ENDINGS = (".glb", ".usdc")
"""Formats that can store a garment as a skinned mesh."""
QUANTIZED_ENDINGS = (".glb",)
"""Formats that can be quantised to fewer bytes per number."""
PICTURES = (".png", ".webp")
"""Formats that are pictures of the clip."""
_PICTURE_SIZES = {write_still: (640, 640), write_moving: (480, 480)}


def write(
    path: str | Path,
    clip: Clip,
    *,
    view: str = AUTO,
    size: tuple[int, int] | None = None,
    quantized: bool = False,
) -> tuple[Path, ...]:
    """Writes a clip in the format named by the ending of the path, whole or not at all.

    Args:
        path: The file to write; its folder must exist.
        clip: The clip. If it has a skin (`skin_clip`), the garment follows bones in GLB and USD.
        view: View of pictures: one of `hemline.pictures.VIEWS_DEG`, or `"auto"` for the view that shows most of the
            garment.
        size: Width and height of pictures [pixels]; None: 640 x 640 for a still, 480 x 480 for a moving picture.
        quantized: Whether to use fewer bytes per number (GLB).

    Returns:
        The files written: several where a format stores one mesh or one frame per file.

    Raises:
        BadOutput: The ending names no format, or the path cannot be written.
        BadInput: The view is unknown, or the format does not support a skinned garment or quantisation.
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
    """Refuses a path that `write` could not write, before any work is done.

    Raises:
        BadOutput: The ending names no format, or the folder cannot be written.
        BadInput: The format does not support a skinned garment or quantisation, which is asked for.
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
