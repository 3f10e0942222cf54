"""Samples points around random posed bodies with exact distances, the training data of the neural distance."""

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
SKIN_FRACTION, GARMENT_FRACTION, INSIDE_FRACTION = 0.45, 0.25, 0.15
"""Fractions of points close to the skin, where garments are, and inside; the rest is uniform in a box."""
SKIN_DEVIATION = 0.008
"""Standard deviation of the distance of the points close to the skin [m]."""
GARMENT_RANGE = -0.03, 0.15
"""Range of the offset of garment points along the normal [m], before they are jittered by a centimetre."""
MIN_OFFSET = -0.08
"""Lowest offset of inside points along the normal [m]."""
BOX_MARGIN = 0.2
"""Distance of the box from the body [m]."""
MAX_BETA = 2.5
"""Largest shape coefficient of the random bodies, whose standard deviation is 1.2."""
SHARD = 100
"""Number of bodies per file."""


@dataclass(frozen=True, eq=False)
class DistanceSamples:
    """Posed bodies and points around each of them, in the frame of its pelvis."""

    betas: Float[np.ndarray, "bodies betas"]
    """Shape coefficients, float32."""
    rotations: Float[np.ndarray, "bodies joints 4"]
    """Local joint rotations, float32."""
    points: Float[np.ndarray, "bodies points 3"]
    """Positions in the frame of the pelvis [m], float32."""
    distances: Float[np.ndarray, "bodies points"]
    """Exact signed distances [m], float32."""
    gradients: Float[np.ndarray, "bodies points 3"]
    """Gradients of the distances in the same frame, float16."""

    def arrays(self) -> dict[str, np.ndarray]:
        """Returns all arrays by name."""
        return {name: getattr(self, name) for name in self.__dataclass_fields__}


def clips_by_side(folder: Path) -> dict[str, list[Motion]]:
    """Splits the clips of a folder into training, validation and test, each subject in one of them only.

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


def produce_samples(
    folder: Path, body: Body, clips: Callable[[], Sequence[Motion]], count: int, seed: int
) -> list[DistanceSamples]:
    """Returns samples of random bodies in random frames of clips, and stores them in files of a hundred bodies.

    Args:
        folder: Folder of the files; existing files are read.
        body: The body.
        clips: Returns the clips to take poses from, all equally often; called only if a file is missing.
        count: Number of bodies, rounded up to whole files.
        seed: Seed of bodies, poses and points.

    Raises:
        BadDataset: A file is damaged, or of another body.
    """
    shards = []
    for number in range(-(-count // SHARD)):
        path = folder / f"{number:03d}.safetensors"
        if not path.exists():
            shard = sample_bodies(body, clips(), SHARD, np.random.default_rng((seed, number)))
            write_tensors(path, shard.arrays(), {"kind": "distances", "body_hash": body.hash})
        arrays, metadata = read_tensors(path, "distances", error=BadDataset)
        if metadata["body_hash"] != body.hash:
            raise BadDataset(f"{path} was made for another body", metadata["body_hash"], "name another folder")
        shards.append(DistanceSamples(**arrays))
    return shards


def sample_bodies(
    body: Body, clips: Sequence[Motion], count: int, random: np.random.Generator, *, largest: float = MAX_BETA
) -> DistanceSamples:
    """Samples points around `count` random bodies, with betas in proportion to `largest`."""
    betas = np.clip(random.normal(0, 0.48 * largest, (count, len(body.shapedirs))), -largest, largest)
    betas, rotations, rows = betas.astype(np.float32), [], []
    for coefficients in betas:
        clip = clips[int(random.integers(len(clips)))]
        rotations.append(clip.rotations[random.integers(len(clip))])
        shaped = body.shaped(coefficients)
        rows.append(sample_points(shaped.posed(in_pelvis_frame(shaped, rotations[-1])), random))
    points, distances, gradients = (np.stack(column) for column in zip(*rows, strict=True))
    return DistanceSamples(
        betas,
        np.stack(rotations),
        points.astype(np.float32),
        distances.astype(np.float32),
        gradients.astype(np.float16),
    )


def in_pelvis_frame(shaped: ShapedBody, rotations: Quaternions) -> Pose:
    """Returns the pose with the pelvis at its place at rest, so that the frame of the pelvis is the world."""
    still = np.array(rotations, np.float32)
    still[0] = inverse(shaped.body.rest_offsets[0])
    return Pose(still, shaped.joints[0])


def sample_points(
    posed: PosedBody, random: np.random.Generator
) -> tuple[Points, Float[np.ndarray, " points"], Float[np.ndarray, "points 3"]]:
    """Samples points around one body; returns them with exact distances [m] and gradients."""
    vertices, faces = posed.vertices.astype(np.float64), posed.faces
    near, apart, deep = (round(fraction * POINTS) for fraction in (SKIN_FRACTION, GARMENT_FRACTION, INSIDE_FRACTION))
    areas = face_areas(vertices, faces)
    face = random.choice(len(faces), near + apart + deep, p=areas / areas.sum())
    weights = random.dirichlet(np.ones(3), len(face))
    skin = np.einsum("pc,pcx->px", weights, vertices[faces[face]])
    offsets = np.concatenate(
        [
            random.normal(0, SKIN_DEVIATION, near),
            random.uniform(*GARMENT_RANGE, apart),
            random.uniform(MIN_OFFSET, 0, deep),
        ]
    )
    skin += offsets[:, None] * face_normals(vertices, faces)[face]
    skin[near : near + apart] += random.normal(0, 0.01, (apart, 3))
    low, high = vertices.min(axis=0) - BOX_MARGIN, vertices.max(axis=0) + BOX_MARGIN
    points = np.concatenate([skin, random.uniform(low, high, (POINTS - len(skin), 3))])
    return points, *ExactDistance.of(posed).with_gradients(points)
