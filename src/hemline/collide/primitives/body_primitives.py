"""A body as a few rounded cones bound to its joints, fitted to any shape: the colliders of rope chains."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from hemline.arrays import Float, Int, Points, Transforms
from hemline.errors import BadModel

from .cone_fit import fit_cones
from .primitive_kernels import ROUND_CONE, union_distances

if TYPE_CHECKING:
    from hemline.bodies import PosedBody, ShapedBody

_ARRAYS = {"kinds": 1, "joints": 1, "shapes": 2, "pivots": 2}


class Colliders(NamedTuple):
    """The arrays of a `BodyPrimitives`, as kernels read them."""

    kinds: Int[np.ndarray, " prims"]
    """Kind of each primitive."""
    joints: Int[np.ndarray, " prims"]
    """Joint that carries it."""
    shapes: Float[np.ndarray, "prims 16"]
    """Numbers of each primitive at rest, as `primitive_kernels` lists them [m]."""
    centres: Float[np.ndarray, "prims 4"]
    """Centre and radius of a ball around it at rest [m]."""
    pivots: Float[np.ndarray, "joints 3"]
    """Joints at rest [m]."""


@dataclass(frozen=True, eq=False)
class BodyPrimitives:
    """Primitives in the body's rest pose; each moves with the skin transform of one joint."""

    kinds: Int[np.ndarray, " prims"]
    """Kind of each primitive: 0, a rounded cone; int32."""
    joints: Int[np.ndarray, " prims"]
    """Joint that carries each primitive; int32."""
    shapes: Float[np.ndarray, "prims 16"]
    """Numbers of each primitive at rest, as `primitive_kernels` lists them; float64 [m]."""
    pivots: Float[np.ndarray, "joints 3"]
    """Joints at rest, which move on straight lines within a step; float64 [m]."""
    names: tuple[str, ...] = ()
    """Body part that each primitive stands for."""

    def __post_init__(self) -> None:
        for name, axes in _ARRAYS.items():
            array = np.asarray(getattr(self, name))
            kind = np.int32 if axes == 1 else np.float64
            if array.ndim != axes or not np.isfinite(array).all():
                raise BadModel(
                    f"array '{name}' of the primitives cannot be used", f"shape {array.shape}", "fit them again"
                )
            object.__setattr__(self, name, np.ascontiguousarray(array, kind))
        count = len(self.kinds)
        fits = self.joints.shape == (count,) and self.shapes.shape == (count, 16) and self.pivots.shape[1] == 3
        inside = count == 0 or (self.joints.min() >= 0 and self.joints.max() < len(self.pivots))
        if not (fits and inside and (self.kinds == ROUND_CONE).all()):
            raise BadModel(
                "arrays of the primitives do not match", f"{count} kinds, {self.shapes.shape} shapes", "fit them again"
            )
        object.__setattr__(self, "centres", _bounding_balls(self.shapes))

    centres: Float[np.ndarray, "prims 4"] = None  # type: ignore[assignment]  # computed from the shapes
    """Centre and radius of a ball around each primitive at rest; float64 [m]."""

    @classmethod
    def none(cls, joints: int = 1) -> "BodyPrimitives":
        """Makes an empty set, for a body of `joints` joints."""
        empty = np.zeros(0, np.int32)
        return cls(empty, empty, np.zeros((0, 16)), np.zeros((joints, 3)))

    @classmethod
    def from_primitives(cls, primitives: list[tuple[int, tuple[int, np.ndarray]]], pivots: Points) -> "BodyPrimitives":
        """Makes a set of given primitives: the joint of each, and what `round_cone_shape` returns."""
        joints = np.array([joint for joint, _ in primitives], np.int32)
        kinds = np.array([kind for _, (kind, _) in primitives], np.int32)
        shapes = np.array([shape for _, (_, shape) in primitives], float).reshape(-1, 16)
        return cls(kinds, joints, shapes, pivots)

    @classmethod
    def fit(cls, shaped: "ShapedBody") -> "BodyPrimitives":
        """Fits primitives to a body at rest; the results for the last few shapes are cached.

        Args:
            shaped: The body in its shape.

        Returns:
            About two dozen rounded cones, which lie over and under the skin by about the same distances.
        """
        return _fit(_ShapeKey(shaped))

    @property
    def colliders(self) -> Colliders:
        """The arrays that do not depend on the pose, as kernels read them."""
        return Colliders(self.kinds, self.joints, self.shapes, self.centres, self.pivots)

    def joint_frames(self, posed: "PosedBody") -> Float[np.ndarray, "joints 3 4"]:
        """Returns the frames that kernels read: rest to world for each joint, float64, C-contiguous."""
        return np.ascontiguousarray(posed.transforms, np.float64)

    def distances(
        self, points: Points, transforms: Transforms
    ) -> tuple[Float[np.ndarray, " points"], Int[np.ndarray, " points"]]:
        """Returns the distance of points to the union of all primitives, negative inside, and the nearest primitive.

        Args:
            points: Points in the world [m].
            transforms: Skin transforms of the pose.
        """
        points = np.ascontiguousarray(points, np.float64)
        distance, nearest = np.empty(len(points)), np.empty(len(points), np.int32)
        frames = np.ascontiguousarray(transforms, np.float64)
        union_distances(self.colliders, frames, points, distance, nearest)
        return distance, nearest

    def arrays(self) -> dict[str, np.ndarray]:
        """Returns all arrays by name, as model files store them."""
        return {f"proxy_{name}": getattr(self, name) for name in _ARRAYS}

    @classmethod
    def of(cls, arrays: Mapping[str, np.ndarray], metadata: Mapping[str, Any]) -> "BodyPrimitives":
        """Makes the primitives that `arrays` (and the key `proxy_names`) describe.

        Raises:
            BadModel: An array is missing or they do not fit together.
        """
        missing = [name for name in _ARRAYS if f"proxy_{name}" not in arrays]
        if missing:
            raise BadModel("primitives must have all their arrays", f"no proxy_{missing[0]}", "make the file again")
        named = {name: arrays[f"proxy_{name}"] for name in _ARRAYS}
        return cls(**named, names=tuple(metadata.get("proxy_names", ())))


class _ShapeKey:
    """A cache key: shaped bodies of the same body and betas are equal."""

    def __init__(self, shaped: "ShapedBody"):
        self.shaped, self.key = shaped, (shaped.body.hash, np.asarray(shaped.betas).tobytes())

    def __hash__(self) -> int:
        return hash(self.key)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _ShapeKey) and self.key == other.key


@lru_cache(maxsize=16)
def _fit(shape: _ShapeKey) -> BodyPrimitives:
    cones = fit_cones(shape.shaped)
    kinds = np.full(len(cones.joints), ROUND_CONE, np.int32)
    return BodyPrimitives(kinds, cones.joints, cones.shapes, np.asarray(shape.shaped.joints, np.float64), cones.names)


def _bounding_balls(shapes: np.ndarray) -> np.ndarray:
    """Returns centre and radius of a ball around each rounded cone."""
    middle = (shapes[:, :3] + shapes[:, 3:6]) / 2
    radius = np.linalg.norm(shapes[:, 3:6] - shapes[:, :3], axis=1) / 2 + shapes[:, 6:8].max(1, initial=0)
    return np.ascontiguousarray(np.column_stack([middle, radius]))
