"""AgentDress beside a simulation in motion, and beside the garment at rest in the same frames."""

from pathlib import Path

import numpy as np

import hemline
from hemline import bodies, motions
from hemline.animators.agentdress.model import AnimatorAgentDress
from hemline.arrays import Vertices
from hemline.bodies.body import ShapedBody
from hemline.datasets import open_dataset
from hemline.motions.motion import Motion
from hemline.sim import SimSettings, produce_posed, simulate
from hemline.sim.takes.anchor_jobs import HANGING
from papers.agentdress.settled.pairs import mean_distance_mm

from .ablations import Errors
from .paper_system import PaperSystem

CLIP, FPS, EVERY, SECONDS = "walk", 30.0, 8, 3.0
"""A clip of a person who appears in no fit, its frame rate, step between the compared frames, and its length [s]."""
SETTLED = "the garment at rest in the same frames"
"""Name of what no model of settled garments can be expected to beat."""


def distances_in_motion(
    folder: Path, models: dict[str, AnimatorAgentDress], system: PaperSystem | None, *, jobs: int
) -> Errors:
    """Returns the distance of each model from a simulation on the mean body, in some frames of a clip [mm].

    Args:
        folder: Dataset of the garments at rest; made if missing, and continued.
        models: Models by name; all of one garment.
        system: The system of the paper, or None.
        jobs: Number of processes.
    """
    first = next(iter(models.values()))
    shaped = bodies.load(first.body_name).shaped()
    clip = motions.load(CLIP).resample(FPS)[: round(SECONDS * FPS)]
    motion = shaped.untangle_motion(shaped.placed(clip))
    take = simulate(first.garment, shaped, motion, SimSettings(fps=FPS))
    frames = range(EVERY, len(motion), EVERY)
    truth = take.vertices[take.clip_frames]
    poses = [[motion[frame]] for frame in frames]
    results = produce_posed(folder, first.garment, poses, rules=HANGING, jobs=jobs)
    dataset = open_dataset(folder)
    errors: dict[str, list[float]] = {SETTLED: []}
    for frame, result in zip(frames, results, strict=True):
        if result is not None:
            at_rest = dataset.take(result.names[0]).vertices[0]
            errors[SETTLED].append(mean_distance_mm(at_rest, truth[frame]))
    for name, model in models.items():
        shown = play_clip(model, shaped, motion)
        errors[f"{name}, as shown"] = [mean_distance_mm(shown[frame], truth[frame]) for frame in frames]
    if system is not None:
        posed = {frame: shaped.posed(motion[frame]) for frame in frames}
        garments = {frame: system.drape(each) for frame, each in posed.items()}
        errors["the paper's system"] = [mean_distance_mm(garments[frame], truth[frame]) for frame in frames]
    return errors


def play_clip(model: AnimatorAgentDress, shaped: ShapedBody, motion: Motion) -> list[Vertices]:
    """Returns the garment that a player shows in each frame of a motion that is placed on the body [m]."""
    player = hemline.Player.prepare(model, shaped, placed=True)
    state, shown = player.start(motion[0]), []
    for frame in range(len(motion)):
        state, result = player.step(state, motion[frame], 1 / motion.fps)
        shown.append(np.asarray(result.vertices))
    return shown
