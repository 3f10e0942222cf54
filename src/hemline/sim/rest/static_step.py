"""One Newton step towards equilibrium: all forces on cloth at rest, as a potential around where it is."""

import numpy as np
from jaxtyping import Bool, Float, Int

from hemline.sim.cloth.inertia_kernels import Inertia
from hemline.sim.cloth.sheet import Positions
from hemline.sim.contact.body.body_contact import Contact
from hemline.sim.contact.body.friction_anchors import FrictionAnchors
from hemline.sim.contact.body.planes import SkinPoints, Planes, no_planes
from hemline.sim.step.pair_contacts import PairContacts
from hemline.sim.step.model import ClothModel
from hemline.sim.step.newton import newton_step
from hemline.sim.step.potential import Potential
from hemline.sim.step.state import Scene
from hemline.sim.step.terms.air import constant_force
from hemline.sim.step.terms.skin_contact import skin_contact
from hemline.sim.step.workspace import Workspace

from .statics_kernels import closest_on_faces

STICK_SLIP = 2e-4
"""Slip below which static friction is smoothed [m]."""

MAX_STRETCH = 4.0
"""How much farther than a Newton step the line search looks: without compression the Hessian is too stiff."""

MIN_LEAN_DISTANCE = 1e-4
"""Distance from the body below which its interpolated normal says the direction of contact [m]."""

SOLVER_SHARE, SOLVER_STEPS = 0.05, 400
"""How far conjugate gradients go in a Newton step of the statics, as the settings of the same names."""

WEAK_REGULARISATION = 1e3
"""Regularisation m / h^2 as h [s] that is hardly any."""

CreaseFaces = Int[np.ndarray, " verts"]


