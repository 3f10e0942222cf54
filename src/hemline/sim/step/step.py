"""One step of backward Euler: contact found, its potential made, minimised and judged."""

import math

import numpy as np

from hemline.sim.contact.body.body_contact import Contact
from hemline.sim.contact.body.planes import SkinPoints, no_planes
from hemline.sim.contact.history.contact_history import ContactHistory
from hemline.sim.contact.history.contact_with_history import ContactWithHistory, Wearing
from hemline.sim.contact.pairs.pair_kernels import PairRows
from hemline.sim.step.terms.air import air_term
from hemline.sim.step.terms.inertia import inertia_term
from hemline.sim.step.terms.skin_contact import skin_contact

from .pair_contacts import PairContacts
from .model import ClothModel
from .newton import newton_step
from .potential import Potential
from .state import ClothState, Scene, StepRejected, StepReport
from .vertex_kernels import count_farther
from .workspace import Workspace

MAX_SPEED = 60.0
"""A vertex faster than this is taken for a step that failed [m/s]."""

MAX_ERROR = 0.015
"""So is a mean residual that would move a free vertex farther than this within the step [m]."""


class Step:
    """One step of length h, from its start to its result.

    Args:
        model: The sheet.
        workspace: Arrays to work with.
        state: At the step's start.
        h: Its length [s].
        then: What drives the cloth at the start.
        now: What drives it at the end.
        known: Where the body was closest in an earlier step; it speeds the search and does not change its result.
    """

    def __init__(
        self,
        model: ClothModel,
        workspace: Workspace,
        state: ClothState,
        h: float,
        then: Scene,
        now: Scene,
        known: SkinPoints | None = None,
    ):
        self.model, self.state, self.h = model, state, h
        settings, sheet = model.settings, model.sheet
        guess = state.positions + h * (state.velocities + state.change)
        guess[model.pinned] = now.pinned[model.hard]
        inertia = inertia_term(model, state, h, now.pinned)
        air = air_term(model, workspace, state, h)
        self.contact = self._contact(then, now, guess, known)
        planes = no_planes(sheet.vertex_count) if self.contact is None else self.contact.planes
        self.meeting = PairContacts(model, workspace, self.contact, state.positions, guess, self._off_bones(then, now))
        self.potential = Potential(
            model,
            workspace,
            start=state.positions,
            over_h=1 / h,
            cap=model.cap * (1 / h) ** 2,
            inertia=inertia,
            air=air,
            contact=skin_contact(planes, sheet.friction * state.load, settings, settings.creep * h),
        )
        self.potential.replace_pairs(self.meeting.lay(guess))
        self.potential.evaluate(guess)

    def solve(self) -> StepReport:
        """Newton steps until the residual is small, contact found anew after each."""
        settings, potential = self.model.settings, self.potential
        taken = solver_steps = 0
        while taken < settings.newton_steps:
            _, spent = newton_step(
                potential,
                fresh=taken == 0,
                solver_share=settings.solver_share,
                solver_steps=settings.solver_steps,
            )
            taken, solver_steps = taken + 1, solver_steps + spent
            self._touch()
            if potential.residual_share < settings.residual_share:
                break
        return StepReport(potential.residual_share, taken, solver_steps)

    def result(self) -> ClothState:
        """The state at the end of the step.

        Raises:
            StepRejected: It is not finite, too fast, or too far from equilibrium.
        """
        self._check()
        x, state, planes, settings = self.potential.x, self.state, self.potential.contact.planes, self.model.settings
        penetration = np.clip(settings.thickness - planes.gap(x), 0, settings.contact_depth)
        velocities, history = (x - state.positions) / self.h, state.contact_history
        if isinstance(self.contact, ContactWithHistory):
            history = self.contact.history.faces
        return ClothState(
            positions=x,
            velocities=velocities,
            change=velocities - state.velocities,
            load=planes.stiffness * penetration,
            pinched=state.pinched,
            contact_history=history,
            time=state.time + self.h,
        )

    def _contact(self, then: Scene, now: Scene, guess: np.ndarray, known: SkinPoints | None) -> Contact | None:
        """Contact of the vertices with the body, if there is one."""
        model, state, share = self.model, self.state, self.model.settings.pinched_share
        if model.surface is None or then.skin is None or now.skin is None:
            return None
        moment = model.surface, then.skin, now.skin, state.positions, guess, model.fixed
        stiffness = model.contact_stiffness
        if state.contact_history is None:
            return Contact(*moment, stiffness * np.where(state.pinched, share, 1.0), known)
        wearing = Wearing(ContactHistory.of(state.contact_history, model.surface), model.home, state.pinched, share)
        return ContactWithHistory(*moment, stiffness, known, wearing)

    def _off_bones(self, then: Scene, now: Scene) -> PairRows | None:
        """The pairs of the capsules with worn cloth, if there are any."""
        model = self.model
        if model.capsules is None or self.state.contact_history is None or then.joints is None or now.joints is None:
            return None
        rows = model.capsules.rows(
            self.state.positions,
            model.sheet.faces,
            model.limb_of_face,
            then.joints,
            now.joints,
            model.contact_stiffness,
        )
        return rows if rows.size else None

    def _touch(self) -> None:
        """Look for contact again where the cloth is now; with the body, unless it hardly moved since."""
        contact, potential, meeting = self.contact, self.potential, self.meeting
        pressed = contact is not None and contact.move(potential.x)
        if contact is not None and pressed:
            potential.contact = potential.contact.on(contact.planes)
            if meeting.points is not None:
                meeting.points.move(potential.x)
        if pressed or meeting.itself is not None:
            potential.replace_pairs(meeting.lay(potential.x))
            potential.evaluate_contact()

    def _check(self) -> None:
        x, start, potential = self.potential.x, self.state.positions, self.potential
        if not (math.isfinite(potential.energy) and np.isfinite(x).all()):
            raise StepRejected("positions are not finite")
        if count_farther(x, start, MAX_SPEED * self.h):
            speed = float(np.linalg.norm(x - start, axis=1).max()) / self.h
            raise StepRejected(f"a vertex moves at {speed:.3g} m/s")
        if 9.81 * potential.residual_share * self.h**2 > MAX_ERROR:
            raise StepRejected(f"the residual stays at {potential.residual_share:.3g} weights")
