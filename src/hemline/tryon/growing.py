"""Grows a thin body inside a garment and turns it to its rest pose, which pulls the cloth into place."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from hemline.arrays import Vertices
from hemline.bodies.lead_in import interpolate_poses
from hemline.garments.garment import Garment
from hemline.garments.proxy.coarser import coarser_garment
from hemline.garments.proxy.embedding import Embedding
from hemline.meshes import ClosestTree, crossing_edges, edge_strains
from hemline.sim import MovingSkin, SimSettings, StepScene
from hemline.sim.rest.sewing import CLOSED_STRETCH, largest_stretch, sew
from hemline.sim.step.dressed_body import DressedBody
from hemline.sim.step.frame_end import FrameEnd
from hemline.sim.step.state import ClothState

from .alignment import Alignment
from .budget import Budget
from .thin_body import ThinBody

if TYPE_CHECKING:
    from hemline.bodies import PosedBody, ShapedBody

GIRTHS = (1.0, 0.8, 0.6, 0.45, 0.3, 0.2, 0.15, 0.1, 0.07)
"""Fractions of the body's girth that are tried until hardly any cloth is inside."""

INSIDE_FRACTION, INSIDE_DEPTH = 0.005, 0.01
"""Largest fraction of vertices that may be inside the thin body, and their largest depth [m]."""

SEAM_STEP = 1 / 1500
"""Time step while seams close, short so that cloth does not jump over a thin limb [s]."""

FRAMES = 40
"""Number of frames of growing and turning."""

GROWN_AT, TURNING_FROM = 0.7, 0.3
"""Fractions of these frames at which the body is grown, and at which it starts to turn."""

STILL_FRAMES = 8
"""Number of frames at the end in which the body does not change."""

FINE_VERTICES = 30_000
"""A garment with more vertices is put on as a coarse copy, which carries it."""

COARSE_VERTICES = 4000, 8000
"""Least and largest number of vertices of that copy, which has half of those of the garment between them."""

CARRIED_FRAMES = 4
"""Number of frames in which the fine garment then comes to rest on the body."""

DAMPING = 0.7
"""Fraction of the velocities that remains after each step; 1 is no damping."""


@dataclass(frozen=True, eq=False)
class Growth:
    """A garment after the body has grown inside it.

    Attributes:
        vertices: Positions on the body in its rest pose, without gravity [m].
        girth: Fraction of its full girth that the body had at the start.
        stretched: Greatest stretch factor of an edge at the start, which shows open seams.
        crossed_before: Number of edges that went through the cloth at the start.
        crossed_after: Number of edges that go through the cloth at the end.
    """

    vertices: Vertices
    girth: float
    stretched: float
    crossed_before: int
    crossed_after: int


def grow(
    garment: Garment,
    shaped: "ShapedBody",
    alignment: Alignment,
    progress: Callable[[int, int], None] | None = None,
    budget: Budget | None = None,
    *,
    carried: bool = False,
) -> Growth:
    """Lets a body grow inside a garment and turn to its rest pose, without gravity.

    A garment with many vertices and closed seams is carried by a coarse copy of it.

    Args:
        garment: A garment without pins, its vertices where the alignment put them.
        shaped: The body.
        alignment: Alignment with the pose in which the body starts.
        progress: Called with frames done and frames in all.
        budget: Limits the time; None: no limit.
        carried: Whether a coarse copy carries the garment, whatever its number of vertices: it tangles less.

    Raises:
        SimulationFailed: A step failed even at the shortest time step.
        BadGarment: The time is used up.
    """
    budget = budget or Budget(garment.name, np.inf)
    count = len(garment.vertices)
    large = count > (COARSE_VERTICES[0] if carried else FINE_VERTICES)
    if not large or _stretch(garment) > CLOSED_STRETCH:
        return _grow(garment, shaped, alignment, progress, budget)
    coarse, kept = coarser_garment(garment, float(np.clip(count / 2, *COARSE_VERTICES)) / count)
    growth = _grow(coarse, shaped, alignment, progress, budget)
    embedded = Embedding.of(garment, coarse, kept).fine_vertices(growth.vertices)
    vertices = _rest_on_body(replace(garment, vertices=embedded), shaped, budget)
    before, after = (
        len(crossing_edges(each.astype(np.float32), garment.faces)) for each in (garment.vertices, vertices)
    )
    return replace(growth, vertices=vertices, crossed_before=before, crossed_after=after)


def _stretch(garment: Garment) -> float:
    """Returns the largest stretch of an edge, as a factor."""
    return 1 + float(edge_strains(garment.vertices, garment.faces, garment.rest_edges).max())


