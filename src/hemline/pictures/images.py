"""Writing of pictures to files, and composition of several pictures."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from hemline.errors import BadInput, BadOutput
from hemline.files import atomic_write

from .render import AnyPicture, Picture


def write_png(path: str | Path, picture: Picture) -> None:
    """Writes a picture as PNG, whole or not at all.

    Raises:
        BadOutput: The path cannot be written.
    """
    from PIL import Image

    with atomic_write(path) as temporary:
        Image.fromarray(np.ascontiguousarray(picture, np.uint8)).save(temporary, format="PNG")


def write_webp(path: str | Path, frames: Sequence[Picture], fps: float, *, quality: int = 82) -> None:
    """Writes pictures as an endless WebP, whole or not at all.

    The file stores durations in whole milliseconds, which are rounded so that their sum is right: at 30 fps frames last
    33, 34, 33, ... ms.

    Args:
        path: The file to write.
        frames: Pictures of equal size.
        fps: Frames per second.
        quality: Quality from 0 to 100.

    Raises:
        BadOutput: There are no frames, `fps` is beyond 1000, or the path cannot be written.
    """
    from PIL import Image

    if not len(frames) or not 0 < fps <= 1000:
        got = f"{len(frames)} frames at {fps} a second"
        raise BadOutput(f"cannot write {path}", got, "give at least one frame, and at most 1000 a second")
    ends_ms = np.round(1000 / fps * np.arange(len(frames) + 1)).astype(int)
    images = [Image.fromarray(np.ascontiguousarray(frame, np.uint8)) for frame in frames]
    with atomic_write(path) as temporary:
        images[0].save(
            temporary,
            format="WEBP",
            save_all=True,
            append_images=images[1:],
            duration=np.diff(ends_ms).tolist(),
            loop=0,
            quality=quality,
            method=2,
        )


def side_by_side(pictures: Sequence[AnyPicture], captions: Sequence[str] = ()) -> AnyPicture:
    """Joins pictures of equal height in one row, each with a caption at its lower edge.

    Args:
        pictures: At least one picture.
        captions: One caption per picture, or an empty sequence.

    Raises:
        BadInput: There is no picture, or heights or the number of captions do not match.
    """
    heights = {picture.shape[0] for picture in pictures}
    if len(heights) != 1 or len(captions) not in (0, len(pictures)):
        got = f"{len(pictures)} pictures of heights {sorted(heights)} and {len(captions)} captions"
        raise BadInput("pictures do not fit in one row", got, "give pictures of equal height, captions for all or none")
    labelled = [add_caption(*pair) for pair in zip(pictures, captions, strict=True)] if captions else list(pictures)
    return np.concatenate(labelled, axis=1)


def add_caption(picture: Picture, text: str) -> Picture:
    """Writes one line of text at the lower left of a picture."""
    from PIL import Image, ImageDraw, ImageFont

    image = Image.fromarray(np.ascontiguousarray(picture, np.uint8))
    height = picture.shape[0]
    size = max(11, height // 36)
    ImageDraw.Draw(image).text((size, height - 2 * size), text, fill=(60, 60, 64), font=ImageFont.load_default(size))
    return np.asarray(image)
