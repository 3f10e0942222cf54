"""A body as a few analytic primitives bound to its joints, fitted to any shape: what rope chains collide with."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from hemline.arrays import Float, Int, Points, Transforms
from hemline.errors import BadModel

from .primitive_kernels import BOX, ELLIPSOID, ROUND_CONE, union_distances
from .proxy_fit import fit_cones

if TYPE_CHECKING:
    from hemline.bodies import PosedBody, ShapedBody

_ARRAYS = {"kinds": 1, "joints": 1, "shapes": 2, "pivots": 2}


class Colliders(NamedTuple):
    """The arrays of a proxy as kernels take them, in this order."""

    kinds: Int[np.ndarray, " prims"]
    joints: Int[np.ndarray, " prims"]
    shapes: Float[np.ndarray, "prims 16"]
    centres: Float[np.ndarray, "prims 4"]
    pivots: Float[np.ndarray, "joints 3"]


@dataclass(frozen=True, eq=False)
class BodyProxy:
    """Primitives in the body's rest pose; each moves with the skin transform of one joint."""

    kinds: Int[np.ndarray, " prims"]
    """Kind of each primitive: 0 rounded cone, 1 ellipsoid, 2 box; int32."""
    joints: Int[np.ndarray, " prims"]
    """Joint that carries it; int32."""
    shapes: Float[np.ndarray, "prims 16"]
    """Its numbers at rest, as `primitive_kernels` lists them; float64 [m]."""
    pivots: Float[np.ndarray, "joints 3"]
    """The joints at rest, which move on straight lines within a step; float64 [m]."""
    names: tuple[str, ...] = ()
    """What each primitive stands for."""

    def __post_init__(self) -> None:
        for name, axes in _ARRAYS.items():
            array = np.asarray(getattr(self, name))
            kind = np.int32 if axes == 1 else np.float64
            if array.ndim != axes or not np.isfinite(array).all():
                raise BadModel(f"proxy array '{name}' cannot be used", f"shape {array.shape}", "fit the proxy again")
            object.__setattr__(self, name, np.ascontiguousarray(array, kind))
        count = len(self.kinds)
        fits = self.joints.shape == (count,) and self.shapes.shape == (count, 16) and self.pivots.shape[1] == 3
        inside = count == 0 or (self.joints.min() >= 0 and self.joints.max() < len(self.pivots))
        if not (fits and inside and np.isin(self.kinds, (ROUND_CONE, ELLIPSOID, BOX)).all()):
            raise BadModel(
                "proxy arrays do not fit together", f"{count} kinds, {self.shapes.shape} shapes", "fit the proxy again"
            )
        object.__setattr__(self, "centres", _bounding_balls(self.kinds, self.shapes))

    centres: Float[np.ndarray, "prims 4"] = None  # type: ignore[assignment]  # found from the shapes
    """Centre and radius of a ball around each primitive at rest; float64 [m]."""

    @classmethod
    def none(cls, joints: int = 1) -> "BodyProxy":
        """Nothing to collide with, in a world of `joints` frames."""
        empty = np.zeros(0, np.int32)
        return cls(empty, empty, np.zeros((0, 16)), np.zeros((joints, 3)))

    @classmethod
    def from_primitives(cls, primitives: list[tuple[int, tuple[int, np.ndarray]]], pivots: Points) -> "BodyProxy":
        """A proxy of given primitives: the joint of each, and what `round_cone_shape` and its like return."""
        joints = np.array([joint for joint, _ in primitives], np.int32)
        kinds = np.array([kind for _, (kind, _) in primitives], np.int32)
        shapes = np.array([shape for _, (_, shape) in primitives], float).reshape(-1, 16)
        return cls(kinds, joints, shapes, pivots)

    @classmethod
    def fit(cls, shaped: "ShapedBody") -> "BodyProxy":
        """Primitives fitted to a body at rest; kept for the last few shapes.

        Args:
            shaped: The body in its shape.

        Returns:
            About two dozen rounded cones, over- and undershooting the skin alike.
        """
        return _fit(_Shape(shaped))

    @property
    def colliders(self) -> Colliders:
        """What does not depend on the pose, for kernels."""
        return Colliders(self.kinds, self.joints, self.shapes, self.centres, self.pivots)

    def posed(self, posed: "PosedBody") -> Float[np.ndarray, "joints 3 4"]:
        """The frames that the kernels want: rest to world for each joint, float64, C-contiguous."""
        return np.ascontiguousarray(posed.transforms, np.float64)

    def distances(
        self, points: Points, transforms: Transforms
    ) -> tuple[Float[np.ndarray, " points"], Int[np.ndarray, " points"]]:
        """Distance of points to the union of all primitives, negative inside, and the nearest primitive.

        Args:
            points: In the world [m].
            transforms: Skin transforms of the pose.
        """
        points = np.ascontiguousarray(points, np.float64)
        distance, nearest = np.empty(len(points)), np.empty(len(points), np.int32)
        frames = np.ascontiguousarray(transforms, np.float64)
        union_distances(self.kinds, self.joints, self.shapes, frames, points, distance, nearest)
        return distance, nearest

    def coverage(self, shaped: "ShapedBody", within_mm: float = 10.0) -> float:
        """Share of the body's vertices at rest that lie within `within_mm` of the proxy's surface."""
        identity = np.tile(np.eye(4)[:3], (len(self.pivots), 1, 1))
        return float((np.abs(self.distances(shaped.vertices, identity)[0]) <= within_mm / 1000).mean())

    def arrays(self) -> dict[str, np.ndarray]:
        """All arrays by name, as files hold them."""
        return {f"proxy_{name}": getattr(self, name) for name in _ARRAYS}

    @classmethod
    def of(cls, arrays: Mapping[str, np.ndarray], metadata: Mapping[str, Any]) -> "BodyProxy":
        """The proxy that `arrays` (and the key `proxy_names`) describe.

        Raises:
            BadModel: An array is missing or they do not fit together.
        """
        missing = [name for name in _ARRAYS if f"proxy_{name}" not in arrays]
        if missing:
            raise BadModel("a proxy must have all its arrays", f"no proxy_{missing[0]}", "make the file again")
        named = {name: arrays[f"proxy_{name}"] for name in _ARRAYS}
        return cls(**named, names=tuple(metadata.get("proxy_names", ())))


