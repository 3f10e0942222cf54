"""Reading of ropes from the arrays of a model file, which are checked before anything runs."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from hemline.animators.ropes.mechanics.constants import RopeConstants
from hemline.animators.ropes.mechanics.dynamics import RopeChains
from hemline.collide.primitives.body_primitives import BodyPrimitives
from hemline.errors import BadModel
from hemline.files.contents import AGAIN, array_of, entry
from hemline.motions import JOINT_NAMES
from hemline.options import options_of

from .chains import Ropes
from .embedding import Carriage, NodeEmbedding


def read_ropes(arrays: Mapping[str, np.ndarray], metadata: Mapping[str, Any]) -> Ropes:
    """Reads the ropes that `Ropes.arrays` and `Ropes.metadata` wrote; other keys are ignored.

    Raises:
        BadModel: An entry is missing, of another type or shape, or an index is out of range.
    """
    key = entry(metadata, "key_joint", str)
    _check(key in JOINT_NAMES, "ropes need a key joint", repr(key))
    constants = options_of(RopeConstants, entry(metadata, "constants", dict), "rope constant", error=BadModel)
    offsets = array_of(arrays, "offsets", "int32", (None,))
    _check(
        len(offsets) > 0 and offsets[0] >= 0 and bool((np.diff(offsets) >= 2).all()),
        "chains need two nodes or more",
        offsets.tolist()[:20],
    )
    nodes, count = int(offsets[-1]), len(offsets) - 1
    pairs = _indices(arrays, "pairs", (None, 2), nodes)
    values = {name: _numbers(arrays, name, nodes) for name in ("lengths", "masses", "rest_spans", "clearances")}
    chains = RopeChains(
        offsets=offsets,
        pairs=pairs,
        rest_directions=_numbers(arrays, "rest_directions", nodes, 3),
        chain_joints=_indices(arrays, "chain_joints", (count,), len(JOINT_NAMES)),
        pair_spans=_numbers(arrays, "pair_spans", len(pairs), 2),
        balance=_numbers(arrays, "balance", nodes, 3),
        rest_tensions=_numbers(arrays, "rest_tensions", nodes),
        constants=constants,
        **values,
    )
    free = chains.parents >= 0
    _check(
        bool((chains.lengths[free] > 0).all() and (chains.masses[free] > 0).all()),
        "ropes need positive lengths and masses",
        "zero or less",
    )
    kin = len(chains.kinematic)
    embedding = NodeEmbedding(_indices(arrays, "corners", (nodes, 3), None), _numbers(arrays, "barycentric", nodes, 3))
    carriage = Carriage(
        _numbers(arrays, "carriage_rest", kin, 3),
        _numbers(arrays, "carriage_weights", kin, len(JOINT_NAMES)),
        _indices(arrays, "carriage_nearest", (kin,), None),
        _numbers(arrays, "carriage_nearest_rest", kin, 3),
    )
    primitives = BodyPrimitives.of(arrays, metadata)
    _check(
        len(primitives.pivots) == len(JOINT_NAMES), f"primitives need {len(JOINT_NAMES)} pivots", len(primitives.pivots)
    )
    rest, betas = _numbers(arrays, "rest", nodes, 3), _numbers(arrays, "betas", None)
    return Ropes(chains, embedding, carriage, rest, primitives, betas, key)


def _numbers(arrays: Mapping[str, np.ndarray], name: str, *shape: int | None) -> np.ndarray:
    return array_of(arrays, name, "float64", shape)


def _indices(
    arrays: Mapping[str, np.ndarray], name: str, shape: tuple[int | None, ...], limit: int | None
) -> np.ndarray:
    array = array_of(arrays, name, "int32", shape)
    high = np.iinfo(np.int32).max if limit is None else limit
    inside = array.size == 0 or (array.min() >= 0 and array.max() < high)
    _check(bool(inside), f"rope array '{name}' must count from 0 to {high - 1}", "an index outside")
    return array


def _check(right: bool, what: str, got: object) -> None:
    if not right:
        raise BadModel(what, got, AGAIN)
