"""Drapes in the pose of one anchor on known and random bodies, and models that predict them from the body shape."""

import sys
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from hemline import bodies
from hemline.animators.agentdress.binding import Binding
from hemline.animators.agentdress.fit.anchor_set import AnchorSet
from hemline.animators.agentdress.model import AnimatorAgentDress
from hemline.animators.agentdress.shape_model import ShapeModel
from hemline.arrays import Float, Int
from hemline.bodies import Body, PosedBody
from hemline.garments import Garment
from hemline.learning.pca import principal_of_rows
from hemline.motions.motion import Pose
from hemline.sim import random_shapes
from papers.agentdress.models.ablations import with_offsets
from papers.agentdress.models.drape_baseline import DrapeShapeModel, Poisson
from papers.agentdress.settled.pairs import settle_in_poses

Shapes = Float[np.ndarray, "shapes betas"]
Worn = Float[np.ndarray, "shapes verts 3"]


@dataclass(frozen=True)
class Drapes:
    """The garment in one pose, on the shapes that models are fitted to, and on random ones.

    Attributes:
        anchor: Index of the anchor.
        pose: The pose.
        fitted: The garment on each shape of the anchors [m].
        betas: Random shapes on which the garment came to rest.
        unseen: The garment on these random shapes [m].
    """

    anchor: int
    pose: Pose
    fitted: Worn
    betas: Shapes
    unseen: Worn


def anchor_drapes(anchors: AnchorSet, body: Body, number: int) -> tuple[Pose, Worn]:
    """Returns the pose of an anchor, and the garment on each of its shapes in the world [m]."""
    pose = Pose(anchors.rotations[number].astype(np.float32), body.shaped().rest_pose.translation)
    rests = anchors.rest.at(anchors.betas).reshape(len(anchors.betas), -1, 3)
    garments = [
        anchors.binding.skin(body.shaped(betas).posed(pose).transforms, rest, offsets)
        for betas, rest, offsets in zip(anchors.betas.astype(np.float32), rests, anchors.offsets[number], strict=True)
    ]
    return pose, np.array(garments)


def draw_shapes(body: Body, count: int, betas: int, seed: int) -> list[tuple[float, ...]]:
    """Draws random bodies with the given number of non-zero betas; the paper has four."""
    return [each[:betas] for each in random_shapes(body, count, seed)]


def settle_drapes(
    anchors: AnchorSet,
    folder: Path,
    garment: Garment,
    *,
    poses: int,
    shapes: list[tuple[float, ...]],
    seed: int,
    jobs: int,
) -> list[Drapes]:
    """Settles the garment in the poses of some anchors on random bodies.

    Args:
        anchors: Training data of the shape models.
        folder: A dataset, made if missing and continued.
        garment: The garment.
        poses: Number of anchors.
        shapes: Betas of the random bodies.
        seed: Seed of the choice of anchors.
        jobs: Number of processes.
    """
    body = bodies.load(garment.body_name)
    chosen: Int[np.ndarray, " some"] = np.random.default_rng(seed).permutation(len(anchors.rotations))[:poses]
    known = [anchor_drapes(anchors, body, int(number)) for number in chosen]
    by_pose: list[dict[int, np.ndarray]] = [{} for _ in chosen]
    for number, betas in enumerate(shapes):
        settled = settle_in_poses(folder, garment, [pose for pose, _ in known], betas, jobs=jobs)
        for unseen, vertices in zip(by_pose, settled, strict=True):
            if vertices is not None:
                unseen[number] = vertices.astype(np.float64)
        print(f"{number + 1} of {len(shapes)} shapes", file=sys.stderr, flush=True)
    return [
        Drapes(int(number), pose, fitted, np.array([shapes[each] for each in unseen]), np.array(list(unseen.values())))
        for number, (pose, fitted), unseen in zip(chosen, known, by_pose, strict=True)
    ]


COMPONENTS, RIDGE = 5, 0.2
"""Number of components in the paper, and ridge penalty."""

CLEARANCE, ROUNDS = 1e-4, 20
"""Height above the skin to which vertices are pushed [m], and largest number of rounds."""


