"""A small garment and takes of it: plain arrays, no simulation."""

import numpy as np

from hemline.datasets import Take
from hemline.garments.garment import Garment
from hemline.garments.material import MATERIALS
from hemline.garments.pins import Pins
from hemline.motions.motion import Motion


def make_garment(size: float = 1.0) -> Garment:
    vertices = size * np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]], np.float32)
    faces = np.array([[0, 1, 2], [1, 3, 2]], np.int32)
    edges = np.stack([np.eye(2), np.array([[0.0, -1.0], [1.0, 1.0]])]) * size
    one = np.zeros(1, np.int32)
    pins = Pins(one, one, np.array([[1, 0, 0]], np.float32), np.array([0.002], np.float32))
    return Garment("square", vertices, faces, edges, MATERIALS["cotton"], pins, "neck")


def make_take(garment: Garment, clip: str = "02_01", part: int = 0, frames: int = 6, seed: int = 0) -> Take:
    rng = np.random.default_rng(seed)
    rotations = np.tile(np.array([1, 0, 0, 0], np.float32), (frames, 24, 1))
    motion = Motion(rotations, np.zeros((frames, 3), np.float32), fps=30, leg_length=0.9, name=clip, source="test")
    return Take(
        kind="clip",
        # beside the body, and not torn: a fit does not leave it out
        vertices=(garment.vertices + [10, 0, 0] + rng.normal(0, 0.1, (frames, 4, 3))).astype(np.float32),
        motion=motion,
        betas=np.zeros(16, np.float32),
        lead_in=np.arange(frames) < 2,
        pinched=np.zeros(frames, np.int32),
        figures={"edge_strain_p99": 0.01},
        end_state={"velocities": rng.normal(0, 1, (4, 3))},
        inputs={"garment": garment.hash, "clip": clip, "subject": clip.split("_")[0], "part": part, "seed": seed},
    )
