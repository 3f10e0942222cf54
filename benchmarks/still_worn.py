"""Whether a garment is still worn while the body moves: limbs go through its openings and not through its cloth.

No vertex of the cloth need be inside the body for a leg to stand beside its trousers. The body is taken as the lines of
its skeleton (`hemline.tryon`): those that go through an opening at the start of a take must do so later, and none may
go through cloth, but where the pose is so folded that the skin itself cuts the line.
"""

from typing import NamedTuple

import numpy as np

from hemline.datasets import Take
from hemline.garments import Garment
from hemline.motions.motion import JOINT_NAMES
from hemline.tryon.crossing_segment_kernels import crossings_of_segments
from hemline.tryon.rims import rims_of
from hemline.tryon.skeleton import Skeleton


class StillWorn(NamedTuple):
    """What became of a garment in a take.

    Attributes:
        lost: The frame looked at from which on, to the end, no limb goes through an opening that was used at first, and
            the joint near it then; None: there is none. For a while one may, as in a squat the feet are in the skirt.
        through_percent: Frames looked at in which a limb goes through cloth [percent].
        at_end: The last of them and the joint that such a limb begins at, where one does there; else None.
    """

    lost: tuple[int, str] | None
    through_percent: float
    at_end: tuple[int, str] | None


def still_worn(take: Take, garment: Garment, shaped, every: int) -> StillWorn:
    """Look at every so many frames of a take."""
    rims = rims_of(garment.vertices, garment.faces)
    since: list[tuple[int, str] | None] = [None] * len(rims)
    used, through, at_end = None, [], None
    for frame in range(0, len(take.vertices), every):
        posed = shaped.posed(take.motion[frame])
        skeleton, cloth = Skeleton.of(posed.joints), take.vertices[frame].astype(np.float64)
        placed = [rim.at(cloth) for rim in rims]
        passed = [rim.passed(skeleton) for rim in placed]
        used = passed if used is None else used
        for number, (rim, now, before) in enumerate(zip(placed, passed, used, strict=True)):
            if now or not before:
                since[number] = None
            elif since[number] is None:
                near = np.linalg.norm(posed.joints - rim.points[-1], axis=1).argmin()
                since[number] = frame, JOINT_NAMES[int(near)]
        cut = _crossed(skeleton, cloth, garment.faces) & ~_crossed(skeleton, posed.vertices, posed.faces)
        through.append(bool(cut.any()))
        at_end = (frame, JOINT_NAMES[int(skeleton.limbs[cut.argmax(), 0])]) if cut.any() else None
    lost = min((each for each in since if each is not None), default=None)
    return StillWorn(lost, 100 * float(np.mean(through)), at_end)


def _crossed(skeleton: Skeleton, vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Which limbs of the skeleton go through a mesh; the last ones end outside of the body's."""
    count = np.empty(len(skeleton.limbs), np.int64)
    crossings_of_segments(skeleton.points, skeleton.limbs, vertices.astype(np.float64), faces, count)
    return count > 0
