"""One settling of a garment: from station to station, by Newton's method, damped dynamics where it fails, or a walk."""

from typing import TYPE_CHECKING, Literal

import numpy as np

from hemline.arrays import Mask
from hemline.bodies.lead_in import between
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
from hemline.sim.step.state import ClothState, Scene

from .carry import carry_along, farthest_displacement
from .damped import STILL_SPEED, free_crossings, run_damped
from .rest import Rest
from .sewing import largest_stretch
from .static_step import CreaseFaces
from .statics import Equilibrium, EquilibriumSearch
from .tangles import MAX_CROSSING_RATIO, refuse_tangles
from .walk import accept, walk_into_pose

if TYPE_CHECKING:
    from hemline.bodies import PosedBody, ShapedBody

MAX_NEWTON_STEPS = 400
"""Newton steps of one search, at most."""

MAX_STATION_MOVE = 0.1
"""How far the skin under the cloth may move from one station of a continuation to the next [m]."""

MAX_SHAPE_STATION_MOVE = 0.006
"""So far where the garment follows the change of the body from its own shape [m]."""

STATION_TOLERANCE = 0.3
"""Residual share that is small enough at the stations in between."""

MAX_CROSSING_RATIO_AT_START = 0.005
"""Share of the edges that may go through the cloth where a take starts: a fold pressed into an armpit, which motion
opens again. An equilibrium may have fewer (`tangles.MAX_CLUSTERS`)."""

VELOCITY_RATIO = 0.9
"""Share of the velocity that is kept from frame to frame while settling by dynamics."""

SHAKING_TIME = 0.5
"""Time of damped dynamics between two searches [s]."""

DRAPING_TIME = 1.0
"""Time of dynamics that counts as draping in AgentDress [s]."""

MAX_ATTEMPTS = 5
"""Searches at one station, at most."""

Method = Literal["newton", "draping", "walked"]


