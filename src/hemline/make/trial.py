"""Plays a method on the clip that is kept back, beside its simulation, and collects the figures that decide."""

from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np

from hemline import metrics
from hemline.animators import Animator
from hemline.bodies import ShapedBody, limb_bones
from hemline.datasets import Dataset, Take
from hemline.meshes import rest_lengths
from hemline.motions import Motion
from hemline.playback import Frame, evaluate

from .slowness import ProcessorShare

TRUTH = "truth"
"""Method name of the simulation itself."""
WORST_FRAMES, WORST_APART = 3, 10
"""Number of worst frames that a report shows, and least number of frames between two of them."""


@dataclass(frozen=True)
class Trial:
    """Figures of one method on the clip that is kept back.

    Attributes:
        method: Name of the animator; `truth` for the simulation itself.
        error_mm: Mean distance of vertices from the simulation [mm].
        stretch_p99: 99th percentile of the stretch of edges, mean over frames [percent].
        stretch_worst: The same in the worst frame [percent].
        skin_seen: Covered skin that shows through the cloth, mean over frames [percent].
        limbs_through: Limbs whose bone goes through the cloth, mean over limbs and frames [percent].
        inside: Vertices inside the body after the projection, worst frame [percent].
        jerk: Jerk relative to that of the simulation.
        frame_ms: Median time of a frame, without the share of it that other programs took [ms].
        model_mb: Size of the model file [MB].
        failed: Why the method could not be fitted or played; empty if it could.
    """

    method: str
    error_mm: float = 0.0
    stretch_p99: float = 0.0
    stretch_worst: float = 0.0
    skin_seen: float = 0.0
    limbs_through: float = 0.0
    inside: float = 0.0
    jerk: float = 1.0
    frame_ms: float = 0.0
    model_mb: float = 0.0
    failed: str = ""

    def entries(self) -> dict[str, Any]:
        """Returns the figures as JSON-like values."""
        return asdict(self)


@dataclass(frozen=True)
class Played:
    """A trial with its frames.

    Attributes:
        trial: The figures.
        frames: All frames.
        worst: Numbers of the frames with the largest errors, the worst one first.
    """

    trial: Trial
    frames: list[Frame] = field(default_factory=list)
    worst: tuple[int, ...] = ()


def run_trial(animator: Animator, body: ShapedBody, motion: Motion, check: Dataset, model_mb: float) -> Played:
    """Plays an animator on the clip that is kept back, and measures it.

    Args:
        animator: The animator.
        body: The body of the check.
        motion: The clip.
        check: Dataset with the simulation of the clip on this body.
        model_mb: Size of the model file [MB].
    """
    frames: list[Frame] = []
    with ProcessorShare() as measured:
        figures = evaluate(animator, body, motion, truth=check, keep=frames.append).figures
    jerk = figures["jerk_m_s3"]
    trial = Trial(
        animator.name,
        figures["vertex_error_mm"]["mean"],
        figures["stretch_percent"]["p99_mean"],
        figures["stretch_percent"]["p99_worst"],
        figures["skin_through_percent"]["mean"],
        figures["limbs_through_percent"]["mean"],
        figures["inside_percent"]["after"],
        1.0 if jerk is None or jerk["ratio"] is None else jerk["ratio"],
        figures["frame_ms"]["median"] * measured.share,
        model_mb,
    )
    truth = truth_vertices(check, motion)
    errors = np.array([np.linalg.norm(f.vertices - t, axis=1).mean() for f, t in zip(frames, truth, strict=True)])
    return Played(trial, frames, _worst_apart(errors))


def truth_trial(check: Dataset, motion: Motion, body: ShapedBody) -> Trial:
    """Returns the figures of the simulation itself, as far as they need no comparison."""
    garment = check.garment
    edges, lengths = rest_lengths(garment.faces, garment.rest_edges)
    counted = ~np.isin(edges, garment.pins.vertices).all(axis=1)
    shown = [(take, int(frame)) for take in _takes(check, motion) for frame in take.clip_frames]
    stretch = metrics.stretch_figures(
        [metrics.stretch_percent(take.vertices[frame], edges[counted], lengths[counted]) for take, frame in shown]
    )
    through = []
    for take, frame in shown:
        posed = body.posed(take.motion[frame])
        cloth = take.vertices[frame], garment.faces
        through.append(metrics.limbs_through(limb_bones(posed.joints), *cloth, posed.vertices, posed.faces))
    return Trial(
        TRUTH,
        stretch_p99=stretch["p99_mean"],
        stretch_worst=stretch["p99_worst"],
        limbs_through=100 * float(np.mean(through)),
    )


def truth_vertices(check: Dataset, motion: Motion) -> np.ndarray:
    """Returns the simulated garment in each frame of a clip, without the lead-in (frames, verts, 3) [m]."""
    return np.concatenate([take.vertices[take.clip_frames] for take in _takes(check, motion)])


def _takes(check: Dataset, motion: Motion) -> list[Take]:
    return [check.take(row) for row in check.clips() if row.clip == motion.name]


def _worst_apart(errors: np.ndarray) -> tuple[int, ...]:
    """Returns the numbers of the frames with the largest errors, none close to another."""
    chosen: list[int] = []
    for frame in np.argsort(-errors):
        if all(abs(int(frame) - other) >= WORST_APART for other in chosen):
            chosen.append(int(frame))
        if len(chosen) == WORST_FRAMES:
            break
    return tuple(chosen)
