"""Ways from the shape of a body to the garment on it, in the pose of one anchor."""

from dataclasses import dataclass

import numpy as np

from hemline.animators.agentdress.binding import Binding
from hemline.animators.agentdress.fit.anchor_set import AnchorSet
from hemline.animators.agentdress.model import AnimatorAgentDress
from hemline.animators.agentdress.shape_model import ShapeModel
from hemline.arrays import Faces, Float
from hemline.bodies import Body, PosedBody
from hemline.learning.pca import principal_of_rows
from papers.agentdress.compared import told_by
from papers.agentdress.drape_baseline import DrapeShapeModel, Poisson
from papers.agentdress.shape_drapes import Drapes, Shapes, Worn

COMPONENTS, RIDGE = 5, 0.2
"""Of the paper."""

PUSHED, ROUNDS = 1e-4, 20
"""How far over the skin a vertex is put [m], and how often it is looked for again."""


@dataclass(frozen=True)
class Ways:
    """One pose, and all that can tell the garment there on other bodies.

    Attributes:
        drapes: The pose and its simulated garments.
        anchors: All anchors.
        body: The body.
        model: What `hemline fit` makes of all of their drapes.
        faces: Triangles of the garment.
        poisson: From deformation gradients of the mean shape's garment to vertices.
    """

    drapes: Drapes
    anchors: AnchorSet
    body: Body
    model: AnimatorAgentDress
    faces: Faces
    poisson: Poisson

    @classmethod
    def of(cls, drapes: Drapes, anchors: AnchorSet, body: Body, model: AnimatorAgentDress) -> "Ways":
        """The mean shape is the anchors' first."""
        faces = model.garment.faces
        return cls(drapes, anchors, body, model, faces, Poisson.of(drapes.fitted[0], faces))

    def posed(self, betas: Float[np.ndarray, " betas"]) -> PosedBody:
        """A body in the pose."""
        return self.body.shaped(betas.astype(np.float32)).posed(self.drapes.pose)

    def known(self, betas: Shapes) -> Shapes:
        """The betas that the anchors know."""
        return betas[:, : self.anchors.betas.shape[1]]

    def coordinates(self, *, components: int = COMPONENTS, squares: bool = True) -> ShapeModel:
        """The paper's: of the coordinates of the vertices (Eq. 5 and 6)."""
        rows = self.drapes.fitted.reshape(len(self.drapes.fitted), -1)
        return ShapeModel.fit(rows, self.anchors.betas, components=components, ridge=RIDGE, squares=squares)

    def drape(self, *, components: int = COMPONENTS, **options: bool) -> DrapeShapeModel:
        """DRAPE's: of the deformation gradients of the triangles."""
        worn, betas = self.drapes.fitted, self.anchors.betas
        return DrapeShapeModel.fit(self.poisson, worn, betas, components=components, ridge=RIDGE, **options)

    def turned(self, betas: Shapes) -> Worn:
        """The same of what the anchor adds to skinning, in the turned frames of the vertices, where it blends [m]."""
        offsets = self.anchors.offsets[self.drapes.anchor].astype(np.float64).reshape(len(self.anchors.betas), -1)
        model = ShapeModel.fit(offsets, self.anchors.betas, components=COMPONENTS, ridge=RIDGE)
        added = model.at(self.known(betas)).reshape(len(betas), -1, 3)
        rests = self.anchors.rest
        rests = rests.at(betas[:, : len(rests.effects) // 2]).reshape(len(betas), -1, 3)
        each = zip(betas, rests, added, strict=True)
        return np.array([self.anchors.binding.skin(self.posed(b).transforms, rest, more) for b, rest, more in each])

    def played(self, betas: Shapes) -> Worn:
        """What the model says that the shape adds, to the simulated garment of the mean shape [m]."""
        told = told_by(self.model, self.anchors.offsets[self.drapes.anchor, 0])
        return np.array([told.settled(self.posed(each)) for each in betas])

    def following(self, betas: Shapes) -> Worn:
        """The mean shape's garment, each vertex moved as far as the closest vertex of the body [m]."""
        from scipy.spatial import KDTree

        mean = self.posed(np.zeros(1)).vertices
        nearest = KDTree(mean).query(self.drapes.fitted[0])[1]
        return np.array([self.drapes.fitted[0] + (self.posed(each).vertices - mean)[nearest] for each in betas])

    def skinned(self, betas: Shapes) -> Worn:
        """The mean shape's garment, carried along by the joints to where the other body has them [m]."""
        mean = self.posed(np.zeros(1))
        weights = Binding.of(self.drapes.fitted[0], self.faces, mean).shares()
        return np.array([self.drapes.fitted[0] + weights @ (self.posed(each).joints - mean.joints) for each in betas])

    def all(self) -> dict[str, Worn]:
        """The garment on the shapes that nobody fitted to, by name of the way [m]."""
        betas, known = self.drapes.betas, self.known(self.drapes.betas)
        drape, following = self.drape(), self.following(betas)
        return {
            "coordinates": self.coordinates().at(known).reshape(len(betas), -1, 3),
            "coordinates, without squares": self.coordinates(squares=False).at(known).reshape(len(betas), -1, 3),
            "coordinates, in turned frames": self.turned(betas),
            "kernel over pose and shape, as played": self.played(betas),
            "DRAPE": drape.at(known),
            "DRAPE, with squares": self.drape(squares=True).at(known),
            "DRAPE, triangles of any size alike": self.drape(by_area=False).at(known),
            "DRAPE, moved as the skin under it": drape.at(known, following.mean(axis=1)),
            "DRAPE, put where the simulation is": drape.at(known, self.drapes.unseen.mean(axis=1)),
            "following the closest vertex of the body": following,
            "skinning": self.skinned(betas),
        }

    def shares(self, most: int) -> dict[str, Float[np.ndarray, " components"]]:
        """Share of the variance that the first components hold, by what they are of and of which garments."""
        found, both = {}, (self.drapes.fitted, self.drapes.unseen)
        told = {
            "coordinates": [each.reshape(len(each), -1) for each in both],
            "gradients": [self.poisson.rows(each, self.poisson.roots) for each in both],
        }
        for name, (fitted, unseen) in told.items():
            mean = fitted.mean(axis=0)
            basis, _ = principal_of_rows(fitted - mean, most)
            for which, rows in {"fitted": fitted, "unseen": unseen}.items():
                squares = ((rows - mean) @ basis.T) ** 2
                found[f"{name}, {which}"] = squares.sum(axis=0).cumsum() / ((rows - mean) ** 2).sum()
        return found

    def pushed_out(self, worn: Worn) -> Worn:
        """Garments moved out of the bodies along the normal of the closest vertex (section 3.2) [m]."""
        return np.array([pushed_out(each, self.posed(b)) for each, b in zip(worn, self.drapes.betas, strict=True)])


def pushed_out(worn: Float[np.ndarray, "verts 3"], posed: PosedBody) -> Float[np.ndarray, "verts 3"]:
    """A garment moved out of a body along the normal of the closest vertex until it is in front of it [m].

    Source: Wu et al., "AgentDress: Realtime Clothing Synthesis for Virtual Agents using Plausible Deformations", 2021,
        section 3.2.
    """
    from scipy.spatial import KDTree

    tree, worn, asked = KDTree(posed.vertices), worn.copy(), np.arange(len(worn))
    for _ in range(ROUNDS):
        nearest = tree.query(worn[asked])[1]
        normals = posed.normals[nearest]
        lack = PUSHED - np.einsum("vi,vi->v", worn[asked] - posed.vertices[nearest], normals)
        behind = lack > PUSHED
        asked = asked[behind]
        worn[asked] += lack[behind, None] * normals[behind]
    return worn


def apart_mm(one: Worn, other: Worn) -> Float[np.ndarray, " shapes"]:
    """Mean distance of the vertices on each shape [mm]."""
    return 1e3 * np.linalg.norm(one - other, axis=2).mean(axis=1)
