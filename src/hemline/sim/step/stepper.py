"""Time steps by backward Euler for one sheet of cloth, on plain arrays without garments or bodies."""

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
from .state import ClothState, StepRejected, StepReport, StepScene
from .step import Step
from .workspace import Workspace


class Stepper:
    """Steps one sheet of cloth, with or without a body.

    Attributes:
        model: Constants of the sheet.
        workspace: Arrays that each step overwrites.
        known: Closest skin of each vertex in the last step, which speeds up the next search; only `step` writes it.

    Args:
        sheet: The cloth.
        pinned: Vertices with a given position.
        pin_stiffness: Stiffness of the spring that pulls each pinned vertex to its position [N/m], infinite for a hard
            pin, which is moved there; None if all pins are hard.
        surface: Topology of the body's mesh, or None.
        capsules: Capsules around the bones of the body, or None.
        rest_limb: Limb of the body that each vertex lies on at rest; None for a body with a single limb.
        settings: Gravity, contact, tolerances; `fps` and `substeps` are not used here.
        wind: Wind over time and place; None for that of the settings.

    Raises:
        BadInput: A pin is not a vertex of the sheet, or its stiffness is not positive.

    Example:
        >>> import numpy as np
        >>> from hemline.sim import Elastic, StepScene, Stepper, make_sheet
        >>> corners = np.array([[0.0, 0, 0], [1, 0, 0], [0, 0, 1]])
        >>> stepper = Stepper(make_sheet(np.array([[0, 1, 2]]), np.eye(2)[None], Elastic()))
        >>> state, _ = stepper.advance(stepper.start(corners), 0.1, lambda fraction: StepScene(np.zeros((0, 3))))
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
        rest_limb: Int[np.ndarray, " verts"] | None = None,
        settings: SimSettings | None = None,
        wind: Wind | None = None,
    ):
        self.model = make_model(
            sheet,
            pinned=pinned,
            pin_stiffness=pin_stiffness,
            surface=surface,
            capsules=capsules,
            rest_limb=rest_limb,
            settings=settings,
            wind=wind,
        )
        self.workspace = Workspace(self.model)
        self.known: SkinPoints | None = None

    def start(self, positions: Positions) -> ClothState:
        """Returns the state of cloth at rest at the given positions.

        Raises:
            BadInput: The number of positions is wrong, or one is not finite.
        """
        count = self.model.sheet.vertex_count
        x = np.array(positions, np.float64, order="C")
        if x.shape != (count, 3) or not np.isfinite(x).all():
            raise BadInput(f"positions must be {count} finite points", x.shape, "give one a vertex of the sheet")
        still, no_faces = np.zeros((count, 3)), np.full((count, 2), -1, np.int32)
        return ClothState(x, still, still.copy(), np.zeros(count), np.zeros(count, bool), no_faces)

    def advance(
        self, state: ClothState, h: float, scene_at: Callable[[float], StepScene]
    ) -> tuple[ClothState, StepReport]:
        """Takes one step of length h; a step that fails is repeated as two steps of half the length.

        Args:
            state: State of the cloth.
            h: Length of the step [s].
            scene_at: Returns the scene at a fraction of the step from 0 to 1.

        Raises:
            SimulationFailed: Even the shortest step failed.
        """
        return self._advance(state, h, scene_at, (0.0, 1.0), self.model.settings.halvings)

    def _advance(
        self,
        state: ClothState,
        h: float,
        scene_at: Callable[[float], StepScene],
        span: tuple[float, float],
        halvings: int,
    ) -> tuple[ClothState, StepReport]:
        begin, end = span
        try:
            return self.step(state, h * (end - begin), scene_at(begin), scene_at(end))
        except StepRejected as reason:
            if not halvings:
                raise SimulationFailed(f"{reason} in a step of {1000 * h * (end - begin):.3g} ms") from reason
        middle = 0.5 * (begin + end)
        # the last acceleration is no longer a good prediction
        state = replace(state, change=np.zeros_like(state.change))
        state, _ = self._advance(state, h, scene_at, (begin, middle), halvings - 1)
        return self._advance(state, h, scene_at, (middle, end), halvings - 1)

    def step(self, state: ClothState, h: float, then: StepScene, now: StepScene) -> tuple[ClothState, StepReport]:
        """Takes one step of backward Euler; a step that fails is not repeated.

        Raises:
            StepRejected: The result is not finite, too fast, or too far from equilibrium.
        """
        step = Step(self.model, self.workspace, state, h, then, now, self.known)
        report = step.solve()
        result = step.result()
        if step.contact is not None:
            # the only thing passed from step to step besides the state: it speeds up the next search
            self.known = step.contact.ahead
        return result, report

    def gradient(self, positions: Positions) -> Positions:
        """Returns the gradient of the elastic energy of membrane and bending: minus the elastic force [N]."""
        return elastic_potential(
            self.model, self.workspace, self.start(positions).positions
        ).workspace.evaluation.gradient.copy()

    def energy(self, positions: Positions) -> float:
        """Returns the elastic energy of membrane and bending [J]."""
        return elastic_potential(self.model, self.workspace, self.start(positions).positions).energy