def _grow(
    garment: Garment,
    shaped: "ShapedBody",
    alignment: Alignment,
    progress: Callable[[int, int], None] | None,
    budget: Budget,
) -> Growth:
    settings = SimSettings(gravity=(0.0, 0.0, 0.0))
    dressed, thin = DressedBody(garment, shaped, settings), ThinBody(shaped)
    positions = garment.vertices.astype(np.float64)
    girth = _girth(thin, alignment, positions)
    state = dressed.stepper.start(positions)
    stretched, crossed = largest_stretch(dressed.sheet, positions), len(crossing_edges(garment.vertices, garment.faces))
    at_first = _scene(thin.at(girth).posed(alignment.pose))
    tangled = f"; {crossed} of its edges went through its own cloth at the start" if crossed else ""

    def sewing_step(now: ClothState) -> ClothState:
        open_by = largest_stretch(dressed.sheet, now.positions)
        budget.check(f"its seams still open: an edge is {open_by:.1f} times too long, {stretched:.1f} at first")
        return dressed.stepper.advance(now, SEAM_STEP, lambda _: at_first)[0]

    state = sew(dressed.sheet, state, sewing_step)
    turned = alignment.pose.hash != shaped.rest_pose.hash
    frames = FRAMES if girth < 1 or turned else 0

    def body_at(fraction: float) -> "PosedBody":
        size = girth + (1 - girth) * min(1.0, fraction / GROWN_AT)
        turn = float(np.clip((fraction - TURNING_FROM) / (1 - TURNING_FROM), 0, 1))
        return thin.at(size).posed(interpolate_poses(alignment.pose, shaped.rest_pose, turn))

    for frame in range(frames + STILL_FRAMES):
        budget.check(f"{frame} of {frames + STILL_FRAMES} frames in which the body grows inside it{tangled}")
        first, second = (min(1.0, (frame + end) / max(frames, 1)) for end in (0, 1))
        state = _frame(dressed, state, lambda fraction, a=first, b=second: _scene(body_at(a + fraction * (b - a))))
        if progress:
            progress(frame + 1, frames + STILL_FRAMES)
    cleaned = FrameEnd(garment, shaped).clean(shaped.posed(shaped.rest_pose), state.positions, 1.0)
    vertices = cleaned.positions
    after = len(crossing_edges(vertices.astype(np.float32), garment.faces))
    return Growth(vertices, girth, stretched, crossed, after)


def _rest_on_body(garment: Garment, shaped: "ShapedBody", budget: Budget) -> Vertices:
    """Returns the vertices of a garment after a few damped frames on the body at rest, without gravity [m]."""
    dressed = DressedBody(garment, shaped, SimSettings(gravity=(0.0, 0.0, 0.0)))
    posed = shaped.posed(shaped.rest_pose)
    scene, frame_end = _scene(posed), FrameEnd(garment, shaped)
    positions = frame_end.clean(posed, garment.vertices.astype(np.float64), 1.0).positions
    state = dressed.stepper.start(positions)
    for frame in range(CARRIED_FRAMES):
        budget.check(f"{frame} of {CARRIED_FRAMES} frames of all its vertices on the grown body")
        state = _frame(dressed, state, lambda _: scene)
    return frame_end.clean(posed, state.positions, 1.0).positions


def _girth(thin: ThinBody, alignment: Alignment, positions: Vertices) -> float:
    """Returns the greatest girth that leaves room for the cloth, except for a few vertices that contact pushes out."""
    for girth in GIRTHS:
        posed = thin.at(girth).posed(alignment.pose)
        height = ClosestTree(posed.vertices.astype(np.float64), posed.faces).signed_distances(positions)
        if (height < 0).mean() < INSIDE_FRACTION and height.min() > -INSIDE_DEPTH:
            break
    return girth


def _scene(posed: "PosedBody") -> StepScene:
    return StepScene(np.zeros((0, 3)), MovingSkin(posed.vertices, posed.normals))


def _frame(dressed: DressedBody, state: ClothState, scene_at: Callable[[float], StepScene]) -> ClothState:
    """Advances the cloth by two steps of a sixtieth of a second; all motion is damped."""
    known: dict[float, StepScene] = {}

    def scene(fraction: float) -> StepScene:
        if fraction not in known:
            known[fraction] = scene_at(fraction)
        return known[fraction]

    for step in range(2):
        state, _ = dressed.stepper.advance(state, 1 / 60, lambda fraction, step=step: scene((step + fraction) / 2))
        state = _damp(state, DAMPING)
    return state


def _damp(state: ClothState, damping: float) -> ClothState:
    return replace(state, velocities=damping * state.velocities, change=np.zeros_like(state.change))
