"""The figures of a model on a motion: milliseconds, millimetres, vertices inside."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from hemline.animators.base import Animator
from hemline.bodies.shaped import ShapedBody
from hemline.collide.winding import inside
from hemline.datasets import Dataset, Take
from hemline.errors import BadInput
from hemline.metrics import deepest_mm, edge_strain
from hemline.motions.motion import Motion

from .play import Frame, play


@dataclass(frozen=True)
class Evaluation:
    """Figures, and the worst frame to look at."""

    figures: dict[str, Any]
    """The JSON that scripts rely on; keys as in docs/design.md."""
    worst: Frame
    """The frame with the largest error, or the most vertices inside before the projection."""
    worst_index: int
    worst_truth: np.ndarray | None
    """The truth of that frame, (verts, 3) [m]."""


def takes_of(truth: Dataset, motion: Motion, betas: np.ndarray) -> list[Take]:
    """The takes of one clip on one body shape, part by part.

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
        held = ", ".join(sorted({row.clip for row in truth.clips()})) or "nothing"
        raise BadInput(
            f"the truth holds no take of clip '{motion.name}' on this body",
            f"takes of {held}",
            "simulate it with 'hemline simulate'",
        )
    return [truth.take(row) for row in rows]


def evaluate(
    animator: Animator,
    body: ShapedBody,
    motion: Motion,
    *,
    truth: Dataset | None = None,
    drive: str = "own",
    fps: float = 30.0,
    guarantee: str = "exact",
    untangle: bool = False,
) -> Evaluation:
    """Play a motion and measure.

    Args:
        animator: A fitted animator.
        body: The body.
        motion: The motion. With a truth, the takes' own poses are played instead: the same clip, untangled and placed
            as it was simulated.
        truth: A dataset with takes of this clip and shape.
        drive: `own`: the animator's bones; `truth`: bones embedded in the truth.
        fps: Frames a second, where there is no truth.
        guarantee: As for `play`.
        untangle: As for `play`.

    Returns:
        Figures and the worst frame.

    Raises:
        BadInput: `drive` is neither, or is `truth` without one, or the truth lacks the clip.
    """
    if drive not in ("own", "truth"):
        raise BadInput("drive must be 'own' or 'truth'", repr(drive), "name one of them")
    if drive == "truth" and truth is None:
        raise BadInput("drive 'truth' needs simulated takes", "none", "name a dataset with --truth")
    tally = _Tally(animator)
    if truth is None:
        for frame in play(animator, body, motion, fps=fps, guarantee=guarantee, untangle=untangle):
            tally.add(frame, None)
    else:
        takes = takes_of(truth, motion, body.betas)
        fps = takes[0].motion.fps
        for take in takes:
            driven = take.vertices if drive == "truth" else None
            frames = play(animator, body, take.motion, fps=None, guarantee=guarantee, placed=True, truth=driven)
            for index, frame in enumerate(frames):
                if not take.lead_in[index]:
                    tally.add(frame, take.vertices[index])
    return tally.evaluation(fps, drive)


class _Tally:
    """Sums over frames; a clip's length does not grow the memory but by a few numbers a frame."""

    def __init__(self, animator: Animator):
        self.animator = animator
        self.milliseconds: list[dict[str, float]] = []
        self.before: list[int] = []
        self.after: list[int] = []
        self.pinched: list[int] = []
        self.depth_before: list[float] = []
        self.depth_after: list[float] = []
        self.strain: list[np.ndarray] = []
        self.errors: list[np.ndarray] = []
        self.recent: list[np.ndarray] = []
        self.recent_truth: list[np.ndarray] = []
        self.jerks: list[tuple[float, float]] = []
        self.worst: tuple[float, int, Frame, np.ndarray | None] | None = None

    def add(self, frame: Frame, truth: np.ndarray | None) -> None:
        posed, faces = frame.body, frame.body.shaped.body.faces
        inside_before = inside(posed.vertices, faces, frame.animated)
        inside_after = inside(posed.vertices, faces, frame.vertices)
        inside_after[frame.report.pinched] = False
        self.milliseconds.append(dict(frame.milliseconds))
        self.before.append(int(inside_before.sum()))
        self.after.append(int(inside_after.sum()))
        self.pinched.append(len(frame.report.pinched))
        self.depth_before.append(deepest_mm(posed.vertices, faces, frame.animated, inside_before))
        self.depth_after.append(deepest_mm(posed.vertices, faces, frame.vertices, inside_after))
        self.strain.append(
            edge_strain.strains(frame.vertices, self.animator.garment.faces, self.animator.garment.rest_edges)
        )
        badness = float(inside_before.sum())
        if truth is not None:
            error = np.linalg.norm(frame.vertices - truth, axis=1) * 1e3
            self.errors.append(error)
            badness = float(error.mean())
        self._jerk(frame, truth)
        if self.worst is None or badness > self.worst[0]:
            self.worst = (badness, len(self.before) - 1, frame, truth)

    def _jerk(self, frame: Frame, truth: np.ndarray | None) -> None:
        self.recent = [*self.recent[-3:], frame.vertices]
        self.recent_truth = [] if truth is None else [*self.recent_truth[-3:], truth]

    def evaluation(self, fps: float, drive: str) -> Evaluation:
        raise RuntimeError
