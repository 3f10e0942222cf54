"""A garment of unknown origin, put on a body: read, placed, posed for, grown into, settled, judged."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from hemline.errors import BadGarment, OffBody, SimulationFailed
from hemline.garments.garment import Garment
from hemline.garments.material import Material
from hemline.garments.pin_rules import NO_PINS
from hemline.garments.reading.assembly import Cloth, assembled, body_made_on
from hemline.garments.reading.garment_toml import GarmentFile, read_garment_toml
from hemline.garments.reading.read import cloth_of, read
from hemline.garments.reading.up_axis import TURNED
from hemline.garments.shipped import open_garment
from hemline.motions.motion import JOINT_NAMES

from .alignment import Alignment, aligned
from .fitness import Fitness, fitness
from .growing import Grown, grown

if TYPE_CHECKING:
    from hemline.bodies import ShapedBody

SCALED = 0.02
"""Change of size that is taken seriously; below it the garment keeps its own."""

MANY, COST = 30_000, 0.008
"""Vertices from which on the cost is said before; time for each of them, about [s]."""

ON_SHOULDERS = 0.06
"""Cloth that is so near to the line from neck to shoulder lies on it [m]."""


_CURE = "place it on the body at rest (y up, facing +z), or check its unit"


@dataclass(frozen=True, eq=False)
class TryOn:
    """What came of trying a garment on.

    Attributes:
        garment: On the body, with what was done to it in its notes. On the shape that it was made on, if that is
            another: dressing it on this one is left to what simulates it.
        fitness: How it is worn once settled, and the reason where it is not.
        alignment: Where it was laid, and for which pose of the body; None: where it lies is part of its file.
        grown: How the body grew into it; None as well then.
    """

    garment: Garment
    fitness: Fitness
    alignment: Alignment | None = None
    grown: Grown | None = None


def try_on(
    path: str | Path,
    shaped: "ShapedBody",
    *,
    unit: str | None = None,
    scaled: bool = True,
    say: Callable[[str], None] | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> TryOn:
    """Put a garment that was made on an unknown body onto this one.

    The body's skeleton, its pose and the garment's place and size are sought so that limbs go through openings
    (`alignment`); the body, made thin, then grows inside the cloth and turns to its rest pose (`growing`); the cloth
    keeps the rest metric of its own mesh or pattern. At last it settles under gravity (`fitness`). Clothes of MakeHuman
    (`.mhclo`) and hemline's own lie where their bindings or pins say, and are only settled and judged.

    Args:
        path: A mesh, a TOML that names one, a `.mhclo`, or a garment of hemline's own, by name or file.
        shaped: The body.
        unit: Unit of the mesh; None: as the TOML says, or guessed.
        scaled: Whether its size may change by up to 40 % when it was plainly made for a body of another size.
        say: Called with what is worth knowing before it takes long.
        progress: Called with frames done and frames in all.

    Returns:
        The garment and how it is worn; `fitness.reason` says why it is not.

    Raises:
        BadGarment: Unit, material or pins contradict each other, or it could not be put around the body at all.
        BadMesh: The mesh cannot be read, or no cloth can be made of it.
    """
    path = Path(path)
    if path.suffix.lower() in ("", ".safetensors"):
        if unit is not None:
            raise BadGarment(f"{path} is in metres", f"unit '{unit}'", "leave out the unit")
        garment = open_garment(path, shaped, dressed=False)
        return TryOn(garment, fitness(garment, shaped))
    said = read_garment_toml(path) if path.suffix == ".toml" else GarmentFile(mesh=path.name)
    if Path(said.mesh).suffix.lower() == ".mhclo":
        garment = read(path, shaped, unit)
        return TryOn(garment, fitness(garment, shaped))
    made_on, notes = body_made_on(said, shaped, path)
    cloth = cloth_of(path, said, unit or said.unit)
    if say and len(cloth.vertices) > MANY:
        minutes = max(1, round(len(cloth.vertices) * COST / 60))
        say(f"{cloth.name} has {len(cloth.vertices)} vertices: this takes {minutes} minutes or more")
    alignment = aligned(cloth.vertices, cloth.faces, made_on, scaled=scaled, up=said.up)
    loose = around(cloth, said, made_on, alignment)
    try:
        result = grown(loose, made_on, alignment, progress)
    except SimulationFailed as failure:
        what = f"{cloth.name} must fit around the body"
        raise BadGarment(what, failure, _CURE) from failure
    on_body = Cloth(
        cloth.name,
        result.vertices,
        loose.faces,
        loose.rest_edges,
        cloth.from_pattern,
        notes + cloth.notes + _said(alignment, result, guessed=said.up is None),
    )
    if said.pins is None and on_shoulders(result.vertices, made_on):
        said = replace(said, pins="none")
        on_body = replace(on_body, notes=(*on_body.notes, "pins: none, as the shoulders carry it"))
    try:
        garment = assembled(on_body, said, made_on)
    except OffBody as still:
        raise BadGarment(f"once tried on, {still.what}", still.got, _CURE) from still
    return TryOn(garment, fitness(garment, shaped), alignment, result)


def around(cloth: Cloth, said: GarmentFile, shaped: "ShapedBody", alignment: Alignment) -> Garment:
    """The garment where it was laid, its rest metric scaled, without pins."""
    scale = alignment.scale if abs(alignment.scale - 1) > SCALED else 1.0
    return Garment(
        name=cloth.name,
        vertices=alignment.vertices.astype(np.float32),
        faces=cloth.faces,
        rest_edges=scale * cloth.rest_edges,
        material=Material.of(said.material if said.material is not None else "cotton"),
        pins=NO_PINS,
        key_joint="pelvis",
        body_name=shaped.body.name,
        body_betas=np.array(shaped.betas, np.float32),
        flat_rest=cloth.from_pattern if said.flat_rest is None else said.flat_rest,
    )


def on_shoulders(vertices: np.ndarray, shaped: "ShapedBody") -> bool:
    """Whether cloth lies on both shoulders, between neck and arm."""
    for side in ("left", "right"):
        neck, shoulder = (shaped.joints[JOINT_NAMES.index(each)] for each in ("neck", f"{side}_shoulder"))
        middle = 0.3 * neck + 0.7 * shoulder
        tall = shaped.vertices[np.linalg.norm(shaped.vertices[:, [0, 2]] - middle[[0, 2]], axis=1) < 0.03]
        top = np.array([middle[0], tall[tall[:, 1] < neck[1] + 0.1][:, 1].max(), middle[2]])
        if np.linalg.norm(vertices - top, axis=1).min() > ON_SHOULDERS:
            return False
    return True


def _said(alignment: Alignment, result: Grown, *, guessed: bool) -> tuple[str, ...]:
    """What was done, in words; the axis up only where it was guessed."""
    up, forward, bend, apart = np.degrees(alignment.angles)
    notes = [TURNED] if guessed and alignment.up == "z" else []
    notes += [f"place: moved by ({', '.join(f'{value:.2f}' for value in alignment.moved)}) m"]
    if abs(alignment.scale - 1) > SCALED:
        notes.append(f"size: {100 * (alignment.scale - 1):+.0f} %, cloth and all, as it was made for another body")
    if max(abs(up), abs(forward), abs(bend), abs(apart)) > 5:
        notes.append(
            f"pose: put on with arms turned up by {up:.0f} and forward by {forward:.0f} degrees, elbows by {bend:.0f}, "
            f"legs apart by {apart:.0f}, then turned to the rest pose"
        )
    if result.girth < 1:
        notes.append(f"body: grown from {100 * result.girth:.0f} % of its girth inside the garment")
    if result.stretched > 1.5:
        notes.append(f"seams: closed, some edges were {result.stretched:.0f} times too long")
    if alignment.empty:
        notes.append(f"openings: {alignment.empty} of {alignment.rims} had no limb to go through them")
    return tuple(notes)
