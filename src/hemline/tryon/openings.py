"""Tests what goes through a garment's cloth and openings, and whether openings without a limb are harmless."""

from typing import TYPE_CHECKING

import numpy as np

from hemline.arrays import Faces, Vertices
from hemline.meshes import components, face_areas, geodesic_distances
from hemline.meshes.segment_crossing_kernels import crossings_of_segments
from hemline.motions.motion import JOINT_NAMES

from .rims import Rim, rims_of
from .skeleton import Skeleton

if TYPE_CHECKING:
    from hemline.bodies import ShapedBody

EXTREMITIES = ("ankle", "foot", "wrist", "hand")
"""Joints at which a leg or sleeve that is too long lies in folds."""

CUT_OUT_JOINTS = ("spine1", "spine2", "spine3", "neck", "collar", "shoulder")
"""Joints near which an opening may be empty, such as a keyhole, an open back or an armhole below the arm."""

RIM_DISTANCE = 0.25
"""Distance from a rim within which its cloth is measured, as a fraction of the rim's length."""

HOLE_RATIO = 1.2
"""A rim is a hole, not the end of a sleeve, if the area of that cloth exceeds that of a tube by this factor."""


def joints_through_cloth(vertices: Vertices, faces: Faces, shaped: "ShapedBody") -> tuple[str, ...]:
    """Returns the names of joints from which a line inside the body at rest goes through cloth.

    Feet and hands are ignored, as a leg or sleeve that is too long lies on them in folds.
    """
    skeleton = Skeleton.of(shaped.joints)
    count = np.empty(len(skeleton.inner), np.int64)
    crossings_of_segments(skeleton.points, skeleton.inner, vertices.astype(np.float64), faces, count)
    names = dict.fromkeys(skeleton.name(int(segment)) for segment in np.flatnonzero(count))
    return tuple(name for name in names if not name.endswith(EXTREMITIES))


def empty_openings(vertices: Vertices, faces: Faces, shaped: "ShapedBody") -> tuple[str, ...]:
    """Returns the joint nearest to each opening that no limb goes through; those at hands and feet are ignored."""
    placed, skeleton = vertices.astype(np.float64), Skeleton.of(shaped.joints)
    rims = [rim.at(placed) for rim in rims_of(placed, faces)]
    return _near([rim for rim in rims if not rim.has_limb(skeleton)], shaped)


def is_worn_nowhere(vertices: Vertices, faces: Faces, shaped: "ShapedBody") -> bool:
    """Whether some piece of cloth has two openings or more, and no limb goes through any of them, hands and feet too.

    A cape or a scarf has one rim. What has sleeves or legs and lies beside the body or between the feet is not worn.
    """
    placed, skeleton = vertices.astype(np.float64), Skeleton.of(shaped.joints)
    return any(len(own) > 1 and not any(rim.has_limb(skeleton) for rim in own) for own in _rims_by_piece(placed, faces))


def openings_are_harmless(vertices: Vertices, faces: Faces, shaped: "ShapedBody") -> bool:
    r"""Whether all openings that no limb goes through are intended, and the garment is worn the right way.

    Each of them must be near the upper trunk and a hole in cloth: an area of $L d + \pi d^2$ lies within the distance
    $d$ of a rim of length $L$ in flat cloth, and $L d$ at the end of a tube. The piece of cloth with the opening must
    be around the trunk, and both arms must come out of it in the same way: each through an opening of its own, or both
    through that of the head, but not through that of the legs. An arm that is stuck ends inside, or comes out there.
    """
    placed, skeleton = vertices.astype(np.float64), Skeleton.of(shaped.joints)
    for own in _rims_by_piece(placed, faces):
        empty = [rim for rim in own if not rim.has_limb(skeleton) and _near([rim], shaped)]
        if not all(_near([rim], shaped)[0].endswith(CUT_OUT_JOINTS) and _is_hole(rim, placed, faces) for rim in empty):
            return False
        if empty and not _is_worn_right(own, skeleton):
            return False
    return True


def _rims_by_piece(placed: Vertices, faces: Faces) -> list[list[Rim]]:
    """Returns the rims of each connected piece of cloth that has any."""
    part, pieces = components(faces, len(placed)), {}
    for rim in rims_of(placed, faces):
        pieces.setdefault(int(part[rim.loop[0]]), []).append(rim.at(placed))
    return [pieces[piece] for piece in sorted(pieces)]


def _near(rims: list[Rim], shaped: "ShapedBody") -> tuple[str, ...]:
    """Returns the joint nearest to the centre of each rim; those at hands and feet are ignored."""
    centres = [rim.points[-1] for rim in rims]
    names = [JOINT_NAMES[int(np.linalg.norm(shaped.joints - centre, axis=1).argmin())] for centre in centres]
    return tuple(name for name in names if not name.endswith(EXTREMITIES))


def _is_hole(rim: Rim, placed: Vertices, faces: Faces) -> bool:
    distance = RIM_DISTANCE * rim.length
    away = geodesic_distances(placed, faces, rim.loop)[faces].mean(axis=1)
    return float(face_areas(placed, faces)[away < distance].sum()) > HOLE_RATIO * rim.length * distance


def _is_worn_right(rims: list[Rim], skeleton: Skeleton) -> bool:
    """Whether trunk and arms come out of a piece of cloth the right way, by the openings that each goes through."""
    crossed = np.array([rim.crossings(skeleton) for rim in rims]) % 2
    crown, left, right, *feet = (
        (crossed @ skeleton.path(end) % 2).tolist()
        for end in ("crown", "left_hand", "right_hand", "left_foot", "right_foot")
    )
    outside = sum(crown) % 2
    around = crown not in feet and left not in feet and right not in feet
    out = sum(left) % 2 == sum(right) % 2 == outside
    alike = left == right == crown or (left != right and crown not in (left, right))
    return around and out and alike
