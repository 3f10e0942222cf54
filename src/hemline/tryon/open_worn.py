"""The garment of a dataset: read where it sits on the body, tried on where it does not, and kept for the next time."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from hemline.errors import BadDataset, BadGarment, OffBody
from hemline.files import check_folder, content_hash
from hemline.garments.garment import Garment
from hemline.garments.reading.garment_toml import GarmentFile, read_garment_toml
from hemline.garments.shipped import open_garment
from hemline.meshes import read_mesh

from .openings import pierced
from .try_on import try_on

if TYPE_CHECKING:
    from hemline.bodies import ShapedBody

_READ_AS_THEY_ARE = ("", ".safetensors", ".mhclo")
"""Names, and files that say themselves where they lie on a body."""


def open_worn(
    name_or_path: str | Path,
    shaped: "ShapedBody",
    dataset: str | Path,
    *,
    dressed: bool = True,
    say: Callable[[str], None] | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Garment:
    """A garment by name or from a file, on a body; a mesh that does not sit on it is tried on first.

    A mesh does not sit on the body where `open_garment` refuses it as `OffBody`, or where a bone goes through its
    cloth. What `try_on` makes of it is kept in the dataset as `worn/<hash>.safetensors`, the hash that of mesh, TOML
    and body, and read from there the next time: so a command that is run again goes on with the very same garment,
    and another mesh is never taken for it.

    Args:
        name_or_path: As `open_garment`.
        shaped: The body.
        dataset: The folder of the dataset, there or not.
        dressed: As `open_garment`.
        say: Called with a line that says what is done.
        progress: Called with frames done and frames in all while it is tried on.

    Returns:
        The garment, as `open_garment` gives it.

    Raises:
        BadGarment: As `open_garment`; or it does not sit on the body and cannot be worn, with the reason.
        BadMesh: The mesh cannot be read, or no cloth can be made of it.
        BadDataset: The mesh would have to be tried on, and the dataset has a garment that was not made of it.
        BadOutput: The folder cannot be written to.
    """
    path, tell = Path(name_or_path), say or (lambda line: None)
    said = read_garment_toml(path) if path.suffix == ".toml" else GarmentFile(mesh=path.name)
    if path.suffix.lower() in _READ_AS_THEY_ARE or Path(said.mesh).suffix.lower() in _READ_AS_THEY_ARE:
        return open_garment(name_or_path, shaped, dressed=dressed)
    kept = Path(dataset) / "worn" / f"{_source(path, said, shaped)}.safetensors"
    if kept.exists():
        tell(f"{path.name} was tried on before: going on with {kept}")
        return open_garment(kept, shaped, dressed=dressed)
    try:
        garment = open_garment(path, shaped, dressed=dressed)
        if sits(garment, shaped):
            return garment
    except OffBody:
        pass
    if (Path(dataset) / "garment.safetensors").exists():
        cure = f"choose another folder, or name {Path(dataset) / 'garment.safetensors'} to go on with that one"
        raise BadDataset(f"{dataset} was made for another garment", f"{path.name}, not tried on for it", cure)
    check_folder(dataset)
    tell(f"{path.name} does not sit on the body: trying it on (as 'hemline tryon' would)")
    for warning in _tried(path, shaped, say, progress, kept):
        tell(f"warning: {warning}")
    tell(f"{path.name} is worn, and kept as {kept}")
    return open_garment(kept, shaped, dressed=dressed)


def sits(garment: Garment, shaped: "ShapedBody") -> bool:
    """Whether no bone of trunk, arms or legs goes through a garment's cloth, on the shape that it was made on."""
    made_on = shaped if garment.is_on(shaped) else shaped.body.shaped(garment.body_betas)
    # a cap may be closed above the head
    return not set(pierced(garment.vertices, garment.faces, made_on)) - {"head"}


def _source(path: Path, said: GarmentFile, shaped: "ShapedBody") -> str:
    """A hash of the mesh, of what is said about it and of the body; names of files do not count."""
    mesh = read_mesh(path.parent / said.mesh)
    pattern = [each for each in (mesh.pattern, mesh.pattern_faces) if each is not None]
    betas = {"betas": [float(beta) for beta in shaped.betas]}
    return content_hash(
        mesh.vertices, mesh.faces, *pattern, repr(replace(said, mesh="", name=None)), shaped.body.hash, betas
    )


def _tried(path: Path, shaped: "ShapedBody", say, progress, kept: Path) -> tuple[str, ...]:
    """Try on and save, or say why it cannot be worn; what is odd about how it is worn."""
    what = f"{path.name} does not sit on the body and cannot be worn as it is"
    cure = (
        "see it with 'hemline tryon', place it on the body at rest (y up, facing +z), or say more in a TOML beside it"
    )
    tried = try_on(path, shaped, say=say, progress=progress)
    if tried.fitness.reason is not None:
        raise BadGarment(what, tried.fitness.reason, cure)
    kept.parent.mkdir(parents=True, exist_ok=True)
    tried.garment.save(kept)
    return tried.fitness.warnings