class _Shape:
    """A shaped body that equals another of the same body and betas."""

    def __init__(self, shaped: "ShapedBody"):
        self.shaped, self.key = shaped, (shaped.body.hash, np.asarray(shaped.betas).tobytes())

    def __hash__(self) -> int:
        return hash(self.key)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Shape) and self.key == other.key


@lru_cache(maxsize=16)
def _fit(shape: _Shape) -> BodyProxy:
    cones = fit_cones(shape.shaped)
    kinds = np.full(len(cones.joints), ROUND_CONE, np.int32)
    return BodyProxy(kinds, cones.joints, cones.shapes, np.asarray(shape.shaped.joints, np.float64), cones.names)


def _bounding_balls(kinds: np.ndarray, shapes: np.ndarray) -> np.ndarray:
    cone = (kinds == ROUND_CONE)[:, None]
    middle = np.where(cone, (shapes[:, :3] + shapes[:, 3:6]) / 2, shapes[:, :3])
    half = np.linalg.norm(shapes[:, 3:6] - shapes[:, :3], axis=1) / 2 + shapes[:, 6:8].max(1, initial=0)
    radius = np.select(
        [kinds == ROUND_CONE, kinds == ELLIPSOID],
        [half, shapes[:, 3:6].max(1, initial=0)],
        np.linalg.norm(shapes[:, 3:6], axis=1) + shapes[:, 15],
    )
    return np.ascontiguousarray(np.column_stack([middle, radius]))
