"""One garment on one body, frame by frame: place the pose, skin the body, animate, repair the cloth, project it.

Everything that shows a garment goes through a `Player`: `play`, `evaluate`, the demo, and the loop of a program. So all
of them show cloth in one piece, with no vertex inside the body.
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
    GarmentOnBody,
    Guarantee,
    LayersReport,
    WholeCloth,
    WholeSettings,
)
from hemline.errors import BadInput
from hemline.garments import Garment
from hemline.motions.motion import Pose
from hemline.playback.detail import level_on_body
from hemline.playback.switch import nearest_vertices, transfer_projector, transfer_whole_cloth

from .frame import Frame
from .known_body import known_body
from .layers import (
    THICKNESS_MM,
    ClosePiece,
    FrameProjector,
    check_thickness,
    close_pieces,
    close_vertices,
    covers_of,
    hold_close,
    projector_of,
    rest_function,
    stretch_limits,
)
from .notebook import frame_html
from .origin import WORLD_ORIGIN, Origin, in_world, origin_for, relative_to
from .player_state import PlayerState
from .run_up import run_up
from .time_step import clamp_dt, run_up_steps

STAGES = ("body", "animator", "whole", "cover", "projection")
"""Stages of a frame that are timed; for several garments, `layers` is timed as well."""


@dataclass(frozen=True, eq=False)
class Player:
    """The garment of an animator on one body, ready to be played. Make it with `Player.prepare`.

    Attributes:
        animator: The animator of the garment.
        body: The body that wears it.
        known: The body that the animator knows: `body`, or without its accessories if the animator was fitted so.
        garment: The garment that is shown, with fewer vertices below a detail of 1.
        collider: The body that cloth is kept out of: `body`, or below a detail of 0.5 a coarser one around it.
        error: Error of the level of detail, see `LevelOnBody` [m].
        whole: The step that keeps cloth in one piece, between animator and projection; None where it is off, or all
            garments lie close to the body.
        close: The pieces that lie close to the body, each with the step that keeps it in one piece, out of the skin and
            over it, in the place of `whole` and `cover`; empty where `whole` is off, or there is no such piece.
        cover: Keeps the skin from showing through close-fitting cloth, one per piece that is not in `close`; None where
            `whole` is off, or the collider is not the body.
        projector: Moves vertices out of the body in each frame, and each of several garments out of those beneath it.
        held: Which vertices belong to pieces of `close`, where others are worn with them: the whole-cloth step leaves
            these vertices alone. None where all vertices are of one sort.
        placed: Whether poses of a motion are placed on this body already.

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
    known: ShapedBody
    garment: Garment
    collider: ShapedBody
    error: float
    whole: WholeCloth | None
    close: tuple[ClosePiece, ...]
    cover: tuple[Cover, ...] | None
    projector: FrameProjector
    held: Bool[np.ndarray, " verts"] | None
    placed: bool
    _placements: dict[str, Placement] = field(default_factory=dict, init=False, repr=False)
    """Placement of each clip, by its hash."""

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
        """Prepares a garment on a body, which takes about a second.

        A pose of a motion (`motion[0]`, `motion.at(0.5)`) is placed when it is played: scaled to the legs of the body,
        and lifted so that the soles of its clip are on the floor. Any other pose, `Pose(rotations, translation)`, is
        used unchanged.

        Args:
            animator: A fitted animator.
            body: A body of the kind that it was fitted on, of any shape, with or without accessories.
            guarantee: `exact` tests in every frame that no vertex is inside the body; `fast` does not test.
            measure: Whether reports count the vertices that were inside before, and measure their depth.
            placed: Whether poses of motions are placed on this body already (`body.placed(motion)`).
            whole: Whether cloth is kept in one piece where the animator tears it or puts it through a limb. If off, the
                cloth of the animator is shown as it is.
            detail: Fraction of the garment's vertices; the player shows `player.garment`, and all stages cost less.
                Below 0.5 cloth is kept out of the coarser `player.collider`, so a little of it may be inside the body.
            thickness_mm: Least distance of a garment from the one beneath it, where it is moved [mm].

        Raises:
            BadModel: The animator was fitted on another kind of body.
            BadGarment: The garment is pinned to triangles that the body does not have.
            BadInput: `detail` is not above 0 and at most 1, or leaves too few vertices; the animator has no levels of
                detail; or `thickness_mm` is not above 0 and at most 10 mm.
        """
        known = known_body(animator, body)
        animator.garment.check_pins_on(body)
        check_thickness(thickness_mm)
        level = level_on_body(animator, body, detail, known=known)
        garment, collider = level.garment, level.body
        made_on = body.body.shaped(garment.body_betas)
        on_body = GarmentOnBody.of(collider, garment.vertices, made_on=made_on.vertices if collider is body else None)
        held = close_vertices(level.animator)
        projector = projector_of(
            level,
            on_body,
            held,
            thickness_mm,
            guarantee=guarantee,
            measure=measure,
            whole=whole,
            detail=detail,
        )
        cloth = None
        if whole and not held.all():
            cloth = WholeCloth.prepare(collider, garment, on_body, WholeSettings().at_detail(detail))
        close = close_pieces(garment, on_body, stretch_limits(level.animator), level, body) if whole else ()
        cover = None
        if whole and collider is body:
            cover = covers_of(garment, made_on.bare, held)
        return cls(
            animator=level.animator,
            body=body,
            known=known,
            garment=garment,
            collider=collider,
            error=level.error,
            whole=cloth,
            close=close,
            cover=cover,
            projector=projector,
            held=held if cloth is not None and held.any() else None,
            placed=placed,
        )

    def start(self, pose: Pose, *, pre_roll: float = 1.0, dt: float = 1 / 30) -> PlayerState:
        """Returns the state before the first frame, in which the garment has settled.

        The body moves from its rest pose, in which the garment hangs freely, to the first pose, so that no limb starts
        inside the cloth. For the first pose of a clip it accelerates to the speed of the clip, as in the simulation.

        Args:
            pose: The first pose.
            pre_roll: Time before the first pose for which the animator runs without output, at most ten minutes [s].
            dt: Length of the steps, clamped to 1 ms to 0.25 s [s].

        Raises:
            BadInput: `dt` is not a positive time; or `pre_roll` is negative, not finite or longer than ten minutes; or
                the body is more than 1,048 km from the world's origin.
        """
        frames, dt = run_up_steps(pre_roll, dt)
        poses, origin = self._run_up_poses(pose, frames, dt)
        posed = self._pose_body(poses[0], origin)
        state, whole = self.animator.start(self._as_known(posed)), self.whole.start() if self.whole else None
        for each in poses[1:]:
            posed = self._pose_body(each, origin)
            state, vertices = self.animator.step(state, self._as_known(posed), dt)
            if self.whole and whole:
                whole, _ = self.whole.step(whole, self._on_collider(posed), vertices, dt=dt)
        return PlayerState(state, whole, self.projector.start(), origin, poses[-1])

    def step(self, state: PlayerState, pose: Pose, dt: float) -> tuple[PlayerState, Frame]:
        """Plays the next frame.

        After a pause (a program that was stopped, a level that was loaded) only a quarter of a second is played, so
        that the frame costs no more than others: the garment is carried along with the body, and swings at the average
        speed of the body. If the animator is not `Movable`, the body makes the whole distance in that quarter of a
        second.

        A body may be up to 1,048 km from the origin of the world without loss of quality of its garment. Positions in
        the world are rounded to 6 cm at 1,000 km in single precision: draw `frame.local` at `frame.origin`, and pass
        poses as exact as the motion of the body should be.

        Args:
            state: State from `start`, or from the previous frame; it is not changed.
            pose: Present pose of the body.
            dt: Time since the state, any positive time [s]. More than 0.25 s counts as a pause; less than 0.1 ms counts
                as 0.1 ms, and the garment moves rigidly with the body.

        Returns:
            The next state, and the frame: its cloth is in one piece, and no vertex of it is inside the body.

        Raises:
            BadInput: `dt` is not a positive time, or the body is more than 1,048 km from the origin of the world.
        """
        return self._advance(state, pose, dt, self.animator.step)

    def switch_to(self, state: PlayerState, other: "Player") -> PlayerState:
        """Returns the state for a player of another level of detail; the cloth does not jump.

        Args:
            state: A state of this player; it is not changed.
            other: The player to continue with, of the same animator on the same body.

        Raises:
            BadInput: The animator or the body differs, or only one of both players keeps the cloth in one piece.
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

    def reshape(self, state: PlayerState, body: ShapedBody) -> tuple["Player", PlayerState]:
        """Changes the shape of the body from the next frame on, without preparing anything anew.

        It serves shape sliders, and crowds: prepare one player, and reshape it for each agent.

        Args:
            state: A state of this player; it is not changed.
            body: The body of the new shape.

        Returns:
            The player of that body, and the state to continue with.

        Raises:
            BadInput: The animator is not `Settled`, or the body is of another kind.
        """
        if not isinstance(self.animator, Settled) or self.collider is not self.body:
            raise BadInput(
                "a body changes its shape under garments of settled states alone",
                f"animator '{self.animator.name}'",
                "prepare a player for each body",
            )
        known = body if self.known is self.body else body.bare
        moved = replace(state, animator=self.animator.reshape(state.animator, known))
        return replace(self, body=body, known=known, collider=body), moved

    def follow(self, state: PlayerState, pose: Pose, dt: float, truth: Vertices) -> tuple[PlayerState, Frame]:
        """Plays the next frame like `step`, driven by simulated vertices instead of the dynamics of the animator.

        Args:
            state: See `step`.
            pose: See `step`.
            dt: See `step` [s].
            truth: The simulated garment in this pose (verts, 3) [m].

        Raises:
            BadInput: The animator cannot be driven by vertices.
        """
        animator = require_driven(self.animator)

        def follow(moving: Any, posed: PosedBody, dt: float) -> tuple[Any, Vertices]:
            near = truth if posed.origin == WORLD_ORIGIN else (truth - np.array(posed.origin)).astype(np.float32)
            return animator.follow(moving, posed, dt, near)

        return self._advance(state, pose, dt, follow)

    def redress(
        self, state: PlayerState, pose: Pose, dt: float, vertices: Vertices, nominal: PosedBody
    ) -> tuple[PlayerState, Frame]:
        """Transfers a garment from the body of the fit, moved there by a simulation or another animator, to this body.

        Args:
            state: See `step`.
            pose: See `step`.
            dt: See `step` [s].
            vertices: The garment on the body of the fit (verts, 3) [m].
            nominal: The body of the fit in this pose.

        Raises:
            BadInput: The animator does not know the effect of shapes on a garment; or see `Redressing.redress`.
        """
        if not isinstance(self.animator, Redressing):
            raise BadInput(
                "what a body's shape does to a garment is known to models of settled garments",
                f"animator '{self.animator.name}'",
                "fit one with 'hemline fit --animator agentdress'",
            )
        return self._advance(state, pose, dt, partial(self.animator.redress, worn=vertices, nominal=nominal))

    def warm_up(self, pose: Pose) -> float:
        """Compiles everything by playing one frame; returns the time that it took [s]."""
        began = time.perf_counter()
        self.step(self.start(pose, pre_roll=1 / 30), pose, 1 / 30)
        return time.perf_counter() - began

    def _repr_html_(self) -> str:
        """Shows the garment on its body at rest in a notebook, and a line of facts."""
        pose = self.body.rest_pose
        _, frame = self.step(self.start(pose), pose, 1 / 30)
        caption = f"{self.garment.facts}; played by {self.animator.name} on {self.body.body.name}"
        return frame_html(frame, self.garment.faces, caption)

    @cached_property
    def _novelty_source(self) -> Bounded | None:
        return self.animator if isinstance(self.animator, Bounded) else None

    @cached_property
    def _terms(self) -> tuple[str, ...]:
        return terms_of(self.animator)

    @cached_property
    def _rest_vertices(self) -> Callable[[Any, ShapedBody], Vertices]:
        return rest_function(self.animator)

    def _on_collider(self, posed: PosedBody) -> PosedBody:
        """Returns the collider in the same pose."""
        return posed if self.collider is self.body else replace(posed, shaped=self.collider)

    def _as_known(self, posed: PosedBody) -> PosedBody:
        """Returns the body that the animator knows, in the same pose."""
        return posed if self.known is self.body else replace(posed, shaped=self.known)

    def _place(self, pose: Pose) -> Pose:
        clip = pose.clip
        if self.placed or clip is None:
            return pose
        if clip.hash not in self._placements:
            self._placements[clip.hash] = placement(self.body, clip)
        return self._placements[clip.hash].of(pose)

    def _pose_body(self, pose: Pose, origin: Origin) -> PosedBody:
        posed = self.body.posed(pose)
        return posed if origin == WORLD_ORIGIN else replace(posed, origin=origin)

    def _run_up_poses(self, pose: Pose, frames: int, dt: float) -> tuple[list[Pose], Origin]:
        """Returns the poses of the run-up, the first pose last, and their origin.

        At the first frame of a clip the run-up ends at the speed of the clip.
        """
        there, clip, second = self._place(pose), pose.clip, None
        origin = origin_for(there)
        first = relative_to(there, origin)
        if clip is not None and len(clip) > 1 and np.array_equal(pose.translation, clip.translations[0]):
            step = (self._place(clip[1]).translation - there.translation) * (dt * clip.fps)
            second = Pose(first.rotations, first.translation + step)
        return run_up(self.body, first, second, frames, dt), origin

    def _advance(
        self, state: PlayerState, pose: Pose, dt: float, animate: Callable[..., tuple[Any, Vertices]]
    ) -> tuple[PlayerState, Frame]:
        played, clock, pose = clamp_dt(dt), [time.perf_counter()], self._place(pose)
        state, dt = state.relocate(self.animator, self.known, pose, dt), played
        local = relative_to(pose, state.origin)
        posed = self._pose_body(local, state.origin)
        solid = self._on_collider(posed)
        surface = self.projector.on_body.surface(solid)
        clock.append(time.perf_counter())
        moved, animated = animate(state.animator, self._as_known(posed), dt)
        clock.append(time.perf_counter())
        whole, constrained = state.whole, animated
        if self.whole and whole:
            whole, constrained = self.whole.step(whole, solid, animated, dt=dt, surface=surface)
            constrained = constrained if self.held is None else np.where(self.held[:, None], animated, constrained)
        contact = None
        if self.close:
            constrained, contact = hold_close(
                self.close, constrained, self._rest_vertices(moved, self.known), solid, surface
            )
        clock.append(time.perf_counter())
        covered = constrained
        for cover in self.cover or ():
            covered = cover.step(solid.vertices[: len(self.body.bare.vertices)], covered)
        clock.append(time.perf_counter())
        projected, vertices, report = self.projector.project(
            state.projector, solid, covered, dt=dt, surface=surface, contact=contact
        )
        clock.append(time.perf_counter())
        times = [(after - before) * 1e3 for before, after in pairwise(clock)]
        spans: dict[str, float] = dict(zip(STAGES, times, strict=True))
        if isinstance(report, LayersReport):
            spans |= {"projection": spans["projection"] - report.layers_ms, "layers": report.layers_ms}
        novelty = self._novelty_source.novelty(moved) if self._novelty_source else None
        frame = Frame(vertices, animated, covered, posed, report, spans, novelty, self._terms)
        after = PlayerState(moved, whole, projected, state.origin, local)
        return after, frame if state.origin == WORLD_ORIGIN else frame.in_world(in_world(posed, pose))


def require_driven(animator: Animator) -> Driven:
    """Returns an animator that simulated vertices can drive.

    Raises:
        BadInput: They cannot drive this one.
    """
    if not isinstance(animator, Driven):
        raise BadInput(
            f"animator '{animator.name}' is not driven by ground truth", "simulated vertices", "let it run: drive 'own'"
        )
    return animator
