"""One garment on one body, frame by frame: place the pose, skin the body, animate, hold together, project, time.

Everything that shows a garment goes through a `Player`: `play`, `evaluate`, the demo, and a program's own loop. So
"cloth in one piece, and none of it inside the body" holds for all of them.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from itertools import pairwise
from typing import Any, Self

import numpy as np

from hemline.animators.base import Animator, Bounded, Driven, Redressing, Settled
from hemline.animators.terms import terms_of
from hemline.arrays import Bool, Vertices
from hemline.bodies.body import PosedBody, ShapedBody
from hemline.bodies.place import Placement, placement
from hemline.collide import (
    Cover,
    EdgeLimits,
    Guarantee,
    LayeredProjector,
    LayersReport,
    Projector,
    WholeCloth,
    WholeSettings,
    GarmentOnBody,
)
from hemline.errors import BadInput, BadModel
from hemline.garments import Garment
from hemline.motions.motion import Pose
from hemline.playback.detail import level_on_body
from hemline.playback.switch import nearest_vertices, transfer_projector, transfer_whole_cloth

from .time_step import clamp_dt, run_up_steps
from .frame import Frame
from .layers import THICKNESS_MM, rest_function, check_thickness, covers_of, projected_by, projector_of, settled_vertices
from .origin import WORLD_ORIGIN, Origin, in_world, origin_for, relative_to
from .player_state import PlayerState
from .run_up import run_up

STAGES = ("body", "animator", "whole", "cover", "projection")
"""What a frame's time is made of; where several garments are worn, `layers`, too."""


