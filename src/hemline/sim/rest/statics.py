"""Static equilibrium of one sheet: Newton's method on the forces themselves, without inertia."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Bool, Float, Int

from hemline.sim.cloth.sheet import Positions
from hemline.sim.contact.body.friction_anchors import FrictionAnchors
from hemline.sim.contact.body.planes import SkinPoints
from hemline.sim.step.model import ClothModel
from hemline.sim.step.state import StepRejected, StepScene
from hemline.sim.step.workspace import Workspace

from .static_step import BodyFaces, StaticStep

MAX_VERTEX_MOVE = 0.02
"""A Newton step that moves a vertex farther than this distance is repeated with more regularisation [m]."""

FIRST_H, MIN_H, MAX_H = 0.03, 1e-4, 1e3
"""Lengths h of a step that give the regularisation m / h^2 of the first Newton step, the strongest and the weakest
one [s]."""

SOFT_CONTACT = 0.05
"""Fraction of the contact stiffness with which the search begins far from equilibrium."""

SOFT_RESIDUAL, HARDEN_RESIDUAL, NEAR_RESIDUAL = 1.0, 0.1, 0.02
"""Residuals over the mean weight of a vertex. Above the first, contact is soft at first; at the second, it hardens;
below the third, the Hessian keeps all compression and friction uses the load itself.
"""

CREASE_RELEASE = 0.01
"""Distance from the side of a crease beyond which a vertex is released from it [m]."""

TURNED_COSINE, MIN_FLIPS = 0.9, 3
"""A vertex is in a crease once its contact has turned this number of times, each time beyond this cosine."""

MAX_GROWTH, SHORT_H = 1.5, 1e-3
"""A Newton step after which the residual has grown by this factor is repeated, unless h was this short [s]. It is not
repeated either if no contact changed and the step predicted the growth: where cloth buckles, the energy falls and the
residual grows."""

MAX_STALLED_STEPS = 40
"""Newton steps within which the residual must fall by a tenth, counted from the start of the last valley."""


@dataclass(frozen=True)
class Equilibrium:
    """The end of a search.

    Attributes:
        positions: Positions of the cloth [m].
        forces: Remaining force on each vertex [N].
        load: Force with which the body presses on each vertex [N].
        face: Triangle of the body that holds each vertex off, -1 for none.
        crease_face: Triangle that each vertex in a crease stays with, -1 for the others.
        friction_anchors: Friction anchors from here on; None without a body.
        residual_share: Mean size of the forces over the mean weight of a vertex.
        newton_steps: Number of Newton steps.
        solver_steps: Number of steps of conjugate gradients in all Newton steps.
    """

    positions: Positions
    forces: Positions
    load: Float[np.ndarray, " verts"]
    face: Int[np.ndarray, " verts"]
    crease_face: BodyFaces
    friction_anchors: FrictionAnchors | None
    residual_share: float
    newton_steps: int = 0
    solver_steps: int = 0


class EquilibriumSearch:
    """Searches for the equilibrium near some positions.

    This is Newton's method with m / h^2 added to the Hessian. h doubles after each step that the line search takes
    whole and is halved after others, so that the cloth creeps downhill far from equilibrium and takes plain Newton
    steps near it. Before each step, contact, load and the direction of friction are updated.

    Far from equilibrium, contact is soft: stiff contact lets vertices through one by one and cuts every step short. The
    load stays when contact hardens. A vertex in a crease of the body is near both sides of it; one that alternates
    between the sides stays with the side where it is. The energy falls with each step, but updated contact may bring
    back more energy than was gained; the step is then repeated, much shorter. If contact plays no part, a growing
    residual means that the cloth leaves an unstable equilibrium. A vertex that touches in every other step would have
    friction in every other step. The load for friction therefore changes by halves until the equilibrium is near; the
    equilibrium must hold with the load itself.

    Args:
        model: The sheet; wind does not act.
        workspace: Arrays that every evaluation overwrites.
        pinched: Vertices whose contact yields.
        scene: Pins and body.
        crease_face: Triangles that vertices in a crease stay with from the start; None for none.
    """

    def __init__(
        self,
        model: ClothModel,
        workspace: Workspace,
        pinched: Bool[np.ndarray, " verts"],
        scene: StepScene,
        crease_face: BodyFaces | None = None,
        on_step: Callable[[], None] | None = None,
    ):
        self.on_step = on_step
        self.model, self.workspace, self.pinched, self.scene = model, workspace, pinched, scene
        self.newton_steps = self.solver_steps = 0
        self.flips = np.zeros(len(pinched), np.int32)
        self.crease_face = np.full(len(pinched), -1, np.int32) if crease_face is None else crease_face
        self.last: StaticStep | None = None
        self._known: SkinPoints | None = None

    def run(
        self, positions: Positions, friction_anchors: FrictionAnchors | None, *, tolerance: float, newton_steps: int
    ) -> Equilibrium:
        """Searches from some positions.

        Args:
            positions: Positions to start from [m].
            friction_anchors: Friction anchors.
            tolerance: Mean residual force that is small enough, over the mean weight of a vertex.
            newton_steps: Maximum number of Newton steps.

        Returns:
            The best positions of the search; `residual_share` tells whether they are an equilibrium.
        """
        step = self._step(positions, friction_anchors)
        if step.potential.residual_share > SOFT_RESIDUAL:
            step = self._descend(
                self._step(positions, friction_anchors, soft=SOFT_CONTACT),
                max(tolerance, HARDEN_RESIDUAL),
                newton_steps,
            )
            step = self._step(
                step.x + ((1 - SOFT_CONTACT) * step.depth)[:, None] * step.planes.normal, step.friction_anchors
            )
        step = self._descend(step, tolerance, newton_steps)
        return Equilibrium(
            positions=step.x,
            forces=step.forces,
            load=step.load,
            face=step.face,
            crease_face=self.crease_face,
            friction_anchors=step.drag_anchors(),
            residual_share=step.potential.residual_share,
            newton_steps=self.newton_steps,
            solver_steps=self.solver_steps,
        )

    def _step(
        self, positions: Positions, friction_anchors: FrictionAnchors | None, *, by_halves: bool = True, **options: Any
    ) -> StaticStep:
        last = self.last
        pressed = (
            last.pressed if by_halves and last is not None and last.potential.residual_share > NEAR_RESIDUAL else None
        )
        options = {"h": FIRST_H, "crease_face": self.crease_face, "pressed": pressed, "known": self._known} | options
        step = StaticStep(self.model, self.workspace, positions, self.pinched, self.scene, friction_anchors, **options)
        self._known = None if step.contact is None else step.contact.ahead
        if self.last is not None:
            turned = np.einsum("vi,vi->v", step.planes.normal, self.last.planes.normal) < TURNED_COSINE
            self.flips += turned & (step.load > 0) & (self.last.load > 0) & (step.face != self.last.face)
            self.crease_face = np.where((self.flips >= MIN_FLIPS) & (self.crease_face < 0), step.face, self.crease_face)
            left = (self.crease_face >= 0) & (step.planes.gap(step.x) > CREASE_RELEASE)
            self.crease_face = np.where(left, -1, self.crease_face).astype(np.int32)
        self.last = step
        return step

    def _descend(self, step: StaticStep, tolerance: float, newton_steps: int) -> StaticStep:
        """Takes Newton steps until the residual is small or stalls; returns the best place, evaluated."""
        soft, h, since, mark = step.soft, FIRST_H, 0, step.potential.residual_share
        least, best, friction_anchors, low = mark, step.x, step.friction_anchors, mark
        while least > tolerance and self.newton_steps < newton_steps and since < MAX_STALLED_STEPS and h > MIN_H:
            start, residual, anchored, touching = (
                step.x,
                step.potential.residual_share,
                step.friction_anchors,
                step.load > 0,
            )
            if self.on_step:
                self.on_step()
            try:
                spent = step.newton()
            except StepRejected:
                spent = 0
            self.newton_steps, self.solver_steps, since = self.newton_steps + 1, self.solver_steps + spent, since + 1
            taken = (
                spent and math.isfinite(step.potential.energy) and 0 < np.abs(step.x - start).max() < MAX_VERTEX_MOVE
            )
            h = min((2.0 if step.stretch else 0.5) * h, MAX_H) if taken else 0.25 * h
            whole, predicted = soft == 1.0 and residual < NEAR_RESIDUAL, step.predicted
            step = self._step(step.x if taken else start, step.friction_anchors, h=h, soft=soft, whole=whole)
            if taken and step.potential.residual_share > MAX_GROWTH * residual:
                if np.array_equal(step.load > 0, touching) and step.potential.residual_share <= MAX_GROWTH * predicted:
                    # into another valley, which is as high at first
                    mark = low = step.potential.residual_share
                    since = 0
                elif h > SHORT_H:
                    h *= 0.125
                    step = self._step(start, anchored, h=h, soft=soft, whole=whole)
            if step.potential.residual_share <= tolerance and step.pressed is not step.load:
                step = self._step(step.x, step.friction_anchors, by_halves=False, h=h, soft=soft, whole=whole)
            if step.potential.residual_share < least:
                least, best, friction_anchors = step.potential.residual_share, step.x, step.friction_anchors
            low = min(low, step.potential.residual_share)
            if low < 0.9 * mark:
                mark, since = low, 0
        if step.x is best and step.pressed is step.load:
            return step
        return self._step(best, friction_anchors, by_halves=False, soft=soft)
