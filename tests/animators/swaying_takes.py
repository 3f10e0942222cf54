"""Datasets of small garments that sway by a formula: each vertex trails where skinning puts it, the more the lower."""

from collections.abc import Sequence
from functools import cache
from pathlib import Path

import numpy as np

from hemline import bodies, garments, motions
from hemline.animators.coarse.features.trail import Trail
from hemline.animators.coarse.proxy_on_body import ProxyOnBody
from hemline.datasets import Dataset, Take, create
from hemline.garments import Garment, coarser_garment
from hemline.motions.motion import Motion

SMALL = {"cape-light": 0.06, "skirt-light": 0.06, "tshirt-light": 0.08, "dress-light": 0.06}
CLIPS = ("walk", "run", "kick", "dance")
FRAMES = 24


@cache
def small(name: str) -> Garment:
    return coarser_garment(garments.load(name), SMALL[name])[0]


def swaying(folder: Path, name: str, clips: Sequence[str] = CLIPS) -> Dataset:
    """Takes of a garment in clips, each of another subject, on the mean body."""
    body = bodies.load("anny24").shaped()
    garment = small(name)
    dataset = create(folder, garment)
    still = Motion(
        body.rest_pose.rotations[None], body.rest_pose.translation[None], fps=30.0, leg_length=body.leg_length
    )
    proxy = ProxyOnBody.of(garment, garment.vertices, body)
    dataset.add(_take("rest", garment.vertices[None], still, body, garment, "", ""))
    for clip in clips:
        motion = body.placed(motions.load(clip))[30 : 30 + FRAMES]
        trail, vertices = Trail.start(proxy, body.posed(motion[0])), []
        depth = np.clip(1.4 - garment.vertices[:, 1:2], 0, 1)
        for frame in range(FRAMES):
            posed = body.posed(motion[frame])
            trail = trail.advance(proxy, posed, 1 / 30) if frame else trail
            vertices.append(trail.skinned + depth * trail.trails[:, 1])
        dataset.add(_take("clip", np.array(vertices, np.float32), motion, body, garment, clip, f"subject of {clip}"))
    return dataset


def _take(kind, vertices, motion, body, garment, clip, subject) -> Take:
    inputs = {"garment": garment.hash, "body": body.body.hash, "betas": [float(b) for b in body.betas], "clip": clip}
    return Take(
        kind=kind,
        vertices=vertices,
        motion=motion,
        betas=body.betas,
        lead_in=np.zeros(len(motion), bool),
        pinched=np.zeros(len(motion), np.int32),
        figures={},
        inputs=inputs | {"subject": subject, "part": 0, "settings": {"air_density": 1.2}},
    )
