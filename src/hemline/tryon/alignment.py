"""Aligns a garment with a body that it was not made for: finds its place, its scale, and the pose of the body."""

from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from hemline.arrays import Faces, Float, Int, Vertices
from hemline.bodies import own_size, skin_points
from hemline.garments.reading.units import AXES, UP_GUESS_RATIO, to_y_up
from hemline.meshes.segment_crossing_kernels import crossings_of_segments
from hemline.motions.motion import JOINT_NAMES, PARENTS, Pose
from hemline.motions.quaternions import from_axis_angle, inverse, multiply

from .rims import Rim, rims_of
from .skeleton import Skeleton

if TYPE_CHECKING:
    from hemline.bodies import ShapedBody

CLOTH_SAMPLES, BODY_SAMPLES = 400, 2500
"""Number of vertices of the cloth and of the body that are sampled."""

BOUNDS = ((-0.3, 0.3), (-0.15, 0.15), (-0.4, 0.4), (-0.9, 1.2), (-0.5, 0.5), (-0.9, 1.6), (-0.1, 0.4))
"""Bounds of the variables: up, forward [m], logarithm of the scale, arms up, arms forward, elbows, legs apart [rad]."""

EVALUATIONS = 600
"""Number of placements that are evaluated from each start."""

STARTS = 3
"""Number of starts of the search for each possible origin of the garment."""

SIZES = (-0.25, 0.0, 0.3)
"""Logarithms of the scale from which the search starts."""

EASY_RESIZE = 0.05
"""Logarithm of the scale above which its cost grows linearly instead of quadratically."""

OFF_BODY_DISTANCE = 0.2
"""A garment farther than this from the body, with its origin at pelvis or floor, has its origin elsewhere [m]."""


@dataclass(frozen=True, eq=False)
class Alignment:
    """Placement of a garment, and pose of the body, such that limbs go through its openings.

    Attributes:
        vertices: Positions of the garment [m].
        pose: Pose of the body.
        up: The axis that points up in the garment's file, y or z.
        scale: Scale factor of the garment.
        moved: Displacement of its centre, after it was turned to y up [m].
        angles: By how much arms are raised and brought forward, elbows bent and legs spread from the rest pose [rad].
        through: Names of joints whose segments of the skeleton go through cloth; empty if the alignment is good.
        empty: Number of openings that no limb goes through.
        rims: Number of openings.
        cost: Least cost that the search found, see `align`: below 2 where a garment goes around its body.
        misfit: Least cost among the places and poses from which the search started.
    """

    vertices: Vertices
    pose: Pose
    up: str
    scale: float
    moved: Float[np.ndarray, "3"]
    angles: tuple[float, float, float, float]
    through: tuple[str, ...]
    empty: int
    rims: int
    cost: float
    misfit: float


def misfit(
    vertices: Vertices,
    faces: Faces,
    shaped: "ShapedBody",
    up: str | None = None,
    *,
    sizes: tuple[float, ...] = SIZES,
) -> float:
    """Returns the least cost of a garment among the places and poses from which a search starts, see `align`.

    Args:
        vertices: Positions of the garment [m].
        faces: Triangles.
        shaped: The body.
        up: The axis that points up, y or z; None: either.
        sizes: Logarithms of the scales from which it starts; fewer take less time.
    """
    points, faces = np.asarray(vertices, np.float64), np.ascontiguousarray(faces)
    return min(_Search(to_y_up(points, axis), faces, shaped, sizes).least for axis in ((up,) if up else AXES))


def align(
    vertices: Vertices, faces: Faces, shaped: "ShapedBody", *, scaled: bool = True, up: str | None = None
) -> Alignment:
    """Finds the place and scale of a garment, and the pose of a body, that suit each other best.

    The cost is a weighted sum of terms for cloth inside the body, cloth far from it, openings whose centre is far from
    a limb, openings that no limb goes through, segments of the skeleton that go through cloth, and changes of pose,
    place and scale. A scale that suits a body of unusual size, such as a child's, costs no more than none. The best
    candidates of a grid of places and poses are refined by Powell's method.

    Args:
        vertices: Positions of the garment [m]; its origin is at the pelvis, on the floor, or anywhere.
        faces: Triangles.
        shaped: The body.
        scaled: Whether the scale may change.
        up: The axis that points up, y or z. If it is None, it is y, unless the garment fits much better with z up.
    """
    sizes = SIZES if scaled else (0.0,)
    points, faces = np.asarray(vertices, np.float64), np.ascontiguousarray(faces)
    axes = (up,) if up else AXES
    searches = [_Search(to_y_up(points, axis), faces, shaped, sizes) for axis in axes]
    chosen = int(searches[-1].least < UP_GUESS_RATIO * searches[0].least)
    search = searches[chosen]
    bounds = [*BOUNDS]
    low, high = BOUNDS[2]
    bounds[2] = (min(low, search.own_size - 0.1), max(high, search.own_size + 0.1)) if scaled else (-1e-9, 1e-9)
    results = [search.minimise(start, lift, bounds) for lift, start in search.starts]
    _, x, lift = min(results, key=lambda each: each[0])
    # Powell's method moves along one direction at a time: try once more with the original scale
    again = search.minimise(np.where(np.arange(len(x)) == 2, 0.0, x), lift, bounds)
    _, x, lift = min((again, *results), key=lambda each: each[0])
    return search.result(x, lift, axes[chosen])


