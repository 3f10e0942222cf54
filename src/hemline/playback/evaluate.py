"""Evaluation of a model on a motion: times, errors, and vertices inside the body."""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from hemline.animators.base import Animator, Level
from hemline.arrays import Vertices
from hemline.bodies.body import ShapedBody
from hemline.collide import Guarantee
from hemline.datasets import Dataset, Take, newest
from hemline.errors import BadInput
from hemline.garments import Garment
from hemline.motions.motion import Motion
from hemline.playback.player.frame import Frame
from hemline.playback.player.layers import THICKNESS_MM
from hemline.playback.player.player import Player

from .detail import level_of
from .play import play_on
from .tally import Tally


@dataclass(frozen=True)
class Evaluation:
    """Figures of an evaluation, and its worst frame."""

    figures: dict[str, Any]
    """The JSON that scripts rely on; keys as in docs/design.md."""
    garment: Garment
    """The garment that was shown: that of the animator, or a coarser level of it."""
    worst: Frame
    """The frame with the largest error, or the most vertices inside before the projection."""
    worst_index: int
    """Number of the worst frame."""
    worst_truth: np.ndarray | None
    """Simulated vertices of the worst frame, (verts, 3) [m]; None without ground truth."""


def takes_of(truth: Dataset, motion: Motion, betas: np.ndarray) -> list[Take]:
    """Returns the takes of one clip on one body shape, part by part, from the newest simulator only.

    Raises:
        BadInput: The dataset holds none.
    """
    shape = np.trim_zeros(np.asarray(betas, np.float32), "b")
    rows = [
        row
        for row in truth.clips()
        if row.clip == motion.name and np.array_equal(np.trim_zeros(np.asarray(row.betas, np.float32), "b"), shape)
    ]
    if not rows:
        clips = ", ".join(sorted({row.clip for row in truth.clips()})) or "nothing"
        raise BadInput(
            f"the truth holds no take of clip '{motion.name}' on this body",
            f"takes of {clips}",
            "simulate it with 'hemline simulate'",
        )
    return [truth.take(row) for row in newest(rows, f"clip '{motion.name}' in {truth.folder}")]


def evaluate(
    animator: Animator,
    body: ShapedBody,
    motion: Motion,
    *,
    truth: Dataset | None = None,
    drive: str = "own",
    fps: float = 30.0,
    start: float = 0.0,
    seconds: float | None = None,
    guarantee: Guarantee = "exact",
    untangle: bool = False,
    whole: bool = True,
    detail: float = 1.0,
    thickness_mm: float = THICKNESS_MM,
    keep: Callable[[Frame], None] | None = None,
) -> Evaluation:
    """Plays a motion and measures its frames.

    Everything is compiled before the first frame is timed; the time of that is the figure `compile_s`.

    Args:
        animator: A fitted animator.
        body: The body.
        motion: The motion. With ground truth, the takes' own poses are played instead: the same clip, untangled and
            placed as it was simulated.
        truth: A dataset with takes of this clip and shape.
        drive: `own`: the animator's own dynamics; `truth`: it is driven by the simulated vertices.
        fps: Frames a second, where there is no ground truth.
        start: Where in the motion to begin to measure; what comes before is played, too [s].
        seconds: How much to measure; None: to the end [s].
        guarantee: As for `play`.
        untangle: As for `play`.
        whole: As for `play`.
        detail: As for `play`; errors are those of the vertices that are left.
        thickness_mm: As for `Player.prepare` [mm].
        keep: Called with each frame, to record it.

    Returns:
        Figures and the worst frame.

    Raises:
        BadInput: `drive` is neither, or is `truth` without one, or the ground truth lacks the clip; or no frame is left
            to measure.
    """
    if drive not in ("own", "truth"):
        raise BadInput("drive must be 'own' or 'truth'", repr(drive), "name one of them")
    if drive == "truth" and truth is None:
        raise BadInput("drive 'truth' needs simulated takes", "none", "name a dataset with --truth")
    takes = None if truth is None else takes_of(truth, motion, body.betas)
    fps = fps if takes is None else takes[0].motion.fps
    level = level_of(animator, detail)
    options = {"guarantee": guarantee, "whole": whole, "detail": detail, "thickness_mm": thickness_mm}
    player = Player.prepare(animator, body, placed=True, **options)
    placed = body.placed(motion) if takes is None else takes[0].motion
    compile_s = player.warm_up(placed[0])
    tally = Tally(level, keep)
    last = math.inf if seconds is None else start + seconds
    played = _frames(player, placed, takes, drive, fps, untangle)
    for index, (frame, reference) in enumerate(played):
        if index / fps > last + 1e-9:
            break
        if index / fps >= start - 1e-9:
            shown = reference[level.vertex_ids] if reference is not None and isinstance(level, Level) else reference
            tally.add(frame, shown, fps)
    worst_index, worst, worst_truth = tally.worst_frame()
    figures = {
        "animator": animator.name,
        "drive": drive,
        "detail": detail,
        "fps": fps,
        "compile_s": compile_s,
    } | tally.figures()
    return Evaluation(figures, level.garment, worst, worst_index, worst_truth)


def _frames(
    player: Player, motion: Motion, takes: list[Take] | None, drive: str, fps: float, untangle: bool
) -> Iterator[tuple[Frame, Vertices | None]]:
    """Yields the frames of a placed clip without its lead-in, each with its ground truth where there is one."""
    if takes is None:
        for frame in play_on(player, motion, fps=fps, untangle=untangle):
            yield frame, None
        return
    for take in takes:
        truth = take.vertices if drive == "truth" else None
        for index, frame in enumerate(play_on(player, take.motion, fps=None, truth=truth)):
            if not take.lead_in[index]:
                yield frame, take.vertices[index]
