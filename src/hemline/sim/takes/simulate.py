"""A garment on a moving body: the frames of one take."""

import logging
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from hemline.bodies.lead_in import lead_in
from hemline.datasets.take import Take
from hemline.datasets.take_checks import VERTEX_LIMIT
from hemline.errors import BadInput, SimulationFailed
from hemline.garments.garment import Garment
from hemline.motions.clean import jump
from hemline.motions.motion import Motion, Pose
from hemline.sim.cloth.figures import crossing_figures, mean_or_zero, strain_figures
from hemline.sim.cloth.wind import Wind
from hemline.sim.rest.settle import rest_drape
from hemline.sim.settings import SIMULATOR, SimSettings
from hemline.sim.step.dressed_body import DressedBody
from hemline.sim.step.frame_end import FrameEnd, projector_arrays, read_projector
from hemline.sim.step.state import ClothState

from .build_info import build_info
from .end_state import EndState, check_end_state

if TYPE_CHECKING:
    from hemline.bodies import ShapedBody

log = logging.getLogger(__name__)


def simulate(
    garment: Garment,
    shaped: "ShapedBody",
    motion: Motion,
    settings: SimSettings | None = None,
    *,
    start: Take | None = None,
    resume: EndState | None = None,
    wind: Wind | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Take:
    """Simulates a garment against a clip.

    Args:
        garment: The garment, on this body shape.
        shaped: The body.
        motion: The clip, placed on the body; it is resampled to the frame rate of the settings.
        settings: Settings of the simulator.
        start: The settled rest drape of this garment on this body; None to settle it here.
        resume: The end state of the preceding part of the clip; the result is the same as without the cut.
        wind: Wind over time and place, such as `Gusts` or a function (seconds, positions) to velocities; None for the
            wind of the settings. Only the latter is an input of the take.
        progress: Called after each frame with the frames done and the total number of frames.

    Returns:
        The take, with its lead-in. If a step failed at its shortest, or the clip jumps as no person can, `failed` gives
        the frame and the reason, and the take holds the frames before.

    Raises:
        BadInput: `start` or `resume` belongs to another garment, `resume` is no end state, or a wind is not one finite
            velocity per vertex.
        SimulationFailed: The garment could not be settled in the rest pose.
    """
    settings = settings or SimSettings()
    motion = motion.resample(settings.fps)
    dressed = DressedBody(garment, shaped, settings, wind)
    record = _Record()
    if resume is None:
        rest = start or rest_drape(garment, shaped, settings)
        _check_count("start", rest.vertices[0], garment)
        leading, placement = lead_in(shaped, motion, max(1, round(settings.lead_in * settings.fps)))
        state, before = dressed.stepper.start(placement.points(rest.vertices[0])), leading[0]
        end = FrameEnd(garment, shaped)
        projector = end.start()
        record.keep(state.positions, int(rest.pinched[0]))
        poses = [leading[i] for i in range(1, len(leading))] + [motion[i] for i in range(len(motion))]
    else:
        end = FrameEnd(garment, shaped)
        _check_resume(resume, garment, shaped, end)
        state, before = _state(resume), Pose(resume["rotations"], resume["translation"])
        projector = read_projector(resume)
        leading, poses = None, [motion[i] for i in range(len(motion))]
    failed = None
    lead_frames = 0 if leading is None else len(leading)
    total = len(poses) + len(record.vertices)
    for index, pose in enumerate(poses, start=len(record.vertices)):
        began = time.perf_counter()
        if jumping := jump(before, pose, 1 / settings.fps):
            failed = f"frame {index}: the clip jumps, {jumping}; cut it there, see motions.longest_clean"
            log.warning("take failed: %s", failed)
            break
        try:
            frame = dressed.simulate_frame(state, before, pose)
        except SimulationFailed as reason:
            failed = f"frame {index}: {reason}"
            log.warning("take failed: %s", failed)
            break
        state = frame.state
        if (away := float(np.abs(state.positions - pose.translation).max())) > VERTEX_LIMIT - 1:
            failed = f"frame {index}: the garment is not worn any more, a vertex is {away:.0f} m from the pelvis"
            log.warning("take failed: %s", failed)
            break
        cleaned = end.clean(frame.posed, state.positions, 1 / settings.fps, state.contact_history, projector=projector)
        state, before, projector = dressed.apply_projection(frame, cleaned), pose, cleaned.projector
        record.keep(cleaned.positions, len(cleaned.pinched))
        record.inside.append(cleaned.inside)
        record.deepest_mm.append(cleaned.deepest_mm)
        record.residual_share += [report.residual_share for report in frame.reports]
        newton, solver = sum(r.newton_steps for r in frame.reports), sum(r.solver_steps for r in frame.reports)
        log.debug(
            "frame %d: %.1f ms, %d Newton steps, %d of conjugate gradients",
            index,
            1000 * (time.perf_counter() - began),
            newton,
            solver,
        )
        if progress:
            progress(index + 1, total)
    whole = motion if leading is None else _concatenate(leading, motion)
    if not record.vertices:
        # a part that failed at once holds the frame that it started from
        record.keep(state.positions, int(state.pinched.sum()))
        whole, lead_frames = replace(motion, rotations=before.rotations[None], translations=before.translation[None]), 1
    done = len(record.vertices)
    leads = np.arange(done) < lead_frames
    vertices = np.array(record.vertices)
    shown = vertices[~leads] if (~leads).any() else vertices
    figures = strain_figures(dressed.sheet, shown, dressed.pinned) | crossing_figures(dressed.sheet, shown)
    return Take(
        kind="clip",
        vertices=vertices,
        motion=whole[:done],
        betas=shaped.betas,
        lead_in=leads,
        pinched=np.array(record.pinched, np.int32),
        figures=figures | record.figures(),
        failed=failed,
        inputs={
            "garment": garment.hash,
            "body": shaped.body.hash,
            "betas": [float(b) for b in shaped.betas],
            "motion": motion.hash,
            "clip": motion.name,
            "settings": asdict(settings),
            "simulator": SIMULATOR,
        },
        made_with=build_info(),
        end_state=_end_state(state, before) | projector_arrays(projector),
    )


@dataclass
class _Record:
    """Results noted frame by frame."""

    vertices: list[np.ndarray] = field(default_factory=list)
    pinched: list[int] = field(default_factory=list)
    inside: list[int] = field(default_factory=list)
    deepest_mm: list[float] = field(default_factory=list)
    residual_share: list[float] = field(default_factory=list)

    def keep(self, positions: np.ndarray, pinched: int) -> None:
        """Adds the positions of a frame."""
        self.vertices.append(positions.astype(np.float32))
        self.pinched.append(pinched)

    def figures(self) -> dict[str, float]:
        """Returns the figures of the take."""
        return {
            "inside": float(max(self.inside, default=0)),
            "deepest_mm": float(max(self.deepest_mm, default=0.0)),
            "pinched": mean_or_zero(self.pinched),
            "residual_share": mean_or_zero(self.residual_share),
        }


def _end_state(state: ClothState, pose: Pose) -> dict[str, np.ndarray]:
    """Returns the arrays that the next part continues from."""
    assert state.contact_history is not None
    return {
        "positions": state.positions,
        "velocities": state.velocities,
        "change": state.change,
        "load": state.load,
        "pinched": state.pinched.astype(np.uint8),
        "contact_history": state.contact_history,
        "time": np.array([state.time]),
        "rotations": pose.rotations,
        "translation": pose.translation,
    }


def _state(end: EndState) -> ClothState:
    """Returns the state of the cloth from an end state."""
    arrays = {
        name: np.ascontiguousarray(end[name], np.float64) for name in ("positions", "velocities", "change", "load")
    }
    # takes of older versions have no contact history: they continue from the closest skin
    history = end.get("contact_history", np.full((len(arrays["positions"]), 2), -1, np.int32))
    return ClothState(
        **arrays, pinched=end["pinched"].astype(bool), contact_history=history, time=float(end["time"][0])
    )


def _concatenate(first: Motion, second: Motion) -> Motion:
    """Joins two motions."""
    return replace(
        second,
        rotations=np.concatenate([first.rotations, second.rotations]),
        translations=np.concatenate([first.translations, second.translations]),
    )


def _check_resume(resume: EndState, garment: Garment, shaped: "ShapedBody", end: FrameEnd) -> None:
    """Checks that a simulation of this garment on this body can continue from an end state."""
    _check_count("resume", resume.get("positions", np.zeros(0)), garment)
    faces = len(end.projector.on_body.patches.faces)
    check_end_state(resume, len(garment.vertices), shaped.body, faces, owner="'resume'")


def _check_count(name: str, vertices: np.ndarray, garment: Garment) -> None:
    """Checks the number of vertices of an input."""
    if len(vertices) != len(garment.vertices):
        got = f"{len(vertices)} vertices for {len(garment.vertices)}"
        raise BadInput(f"'{name}' must belong to garment '{garment.name}'", got, "settle this garment again")
