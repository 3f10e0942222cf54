"""Backward Euler for one sheet on plain arrays."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from jaxtyping import Float, Int

from hemline.errors import BadInput, SimulationFailed
from hemline.sim.cloth.sheet import Positions, Sheet
from hemline.sim.cloth.wind import Wind
from hemline.sim.contact.body.planes import SkinPoints
from hemline.sim.contact.body.surface import BodySurface
from hemline.sim.contact.pairs.capsules import Capsules
from hemline.sim.settings import SimSettings

from .model import make_model
from .potential import elastic_potential
from .state import ClothState, Scene, StepRejected, StepReport
from .step import Step
from .workspace import Workspace


class Stepper:
    """Steps one sheet of cloth; usable without a body. A thin front: model, workspace, and where the body was last.

    Attributes:
        model: What never moves.
        workspace: Arrays that each step overwrites.
        known: Where the body was closest to each vertex in the last step; only `step` writes it.

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
        surface: BodySurface | None = None,
        capsules: Capsules | None = None,
        home: Int[np.ndarray, " verts"] | None = None,
        settings: SimSettings | None = None,
        wind: Wind | None = None,
    ):
        self.model = make_model(
            sheet,
            pinned=pinned,
            pin_stiffness=pin_stiffness,
            surface=surface,
            capsules=capsules,
            home=home,
            settings=settings,
            wind=wind,
        )
        self.workspace = Workspace(self.model)
        self.known: SkinPoints | None = None

    def start(self, positions: Positions) -> ClothState:
        """At rest at the given positions.

        Raises:
            BadInput: Another number of positions, or one that is not finite.
        """
        count = self.model.sheet.vertex_count
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
        return self._advance(state, h, scene_at, (0.0, 1.0), self.model.settings.halvings)

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
        step = Step(self.model, self.workspace, state, h, then, now, self.known)
        report = step.solve()
        result = step.result()
        if step.contact is not None:
            # the one thing that steps hand on beside the state: it speeds the next search
            self.known = step.contact.ahead
        return result, report

    def gradient(self, positions: Positions) -> Positions:
        """Gradient of the elastic energy, membrane and bending: minus the elastic force [N]."""
        return elastic_potential(self.model, self.workspace, self.start(positions).positions).workspace.gradient.copy()

    def energy(self, positions: Positions) -> float:
        """Elastic energy, membrane and bending [J]."""
        return elastic_potential(self.model, self.workspace, self.start(positions).positions).energy
