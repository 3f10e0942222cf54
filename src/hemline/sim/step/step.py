"""One step of backward Euler: finds contact, minimises the potential, and checks the result."""

import math

import numpy as np

from hemline.sim.contact.body.body_contact import ClosestContact, Contact
from hemline.sim.contact.body.planes import SkinPoints, no_planes
from hemline.sim.contact.history.contact_history import ContactHistory
from hemline.sim.contact.history.contact_with_history import ContactWithHistory
from hemline.sim.contact.pairs.pair_kernels import PairRows
from hemline.sim.step.terms.air import air_term
from hemline.sim.step.terms.inertia import inertia_term
from hemline.sim.step.terms.registry import make_terms
from hemline.sim.step.terms.skin_contact import skin_contact
from hemline.sim.step.terms.term import TermInputs

from .model import ClothModel
from .newton import newton_step
from .pair_contacts import PairContacts
from .potential import Potential
from .state import ClothState, StepRejected, StepReport, StepScene
from .vertex_kernels import count_farther
from .workspace import Workspace

MAX_SPEED = 60.0
"""A step in which a vertex is faster than this has failed [m/s]."""

MAX_ERROR = 0.015
"""A step whose mean residual would move a free vertex farther than this within the step has failed [m]."""


class Step:
    """One step of length h, from its start to its result.

    Args:
        model: The sheet.
        workspace: Arrays that every evaluation overwrites.
        state: State at the start of the step.
        h: Length of the step [s].
        then: Scene at the start of the step.
        now: Scene at the end of the step.
        known: Closest skin of an earlier step; it speeds up the search and does not change its result.

    Attributes:
        contact: Contact of the vertices with the body, or None.
        pair_contacts: Contact in pairs.
        potential: The potential of the step.
    """

    def __init__(
        self,
        model: ClothModel,
        workspace: Workspace,
        state: ClothState,
        h: float,
        then: StepScene,
        now: StepScene,
        known: SkinPoints | None = None,
    ):
        self.model, self.state, self.h = model, state, h
        settings, sheet = model.settings, model.sheet
        guess = state.positions + h * (state.velocities + state.change)
        guess[model.pinned] = now.pinned[model.hard]
        inertia = inertia_term(model, state, h, now.pinned)
        air = air_term(model, workspace, state, h)
        self.contact = self._find_contact(then, now, guess, known)
        planes = no_planes(sheet.vertex_count) if self.contact is None else self.contact.planes
        capsule_pairs = self._find_capsule_pairs(then, now)
        self.pair_contacts = PairContacts(model, workspace, self.contact, state.positions, guess, capsule_pairs)
        self.potential = Potential(
            model,
            workspace,
            start=state.positions,
            over_h=1 / h,
            cap=model.cap * (1 / h) ** 2,
            inertia=inertia,
            air=air,
            contact=skin_contact(planes, sheet.friction * state.load, settings, settings.creep * h),
            terms=make_terms(TermInputs(model, state.positions, now, h)),
        )
        self.potential.replace_pairs(self.pair_contacts.at(guess))
        self.potential.evaluate(guess)

    def solve(self) -> StepReport:
        """Takes Newton steps until the residual is small, and updates contact after each of them."""
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
            self._update_contact()
            if potential.residual_share < settings.residual_share:
                break
        return StepReport(potential.residual_share, taken, solver_steps)

    def result(self) -> ClothState:
        """Returns the state at the end of the step.

        Raises:
            StepRejected: The state is not finite, too fast, or too far from equilibrium.
        """
        self._check()
        x, state, planes, settings = self.potential.x, self.state, self.potential.contact.planes, self.model.settings
        penetration = np.clip(settings.thickness - planes.gap(x), 0, settings.contact_depth)
        velocities, history = (x - state.positions) / self.h, state.contact_history
        if self.contact is not None:
            history = self.contact.history_faces(history)
        return ClothState(
            positions=x,
            velocities=velocities,
            change=velocities - state.velocities,
            load=planes.stiffness * penetration,
            pinched=state.pinched,
            contact_history=history,
            time=state.time + self.h,
        )

    def _find_contact(
        self, then: StepScene, now: StepScene, guess: np.ndarray, known: SkinPoints | None
    ) -> Contact | None:
        """Returns the contact of the vertices with the body, or None without a body."""
        model, state, yielding = self.model, self.state, self.model.settings.pinched_share
        if model.surface is None or then.skin is None or now.skin is None:
            return None
        moment = model.surface, then.skin, now.skin, state.positions, guess, model.fixed
        stiffness = model.contact_stiffness
        if state.contact_history is None:
            return ClosestContact(*moment, stiffness * np.where(state.pinched, yielding, 1.0), known)
        return ContactWithHistory(
            *moment,
            stiffness,
            known,
            history=ContactHistory.from_faces(state.contact_history, model.surface),
            rest_limb=model.rest_limb,
            pinched=state.pinched,
            yielding=yielding,
        )

    def _find_capsule_pairs(self, then: StepScene, now: StepScene) -> PairRows | None:
        """Returns the pairs of capsules and cloth, or None if there are none."""
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

    def _update_contact(self) -> None:
        """Updates contact to the positions of the cloth; contact with the body only if a vertex moved far enough."""
        contact, potential, pair_contacts = self.contact, self.potential, self.pair_contacts
        moved = contact is not None and contact.move(potential.x)
        if contact is not None and moved:
            potential.contact = potential.contact.on(contact.planes)
            if pair_contacts.points is not None:
                pair_contacts.points.move(potential.x)
        if moved or pair_contacts.self_contact is not None:
            potential.replace_pairs(pair_contacts.at(potential.x))
            potential.evaluate_contact()

    def _check(self) -> None:
        """Checks the end of the step.

        Raises:
            StepRejected: See `result`.
        """
        x, start, potential = self.potential.x, self.state.positions, self.potential
        if not (math.isfinite(potential.energy) and np.isfinite(x).all()):
            raise StepRejected("positions are not finite")
        if count_farther(x, start, MAX_SPEED * self.h):
            speed = float(np.linalg.norm(x - start, axis=1).max()) / self.h
            raise StepRejected(f"a vertex moves at {speed:.3g} m/s")
        if 9.81 * potential.residual_share * self.h**2 > MAX_ERROR:
            raise StepRejected(f"the residual stays at {potential.residual_share:.3g} weights")
