"""Opens a garment by name or from a file and puts it on a body; tries it on if it does not sit on the body."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Literal, get_args

import numpy as np

from hemline.errors import BadDataset, BadGarment, BadInput, OffBody
from hemline.files import check_folder, content_hash
from hemline.garments.garment import Garment
from hemline.garments.material import Material
from hemline.garments.reading.read import garment_of_source, put_on, read_source
from hemline.garments.reading.source import GarmentSource
from hemline.garments.reading.units import Z_UP_NOTE
from hemline.garments.shipped import is_name, load
from hemline.meshes import edge_strains

from .openings import joints_through_cloth
from .try_on import TryOn, try_on, try_on_source

if TYPE_CHECKING:
    from hemline.bodies import ShapedBody

OPEN_SEAM_STRAIN = 2.0
"""Strain that one edge in a hundred has where panels lie apart that their pattern joins."""
TryOnRule = Literal["auto", "never", "always"]
"""When a garment is tried on; `auto`: only if it does not sit where its file places it."""


def open_garment(
    name_or_path: str | Path,
    body: "ShapedBody",
    *,
    tryon: TryOnRule = "auto",
    dressed: bool = True,
    material: Material | str | None = None,
    dataset: str | Path | None = None,
    say: Callable[[str], None] | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Garment:
    """Opens a garment by name or from a file, on a body.

    Meshes by other makers often do not sit on the body: they or their pins are far from it or inside it, a bone goes
    through their cloth, or their panels are not sewn together yet. With `tryon="auto"` such a mesh is tried on (see
    `try_on`), which takes about a minute.

    Args:
        name_or_path: A name that `garments.load` knows, such as `cape` or `dress:7`, or a file that `garments.read`
            reads.
        body: The body to wear the garment.
        tryon: `auto`: a mesh that does not sit on the body is tried on; `never`: it is refused; `always`: every garment
            is tried on, or at least settled and judged.
        dressed: Whether the garment is moved onto the shape of `body`; otherwise it stays on the shape of that body
            that it was made on.
        material: A material, or the name of one; None keeps the material that the garment or its file states.
        dataset: Folder of a dataset, which need not exist yet. Garments that were tried on are kept in it, in
            `worn/<hash>.safetensors` with the hash of mesh, TOML and body, so that opening the same mesh again returns
            the same garment at once.
        say: Called with a line of text before each step that takes long.
        progress: Called with the number of frames done and the number of all frames while a garment is tried on.

    Returns:
        The garment on `body`, or on another shape of that body.

    Raises:
        BadInput: `tryon` is not one of its three values.
        BadGarment: Unknown name or material, a file that contradicts itself, or a garment that cannot be worn.
        OffBody: With `never`: the garment does not sit on the body (a BadGarment as well).
        BadMesh: The mesh cannot be read, or no cloth can be made of it.
        BadDataset: The mesh would have to be tried on, but the dataset belongs to a garment of another mesh.
        BadOutput: The folder of the dataset cannot be written to.

    Example:
        >>> skirt = hemline.open_garment("skirt.obj", hemline.bodies.load("anny24").shaped())
    """
    if tryon not in get_args(TryOnRule):
        known = ", ".join(get_args(TryOnRule))
        raise BadInput(f"tryon must be one of {known}", repr(tryon), "leave it out to try on if needed")
    fabric = None if material is None else Material.of(material)  # an unknown one is refused before a mesh is tried on
    tell = say or (lambda line: None)
    if is_name(name_or_path):
        garment = load(str(name_or_path), body, dressed=dressed)
        if tryon == "always":
            _check_wearable(try_on(name_or_path, body), f"'{name_or_path}' cannot be worn", tell)
    else:
        source = GarmentSource.open(name_or_path)
        if tryon == "never" or (tryon == "auto" and source.kind != "mesh"):
            garment = read_source(source, body, dressed=dressed)
        else:
            garment = _open_source(source, body, tryon, dressed, dataset, tell, progress)
    return garment if fabric is None else garment.in_material(fabric)


def _open_source(
    source: GarmentSource,
    body: "ShapedBody",
    rule: TryOnRule,
    dressed: bool,
    dataset: str | Path | None,
    tell: Callable[[str], None],
    progress: Callable[[int, int], None] | None,
) -> Garment:
    """Returns the garment of a file; if it has to be tried on, does so, or returns what an earlier try-on kept."""
    name = source.path.name
    kept = None
    if dataset is not None and source.kind == "mesh":
        kept = Path(dataset) / "worn" / f"{_source_hash(source, body)}.safetensors"
        if kept.exists():
            tell(f"{name} was tried on before: going on with {kept}")
            return put_on(Garment.load(kept), body, dressed=dressed)
    if rule == "auto":
        garment = garment_of_source(source, body)
        # a mesh whose up axis was guessed from how near it lies to the skin may be a shirt that hangs from the hips
        if not isinstance(garment, OffBody) and Z_UP_NOTE not in garment.notes:
            garment = put_on(garment, body, dressed=dressed)
            if sits_on_body(garment, body):
                return garment
    if dataset is not None and kept is not None:
        _check_dataset(Path(dataset), name)
    fault = "cannot be worn"
    if rule == "auto":
        tell(f"{name} does not sit on the body: trying it on (as 'hemline tryon' would)")
        fault = "does not sit on the body and cannot be worn as it is"
    tried = try_on_source(source, body, say=tell, progress=progress)
    _check_wearable(tried, f"{name} {fault}", tell, keep_in=kept)
    tell(f"{name} is worn" + ("" if kept is None else f", and kept as {kept}"))
    return put_on(tried.garment, body, dressed=dressed)


def sits_on_body(garment: Garment, shaped: "ShapedBody") -> bool:
    """Whether a garment can settle where it lies, see `misfit_reason`."""
    return misfit_reason(garment, shaped) is None


def misfit_reason(garment: Garment, shaped: "ShapedBody") -> str | None:
    """Returns why a garment cannot settle where it lies, on the shape that it was made on; None if it can.

    A bone of trunk, arms or legs goes through its cloth, or its seams are open: panels that a pattern program laid
    around the body are joined by edges of many times their length (`OPEN_SEAM_STRAIN`).
    """
    made_on = shaped if garment.is_on(shaped) else shaped.body.shaped(garment.body_betas)
    if np.percentile(edge_strains(garment.vertices, garment.faces, garment.rest_edges), 99) > OPEN_SEAM_STRAIN:
        return "its panels are not sewn together yet"
    # a cap may be closed above the head
    if set(joints_through_cloth(garment.vertices, garment.faces, made_on)) - {"head"}:
        return "bones go through the cloth"
    return None


def _source_hash(source: GarmentSource, shaped: "ShapedBody") -> str:
    """Returns a hash of the mesh, its description and the body; names of files do not count."""
    mesh, description = source.mesh, replace(source.description, mesh="", name=None)
    pattern = [each for each in (mesh.pattern, mesh.pattern_faces) if each is not None]
    betas = {"betas": [float(beta) for beta in shaped.betas]}
    return content_hash(mesh.vertices, mesh.faces, *pattern, repr(description), shaped.body.hash, betas)


def _check_dataset(folder: Path, name: str) -> None:
    """Refuses a dataset that was made for another garment, or whose folder cannot be written to."""
    if (folder / "garment.safetensors").exists():
        cure = f"choose another folder, or name {folder / 'garment.safetensors'} to go on with that one"
        raise BadDataset(f"{folder} was made for another garment", f"{name}, not tried on for it", cure)
    check_folder(folder)


def _check_wearable(tried: TryOn, what: str, tell: Callable[[str], None], keep_in: Path | None = None) -> None:
    """Refuses a garment that cannot be worn; saves one that can, and passes its warnings on."""
    if tried.fitness.reason is not None:
        place = "place it on the body at rest (y up, facing +z)"
        cure = f"see it with 'hemline tryon', {place}, or say more in a TOML beside it"
        raise BadGarment(what, tried.fitness.reason, cure)
    if keep_in is not None:
        keep_in.parent.mkdir(parents=True, exist_ok=True)
        tried.garment.save(keep_in)
    for warning in tried.fitness.warnings:
        tell(f"warning: {warning}")
