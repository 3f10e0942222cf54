"""Puts a garment of unknown origin on a body: align it, grow the body inside it, settle it, accept or reject it."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from hemline.errors import BadGarment, OffBody, SimulationFailed
from hemline.garments.garment import Garment
from hemline.garments.material import Material
from hemline.garments.pin_rules import NO_PINS
from hemline.garments.reading.assembly import assemble, body_made_on
from hemline.garments.reading.cloth import GarmentCloth
from hemline.garments.reading.garment_toml import GarmentFile
from hemline.garments.reading.read import read_source
from hemline.garments.reading.source import GarmentSource
from hemline.garments.reading.units import Z_UP_NOTE
from hemline.garments.shipped import is_name, load
from hemline.motions.motion import JOINT_NAMES

from .alignment import Alignment, align
from .fitness import Fitness, fitness
from .growing import Growth, grow

if TYPE_CHECKING:
    from hemline.bodies import ShapedBody

LEAST_RESIZE = 0.02
"""Relative change of size below which a garment keeps its own size."""

MANY_VERTICES = 30_000
"""Number of vertices above which the user is told how long it will take."""

SECONDS_A_VERTEX = 0.008
"""Approximate time that a try-on takes per vertex [s]."""

SHOULDER_DISTANCE = 0.06
"""Cloth nearer than this to the middle of a shoulder rests on it [m]."""

_CURE = "place it on the body at rest (y up, facing +z), or check its unit"


@dataclass(frozen=True, eq=False)
class TryOn:
    """The outcome of a try-on.

    Attributes:
        garment: The garment on the body; its notes say what was done to it. If it was made on another shape of the
            body, it stays on that shape, and is dressed on this one when it is simulated.
        fitness: How well the settled garment fits, and the reason if it cannot be worn.
        alignment: Where the garment was put, and for which pose of the body; None if its file says where it lies.
        growth: The garment after the body grew inside it; None if its file says where it lies.
    """

    garment: Garment
    fitness: Fitness
    alignment: Alignment | None = None
    growth: Growth | None = None


def try_on(
    name_or_path: str | Path,
    shaped: "ShapedBody",
    *,
    unit: str | None = None,
    scaled: bool = True,
    say: Callable[[str], None] | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> TryOn:
    """Puts a garment that was made on an unknown body onto this one.

    First, a search finds a place and size of the garment and a pose of the body with which limbs go through openings
    (`alignment`). The body, made thin, then grows inside the cloth and turns to its rest pose (`growing`); the cloth
    keeps the rest shape of its own mesh or pattern. Finally the garment settles under gravity and is accepted or
    rejected (`fitness`). Clothes of MakeHuman (`.mhclo`) and hemline's own garments lie where their bindings or pins
    say, so that only this last step is done. To get just the garment, use `open_garment`.

    Args:
        name_or_path: A mesh, a TOML that names one, a `.mhclo`, or a garment of hemline's own, by name or file.
        shaped: The body.
        unit: Unit of the mesh. If it is None, the TOML states it, or it is guessed.
        scaled: Whether it may be scaled, by 0.67 to 1.49, if it was clearly made for a body of another size.
        say: Called with a line of text before a step that takes long.
        progress: Called with the number of frames done and the number of all frames.

    Returns:
        The garment and how it fits; if it cannot be worn, `fitness.reason` says why.

    Raises:
        BadGarment: Unit, material or pins contradict each other, or the garment cannot be put around the body at all.
        BadMesh: The mesh cannot be read, or no cloth can be made of it.
    """
    named = is_name(name_or_path)
    if unit is not None and (named or Path(name_or_path).suffix.lower() == ".safetensors"):
        raise BadGarment(f"{name_or_path} is in metres", f"unit '{unit}'", "leave out the unit")
    if named:
        garment = load(str(name_or_path), shaped, dressed=False)
        return TryOn(garment, fitness(garment, shaped))
    return try_on_source(GarmentSource.open(name_or_path, unit), shaped, scaled=scaled, say=say, progress=progress)


def try_on_source(
    source: GarmentSource,
    shaped: "ShapedBody",
    *,
    scaled: bool = True,
    say: Callable[[str], None] | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> TryOn:
    """Puts the garment of a file that is already open onto a body, see `try_on`."""
    if source.kind != "mesh":
        garment = read_source(source, shaped, dressed=False)
        return TryOn(garment, fitness(garment, shaped))
    description = source.description
    made_on, body_notes = body_made_on(description, shaped, source.path)
    cloth = source.cloth
    if say and len(cloth.vertices) > MANY_VERTICES:
        minutes = max(1, round(len(cloth.vertices) * SECONDS_A_VERTEX / 60))
        say(f"{cloth.name} has {len(cloth.vertices)} vertices: this takes {minutes} minutes or more")
    alignment = align(cloth.vertices, cloth.faces, made_on, scaled=scaled, up=description.up)
    loose = loose_garment(cloth, description, made_on, alignment)
    try:
        growth = grow(loose, made_on, alignment, progress)
    except SimulationFailed as failure:
        what = f"{cloth.name} must fit around the body"
        raise BadGarment(what, failure, _CURE) from failure
    notes = body_notes + cloth.notes + _describe_steps(alignment, growth, up_guessed=description.up is None)
    if description.pins is None and rests_on_shoulders(growth.vertices, made_on):
        description = replace(description, pins="none")
        notes += ("pins: none, as the shoulders carry it",)
    on_body = replace(cloth, vertices=growth.vertices, faces=loose.faces, rest_edges=loose.rest_edges, notes=notes)
    garment = assemble(on_body, description, made_on)
    if isinstance(garment, OffBody):
        raise BadGarment(f"once tried on, {garment.what}", garment.got, _CURE)
    return TryOn(garment, fitness(garment, shaped), alignment, growth)


def loose_garment(cloth: GarmentCloth, description: GarmentFile, shaped: "ShapedBody", alignment: Alignment) -> Garment:
    """Makes a garment without pins from a mesh: placed by the alignment, with its rest triangles scaled.

    Args:
        cloth: The mesh.
        description: Material, and whether the cloth is flat at rest.
        shaped: The body.
        alignment: Place and scale of the garment.
    """
    scale = alignment.scale if abs(alignment.scale - 1) > LEAST_RESIZE else 1.0
    return Garment(
        name=cloth.name,
        vertices=alignment.vertices.astype(np.float32),
        faces=cloth.faces,
        rest_edges=scale * cloth.rest_edges,
        material=Material.of(description.material if description.material is not None else "cotton"),
        pins=NO_PINS,
        key_joint="pelvis",
        body_name=shaped.body.name,
        body_betas=np.array(shaped.betas, np.float32),
        flat_rest=cloth.from_pattern if description.flat_rest is None else description.flat_rest,
    )


def rests_on_shoulders(vertices: np.ndarray, shaped: "ShapedBody") -> bool:
    """Whether cloth lies on both shoulders, between neck and arm."""
    for side in ("left", "right"):
        neck, shoulder = (shaped.joints[JOINT_NAMES.index(each)] for each in ("neck", f"{side}_shoulder"))
        middle = 0.3 * neck + 0.7 * shoulder
        above = shaped.vertices[np.linalg.norm(shaped.vertices[:, [0, 2]] - middle[[0, 2]], axis=1) < 0.03]
        top = np.array([middle[0], above[above[:, 1] < neck[1] + 0.1][:, 1].max(), middle[2]])
        if np.linalg.norm(vertices - top, axis=1).min() > SHOULDER_DISTANCE:
            return False
    return True


def _describe_steps(alignment: Alignment, growth: Growth, *, up_guessed: bool) -> tuple[str, ...]:
    """Says what was done to the garment; the up axis only if it was guessed."""
    up, forward, bend, apart = np.degrees(alignment.angles)
    notes = [Z_UP_NOTE] if up_guessed and alignment.up == "z" else []
    notes += [f"place: moved by ({', '.join(f'{value:.2f}' for value in alignment.moved)}) m"]
    if abs(alignment.scale - 1) > LEAST_RESIZE:
        notes.append(f"size: {100 * (alignment.scale - 1):+.0f} %, cloth and all, as it was made for another body")
    if max(abs(up), abs(forward), abs(bend), abs(apart)) > 5:
        notes.append(
            f"pose: put on with arms turned up by {up:.0f} and forward by {forward:.0f} degrees, elbows by {bend:.0f}, "
            f"legs apart by {apart:.0f}, then turned to the rest pose"
        )
    if growth.girth < 1:
        notes.append(f"body: grown from {100 * growth.girth:.0f} % of its girth inside the garment")
    if growth.stretched > 1.5:
        notes.append(f"seams: closed, some edges were {growth.stretched:.0f} times too long")
    if alignment.empty:
        notes.append(f"openings: {alignment.empty} of {alignment.rims} had no limb to go through them")
    return tuple(notes)
