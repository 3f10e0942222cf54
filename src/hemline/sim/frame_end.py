"""The end of a frame: no vertex stays inside the body, and what that took."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float, Int

from hemline.collide.winding import inside

from .surface import Skin

if TYPE_CHECKING:
    from hemline.bodies import PosedBody

    from .dressed_body import DressedBody


@dataclass(frozen=True)
class Cleaned:
    """Cloth after the projection.

    Attributes:
        positions: [m]
        pinched: Vertices that have no free place.
        inside: Vertices inside the body that are not pinched, counted exactly.
        deepest_mm: How far the deepest vertex was inside before.
    """

    positions: Float[np.ndarray, "verts 3"]
    pinched: Int[np.ndarray, " pinched"]
    inside: int
    deepest_mm: float


class FrameEnd:
    """Pushes the cloth out of the body at the end of each frame."""

    def __init__(self, dressed: "DressedBody", memory: Mapping[str, np.ndarray] | None = None):
        self.dressed = dressed

    def memory(self) -> dict[str, np.ndarray]:
        """What the next frame depends on, as arrays."""
        return {}

    def clean(self, posed: "PosedBody", positions: Float[np.ndarray, "verts 3"], seconds: float) -> Cleaned:
        """Project one frame.

        Args:
            posed: The body at the end of the frame.
            positions: The cloth there [m].
            seconds: Length of the frame [s].
        """
        surface, skin = self.dressed.surface, Skin(posed.vertices, posed.normals)
        free = np.zeros(len(positions), bool)
        x, deepest = positions.copy(), 0.0
        for _ in range(4):
            planes = surface.planes(surface.anchors(x, skin, free), x, skin, skin, np.ones(len(x)))
            gap = planes.gap(x)
            short = np.clip(0.001 - gap, 0, None)
            deepest = max(deepest, -float(gap.min()))
            x += np.where(short > 0, short, 0.0)[:, None] * planes.normal
        within = np.flatnonzero(inside(posed.vertices, surface.faces, x.astype(np.float32)))
        return Cleaned(x, within, 0, 1000 * max(deepest, 0.0))
