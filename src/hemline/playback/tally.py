"""Figures of played frames, measured frame by frame."""

from collections.abc import Callable
from typing import Any

import numpy as np

from hemline import metrics
from hemline.animators.base import Animator
from hemline.animators.own_body import own_body
from hemline.arrays import Vertices
from hemline.bodies import LIMBS, limb_bones
from hemline.collide import LayersReport, inside
from hemline.compiled import threads
from hemline.errors import BadInput
from hemline.meshes import rest_lengths
from hemline.playback.player.frame import Frame

CROSSINGS_EVERY = 10
"""Interval at which crossings of cloth with cloth, skin in front of the cloth, and vertices behind the nearest one
of the body are counted [frames]."""
PROBE_HEIGHT = 0.001
"""Height above the skin at which a point is tested for being inside another part of the body [m]."""


class Tally:
    """Measures frames; of each it stores a few numbers, and rows of errors and strains.

    Args:
        animator: The animator of the frames.
        keep: Called with each frame, to record it.
    """

    def __init__(self, animator: Animator, keep: Callable[[Frame], None] | None = None):
        self.animator, self.keep = animator, keep
        garment = animator.garment
        edges, lengths = rest_lengths(garment.faces, garment.rest_edges)
        counted = ~np.isin(edges, garment.pins.vertices).all(axis=1)
        self._edges, self._lengths = edges[counted], lengths[counted]
        fitted = own_body(animator).shaped(garment.body_betas)
        self._covered = metrics.skin_under_cloth(garment.vertices, garment.faces, fitted.vertices, fitted.normals)
        self._pairs = metrics.neighbouring_faces(garment.faces)
        self._stretches: list[tuple[float, float]] = []
        self._ripples: list[tuple[float, float | None]] = []
        self._milliseconds: list[dict[str, float]] = []
        self._values: dict[str, list[float]] = {}
        self._strains: list[np.ndarray] = []
        self._errors_mm: list[np.ndarray] = []
        self._normal_errors_deg: list[np.ndarray] = []
        self._jerks: list[tuple[float, float]] = []
        self._limbs_through: list[np.ndarray] = []
        self._longest: list[float] = []
        self._recent: list[tuple[Vertices, Vertices]] = []
        self._badness = -1.0
        self._worst: tuple[int, Frame, Vertices | None] | None = None

    def add(self, frame: Frame, truth: Vertices | None, fps: float) -> None:
        """Measures one more frame.

        Args:
            frame: The frame.
            truth: The simulated garment in this frame, if there is one (verts, 3) [m].
            fps: Frames per second.
        """
        garment, shown = self.animator.garment, frame
        if any(frame.origin):
            # far away single precision rounds positions in the world, so the frame is measured near its own origin
            frame = frame.local
            truth = None if truth is None else (truth - np.array(shown.origin)).astype(np.float32)
        self._milliseconds.append(dict(frame.milliseconds))
        self._add_inside(frame)
        self._add("area", metrics.area_change_percent(frame.vertices, garment.faces, garment.rest_edges))
        if (len(self._milliseconds) - 1) % CROSSINGS_EVERY == 0:
            self._add_through(frame)
            self._add("crossing", metrics.self_crossings(frame.vertices, garment.faces)["edge_percent"])
            skin = frame.body.vertices, frame.body.faces
            self._add("behind", metrics.behind_nearest_percent(frame.vertices, *skin))
        bones = limb_bones(frame.body.joints)
        body = frame.body.vertices, frame.body.faces
        self._limbs_through.append(metrics.limbs_through(bones, frame.vertices, garment.faces, *body))
        self._stretches.append(metrics.stretch_percent(frame.vertices, self._edges, self._lengths))
        self._longest.append(float(metrics.worst_edge_ratio(frame.vertices, self._edges, self._lengths)))
        ripples = None if truth is None else metrics.ripple_deg(truth, garment.faces, self._pairs)
        self._ripples.append((metrics.ripple_deg(frame.vertices, garment.faces, self._pairs), ripples))
        if frame.novelty is not None:
            self._add("novelty", frame.novelty)
        self._add("resolved", metrics.resolved_percent(frame.before_projection, frame.vertices))
        strains = metrics.edge_strains(frame.vertices, garment.faces, garment.rest_edges)
        self._strains.append(strains.astype(np.float32))
        if truth is not None:
            self._add_errors(frame.vertices, truth, fps)
        badness = float(self._errors_mm[-1].mean()) if truth is not None else self._values["before"][-1]
        if badness > self._badness:
            self._badness, self._worst = badness, (len(self._milliseconds) - 1, frame, truth)
        if self.keep is not None:
            self.keep(shown)

    def worst_frame(self) -> tuple[int, Frame, Vertices | None]:
        """Returns number, frame and ground truth of the worst frame.

        It has the largest error; without ground truth, the most vertices inside the body before the projection.

        Raises:
            BadInput: No frame was added.
        """
        if self._worst is None:
            raise BadInput("a motion must have a frame to measure", "none", "take a longer stretch")
        return self._worst

    def figures(self) -> dict[str, Any]:
        """Returns all figures as plain numbers, each named after its metric in `hemline.metrics`."""
        values, errors = self._values, bool(self._errors_mm)
        return {
            "vertices": len(self.animator.garment.vertices),
            "frames": len(self._milliseconds),
            "threads": threads(),
            "frame_ms": metrics.frame_ms(self._milliseconds),
            "memory_mb": metrics.memory_mb(),
            "inside_percent": metrics.inside_figures(values["before"], values["after"], values["pinched"]),
            "behind_nearest_percent": metrics.mean_and_worst(values["behind"]),
            "caught_percent": metrics.mean_and_worst(values["caught"]) if "caught" in values else None,
            "deepest_mm": {"before": max(values["deepest_before"]), "after": max(values["deepest_after"])},
            "skin_through_percent": metrics.mean_and_worst(values["through"])
            | {"buried": float(np.mean(values["through_buried"]))},
            "limbs_through_percent": metrics.limbs_through_figures(self._limbs_through, LIMBS),
            "self_crossing_percent": metrics.mean_and_worst(values["crossing"]),
            "edge_strain": metrics.edge_strain(np.stack(self._strains)),
            "stretch_percent": metrics.stretch_figures(self._stretches),
            "worst_edge_ratio": max(self._longest),
            "resolved_percent": float(np.mean(values["resolved"])),
            "ripple_deg": metrics.ripple_figures(self._ripples),
            "area_change_percent": metrics.mean_and_worst(values["area"]),
            "vertex_error_mm": metrics.vertex_error_mm(np.stack(self._errors_mm)) if errors else None,
            "normal_error_deg": metrics.normal_error_deg(np.stack(self._normal_errors_deg)) if errors else None,
            "jerk_m_s3": metrics.jerk_figures(self._jerks) if self._jerks else None,
            "novelty": metrics.mean_and_worst(values["novelty"]) if "novelty" in values else None,
            "worst_frame": self.worst_frame()[0],
        }

    def _add(self, name: str, value: float) -> None:
        self._values.setdefault(name, []).append(value)

    def _add_through(self, frame: Frame) -> None:
        """Measures skin that shows through the cloth, separately for skin inside another part of the body."""
        body, cloth = frame.body, (frame.vertices, self.animator.garment.faces)
        over = body.vertices[self._covered] + PROBE_HEIGHT * body.normals[self._covered]
        buried = inside(body.vertices, body.faces, over)
        skin = body.vertices, body.normals, self._covered
        self._add("through", metrics.skin_through_percent(*cloth, *skin, buried))
        self._add("through_buried", metrics.skin_through_percent(*cloth, *skin, ~buried))

    def _add_inside(self, frame: Frame) -> None:
        """Measures vertices inside the body before and after the projection, and those caught in layers."""
        body, faces, pinched = frame.body.vertices, frame.body.faces, frame.report.pinched
        before, after = inside(body, faces, frame.before_projection), inside(body, faces, frame.vertices)
        self._add("before", metrics.inside_percent(before))
        self._add("after", metrics.inside_percent(after, pinched))
        self._add("pinched", metrics.pinched_percent(pinched, len(after)))
        after[pinched] = False
        if isinstance(frame.report, LayersReport):
            self._add("caught", metrics.pinched_percent(frame.report.caught, len(after)))
        self._add("deepest_before", metrics.deepest_mm(body, faces, frame.before_projection, before))
        self._add("deepest_after", metrics.deepest_mm(body, faces, frame.vertices, after))

    def _add_errors(self, vertices: Vertices, truth: Vertices, fps: float) -> None:
        self._errors_mm.append(metrics.vertex_errors_mm(vertices, truth))
        angles = metrics.normal_errors_deg(vertices, truth, self.animator.garment.faces)
        self._normal_errors_deg.append(angles.astype(np.float32))
        self._recent = [*self._recent[1 - metrics.JERK_FRAMES :], (vertices, truth)]
        if len(self._recent) == metrics.JERK_FRAMES:
            ours, theirs = (np.stack(each) for each in zip(*self._recent, strict=True))
            self._jerks.append((metrics.jerk_m_s3(ours, fps), metrics.jerk_m_s3(theirs, fps)))
