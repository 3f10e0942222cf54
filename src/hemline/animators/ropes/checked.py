"""Ropes out of arrays that a file held: checked before anything runs."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from hemline.collide.primitives.proxy import BodyProxy
from hemline.errors import BadModel
from hemline.motions import JOINT_NAMES

from .constants import RopeConstants
from .dynamics import RopeChains
from .embedding import Carriage, Embedding

if TYPE_CHECKING:
    from .chains import Ropes

_CURE = "make the file again"


def checked_ropes(kind: "type[Ropes]", arrays: Mapping[str, np.ndarray], metadata: Mapping[str, Any]) -> "Ropes":
    """The ropes that `Ropes.arrays` and `Ropes.metadata` gave.

    Raises:
        BadModel: Something is missing, of the wrong shape, or points to what is not there.
    """
    key, constants = metadata.get("key_joint"), metadata.get("constants")
    _check(key in JOINT_NAMES, "ropes need a key joint", key)
    _check(isinstance(constants, Mapping), "ropes need constants", type(constants).__name__)
    offsets = _array(arrays, "offsets", (-1,), np.int32)
    _check(
        len(offsets) > 0 and offsets[0] >= 0 and bool((np.diff(offsets) >= 2).all()),
        "chains need two nodes or more",
        offsets.tolist()[:20],
    )
    nodes, count = int(offsets[-1]), len(offsets) - 1
    pairs = _indices(arrays, "pairs", (-1, 2), nodes)
    values = {name: _array(arrays, name, (nodes,)) for name in ("lengths", "masses", "rest_spans", "clearances")}
    chains = RopeChains(
        offsets=offsets,
        pairs=pairs,
        rest_directions=_array(arrays, "rest_directions", (nodes, 3)),
        chain_joints=_indices(arrays, "chain_joints", (count,), len(JOINT_NAMES)),
        pair_spans=_array(arrays, "pair_spans", (len(pairs), 2)),
        constants=RopeConstants.of(constants),  # type: ignore[arg-type]  # checked above
        **values,
    )
    free = chains.parents >= 0
    _check(
        bool((chains.lengths[free] > 0).all() and (chains.masses[free] > 0).all()),
        "ropes need positive lengths and masses",
        "zero or less",
    )
    kin = len(chains.kinematic)
    embedding = Embedding(_indices(arrays, "corners", (nodes, 3), None), _array(arrays, "barycentric", (nodes, 3)))
    carriage = Carriage(
        _array(arrays, "carriage_rest", (kin, 3)),
        _array(arrays, "carriage_weights", (kin, len(JOINT_NAMES))),
        _indices(arrays, "carriage_nearest", (kin,), None),
        _array(arrays, "carriage_nearest_rest", (kin, 3)),
    )
    rest, betas = _array(arrays, "rest", (nodes, 3)), _array(arrays, "betas", (-1,))
    proxy = BodyProxy.of(arrays, metadata)
    _check(len(proxy.pivots) == len(JOINT_NAMES), f"a proxy needs {len(JOINT_NAMES)} pivots", len(proxy.pivots))
    return kind(chains, embedding, carriage, rest, proxy, betas, str(key))


def _array(arrays: Mapping[str, np.ndarray], name: str, shape: tuple[int, ...], kind: type = np.float64) -> np.ndarray:
    _check(name in arrays, f"ropes need an array '{name}'", "none")
    array = np.asarray(arrays[name])
    fits = array.ndim == len(shape) and all(want in (-1, got) for want, got in zip(shape, array.shape, strict=True))
    _check(fits, f"rope array '{name}' must have shape {shape}", array.shape)
    _check(
        np.issubdtype(array.dtype, np.integer if kind is np.int32 else np.floating),
        f"rope array '{name}' has the wrong type",
        array.dtype,
    )
    _check(bool(np.isfinite(array).all()), f"rope array '{name}' must be finite", "NaN or infinity")
    return np.ascontiguousarray(array, kind)


def _indices(arrays: Mapping[str, np.ndarray], name: str, shape: tuple[int, ...], limit: int | None) -> np.ndarray:
    array = _array(arrays, name, shape, np.int32)
    high = np.iinfo(np.int32).max if limit is None else limit
    inside = array.size == 0 or (array.min() >= 0 and array.max() < high)
    _check(bool(inside), f"rope array '{name}' must count from 0 to {high - 1}", "an index outside")
    return array


def _check(right: bool, what: str, got: object) -> None:
    if not right:
        raise BadModel(what, got, _CURE)
