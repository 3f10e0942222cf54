"""The end of a frame: no vertex stays inside the body, and what that took."""

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
"""Contact holds the cloth off the body, so the projection has a thin margin, and no displacement outlives its frame."""

MAX_PINCHED_MOVE = 0.01
"""A vertex that is inside two parts of the body at once is not led out farther than that [m]."""

COUNT_INTERVAL = 10
"""Frames from one count by winding numbers, beside the projection's own, to the next."""

_PREFIX = "projector."


@dataclass(frozen=True)
class Cleaned:
    """Cloth after the projection.

    Attributes:
        positions: [m]
        pinched: Vertices that have no free place.
        inside: Vertices inside the body that are not pinched, counted in some frames; 0 in the others.
        deepest_mm: How far the deepest vertex was inside before.
    """

    positions: Float[np.ndarray, "verts 3"]
    pinched: Int[np.ndarray, " pinched"]
    inside: int
    deepest_mm: float


class FrameEnd:
    """Pushes the cloth out of the body at the end of each frame.

    Args:
        garment: The garment.
        shaped: The body.
        memory: What `memory` returned at the end of the part before.
    """

    def __init__(self, garment: "Garment", shaped: "ShapedBody", memory: Mapping[str, np.ndarray] | None = None):
        self.projector = Projector.prepare(shaped, garment.vertices, garment.faces, settings=SETTINGS)
        self.state = self.projector.start() if memory is None else remembered(memory)

    def memory(self) -> dict[str, np.ndarray]:
        """What the next frame depends on, as arrays."""
        values = {field.name: getattr(self.state, field.name) for field in fields(self.state)}
        return {
            _PREFIX + name: value.astype(np.uint8) if value.dtype == bool else value
            for name, value in ((name, np.atleast_1d(np.asarray(value))) for name, value in values.items())
        }

    def clean(
        self,
        posed: "PosedBody",
        positions: Float[np.ndarray, "verts 3"],
        seconds: float,
        contact_history: HistoryFaces | None = None,
    ) -> Cleaned:
        """Project one frame.

        Args:
            posed: The body at the end of the frame.
            positions: The cloth there [m].
            seconds: Length of the frame [s].
            contact_history: Where the body held the cloth off in it; None: the cloth has no past.
        """
        before = positions.astype(np.float32)
        places = None if contact_history is None else contact_history[:, 0]
        self.state, after, report = self.projector.project(self.state, posed, before, dt=seconds, places=places)
        kept = self._caught(posed, before, after)
        after[kept] = before[kept]
        pinched = np.union1d(report.pinched, kept)
        moved = (after != before).any(axis=1)
        within = 0
        if self.state.frame % COUNT_INTERVAL == 0:
            found = inside(posed.vertices, posed.faces, after)
            found[pinched] = False
            within = int(found.sum())
        return Cleaned(np.where(moved[:, None], after, positions), pinched, within, report.deepest_mm)

    @staticmethod
    def _caught(posed: "PosedBody", before: np.ndarray, after: np.ndarray) -> Int[np.ndarray, " caught"]:
        """Vertices between two parts of the body that are in each other, far from any way out: led out one by one, in
        a fold, neighbours would come out at different sides of a limb.
        """
        far = np.flatnonzero(np.linalg.norm(after - before, axis=1) > MAX_PINCHED_MOVE)
        if not len(far):
            return far
        turns = winding_numbers(posed.vertices, posed.faces, before[far])
        return far[np.abs(turns) > 1.5]


def remembered(memory: Mapping[str, np.ndarray]) -> ProjectorState:
    """The projection's state from what `FrameEnd.memory` returned."""
    values: dict[str, Any] = {field.name: memory[_PREFIX + field.name] for field in fields(ProjectorState)}
    return ProjectorState(**values | {"frame": int(values["frame"][0]), "lively": values["lively"].astype(bool)})
