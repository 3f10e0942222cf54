"""One settling of a garment: Newton's method from station to station, damped dynamics where it fails, or a walk."""

from collections.abc import Callable
from typing import TYPE_CHECKING, Literal

import numpy as np

from hemline.arrays import Mask
from hemline.bodies.lead_in import interpolate_poses
from hemline.collide import inside
from hemline.errors import SimulationFailed
from hemline.garments.garment import Garment
from hemline.motions.motion import Pose
from hemline.sim.cloth.figures import strain_figures
from hemline.sim.cloth.sheet import Positions
from hemline.sim.contact.body.friction_anchors import FrictionAnchors
from hemline.sim.settings import SimSettings
from hemline.sim.step.dressed_body import DressedBody
from hemline.sim.step.frame_end import FrameEnd
from hemline.sim.step.state import ClothState, StepScene

from .carry import carry_along, farthest_displacement
from .damped import STILL_SPEED, free_crossings, run_damped
from .rest import Rest
from .sewing import largest_stretch
from .static_step import BodyFaces
from .statics import Equilibrium, EquilibriumSearch
from .tangles import MAX_CROSSING_RATIO, refuse_tangles
from .walk import accept, walk_into_pose

if TYPE_CHECKING:
    from hemline.bodies import PosedBody, ShapedBody

MAX_NEWTON_STEPS = 400
"""Maximum number of Newton steps in one search."""

MAX_STATION_MOVE = 0.1
"""Maximum motion of the skin under the cloth from one station of a continuation to the next [m]."""

MAX_SHAPE_STATION_MOVE = 0.006
"""Maximum motion of the skin between stations where the garment follows the body from the garment's own shape [m]."""

STATION_TOLERANCE = 0.3
"""Residual that is small enough at intermediate stations, over the mean weight of a vertex."""

MAX_CROSSING_RATIO_AT_START = 0.005
"""Maximum fraction of edges that may cross the cloth where a take starts, such as a fold pressed into an armpit, which
motion opens again. An equilibrium may have fewer (`tangles.MAX_CROSSING_RATIO`)."""

VELOCITY_RATIO = 0.9
"""Fraction of the velocity that damped dynamics keep from frame to frame."""

SHAKING_TIME = 0.5
"""Time of damped dynamics between two searches [s]."""

DRAPING_TIME = 1.0
"""Time of dynamics that counts as draping in AgentDress [s]."""

MAX_ATTEMPTS = 5
"""Maximum number of searches at one station."""

Method = Literal["newton", "draping", "walked"]


