"""Static equilibrium of one sheet: Newton's method on the forces themselves, without inertia."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Bool, Float, Int

from hemline.sim.cloth.sheet import Positions
from hemline.sim.contact.body.friction_anchors import FrictionAnchors
from hemline.sim.contact.body.planes import SkinPoints
from hemline.sim.step.model import ClothModel
from hemline.sim.step.state import Scene, StepRejected
from hemline.sim.step.workspace import Workspace

from .static_step import CreaseFaces, StaticStep

MAX_VERTEX_MOVE = 0.02
"""A Newton step that moves a vertex farther than this is taken again with more regularisation [m]."""

FIRST, LEAST, MOST = 0.03, 1e-4, 1e3
"""Regularisation m / h^2 as h [s]: of the first Newton step, the strongest, the weakest."""

SOFT_CONTACT = 0.05
"""Share of the contact stiffness with which the search begins far from equilibrium."""

FAR, ENOUGH, NEAR = 1.0, 0.1, 0.02
"""Residual share above which contact is soft at first; at which it hardens; below which the Hessian keeps all
compression, and friction goes by the load itself."""

CREASE_RELEASE = 0.01
"""Distance from the side of a crease beyond which a vertex is no more held to it [m]."""

TURNED, FLIPS = 0.9, 3
"""A vertex is in a crease if its contact turned by more than this cosine so often."""

GROWTH, SHORT = 1.5, 1e-3
"""A Newton step after which the residual is so many times what it was is taken again, unless h was this short [s]; or
unless no contact came or went and the step knew it: where cloth buckles, the energy falls and the residual grows."""

MAX_STALLED_STEPS = 40
"""Newton steps in which the residual must fall by a tenth, since the last valley began."""


@dataclass(frozen=True)
class Equilibrium:
    """Where the search ended.

    Attributes:
        positions: [m]
        forces: What is left on each vertex [N].
        load: Force with which the body presses on each vertex [N].
        face: Triangle of the body that each vertex is held off from, -1 for none.
        held: Triangle that each vertex in a crease keeps to, -1 for the others.
        friction_anchors: Friction anchors from here on; None without a body.
        residual_share: Mean size of the forces over the mean weight of a vertex.
        newton_steps: Newton steps taken.
        solver_steps: Steps of conjugate gradients in all of them.
    """

    positions: Positions
    forces: Positions
    load: Float[np.ndarray, " verts"]
    face: Int[np.ndarray, " verts"]
    held: CreaseFaces
    friction_anchors: FrictionAnchors | None
    residual_share: float
    newton_steps: int = 0
    solver_steps: int = 0


class EquilibriumSearch:
    """Looks for the equilibrium near some positions.

    Newton's method with m / h^2 added to the Hessian: h doubles after each step that the line search takes whole and is
    halved after others, so that far from equilibrium the cloth creeps downhill and near it the steps are Newton's own.
    Contact, load and the direction of friction are found anew before each step. Far away contact is soft: stiff contact
    lets vertices through one by one and cuts every step short; the load stays when it hardens. A vertex in a crease of
    the body is near to both sides of it: one that goes from side to side is held to the side where it is. The energy
    falls with each step, but contact that is found anew may bring back more than was won: then the step is taken again,
    much shorter. Where contact has no part in it, a residual that grows is cloth that leaves an equilibrium in which it
    would not stay. A vertex that touches in one step and not in the next would have friction in every other: the load
    that friction goes by changes by halves, until the balance is near; it must hold with the load itself.

    Args:
        model: The sheet; wind does not act.
        workspace: Arrays to work with.
        pinched: Vertices whose contact yields.
        scene: What drives the cloth.
        held: Triangles that vertices in a crease keep to from the start; None: none.
    """

    def __init__(
        self,
        model: ClothModel,
        workspace: Workspace,
        pinched: Bool[np.ndarray, " verts"],
        scene: Scene,
        held: CreaseFaces | None = None,
    ):
        self.model, self.workspace, self.pinched, self.scene = model, workspace, pinched, scene
        self.newton_steps = self.solver_steps = 0
        self.flips = np.zeros(len(pinched), np.int32)
        self.held = np.full(len(pinched), -1, np.int32) if held is None else held
        self.last: StaticStep | None = None
        self._known: SkinPoints | None = None

    def run(
        self, positions: Positions, friction_anchors: FrictionAnchors | None, *, tolerance: float, newton_steps: int
    ) -> Equilibrium:
        """Search from there.

        Args:
            positions: Where to start [m].
            friction_anchors: Friction anchors.
            tolerance: Mean residual force that is small enough, over the mean weight of a vertex.
            newton_steps: How many to take at most.

        Returns:
            The best that was found; its `residual_share` says whether it is an equilibrium.
        """
        step = self._step(positions, friction_anchors)
        if step.potential.residual_share > FAR:
            step = self._descend(
                self._step(positions, friction_anchors, soft=SOFT_CONTACT), max(tolerance, ENOUGH), newton_steps
            )
            step = self._step(step.x + ((1 - SOFT_CONTACT) * step.depth)[:, None] * step.planes.normal, step.friction_anchors)
        step = self._descend(step, tolerance, newton_steps)
        return Equilibrium(
            positions=step.x,
            forces=step.forces,
            load=step.load,
            face=step.face,
            held=self.held,
            friction_anchors=step.slipped(),
            residual_share=step.potential.residual_share,
            newton_steps=self.newton_steps,
            solver_steps=self.solver_steps,
        )

    def _step(
        self, positions: Positions, friction_anchors: FrictionAnchors | None, *, by_halves: bool = True, **options: Any
    ) -> StaticStep:
        last = self.last
        pressed = last.pressed if by_halves and last is not None and last.potential.residual_share > NEAR else None
        options = {"h": FIRST, "held": self.held, "pressed": pressed, "known": self._known} | options
        step = StaticStep(self.model, self.workspace, positions, self.pinched, self.scene, friction_anchors, **options)
        self._known = None if step.contact is None else step.contact.ahead
        if self.last is not None:
            turned = np.einsum("vi,vi->v", step.planes.normal, self.last.planes.normal) < TURNED
            self.flips += turned & (step.load > 0) & (self.last.load > 0) & (step.face != self.last.face)
            self.held = np.where((self.flips >= FLIPS) & (self.held < 0), step.face, self.held)
            left = (self.held >= 0) & (step.planes.gap(step.x) > CREASE_RELEASE)
            self.held = np.where(left, -1, self.held).astype(np.int32)
        self.last = step
        return step

    def _descend(self, step: StaticStep, tolerance: float, newton_steps: int) -> StaticStep:
        """Newton steps until the residual is small, or falls no more; the best place, evaluated."""
        soft, h, since, mark = step.soft, FIRST, 0, step.potential.residual_share
        least, best, friction_anchors, low = mark, step.x, step.friction_anchors, mark
        while least > tolerance and self.newton_steps < newton_steps and since < MAX_STALLED_STEPS and h > LEAST:
            start, residual, anchored, touching = (
                step.x,
                step.potential.residual_share,
                step.friction_anchors,
                step.load > 0,
            )
            try:
                spent = step.newton()
            except StepRejected:
                spent = 0
            self.newton_steps, self.solver_steps, since = self.newton_steps + 1, self.solver_steps + spent, since + 1
            taken = spent and math.isfinite(step.potential.energy) and 0 < np.abs(step.x - start).max() < MAX_VERTEX_MOVE
            h = min((2.0 if step.stretch else 0.5) * h, MOST) if taken else 0.25 * h
            whole, foreseen = soft == 1.0 and residual < NEAR, step.foreseen
            step = self._step(step.x if taken else start, step.friction_anchors, h=h, soft=soft, whole=whole)
            if taken and step.potential.residual_share > GROWTH * residual:
                if np.array_equal(step.load > 0, touching) and step.potential.residual_share <= GROWTH * foreseen:
                    # into another valley, which is as high at first
                    mark = low = step.potential.residual_share
                    since = 0
                elif h > SHORT:
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
