"""The constants of a sheet while it is stepped: the sheet itself, pins, topology of the body, settings."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from hemline.errors import BadInput
from hemline.sim.cloth.elastic_kernels import BendingMatrix
from hemline.sim.cloth.membrane_kernels import Fabric
from hemline.sim.cloth.rows import Rows, incidence
from hemline.sim.cloth.sheet import Sheet
from hemline.sim.cloth.wind import Wind, wind_of, with_checks
from hemline.sim.contact.body.surface import BodySurface
from hemline.sim.contact.pairs.capsules import Capsules
from hemline.sim.settings import SimSettings
from hemline.sim.solver.layout import Layout, make_layout

COMPRESSION_RATIO = 0.9
"""Fraction that stays in the Hessian of the largest compression whose negative stiffness inertia still outweighs."""


@dataclass(frozen=True, eq=False)
class ClothModel:
    """The constants of one sheet; made by `make_model`.

    Attributes:
        sheet: The cloth.
        settings: Gravity, contact, tolerances.
        wind: Wind as a function of time and place.
        surface: Topology of the body's mesh, or None.
        capsules: Capsules around the bones of the body, or None.
        rest_limb: Limb of the body that each vertex lies on at rest.
        limb_of_face: Limb that all corners of a triangle lie on; -1 if they lie on several, or if one is fixed.
        hard: Mask of the hard pins among all pins.
        pinned: Vertices of the hard pins, which are moved to their targets.
        soft_pins: Vertices of the soft pins.
        spring: Spring stiffness of each soft pin [N/m].
        fixed: Mask of the vertices with a hard pin.
        contact_stiffness: Stiffness of each vertex against the body [N/m].
        mean_weight: Mean weight of a vertex [N].
        cap: Largest compression of each triangle that stays in the Hessian, times h^2 [N m s^2].
        fabric: Triangles of the sheet, in the form that the membrane's kernels take.
        bending: Bending matrix for forces; 0 if hinges replace it.
        hinge_rest: 2 sin(angle / 2) of each hinge at rest.
        hinge_corners: Hinges of each vertex, encoded as 4 hinge + corner.
        layout: The solver's order of vertices.
    """

    sheet: Sheet
    settings: SimSettings
    wind: Wind
    surface: BodySurface | None
    capsules: Capsules | None
    rest_limb: Int[np.ndarray, " verts"]
    limb_of_face: Int[np.ndarray, " faces"]
    hard: Bool[np.ndarray, " pins"]
    pinned: Int[np.ndarray, " hard_pins"]
    soft_pins: Int[np.ndarray, " soft_pins"]
    spring: Float[np.ndarray, " soft_pins"]
    fixed: Bool[np.ndarray, " verts"]
    contact_stiffness: Float[np.ndarray, " verts"]
    mean_weight: float
    cap: Float[np.ndarray, " faces"]
    fabric: Fabric
    bending: BendingMatrix
    hinge_rest: Float[np.ndarray, " hinges_or_none"]
    hinge_corners: Rows
    layout: Layout


def make_model(
    sheet: Sheet,
    *,
    pinned: Int[np.ndarray, " pins"] = (),  # type: ignore[assignment]
    pin_stiffness: Float[np.ndarray, " pins"] | None = None,
    surface: BodySurface | None = None,
    capsules: Capsules | None = None,
    rest_limb: Int[np.ndarray, " verts"] | None = None,
    settings: SimSettings | None = None,
    wind: Wind | None = None,
) -> ClothModel:
    """Makes the model of a sheet; see `Stepper` for the arguments.

    Raises:
        BadInput: A pin is not a vertex of the sheet, or its stiffness is not positive.
    """
    settings, count = settings or SimSettings(), sheet.vertex_count
    pins, stiffness = _check_pins(pinned, pin_stiffness, count)
    hard = np.isinf(stiffness)
    fixed = np.zeros(count, bool)
    fixed[pins[hard]] = True
    rest_limb = np.zeros(count, np.int64) if rest_limb is None else rest_limb
    limb = rest_limb[sheet.faces]
    one_limb = (limb == limb[:, :1]).all(axis=1) & ~fixed[sheet.faces].any(axis=1)
    gram = np.einsum("fac,fad->fcd", sheet.shape, sheet.shape)
    bending = BendingMatrix(*sheet.ring, sheet.ring_bending, *sheet.far, sheet.far_bending)
    if len(sheet.hinge_rest):
        # if the rest shape is not flat, hinges compute the forces; the Hessian remains that of a flat sheet
        nothing = np.zeros_like(sheet.ring_bending), np.zeros_like(sheet.far_bending)
        bending = bending._replace(ring_bending=nothing[0], far_bending=nothing[1])
    return ClothModel(
        sheet=sheet,
        settings=settings,
        wind=wind_of(settings) if wind is None else with_checks(wind),
        surface=surface,
        capsules=capsules,
        rest_limb=rest_limb,
        limb_of_face=np.where(one_limb, limb[:, 0], -1),
        hard=hard,
        pinned=pins[hard],
        soft_pins=pins[~hard],
        spring=stiffness[~hard],
        fixed=fixed,
        contact_stiffness=settings.contact_stiffness * sheet.vertex_area,
        mean_weight=9.81 * float(sheet.mass.mean()),
        cap=COMPRESSION_RATIO * sheet.density * sheet.area / 3 / np.linalg.eigvalsh(gram)[:, 1],
        fabric=Fabric(sheet.faces, sheet.shape, sheet.area, sheet.lame, sheet.shear, sheet.damping),
        bending=bending,
        hinge_rest=2 * np.sin(0.5 * sheet.hinge_rest),
        hinge_corners=incidence(sheet.hinges.ravel(), np.arange(sheet.hinges.size), count),
        layout=make_layout(sheet, fixed),
    )


def _check_pins(pinned: np.ndarray, pin_stiffness: np.ndarray | None, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Returns pins and stiffnesses as arrays.

    Raises:
        BadInput: A pin is not a vertex of the sheet, or its stiffness is not positive.
    """
    pins = np.asarray(pinned, np.int32)
    if pins.size and not (pins.min() >= 0 and pins.max() < count):
        got = f"{pins.min()} to {pins.max()} for {count} vertices"
        raise BadInput("pins must be vertices of the sheet", got, "count from 0")
    stiffness = np.full(len(pins), np.inf) if pin_stiffness is None else np.asarray(pin_stiffness, np.float64)
    if stiffness.shape != pins.shape or not (stiffness > 0).all():
        got = f"shape {stiffness.shape}" if stiffness.shape != pins.shape else stiffness.min()
        raise BadInput(f"{len(pins)} pins must have positive stiffnesses", got, "use infinity for a hard pin")
    return pins, stiffness
