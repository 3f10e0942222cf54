"""The figures of a model on a motion: milliseconds, millimetres, vertices inside."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from hemline.animators import name_of
from hemline.animators.base import Animator
from hemline.bodies.body import ShapedBody
from hemline.collide import Guarantee
from hemline.collide.winding.numbers import inside
from hemline.datasets import Dataset, Take
from hemline.errors import BadInput
from hemline.metrics import deepest_mm, edge_strain, edge_strains, frame_ms, jerk_m_s3
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
    guarantee: Guarantee = "exact",
    untangle: bool = False,
    keep: Callable[[Frame], None] | None = None,
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
        keep: Called with each frame, to record it.

    Returns:
        Figures and the worst frame.

    Raises:
        BadInput: `drive` is neither, or is `truth` without one, or the truth lacks the clip.
    """
    if drive not in ("own", "truth"):
        raise BadInput("drive must be 'own' or 'truth'", repr(drive), "name one of them")
    if drive == "truth" and truth is None:
        raise BadInput("drive 'truth' needs simulated takes", "none", "name a dataset with --truth")
    tally = _Tally(animator, keep)
    if truth is None:
        for frame in play(animator, body, motion, fps=fps, guarantee=guarantee, untangle=untangle):
            tally.add(frame, None, fps)
    else:
        takes = takes_of(truth, motion, body.betas)
        fps = takes[0].motion.fps
        for take in takes:
            driven = take.vertices if drive == "truth" else None
            frames = play(animator, body, take.motion, fps=None, guarantee=guarantee, placed=True, truth=driven)
            for index, frame in enumerate(frames):
                if not take.lead_in[index]:
                    tally.add(frame, take.vertices[index], fps)
    return tally.evaluation(fps, drive)


class _Tally:
    """Figures gathered frame by frame: what is kept of a frame is a few numbers and one error a vertex."""

    def __init__(self, animator: Animator, keep: Callable[[Frame], None] | None):
        self.animator, self.keep = animator, keep
        self.milliseconds: list[dict[str, float]] = []
        self.before: list[int] = []
        self.after: list[int] = []
        self.pinched: list[int] = []
        self.depth_mm: list[tuple[float, float]] = []
        self.strains: list[np.ndarray] = []
        self.errors_mm: list[np.ndarray] = []
        self.jerks: list[tuple[float, float]] = []
        self.recent: list[tuple[np.ndarray, np.ndarray]] = []
        self.badness = -1.0
        self.worst: tuple[int, Frame, np.ndarray | None] | None = None

    def add(self, frame: Frame, truth: np.ndarray | None, fps: float) -> None:
        posed, garment = frame.body, self.animator.garment
        faces = posed.shaped.body.faces
        before = inside(posed.vertices, faces, frame.animated)
        after = inside(posed.vertices, faces, frame.vertices)
        after[frame.report.pinched] = False
        self.milliseconds.append(dict(frame.milliseconds))
        self.before.append(int(before.sum()))
        self.after.append(int(after.sum()))
        self.pinched.append(len(frame.report.pinched))
        self.depth_mm.append(
            (
                deepest_mm(posed.vertices, faces, frame.animated, before),
                deepest_mm(posed.vertices, faces, frame.vertices, after),
            )
        )
        self.strains.append(edge_strains(frame.vertices, garment.faces, garment.rest_edges).astype(np.float32))
        if truth is not None:
            self.errors_mm.append((np.linalg.norm(frame.vertices - truth, axis=1) * 1e3).astype(np.float32))
            self._add_jerk(frame.vertices, truth, fps)
        badness = float(self.errors_mm[-1].mean() if truth is not None else before.sum())
        if badness > self.badness:
            self.badness, self.worst = badness, (len(self.before) - 1, frame, truth)
        if self.keep is not None:
            self.keep(frame)

    def _add_jerk(self, vertices: np.ndarray, truth: np.ndarray, fps: float) -> None:
        self.recent = [*self.recent[-3:], (vertices, truth)]
        if len(self.recent) == 4:
            ours, theirs = (np.stack(each) for each in zip(*self.recent, strict=True))
            self.jerks.append((jerk_m_s3(ours, fps), jerk_m_s3(theirs, fps)))

    def evaluation(self, fps: float, drive: str) -> Evaluation:
        from hemline.compiled import threads

        if self.worst is None:
            raise BadInput("a motion must have a frame", "none after the lead-in", "take a longer stretch")
        index, frame, truth = self.worst
        counts = np.array([self.before, self.after, self.pinched], np.float64)
        percent = 100.0 * counts / len(frame.vertices)
        own, theirs = np.mean(self.jerks, axis=0) if self.jerks else (0.0, 0.0)
        figures: dict[str, Any] = {
            "animator": name_of(self.animator),
            "drive": drive,
            "vertices": len(frame.vertices),
            "frames": len(self.before),
            "fps": fps,
            "threads": threads(),
            "frame_ms": frame_ms(self.milliseconds),
            "inside_percent": {
                "before": percent[0].mean(),
                "after": percent[1].mean(),
                "worst_frame_after": percent[1].max(),
                "pinched": percent[2].mean(),
            },
            "deepest_mm": {"before": max(d[0] for d in self.depth_mm), "after": max(d[1] for d in self.depth_mm)},
            "edge_strain": edge_strain(np.stack(self.strains)),
            "vertex_error_mm": _error(self.errors_mm),
            "jerk_m_s3": {"mean": own, "ratio": own / theirs} if self.jerks and theirs else None,
            "worst_frame": index,
        }
        return Evaluation(_plain(figures), frame, index, truth)


def _error(errors_mm: list[np.ndarray]) -> dict[str, float] | None:
    if not errors_mm:
        return None
    every = np.stack(errors_mm)
    return {"mean": every.mean(dtype=np.float64), "p95": np.percentile(every, 95), "max": every.max()}


def _plain(value: Any) -> Any:
    """NumPy's numbers as Python's, for JSON."""
    if isinstance(value, dict):
        return {key: _plain(inner) for key, inner in value.items()}
    return value.item() if isinstance(value, np.generic) else value
