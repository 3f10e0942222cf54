"""A clip as a picture: a still PNG, or a moving WebP."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from hemline.pictures import Surface, frame_clip, render, write_png, write_webp
from hemline.pictures.render import Picture

from .clip import Clip


def write_still(path: Path, clip: Clip, *, view: str, size: tuple[int, int]) -> tuple[Path, ...]:
    """Write the frame in the middle of the clip as PNG.

    Raises:
        BadInput: The view has no such name.
        BadOutput: The path cannot be written.
    """
    middle = clip.frame_count // 2
    write_png(path, next(painted(clip, view=view, size=size, frames=range(middle, middle + 1))))
    return (path,)


def write_moving(path: Path, clip: Clip, *, view: str, size: tuple[int, int]) -> tuple[Path, ...]:
    """Write all frames as a WebP that repeats for ever, the camera going along.

    Raises:
        BadInput: The view has no such name.
        BadOutput: The path cannot be written.
    """
    write_webp(path, list(painted(clip, view=view, size=size, frames=range(clip.frame_count))), clip.fps)
    return (path,)


def painted(clip: Clip, *, view: str, size: tuple[int, int], frames: range) -> Iterator[Picture]:
    """Pictures of some frames of a clip, on a ground at its lowest vertex.

    Args:
        clip: What to paint.
        view: One of `hemline.pictures.VIEWS_DEG`.
        size: Width and height [pixels].
        frames: Which frames.
    """
    everything = np.concatenate([part.vertices for part in clip.parts], axis=1)
    cameras = frame_clip(everything, view, size=size, fps=clip.fps)
    ground = float(everything[..., 1].min())
    for frame in frames:
        surfaces = [
            Surface(part.vertices[frame], part.faces, part.colour, sheen=0.0 if part.suffix else 0.08)
            for part in clip.parts
        ]
        yield render(surfaces, cameras[frame], size, ground=ground)
