"""Keeps a garment in one piece between the animator and the projection.

An animator may put cloth deep into a limb. The projection moves each vertex alone, so neighbours would come out on
different sides of the limb. This step takes patches of cloth out as a whole, and shortens edges that are too long.
"""

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Self

import numpy as np

from hemline.arrays import Float, Int, Points, UInt, Vertices
from hemline.collide.surface.garment_on_body import GarmentOnBody
from hemline.collide.surface.posed_surface import PosedSurface
from hemline.meshes import ClosestTree

from .limit_kernels import carry_vertices, decay_shifts, limit_coarse, limit_fine
from .models import CoarseModel, FineModel, coarse_model, fine_model
from .plane_kernels import (
    HalfSpaces,
    LimbGrid,
    Limbs,
    SampleMemory,
    Samples,
    ShiftedCloth,
    constrain_samples,
    fill_cells,
    grid_around,
    place_pins,
)

if TYPE_CHECKING:
    from hemline.bodies import PosedBody, ShapedBody
    from hemline.garments import Garment


@dataclass(frozen=True)
class WholeSettings:
    """Sizes, distances and times of the whole-cloth step."""

    controls: int = 800
    """Number of control vertices."""
    samples: int = 2000
    """Number of vertices that are kept over the skin."""
    margin: float = 0.01
    """Least height of a sample over the skin; lower where the garment is lower at rest [m]."""
    least: float = 0.005
    """Lower bound of that least height [m]."""
    reach: float = 0.008
    """A sample is constrained up to this height above its least height [m]."""
    stretch: float = 1.06
    """Longest length of an edge over its length at rest [1]."""
    memory: float = 0.1
    """Time constant with which shifts of control vertices fade [s]."""
    speed: float = 0.36
    """Largest speed at which shifts fade [m/s]."""
    keep: float = 0.97
    """Fraction of a vertex's fine offset that remains after a thirtieth of a second."""
    rounds: int = 2
    """Passes in a frame in which samples search for the skin."""
    coarse_sweeps: int = 6
    """Sweeps over coarse edges after each of these passes."""
    fine_sweeps: int = 4
    """Sweeps over all edges."""
    cell: float = 0.05
    """Edge length of the grid cells that tell where skin may be near [m]."""
    widen: float = 0.02
    """Distance from the skin up to which a cell counts as near [m]."""

    def at_detail(self, detail: float) -> "WholeSettings":
        """Returns settings for a fraction of a garment's vertices, above 0 and at most 1."""
        return replace(self, controls=math.ceil(detail * self.controls), samples=math.ceil(detail * self.samples))


@dataclass(frozen=True)
class WholeState:
    """State of the step: plain arrays in the frame of the key bone."""

    frame: int
    """Number of frames done."""
    shifts: Float[np.ndarray, "controls 3"]
    """Shifts of the control vertices [m]."""
    offsets: Float[np.ndarray, "verts 3"]
    """Fine offset of each vertex, beyond what control vertices do [m]; in the kernels' order."""
    memory: SampleMemory
    """Face, height and freshness of each sample."""


