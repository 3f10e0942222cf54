"""Converts the variables, selections and sparse matrices of a pickled SMPL file into arrays."""

import math

import numpy as np

from .smpl_stand_ins import Array, Node, Refused, Selection, SparseColumns, SparseRows, is_length

_DENSE_MAX = 2_000_000
"""Largest number of entries of a sparse matrix; the regressor of SMPL-X has 576,125."""
_DEPTH_MAX = 8


def as_array(value: object, depth: int = 0) -> np.ndarray:
    """Converts an array, a chumpy variable or a sparse matrix into a NumPy array.

    Raises:
        Refused: It is anything else, or its content contradicts itself.
    """
    if depth > _DEPTH_MAX:
        raise Refused(f"chumpy variables nested more than {_DEPTH_MAX} deep")
    if isinstance(value, Array):
        return value.to_numpy()
    if isinstance(value, Node):
        return as_array(value.field("x"), depth + 1)
    if isinstance(value, Selection):
        return _select(value, depth + 1)
    if isinstance(value, SparseColumns | SparseRows):
        return _dense(value, depth + 1)
    raise Refused(f"a {type(value).__name__} in place of an array")


def _select(selection: Selection, depth: int) -> np.ndarray:
    whole, ids = as_array(selection.field("a"), depth).reshape(-1), as_array(selection.field("idxs"), depth).reshape(-1)
    shape = selection.field("preferred_shape")
    shape = as_array(shape, depth).tolist() if isinstance(shape, Array) else shape
    _need_ids(ids, len(whole))
    if not (isinstance(shape, tuple | list) and len(shape) <= 4 and all(is_length(each) for each in shape)):
        raise Refused("a selection whose shape is none")
    if math.prod(shape) != len(ids):
        raise Refused(f"a selection of {len(ids)} in the shape {tuple(shape)}")
    return whole[ids].reshape(shape)


def _dense(sparse: SparseColumns | SparseRows, depth: int) -> np.ndarray:
    data, inner, starts = (as_array(sparse.field(name), depth) for name in ("data", "indices", "indptr"))
    shape = sparse.field("_shape", "shape")
    if not (isinstance(shape, tuple) and len(shape) == 2 and all(is_length(each) for each in shape)):
        raise Refused("a sparse matrix whose shape is none")
    rows, columns = shape if isinstance(sparse, SparseRows) else shape[::-1]
    if rows * columns > _DENSE_MAX:
        raise Refused(f"a sparse matrix that claims shape {shape}")
    if not (data.shape == inner.shape == (data.size,) and starts.shape == (rows + 1,)):
        raise Refused("a sparse matrix whose parts do not fit together")
    _need_ids(inner, columns)
    _need_ids(starts, len(data) + 1)
    counts = np.diff(starts.astype(np.int64))
    if starts[0] != 0 or starts[-1] != len(data) or (counts < 0).any():
        raise Refused("a sparse matrix whose rows do not follow each other")
    dense = np.zeros((rows, columns))
    np.add.at(dense, (np.repeat(np.arange(rows), counts), inner), data)
    return dense if isinstance(sparse, SparseRows) else dense.T


def _need_ids(ids: np.ndarray, count: int) -> None:
    if ids.dtype.kind not in "iu" or (len(ids) and not 0 <= int(ids.min()) <= int(ids.max()) < count):
        raise Refused(f"indices that are not within 0..{count - 1}")
