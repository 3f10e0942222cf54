"""A coarse garment simulated on one shape of the body: settled, stepped, carried where no step can be taken."""

import math
import threading
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from hemline.bodies import PosedBody, ShapedBody
from hemline.bodies.lead_in import Stance, between
from hemline.collide import ProjectorState
from hemline.errors import SimulationFailed
from hemline.garments import Garment
from hemline.motions import JOINT_NAMES
from hemline.motions.motion import Pose
from hemline.motions.quaternions import to_matrix
from hemline.sim.cloth.sheet import Positions
from hemline.sim.cloth.wind import wind_of
from hemline.sim.settings import SimSettings
from hemline.sim.step.dressed_body import DressedBody
from hemline.sim.step.frame_end import FrameEnd
from hemline.sim.step.state import ClothState

from .teleport import RigidTransform, is_teleport
from .settle import settle_garment

FRAME_SECONDS = 1 / 30
"""A longer time is cut into frames of this length at most [s]."""
LONGEST_INTERVAL = 0.5
"""Of a longer time so much is simulated [s]."""
START_FRAMES = 15
"""Frames in which a body comes from its rest pose into another one that it starts in."""
KEPT_VELOCITY = 0.5
"""Share of its velocity that cloth keeps when it is carried."""
DRAPE_RETURN = 0.05
"""Share of the way to the settled drape that it goes then; twice that in each further frame."""
ORIGIN_SPACING = 64.0
"""A body that gets farther from home along an axis finds a new home, in steps of this length [m]."""

STEP_HALVINGS = 3
"""How often a step that fails is halved, before the cloth is carried along instead."""


class QualityLevel(NamedTuple):
    """What a quality means."""

    substeps: int
    """Steps of backward Euler in a frame of 1/30 s."""
    newton_steps: int
    """Newton steps in each, at most."""
    residual_share: float
    """Fewer, where the mean residual force is below this share of a vertex's mean weight."""
    frame_ms: float
    """What a frame costs however few vertices there are [ms]."""
    vertex_us: float
    """What each vertex adds [us]."""

    def settings(self, **others: Any) -> SimSettings:
        """Those of the simulator; `others` go to it as they are."""
        return SimSettings(
            substeps=self.substeps,
            newton_steps=self.newton_steps,
            residual_share=self.residual_share,
            halvings=STEP_HALVINGS,
            **others,
        )


QUALITY_LEVELS = {
    "fine": QualityLevel(4, 6, 0.25, 12.0, 24.0),
    "good": QualityLevel(2, 6, 0.6, 6.0, 11.0),
    "fast": QualityLevel(2, 4, 0.9, 5.0, 9.0),
}
"""From the best on. Costs are estimates from the light skirt at 1,000 vertices (README), without self-contact."""


