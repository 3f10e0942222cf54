"""A garment around a thin body that grows, then turns to its rest pose: what pulls the cloth to where it is worn."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from hemline.arrays import Vertices
from hemline.bodies.lead_in import between
from hemline.garments.garment import Garment
from hemline.meshes import ClosestTree, crossing_edges
from hemline.sim import Scene, SimSettings, MovingSkin
from hemline.sim.rest.sewing import sew, largest_stretch
from hemline.sim.step.dressed_body import DressedBody
from hemline.sim.step.frame_end import FrameEnd
from hemline.sim.step.state import ClothState

from .alignment import Alignment
from .thin_body import ThinBody

if TYPE_CHECKING:
    from hemline.bodies import PosedBody, ShapedBody

GIRTHS = (1.0, 0.8, 0.6, 0.45, 0.3, 0.2, 0.15, 0.1, 0.07)
"""Shares of the body's girth that are tried until hardly any cloth is inside."""

FEW, SHALLOW = 0.005, 0.01
"""Share of vertices that may be inside then, and how deep [m]."""

SEAM_STEP = 1 / 1500
"""Length of a step while seams close, short so that cloth does not jump over a thin limb [s]."""

FRAMES, GROWN, TURNING = 40, 0.7, 0.3
"""Frames of growing and turning; share of them when the body is grown, and when it starts to turn."""

STILL_FRAMES, KEPT = 8, 0.7
"""Frames at the end without a change of the body; share of the velocities that each step keeps."""


@dataclass(frozen=True, eq=False)
class Grown:
    """A garment after the body grew into it.

    Attributes:
        vertices: On the body in its rest pose, without gravity [m].
        girth: Share of its girth with which the body began.
        stretched: Greatest stretch of an edge at the start, as a factor: seams that were open.
        crossed_before: Edges that went through its cloth at the start.
        crossed_after: Those at the end.
    """

    vertices: Vertices
    girth: float
    stretched: float
    crossed_before: int
    crossed_after: int


def grown(
    garment: Garment, shaped: "ShapedBody", alignment: Alignment, progress: Callable[[int, int], None] | None = None
) -> Grown:
    """Let a body grow inside a garment and turn to its rest pose, without gravity.

    Args:
        garment: Without pins, its vertices where the alignment put them.
        shaped: The body.
        alignment: The pose it starts in.
        progress: Called with frames done and frames in all.

    Raises:
        SimulationFailed: A step failed at its shortest.
    """
    settings = SimSettings(gravity=(0.0, 0.0, 0.0))
    dressed, thin = DressedBody(garment, shaped, settings), ThinBody(shaped)
    positions = garment.vertices.astype(np.float64)
    girth = _girth(thin, alignment, positions)
    state = dressed.stepper.start(positions)
    stretched, crossed = largest_stretch(dressed.sheet, positions), len(crossing_edges(garment.vertices, garment.faces))
    at_first = _scene(thin.at(girth).posed(alignment.pose))
    state = sew(dressed.sheet, state, lambda now: dressed.stepper.advance(now, SEAM_STEP, lambda _: at_first)[0])
    turned = alignment.pose.hash != shaped.rest_pose.hash
    frames = FRAMES if girth < 1 or turned else 0

    def posed(share: float) -> "PosedBody":
        size = girth + (1 - girth) * min(1.0, share / GROWN)
        turn = float(np.clip((share - TURNING) / (1 - TURNING), 0, 1))
        return thin.at(size).posed(between(alignment.pose, shaped.rest_pose, turn))

    for frame in range(frames + STILL_FRAMES):
        first, second = (min(1.0, (frame + end) / max(frames, 1)) for end in (0, 1))
        state = _frame(dressed, state, lambda share, a=first, b=second: _scene(posed(a + share * (b - a))))
        if progress:
            progress(frame + 1, frames + STILL_FRAMES)
    cleaned = FrameEnd(garment, shaped).clean(shaped.posed(shaped.rest_pose), state.positions, 1.0)
    vertices = cleaned.positions
    after = len(crossing_edges(vertices.astype(np.float32), garment.faces))
    return Grown(vertices, girth, stretched, crossed, after)


def _girth(thin: ThinBody, alignment: Alignment, positions: Vertices) -> float:
    """The greatest girth that leaves room for the cloth where it is, but for a few vertices that contact pushes out."""
    for girth in GIRTHS:
        posed = thin.at(girth).posed(alignment.pose)
        height = ClosestTree(posed.vertices.astype(np.float64), posed.faces).signed_distances(positions)
        if (height < 0).mean() < FEW and height.min() > -SHALLOW:
            break
    return girth


def _scene(posed: "PosedBody") -> Scene:
    return Scene(np.zeros((0, 3)), MovingSkin(posed.vertices, posed.normals))


def _frame(dressed: DressedBody, state: ClothState, scene_at: Callable[[float], Scene]) -> ClothState:
    """Two steps of a sixtieth of a second; all motion is damped."""
    known: dict[float, Scene] = {}

    def scene(share: float) -> Scene:
        if share not in known:
            known[share] = scene_at(share)
        return known[share]

    for step in range(2):
        state, _ = dressed.stepper.advance(state, 1 / 60, lambda share, step=step: scene((step + share) / 2))
        state = _slowed(state, KEPT)
    return state


def _slowed(state: ClothState, kept: float) -> ClothState:
    return replace(state, velocities=kept * state.velocities, change=np.zeros_like(state.change))
