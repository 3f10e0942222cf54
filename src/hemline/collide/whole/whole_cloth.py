"""Keeps a garment in one piece between the animator and the projection.

What an animator makes may cut deep into a limb. The projection moves each vertex alone, so neighbours would come out on
different sides of it. This step takes patches of cloth out as a whole, and shortens edges that are too long.
"""

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Self

import numpy as np

from hemline.arrays import Float, Int, Points, UInt, Vertices
from hemline.collide.surface.posed_surface import PosedSurface
from hemline.collide.surface.garment_on_body import GarmentOnBody
from hemline.meshes import ClosestTree

from .limit_kernels import decay_shifts, limit_coarse, limit_fine, carry_vertices
from .models import CoarseModel, FineModel, coarse_model, fine_model
from .plane_kernels import LimbGrid, Limbs, SampleMemory, fill_cells, grid_around, constrain_samples, place_pins

if TYPE_CHECKING:
    from hemline.bodies import PosedBody, ShapedBody
    from hemline.garments import Garment


@dataclass(frozen=True)
class WholeSettings:
    """Sizes, distances and times of the whole-cloth step."""

    controls: int = 800
    """Control vertices."""
    samples: int = 2000
    """Vertices that the skin holds off."""
    margin: float = 0.01
    """Height over the skin that a sample is held at, less where it is lower at rest [m]."""
    least: float = 0.005
    """It is not held lower than this [m]."""
    reach: float = 0.008
    """How far above that height it is held [m]."""
    stretch: float = 1.06
    """Longest that an edge may be, over its length at rest."""
    memory: float = 0.1
    """Time constant with which shifts of control vertices fade [s]."""
    speed: float = 0.36
    """Fastest that they fade [m/s]."""
    keep: float = 0.97
    """What is kept of a vertex's fine offset after a thirtieth of a second."""
    rounds: int = 2
    """How often samples look for the skin in a frame."""
    coarse_sweeps: int = 6
    """Sweeps over coarse edges after each look."""
    fine_sweeps: int = 4
    """Sweeps over all edges."""
    cell: float = 0.05
    """Size of the cells that tell where skin may be near [m]."""
    widen: float = 0.02
    """How far from skin a cell counts as near [m]."""

    def at_detail(self, detail: float) -> "WholeSettings":
        """Control vertices and samples for a share of a garment's vertices, above 0 and at most 1."""
        return replace(self, controls=math.ceil(detail * self.controls), samples=math.ceil(detail * self.samples))


@dataclass(frozen=True)
class WholeState:
    """What moves from frame to frame: plain arrays in the frame of the key bone."""

    frame: int
    """Frames done."""
    shifts: Float[np.ndarray, "controls 3"]
    """Of the control vertices [m]."""
    offsets: Float[np.ndarray, "verts 3"]
    """Of each vertex, beside what control vertices do [m]; in the kernels' order."""
    memory: SampleMemory