@dataclass(frozen=True)
class ShapePredictions:
    """Predictions of the garment on other bodies in one pose.

    Attributes:
        drapes: The pose and its simulated garments; the first shape is the mean one.
        anchors: All anchors.
        body: The body.
        model: The model that `hemline fit` makes of all anchors.
    """

    drapes: Drapes
    anchors: AnchorSet
    body: Body
    model: AnimatorAgentDress

    @cached_property
    def poisson(self) -> Poisson:
        """Solver from deformation gradients of the garment on the mean shape to vertices."""
        return Poisson.of(self.drapes.fitted[0], self.model.garment.faces)

    def posed(self, betas: Float[np.ndarray, " betas"]) -> PosedBody:
        """Returns a body in the pose."""
        return self.body.shaped(betas.astype(np.float32)).posed(self.drapes.pose)

    def anchor_betas(self, betas: Shapes) -> Shapes:
        """Returns the betas that anchors have, of each shape."""
        return betas[:, : self.anchors.betas.shape[1]]

    def coordinates(self, *, components: int = COMPONENTS, squares: bool = True) -> ShapeModel:
        """Fits the model of the paper, on the coordinates of the vertices (Eq. 5 and 6)."""
        rows = self.drapes.fitted.reshape(len(self.drapes.fitted), -1)
        return ShapeModel.fit(rows, self.anchors.betas, components=components, ridge=RIDGE, squares=squares)

    def drape(self, *, components: int = COMPONENTS, **options: bool) -> DrapeShapeModel:
        """Fits the model of DRAPE, on the deformation gradients of the triangles."""
        fitted, betas = self.drapes.fitted, self.anchors.betas
        return DrapeShapeModel.fit(self.poisson, fitted, betas, components=components, ridge=RIDGE, **options)

    def in_rotated_frames(self, betas: Shapes) -> Worn:
        """Predicts with the model of the paper on the offsets of the anchor, as `--shape-model blended` does [m]."""
        offsets = self.anchors.offsets[self.drapes.anchor].astype(np.float64).reshape(len(self.anchors.betas), -1)
        model = ShapeModel.fit(offsets, self.anchors.betas, components=COMPONENTS, ridge=RIDGE)
        predicted = model.at(self.anchor_betas(betas)).reshape(len(betas), -1, 3)
        rest = self.anchors.rest
        rests = rest.at(betas[:, : len(rest.effects) // 2]).reshape(len(betas), -1, 3)
        parts, binding = zip(betas, rests, predicted, strict=True), self.anchors.binding
        return np.array([binding.skin(self.posed(b).transforms, each, offset) for b, each, offset in parts])

    def as_played(self, betas: Shapes) -> Worn:
        """Predicts with the fitted model, using the simulated garment of the mean shape as pose model [m]."""
        model = with_offsets(self.model, self.anchors.offsets[self.drapes.anchor, 0])
        return np.array([model.drape(self.posed(each)) for each in betas])

    def following_skin(self, betas: Shapes) -> Worn:
        """Moves each vertex on the mean shape as far as the closest body vertex [m]."""
        from scipy.spatial import KDTree

        mean = self.posed(np.zeros(1)).vertices
        nearest = KDTree(mean).query(self.drapes.fitted[0])[1]
        return np.array([self.drapes.fitted[0] + (self.posed(each).vertices - mean)[nearest] for each in betas])

    def following_joints(self, betas: Shapes) -> Worn:
        """Moves the garment of the mean shape with the joints of the other body [m]."""
        mean = self.posed(np.zeros(1))
        weights = Binding.of(self.drapes.fitted[0], self.model.garment.faces, mean).dense_weights()
        return np.array([self.drapes.fitted[0] + weights @ (self.posed(each).joints - mean.joints) for each in betas])

    def predict_all(self) -> dict[str, Worn]:
        """Predicts the garment on the unseen shapes with every model, by name [m]."""
        betas, known = self.drapes.betas, self.anchor_betas(self.drapes.betas)
        drape, following = self.drape(), self.following_skin(betas)
        return {
            "coordinates": self.coordinates().at(known).reshape(len(betas), -1, 3),
            "coordinates, without squares": self.coordinates(squares=False).at(known).reshape(len(betas), -1, 3),
            "coordinates, in turned frames": self.in_rotated_frames(betas),
            "kernel over pose and shape, as played": self.as_played(betas),
            "DRAPE": drape.at(known),
            "DRAPE, with squares": self.drape(squares=True).at(known),
            "DRAPE, triangles of any size alike": self.drape(by_area=False).at(known),
            "DRAPE, moved as the skin under it": drape.at(known, following.mean(axis=1)),
            "DRAPE, put where the simulation is": drape.at(known, self.drapes.unseen.mean(axis=1)),
            "following the closest vertex of the body": following,
            "skinning": self.following_joints(betas),
        }

    def explained_variance(self, count: int) -> dict[str, Float[np.ndarray, " components"]]:
        """Returns the fraction of variance explained by the first components, by quantity and set of garments."""
        fractions, both = {}, (self.drapes.fitted, self.drapes.unseen)
        quantities = {
            "coordinates": [each.reshape(len(each), -1) for each in both],
            "gradients": [self.poisson.rows(each, self.poisson.roots) for each in both],
        }
        for name, (fitted, unseen) in quantities.items():
            mean = fitted.mean(axis=0)
            basis, _ = principal_of_rows(fitted - mean, count)
            for which, rows in {"fitted": fitted, "unseen": unseen}.items():
                squares = ((rows - mean) @ basis.T) ** 2
                fractions[f"{name}, {which}"] = squares.sum(axis=0).cumsum() / ((rows - mean) ** 2).sum()
        return fractions

    def push_out(self, garments: Worn) -> Worn:
        """Moves garments on the unseen shapes out of the bodies, see `push_out` [m]."""
        return np.array([push_out(each, self.posed(b)) for each, b in zip(garments, self.drapes.betas, strict=True)])


def push_out(vertices: Float[np.ndarray, "verts 3"], posed: PosedBody) -> Float[np.ndarray, "verts 3"]:
    """Moves vertices along the normal of the closest body vertex until they are in front of it [m].

    Source: Wu et al., "AgentDress: Realtime Clothing Synthesis for Virtual Agents using Plausible Deformations", 2021,
        section 3.2.
    """
    from scipy.spatial import KDTree

    tree, vertices, active = KDTree(posed.vertices), vertices.copy(), np.arange(len(vertices))
    for _ in range(ROUNDS):
        nearest = tree.query(vertices[active])[1]
        normals = posed.normals[nearest]
        lack = CLEARANCE - np.einsum("vi,vi->v", vertices[active] - posed.vertices[nearest], normals)
        behind = lack > CLEARANCE
        active = active[behind]
        vertices[active] += lack[behind, None] * normals[behind]
    return vertices


def distances_mm(garments: Worn, others: Worn) -> Float[np.ndarray, " shapes"]:
    """Returns the mean distance of the vertices on each shape [mm]."""
    return 1e3 * np.linalg.norm(garments - others, axis=2).mean(axis=1)
