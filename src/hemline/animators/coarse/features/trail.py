"""The memory of how a proxy moved: where skinning put its vertices, and how their filters trail."""

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Self

import numpy as np

from hemline.animators.coarse.beginning import Beginning
from hemline.animators.coarse.proxy_on_body import DESCRIBED_COUNT, DYNAMIC_COUNT, ProxyOnBody
from hemline.animators.teleport import RigidTransform
from hemline.arrays import Float, Transforms
from hemline.motions.quaternions import rotate

from .feature_kernels import displace, remember, skin_and_turn
from .memory import LAGS, SWINGS, FilterStep

if TYPE_CHECKING:
    from hemline.bodies import PosedBody


@dataclass(frozen=True, eq=False)
class Trail:
    """All that is remembered of a proxy; float32, never changed in place."""

    skinned: Float[np.ndarray, "verts 3"]
    """Where skinning puts it [m]."""
    turns: Float[np.ndarray, "verts 4"]
    """How each vertex is turned, wxyz."""
    carried: Float[np.ndarray, "verts 3"]
    """Carried rigidly with the key joint [m]."""
    trails: Float[np.ndarray, "verts filters 3"]
    carried_trails: Float[np.ndarray, "verts filters 3"]
    beginning: Beginning | None = None
    """How the garment lay at first, where it is known."""

    @classmethod
    def start(cls, proxy: ProxyOnBody, posed: "PosedBody") -> Self:
        """On a body that has always stood so."""
        still = np.zeros((len(proxy.rest), len(LAGS) + 2 * len(SWINGS) + 1, 3), np.float32)
        return cls(*_skin_proxy(proxy, posed.transforms), still, still)

    def stepped(self, proxy: ProxyOnBody, posed: "PosedBody", dt: float) -> Self:
        """After the body moved on into a pose, in a time `dt` [s]."""
        skinned, turns, carried = _skin_proxy(proxy, posed.transforms)
        step, trails = FilterStep.of(dt), [np.empty_like(self.trails), np.empty_like(self.trails)]
        before = ((self.skinned, skinned, self.trails), (self.carried, carried, self.carried_trails))
        for (one, other, memory), out in zip(before, trails, strict=True):
            remember(one, other, np.float32(dt), step.lags, step.swings, memory, out)
        return type(self)(skinned, turns, carried, *trails, beginning=self.beginning and self.beginning.later(dt))

    def begun(self, positions: Float[np.ndarray, "verts 3"]) -> Self:
        """With vertices that lie there now [m]."""
        return replace(self, beginning=Beginning(self.turned_back(positions)))

    def turned_back(self, positions: Float[np.ndarray, "verts 3"]) -> Float[np.ndarray, "verts 3"]:
        """Positions as seen from where skinning puts each vertex, in its turned frame [m]."""
        back = self.turns.astype(np.float64) * np.array([1, -1, -1, -1])
        return rotate(back, positions.astype(np.float64) - self.skinned).astype(np.float32)

    def add_displacements(self, displacements: Float[np.ndarray, "verts 3"]) -> Float[np.ndarray, "verts 3"]:
        """Positions of vertices that are so far from where skinning puts them, seen in their turned frames [m]."""
        out = np.empty_like(self.skinned)
        displace(self.skinned, self.turns, displacements, out)
        return out

    def transform(self, way: RigidTransform) -> Self:
        """Turned and moved as a whole."""
        points = (way.points(each.astype(np.float64)).astype(np.float32) for each in (self.skinned, self.carried))
        skinned, carried = points
        turned = (
            way.vectors(each.astype(np.float64)).astype(np.float32) for each in (self.trails, self.carried_trails)
        )
        return type(self)(skinned, self.turns, carried, *turned, beginning=self.beginning)

    def told(self, proxy: ProxyOnBody, posed: "PosedBody") -> Float[np.ndarray, "verts dynamic"]:
        """The features of this frame."""
        out = np.empty((len(self.skinned), DYNAMIC_COUNT), np.float32)
        frames = np.ascontiguousarray(posed.transforms, np.float64)
        proxy.describe(
            self.skinned, self.turns, self.carried, self.trails, self.carried_trails, frames, posed.joints, out
        )
        out[:, DESCRIBED_COUNT:] = 0 if self.beginning is None else self.beginning.told()
        return out


def _skin_proxy(proxy: ProxyOnBody, transforms: Transforms) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    transforms = np.ascontiguousarray(transforms, np.float32)
    skinned, turns = np.empty_like(proxy.rest), np.empty((len(proxy.rest), 4), np.float32)
    skin_and_turn(proxy.rest, *proxy.skin, transforms, skinned, turns)
    key = transforms[proxy.key]
    return skinned, turns, (proxy.rest @ key[:, :3].T + key[:, 3]).astype(np.float32)