class _Search:
    """Search for the alignment of one garment and one body."""

    def __init__(self, vertices: Vertices, faces: Faces, shaped: "ShapedBody", sizes: tuple[float, ...]):
        self.vertices, self.faces, self.shaped, self.sizes = vertices, faces, shaped, sizes
        self.centre = vertices.mean(axis=0)
        self.own_size = float(np.log(own_size(shaped)))
        self.some = np.linspace(0, len(vertices) - 1, min(CLOTH_SAMPLES, len(vertices))).astype(int)
        self.skin = np.linspace(0, len(shaped.vertices) - 1, BODY_SAMPLES).astype(int)
        self.rims = rims_of(vertices, faces)
        self.body = lru_cache(maxsize=4096)(self._body)
        self.origins = self._origins()
        self.starts, self.least = self._starts()

    def _origins(self) -> list[np.ndarray]:
        """Returns possible origins: pelvis and floor; if both are far off, two that put its top at neck or spine."""
        shaped, joints = self.shaped, self.shaped.joints
        known = [np.zeros(3), np.array([0, float(shaped.vertices[:, 1].min()), 0])]
        points = self.vertices[self.some]
        tree = self.body(0.0, 0.0, 0.0, 0.0)[3]
        if min(tree.query(points + origin)[0].min() for origin in known) < OFF_BODY_DISTANCE:
            return known
        middle = 0.5 * (self.vertices.min(axis=0) + self.vertices.max(axis=0))
        tops = [float(joints[JOINT_NAMES.index(name)][1]) for name in ("neck", "spine2")]
        return [np.array([-middle[0], top - self.vertices[:, 1].max(), -middle[2]]) for top in tops]

    def _starts(self) -> tuple[list[tuple[int, np.ndarray]], float]:
        """Returns the best places and poses of a grid, far apart from each other, and the cost of the best."""
        grid = [
            (lift, np.array([up, 0, size, arms, 0, elbows, 0], np.float64))
            for lift in range(len(self.origins))
            for arms in (-0.6, -0.3, 0.0, 0.35, 0.7)
            for elbows in (-0.6, 0.0, 1.0)
            for up in (-0.1, -0.05, 0.0, 0.05)
            for size in dict.fromkeys((*self.sizes, self.own_size) if len(self.sizes) > 1 else self.sizes)
        ]
        grid.sort(key=lambda each: self.cost(each[1], each[0]))
        picked: list[tuple[int, np.ndarray]] = []
        for lift, start in grid:
            alike = [place for other, place in picked if lift == other]
            if len(alike) < STARTS and all(np.abs(start - place).max() > 0.24 for place in alike):
                picked.append((lift, start))
        # an origin with which the garment fits far worse is not searched
        least = self.cost(picked[0][1], picked[0][0])
        return [(lift, start) for lift, start in picked if self.cost(start, lift) < 2 * least + 1], least

    def minimise(self, start: np.ndarray, lift: int, bounds: list) -> tuple[float, np.ndarray, int]:
        """Minimises the cost from a start; returns the least cost, its variables and the origin."""
        from scipy.optimize import minimize

        options = {"maxfev": EVALUATIONS, "xtol": 1e-3, "ftol": 1e-4}
        results = minimize(self.cost, start, (lift,), method="Powell", bounds=bounds, options=options)
        return float(results.fun), np.asarray(results.x), lift

    def cost(self, x: np.ndarray, lift: int) -> float:
        """Returns the cost of a placement and a pose, see `align`."""
        placed = self.place(x, lift)
        skeleton, height = self.heights(x, placed[self.some])
        inside = (np.clip(-height, 0, 0.08) ** 2).mean() / 0.02**2
        far = np.clip(height - 0.005, 0, 0.3).mean() / 0.05
        resized = min(_resize_cost(x[2]), _resize_cost(x[2] - self.own_size))
        changed = resized + 0.04 * float((x[3:] ** 2).sum()) + 2 * float((x[:2] ** 2).sum())
        rims = [rim.at(placed) for rim in self.rims]
        off = sum(
            min(d / (rim.radius + 0.05), 3.0) ** 2 for rim, d in zip(rims, _centres_off(rims, skeleton), strict=True)
        )
        empty = sum(not rim.has_limb(skeleton) for rim in rims)
        crossed = min(int(self.cloth_crossings(placed, skeleton).sum()), 20)
        return float(inside + 0.1 * far + changed + 2 * off / max(len(rims), 1) + 1.0 * empty + 0.3 * crossed)

    def place(self, x: np.ndarray, lift: int) -> Vertices:
        """Returns the garment, scaled about its centre and moved [m]."""
        displacement = self.origins[lift] + (0, x[0], x[1])
        return np.exp(x[2]) * (self.vertices - self.centre) + self.centre + displacement

    def heights(self, x: np.ndarray, points: np.ndarray) -> tuple[Skeleton, np.ndarray]:
        """Returns the posed skeleton, and the approximate height of points above the skin, negative inside [m]."""
        skeleton, skin, normals, tree = self.body(*(round(float(angle), 3) for angle in x[3:]))
        distance, nearest = tree.query(points)
        height = ((points - skin[nearest]) * normals[nearest]).sum(axis=1)
        return skeleton, np.where(height < 0, -distance, distance)

    def _body(self, *angles: float):
        from scipy.spatial import KDTree

        shaped, body = self.shaped, self.shaped.body
        pose = pose_from_angles(shaped, angles)
        transforms, joints = shaped.transforms_of(pose.rotations[None], pose.translation[None])
        of = (body.weight_indices[self.skin], body.weights[self.skin])
        points = shaped.vertices[self.skin]
        skin = skin_points(transforms[0], *of, points).astype(np.float64)
        raised = skin_points(transforms[0], *of, points + shaped.normals[self.skin])
        return Skeleton.of(joints[0]), skin, raised - skin, KDTree(skin)

    def cloth_crossings(self, placed: Vertices, skeleton: Skeleton) -> Int[np.ndarray, " segments"]:
        """Returns how often each inner segment goes through cloth."""
        count = np.empty(len(skeleton.inner), np.int64)
        crossings_of_segments(skeleton.points, skeleton.inner, placed, self.faces, count)
        return count

    def result(self, x: np.ndarray, lift: int, up: str) -> Alignment:
        """Returns the alignment for given variables."""
        placed = self.place(x, lift)
        skeleton, _ = self.heights(x, placed[self.some])
        through = tuple(
            dict.fromkeys(skeleton.name(int(s)) for s in np.flatnonzero(self.cloth_crossings(placed, skeleton)))
        )
        empty = sum(not rim.at(placed).has_limb(skeleton) for rim in self.rims)
        return Alignment(
            placed,
            pose_from_angles(self.shaped, tuple(x[3:])),
            up,
            float(np.exp(x[2])),
            placed.mean(axis=0) - self.centre,
            (float(x[3]), float(x[4]), float(x[5]), float(x[6])),
            through,
            empty,
            len(self.rims),
            self.cost(x, lift),
            self.least,
        )


