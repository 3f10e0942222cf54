"""Backward Euler for one sheet on plain arrays."""

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from jaxtyping import Float, Int

from hemline.errors import BadInput, SimulationFailed
from hemline.sim.cloth.sheet import Positions, Sheet, incidence
from hemline.sim.cloth.wind import Wind, checked, wind_of
from hemline.sim.contact.body_points import BodyPoints
from hemline.sim.contact.capsules import Capsules
from hemline.sim.contact.self_contact import SelfContact
from hemline.sim.contact.surface import Anchors, Surface
from hemline.sim.settings import SimSettings
from hemline.sim.solver.layout import make_layout

from .state import ClothState, Scene, StepRejected, StepReport
from .step import Memory, Step

KEPT_COMPRESSION = 0.9
"""Share of the compression that inertia makes harmless which stays in the Hessian."""


class Stepper:
    """Steps one sheet of cloth; usable without a body.

    Args:
        sheet: The cloth.
        pinned: Vertices whose positions are given.
        pin_stiffness: For each of them the stiffness of the spring that holds it there [N/m], infinite for a vertex
            that is put there; None: all are.
        surface: The body's mesh, or None.
        capsules: Around the bones of its limbs, or None.
        home: The body's limb that each vertex lies on at rest; None: the body has but one.
        settings: Gravity, contact, tolerances; `fps` and `substeps` are not used here.
        wind: Wind over time and place; None: that of the settings.

    Raises:
        BadInput: A pin is not a vertex of the sheet, or its stiffness is not positive.

    Example:
        >>> from hemline.sim.cloth.sheet import Elastic, make_sheet
        >>> corners = np.array([[0.0, 0, 0], [1, 0, 0], [0, 0, 1]])
        >>> stepper = Stepper(make_sheet(np.array([[0, 1, 2]]), np.eye(2)[None], Elastic()))
        >>> state, _ = stepper.advance(stepper.start(corners), 0.1, lambda share: Scene(np.zeros((0, 3))))
        >>> state.velocities[:, 1].round(3)
        array([-0.981, -0.981, -0.981])
    """

    def __init__(
        self,
        sheet: Sheet,
        *,
        pinned: Int[np.ndarray, " pins"] = (),  # type: ignore[assignment]
        pin_stiffness: Float[np.ndarray, " pins"] | None = None,
        surface: Surface | None = None,
        capsules: Capsules | None = None,
        home: Int[np.ndarray, " verts"] | None = None,
        settings: SimSettings | None = None,
        wind: Wind | None = None,
    ):
        self.home = np.zeros(sheet.vertex_count, np.int64) if home is None else home
        self.sheet, self.surface, self.capsules = sheet, surface, capsules
        self.settings = settings or SimSettings()
        self.wind = wind_of(self.settings) if wind is None else checked(wind)
        pins = np.asarray(pinned, np.int32)
        if pins.size and not (pins.min() >= 0 and pins.max() < sheet.vertex_count):
            got = f"{pins.min()} to {pins.max()} for {sheet.vertex_count} vertices"
            raise BadInput("pins must be vertices of the sheet", got, "count from 0")
        stiffness = np.full(len(pins), np.inf) if pin_stiffness is None else np.asarray(pin_stiffness, np.float64)
        if stiffness.shape != pins.shape or not (stiffness > 0).all():
            got = f"shape {stiffness.shape}" if stiffness.shape != pins.shape else stiffness.min()
            raise BadInput(f"{len(pins)} pins must have positive stiffnesses", got, "use infinity for a hard pin")
        self.hard = np.isinf(stiffness)
        self.pinned, self.held, self.spring = pins[self.hard], pins[~self.hard], stiffness[~self.hard]
        self.fixed = np.zeros(sheet.vertex_count, bool)
        self.fixed[self.pinned] = True
        home = self.home[sheet.faces]
        loose = (home == home[:, :1]).all(axis=1) & ~self.fixed[sheet.faces].any(axis=1)
        self.limb_of_face = np.where(loose, home[:, 0], -1)
        self.push = self.settings.contact_stiffness * sheet.vertex_area
        self.mean_weight = 9.81 * float(sheet.mass.mean())
        gram = np.einsum("fac,fad->fcd", sheet.shape, sheet.shape)
        self.cap = KEPT_COMPRESSION * sheet.density * sheet.area / 3 / np.linalg.eigvalsh(gram)[:, 1]
        flat = not len(sheet.hinge_rest)
        # where the rest shape is not flat, hinges bring the forces; their Hessian stays that of a flat sheet
        self.bending = (
            (sheet.ring_bending, sheet.far_bending)
            if flat
            else tuple(np.zeros_like(each) for each in (sheet.ring_bending, sheet.far_bending))
        )
        self.hinge_rest = 2 * np.sin(0.5 * sheet.hinge_rest)
        self.hinge_corners = incidence(sheet.hinges.ravel(), np.arange(sheet.hinges.size), sheet.vertex_count)
        self.layout = make_layout(sheet, self.fixed)
        self.memory = Memory(sheet, self.layout)
        self.last_anchors: Anchors | None = None
        self.body_points = BodyPoints(
            sheet, fixed=self.fixed, thickness=self.settings.thickness, friction=sheet.friction
        )
        self.self_contact = (
            None
            if not self.settings.self_contact
            else SelfContact(
                sheet,
                thickness=self.settings.self_thickness,
                stiffness=self.settings.self_stiffness,
                friction=sheet.friction,
            )
        )

    def start(self, positions: Positions) -> ClothState:
        """At rest at the given positions.

        Raises:
            BadInput: Another number of positions, or one that is not finite.
        """
        count = self.sheet.vertex_count
        x = np.array(positions, np.float64, order="C")
        if x.shape != (count, 3) or not np.isfinite(x).all():
            raise BadInput(f"positions must be {count} finite points", x.shape, "give one a vertex of the sheet")
        still, nowhere = np.zeros((count, 3)), np.full((count, 2), -1, np.int32)
        return ClothState(x, still, still.copy(), np.zeros(count), np.zeros(count, bool), nowhere)

    def advance(self, state: ClothState, h: float, scene_at: Callable[[float], Scene]) -> tuple[ClothState, StepReport]:
        """One step of length h; a step that fails is halved and tried again.

        Args:
            state: Where the cloth is.
            h: Length of the step [s].
            scene_at: The scene at a share of the step from 0 to 1.

        Raises:
            SimulationFailed: The shortest step failed too.
        """
        return self._advance(state, h, scene_at, (0.0, 1.0), self.settings.halvings)

    def _advance(
        self, state: ClothState, h: float, scene_at: Callable[[float], Scene], span: tuple[float, float], halvings: int
    ) -> tuple[ClothState, StepReport]:
        begin, end = span
        try:
            return self.step(state, h * (end - begin), scene_at(begin), scene_at(end))
        except StepRejected as reason:
            if not halvings:
                raise SimulationFailed(f"{reason} in a step of {1000 * h * (end - begin):.3g} ms") from reason
        middle = 0.5 * (begin + end)
        # the last acceleration is no guide any more
        state = replace(state, change=np.zeros_like(state.change))
        state, _ = self._advance(state, h, scene_at, (begin, middle), halvings - 1)
        return self._advance(state, h, scene_at, (middle, end), halvings - 1)

    def step(self, state: ClothState, h: float, then: Scene, now: Scene) -> tuple[ClothState, StepReport]:
        """One step of backward Euler, without another try.

        Raises:
            StepRejected: The result is not finite, too fast, or too far from equilibrium.
        """
        step = Step(self, state, h, then, now)
        taken = solver_steps = 0
        for _ in range(self.settings.newton_steps):
            solver_steps += step.newton()
            taken += 1
            step.touch()
            if step.residual_share < self.settings.residual_share:
                break
        step.check()
        return step.result(), StepReport(step.residual_share, taken, solver_steps)

    def gradient(self, positions: Positions) -> Positions:
        """Gradient of the elastic energy, membrane and bending: minus the elastic force [N]."""
        Step(self, self.start(positions), math.inf, _NOTHING, _NOTHING)
        return self.memory.gradient.copy()

    def energy(self, positions: Positions) -> float:
        """Elastic energy, membrane and bending [J]."""
        return Step(self, self.start(positions), math.inf, _NOTHING, _NOTHING).energy


_NOTHING = Scene(np.zeros((0, 3)))
