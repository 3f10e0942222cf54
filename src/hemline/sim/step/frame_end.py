"""The end of a frame: pushes vertices out of the body, and counts those that were inside."""

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any

import numpy as np
from jaxtyping import Float, Int

from hemline.collide import ProjectionSettings, Projector, ProjectorState, inside, winding_numbers
from hemline.sim.contact.history.contact_history import HistoryFaces

if TYPE_CHECKING:
    from hemline.bodies import PosedBody, ShapedBody
    from hemline.garments.garment import Garment

SETTINGS = ProjectionSettings(margin=0.001, gap=0.0003, release=1e-3)
"""Settings of the projection. Contact keeps the cloth off the body already, so the margin is thin, and displacements
are not carried over to the next frame."""

MAX_PINCHED_MOVE = 0.01
"""A vertex that is inside two parts of the body at once is moved out by this distance at most [m]."""

COUNT_INTERVAL = 10
"""Frames between two counts of vertices inside the body by winding numbers."""

_PREFIX = "projector."


@dataclass(frozen=True)
class CleanCloth:
    """Cloth after the projection at the end of a frame.

    Attributes:
        positions: Positions after the projection [m].
        pinched: Vertices that cannot leave the body, because parts of it intersect there.
        inside: Number of vertices inside the body that are not pinched; 0 in frames in which they are not counted.
        deepest_mm: Largest depth inside the body before the projection [mm].
        projector: State of the projection, which the next frame starts from.
    """

    positions: Float[np.ndarray, "verts 3"]
    pinched: Int[np.ndarray, " pinched"]
    inside: int
    deepest_mm: float
    projector: ProjectorState


class FrameEnd:
    """Pushes the cloth out of the body at the end of each frame. It holds no state between frames.

    Args:
        garment: The garment.
        shaped: The body.
    """

    def __init__(self, garment: "Garment", shaped: "ShapedBody"):
        self.projector = Projector.prepare(shaped, garment.vertices, garment.faces, settings=SETTINGS)

    def start(self) -> ProjectorState:
        """Returns the state of the projection before the first frame."""
        return self.projector.start()

    def clean(
        self,
        posed: "PosedBody",
        positions: Float[np.ndarray, "verts 3"],
        seconds: float,
        contact_history: HistoryFaces | None = None,
        *,
        projector: ProjectorState | None = None,
    ) -> CleanCloth:
        """Moves the cloth of one frame out of the body.

        Args:
            posed: The body at the end of the frame.
            positions: The cloth at the end of the frame [m].
            seconds: Length of the frame [s].
            contact_history: Faces of the body that kept the cloth off in this frame; None if the cloth has no history.
            projector: State of the projection after the frame before; None for the first frame.
        """
        before = positions.astype(np.float32)
        places = None if contact_history is None else contact_history[:, 0]
        state = self.start() if projector is None else projector
        state, after, report = self.projector.project(state, posed, before, dt=seconds, places=places)
        stuck = self._stuck_between_parts(posed, before, after)
        after[stuck] = before[stuck]
        pinched = np.union1d(report.pinched, stuck)
        moved = (after != before).any(axis=1)
        count = 0
        if state.frame % COUNT_INTERVAL == 0:
            within = inside(posed.vertices, posed.faces, after)
            within[pinched] = False
            count = int(within.sum())
        return CleanCloth(np.where(moved[:, None], after, positions), pinched, count, report.deepest_mm, state)

    @staticmethod
    def _stuck_between_parts(posed: "PosedBody", before: np.ndarray, after: np.ndarray) -> Int[np.ndarray, " stuck"]:
        """Returns vertices between two intersecting parts of the body, far from any way out.

        Pushed out one by one, neighbouring vertices in a fold would come out on different sides of a limb.
        """
        far = np.flatnonzero(np.linalg.norm(after - before, axis=1) > MAX_PINCHED_MOVE)
        if not len(far):
            return far
        turns = winding_numbers(posed.vertices, posed.faces, before[far])
        return far[np.abs(turns) > 1.5]


def projector_arrays(state: ProjectorState) -> dict[str, np.ndarray]:
    """Returns the state of the projection as arrays, under the names that an end state stores them by."""
    values = {_PREFIX + field.name: getattr(state, field.name) for field in fields(state)}
    return {
        name: value.astype(np.uint8) if value.dtype == bool else value
        for name, value in ((name, np.atleast_1d(np.asarray(value))) for name, value in values.items())
    }


def read_projector(arrays: Mapping[str, np.ndarray]) -> ProjectorState:
    """Returns the state of the projection from the arrays of an end state, see `projector_arrays`."""
    values: dict[str, Any] = {field.name: arrays[_PREFIX + field.name] for field in fields(ProjectorState)}
    return ProjectorState(**values | {"frame": int(values["frame"][0]), "lively": values["lively"].astype(bool)})
