"""The drape in the body's rest pose, from which every take starts."""

from dataclasses import asdict, replace
from typing import TYPE_CHECKING

import numpy as np

from hemline.datasets.take import Take
from hemline.errors import SimulationFailed
from hemline.garments.garment import Garment
from hemline.motions.motion import Motion

from .dressed_body import DressedBody
from .figures import mean_or_zero, strain_figures
from .frame_end import FrameEnd
from .settings import SimSettings
from .sheet import Sheet

if TYPE_CHECKING:
    from hemline.bodies import ShapedBody

STILL = 0.002
"""Mean speed below which the cloth is taken to be settled [m/s]."""

KEPT_SPEED = 0.9
"""Share of the velocity that is kept from step to step while settling."""

CLOSED = 1.5
"""Greatest stretch of an edge from which the garment is taken to be sewn up."""


def rest_drape(garment: Garment, shaped: "ShapedBody", settings: SimSettings | None = None) -> Take:
    """Settle a garment in the rest pose of a body, without wind.

    Args:
        garment: The garment, on this body shape.
        shaped: The body.
        settings: Settings; the wind is ignored.

    Returns:
        A take of kind `rest` with one frame.

    Raises:
        SimulationFailed: The garment cannot be settled from where it starts.
    """
    settings = replace(settings or SimSettings(), wind=(0.0, 0.0, 0.0), gusts=0.0)
    dressed = DressedBody(garment, shaped, settings)
    pose = shaped.rest_pose
    state, end = dressed.stepper.start(garment.vertices), FrameEnd(garment, shaped)
    residuals: list[float] = []
    step = 1 / settings.fps
    meeting = dressed.stepper.self_contact
    for frame in range(round(settings.settle * settings.fps)):
        # seams that are still open pull cloth through cloth: it meets itself once they are closed, without any speed
        closed = _stretch(dressed.sheet, state.positions) < CLOSED
        dressed.stepper.self_contact = meeting if closed else None
        try:
            state, reports, posed = dressed.frame(state, pose, pose, substeps=2, seconds=step)
        except SimulationFailed as reason:
            raise SimulationFailed(f"settling '{garment.name}' in the rest pose, frame {frame}: {reason}") from reason
        cleaned = end.clean(posed, state.positions, step)
        state = dressed.fed_back(state, cleaned.positions, cleaned.pinched)
        kept = KEPT_SPEED if closed else 0.0
        state = replace(state, velocities=kept * state.velocities, change=kept * state.change)
        residuals = [report.residual_share for report in reports]
        if frame > 5 and closed and float(np.linalg.norm(state.velocities, axis=1).mean()) < STILL:
            break
    motion = Motion(
        pose.rotations[None], pose.translation[None], fps=settings.fps, leg_length=shaped.leg_length, name="rest"
    )
    vertices = cleaned.positions.astype(np.float32)[None]
    figures = strain_figures(dressed.sheet, vertices, dressed.pinned) | {
        "inside": float(cleaned.inside), "deepest_mm": cleaned.deepest_mm, "pinched": float(len(cleaned.pinched)),
        "residual_share": mean_or_zero(residuals),
    }  # fmt: skip
    inputs = {
        "garment": garment.hash, "body": shaped.body.hash, "betas": [float(b) for b in shaped.betas],
        "settings": asdict(settings), "clip": "", "part": 0,
    }  # fmt: skip
    return Take(
        kind="rest", vertices=vertices, motion=motion, betas=shaped.betas, lead_in=np.zeros(1, bool),
        pinched=np.array([len(cleaned.pinched)], np.int32), figures=figures, inputs=inputs,
    )  # fmt: skip


def _stretch(sheet: Sheet, positions: np.ndarray) -> float:
    ends = positions[sheet.edges]
    return float((np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1) / sheet.edge_length).max())
