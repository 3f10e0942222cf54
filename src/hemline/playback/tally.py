"""Figures of played frames, gathered one by one."""

from collections.abc import Callable
from typing import Any

import numpy as np

from hemline.animators.base import Animator
from hemline.arrays import Vertices
from hemline.collide import inside
from hemline.compiled import threads
from hemline.errors import BadInput
from hemline.metrics import deepest_mm, edge_strain, edge_strains, frame_ms, inside_percent, jerk_m_s3

from .frame import Frame


class Tally:
    """Figures gathered frame by frame: what is kept of a frame is a few numbers, and a row of errors and of strains.

    Args:
        animator: Whose frames they are.
        keep: Called with each frame, to record it.
    """

    def __init__(self, animator: Animator, keep: Callable[[Frame], None] | None = None):
        self.animator, self.keep = animator, keep
        self._milliseconds: list[dict[str, float]] = []
        self._inside: dict[str, list[np.ndarray]] = {"before": [], "after": [], "pinched": []}
        self._deepest_mm: dict[str, float] = {"before": 0.0, "after": 0.0}
        self._strains: list[np.ndarray] = []
        self._errors_mm: list[np.ndarray] = []
        self._jerks: list[tuple[float, float]] = []
        self._recent: list[tuple[np.ndarray, np.ndarray]] = []
        self._badness = -1.0
        self._worst: tuple[int, Frame, Vertices | None] | None = None

    def add(self, frame: Frame, truth: Vertices | None, fps: float) -> None:
        """Measure one more frame.

        Args:
            frame: The frame.
            truth: The simulated garment in it, if there is one [m].
            fps: Frames a second.
        """
        inside_before = self._count_inside(frame)
        self._milliseconds.append(dict(frame.milliseconds))
        garment = self.animator.garment
        self._strains.append(edge_strains(frame.vertices, garment.faces, garment.rest_edges).astype(np.float32))
        if truth is not None:
            self._errors_mm.append((np.linalg.norm(frame.vertices - truth, axis=1) * 1e3).astype(np.float32))
            self._add_jerk(frame.vertices, truth, fps)
        badness = float(self._errors_mm[-1].mean() if truth is not None else inside_before)
        if badness > self._badness:
            self._badness, self._worst = badness, (len(self._milliseconds) - 1, frame, truth)
        if self.keep is not None:
            self.keep(frame)

    def worst_frame(self) -> tuple[int, Frame, Vertices | None]:
        """Number, frame and ground truth of that with the largest error; without one, with most vertices inside before.

        Raises:
            BadInput: No frame was added.
        """
        if self._worst is None:
            raise BadInput("a motion must have a frame to measure", "none", "take a longer stretch")
        return self._worst

    def figures(self) -> dict[str, Any]:
        """All that was measured, as plain numbers; keys as in `docs/design.md`."""
        before, after, pinched = (np.stack(self._inside[name]) for name in ("before", "after", "pinched"))
        clean = inside_percent(after, pinched)
        own, theirs = np.mean(self._jerks, axis=0) if self._jerks else (0.0, 0.0)
        found: dict[str, Any] = {
            "vertices": before.shape[1],
            "frames": len(before),
            "threads": threads(),
            "frame_ms": frame_ms(self._milliseconds),
            "inside_percent": {
                "before": inside_percent(before)["mean"],
                "after": clean["mean"],
                "worst_frame_after": clean["worst_frame"],
                "pinched": clean["pinched"],
            },
            "deepest_mm": self._deepest_mm,
            "edge_strain": edge_strain(np.stack(self._strains)),
            "vertex_error_mm": self._error(),
            "jerk_m_s3": {"mean": own, "ratio": own / theirs} if self._jerks and theirs else None,
            "worst_frame": self.worst_frame()[0],
        }
        return _plain(found)

    def _count_inside(self, frame: Frame) -> int:
        """Count vertices inside, before and after the projection; how many there were before."""
        body, faces = frame.body.vertices, frame.body.faces
        before, after = inside(body, faces, frame.animated), inside(body, faces, frame.vertices)
        pinched = np.zeros(len(after), bool)
        pinched[frame.report.pinched] = True
        for name, value in (("before", before), ("after", after), ("pinched", pinched)):
            self._inside[name].append(value)
        depths = {"before": (frame.animated, before), "after": (frame.vertices, after & ~pinched)}
        for name, (vertices, which) in depths.items():
            self._deepest_mm[name] = max(self._deepest_mm[name], deepest_mm(body, faces, vertices, which))
        return int(before.sum())

    def _add_jerk(self, vertices: np.ndarray, truth: np.ndarray, fps: float) -> None:
        self._recent = [*self._recent[-3:], (vertices, truth)]
        if len(self._recent) == 4:
            ours, theirs = (np.stack(each) for each in zip(*self._recent, strict=True))
            figures = jerk_m_s3(ours, fps, theirs)
            self._jerks.append((figures["mean"] or 0.0, figures["truth"] or 0.0))

    def _error(self) -> dict[str, float] | None:
        if not self._errors_mm:
            return None
        every = np.stack(self._errors_mm)
        return {"mean": every.mean(dtype=np.float64), "p95": np.percentile(every, 95), "max": every.max()}


def _plain(value: Any) -> Any:
    """NumPy's numbers as Python's, for JSON."""
    if isinstance(value, dict):
        return {key: _plain(inner) for key, inner in value.items()}
    return value.item() if isinstance(value, np.generic) else value
