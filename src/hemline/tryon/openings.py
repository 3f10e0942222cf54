"""What goes through a garment's cloth and openings, and whether an opening may be left without a limb."""

from typing import TYPE_CHECKING

import numpy as np

from hemline.arrays import Faces, Vertices
from hemline.meshes import components, face_areas, geodesic_distances
from hemline.motions.motion import JOINT_NAMES

from .crossing_segment_kernels import crossings_of_segments
from .rims import Rim, rims_of
from .skeleton import Skeleton

if TYPE_CHECKING:
    from hemline.bodies import ShapedBody

ENDS = ("ankle", "foot", "wrist", "hand")
"""Where too long a leg or sleeve lies in folds."""

CUT_OUT = ("spine1", "spine2", "spine3", "neck", "collar", "shoulder")
"""Joints near which an opening may be empty: a keyhole, an open back, an armhole below the arm."""

NEAR, ROUND = 0.25, 1.2
"""How far from a rim its cloth is measured, as a share of the rim's length; the area found there over that of a tube,
from which on the rim is a hole in cloth and not the end of a sleeve."""


def pierced(vertices: Vertices, faces: Faces, shaped: "ShapedBody") -> tuple[str, ...]:
    """Names of the joints from which a line inside the body, at rest, goes through cloth; feet and hands apart, on
    which too long a leg or sleeve lies in folds.
    """
    skeleton = Skeleton.of(shaped.joints)
    count = np.empty(len(skeleton.inner), np.int64)
    crossings_of_segments(skeleton.points, skeleton.inner, vertices.astype(np.float64), faces, count)
    names = dict.fromkeys(skeleton.name(int(segment)) for segment in np.flatnonzero(count))
    return tuple(name for name in names if not name.endswith(ENDS))


def unused(vertices: Vertices, faces: Faces, shaped: "ShapedBody") -> tuple[str, ...]:
    """Of each opening that no limb goes through, the joint that is nearest to it; beyond hands and feet it may lie."""
    placed, skeleton = vertices.astype(np.float64), Skeleton.of(shaped.joints)
    rims = [rim.at(placed) for rim in rims_of(placed, faces)]
    return _near([rim for rim in rims if not rim.passed(skeleton)], shaped)


def harmless(vertices: Vertices, faces: Faces, shaped: "ShapedBody") -> bool:
    r"""Whether all openings that no limb goes through may be so, as the garment is worn as it is meant.

    Each of them must be near the upper trunk and a hole in cloth: around a rim of length $L$ in flat cloth,
    $L d + \pi d^2$ lie within the distance $d$, around the end of a tube $L d$. And the piece of cloth that has it must
    be around the trunk, with both arms out of it alike: each by an opening of its own or both beside the head, and not
    where the legs are. An arm that is stuck inside ends inside, or comes out with the legs.
    """
    placed, skeleton = vertices.astype(np.float64), Skeleton.of(shaped.joints)
    rims, part = [rim.at(placed) for rim in rims_of(placed, faces)], components(faces, len(vertices))
    for piece in np.unique([part[rim.loop[0]] for rim in rims]):
        own = [rim for rim in rims if part[rim.loop[0]] == piece]
        empty = [rim for rim in own if not rim.passed(skeleton) and _near([rim], shaped)]
        if not all(_near([rim], shaped)[0].endswith(CUT_OUT) and _is_hole(rim, placed, faces) for rim in empty):
            return False
        if empty and not _worn_as_meant(own, skeleton):
            return False
    return True


def _near(rims: list[Rim], shaped: "ShapedBody") -> tuple[str, ...]:
    """The joint nearest to the centre of each rim; those beyond hands and feet are left out."""
    centres = [rim.points[-1] for rim in rims]
    names = [JOINT_NAMES[int(np.linalg.norm(shaped.joints - centre, axis=1).argmin())] for centre in centres]
    return tuple(name for name in names if not name.endswith(ENDS))


def _is_hole(rim: Rim, placed: Vertices, faces: Faces) -> bool:
    reach = NEAR * rim.length
    away = geodesic_distances(placed, faces, rim.loop)[faces].mean(axis=1)
    return float(face_areas(placed, faces)[away < reach].sum()) > ROUND * rim.length * reach


def _worn_as_meant(rims: list[Rim], skeleton: Skeleton) -> bool:
    """Whether trunk and arms come out of a piece of cloth as they should, by the openings that each goes through."""
    crossed = np.array([rim.crossings(skeleton) for rim in rims]) % 2
    crown, left, right, *feet = (
        (crossed @ skeleton.way(end) % 2).tolist()
        for end in ("crown", "left_hand", "right_hand", "left_foot", "right_foot")
    )
    outside = sum(crown) % 2
    around = crown not in feet and left not in feet and right not in feet
    out = sum(left) % 2 == sum(right) % 2 == outside
    alike = left == right == crown or (left != right and crown not in (left, right))
    return around and out and alike