@dataclass(frozen=True)
class WholeCloth:
    """Keeps the cloth of a garment on a body in one piece; frozen. Make one with `WholeCloth.prepare`."""

    on_body: GarmentOnBody
    coarse: CoarseModel
    fine: FineModel
    pins: Int[np.ndarray, " pins"]
    """Hard pins, in the kernels' order of vertices."""
    pin_corners: Int[np.ndarray, "pins 3"]
    pin_weights: Float[np.ndarray, "pins 3"]
    pin_heights: Float[np.ndarray, " pins"]
    pin_joints: Int[np.ndarray, " pins"]
    """Joint that carries each pin; -1 for a pin on the skin."""
    pin_offsets: Float[np.ndarray, "pins 3"]
    """Position of each pin relative to its joint [m]."""
    margins: Float[np.ndarray, " samples"]
    """Least height of each sample over the skin [m]."""
    limbs: Limbs
    patch_bit: UInt[np.ndarray, " patches"]
    settings: WholeSettings

    @cached_property
    def control_pins(self) -> Int[np.ndarray, " pinned"]:
        """Numbers, among the controls, of control vertices that are hard pins."""
        return np.flatnonzero(self.coarse.free == 0)

    @cached_property
    def control_pin_numbers(self) -> Int[np.ndarray, " pinned"]:
        """Numbers, among the pins, of control vertices that are hard pins."""
        return np.searchsorted(self.pins, self.coarse.controls[self.control_pins])

    @classmethod
    def prepare(
        cls,
        shaped: "ShapedBody",
        garment: "Garment",
        on_body: GarmentOnBody,
        settings: WholeSettings | None = None,
    ) -> Self:
        """Spreads control vertices and samples over a garment; takes less than a second.

        Args:
            shaped: The body.
            garment: The garment.
            on_body: Body and garment, cut into patches and blocks.
            settings: Sizes, distances and times.
        """
        settings = settings or WholeSettings()
        number = np.empty(len(on_body.order), np.int64)
        number[on_body.order] = np.arange(len(on_body.order))
        hard = np.flatnonzero(np.isinf(garment.pins.stiffness))
        hard = hard[np.argsort(number[garment.pins.vertices[hard]])]
        pins, faces = number[garment.pins.vertices[hard]], number[garment.faces]
        vertices = garment.vertices[on_body.order]
        coarse = coarse_model(vertices, faces, garment.rest_edges, pins, settings.controls, settings.samples)
        names = np.unique(on_body.patches.limb)
        bits, patch_bits = (
            np.left_shift(np.uint32(1), np.searchsorted(names, limb).astype(np.uint32))
            for limb in (on_body.patches.limb, on_body.patches.patch_limb)
        )
        return cls(
            on_body=on_body,
            coarse=coarse,
            fine=fine_model(faces, garment.rest_edges, pins),
            pins=pins.astype(np.int32),
            pin_corners=on_body.patches.number[shaped.body.faces[garment.pins.body_faces[hard]]].astype(np.int32),
            pin_weights=garment.pins.barycentric[hard].astype(np.float32),
            pin_heights=garment.pins.heights[hard].astype(np.float32),
            pin_joints=garment.pins.joints[hard],
            pin_offsets=garment.pins.offsets[hard],
            margins=_margins(shaped, vertices[coarse.samples], settings),
            limbs=Limbs(on_body.patches.limb, bits),
            patch_bit=patch_bits,
            settings=settings,
        )

    def start(self) -> WholeState:
        """Returns the state before the first frame: no shifts, each sample next to the skin that is nearest at rest."""
        samples = self.coarse.samples
        return WholeState(
            frame=0,
            shifts=np.zeros((len(self.coarse.controls), 3), np.float32),
            offsets=np.zeros((len(self.on_body.order), 3), np.float32),
            memory=SampleMemory(
                faces=self.on_body.nearest_faces[samples].astype(np.int64),
                heights=np.zeros(len(samples), np.float32),
                fresh=np.ones(len(samples), np.bool_),
            ),
        )

    def step(
        self,
        state: WholeState,
        posed: "PosedBody",
        vertices: Vertices,
        *,
        dt: float,
        surface: PosedSurface | None = None,
    ) -> tuple[WholeState, Vertices]:
        """Keeps the cloth of one frame together.

        Args:
            state: State from `start`, or from the frame before; it is not changed.
            posed: The body in this frame.
            vertices: The garment as the animator made it [m].
            dt: Time since the frame before [s].
            surface: The body's surface in this frame (`on_body.surface(posed)`), if it was computed already.

        Returns:
            The next state, and the vertices [m].

        Raises:
            BadGarment: The number of vertices differs from the prepared garment's, or a position is not finite.
        """
        settings, coarse = self.settings, self.coarse
        surface = surface or self.on_body.surface(posed)
        points = surface.into_bone_frame(self.on_body.check_vertices(vertices), self.on_body.order)
        shifts = np.empty_like(state.shifts)
        decay_shifts(state.shifts, np.float32(math.exp(-dt / settings.memory)), np.float32(settings.speed * dt), shifts)
        places = self.pin_places(posed, surface)
        shifts[self.control_pins] = places[self.control_pin_numbers] - points[coarse.controls[self.control_pins]]
        grid, memory, count = self.limb_grid(surface), state.memory.copy(), len(coarse.samples)
        spaces = HalfSpaces(np.empty((count, 4), np.float32), np.empty(count, np.int64))
        cloth, listed, reach = ShiftedCloth(points, shifts), np.arange(count), np.float32(settings.reach)
        for turn in range(settings.rounds):
            samples = Samples(listed, self.margins, reach, state.frame, turn > 0)
            count = constrain_samples(surface.skin, self.limbs, grid, cloth, coarse, samples, memory, spaces)
            listed = spaces.constrained[:count].copy()
            limit_coarse(points, coarse, spaces.planes, listed, settings.coarse_sweeps, shifts)
        moved, carried = np.empty_like(points), np.empty_like(points)
        keep = np.float32(settings.keep ** (30 * dt))
        carry_vertices(cloth, coarse, state.offsets, keep, moved, carried)
        moved[self.pins] = places
        limit_fine(self.fine, np.float32(settings.stretch), settings.fine_sweeps, moved)
        after = WholeState(state.frame + 1, shifts, moved - carried, memory)
        return after, surface.out_of_bone_frame(moved, self.on_body.order)

    def pin_places(self, posed: "PosedBody", surface: PosedSurface) -> Points:
        """Returns the positions of the hard pins, see `garments.Pins.on`, in the frame of the key bone [m]."""
        places = np.empty((len(self.pins), 3), np.float32)
        place_pins(surface.skin, self.pin_corners, self.pin_weights, self.pin_heights, places)
        on_joints = np.flatnonzero(self.pin_joints >= 0)
        if len(on_joints):
            joint = self.pin_joints[on_joints]
            turned = np.einsum("pij,pj->pi", posed.transforms[joint, :, :3], self.pin_offsets[on_joints])
            places[on_joints] = surface.into_bone_frame(
                (posed.joints[joint] + turned).astype(np.float32), np.arange(len(on_joints))
            )
        return places

    def limb_grid(self, surface: PosedSurface) -> LimbGrid:
        """Returns a grid over the body that tells which limbs may be near."""
        settings, boxes = self.settings, surface.skin.patch_box
        size, widen = np.float32(settings.cell), np.float32(settings.widen)
        low, counts = np.empty(3, np.float32), np.empty(3, np.int64)
        grid_around(boxes, size, widen, low, counts)
        bits = np.zeros(tuple(counts), np.uint32)
        fill_cells(boxes, self.patch_bit, low, size, widen, bits)
        return LimbGrid(bits, low, size)


def _margins(shaped: "ShapedBody", samples: Points, settings: WholeSettings) -> Float[np.ndarray, " samples"]:
    """Returns the least heights of samples; cloth that lies close at rest, such as a waistband, is kept no higher."""
    closest = ClosestTree(shaped.vertices.astype(np.float64), shaped.body.faces).closest(samples)
    return np.clip(closest.distances, settings.least, settings.margin).astype(np.float32)
