"""One Newton step towards equilibrium: all forces on cloth at rest, as a potential around its positions."""

import numpy as np
from jaxtyping import Bool, Float, Int

from hemline.sim.cloth.inertia_kernels import Inertia
from hemline.sim.cloth.sheet import Positions
from hemline.sim.contact.body.body_contact import ClosestContact, Contact
from hemline.sim.contact.body.friction_anchors import FrictionAnchors
from hemline.sim.contact.body.planes import Planes, SkinPoints, no_planes
from hemline.sim.step.model import ClothModel
from hemline.sim.step.newton import newton_step
from hemline.sim.step.pair_contacts import PairContacts
from hemline.sim.step.potential import Potential
from hemline.sim.step.state import StepScene
from hemline.sim.step.terms.air import constant_force
from hemline.sim.step.terms.registry import make_terms
from hemline.sim.step.terms.skin_contact import skin_contact
from hemline.sim.step.terms.term import TermInputs
from hemline.sim.step.workspace import Workspace

from .statics_kernels import closest_on_faces

STICK_SLIP = 2e-4
"""Slip below which static friction is smoothed [m]."""

MAX_STRETCH = 4.0
"""Maximum length of the line search, as a multiple of the Newton step: without compression the Hessian is too stiff."""

MIN_LEAN_DISTANCE = 1e-4
"""Distance from the body below which the interpolated normal gives the direction of contact [m]."""

SOLVER_SHARE, SOLVER_STEPS = 0.05, 400
"""Tolerance and maximum number of steps of conjugate gradients in a static Newton step, see `SimSettings`."""

WEAK_REGULARISATION = 1e3
"""Length h of a step that makes the regularisation m / h^2 negligible [s]."""

BodyFaces = Int[np.ndarray, " verts"]
"""One triangle of the body for each cloth vertex, -1 for none."""