@dataclass(frozen=True)
class WholeCloth:
    """A garment on a body made ready for the step; frozen. Make it with `WholeCloth.prepare`."""

    on_body: GarmentOnBody
    coarse: CoarseModel
    fine: FineModel
    pins: Int[np.ndarray, " pins"]
    """Hard pins, in the kernels' order of vertices."""
    pin_corners: Int[np.ndarray, "pins 3"]
    pin_weights: Float[np.ndarray, "pins 3"]
    pin_heights: Float[np.ndarray, " pins"]
    pin_joints: Int[np.ndarray, " pins"]
    """The joint that carries each pin; -1 for one on the skin."""
    pin_offsets: Float[np.ndarray, "pins 3"]
    """From that joint [m]."""
    margins: Float[np.ndarray, " samples"]
    """Height that each sample is held at [m]."""
    limbs: Limbs
    patch_bit: UInt[np.ndarray, " patches"]
    settings: WholeSettings

    @cached_property
    def control_pins(self) -> Int[np.ndarray, " pinned"]:
        """Control vertices that are hard pins: their numbers among the controls."""
        return np.flatnonzero(self.coarse.free == 0)

    @cached_property
    def control_pin_numbers(self) -> Int[np.ndarray, " pinned"]:
        """Their numbers among the pins."""
        return np.searchsorted(self.pins, self.coarse.controls[self.control_pins])

    @classmethod
    def prepare(
        cls,
        shaped: "ShapedBody",
        garment: "Garment",
        worn: GarmentOnBody,
        settings: WholeSettings | None = None,
    ) -> Self:
        """Spread control vertices and samples over a garment: less than a second, once.

        Args:
            shaped: The body.
            garment: The garment.
            worn: Both, cut into patches and blocks.
            settings: Sizes, distances and times.
        """
        settings = settings or WholeSettings()
        number = np.empty(len(worn.order), np.int64)
        number[worn.order] = np.arange(len(worn.order))
        hard = np.flatnonzero(np.isinf(garment.pins.stiffness))
        hard = hard[np.argsort(number[garment.pins.vertices[hard]])]
        pins, faces = number[garment.pins.vertices[hard]], number[garment.faces]
        vertices = garment.vertices[worn.order]
        coarse = coarse_model(vertices, faces, garment.rest_edges, pins, settings.controls, settings.samples)
        names = np.unique(worn.patches.limb)
        bits, patch_bits = (
            np.left_shift(np.uint32(1), np.searchsorted(names, limb).astype(np.uint32))
            for limb in (worn.patches.limb, worn.patches.patch_limb)
        )
        return cls(
            worn=worn,
            coarse=coarse,
            fine=fine_model(faces, garment.rest_edges, pins),
            pins=pins.astype(np.int32),
            pin_corners=worn.patches.number[shaped.body.faces[garment.pins.body_faces[hard]]].astype(np.int32),
            pin_weights=garment.pins.barycentric[hard].astype(np.float32),
            pin_heights=garment.pins.heights[hard].astype(np.float32),
            pin_joints=garment.pins.joints[hard],
            pin_offsets=garment.pins.offsets[hard],
            margins=_margins(shaped, vertices[coarse.samples], settings),
            limbs=Limbs(worn.patches.limb, bits),
            patch_bit=patch_bits,
            settings=settings,
        )

    def start(self) -> WholeState:
        """The state before the first frame: nothing shifted, each sample next to the skin that is nearest at rest."""
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
        """Hold the cloth of one frame together.

        Args:
            state: From `start`, or from the frame before; it is not changed.
            posed: The body in this frame.
            vertices: What the animator made [m].
            dt: Time since the frame before [s].
            surface: The body's surface in this frame (`worn.surface(posed)`), where it is there already.

        Returns:
            The state after, and the vertices [m].

        Raises:
            BadGarment: Another number of vertices than was prepared, or positions that are not finite.
        """
        settings, coarse = self.settings, self.coarse
        surface = surface or self.on_body.surface(posed)
        points = surface.into_bone_frame(self.on_body.check_vertices(vertices), self.on_body.order)
        shifts = np.empty_like(state.shifts)
        decay_shifts(state.shifts, np.float32(math.exp(-dt / settings.memory)), np.float32(settings.speed * dt), shifts)
        places = self.pin_places(posed, surface)
        shifts[self.control_pins] = places[self.control_pin_numbers] - points[coarse.controls[self.control_pins]]
        cells, memory = self.cells(surface), state.memory.copy()
        count = len(coarse.samples)
        planes, held = np.empty((count, 4), np.float32), np.empty(count, np.int64)
        listed = np.arange(count)
        for again in range(settings.rounds):
            count = constrain_samples(
                surface.skin,
                self.limbs,
                cells,
                points,
                shifts,
                coarse,
                listed,
                again > 0,
                state.frame,
                self.margins,
                np.float32(settings.reach),
                memory,
                planes,
                held,
            )
            listed = held[:count].copy()
            limit_coarse(points, coarse, planes, listed, settings.coarse_sweeps, shifts)
        moved, carried = np.empty_like(points), np.empty_like(points)
        keep = np.float32(settings.keep ** (30 * dt))
        carry_vertices(points, shifts, coarse.weight_ids, coarse.weights, state.offsets, keep, moved, carried)
        moved[self.pins] = places
        limit_fine(self.fine, np.float32(settings.stretch), settings.fine_sweeps, moved)
        after = WholeState(state.frame + 1, shifts, moved - carried, memory)
        return after, surface.out_of_bone_frame(moved, self.on_body.order)

    def pin_places(self, posed: "PosedBody", surface: PosedSurface) -> Points:
        """Where the hard pins are, as `garments.Pins.positions`, in the frame of the key bone [m]."""
        places = np.empty((len(self.pins), 3), np.float32)
        place_pins(surface.skin, self.pin_corners, self.pin_weights, self.pin_heights, places)
        hung = np.flatnonzero(self.pin_joints >= 0)
        if len(hung):
            joint = self.pin_joints[hung]
            turned = np.einsum("pij,pj->pi", posed.transforms[joint, :, :3], self.pin_offsets[hung])
            places[hung] = surface.into_bone_frame((posed.joints[joint] + turned).astype(np.float32), np.arange(len(hung)))
        return places

    def cells(self, surface: PosedSurface) -> LimbGrid:
        """Which limbs may be near, in a grid over the body."""
        settings, boxes = self.settings, surface.skin.patch_box
        size, widen = np.float32(settings.cell), np.float32(settings.widen)
        low, counts = np.empty(3, np.float32), np.empty(3, np.int64)
        grid_around(boxes, size, widen, low, counts)
        bits = np.zeros(tuple(counts), np.uint32)
        fill_cells(boxes, self.patch_bit, low, size, widen, bits)
        return LimbGrid(bits, low, size)


def _margins(shaped: "ShapedBody", samples: Points, settings: WholeSettings) -> Float[np.ndarray, " samples"]:
    """Cloth that lies close at rest, a waistband, is held no higher than there."""
    closest = ClosestTree(shaped.vertices.astype(np.float64), shaped.body.faces).closest(samples)
    return np.clip(closest.distances, settings.least, settings.margin).astype(np.float32)
