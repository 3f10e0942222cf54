"""The features of a vertex, column by column: the one table that features, mirror images and networks are laid out by.

`DYNAMIC` lists the features that change from frame to frame, in the order in which `feature_kernels.describe` and then
`Beginning.features` write them; `STATIC` lists those that do not change. All vectors are in the rotated frame of the
vertex.
"""

from itertools import accumulate
from typing import NamedTuple

import numpy as np

from hemline.arrays import Float, Int
from hemline.motions.motion import JOINT_NAMES

from .memory import LAGS, SWINGS

BODY_PARTS = ("trunk", "left arm", "right arm", "left leg", "right leg")
"""Parts of the body whose nearness is a feature of each vertex."""
JOINTS = (
    *("pelvis", "spine2", "neck", "left_hip", "right_hip", "left_knee", "right_knee", "left_ankle", "right_ankle"),
    *("left_shoulder", "right_shoulder", "left_elbow", "right_elbow"),
)
"""Names of the joints whose positions are features of each vertex."""
FEATURE_JOINTS = tuple(JOINT_NAMES.index(name) for name in JOINTS)
"""Indices of these joints."""

SCALAR, VECTOR = np.array([1], np.float32), np.array([-1, 1, 1], np.float32)
"""Signs of a number and of a vector in a mirrored frame."""
SCALED_DIRECTION = np.concatenate([SCALAR, VECTOR])
"""Signs of a number followed by a vector in a mirrored frame."""
FADED_VECTOR = np.concatenate([VECTOR, SCALAR])
"""Signs of a vector followed by a number in a mirrored frame."""


class Feature(NamedTuple):
    """One feature: a few columns for each of some things."""

    name: str
    """Name of the feature."""
    things: tuple[str, ...]
    """Things of which it is known, one after the other. In a mirror, left ones and right ones change places."""
    signs: Float[np.ndarray, " columns"]
    """Signs of the columns of one thing in a mirrored frame: `SCALAR`, `VECTOR` or those of both."""

    @property
    def width(self) -> int:
        """Number of columns."""
        return len(self.things) * len(self.signs)

    def mirror(self) -> Int[np.ndarray, " columns"]:
        """Returns the column that takes the place of each one in a mirror."""
        names = [name.replace("_", " ") for name in self.things]
        other = {"left": "right", "right": "left"}
        opposite = [names.index(" ".join(other.get(word, word) for word in name.split())) for name in names]
        return np.arange(self.width).reshape(len(names), -1)[opposite].ravel()


class FeatureTable:
    """Features side by side. `table[name]` is the slice of columns of a feature, `table.count` the number of all.

    Args:
        features: The features in order, of different names.
    """

    def __init__(self, *features: Feature):
        self.features = features
        ends = list(accumulate(each.width for each in features))
        self.count = ends[-1]
        self._columns = {each.name: slice(end - each.width, end) for each, end in zip(features, ends, strict=True)}

    def __getitem__(self, name: str) -> slice:
        return self._columns[name]

    def named(self, *names: str) -> tuple[Feature, ...]:
        """Returns the features of some names, in the order of the names."""
        found = {each.name: each for each in self.features}
        return tuple(found[name] for name in names)

    def mirror(self) -> tuple[Int[np.ndarray, " columns"], Float[np.ndarray, " columns"]]:
        """Returns order and signs of mirrored features: mirrored = features[..., order] * signs."""
        order = [self[each.name].start + each.mirror() for each in self.features]
        signs = [np.tile(each.signs, len(each.things)) for each in self.features]
        return np.concatenate(order), np.concatenate(signs)


_FILTERS = (
    *(f"lag {tau:g}" for tau in LAGS),
    *(f"swing {omega:g} {what}" for omega, _ in SWINGS for what in ("trail", "velocity")),
)
DYNAMIC = FeatureTable(
    Feature("skinned trail", _FILTERS, VECTOR),
    Feature("carried trail", _FILTERS, VECTOR),
    Feature("carried", ("offset",), VECTOR),
    Feature("gravity", ("direction",), VECTOR),
    Feature("nearness", BODY_PARTS, SCALED_DIRECTION),
    Feature("carried nearness", BODY_PARTS, SCALED_DIRECTION),
    Feature("joints", JOINTS, VECTOR),
    Feature("beginning", ("faded offset, factor",), FADED_VECTOR),
)
"""Features that change: how filters of the skinned vertex trail behind it, and of the vertex carried rigidly with the
key joint; the offset of the carried vertex from the skinned one; the direction of gravity; what parts of the body are
near to the skinned vertex and to the carried one; positions of joints against those at rest; and how the vertex lay
when the network took over, with the factor by which this has faded."""
STATIC = FeatureTable(
    Feature("normal", ("direction",), VECTOR),
    Feature("to rim", ("along cloth",), SCALAR),
    Feature("from skin", ("direction",), VECTOR),
    Feature("gaps", ("to skin, near", "to skin, far", "along cloth to skin"), SCALAR),
    Feature("position", ("from key joint",), VECTOR),
    Feature("skin weights", JOINT_NAMES, SCALAR),
)
"""Features that do not change: normal, distance along the cloth to its rim, direction away from the skin, distances to
the skin through the air and along the cloth, position relative to the key joint, skin weights."""
