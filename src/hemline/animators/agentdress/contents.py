"""What a model file holds of AgentDress, written and read back."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from hemline import bodies
from hemline.animators.model_file import garment_of
from hemline.errors import BadModel
from hemline.files.contents import AGAIN, entry, part
from hemline.options import options_of

from .bounds import BetaRange, read_beta_range
from .config import AgentDressConfig
from .materials import Materials
from .tables import Tables

VERSION = 5
"""Version of what model files hold of AgentDress, `agentdress.version`."""


def arrays_of(tables: Tables, materials: Materials | None) -> dict[str, np.ndarray]:
    """All arrays of a model, by name."""
    parts = {"tables": tables.arrays(), "materials": {} if materials is None else materials.arrays()}
    return {f"{of}.{name}": array for of, arrays in parts.items() for name, array in arrays.items()}


def metadata_of(materials: Materials | None, *, width: float, shape_width: float, betas: BetaRange) -> dict[str, Any]:
    """The metadata that is AgentDress's alone; see the fields of `AnimatorAgentDress`."""
    held = {"version": VERSION, "width": width, "shape_width": shape_width, "betas": list(betas)}
    return {"agentdress": held if materials is None else held | {"materials": materials.metadata()}}


def fields_of(arrays: Mapping[str, np.ndarray], metadata: Mapping[str, Any]) -> dict[str, Any]:
    """What an `AnimatorAgentDress` is made of, by the names of its fields.

    Raises:
        BadModel: The file is of another version, a key is missing or of another type, or an array of another dtype or
            shape than the rest asks for.
    """
    held = entry(metadata, "agentdress", dict)
    if held.get("version") != VERSION:
        got = f"version {held.get('version')}"
        raise BadModel(f"this hemline reads version {VERSION} of AgentDress", got, AGAIN)
    width, shape_width = entry(held, "width", float), entry(held, "shape_width", float)
    for each in (width, shape_width):
        if not (np.isfinite(each) and each > 0):
            raise BadModel("the kernels of the model have positive widths", each, AGAIN)
    garment, body = garment_of(arrays, metadata), entry(metadata, "body", dict)
    name = entry(body, "name", str)
    config = options_of(AgentDressConfig, entry(metadata, "config", dict), error=BadModel)
    tables = Tables.of(
        part(arrays, "tables"),
        vertices=len(garment.vertices),
        body_vertices=len(bodies.load(name).template),
        rigged=config.pose_model == "sor",
    )
    materials = None
    if "materials" in held:
        counts = {"poses": len(tables.rotations), "regions": tables.regions.shape[1]}
        materials = Materials.of(part(arrays, "materials"), entry(held, "materials", dict), **counts)
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
        "fitted_betas": read_beta_range(held),
        "materials": materials,
    }