@dataclass(frozen=True, eq=False)
class ProxyState:
    """At the end of a frame; never changed in place."""

    to_world: RigidTransform
    """From where the body stood and headed at the start, in which all else is seen, to the world."""
    cloth: ClothState
    """The coarse cloth."""
    projector: ProjectorState
    """What the projection of the coarse cloth remembers."""
    pose: Pose
    """The body's."""
    failed_frames: int = 0
    """Frames up to this one in which no step could be taken, one after the other."""
    origin: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Place in the world that `home` counts from [m], see `PosedBody.origin`."""

    @property
    def positions(self) -> Positions:
        """Of the coarse cloth, in the world [m]."""
        return self.to_world.points(self.cloth.positions)

    def relocate(self, way: RigidTransform) -> "ProxyState":
        """The same state turned about the vertical and shifted as a whole: home goes along, all else stays in it."""
        return replace(self, home=way.after(self.to_world))

    def recenter(self, pose: Pose) -> "ProxyState":
        """The same state with its home within reach of a pose of the body, where that has gone far: nothing moves.

        Args:
            pose: The body's, not seen from home.
        """
        there = self.to_world.back(pose.translation.astype(np.float64))
        if np.abs(there).max() <= ORIGIN_SPACING:
            return self
        away = ORIGIN_SPACING * np.round(there / ORIGIN_SPACING)
        body = self.pose.translation.astype(np.float64) - away
        return replace(
            self,
            home=self.to_world.after(RigidTransform.shifted(away)),
            cloth=replace(self.cloth, positions=self.cloth.positions - away),
            pose=Pose(self.pose.rotations, body),
        )


class SimulatedProxy:
    """One garment on one body shape.

    Args:
        garment: The coarse garment, on this shape.
        shaped: The body.
        settings: Of the simulator.
        rest: The garment settled in the rest pose [m]; None: settled here.

    Raises:
        SimulationFailed: The garment could not be settled.
    """

    def __init__(self, garment: Garment, shaped: ShapedBody, settings: SimSettings, rest: Positions | None = None):
        self.garment, self.shaped, self.settings = garment, shaped, settings
        self.rest = settle_garment(garment, shaped, self_contact=settings.self_contact) if rest is None else rest
        self._key = JOINT_NAMES.index(garment.key_joint)
        blows = any(settings.wind) or settings.gusts > 0
        self._wind, self._home, self._origin = wind_of(settings), RigidTransform(np.eye(3), np.zeros(3)), np.zeros(3)
        self._dressed = DressedBody(garment, shaped, settings, self._local_wind if blows else None)
        self._end = FrameEnd(garment, shaped)
        self._fresh = self._end.state
        # the solver works in arrays of its own: one step after the other
        self._turn = threading.Lock()

    def start(self, posed: PosedBody) -> ProxyState:
        """At rest on the body in its first pose.

        The garment hangs settled on the rest pose, headed as the first one; from there the body moves into it.
        """
        first, stance = self.shaped.rest_pose, Stance.of(self.shaped, posed.pose, np.zeros(3))
        turn = to_matrix(stance.turn)
        home = RigidTransform(turn, stance.target - turn @ stance.pelvis)
        state, last = (
            ProxyState(home, self._dressed.stepper.start(self.rest), self._fresh, first, origin=posed.origin),
            home.pose_back(posed.pose),
        )
        if np.abs(self.shaped.posed(first).joints - self.shaped.posed(last).joints).max() < 1e-4:
            return state
        for frame in range(START_FRAMES):
            share = (frame + 1) / START_FRAMES
            state = self._frame(state, between(first, last, share * share * (3 - 2 * share)), FRAME_SECONDS)
        still = np.zeros_like(self.rest)
        return replace(state, cloth=replace(state.cloth, velocities=still, change=still))

    def step(self, state: ProxyState, posed: PosedBody, seconds: float) -> ProxyState:
        """The State after a time, the body on its way from the State's pose to another one.

        Args:
            state: It is not changed.
            posed: The body then.
            seconds: Any time; of more than `LONGEST_STEP` the rest is left out.
        """
        state = replace(state.recenter(posed.pose), origin=posed.origin)
        pose = state.to_world.pose_back(posed.pose)
        if is_teleport(state.pose, pose, seconds):
            state = self._teleport(state, pose)
        seconds = min(seconds, LONGEST_INTERVAL)
        frames = max(1, math.ceil(seconds / FRAME_SECONDS - 1e-3))
        first = state.pose
        for frame in range(frames):
            state = self._frame(state, between(first, pose, (frame + 1) / frames), seconds / frames)
        return state

    def _frame(self, state: ProxyState, pose: Pose, seconds: float) -> ProxyState:
        with self._turn:
            self._home, self._origin = state.to_world, np.array(state.origin)
            try:
                return self._simulate(state, pose, seconds)
            except SimulationFailed:
                return self._carry(state, pose, seconds)

    def _simulate(self, state: ProxyState, pose: Pose, seconds: float) -> ProxyState:
        """A frame of the simulator, see `sim/takes/simulate.py`."""
        substeps = max(1, math.ceil(self.settings.substeps * seconds / FRAME_SECONDS - 1e-3))
        cloth, _, posed = self._dressed.frame(state.cloth, state.pose, pose, substeps=substeps, seconds=seconds)
        self._end.state = state.projector
        cleaned = self._end.clean(posed, cloth.positions, seconds, cloth.contact_history)
        cloth = self._dressed.fed_back(cloth, cleaned.positions, cleaned.pinched)
        return ProxyState(state.to_world, cloth, self._end.state, pose, origin=state.origin)

    def _carry(self, state: ProxyState, pose: Pose, seconds: float) -> ProxyState:
        """The frame in which no step could be taken: the cloth rides on the key joint, and towards its drape."""
        then, now = self.shaped.posed(state.pose), self.shaped.posed(pose)
        way = RigidTransform.between(then.transforms[self._key], now.transforms[self._key])
        ridden, drape = way.points(state.cloth.positions), RigidTransform.of(now.transforms[self._key]).points(self.rest)
        positions = ridden + min(1.0, DRAPE_RETURN * 2.0 ** min(state.failed_frames, 9)) * (drape - ridden)
        model, pins = self._dressed.model, self._dressed.scene(now).pinned
        positions[model.pinned] = pins[model.hard]
        self._end.state = state.projector
        cleaned = self._end.clean(now, positions, seconds)
        cloth = self._dressed.stepper.start(np.where(model.fixed[:, None], positions, cleaned.positions))
        cloth = replace(cloth, velocities=KEPT_VELOCITY * way.vectors(state.cloth.velocities), time=state.cloth.time + seconds)
        return ProxyState(state.to_world, cloth, self._end.state, pose, state.failed_frames + 1, state.origin)

    def _local_wind(self, seconds: float, positions: Positions) -> Positions:
        """The wind of the world, as it is seen from home."""
        return self._wind(seconds, self._home.points(positions) + self._origin) @ self._home.turn

    def _teleport(self, state: ProxyState, pose: Pose) -> ProxyState:
        """The State where the body was put: all of it turned and moved with the pelvis."""
        at = state.pose.rotations.copy()
        at[0] = pose.rotations[0]
        there = Pose(at, pose.translation)
        then, now = self.shaped.posed(state.pose), self.shaped.posed(there)
        way, cloth = RigidTransform.between(then.transforms[0], now.transforms[0]), state.cloth
        moved: ClothState = replace(
            cloth,
            positions=way.points(cloth.positions),
            velocities=way.vectors(cloth.velocities),
            change=way.vectors(cloth.change),
        )
        return replace(state, cloth=moved, pose=there)
