"""Checks the arrays of an SMPL file."""

from pathlib import Path

import numpy as np

from hemline.errors import BadBody

from .smpl_families import FAMILIES, Family

CURE = "name the file as its publisher gives it, SMPL, SMPL-H or SMPL-X"
_LARGEST = 1e6


def check_shapes(path: Path, arrays: dict[str, np.ndarray]) -> Family:
    """Returns the family that has arrays of these shapes and types.

    Raises:
        BadBody: There is none.
    """
    template, weights, shapedirs = (arrays[name] for name in ("v_template", "weights", "shapedirs"))
    verts, joints = len(template) if template.ndim else 0, weights.shape[-1] if weights.ndim else 0
    if joints not in FAMILIES:
        known = ", ".join(f"{family.name} has {count}" for count, family in FAMILIES.items())
        raise BadBody(f"{path}: weights must be those of a known number of joints ({known})", weights.shape, CURE)
    shapes = {
        "v_template": (verts, 3),
        "shapedirs": (verts, 3, shapedirs.shape[-1] if shapedirs.ndim else 0),
        "weights": (verts, joints),
        "kintree_table": (2, joints),
        "f": (len(arrays["f"]) if arrays["f"].ndim else 0, 3),
        "J_regressor": (joints, verts),
        "posedirs": (verts, 3, 9 * (joints - 1)),
    }
    for name, shape in shapes.items():
        array = arrays.get(name)
        if array is not None and array.shape != shape:
            raise BadBody(f"{path}: '{name}' must have shape {shape}", array.shape, CURE)
        kinds = "iu" if name in ("kintree_table", "f") else "f"
        if array is not None and array.dtype.kind not in kinds:
            what = "whole numbers" if kinds == "iu" else "floating-point numbers"
            raise BadBody(f"{path}: '{name}' must hold {what}", array.dtype, CURE)
    return FAMILIES[joints]


def check_values(path: Path, arrays: dict[str, np.ndarray], family: Family) -> None:
    """Checks the numbers in the arrays.

    Raises:
        BadBody: Numbers are NaN, the skeleton is not the family's, weights do not sum to 1, or triangles name vertices
            that do not exist.
    """
    for name, array in arrays.items():
        least, largest = array.min(initial=0), array.max(initial=0)
        if array.dtype.kind == "f" and not -_LARGEST < least <= largest < _LARGEST:  # nor with NaN
            raise BadBody(f"{path}: '{name}' must hold numbers below {_LARGEST:g}", f"{least:g}..{largest:g}", CURE)
    parents = tuple(int(parent) for parent in arrays["kintree_table"][0])
    if parents[1:] != family.parents[1:] or 0 <= parents[0] < len(parents):  # the root's is -1, or that as unsigned
        raise BadBody(f"{path}: 'kintree_table' must be that of {family.name}", parents, CURE)
    weights = arrays["weights"]
    sums = weights.sum(axis=1, dtype=np.float64)
    if not len(sums) or weights.min() < -1e-6 or np.abs(sums - 1).max() > 1e-2:
        got = f"sums {sums.min():.4f}..{sums.max():.4f}, least {weights.min():.4f}" if len(sums) else "no vertices"
        raise BadBody(f"{path}: 'weights' of a vertex must sum to 1, none below 0", got, CURE)
    faces, verts = arrays["f"], len(weights)
    if not len(faces) or faces.min() < 0 or faces.max() >= verts:
        got = f"{faces.min()}..{faces.max()}" if len(faces) else "no triangles"
        raise BadBody(f"{path}: 'f' must lie in 0..{verts - 1}", got, CURE)
