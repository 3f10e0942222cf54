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
from hemline.garments.reading.units import UNIT_NAMES, Z_UP_NOTE
from hemline.garments.shipped import is_name, load

from .alignment import Alignment, align
from .budget import SECONDS, Budget
from .fitness import Fitness, fitness
from .growing import Growth, grow
from .openings import EXTREMITIES
from .units_tried import better_unit

if TYPE_CHECKING:
    from hemline.bodies import ShapedBody

LEAST_RESIZE = 0.02
"""Relative change of size below which a garment keeps its own size."""

HOPELESS_COST = 3.0
"""Cost of an alignment above which a garment is refused before the simulation if a limb goes through its cloth."""

WRONG_SIZE_REASONS = ("nothing holds it up", "nothing goes through", "the body goes through", "it is too small")
"""Beginnings of the reasons that a garment of a wrong unit has; with others, another unit is not tried."""

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
    seconds: float = SECONDS,
) -> TryOn:
    """Puts a garment that was made on an unknown body onto this one.

    First, a search finds a place and size of the garment and a pose of the body with which limbs go through openings
    (`alignment`). The body, made thin, then grows inside the cloth and turns to its rest pose (`growing`); the cloth
    keeps the rest shape of its own mesh or pattern. Finally the garment settles under gravity and is accepted or
    rejected (`fitness`). Clothes of MakeHuman (`.mhclo`) and hemline's own garments lie where their bindings or pins
    say, so that only this last step is done. To get just the garment, use `open_garment`.

    If the unit was guessed and the garment fits the body far better in another one, or cannot be worn, that other unit
    is tried, and said. What no place, size and pose lets limbs go through is refused before the simulation.

    Args:
        name_or_path: A mesh, a TOML that names one, a `.mhclo`, or a garment of hemline's own, by name or file.
        shaped: The body.
        unit: Unit of the mesh. If it is None, the TOML states it, or it is guessed.
        scaled: Whether it may be scaled, by 0.67 to 1.49, if it was clearly made for a body of another size.
        say: Called with a line of text before a step that takes long.
        progress: Called with the number of frames done and the number of all frames.
        seconds: Processor time after which the search is given up, checked between its steps; infinite for no limit
            [s].

    Returns:
        The garment and how it fits; if it cannot be worn, `fitness.reason` says why.

    Raises:
        BadGarment: Unit, material or pins contradict each other, the file has no cloth or several garments, the garment
            cannot be put around the body at all, or the time is used up.
        BadMesh: The mesh cannot be read, or no cloth can be made of it.
    """
    named = is_name(name_or_path)
    if unit is not None and (named or Path(name_or_path).suffix.lower() == ".safetensors"):
        raise BadGarment(f"{name_or_path} is in metres", f"unit '{unit}'", "leave out the unit")
    if named:
        garment = load(str(name_or_path), shaped, dressed=False)
        return TryOn(garment, fitness(garment, shaped))
    source = GarmentSource.open(name_or_path, unit)
    return try_on_source(source, shaped, scaled=scaled, say=say, progress=progress, seconds=seconds)


def try_on_source(
    source: GarmentSource,
    shaped: "ShapedBody",
    *,
    scaled: bool = True,
    say: Callable[[str], None] | None = None,
    progress: Callable[[int, int], None] | None = None,
    seconds: float = SECONDS,
) -> TryOn:
    """Puts the garment of a file that is already open onto a body, see `try_on`."""
    if source.kind != "mesh":
        garment = read_source(source, shaped, dressed=False)
        return TryOn(garment, fitness(garment, shaped))
    budget, tell = Budget(source.name, seconds), say or (lambda line: None)
    made_on, _ = body_made_on(source.description, shaped, source.path)
    alignment, unit = _align(source, made_on, scaled, tell, guessed_unit=True)
    if unit is not None:
        source, before = source.in_unit(unit), source.unit
        tell(f"{source.name} fits the body far better in {_full(unit)} than in {_full(before)}: taken to be in them")
        alignment, _ = _align(source, made_on, scaled, tell, guessed_unit=False)
    tried = _put_on(source, shaped, alignment, progress, budget)
    if unit is not None or not (tried.fitness.reason or "").startswith(WRONG_SIZE_REASONS):
        return _note_unit(tried, unit)
    unit = better_unit(source, made_on, alignment.misfit, poor=True)
    if unit is None:
        return tried
    other = source.in_unit(unit)
    tell(f"{source.name} cannot be worn in {_full(source.unit)}, but may be in {_full(unit)}: trying that")
    alignment, _ = _align(other, made_on, scaled, tell, guessed_unit=False)
    again = _put_on(other, shaped, alignment, progress, budget)
    return tried if again.fitness.reason else _note_unit(again, unit)


def _align(
    source: GarmentSource, shaped: "ShapedBody", scaled: bool, tell: Callable[[str], None], *, guessed_unit: bool
) -> tuple[Alignment, str | None]:
    """Aligns a garment; returns also the unit in which it would fit far better, if its unit is only guessed."""
    cloth = source.cloth
    size = " x ".join(f"{side:.2f}" for side in np.ptp(cloth.vertices, axis=0))
    tell(f"{cloth.name}: {len(cloth.vertices)} vertices, {size} m; searching for its place on the body")
    alignment = align(cloth.vertices, cloth.faces, shaped, scaled=scaled, up=source.description.up)
    unit = better_unit(source, shaped, alignment.misfit, poor=False) if guessed_unit else None
    return alignment, unit