class StaticStep:
    """All forces on the cloth where it is, and a Newton step from there with m / h^2 added to the Hessian.

    The potential has the terms of a step in time: its inertia is about where the cloth is, its air is the weight, its
    friction refers to its anchors, and its load is that of the iterate. So its gradient is minus the resultant force.

    Args:
        model: The sheet; wind does not act.
        workspace: Arrays to work with.
        positions: Where the cloth is [m]; pins are put where the scene has them.
        pinched: Vertices whose contact yields.
        scene: What drives the cloth.
        friction_anchors: Friction anchors; vertices that touch without one get theirs here.
        h: Regularisation [s].
        soft: Share of the contact stiffness.
        whole: Whether the Hessian keeps all compression; otherwise what the regularisation makes harmless.
        held: Triangles of the body that vertices keep to, -1 for those that look for the closest.
        pressed: What friction went by before: from now on the mean of that and of the load. None: the load alone.
        known: Where the body was closest before; it speeds the search and does not change its result.

    Attributes:
        potential: Evaluated; `x`, `energy` and `residual_share` are its own.
        forces: Resultant force on each vertex at the start, 0 at pins [N].
        face: Triangle of the body that each vertex is held off from, -1 for none.
        depth: Penetration of the thickness [m].
        load: Force with which the body presses on each vertex [N].
        stretch: How many times the Newton step the line search went; 0: less than once.
        foreseen: Residual share where it ended, by the potential of the start.
    """

    def __init__(
        self,
        model: ClothModel,
        workspace: Workspace,
        positions: Positions,
        pinched: Bool[np.ndarray, " verts"],
        scene: Scene,
        friction_anchors: FrictionAnchors | None,
        *,
        h: float = WEAK_REGULARISATION,
        soft: float = 1.0,
        whole: bool = False,
        held: CreaseFaces | None = None,
        pressed: Float[np.ndarray, " verts"] | None = None,
        known: SkinPoints | None = None,
    ):
        self.model, self.soft = model, soft
        settings, sheet = model.settings, model.sheet
        x = np.array(positions, np.float64, order="C")
        x[model.pinned] = scene.pinned[model.hard]
        self.contact = self._contact(x, pinched, scene, known)
        self.meeting = PairContacts(model, workspace, self.contact, x, x)
        planes, self.face = self._planes(x, held)
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
                else friction_anchors.kept(fresh, (friction_anchors.face >= 0) | (self.load == 0))
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
        )
        self.potential.replace_pairs(self.meeting.lay(x))
        self.potential.evaluate(x)
        self._lean()
        self.forces = np.where(model.fixed[:, None], 0.0, -workspace.gradient)
        self.stretch = self.foreseen = 0.0

    @property
    def x(self) -> Positions:
        """Where the cloth is [m]."""
        return self.potential.x

    @property
    def planes(self) -> Planes:
        """Of the body under each vertex."""
        return self.potential.contact.planes

    def newton(self) -> int:
        """Take the Newton step, lengthened while the energy falls further; the steps of conjugate gradients.

        Raises:
            StepRejected: The Hessian is not positive.
        """
        potential, start = self.potential, self.potential.x
        taken = newton_step(potential, fresh=True, solver_share=SOLVER_SHARE, solver_steps=SOLVER_STEPS)
        kept, energy, self.foreseen = potential.x, potential.energy, potential.residual_share
        if taken.share < 1:
            return taken.solver_steps
        way, self.stretch = kept - start, 1.0
        while self.stretch < MAX_STRETCH:
            potential.evaluate(start + 2 * self.stretch * way)
            if not potential.energy < energy:
                break
            kept, energy, self.foreseen = potential.x, potential.energy, potential.residual_share
            self.stretch *= 2
        potential.x, potential.energy = kept, energy
        return taken.solver_steps

    def slipped(self) -> FrictionAnchors | None:
        """The friction anchors as slip leaves them: those beyond the smoothed slip are dragged along, idle ones go."""
        if self.friction_anchors is None or self.contact is None:
            return None
        normal, carried = self._normal, self.planes.carried
        slip = self.x - carried
        slip = slip - np.einsum("vi,vi->v", slip, normal)[:, None] * normal
        size = np.linalg.norm(slip, axis=1, keepdims=True)
        points = carried + np.maximum(1 - STICK_SLIP / np.maximum(size, 1e-12), 0.0) * slip
        moved = FrictionAnchors.at(points, self.friction_anchors.face, self.contact.now, self.contact.surface.faces)
        return FrictionAnchors(np.where(self.load > 0, moved.face, -1).astype(np.int32), moved.local)

    def _contact(self, x: Positions, pinched: np.ndarray, scene: Scene, known: SkinPoints | None) -> Contact | None:
        """Contact of the vertices with the body where both are, if there is one."""
        model = self.model
        if model.surface is None or scene.skin is None:
            return None
        stiffness = self.soft * model.contact_stiffness * np.where(pinched, model.settings.pinched_share, 1.0)
        return Contact(model.surface, scene.skin, scene.skin, x, x, model.fixed, stiffness, known)

    def _planes(self, x: Positions, held: CreaseFaces | None) -> tuple[Planes, CreaseFaces]:
        """The planes of the body, and its triangles under them: those that are kept to, else the closest."""
        contact = self.contact
        if contact is None:
            return no_planes(len(x)), np.full(len(x), -1, np.int32)
        if held is None or not (held >= 0).any():
            return contact.planes, contact.ahead.face
        face, weights = np.where(held >= 0, held, contact.ahead.face), contact.ahead.weights.copy()
        closest_on_faces(x, face, contact.now.vertices, contact.surface.faces, weights)
        return contact.laid(SkinPoints(contact.ahead.nearest, face, weights)), face

    def _lean(self) -> None:
        """Turn the contact planes onto the triangles, the forces unchanged.

        Contact pushes along interpolated normals n, but a vertex that moves along a triangle changes its distance by
        the triangle's normal m: with n in the Hessian, 0.1 mm on a coarse body would count as several weights.
        """
        potential, planes, x = self.potential, self.planes, self.potential.x
        gradient = potential.workspace.gradient.copy()
        way = x - planes.point
        away = way * np.sign(np.einsum("vi,vi->v", way, planes.normal))[:, None]
        length = np.linalg.norm(away, axis=1, keepdims=True)
        normal = np.where(length > MIN_LEAN_DISTANCE, away / np.maximum(length, MIN_LEAN_DISTANCE), planes.normal)
        gap = np.where(planes.stiffness > 0, planes.gap(x), 0.0)[:, None]
        leaned = planes._replace(normal=normal, point=x - gap * normal)
        potential.contact = potential.contact.on(leaned)
        potential.evaluate_contact()
        force = potential.air.force + (potential.workspace.gradient - gradient)
        potential.air = potential.air._replace(force=force)
        potential.evaluate_contact()


def _inertia_about(model: ClothModel, x: Positions, h: float, targets: Float[np.ndarray, "pins 3"]) -> Inertia:
    """m / h^2 about where the cloth is, with the springs of soft pins."""
    stiffness, goal, held = model.sheet.mass * (1 / h) ** 2, x.copy(), model.held
    stiffness[held] += model.spring
    goal[held] += (model.spring / stiffness[held])[:, None] * (targets[~model.hard] - x[held])
    return Inertia(goal, stiffness)
