"""One garment on one body, frame by frame: place the pose, skin the body, animate, hold together, project, time.

Everything that shows a garment goes through a `Player`: `play`, `evaluate`, the demo, and a program's own loop. So
"cloth in one piece, and none of it inside the body" holds for all of them.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from itertools import pairwise
from typing import Any, Self

import numpy as np

from hemline.animators.base import Animator, Driven
from hemline.arrays import Vertices
from hemline.bodies.body import ShapedBody
from hemline.bodies.lead_in import lead_in
from hemline.bodies.place import Placement, placement
from hemline.collide import Guarantee, Projector, ProjectorState, WholeCloth, WholeState, WornGarment
from hemline.errors import BadInput, BadModel
from hemline.motions.motion import Motion, Pose

from .frame import Frame

STAGES = ("body", "animator", "whole", "projection")
"""What a frame's time is made of."""


@dataclass(frozen=True)
class PlayerState:
    """All that moves from frame to frame: plain data, never changed in place. Keeping an old one is a rollback."""

    animator: Any
    """The animator's own State."""
    whole: WholeState | None
    """None where the step is off."""
    projector: ProjectorState


@dataclass(frozen=True, eq=False)
class Player:
    """An animator's garment on one body, ready to be played. Make it with `Player.prepare`.

    Attributes:
        animator: What moves the garment.
        body: The body that wears it.
        whole: What keeps the cloth in one piece, between animator and projection; None: nothing does.
        projector: What moves vertices out of the body in each frame.
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
    whole: WholeCloth | None
    projector: Projector
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

        Raises:
            BadModel: The animator was fitted on another kind of body.
        """
        if body.body.name != animator.body_name:
            raise BadModel(
                f"the model was fitted on body '{animator.body_name}'",
                f"body '{body.body.name}'",
                "load that body, or fit again",
            )
        garment = animator.garment
        worn = WornGarment.of(body, garment.vertices)
        projector = Projector.prepare(
            body, garment.vertices, garment.faces, guarantee=guarantee, measure=measure, worn=worn
        )
        held = WholeCloth.prepare(body, garment, worn) if whole else None
        return cls(animator, body, held, projector, placed)

    def start(self, pose: Pose, *, pre_roll: float = 1.0, dt: float = 1 / 30) -> PlayerState:
        """The state before the first frame, in which the garment has settled.

        Before that the body moves from its rest pose, in which the garment hangs settled, to the first pose: so no arm
        is through the cloth when it begins. For the first pose of a clip it runs up to the speed of the clip's start,
        as the simulation does.

        Args:
            pose: The first pose.
            pre_roll: Time before the first pose for which the animator runs unseen [s].
            dt: Its steps [s].

        Raises:
            BadInput: `dt` is not a positive time, or `pre_roll` is negative or not finite.
        """
        _check_time(dt)
        if not 0 <= pre_roll < float("inf"):
            raise BadInput("a pre-roll takes a time from 0 on", f"pre_roll = {pre_roll} s", "leave it out for 1 s")
        leading = self._leading(pose, round(pre_roll / dt), dt)
        posed = self.body.posed(leading[0])
        state, whole = self.animator.start(posed), self.whole.start() if self.whole else None
        for each in leading[1:]:
            posed = self.body.posed(each)
            state, vertices = self.animator.step(state, posed, dt)
            if self.whole and whole:
                whole, _ = self.whole.step(whole, posed, vertices, dt=dt)
        return PlayerState(state, whole, self.projector.start())

    def step(self, state: PlayerState, pose: Pose, dt: float) -> tuple[PlayerState, Frame]:
        """The next frame.

        Args:
            state: From `start`, or from the frame before; it is not changed.
            pose: The body's pose now.
            dt: Time since the state [s].

        Returns:
            The state after, and the frame: its cloth is in one piece, and no vertex of it is inside the body.

        Raises:
            BadInput: `dt` is not a positive time.
        """
        return self._stepped(state, pose, dt, self.animator.step)

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
        animator = driven(self.animator)
        return self._stepped(state, pose, dt, partial(animator.follow, truth=truth))

    def warm_up(self, pose: Pose) -> float:
        """Compile what is not compiled yet by one frame that nobody sees; the time that it took [s]."""
        began = time.perf_counter()
        self.step(self.start(pose, pre_roll=1 / 30), pose, 1 / 30)
        return time.perf_counter() - began

    def _placed(self, pose: Pose) -> Pose:
        clip = pose.clip
        if self.placed or clip is None:
            return pose
        if clip.hash not in self._placements:
            self._placements[clip.hash] = placement(self.body, clip)
        return self._placements[clip.hash].of(pose)

    def _leading(self, pose: Pose, frames: int, dt: float) -> list[Pose]:
        """Poses of the run-up, the first pose last; that alone without one."""
        first, clip = self._placed(pose), pose.clip
        if frames < 1:
            return [first]
        translations = first.translation[None]
        if clip is not None and len(clip) > 1 and np.array_equal(pose.translation, clip.translations[0]):
            way = (self._placed(clip[1]).translation - first.translation) * (dt * clip.fps)
            translations = np.stack([first.translation, first.translation + way])
        rotations = np.repeat(first.rotations[None], len(translations), axis=0)
        poses, _ = lead_in(self.body, Motion(rotations, translations, 1 / dt, self.body.leg_length), frames)
        return [*(poses[index] for index in range(len(poses))), first]

    def _stepped(
        self, state: PlayerState, pose: Pose, dt: float, animate: Callable[..., tuple[Any, Vertices]]
    ) -> tuple[PlayerState, Frame]:
        _check_time(dt)
        clock = [time.perf_counter()]
        posed = self.body.posed(self._placed(pose))
        surface = self.projector.worn.surface(posed)
        clock.append(time.perf_counter())
        moved, animated = animate(state.animator, posed, dt)
        clock.append(time.perf_counter())
        whole, held = state.whole, animated
        if self.whole and whole:
            whole, held = self.whole.step(whole, posed, animated, dt=dt, surface=surface)
        clock.append(time.perf_counter())
        projected, vertices, report = self.projector.project(state.projector, posed, held, dt=dt, surface=surface)
        clock.append(time.perf_counter())
        spans = [(after - before) * 1e3 for before, after in pairwise(clock)]
        frame = Frame(vertices, animated, held, posed, report, dict(zip(STAGES, spans, strict=True)))
        return PlayerState(moved, whole, projected), frame


def _check_time(dt: float) -> None:
    if not 0 < dt < float("inf"):
        raise BadInput("a frame must take a positive time", f"dt = {dt} s", "give the time since the last frame")


def driven(animator: Animator) -> Driven:
    """The animator, if simulated vertices can drive it.

    Raises:
        BadInput: They cannot.
    """
    if not isinstance(animator, Driven):
        raise BadInput(
            f"animator '{animator.name}' is not driven by ground truth", "simulated vertices", "let it run: drive 'own'"
        )
    return animator