class Settling:
    """One call of `settle`.

    Args:
        garment: The garment.
        shaped: The body.
        pose: The pose to settle in.
        settings: Settings of the simulator, without wind.
        start: A settled state to start from, or None.
        tolerance: Mean residual force that counts as equilibrium, over the mean weight of a vertex.
        start_garment: The garment with the start positions, used if `start` is None.
        refuse: Whether to raise an error if no equilibrium is found. Otherwise the result is where damped dynamics end.
        max_crossing: Largest fraction of edges that may cross the cloth; None for the usual limit.
        on_step: Called before each frame and each Newton step; it may raise.

    Attributes:
        newton_steps: Newton steps so far.
        solver_steps: Steps of conjugate gradients so far.
        method: How the result was found, see `Rest.method`.
    """

    def __init__(
        self,
        garment: Garment,
        shaped: "ShapedBody",
        pose: Pose,
        settings: SimSettings,
        start: Rest | None,
        tolerance: float,
        start_garment: Garment,
        *,
        refuse: bool,
        max_crossing: float | None = None,
        on_step: Callable[[], None] | None = None,
    ):
        self.on_step = on_step
        self.garment, self.shaped, self.pose, self.settings = garment, shaped, pose, settings
        self.start, self.tolerance, self.start_garment, self.refuse = start, tolerance, start_garment, refuse
        self.max_crossing = max_crossing or (MAX_CROSSING_RATIO if refuse else MAX_CROSSING_RATIO_AT_START)
        self.dressed = DressedBody(garment, shaped, settings)
        self.newton_steps = self.solver_steps = 0
        self.method = "newton"

    def run(self, method: Method) -> Rest:
        """Settles the garment from station to station."""
        posed, positions, friction_anchors = self._origin()
        stations = self._stations(posed, positions)
        if method == "draping":
            for station in stations:
                positions, posed = self._carry(positions, posed, station), station
            return self._drape(posed, positions, friction_anchors)
        if self.start is None:
            positions = self._run_damped(posed, positions, self.settings.settle, VELOCITY_RATIO).positions
        if self.start is None or not stations:
            search, result = self._balance(posed, positions, friction_anchors, last=not stations)
            positions, friction_anchors = result.positions, result.friction_anchors
        for station in stations:
            positions, posed = self._carry(positions, posed, station), station
            search, result = self._balance(posed, positions, friction_anchors, last=station is stations[-1])
            positions, friction_anchors = result.positions, result.friction_anchors
        return self._rest(posed, result, search.pinched, self.method)

    def run_walk(self, most_pinched: float) -> Rest:
        """Settles the garment by a walk: the body that wears it moves from the rest drape `start` into the pose.

        Args:
            most_pinched: Maximum fraction of pinched vertices.
        """
        assert self.start is not None
        posed = self.shaped.posed(self.pose)
        state = walk_into_pose(self.dressed, self._frame_end(posed), self.start.positions, self.pose)
        search = self._search(state.pinched, self.dressed.scene(posed))
        result = search.run(state.positions, None, tolerance=np.inf, newton_steps=0)
        return accept(self._rest(posed, result, state.pinched, "walked"), state, most_pinched)

    def _origin(self) -> tuple["PosedBody", Positions, FrictionAnchors | None]:
        """Returns the body on which the cloth is known, its positions there, and its friction anchors."""
        if self.start is not None:
            return self.start.shaped.posed(self.start.pose), self.start.positions, self.start.friction_anchors
        shaped = self.shaped
        if not self.start_garment.is_on(shaped):
            shaped = shaped.body.shaped(self.start_garment.body_betas)
        return shaped.posed(shaped.rest_pose), self.start_garment.vertices.astype(np.float64), None

    def _stations(self, origin: "PosedBody", positions: Positions) -> list["PosedBody"]:
        """Returns the bodies from the origin, which is left out, to the goal; none if they are the same."""
        goal = self.shaped.posed(self.pose)
        if self.start is not None or origin.shaped is self.shaped:
            return self._bodies_between(origin, goal, positions, MAX_STATION_MOVE)
        # from the garment's own shape: first the shape, finely, then the pose
        rest = self.shaped.posed(self.shaped.rest_pose)
        return [
            *self._bodies_between(origin, rest, positions, MAX_SHAPE_STATION_MOVE),
            *self._bodies_between(rest, goal, positions, MAX_STATION_MOVE),
        ]

    @staticmethod
    def _bodies_between(
        first: "PosedBody", last: "PosedBody", positions: Positions, max_move: float
    ) -> list["PosedBody"]:
        """Returns bodies from the first, left out, to the last; near the cloth the skin moves by `max_move` at most."""
        one, two = first.shaped.betas, last.shaped.betas
        same = np.array_equal(one, two)
        if same and first.pose.hash == last.pose.hash:
            return []
        count = max(1, int(np.ceil(farthest_displacement(first, last, positions) / max_move)))
        inner = np.arange(1, count) / count
        shapes = [last.shaped if same else last.shaped.body.shaped(one + part * (two - one)) for part in inner]
        poses = [interpolate_poses(first.pose, last.pose, part) for part in inner]
        return [*(shape.posed(pose) for shape, pose in zip(shapes, poses, strict=True)), last]

    def _carry(self, positions: Positions, first: "PosedBody", second: "PosedBody") -> Positions:
        """Moves the cloth along with the skin from one body to the next."""
        sheet = self.dressed.sheet
        spacing = float(sheet.edge_length.mean())
        return carry_along(positions, self.garment.faces, spacing, self.dressed.surface, first, second)

    def _balance(
        self, posed: "PosedBody", positions: Positions, friction_anchors: FrictionAnchors | None, *, last: bool
    ) -> tuple[EquilibriumSearch, Equilibrium]:
        """Searches for the equilibrium at one station.

        Newton's method is tried first, then damped dynamics and Newton's method again. It also goes on while the
        pinched vertices change.

        Raises:
            SimulationFailed: The last station is not in equilibrium.
        """
        tolerance = self.tolerance if last else max(self.tolerance, STATION_TOLERANCE)
        scene = self.dressed.scene(posed)
        crease_face = self.start.crease_face if self.start is not None else None
        first_positions = positions
        positions, pinched = self._push_out(posed, positions)
        attempts, tangled = MAX_ATTEMPTS if self.refuse else 1, False
        for attempt in range(attempts):
            search = self._search(pinched, scene, crease_face)
            result = search.run(positions, friction_anchors, tolerance=tolerance, newton_steps=MAX_NEWTON_STEPS)
            self.newton_steps += search.newton_steps
            self.solver_steps += search.solver_steps
            if result.residual_share <= tolerance:
                positions, after = self._push_out(posed, result.positions)
                # what was at rest from the start stays as it is
                again = last and attempt + 1 < attempts
                tangled = (
                    again
                    and search.newton_steps > 0
                    and len(free_crossings(self.dressed, positions, after, self.settings)) > 0
                )
                if not again or (not tangled and np.array_equal(after, pinched)):
                    return search, result
                pinched = after
            if attempt + 1 < attempts and (tangled or result.residual_share > tolerance):
                self.method = "newton after dynamics"
                state = self._run_damped(posed, result.positions, SHAKING_TIME, VELOCITY_RATIO)
                positions, pinched = state.positions, state.pinched
        if last and not self.refuse:
            sheet = self.dressed.sheet
            less_stretched = min(result.positions, first_positions, key=lambda each: largest_stretch(sheet, each))
            return self._settle_by_dynamics(posed, less_stretched)
        if last:
            count = int(search.pinched.sum())
            where = f", {count} vertices are pinched between parts of the body" if count else ""
            raise SimulationFailed(
                f"'{self.garment.name}' found no equilibrium: {result.residual_share:.3g} of a vertex's weight is left "
                f"on the mean vertex after {self.newton_steps} Newton steps{where}; allow a larger 'tolerance', start "
                "from a settled state nearer by, or use method 'draping' or 'walked'"
            )
        return search, result

    def _search(self, pinched: Mask, scene: StepScene, crease_face: BodyFaces | None = None) -> EquilibriumSearch:
        return EquilibriumSearch(
            self.dressed.model, self.dressed.stepper.workspace, pinched, scene, crease_face, self.on_step
        )

    def _settle_by_dynamics(self, posed: "PosedBody", positions: Positions) -> tuple[EquilibriumSearch, Equilibrium]:
        """Returns where damped dynamics end, balanced or not."""
        self.method = "dynamics"
        state = self._run_damped(posed, positions, self.settings.settle, VELOCITY_RATIO, still=0.1 * STILL_SPEED)
        search = self._search(state.pinched, self.dressed.scene(posed))
        return search, search.run(state.positions, None, tolerance=np.inf, newton_steps=0)

    def _push_out(self, posed: "PosedBody", positions: Positions) -> tuple[Positions, Mask]:
        """Moves vertices out of the body; returns the positions, and which vertices have no free place."""
        if not inside(posed.vertices, posed.faces, positions.astype(np.float32)).any():
            return positions, np.zeros(len(positions), bool)
        cleaned = self._frame_end(posed).clean(posed, positions, 1.0)
        return cleaned.positions, np.isin(np.arange(len(positions)), cleaned.pinched)

    def _frame_end(self, posed: "PosedBody") -> FrameEnd:
        return FrameEnd(self.start_garment, posed.shaped)

    def _run_damped(
        self,
        posed: "PosedBody",
        positions: Positions,
        seconds: float,
        velocity_ratio: float,
        still: float = STILL_SPEED,
    ) -> ClothState:
        """Runs damped dynamics on a body that stands still."""
        dressed = (
            self.dressed if posed.shaped is self.shaped else DressedBody(self.garment, posed.shaped, self.settings)
        )
        end = self._frame_end(posed)
        how = {"seconds": seconds, "velocity_ratio": velocity_ratio, "still": still, "on_step": self.on_step}
        return run_damped(dressed, end, posed, positions, **how)

    def _drape(self, posed: "PosedBody", positions: Positions, friction_anchors: FrictionAnchors | None) -> Rest:
        """Returns the garment after a fixed time of undamped dynamics."""
        state = self._run_damped(posed, positions, DRAPING_TIME, 1.0)
        search = self._search(state.pinched, self.dressed.scene(posed))
        result = search.run(state.positions, friction_anchors, tolerance=np.inf, newton_steps=0)
        return self._rest(posed, result, state.pinched, "draping")

    def _rest(
        self,
        posed: "PosedBody",
        result: Equilibrium,
        pinched: Mask,
        method: str,
    ) -> Rest:
        """Returns the settled garment with its figures.

        Raises:
            SimulationFailed: The garment crosses itself.
        """
        sheet = self.dressed.sheet
        assert result.friction_anchors is not None
        positions, stuck = result.positions, pinched
        if not self.refuse:
            # as at the end of each frame of a take; it excuses no tangle
            positions, stuck = self._push_out(posed, positions)
        vertices = positions.astype(np.float32)
        within = inside(posed.vertices, posed.faces, vertices)
        crossing = 0.0
        if self.settings.self_contact:
            crossing = refuse_tangles(self.garment.name, sheet, vertices, posed, pinched, limit=self.max_crossing)
        deepest = self._frame_end(posed).clean(posed, positions, 1.0).deepest_mm if within.any() else 0.0
        return Rest(
            garment=self.garment,
            shaped=self.shaped,
            pose=self.pose,
            settings=self.settings,
            positions=positions,
            forces=result.forces,
            load=result.load,
            face=result.face,
            crease_face=result.crease_face,
            friction_anchors=result.friction_anchors,
            pinched=stuck,
            residual_share=result.residual_share,
            worst_share=float(np.linalg.norm(result.forces, axis=1).max()) / self.dressed.model.mean_weight,
            method=method,
            newton_steps=self.newton_steps,
            solver_steps=self.solver_steps,
            figures=strain_figures(sheet, vertices[None], self.dressed.pinned)
            | {
                "inside": float((within & ~stuck).sum()),
                "deepest_mm": deepest,
                "pinched": float(stuck.sum()),
                "self_crossing_percent": 100 * crossing,
            },
        )
