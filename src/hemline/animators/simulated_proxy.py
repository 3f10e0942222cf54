"""Simulates a proxy, a coarse garment, on one shape of the body in real time."""

import math
import threading
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from hemline.bodies import PosedBody, ShapedBody
from hemline.bodies.lead_in import Stance, interpolate_poses
from hemline.errors import SimulationFailed
from hemline.garments import Garment
from hemline.motions import JOINT_NAMES
from hemline.motions.motion import Pose
from hemline.motions.quaternions import to_matrix
from hemline.sim.cloth.sheet import Positions
from hemline.sim.cloth.wind import Wind, wind_of
from hemline.sim.settings import SimSettings

from .newton_solver import NewtonSolver
from .proxy_solver import FRAME_SECONDS, ProxyCloth, ProxySolver
from .rigid_transform import RigidTransform
from .settle import settle_garment
from .teleport import is_teleport

LONGEST_INTERVAL = 0.5
"""Longest time simulated in one step; the rest is skipped [s]."""
START_FRAMES = 15
"""Frames in which the body moves from its rest pose into the pose that it starts in."""
KEPT_VELOCITY = 0.5
"""Fraction of its velocity that the cloth keeps in a frame in which it is carried."""
DRAPE_RETURN = 0.05
"""Fraction of the distance to the settled drape that the cloth returns in the first carried frame. It doubles in each
further one."""
SLACK = 0.001
"""Cloth is shown at most this far behind where it is simulated [m]: it stays where it is shown while it trembles by
less."""
ORIGIN_SPACING = 64.0
"""The local origin follows a body that is farther than this from it along an axis, in steps of this length [m]."""