class Settling:
    """One call of `settle`."""

    def __init__(
        self,
        garment: Garment,
        shaped: "ShapedBody",
        pose: Pose,
        settings: SimSettings,
        start: Rest | None,
        tolerance: float,
        laid: Garment,
    ):
        self.garment, self.shaped, self.pose, self.settings = garment, shaped, pose, settings
        self.start, self.tolerance, self.laid = start, tolerance, laid
        self.dressed = DressedBody(garment, shaped, settings)
        self.newton_steps = self.solver_steps = 0
        self.method = "newton"

    def run(self, method: Method, *, refuse: bool = True) -> Rest:
        """Settle from station to station; not `refuse`: where no balance is found, where damped dynamics end."""
        self.refuse = refuse
        posed, positions, friction_anchors = self._origin()
        stations = self._stations(posed, positions)
        if method == "draping":
            for station in stations:
                positions, posed = self._carried(positions, posed, station), station
            return self._draped(posed, positions, friction_anchors)
        if self.start is None:
            positions = self._swung(posed, positions, self.settings.settle, VELOCITY_RATIO).positions
        if self.start is None or not stations:
            search, found = self._balanced(posed, positions, friction_anchors, last=not stations)
            positions, friction_anchors = found.positions, found.friction_anchors
        for station in stations:
            positions, posed = self._carried(positions, posed, station), station
            search, found = self._balanced(posed, positions, friction_anchors, last=station is stations[-1])
            positions, friction_anchors = found.positions, found.friction_anchors
        return self._rest(posed, found, search.pinched, self.method)

    def walked(self) -> Rest:
        """The garment after the body went into the pose from the rest drape that is the start, wearing it."""
        assert self.start is not None
        posed = self.shaped.posed(self.pose)
        self.refuse = False
        state = walk_into_pose(self.dressed, self._end(posed), self.start.positions, self.pose)
        search = self._search(state.pinched, self.dressed.scene(posed))
        found = search.run(state.positions, None, tolerance=np.inf, newton_steps=0)
        return accept(self._rest(posed, found, state.pinched, "walked", most=1.0), state)

    def _origin(self) -> tuple["PosedBody", Positions, FrictionAnchors | None]:
        """Where the cloth is known, and how it lies there."""
        if self.start is not None:
            return self.start.shaped.posed(self.start.pose), self.start.positions, self.start.friction_anchors
        shaped = self.shaped
        if not self.laid.is_on(shaped):
            shaped = shaped.body.shaped(self.laid.body_betas)
        return shaped.posed(shaped.rest_pose), self.laid.vertices.astype(np.float64), None

    def _stations(self, origin: "PosedBody", positions: Positions) -> list["PosedBody"]:
        """Bodies from the origin, itself left out, to the goal; none where they are the same."""
        goal = self.shaped.posed(self.pose)
        if self.start is not None or origin.shaped is self.shaped:
            return self._way(origin, goal, positions, MAX_STATION_MOVE)
        # from the garment's own shape: first the shape, finely, then the pose
        rest = self.shaped.posed(self.shaped.rest_pose)
        return self._way(origin, rest, positions, MAX_SHAPE_STATION_MOVE) + self._way(rest, goal, positions, MAX_STATION_MOVE)

    @staticmethod
    def _way(first: "PosedBody", last: "PosedBody", positions: Positions, stride: float) -> list["PosedBody"]:
        """Bodies from the first, left out, to the last, so that the skin near the cloth moves by a stride at most."""
        one, two = first.shaped.betas, last.shaped.betas
        same = np.array_equal(one, two)
        if same and first.pose.hash == last.pose.hash:
            return []
        count = max(1, int(np.ceil(farthest_displacement(first, last, positions) / stride)))
        shapes = [last.shaped if same else last.shaped.body.shaped(one + part * (two - one)) for part in _parts(count)]
        poses = [between(first.pose, last.pose, part) for part in _parts(count)]
        return [*(shape.posed(pose) for shape, pose in zip(shapes, poses, strict=True)), last]

    def _carried(self, positions: Positions, first: "PosedBody", second: "PosedBody") -> Positions:
        sheet = self.dressed.sheet
        spacing = float(sheet.edge_length.mean())
        return carry_along(positions, self.garment.faces, spacing, self.dressed.surface, first, second)

    def _balanced(
        self, posed: "PosedBody", positions: Positions, friction_anchors: FrictionAnchors | None, *, last: bool
    ) -> tuple[EquilibriumSearch, Equilibrium]:
        """Newton's method, then dynamics and again; and again while the pinched vertices change.

        Raises:
            SimulationFailed: The last station is not in equilibrium.
        """
        tolerance = self.tolerance if last else max(self.tolerance, STATION_TOLERANCE)
        scene = self.dressed.scene(posed)
        held = self.start.held if self.start is not None else None
        began = positions
        positions, pinched = self._cleaned(posed, positions)
        attempts, tangled = MAX_ATTEMPTS if self.refuse else 1, False
        for attempt in range(attempts):
            search = self._search(pinched, scene, held)
            found = search.run(positions, friction_anchors, tolerance=tolerance, newton_steps=MAX_NEWTON_STEPS)
            self.newton_steps, self.solver_steps = (
                self.newton_steps + search.newton_steps,
                self.solver_steps + search.solver_steps,
            )
            if found.residual_share <= tolerance:
                positions, after = self._cleaned(posed, found.positions)
                # what was at rest from the start stays as it is
                again = last and attempt + 1 < attempts
                tangled = (
                    again
                    and search.newton_steps > 0
                    and len(free_crossings(self.dressed, positions, after, self.settings)) > 0
                )
                if not again or (not tangled and np.array_equal(after, pinched)):
                    return search, found
                pinched = after
            if attempt + 1 < attempts and (tangled or found.residual_share > tolerance):
                self.method = "newton after dynamics"
                state = self._swung(posed, found.positions, SHAKING_TIME, VELOCITY_RATIO)
                positions, pinched = state.positions, state.pinched
        if last and not self.refuse:
            sheet = self.dressed.sheet
            return self._stilled(posed, min(found.positions, began, key=lambda each: largest_stretch(sheet, each)))
        if last:
            pinched = int(search.pinched.sum())
            where = f", {pinched} vertices are pinched between parts of the body" if pinched else ""
            raise SimulationFailed(
                f"'{self.garment.name}' found no equilibrium: {found.residual_share:.3g} of a vertex's weight is left "
                f"on the mean vertex after {self.newton_steps} Newton steps{where}; allow a larger 'tolerance', start "
                "from a settled state nearer by, or use method 'draping' or 'walked'"
            )
        return search, found

    def _search(self, pinched: Mask, scene: Scene, held: CreaseFaces | None = None) -> EquilibriumSearch:
        return EquilibriumSearch(self.dressed.model, self.dressed.stepper.workspace, pinched, scene, held)

    def _stilled(self, posed: "PosedBody", positions: Positions) -> tuple[EquilibriumSearch, Equilibrium]:
        """Where damped dynamics end, balanced or not."""
        self.method = "dynamics"
        state = self._swung(posed, positions, self.settings.settle, VELOCITY_RATIO, still=0.1 * STILL_SPEED)
        search = self._search(state.pinched, self.dressed.scene(posed))
        return search, search.run(state.positions, None, tolerance=np.inf, newton_steps=0)

    def _cleaned(self, posed: "PosedBody", positions: Positions) -> tuple[Positions, Mask]:
        """Positions moved out of the body, and the vertices for which there is no place."""
        if not inside(posed.vertices, posed.faces, positions.astype(np.float32)).any():
            return positions, np.zeros(len(positions), bool)
        cleaned = self._end(posed).clean(posed, positions, 1.0)
        return cleaned.positions, np.isin(np.arange(len(positions)), cleaned.pinched)

    def _end(self, posed: "PosedBody") -> FrameEnd:
        return FrameEnd(self.laid, posed.shaped)

    def _swung(
        self, posed: "PosedBody", positions: Positions, seconds: float, kept: float, still: float = STILL_SPEED
    ) -> ClothState:
        dressed = (
            self.dressed if posed.shaped is self.shaped else DressedBody(self.garment, posed.shaped, self.settings)
        )
        return run_damped(dressed, self._end(posed), posed, positions, seconds=seconds, kept=kept, still=still)

    def _draped(self, posed: "PosedBody", positions: Positions, friction_anchors: FrictionAnchors | None) -> Rest:
        state = self._swung(posed, positions, DRAPING_TIME, 1.0)
        search = self._search(state.pinched, self.dressed.scene(posed))
        found = search.run(state.positions, friction_anchors, tolerance=np.inf, newton_steps=0)
        return self._rest(posed, found, state.pinched, "draping")

    def _rest(
        self, posed: "PosedBody", found: Equilibrium, pinched: Mask, method: str, *, most: float | None = None
    ) -> Rest:
        sheet = self.dressed.sheet
        assert found.friction_anchors is not None
        positions, stuck = found.positions, pinched
        if not self.refuse:
            # as at the end of each frame of a take; it excuses no tangle
            positions, stuck = self._cleaned(posed, positions)
        vertices = positions.astype(np.float32)
        within = inside(posed.vertices, posed.faces, vertices)
        crossing = 0.0
        if self.settings.self_contact:
            most = most or (MAX_CROSSING_RATIO if self.refuse else MAX_CROSSING_RATIO_AT_START)
            crossing = refuse_tangles(self.garment.name, sheet, vertices, posed, pinched, most=most)
        deepest = self._end(posed).clean(posed, positions, 1.0).deepest_mm if within.any() else 0.0
        return Rest(
            garment=self.garment,
            shaped=self.shaped,
            pose=self.pose,
            settings=self.settings,
            positions=positions,
            forces=found.forces,
            load=found.load,
            face=found.face,
            held=found.held,
            friction_anchors=found.friction_anchors,
            pinched=stuck,
            residual_share=found.residual_share,
            worst_share=float(np.linalg.norm(found.forces, axis=1).max()) / self.dressed.model.mean_weight,
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


def _parts(count: int) -> np.ndarray:
    """Shares of a way cut in so many, its ends left out."""
    return np.arange(1, count) / count