@dataclass(frozen=True, eq=False)
class Player:
    """An animator's garment on one body, ready to be played. Make it with `Player.prepare`.

    Attributes:
        animator: What moves the garment.
        body: The body that wears it.
        garment: The garment that is shown: fewer vertices below a detail of 1.
        collider: What the cloth is kept out of: the body, or below a detail of 0.5 a coarser one around it.
        error: How far a level is from the full garment that hangs at rest, see `LevelOnBody` [m].
        whole: What keeps the cloth in one piece, between animator and projection; None: nothing does, or the animator
            is `SettledGarments`.
        limits: What keeps the cloth of `SettledGarments` animators from being stretched too far, in the same place; None: there
            is none, or `whole` is off.
        cover: What moves cloth that lies close over the skin that looks out, one a piece; None where `whole` is off, or
            the collider is not the body.
        projector: What moves vertices out of the body in each frame; of several garments, each out of those beneath it
            first.
        settled: Which vertices are of `SettledGarments` animators, of several that are worn together: the whole-cloth step
            leaves them alone; None where there is no such difference.
        placed: Whether poses of a motion are on this body already.

    Example:
        >>> import hemline
        >>> body, run = hemline.bodies.load("anny24").shaped(), hemline.motions.load("run")
        >>> player = hemline.Player.prepare(hemline.load("cape"), body)
        >>> state = player.start(run[0])
        >>> state, frame = player.step(state, run[1], 1 / 30)
        >>> frame.vertices.shape
        (12690, 3)
    """

    animator: Animator
    body: ShapedBody
    garment: Garment
    collider: ShapedBody
    error: float
    whole: WholeCloth | None
    limits: EdgeLimits | None
    cover: tuple[Cover, ...] | None
    projector: Projector | LayeredProjector
    settled: Bool[np.ndarray, " verts"] | None
    placed: bool
    _placements: dict[str, Placement] = field(default_factory=dict, init=False, repr=False)
    """Of clips by their hash: found once."""

    @classmethod
    def prepare(
        cls,
        animator: Animator,
        body: ShapedBody,
        *,
        guarantee: Guarantee = "exact",
        measure: bool = False,
        placed: bool = False,
        whole: bool = True,
        detail: float = 1.0,
        thickness_mm: float = THICKNESS_MM,
    ) -> Self:
        """Put a garment on a body: a second of work, once.

        A pose of a motion (`motion[0]`, `motion.at(0.5)`) is placed when it is played: scaled to the body's legs, and
        lifted so that the soles of its clip are on the floor. A pose that one makes, as an engine does, is taken as it
        is: `Pose(rotations, translation)` of this body, where it stands in the world.

        Args:
            animator: A fitted animator.
            body: A body of the kind that it was fitted on, of any shape.
            guarantee: `exact`: no vertex inside the body, tested in every frame; `fast`: not tested.
            measure: Let reports say how many vertices were inside before, and how deep.
            placed: Poses of motions are on this body already (`body.placed(motion)`).
            whole: Keep the cloth in one piece where the animator tears it or puts it through a limb. Off, one sees what
                the animator makes.
            detail: Share of the garment's vertices: the player shows `player.garment`, and all stages cost less. Below
                0.5 the tests are against the coarser `player.collider`: a little cloth may be inside the body itself.
            thickness_mm: Least distance of a garment from the one beneath it, where it must be moved [mm].

        Raises:
            BadModel: The animator was fitted on another kind of body.
            BadGarment: Its garment is pinned to triangles that the body has not.
            BadInput: A level of detail that is not above 0 and at most 1, or that leaves too few vertices; or the
                animator has no levels; or a thickness that is not above 0 and at most 10 mm.
        """
        if body.body.name != animator.body_name:
            raise BadModel(
                f"the model was fitted on body '{animator.body_name}'",
                f"body '{body.body.name}'",
                "load that body, or fit again",
            )
        animator.garment.check_pins_on(body)
        check_thickness(thickness_mm)
        level = level_on_body(animator, body, detail)
        garment, collider = level.garment, level.body
        worn = GarmentOnBody.of(collider, garment.vertices)
        settled = settled_vertices(level.animator)
        projector = projector_of(
            level,
            worn,
            settled,
            thickness_mm,
            guarantee=guarantee,
            measure=measure,
            whole=whole,
            detail=detail,
        )
        held = None
        if whole and not settled.all():
            held = WholeCloth.prepare(collider, garment, worn, WholeSettings().at_detail(detail))
        limits = EdgeLimits.of(garment, settled) if whole and settled.any() else None
        cover = None
        if whole and collider is body:
            cover = covers_of(garment, body.body.shaped(garment.body_betas))
        alone = settled if held is not None and settled.any() else None
        return cls(level.animator, body, garment, collider, level.error, held, limits, cover, projector, alone, placed)

    def start(self, pose: Pose, *, pre_roll: float = 1.0, dt: float = 1 / 30) -> PlayerState:
        """The state before the first frame, in which the garment has settled.

        Before that the body moves from its rest pose, in which the garment hangs settled, to the first pose: so no arm
        is through the cloth when it begins. For the first pose of a clip it runs up to the speed of the clip's start,
        as the simulation does.

        Args:
            pose: The first pose.
            pre_roll: Time before the first pose for which the animator runs unseen, at most ten minutes [s].
            dt: Its steps; shorter ones than 1 ms are taken for 1 ms, longer ones than 0.25 s for 0.25 s [s].

        Raises:
            BadInput: `dt` is not a positive time; or `pre_roll` is negative, not finite or longer than ten minutes; or
                the body is more than 1,048 km from the world's origin.
        """
        frames, dt = run_up_steps(pre_roll, dt)
        leading, origin = self._leading(pose, frames, dt)
        posed = self._posed(leading[0], origin)
        state, whole = self.animator.start(posed), self.whole.start() if self.whole else None
        for each in leading[1:]:
            posed = self._posed(each, origin)
            state, vertices = self.animator.step(state, posed, dt)
            if self.whole and whole:
                whole, _ = self.whole.step(whole, self._collided(posed), vertices, dt=dt)
        return PlayerState(state, whole, self.projector.start(), origin, leading[-1])

    def step(self, state: PlayerState, pose: Pose, dt: float) -> tuple[PlayerState, Frame]:
        """The next frame.

        After a pause (a program that was stopped, a level that was loaded) a quarter of a second is played, however
        long it was, and the frame takes no longer than others: the garment is where the body was put in the meantime,
        and swings from there as fast as the body went on average. Where the animator is not `Movable` it is played as
        if the body had made its whole way in that quarter of a second.

        A body may be up to 1,048 km from the world's origin, and its garment is as good there as anywhere. Positions in
        the world are not, since single precision has steps of 6 cm at 1,000 km: draw `frame.local` at `frame.origin`,
        and give poses that are as exact as you want the motion of the body to be.

        Args:
            state: From `start`, or from the frame before; it is not changed.
            pose: The body's pose now.
            dt: Time since the state [s]: any positive time. More than 0.25 s is a pause; less than 0.1 ms is taken for
                0.1 ms, and the garment goes along with the body unmoved.

        Returns:
            The state after, and the frame: its cloth is in one piece, and no vertex of it is inside the body.

        Raises:
            BadInput: `dt` is not a positive time, or the body is more than 1,048 km from the world's origin.
        """
        return self._stepped(state, pose, dt, self.animator.step)

    def switched(self, state: PlayerState, other: "Player") -> PlayerState:
        """The state for a player of another level of detail, which goes on from there: the cloth does not jump.

        Args:
            state: Of this player; it is not changed.
            other: The player to go on with: of the same animator on the same body.

        Raises:
            BadInput: Another animator or another body, or only one of the two keeps the cloth in one piece.
        """
        if other is self:
            return state
        one, two = (getattr(player.animator, "full", player.animator) for player in (self, other))
        if one is not two or other.body is not self.body or (other.whole is None) != (self.whole is None):
            raise BadInput(
                "a state goes on at another level of the same animator on the same body",
                f"'{one.name}' of '{one.garment.name}' and '{two.name}' of '{two.garment.name}', or two bodies",
                "prepare both players with the same animator, body and `whole`",
            )
        nearest, whole = nearest_vertices(other.garment, self.garment), state.whole
        if other.whole and self.whole and whole:
            whole = transfer_whole_cloth(other.whole, self.whole, whole, nearest)
        projector = transfer_projector(other.projector, self.projector, state.projector, nearest)
        return replace(state, whole=whole, projector=projector)

    def reshaped(self, state: PlayerState, body: ShapedBody) -> tuple["Player", PlayerState]:
        """The garment on a body of another shape from the next frame on; nothing is prepared anew.

        For shape sliders, and for crowds: prepare one player, and reshape it for each agent.

        Args:
            state: Of this player; it is not changed.
            body: The body from now on.

        Returns:
            The player of that body, and the state to go on with.

        Raises:
            BadInput: The animator is not `SettledGarments`, so that its garment must be put on anew; or another kind of body.
        """
        if not isinstance(self.animator, Settled) or self.collider is not self.body:
            raise BadInput(
                "a body changes its shape under garments of settled states alone",
                f"animator '{self.animator.name}'",
                "prepare a player for each body",
            )
        moved = replace(state, animator=self.animator.reshaped(state.animator, body))
        return replace(self, body=body, collider=body), moved

    def follow(self, state: PlayerState, pose: Pose, dt: float, truth: Vertices) -> tuple[PlayerState, Frame]:
        """As `step`, driven by simulated vertices instead of by the animator's own dynamics.

        Args:
            state: As for `step`.
            pose: As for `step`.
            dt: As for `step` [s].
            truth: The simulated garment in this pose [m].

        Raises:
            BadInput: The animator cannot be driven so.
        """
        animator = require_driven(self.animator)

        def follow(moving: Any, posed: PosedBody, dt: float) -> tuple[Any, Vertices]:
            near = truth if posed.origin == WORLD_ORIGIN else (truth - np.array(posed.origin)).astype(np.float32)
            return animator.follow(moving, posed, dt, near)

        return self._stepped(state, pose, dt, follow)

    def redress(
        self, state: PlayerState, pose: Pose, dt: float, worn: Vertices, nominal: PosedBody
    ) -> tuple[PlayerState, Frame]:
        """As `step`, for a garment that something else moved on the body of the fit: a simulated take, other animators.

        Args:
            state: As for `step`.
            pose: As for `step`.
            dt: As for `step` [s].
            worn: The garment there (verts, 3) [m].
            nominal: The body of the fit in this pose.

        Raises:
            BadInput: The animator does not know what shapes do to a garment; or as `Redressing.redress`.
        """
        if not isinstance(self.animator, Redressing):
            raise BadInput(
                "what a body's shape does to a garment is known to models of settled garments",
                f"animator '{self.animator.name}'",
                "fit one with 'hemline fit --animator agentdress'",
            )
        return self._stepped(state, pose, dt, partial(self.animator.redress, worn=worn, nominal=nominal))

    def warm_up(self, pose: Pose) -> float:
        """Compile what is not compiled yet by one frame that nobody sees; the time that it took [s]."""
        began = time.perf_counter()
        self.step(self.start(pose, pre_roll=1 / 30), pose, 1 / 30)
        return time.perf_counter() - began

    @cached_property
    def _bounded(self) -> Bounded | None:
        return self.animator if isinstance(self.animator, Bounded) else None

    @cached_property
    def _terms(self) -> tuple[str, ...]:
        return terms_of(self.animator)

    @cached_property
    def _at_rest(self) -> Callable[[Any], Vertices]:
        return rest_function(self.animator)

    def _collided(self, posed: PosedBody) -> PosedBody:
        """What the cloth is kept out of, in the same pose."""
        return posed if self.collider is self.body else replace(posed, shaped=self.collider)

    def _placed(self, pose: Pose) -> Pose:
        clip = pose.clip
        if self.placed or clip is None:
            return pose
        if clip.hash not in self._placements:
            self._placements[clip.hash] = placement(self.body, clip)
        return self._placements[clip.hash].of(pose)

    def _posed(self, pose: Pose, origin: Origin) -> PosedBody:
        posed = self.body.posed(pose)
        return posed if origin == WORLD_ORIGIN else replace(posed, origin=origin)

    def _leading(self, pose: Pose, frames: int, dt: float) -> tuple[list[Pose], Origin]:
        """Poses of the run-up, the first pose last, and the origin that they are counted from.

        From the first frame of a clip it goes on at the clip's speed.
        """
        there, clip, second = self._placed(pose), pose.clip, None
        origin = origin_for(there)
        first = relative_to(there, origin)
        if clip is not None and len(clip) > 1 and np.array_equal(pose.translation, clip.translations[0]):
            way = (self._placed(clip[1]).translation - there.translation) * (dt * clip.fps)
            second = Pose(first.rotations, first.translation + way)
        return run_up(self.body, first, second, frames, dt), origin

    def _stepped(
        self, state: PlayerState, pose: Pose, dt: float, animate: Callable[..., tuple[Any, Vertices]]
    ) -> tuple[PlayerState, Frame]:
        played, clock, pose = clamp_dt(dt), [time.perf_counter()], self._placed(pose)
        state, dt = state.relocate(self.animator, self.body, pose, dt), played
        local = relative_to(pose, state.origin)
        posed = self._posed(local, state.origin)
        solid = self._collided(posed)
        surface = self.projector.on_body.surface(solid)
        clock.append(time.perf_counter())
        moved, animated = animate(state.animator, posed, dt)
        clock.append(time.perf_counter())
        whole, held = state.whole, animated
        if self.whole and whole:
            whole, held = self.whole.step(whole, solid, animated, dt=dt, surface=surface)
            held = held if self.settled is None else np.where(self.settled[:, None], animated, held)
        if self.limits:
            held = self.limits.shorten(held, self._at_rest(moved))
        clock.append(time.perf_counter())
        covered = held
        for cover in self.cover or ():
            covered = cover.step(solid.vertices, covered)
        clock.append(time.perf_counter())
        projected, vertices, report = projected_by(self.projector, state.projector, solid, covered, dt, surface)
        clock.append(time.perf_counter())
        times = [(after - before) * 1e3 for before, after in pairwise(clock)]
        spans: dict[str, float] = dict(zip(STAGES, times, strict=True))
        if isinstance(report, LayersReport):
            spans |= {"projection": spans["projection"] - report.layers_ms, "layers": report.layers_ms}
        novelty = self._bounded.novelty(moved) if self._bounded else None
        frame = Frame(vertices, animated, covered, posed, report, spans, novelty, self._terms)
        after = PlayerState(moved, whole, projected, state.origin, local)
        return after, frame if state.origin == WORLD_ORIGIN else frame.in_world(in_world(posed, pose))


def require_driven(animator: Animator) -> Driven:
    """The animator, if simulated vertices can drive it.

    Raises:
        BadInput: They cannot.
    """
    if not isinstance(animator, Driven):
        raise BadInput(
            f"animator '{animator.name}' is not driven by ground truth", "simulated vertices", "let it run: drive 'own'"
        )
    return animator