def _resize_cost(logarithm: float) -> float:
    """Returns the cost of a change of size: hardly anything at first, then proportional to it."""
    size = abs(logarithm)
    return 40 * size**2 if size < EASY_RESIZE else 40 * EASY_RESIZE * (2 * size - EASY_RESIZE)


def _centres_off(rims: list[Rim], skeleton: Skeleton) -> np.ndarray:
    centres = np.array([rim.points[-1] for rim in rims]).reshape(-1, 3)
    return np.linalg.norm(centres - skeleton.nearest(centres), axis=1)


def pose_from_angles(shaped: "ShapedBody", angles: tuple[float, ...]) -> Pose:
    """Returns the rest pose with both arms raised and brought forward, elbows bent and legs spread.

    Args:
        shaped: The body.
        angles: Angles in this order: arms up, arms forward, elbows, legs apart [rad].
    """
    up, forward, bend, apart = angles
    rest, rotations = shaped.rest_pose, shaped.rest_pose.rotations.astype(np.float64)
    for sign, hinge, joints in _hinges(shaped):
        turns = {
            "shoulder": np.array([0, -sign * forward, sign * up]),
            "elbow": bend * hinge,
            "hip": np.array([0, 0, sign * apart]),
        }
        for name, turn in turns.items():
            # the turn is about axes of the world at rest, so it is transformed to the frame of the parent
            joint, parent = joints[name]
            local = multiply(multiply(inverse(parent), from_axis_angle(turn)), parent)
            rotations[joint] = multiply(local, rest.rotations[joint].astype(np.float64))
    return Pose(rotations.astype(np.float32), rest.translation)


@lru_cache(maxsize=4)
def _hinges(shaped: "ShapedBody") -> tuple[tuple[float, np.ndarray, dict[str, tuple[int, np.ndarray]]], ...]:
    """Returns the sign, the axis of the elbow, and joints with their parents' global rotations, of each side."""
    before, sides = shaped.rest_pose.rotations.astype(np.float64), []
    for side, sign in (("left", 1.0), ("right", -1.0)):
        numbers = {each: JOINT_NAMES.index(f"{side}_{each}") for each in ("shoulder", "elbow", "wrist", "hip")}
        shoulder, elbow, wrist = (shaped.joints[numbers[each]] for each in ("shoulder", "elbow", "wrist"))
        hinge = np.cross(elbow - shoulder, wrist - elbow).astype(np.float64)
        joints = {
            name: (numbers[name], _global(before, PARENTS[numbers[name]])) for name in ("shoulder", "elbow", "hip")
        }
        sides.append((sign, hinge / max(float(np.linalg.norm(hinge)), 1e-12), joints))
    return tuple(sides)


def _global(rotations: np.ndarray, joint: int) -> np.ndarray:
    result = rotations[joint]
    while PARENTS[joint] >= 0:
        joint = PARENTS[joint]
        result = multiply(rotations[joint], result)
    return result
