"""Checks that a garment stays on while the body moves: limbs pass through its openings and not through its cloth.

A leg may leave its trousers without any vertex of the cloth inside the body. The body is represented by the lines of
its skeleton (`hemline.tryon`). Lines that pass through an opening at the start of a take must do so later, and no line
may pass through cloth, except where the pose is so folded that the line leaves the skin.
"""

from typing import NamedTuple

import numpy as np

from hemline.datasets import Take
from hemline.garments import Garment
from hemline.meshes.segment_crossing_kernels import crossings_of_segments
from hemline.motions.motion import JOINT_NAMES
from hemline.tryon.rims import rims_of
from hemline.tryon.skeleton import Skeleton


class WearCheck(NamedTuple):
    """Result of the check of a take.

    Attributes:
        lost: First checked frame from which no limb passes through an opening until the end, although one did at the
            start, and the joint near the opening; None if there is none. (In a squat the feet leave it for a while.)
        through_percent: Checked frames in which a limb passes through cloth [percent].
        at_end: The last checked frame and the first joint of a limb that passes through cloth there, or None.
    """

    lost: tuple[int, str] | None
    through_percent: float
    at_end: tuple[int, str] | None


def check_wear(take: Take, garment: Garment, shaped, every: int) -> WearCheck:
    """Checks every `every`-th frame of a take."""
    rims = rims_of(garment.vertices, garment.faces)
    since: list[tuple[int, str] | None] = [None] * len(rims)
    used, through, at_end = None, [], None
    for frame in range(0, len(take.vertices), every):
        posed = shaped.posed(take.motion[frame])
        skeleton, cloth = Skeleton.of(posed.joints), take.vertices[frame].astype(np.float64)
        placed = [rim.at(cloth) for rim in rims]
        passed = [rim.has_limb(skeleton) for rim in placed]
        used = passed if used is None else used
        for number, (rim, now, before) in enumerate(zip(placed, passed, used, strict=True)):
            if now or not before:
                since[number] = None
            elif since[number] is None:
                near = np.linalg.norm(posed.joints - rim.points[-1], axis=1).argmin()
                since[number] = frame, JOINT_NAMES[int(near)]
        cut = _crossing_limbs(skeleton, cloth, garment.faces) & ~_crossing_limbs(skeleton, posed.vertices, posed.faces)
        through.append(bool(cut.any()))
        at_end = (frame, JOINT_NAMES[int(skeleton.limbs[cut.argmax(), 0])]) if cut.any() else None
    lost = min((each for each in since if each is not None), default=None)
    return WearCheck(lost, 100 * float(np.mean(through)), at_end)


def _crossing_limbs(skeleton: Skeleton, vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Returns a mask of the limbs that pass through a mesh; the last limbs end outside the skin."""
    count = np.empty(len(skeleton.limbs), np.int64)
    crossings_of_segments(skeleton.points, skeleton.limbs, vertices.astype(np.float64), faces, count)
    return count > 0
