"""Constants of the spring bones of a garment."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any, Self

import numpy as np

from hemline.arrays import Bool, Float
from hemline.errors import BadModel

from .spring_bones import CapsuleColliders, SpringChains, distances_to_axes


@dataclass(frozen=True)
class SpringConstants:
    """Constants of the spring bones of a garment, equal for all chains.

    Attributes:
        stiffness: At the root and at the tip of a chain, exponential between them [m/s per frame].
        gravity: Downward pull [m/s per frame].
        drag: Fraction of the velocity that is lost per frame, at the root and at the tip, linear between them [1].
        radius: Distance from colliders [m]; bones that are closer at rest keep the distance that they have there.
        inward: Largest angle inwards from the direction at rest [rad].
        sideways: Largest angle sideways [rad].
        leg_radius: Radius of the legs for each chain, whose axes then lie that much farther from the chain that their
            side towards it stays where it is [m]. Wide legs push cloth forwards, narrow ones push it aside.
    """

    stiffness: tuple[float, float]
    gravity: float
    drag: tuple[float, float]
    radius: float
    inward: float
    sideways: float
    leg_radius: float

    def apply(
        self, chains: SpringChains, capsules: CapsuleColliders, legs: Sequence[int]
    ) -> tuple[SpringChains, CapsuleColliders]:
        """Returns chains with these constants, and the capsules with the legs of each chain.

        Args:
            chains: The chains at rest.
            capsules: Capsules of all chains.
            legs: Joints of the legs.
        """
        tips = np.repeat(np.diff(chains.offsets) - 1, np.diff(chains.offsets))
        along, count = chains.depths / np.maximum(tips, 1), len(chains.bones)
        first, last = np.log(self.stiffness)
        capsules = capsules.join(self._legs(chains, capsules, legs))
        swinging = replace(
            chains,
            stiffness=np.exp(first + (last - first) * along),
            gravity=np.full(count, self.gravity),
            drag=self.drag[0] + (self.drag[1] - self.drag[0]) * along,
            radii=np.minimum(self.radius, _clearances(chains, capsules)),
            inward=np.full(count, self.inward),
            sideways=np.full(count, self.sideways),
        )
        return swinging, capsules

    def _legs(self, chains: SpringChains, capsules: CapsuleColliders, legs: Sequence[int]) -> CapsuleColliders:
        """Returns the legs for each chain, widened away from it, so thin that none of its bones is inside at rest."""
        which = np.flatnonzero(np.isin(capsules.joints, legs))
        count = len(chains.outward)
        radii = np.tile(np.maximum(self.leg_radius, capsules.radii[which]), count)
        back = -chains.outward[:, None] * (radii.reshape(count, -1) - capsules.radii[which])[..., None]
        starts, ends = ((each[which] + back).reshape(-1, 3) for each in (capsules.starts, capsules.ends))
        owners = np.repeat(np.arange(count), len(which))
        wide = CapsuleColliders(np.tile(capsules.joints[which], count), starts, ends, radii, owners)
        return replace(wide, radii=np.minimum(radii, _nearest_bones(chains, wide)))

    def metadata(self) -> dict[str, Any]:
        """Returns the constants for a model file."""
        return asdict(self)

    @classmethod
    def of(cls, metadata: Mapping[str, Any]) -> Self:
        """Reads the constants from a model file.

        Raises:
            BadModel: A constant is missing or not in its range.
        """
        try:
            two = {name: tuple(map(float, metadata[name])) for name in ("stiffness", "drag")}
            one = {name: float(metadata[name]) for name in ("gravity", "radius", "inward", "sideways", "leg_radius")}
            numbers = [*two["stiffness"], *one.values()]
            sound = len(two["stiffness"]) == len(two["drag"]) == 2 and all(0 < number < np.inf for number in numbers)
            sound = sound and all(0 <= number <= 1 for number in two["drag"])
            if sound:
                return cls(**two, **one)
        except (KeyError, TypeError, ValueError):
            pass
        raise BadModel("constants of the model's spring bones cannot be used", dict(metadata), "fit the model again")


def _clearances(chains: SpringChains, capsules: CapsuleColliders) -> Float[np.ndarray, " points"]:
    """Returns the distance of each bone from the nearest capsule that it collides with, at rest [m]; 0 for roots."""
    away = distances_to_axes(chains.bones, capsules.starts, capsules.ends)[0] - capsules.radii
    away[_apart(chains, capsules)] = np.inf
    return np.where(chains.depths > 0, np.maximum(away.min(axis=1, initial=np.inf), 0.0), 0.0)


def _nearest_bones(chains: SpringChains, capsules: CapsuleColliders) -> Float[np.ndarray, " capsules"]:
    """Returns the distance of the axis of each capsule from the nearest bone that collides with it, at rest [m]."""
    away = distances_to_axes(chains.bones, capsules.starts, capsules.ends)[0]
    away[_apart(chains, capsules) | (chains.depths == 0)[:, None]] = np.inf
    return away.min(axis=0, initial=np.inf)


def _apart(chains: SpringChains, capsules: CapsuleColliders) -> Bool[np.ndarray, "points capsules"]:
    """Tells which bones do not collide with which capsules."""
    chain = np.repeat(np.arange(len(chains.joints)), np.diff(chains.offsets))
    return (capsules.chains >= 0) & (capsules.chains != chain[:, None])