class StaticStep:
    """All forces on the cloth at its positions, and a Newton step from there with m / h^2 added to the Hessian.

    The potential has the terms of a step in time. Its inertia is about the positions of the cloth, its air is the
    weight, its friction refers to the anchors, and its load is that of the iterate. So its gradient is minus the
    resultant force.

    Args:
        model: The sheet; wind does not act.
        workspace: Arrays that every evaluation overwrites.
        positions: Positions of the cloth [m]; pins are moved to their targets in the scene.
        pinched: Vertices whose contact yields.
        scene: Pins and body.
        friction_anchors: Friction anchors; vertices that touch without an anchor get one here.
        h: Length of the step that gives the regularisation [s].
        soft: Fraction of the contact stiffness that acts.
        whole: Whether the Hessian keeps all compression; otherwise as much as the regularisation makes harmless.
        crease_face: Triangles of the body that vertices stay with, -1 for those that search for the closest one.
        pressed: The `pressed` of the step before, which this step averages with the load; None for the load alone.
        known: Closest points of an earlier step; they speed the search and do not change its result.

    Attributes:
        potential: The potential, evaluated; `x`, `energy` and `residual_share` belong to it.
        forces: Resultant force on each vertex at the start, 0 at pins [N].
        face: Triangle of the body that holds each vertex off, -1 for none.
        depth: Penetration of the thickness [m].
        load: Force with which the body presses on each vertex [N].
        pressed: Load that friction is computed with [N].
        stretch: Length of the line search as a multiple of the Newton step; 0 if it was shortened.
        predicted: Residual at the end of the line search by the potential of the start, over the mean weight.
    """

    def __init__(
        self,
        model: ClothModel,
        workspace: Workspace,
        positions: Positions,
        pinched: Bool[np.ndarray, " verts"],
        scene: StepScene,
        friction_anchors: FrictionAnchors | None,
        *,
        h: float = WEAK_REGULARISATION,
        soft: float = 1.0,
        whole: bool = False,
        crease_face: BodyFaces | None = None,
        pressed: Float[np.ndarray, " verts"] | None = None,
        known: SkinPoints | None = None,
    ):
        self.model, self.soft = model, soft
        settings, sheet = model.settings, model.sheet
        x = np.array(positions, np.float64, order="C")
        x[model.pinned] = scene.pinned[model.hard]
        self.contact = self._find_contact(x, pinched, scene, known)
        self.pair_contacts = PairContacts(model, workspace, self.contact, x, x)
        planes, self.face = self._planes(x, crease_face)
        self.depth = np.clip(settings.thickness - planes.gap(x), 0, settings.contact_depth)
        self.load = planes.stiffness * self.depth
        self.pressed = self.load if pressed is None else 0.5 * (self.load + pressed)
        self.friction_anchors = friction_anchors
        if self.contact is not None and scene.skin is not None:
            faces = self.contact.surface.faces
            fresh = FrictionAnchors.at(x, self.face, scene.skin, faces)
            self.friction_anchors = (
                fresh
                if friction_anchors is None
                else friction_anchors.select(fresh, (friction_anchors.face >= 0) | (self.load == 0))
            )
            planes = planes._replace(carried=self.friction_anchors.points(scene.skin, faces))
        self._normal = planes.normal
        self.potential = Potential(
            model,
            workspace,
            start=x,
            over_h=0.0,
            cap=np.full_like(model.cap, np.inf) if whole else model.cap * (1 / h) ** 2,
            inertia=_inertia_about(model, x, h, scene.pinned),
            air=constant_force(x, sheet.mass[:, None] * np.array(settings.gravity)),
            contact=skin_contact(planes, sheet.friction * self.pressed, settings, STICK_SLIP),
            terms=make_terms(TermInputs(model, x, scene, np.inf)),
        )
        self.potential.replace_pairs(self.pair_contacts.at(x))
        self.potential.evaluate(x)
        self._lean_planes()
        self.forces = np.where(model.fixed[:, None], 0.0, -workspace.evaluation.gradient)
        self.stretch = self.predicted = 0.0

    @property
    def x(self) -> Positions:
        """Positions of the cloth [m]."""
        return self.potential.x

    @property
    def planes(self) -> Planes:
        """Planes of the body under each vertex."""
        return self.potential.contact.planes

    def newton(self) -> int:
        """Takes the Newton step, lengthened while the energy falls further.

        Returns:
            Number of steps of conjugate gradients.

        Raises:
            StepRejected: The Hessian is not positive.
        """
        potential, start = self.potential, self.potential.x
        taken = newton_step(potential, fresh=True, solver_share=SOLVER_SHARE, solver_steps=SOLVER_STEPS)
        best, energy, self.predicted = potential.x, potential.energy, potential.residual_share
        if taken.fraction < 1:
            return taken.solver_steps
        direction, self.stretch = best - start, 1.0
        while self.stretch < MAX_STRETCH:
            potential.evaluate(start + 2 * self.stretch * direction)
            if not potential.energy < energy:
                break
            best, energy, self.predicted = potential.x, potential.energy, potential.residual_share
            self.stretch *= 2
        potential.x, potential.energy = best, energy
        return taken.solver_steps

    def drag_anchors(self) -> FrictionAnchors | None:
        """Returns the friction anchors after slip: farther ones are dragged along, those without load are removed."""
        if self.friction_anchors is None or self.contact is None:
            return None
        normal, carried = self._normal, self.planes.carried
        slip = self.x - carried
        slip = slip - np.einsum("vi,vi->v", slip, normal)[:, None] * normal
        size = np.linalg.norm(slip, axis=1, keepdims=True)
        points = carried + np.maximum(1 - STICK_SLIP / np.maximum(size, 1e-12), 0.0) * slip
        moved = FrictionAnchors.at(points, self.friction_anchors.face, self.contact.now, self.contact.surface.faces)
        return FrictionAnchors(np.where(self.load > 0, moved.face, -1).astype(np.int32), moved.local)

    def _find_contact(
        self, x: Positions, pinched: np.ndarray, scene: StepScene, known: SkinPoints | None
    ) -> Contact | None:
        """Returns the contact of the vertices with the body, neither of which moves; None without a body."""
        model = self.model
        if model.surface is None or scene.skin is None:
            return None
        stiffness = self.soft * model.contact_stiffness * np.where(pinched, model.settings.pinched_share, 1.0)
        return ClosestContact(model.surface, scene.skin, scene.skin, x, x, model.fixed, stiffness, known)

    def _planes(self, x: Positions, crease_face: BodyFaces | None) -> tuple[Planes, BodyFaces]:
        """Returns the planes of the body and the triangles under them: the given ones, else the closest."""
        contact = self.contact
        if contact is None:
            return no_planes(len(x)), np.full(len(x), -1, np.int32)
        if crease_face is None or not (crease_face >= 0).any():
            return contact.planes, contact.ahead.face
        face = np.where(crease_face >= 0, crease_face, contact.ahead.face)
        weights = contact.ahead.weights.copy()
        closest_on_faces(x, face, contact.now.vertices, contact.surface.faces, weights)
        return contact.planes_at(SkinPoints(contact.ahead.nearest, face, weights)), face

    def _lean_planes(self) -> None:
        """Turns the contact planes onto the triangles; forces do not change.

        Contact pushes along interpolated normals n, but a vertex that moves along a triangle changes its distance by
        the triangle's normal m: with n in the Hessian, 0.1 mm on a coarse body would count as several weights.
        """
        potential, planes, x = self.potential, self.planes, self.potential.x
        gradient = potential.workspace.evaluation.gradient.copy()
        offset = x - planes.point
        away = offset * np.sign(np.einsum("vi,vi->v", offset, planes.normal))[:, None]
        length = np.linalg.norm(away, axis=1, keepdims=True)
        normal = np.where(length > MIN_LEAN_DISTANCE, away / np.maximum(length, MIN_LEAN_DISTANCE), planes.normal)
        gap = np.where(planes.stiffness > 0, planes.gap(x), 0.0)[:, None]
        leaned = planes._replace(normal=normal, point=x - gap * normal)
        potential.contact = potential.contact.on(leaned)
        potential.evaluate_contact()
        force = potential.air.force + (potential.workspace.evaluation.gradient - gradient)
        potential.air = potential.air._replace(force=force)
        potential.evaluate_contact()


def _inertia_about(model: ClothModel, x: Positions, h: float, targets: Float[np.ndarray, "pins 3"]) -> Inertia:
    """Returns inertia m / h^2 about the positions of the cloth, with the springs of soft pins."""
    stiffness, goal, pins = model.sheet.mass * (1 / h) ** 2, x.copy(), model.soft_pins
    stiffness[pins] += model.spring
    goal[pins] += (model.spring / stiffness[pins])[:, None] * (targets[~model.hard] - x[pins])
    return Inertia(goal, stiffness)
