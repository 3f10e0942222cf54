"""Writing and reading the arrays and metadata of an AgentDress model file."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from hemline import bodies
from hemline.animators.model_file import garment_of
from hemline.errors import BadModel
from hemline.files.contents import AGAIN, entry, part
from hemline.options import options_of

from .bounds import BetaRange, read_beta_range, read_lift, read_stretch_limit
from .config import AgentDressConfig
from .materials import Materials
from .tables import Tables

VERSION, READABLE = 6, (5, 6)
"""Version of the AgentDress part of a model file, `agentdress.version` in its metadata, and the versions that are read.

In version 5, weights of poses were float32, weights of shapes float16, numbers of bones int32, and betas stood there
once a garment."""


def arrays_of(tables: Tables, materials: Materials | None) -> dict[str, np.ndarray]:
    """Returns all arrays of a model, by name."""
    parts = {"tables": tables.arrays(), "materials": {} if materials is None else materials.arrays()}
    return {f"{part}.{name}": array for part, arrays in parts.items() for name, array in arrays.items()}


def metadata_of(
    materials: Materials | None,
    *,
    width: float,
    shape_width: float,
    betas: BetaRange,
    stretch_limit: float,
    lift_deg: float,
) -> dict[str, Any]:
    """Returns the AgentDress entry of the metadata; see the fields of `AnimatorAgentDress`."""
    own = {"version": VERSION, "width": width, "shape_width": shape_width, "betas": list(betas)}
    own |= {"stretch_limit": stretch_limit, "lift_deg": lift_deg}
    return {"agentdress": own if materials is None else own | {"materials": materials.metadata()}}


def fields_of(arrays: Mapping[str, np.ndarray], metadata: Mapping[str, Any]) -> dict[str, Any]:
    """Reads the fields of an `AnimatorAgentDress`, by name.

    Raises:
        BadModel: The file has another version, a key is missing or has the wrong type, or an array has the wrong dtype
            or shape.
    """
    own = entry(metadata, "agentdress", dict)
    if own.get("version") not in READABLE:
        got = f"version {own.get('version')}"
        raise BadModel("this hemline reads versions 5 and 6 of AgentDress", got, AGAIN)
    width, shape_width = entry(own, "width", float), entry(own, "shape_width", float)
    for each in (width, shape_width):
        if not (np.isfinite(each) and each > 0):
            raise BadModel("the kernels of the model have positive widths", each, AGAIN)
    garment, body = garment_of(arrays, metadata), entry(metadata, "body", dict)
    name = entry(body, "name", str)
    config = options_of(AgentDressConfig, _options(entry(metadata, "config", dict)), error=BadModel)
    tables = Tables.of(
        part(arrays, "tables"),
        vertices=len(garment.vertices),
        body_vertices=len(bodies.load(name).template),
        rigged=config.pose_model == "sor",
    )
    materials = None
    if "materials" in own:
        counts = {"poses": len(tables.rotations), "regions": tables.regions.shape[1]}
        materials = Materials.of(part(arrays, "materials"), entry(own, "materials", dict), **counts)
    return {
        "garment": garment,
        "tables": tables,
        "body_name": name,
        "body_hash": entry(body, "hash", str),
        "config": config,
        "width": width,
        "shape_width": shape_width,
        "figures": entry(metadata, "figures", dict),
        "licences": tuple(str(text) for text in entry(metadata, "licences", list)),
        "fitted_betas": read_beta_range(own),
        "stretch_limit": read_stretch_limit(own),
        "lift_deg": read_lift(own),
        "materials": materials,
    }


def _options(stored: Mapping[str, Any]) -> dict[str, Any]:
    """Returns the options of a fit without the clearance that earlier ones had, which was off unless asked for.

    Raises:
        BadModel: It is on.
    """
    if stored.get("clearance", 0.0) != 0.0:
        raise BadModel("hemline no longer plays the option 'clearance' of a fit", stored["clearance"], AGAIN)
    return {name: value for name, value in stored.items() if name != "clearance"}
