"""The memory of how a proxy moved: where skinning put its vertices, and how far their filters trail behind."""

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Self

import numpy as np

from hemline.animators.coarse.beginning import Beginning
from hemline.animators.coarse.proxy_on_body import ProxyOnBody
from hemline.animators.rigid_transform import RigidTransform
from hemline.arrays import Float, Transforms
from hemline.motions.quaternions import rotate

from .columns import DYNAMIC
from .feature_kernels import displace, remember, skin_and_turn
from .kernel_inputs import TrailArrays
from .memory import FILTER_COUNT, FilterStep

if TYPE_CHECKING:
    from hemline.bodies import PosedBody


@dataclass(frozen=True, eq=False)
class Trail:
    """The memory of a proxy; float32 arrays, never changed in place."""

    skinned: Float[np.ndarray, "verts 3"]
    """Positions by skinning [m]."""
    turns: Float[np.ndarray, "verts 4"]
    """Rotation of each vertex by skinning, wxyz."""
    carried: Float[np.ndarray, "verts 3"]
    """Positions if carried rigidly with the key joint [m]."""
    trails: Float[np.ndarray, "verts filters 3"]
    """Filters of `skinned`, see `feature_kernels.remember`."""
    carried_trails: Float[np.ndarray, "verts filters 3"]
    """Filters of `carried`."""
    beginning: Beginning | None = None
    """How the garment lay when the network took over; None if that is unknown."""

    @classmethod
    def start(cls, proxy: ProxyOnBody, posed: "PosedBody") -> Self:
        """Returns the memory of a proxy on a body that has always stood in one pose."""
        still = np.zeros((len(proxy.rest), FILTER_COUNT + 1, 3), np.float32)
        return cls(*_skin_proxy(proxy, posed.transforms), still, still)

    def advance(self, proxy: ProxyOnBody, posed: "PosedBody", dt: float) -> Self:
        """Returns the memory after the body moved to a pose in a time `dt` [s]."""
        skinned, turns, carried = _skin_proxy(proxy, posed.transforms)
        step, trails = FilterStep.of(dt), [np.empty_like(self.trails), np.empty_like(self.trails)]
        before = ((self.skinned, skinned, self.trails), (self.carried, carried, self.carried_trails))
        for (one, other, memory), out in zip(before, trails, strict=True):
            remember(one, other, np.float32(dt), step.lags, step.swings, memory, out)
        return type(self)(skinned, turns, carried, *trails, beginning=self.beginning and self.beginning.later(dt))

    def with_beginning(self, positions: Float[np.ndarray, "verts 3"]) -> Self:
        """Returns the memory with the beginning set to given positions of the vertices (verts, 3) [m]."""
        return replace(self, beginning=Beginning(self.local_offsets(positions)))

    def local_offsets(self, positions: Float[np.ndarray, "verts 3"]) -> Float[np.ndarray, "verts 3"]:
        """Returns the offsets of positions from skinning, in the rotated frames of the vertices [m]."""
        back = self.turns.astype(np.float64) * np.array([1, -1, -1, -1])
        return rotate(back, positions.astype(np.float64) - self.skinned).astype(np.float32)

    def add_displacements(self, displacements: Float[np.ndarray, "verts 3"]) -> Float[np.ndarray, "verts 3"]:
        """Adds displacements, in the rotated frames of the vertices [m], to skinning; returns positions [m]."""
        out = np.empty_like(self.skinned)
        displace(self.skinned, self.turns, displacements, out)
        return out

    def transform(self, transform: RigidTransform) -> Self:
        """Returns the memory turned and shifted as a whole."""
        points, vectors = (self.skinned, self.carried), (self.trails, self.carried_trails)
        skinned, carried = (transform.points(each.astype(np.float64)).astype(np.float32) for each in points)
        trails = (transform.vectors(each.astype(np.float64)).astype(np.float32) for each in vectors)
        return type(self)(skinned, self.turns, carried, *trails, beginning=self.beginning)

    def features(self, proxy: ProxyOnBody, posed: "PosedBody") -> Float[np.ndarray, "verts dynamic"]:
        """Returns the features of this frame that change, in the columns of `columns.DYNAMIC`, float32."""
        out = np.empty((len(self.skinned), DYNAMIC.count), np.float32)
        arrays = TrailArrays(self.skinned, self.turns, self.carried, self.trails, self.carried_trails)
        proxy.describe(arrays, np.ascontiguousarray(posed.transforms, np.float64), posed.joints, out)
        out[:, DYNAMIC["beginning"]] = 0 if self.beginning is None else self.beginning.features()
        return out


def _skin_proxy(proxy: ProxyOnBody, transforms: Transforms) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    transforms = np.ascontiguousarray(transforms, np.float32)
    skinned, turns = np.empty_like(proxy.rest), np.empty((len(proxy.rest), 4), np.float32)
    skin_and_turn(proxy.rest, *proxy.skin, transforms, skinned, turns)
    key = transforms[proxy.key]
    return skinned, turns, (proxy.rest @ key[:, :3].T + key[:, 3]).astype(np.float32)
