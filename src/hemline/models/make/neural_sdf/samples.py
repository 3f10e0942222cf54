"""Points around random bodies in poses of clips, with their exact distances: what a neural distance is trained on."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hemline.arrays import Float, Points, Quaternions
from hemline.bodies import Body, PosedBody, ShapedBody
from hemline.collide.neural_sdf.exact import ExactDistance
from hemline.datasets.split import FRACTIONS, split_by
from hemline.errors import BadDataset
from hemline.files import read_tensors, write_tensors
from hemline.meshes import face_areas, face_normals
from hemline.motions import Motion, Pose, read
from hemline.motions.quaternions import inverse
from hemline.motions.subjects import subject_of

POINTS = 1500
"""Points around each posed body."""
NEAR, APART, DEEP = 0.45, 0.25, 0.15
"""Shares of points within millimetres of the skin, where garments are, and inside; the rest is even in a box."""
CLOSE = 0.008
"""Standard deviation of the distance of the first of these [m]."""
GARMENT = -0.03, 0.15
"""Range of the distance of the second along the normal [m]; they are also moved about by a centimetre."""
DEEPEST = -0.08
"""Lowest offset of the third along the normal [m]."""
MARGIN = 0.2
"""Of the box, beyond the body [m]."""
BETAS = 2.5
"""Largest coefficient of the random bodies; they are drawn with a standard deviation of 1.2."""
SHARD = 100
"""Bodies in a file."""


@dataclass(frozen=True, eq=False)
class Samples:
    """Posed bodies and points around each of them, in the frame of its pelvis."""

    betas: Float[np.ndarray, "bodies betas"]
    """Shapes, float32."""
    rotations: Float[np.ndarray, "bodies joints 4"]
    """Poses, float32."""
    points: Float[np.ndarray, "bodies points 3"]
    """Where, in the frame of `pelvis_frame` [m], float32."""
    distances: Float[np.ndarray, "bodies points"]
    """Exact signed distances [m], float32."""
    gradients: Float[np.ndarray, "bodies points 3"]
    """Their gradients in the same frame, float16."""

    def arrays(self) -> dict[str, np.ndarray]:
        """All arrays by name."""
        return {name: getattr(self, name) for name in self.__dataclass_fields__}


def clips_by_side(folder: Path) -> dict[str, list[Motion]]:
    """The clips of a folder for training, validation and test; a subject is on one side only.

    Raises:
        BadDataset: There are fewer than three clips.
    """
    files = sorted(folder.rglob("*.bvh"))
    if len(files) < 3:
        cure = "name a folder with BVH clips of at least three subjects"
        raise BadDataset(f"clips of {folder} cannot be split by subject", f"{len(files)} BVH files", cure)
    clips = [read(file) for file in files]
    subjects = [subject_of(file.stem) for file in files]
    return split_by(clips, subjects, [len(clip) for clip in clips], FRACTIONS)


def produce(folder: Path, body: Body, clips: Callable[[], Sequence[Motion]], count: int, seed: int) -> list[Samples]:
    """Samples of `count` random bodies in random frames of clips, in files of a hundred; what is there is read.

    Args:
        folder: Where the files are kept.
        body: The body.
        clips: Gives the clips to take poses from, each as often as the other; asked where something is missing.
        count: Bodies; rounded up to whole files.
        seed: Of everything that is drawn.

    Raises:
        BadDataset: A file there is damaged, or of another body.
    """
    shards = []
    for number in range(-(-count // SHARD)):
        path = folder / f"{number:03d}.safetensors"
        if not path.exists():
            shard = made(body, clips(), SHARD, np.random.default_rng((seed, number)))
            write_tensors(path, shard.arrays(), {"kind": "distances", "body_hash": body.hash})
        arrays, metadata = read_tensors(path, "distances", error=BadDataset)
        if metadata["body_hash"] != body.hash:
            raise BadDataset(f"{path} was made for another body", metadata["body_hash"], "name another folder")
        shards.append(Samples(**arrays))
    return shards


def made(
    body: Body, clips: Sequence[Motion], count: int, random: np.random.Generator, *, largest: float = BETAS
) -> Samples:
    """Samples of `count` bodies, drawn anew; betas are drawn in proportion to `largest`."""
    betas = np.clip(random.normal(0, 0.48 * largest, (count, len(body.shapedirs))), -largest, largest)
    betas, rotations, rows = betas.astype(np.float32), [], []
    for each in betas:
        clip = clips[int(random.integers(len(clips)))]
        rotations.append(clip.rotations[random.integers(len(clip))])
        shaped = body.shaped(each)
        rows.append(around(shaped.posed(in_pelvis_frame(shaped, rotations[-1])), random))
    points, distances, gradients = (np.stack(column) for column in zip(*rows, strict=True))
    return Samples(
        betas,
        np.stack(rotations),
        points.astype(np.float32),
        distances.astype(np.float32),
        gradients.astype(np.float16),
    )


def in_pelvis_frame(shaped: ShapedBody, rotations: Quaternions) -> Pose:
    """The pose whose pelvis is where it is at rest: the frame of the pelvis is then the world."""
    still = np.array(rotations, np.float32)
    still[0] = inverse(shaped.body.rest_offsets[0])
    return Pose(still, shaped.joints[0])


def around(
    posed: PosedBody, random: np.random.Generator
) -> tuple[Points, Float[np.ndarray, " points"], Float[np.ndarray, "points 3"]]:
    """Points around one body, their exact distances [m] and gradients."""
    vertices, faces = posed.vertices.astype(np.float64), posed.faces
    near, apart, deep = (round(share * POINTS) for share in (NEAR, APART, DEEP))
    areas = face_areas(vertices, faces)
    face = random.choice(len(faces), near + apart + deep, p=areas / areas.sum())
    weights = random.dirichlet(np.ones(3), len(face))
    skin = np.einsum("pc,pcx->px", weights, vertices[faces[face]])
    offsets = np.concatenate(
        [random.normal(0, CLOSE, near), random.uniform(*GARMENT, apart), random.uniform(DEEPEST, 0, deep)]
    )
    skin += offsets[:, None] * face_normals(vertices, faces)[face]
    skin[near : near + apart] += random.normal(0, 0.01, (apart, 3))
    low, high = vertices.min(axis=0) - MARGIN, vertices.max(axis=0) + MARGIN
    points = np.concatenate([skin, random.uniform(low, high, (POINTS - len(skin), 3))])
    return points, *ExactDistance.of(posed).with_gradients(points)
