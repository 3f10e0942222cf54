"""Reads and writes bodies in hemline's own safetensors container, which `docs/format.md` specifies."""

from pathlib import Path

import numpy as np

from hemline.arrays import Float
from hemline.errors import BadBody
from hemline.files import read_tensors, write_tensors

from .body import Body

_FLOATS = ("template", "joints", "joint_shapedirs", "weights", "rest_offsets")
_SHAPEDIRS_MAX = 32767


def write_body(path: str | Path, body: Body) -> None:
    """Writes a body, with shapedirs as int16 and one scale per beta.

    This rounds them by at most 1/65534 of their largest value. Pose-dependent offsets are written in the same way, with
    one scale per feature.

    Args:
        path: The file, `.safetensors`.
        body: The body.

    Raises:
        BadOutput: The path cannot be written.
    """
    arrays = {field: getattr(body, field) for field in _FLOATS} | {
        **shapedirs_in_steps(body.shapedirs),
        "faces": body.faces.astype(np.uint32 if len(body.template) > 65535 else np.uint16),
        "weight_indices": body.weight_indices.astype(np.uint8),
        "parents": body.parents.astype(np.int8),
    }
    if body.posedirs is not None:
        arrays["posedirs"], arrays["posedirs_scales"] = shapedirs_in_steps(body.posedirs).values()
    metadata: dict[str, str | int] = {"kind": "body", "name": body.name, "licence": body.licence}
    if body.accessory_vertices:
        metadata |= {"accessory_vertices": body.accessory_vertices, "bare_name": body.bare_name}
    write_tensors(path, arrays, metadata)


def read_body(path: str | Path) -> Body:
    """Reads a body that `write_body` wrote.

    Args:
        path: The file.

    Raises:
        BadBody: The file is missing, truncated, a pickle, of another kind or a future version, or its content
            contradicts itself.
    """
    arrays, metadata = read_tensors(path, "body", error=BadBody)
    needed = {*_FLOATS, "shapedirs", "shapedirs_scales", "faces", "weight_indices", "parents"}
    if missing := sorted(needed - arrays.keys()):
        raise BadBody(f"{path} lacks arrays", ", ".join(missing), "make or copy the body file again")
    arrays["shapedirs"] = shapedirs_of_steps(arrays["shapedirs"], arrays.pop("shapedirs_scales"), path)
    if "posedirs" in arrays:
        needed.add("posedirs")
        scales = arrays.pop("posedirs_scales", np.zeros(0))
        arrays["posedirs"] = shapedirs_of_steps(arrays["posedirs"], scales, path, name="posedirs")
    integers = {field: arrays[field].astype(np.int64) for field in ("faces", "weight_indices", "parents")}
    name, licence = str(metadata.get("name", Path(path).stem)), str(metadata.get("licence", ""))
    count, bare_name = metadata.get("accessory_vertices", 0), metadata.get("bare_name", "")
    if not isinstance(count, int) or not isinstance(bare_name, str):
        raise BadBody(f"{path}: accessories must have a number", repr(count), "make or copy the body file again")
    return Body(
        name=name,
        licence=licence,
        accessory_vertices=count,
        bare_name=bare_name,
        **{field: arrays[field] for field in needed & arrays.keys()} | integers,
    )


def shapedirs_in_steps(shapedirs: Float[np.ndarray, "betas verts 3"]) -> dict[str, np.ndarray]:
    """Encodes shapedirs for files: int16 `shapedirs`, and the size of a step of each beta, `shapedirs_scales` [m]."""
    largest = np.abs(shapedirs).max(axis=(1, 2), initial=0.0)
    scales = np.where(largest > 0, largest / _SHAPEDIRS_MAX, 1.0).astype(np.float32)
    return {"shapedirs": np.rint(shapedirs / scales[:, None, None]).astype(np.int16), "shapedirs_scales": scales}


def shapedirs_of_steps(
    steps: np.ndarray, scales: np.ndarray, path: str | Path, *, name: str = "shapedirs"
) -> Float[np.ndarray, "betas verts 3"]:
    """Decodes shapedirs, or the posedirs that `name` names, from steps [m].

    Raises:
        BadBody: The steps are not int16, or there is not one scale for each beta.
    """
    if scales.shape != steps.shape[:1] or steps.dtype != np.int16:
        got = f"{steps.dtype} {steps.shape} and {scales.shape}"
        raise BadBody(f"{path}: {name} must be int16 with one scale each", got, "make or copy the body file again")
    return steps * scales.astype(np.float32)[(...,) + (None,) * (steps.ndim - 1)]