def _full(unit: str) -> str:
    return UNIT_NAMES.get(unit, unit)


def _note_unit(tried: TryOn, unit: str | None) -> TryOn:
    """Adds to the notes of a garment that its unit was found by its fit."""
    if unit is None:
        return tried
    note = f"unit: {_full(unit)}, as it fits the body so"
    return replace(tried, garment=replace(tried.garment, notes=(note, *tried.garment.notes)))


def _put_on(
    source: GarmentSource,
    shaped: "ShapedBody",
    alignment: Alignment,
    progress: Callable[[int, int], None] | None,
    budget: Budget,
) -> TryOn:
    """Puts an aligned garment on a body, and judges it."""
    cloth, description = source.cloth, source.cloth_description
    made_on, body_notes = body_made_on(description, shaped, source.path)
    loose = loose_garment(cloth, description, made_on, alignment)
    if reason := _hopeless(alignment):
        garment = replace(loose, notes=body_notes + cloth.notes + _describe_alignment(alignment, description.up))
        return TryOn(garment, Fitness(reason, {}, None), alignment)
    tried = _grow_inside(source, shaped, loose, alignment, progress, budget)
    if not tried.fitness.tangled:
        return tried
    try:  # carried by a coarse copy, a garment tangles less
        again = _grow_inside(source, shaped, loose, alignment, progress, budget, carried=True)
    except BadGarment:  # no time left, or the copy fails
        return tried
    crossing = [each.fitness.figures.get("self_crossing_percent", np.inf) for each in (tried, again)]
    better = tried.fitness.reason is not None or crossing[1] < crossing[0]
    return again if again.fitness.reason is None and better else tried


def _grow_inside(
    source: GarmentSource,
    shaped: "ShapedBody",
    loose: Garment,
    alignment: Alignment,
    progress: Callable[[int, int], None] | None,
    budget: Budget,
    *,
    carried: bool = False,
) -> TryOn:
    """Grows the body inside an aligned garment, and judges the result.

    Args:
        source: The garment's file.
        shaped: The body.
        loose: The garment without pins, its vertices where the alignment put them.
        alignment: Where the garment was put.
        progress: See `try_on`.
        budget: Limits the time.
        carried: Whether a coarse copy carries the garment, see `growing.grow`.
    """
    cloth, description = source.cloth, source.cloth_description
    made_on, body_notes = body_made_on(description, shaped, source.path)
    try:
        growth = grow(loose, made_on, alignment, progress, budget, carried=carried)
    except SimulationFailed as failure:
        what = f"{cloth.name} must fit around the body"
        raise BadGarment(what, failure, _CURE) from failure
    notes = body_notes + cloth.notes + _describe_alignment(alignment, description.up) + _describe_growth(growth)
    if alignment.empty:
        notes += (f"openings: {alignment.empty} of {alignment.rims} had no limb to go through them",)
    on_body = replace(cloth, vertices=growth.vertices, faces=loose.faces, rest_edges=loose.rest_edges, notes=notes)
    garment = assemble(on_body, description, made_on)
    if isinstance(garment, OffBody) and description.pins is None:
        # whether anything holds it up without the pins that were guessed is judged when it settles
        notes += ("pins: none, as its highest rim is far from the body",)
        garment = assemble(replace(on_body, notes=notes), replace(description, pins="none"), made_on)
    if isinstance(garment, OffBody):
        raise BadGarment(f"once tried on, {garment.what}", garment.got, _CURE)
    found = fitness(garment, shaped, on_step=lambda: budget.check("all but settling under gravity"))
    return TryOn(garment, found, alignment, growth)


def _hopeless(alignment: Alignment) -> str | None:
    """Returns a reason if no place, size and pose was found in which limbs go through openings."""
    through = [name for name in alignment.through if not name.endswith(EXTREMITIES)]
    if alignment.cost <= HOPELESS_COST or not through:
        return None
    names = ", the ".join(through)
    return (
        f"the body goes through its cloth at the {names}: no opening leads there, at any place, size and pose that was "
        f"tried ({alignment.rims} openings, {alignment.empty} of them without a limb)"
    )


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


def _describe_alignment(alignment: Alignment, up: str | None) -> tuple[str, ...]:
    """Describes where a garment was put, and in which pose; the up axis only if it was guessed."""
    raised, forward, bend, apart = np.degrees(alignment.angles)
    notes = [Z_UP_NOTE] if up is None and alignment.up == "z" else []
    notes += [f"place: moved by ({', '.join(f'{value:.2f}' for value in alignment.moved)}) m"]
    if abs(alignment.scale - 1) > LEAST_RESIZE:
        notes.append(f"size: {100 * (alignment.scale - 1):+.0f} %, cloth and all, as it was made for another body")
    if max(abs(raised), abs(forward), abs(bend), abs(apart)) > 5:
        notes.append(
            f"pose: put on with arms turned up by {raised:.0f} and forward by {forward:.0f} degrees, elbows by "
            f"{bend:.0f}, legs apart by {apart:.0f}, then turned to the rest pose"
        )
    return tuple(notes)


def _describe_growth(growth: Growth) -> tuple[str, ...]:
    """Describes how the body grew inside a garment."""
    notes = []
    if growth.girth < 1:
        notes.append(f"body: grown from {100 * growth.girth:.0f} % of its girth inside the garment")
    if growth.stretched > 1.5:
        notes.append(f"seams: closed, some edges were {growth.stretched:.0f} times too long")
    return tuple(notes)
