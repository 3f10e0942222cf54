"""Pictures to files, and several pictures to one."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from hemline.errors import BadInput, BadOutput
from hemline.files import written_whole

from .render import Picture


def write_png(path: str | Path, picture: Picture) -> None:
    """Write a picture as PNG, whole or not at all.

    Raises:
        BadOutput: The path cannot be written.
    """
    from PIL import Image

    with written_whole(path) as temporary:
        Image.fromarray(np.ascontiguousarray(picture, np.uint8)).save(temporary, format="PNG")


def write_webp(path: str | Path, frames: Sequence[Picture], fps: float, *, quality: int = 82) -> None:
    """Write pictures as one moving WebP that repeats for ever, whole or not at all.

    A frame's time is a whole number of milliseconds in the file, so times are rounded one by one such that the sum is
    right: at 30 fps frames last 33, 34, 33, ... ms.

    Args:
        path: The file.
        frames: Pictures of equal size.
        fps: Frames a second.
        quality: 0 to 100.

    Raises:
        BadOutput: No frames, more frames a second than the format can hold, or the path cannot be written.
    """
    from PIL import Image

    if not len(frames) or not 0 < fps <= 1000:
        got = f"{len(frames)} frames at {fps} a second"
        raise BadOutput(f"cannot write {path}", got, "give at least one frame, and at most 1000 a second")
    ends_ms = np.round(1000 / fps * np.arange(len(frames) + 1)).astype(int)
    images = [Image.fromarray(np.ascontiguousarray(frame, np.uint8)) for frame in frames]
    with written_whole(path) as temporary:
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


def side_by_side(pictures: Sequence[Picture], captions: Sequence[str] = ()) -> Picture:
    """Pictures of equal height in one row, each with its caption above its lower edge.

    Args:
        pictures: At least one.
        captions: None, or one for each picture.

    Raises:
        BadInput: No picture, heights that differ, or another number of captions than of pictures.
    """
    heights = {picture.shape[0] for picture in pictures}
    if len(heights) != 1 or len(captions) not in (0, len(pictures)):
        got = f"{len(pictures)} pictures of heights {sorted(heights)} and {len(captions)} captions"
        raise BadInput("pictures do not fit in one row", got, "give pictures of equal height, captions for all or none")
    labelled = [add_caption(*pair) for pair in zip(pictures, captions, strict=True)] if captions else list(pictures)
    return np.concatenate(labelled, axis=1)


def add_caption(picture: Picture, text: str) -> Picture:
    """The picture with one line of text at its lower left."""
    from PIL import Image, ImageDraw, ImageFont

    image = Image.fromarray(np.ascontiguousarray(picture, np.uint8))
    height = picture.shape[0]
    size = max(11, height // 36)
    ImageDraw.Draw(image).text((size, height - 2 * size), text, fill=(60, 60, 64), font=ImageFont.load_default(size))
    return np.asarray(image)
