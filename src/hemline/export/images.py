"""A clip as a picture: a still PNG, or a moving WebP."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from hemline.pictures import AUTO, ShadedSurface, clearest_view, frame_clip, render, write_png, write_webp
from hemline.pictures.render import Picture

from .clip import Clip

VIEW_SAMPLES = 5
"""Frames that are looked at to choose a view."""


def write_still(path: Path, clip: Clip, *, view: str, size: tuple[int, int]) -> tuple[Path, ...]:
    """Write the frame in the middle of the clip as PNG.

    Raises:
        BadInput: The view has no such name.
        BadOutput: The path cannot be written.
    """
    middle = clip.frame_count // 2
    write_png(path, next(render_frames(clip, view=view, size=size, frames=range(middle, middle + 1))))
    return (path,)


def write_moving(path: Path, clip: Clip, *, view: str, size: tuple[int, int]) -> tuple[Path, ...]:
    """Write all frames as a WebP that repeats for ever, the camera going along.

    Raises:
        BadInput: The view has no such name.
        BadOutput: The path cannot be written.
    """
    write_webp(path, list(render_frames(clip, view=view, size=size, frames=range(clip.frame_count))), clip.fps)
    return (path,)


def render_frames(clip: Clip, *, view: str, size: tuple[int, int], frames: range) -> Iterator[Picture]:
    """Pictures of some frames of a clip, on a ground at its lowest vertex.

    Args:
        clip: What to paint.
        view: One of `hemline.pictures.VIEWS_DEG`; `"auto"`: that from which most of the garment is seen, over the clip.
        size: Width and height [pixels].
        frames: Which frames.
    """
    everything = np.concatenate([part.vertices for part in clip.parts], axis=1)
    view = _clearest(clip) if view == AUTO else view
    cameras = frame_clip(everything, view, size=size, fps=clip.fps)
    ground = float(everything[..., 1].min())
    for frame in frames:
        surfaces = [
            ShadedSurface(part.vertices[frame], part.faces, part.colour, sheen=0.0 if part.suffix else 0.08)
            for part in clip.parts
        ]
        yield render(surfaces, cameras[frame], size, ground=ground)


def _clearest(clip: Clip) -> str:
    frames = np.unique(np.linspace(0, clip.frame_count - 1, VIEW_SAMPLES).round().astype(int))
    garment, *others = clip.parts
    return clearest_view(
        [
            ([(garment.vertices[frame], garment.faces)], [(part.vertices[frame], part.faces) for part in others])
            for frame in frames
        ]
    )