@dataclass(frozen=True, eq=False)
class ProxyState:
    """A simulated proxy at the end of a frame; never changed in place."""

    to_world: RigidTransform
    """Transform to the world from local coordinates, those of the place and heading of the body at the start."""
    cloth: ProxyCloth
    """The cloth, in local coordinates."""
    shown: Positions
    """Where the cloth is shown (verts, 3), in local coordinates [m], see `trail_behind`."""
    pose: Pose
    """Pose of the body, in local coordinates."""
    failed_frames: int = 0
    """Number of consecutive frames up to this one in which no step succeeded."""
    origin: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Point of the world that `to_world` counts from [m], see `PosedBody.origin`."""

    @property
    def positions(self) -> Positions:
        """Positions of the simulated cloth in the world (verts, 3) [m]."""
        return self.to_world.points(self.cloth.positions)

    def relocate(self, transform: RigidTransform) -> "ProxyState":
        """Returns the state turned about the vertical and shifted; local coordinates do not change."""
        return replace(self, to_world=transform.after(self.to_world))


def trail_behind(shown: Positions, positions: Positions) -> Positions:
    """Returns where cloth is shown that was shown elsewhere before: not at all moved, or `SLACK` behind.

    Cloth in contact with skin that overlaps itself never comes fully to rest in a simulation. So it is shown as if it
    hung on threads of this length: what trembles by less does not move, and nothing jumps.

    Args:
        shown: Where it was shown (verts, 3) [m].
        positions: Where it is now (verts, 3) [m].
    """
    away = positions - shown
    length = np.linalg.norm(away, axis=1, keepdims=True)
    return shown + away * np.maximum(0.0, 1 - SLACK / np.maximum(length, SLACK))


class SimulatedProxy:
    """Simulates a proxy on one shape of the body. Where no step succeeds, the cloth is carried along with the body.

    Args:
        garment: The proxy on this shape.
        shaped: The body.
        settings: Settings of the simulator.
        rest: The proxy settled in the rest pose (verts, 3) [m]; None settles it here.
        solver: What moves the cloth.

    Raises:
        SimulationFailed: The proxy could not be settled.
    """

    def __init__(
        self,
        garment: Garment,
        shaped: ShapedBody,
        settings: SimSettings,
        rest: Positions | None = None,
        *,
        solver: Callable[[Garment, ShapedBody, SimSettings, Wind | None], ProxySolver] = NewtonSolver,
    ):
        self.garment, self.shaped, self.settings = garment, shaped, settings
        self.rest = settle_garment(garment, shaped, self_contact=settings.self_contact) if rest is None else rest
        self._key = JOINT_NAMES.index(garment.key_joint)
        blows = any(settings.wind) or settings.gusts > 0
        self._wind, self._origin = wind_of(settings), np.zeros(3)
        self._to_world = RigidTransform(np.eye(3), np.zeros(3))
        self._solver = solver(garment, shaped, settings, self._local_wind if blows else None)
        # the solver reuses its arrays, so that only one step may run at a time
        self._lock = threading.Lock()

    def start(self, posed: PosedBody) -> ProxyState:
        """Returns the State at rest on the body in its first pose.

        The proxy hangs settled on the rest pose with the heading of the first pose; then the body moves into that pose.
        """
        first, stance = self.shaped.rest_pose, Stance.of(self.shaped, posed.pose, np.zeros(3))
        turn = to_matrix(stance.turn)
        to_world = RigidTransform(turn, stance.target - turn @ stance.pelvis)
        last = to_world.pose_back(posed.pose)
        state = ProxyState(to_world, self._solver.start(self.rest), self.rest, first, origin=posed.origin)
        if np.abs(self.shaped.posed(first).joints - self.shaped.posed(last).joints).max() < 1e-4:
            return state
        for frame in range(START_FRAMES):
            time = (frame + 1) / START_FRAMES
            state = self._frame(state, interpolate_poses(first, last, time * time * (3 - 2 * time)), FRAME_SECONDS)
        return replace(state, cloth=self._solver.stop(state.cloth))

    def step(self, state: ProxyState, posed: PosedBody, seconds: float) -> ProxyState:
        """Returns the State after a time in which the body moves from the pose of the State to another one.

        Args:
            state: The State before; it is not changed.
            posed: The body at the end.
            seconds: Any time [s]; what exceeds `LONGEST_INTERVAL` is skipped.
        """
        state = replace(self._recenter(state, posed.pose), origin=posed.origin)
        pose = state.to_world.pose_back(posed.pose)
        if is_teleport(state.pose, pose, seconds):
            state = self._teleport(state, pose)
        seconds = min(seconds, LONGEST_INTERVAL)
        frames = max(1, math.ceil(seconds / FRAME_SECONDS - 1e-3))
        first = state.pose
        for frame in range(frames):
            state = self._frame(state, interpolate_poses(first, pose, (frame + 1) / frames), seconds / frames)
        return state

    def _frame(self, state: ProxyState, pose: Pose, seconds: float) -> ProxyState:
        with self._lock:
            self._to_world, self._origin = state.to_world, np.array(state.origin)
            try:
                cloth = self._solver.advance(state.cloth, state.pose, pose, seconds)
            except SimulationFailed:
                return self._carry(state, pose, seconds)
        shown = trail_behind(state.shown, cloth.positions)
        return ProxyState(state.to_world, cloth, shown, pose, origin=state.origin)

    def _carry(self, state: ProxyState, pose: Pose, seconds: float) -> ProxyState:
        """Carries the cloth rigidly with the key joint, and moves it part of the distance to its drape."""
        before, now = self.shaped.posed(state.pose), self.shaped.posed(pose)
        motion = RigidTransform.between(before.transforms[self._key], now.transforms[self._key])
        carried, drape = (
            motion.points(state.cloth.positions),
            RigidTransform.of(now.transforms[self._key]).points(self.rest),
        )
        positions = carried + min(1.0, DRAPE_RETURN * 2.0 ** min(state.failed_frames, 9)) * (drape - carried)
        velocities = KEPT_VELOCITY * motion.vectors(state.cloth.velocities)
        cloth = self._solver.place(state.cloth, positions, velocities, now, seconds)
        return ProxyState(state.to_world, cloth, cloth.positions, pose, state.failed_frames + 1, state.origin)

    def _recenter(self, state: ProxyState, pose: Pose) -> ProxyState:
        """Returns the State with its local origin near a pose of the body in the world; nothing moves there."""
        local = state.to_world.back(pose.translation.astype(np.float64))
        if np.abs(local).max() <= ORIGIN_SPACING:
            return state
        shift = ORIGIN_SPACING * np.round(local / ORIGIN_SPACING)
        return replace(
            state,
            to_world=state.to_world.after(RigidTransform.translation(shift)),
            cloth=self._solver.move(state.cloth, RigidTransform.translation(-shift)),
            shown=state.shown - shift,
            pose=Pose(state.pose.rotations, state.pose.translation.astype(np.float64) - shift),
        )

    def _local_wind(self, seconds: float, positions: Positions) -> Positions:
        """Returns the wind at local positions, in local coordinates [m/s]."""
        return self._wind(seconds, self._to_world.points(positions) + self._origin) @ self._to_world.turn

    def _teleport(self, state: ProxyState, pose: Pose) -> ProxyState:
        """Returns the State turned and moved rigidly with the pelvis to where the body was teleported."""
        rotations = state.pose.rotations.copy()
        rotations[0] = pose.rotations[0]
        target = Pose(rotations, pose.translation)
        before, now = self.shaped.posed(state.pose), self.shaped.posed(target)
        motion = RigidTransform.between(before.transforms[0], now.transforms[0])
        return replace(
            state, cloth=self._solver.move(state.cloth, motion), shown=motion.points(state.shown), pose=target
        )
