"""One step being solved: Newton's method on the step's potential, conjugate gradients, a line search."""

import math
from typing import TYPE_CHECKING

import numpy as np

from hemline.sim.cloth.air_kernels import air_at_vertices, air_by_triangle
from hemline.sim.cloth.hinge_kernels import hinge_forces, hinges_at_vertices
from hemline.sim.cloth.membrane_kernels import green_strain, membrane, membrane_blocks
from hemline.sim.cloth.sheet import Sheet
from hemline.sim.contact.body_contact import Contact
from hemline.sim.contact.pair_kernels import CHUNK as PAIR_CHUNK
from hemline.sim.contact.pair_kernels import pair_blocks, pair_diagonal, pair_forces, pairs_at_vertices
from hemline.sim.contact.pairs import PairRows, Pairs
from hemline.sim.contact.sided_contact import SidedContact, Wearing
from hemline.sim.contact.sides import Sides
from hemline.sim.contact.surface import Planes, Skin, Surface, no_planes
from hemline.sim.solver.block_kernels import blocks_of, vector_of
from hemline.sim.solver.conjugate_kernels import coarse_matrix, conjugate_gradients, factorise
from hemline.sim.solver.layout import Layout

from .state import ClothState, Scene, StepRejected
from .vertex_kernels import CHUNK, diagonal_blocks, elastic_at_vertices, farther_than, gradient, moved, opposed

if TYPE_CHECKING:
    from .stepper import Stepper

FASTEST = 60.0
"""A vertex faster than this is taken for a step that failed [m/s]."""

WORST_ERROR = 0.015
"""So is a mean residual that would move a free vertex farther than this within the step [m]."""


_NO_PAIRS = (
    np.empty((0, 4), np.uint32),
    np.empty((0, 4), np.float32),
    np.empty(0, np.float32),
    np.empty(0, np.uint32),
    np.empty(0, np.uint32),
    np.empty(0, np.float32),
)


class Memory:
    """Working arrays of one stepper."""

    def __init__(self, sheet: Sheet, layout: Layout):
        faces, verts, hinges = len(sheet.faces), sheet.vertex_count, len(sheet.hinge_rest)
        chunks, patches, slots = (verts + CHUNK - 1) // CHUNK, len(layout.begin), len(layout.vertex)
        self.strain = np.zeros((faces, 3))
        self.corner, self.frame, self.tension = np.empty((faces, 9)), np.empty((faces, 6)), np.empty((faces, 3))
        self.face_energy, self.hinge_energy = np.empty(faces), np.empty(hinges)
        self.hinge_gradient, self.bent = np.empty((hinges, 12)), np.zeros((verts, 3))
        self.elastic, self.pressed = np.empty((verts, 3)), np.empty((verts, 3))
        self.gradient, self.residual = np.empty((verts, 3)), np.empty(chunks)
        self.energy, self.bending_energy = np.empty(chunks), np.empty(chunks)
        self.blocks, self.diagonal, self.inverse = (blocks_of(n) for n in (len(sheet.ring.columns), slots, slots))
        self.right, self.solution, *self.vectors = (vector_of(slots) for _ in range(5))
        self.band = np.empty((3 * patches, layout.width))
        self.sums = [np.empty(patches), np.empty(3 * patches), np.empty(3 * patches), vector_of(patches)]
        self.air_force, self.air_matrix = np.zeros((faces, 3)), np.zeros((faces, 6))
        self.air, self.air_diagonal = np.zeros((verts, 3)), np.zeros((verts, 6))
        self.pair_diagonal = np.zeros((verts, 6))
        self.pair_force, self.pair_energy = np.empty((0, 3)), np.empty(0)


class Step:
    """One step of length h: the iterate, its contact planes, its energy. With h infinite: elasticity alone.

    `soft` is the share of the stiffness of contact with the body.
    """

    def __init__(self, stepper: "Stepper", state: ClothState, h: float, then: Scene, now: Scene, *, soft: float = 1.0):
        self.stepper, self.state, self.h = stepper, state, h
        self.sheet, self.settings, self.memory = stepper.sheet, stepper.settings, stepper.memory
        sheet, x0 = self.sheet, state.positions
        moving = math.isfinite(h)
        self.over_h = 1 / h if moving else 0.0
        self.pull = sheet.mass * self.over_h**2
        self.creep = self.settings.creep * h if moving else 1.0
        self.cap = stepper.cap * self.over_h**2
        self.limit = sheet.friction * state.load
        self.inertial = x0 + h * state.velocities + h**2 * np.array(self.settings.gravity) if moving else x0
        self.x = x0 + h * (state.velocities + state.change) if moving else x0.copy()
        if moving:
            self._pin(now)
        green_strain(x0, sheet.faces, sheet.shape, self.memory.strain)
        self._blow()
        self.contact: Contact | None = None
        self.planes: Planes = no_planes(sheet.vertex_count)
        if stepper.surface is not None and then.skin is not None and now.skin is not None:
            self.contact = self._contact(stepper.surface, then.skin, now.skin, soft)
            self.planes = self.contact.planes
        self.coarsened, self.share = False, 0.0
        self.pairs: Pairs | None = None
        if moving and stepper.self_contact is not None:
            stepper.self_contact.begin(x0, self.x)
        if moving and self.contact is not None:
            stepper.body_points.begin(self.contact, self.x)
        self._off_bones = self._kept_off_bones(then, now)
        self._meet()
        self.evaluate()

    def _contact(self, surface: Surface, then: Skin, now: Skin, soft: float) -> Contact:
        """Contact with the body, soft or not."""
        stepper, state, share = self.stepper, self.state, self.settings.pinched_share
        push, moment = soft * stepper.push, (surface, then, now, state.positions, self.x, stepper.fixed)
        if state.sides is None:
            return Contact(*moment, push * np.where(state.pinched, share, 1.0), stepper.last_anchors)
        wearing = Wearing(Sides.of(state.sides, surface), stepper.home, state.pinched, share)
        return SidedContact(*moment, push, stepper.last_anchors, wearing)

    def _kept_off_bones(self, then: Scene, now: Scene) -> list[PairRows]:
        """The pairs of the capsules with worn cloth, if there are any."""
        stepper, x0 = self.stepper, self.state.positions
        if stepper.capsules is None or self.state.sides is None or then.joints is None or now.joints is None:
            return []
        rows = stepper.capsules.rows(x0, self.sheet.faces, stepper.limb_of_face, then.joints, now.joints, stepper.push)
        return [rows] if len(rows) else []

    def newton(self) -> int:
        """One Newton step with a line search; returns the steps of conjugate gradients."""
        sheet, memory, planes, stepper, layout = (
            self.sheet,
            self.memory,
            self.planes,
            self.stepper,
            self.stepper.layout,
        )
        pairs = self._pair_blocks()
        membrane_blocks(
            sheet.edge_corners.starts,
            sheet.edge_corners.columns,
            layout.edge_slots,
            sheet.shape,
            sheet.area,
            memory.frame,
            memory.tension,
            sheet.lame,
            sheet.shear,
            sheet.damping,
            self.over_h,
            layout.ring_bending,
            memory.blocks,
        )
        diagonal_blocks(
            self.x,
            self.pull,
            layout.slot,
            layout.ring.starts,
            memory.blocks,
            layout.far.starts,
            layout.far_bending,
            memory.air_diagonal,
            memory.pair_diagonal,
            planes.normal,
            planes.point,
            planes.carried,
            planes.stiffness,
            self.limit,
            self.settings.thickness,
            self.settings.contact_depth,
            self.creep,
            stepper.fixed,
            memory.diagonal,
            memory.inverse,
        )
        if not self.coarsened:
            self._coarsen()
        opposed(memory.gradient, layout.slot, memory.right)
        steps = conjugate_gradients(
            layout.ring.starts,
            layout.ring.columns,
            memory.blocks,
            layout.far.starts,
            layout.far.columns,
            layout.far_bending,
            memory.diagonal,
            memory.inverse,
            layout.begin,
            layout.end,
            layout.vertex,
            memory.band,
            *pairs,
            memory.right,
            self.settings.solver_share,
            self.settings.solver_steps,
            memory.solution,
            *memory.vectors,
            *memory.sums,
        )
        self._search()
        return steps

    def _meet(self) -> None:
        """Lay the pairs of the cloth with itself and with the body where it is now."""
        stepper, memory = self.stepper, self.memory
        if not math.isfinite(self.h):
            return
        parts = [] if stepper.self_contact is None else stepper.self_contact.lay(self.x)
        if self.contact is not None and len(stepper.body_points):
            parts.append(stepper.body_points.lay())
        if isinstance(self.contact, SidedContact):
            parts += self.contact.second(self.settings.thickness, self.sheet.friction)
        parts += self._off_bones
        if not parts:
            return
        self.pairs = pairs = Pairs.of(parts, self.sheet.vertex_count)
        memory.pair_force = np.empty((len(pairs), 3))
        memory.pair_energy = np.empty((len(pairs) + PAIR_CHUNK - 1) // PAIR_CHUNK)

    def _press(self) -> float:
        """Forces of membrane, bending and pairs at the vertices, into `pressed`; the energy of the pairs."""
        memory, pairs = self.memory, self.pairs
        np.copyto(memory.pressed, memory.elastic)
        if pairs is None or not len(pairs):
            return 0.0
        pair_forces(self.x, *pairs.rows.arrays, self.creep, memory.pair_force, memory.pair_energy)
        pairs_at_vertices(
            pairs.rows.corners, pairs.at.starts, pairs.at.columns, pairs.rows.weights, memory.pair_force, memory.pressed
        )
        return float(memory.pair_energy.sum())

    def _pair_blocks(self) -> tuple[np.ndarray, ...]:
        """The Hessian of the pairs, as the solver wants it; their diagonal blocks."""
        pairs, memory = self.pairs, self.memory
        if pairs is None or not len(pairs):
            memory.pair_diagonal[:] = 0
            return _NO_PAIRS
        block, weights = blocks_of(len(pairs)), pairs.rows.weights
        pair_blocks(self.x, *pairs.rows.arrays, self.creep, block)
        pair_diagonal(pairs.rows.corners, pairs.at.starts, pairs.at.columns, weights, block, memory.pair_diagonal)
        slots = self.stepper.layout.slot[pairs.rows.corners]
        return slots, weights.astype(np.float32), block, pairs.at.starts, pairs.at.columns, vector_of(len(pairs))

    def _coarsen(self) -> None:
        """The coarse level of the preconditioner: that of a step's first Hessian serves the whole step."""
        memory, layout = self.memory, self.stepper.layout
        coarse_matrix(
            layout.begin,
            layout.end,
            layout.patch,
            layout.ring.starts,
            layout.ring.columns,
            memory.blocks,
            layout.far.starts,
            layout.far.columns,
            layout.far_bending,
            memory.diagonal,
            memory.band,
        )
        if not factorise(memory.band):
            raise StepRejected("the Hessian is not positive")
        self.coarsened = True

    def _search(self) -> None:
        before, energy = self.x, self.energy
        self.x = np.empty_like(before)
        for halving in range(8):
            self.share = 0.5**halving
            moved(before, self.share, self.memory.solution, self.stepper.layout.slot, self.x)
            self.evaluate()
            if self.energy <= energy + 1e-10 * abs(energy):
                return
        self.x, self.share = before, 0.0
        self.evaluate()

    def evaluate(self, *, stretched: bool = True) -> None:
        """Energy, gradient and residual at the iterate; not `stretched`: it has not moved, contact has."""
        sheet, memory, planes, stepper = self.sheet, self.memory, self.planes, self.stepper
        if stretched:
            self._stretch()
        pair_energy = self._press()
        gradient(
            self.x,
            self.inertial,
            self.pull,
            memory.pressed,
            self.state.positions,
            memory.air,
            memory.air_diagonal,
            planes.normal,
            planes.point,
            planes.carried,
            planes.stiffness,
            self.limit,
            self.settings.thickness,
            self.settings.contact_depth,
            self.creep,
            stepper.fixed,
            memory.gradient,
            memory.energy,
            memory.residual,
        )
        self.energy = self._elastic_energy + float(memory.energy.sum()) + pair_energy
        free = max(1, sheet.vertex_count - len(stepper.pinned))
        self.residual_share = float(memory.residual.sum()) / free / stepper.mean_weight

    def _stretch(self) -> None:
        """Forces of membrane and bending at the vertices, and their energy."""
        sheet, memory, stepper = self.sheet, self.memory, self.stepper
        membrane(
            self.x,
            sheet.faces,
            sheet.shape,
            sheet.area,
            memory.strain,
            sheet.lame,
            sheet.shear,
            sheet.damping,
            self.over_h,
            self.cap,
            memory.corner,
            memory.frame,
            memory.tension,
            memory.face_energy,
        )
        if len(sheet.hinge_rest):
            hinge_forces(
                self.x,
                sheet.hinges,
                sheet.hinge_weight,
                stepper.hinge_rest,
                memory.hinge_gradient,
                memory.hinge_energy,
            )
            corners = stepper.hinge_corners
            hinges_at_vertices(corners.starts, corners.columns, memory.hinge_gradient, memory.bent)
        elastic_at_vertices(
            self.x,
            sheet.corners.starts,
            sheet.corners.columns,
            memory.corner,
            sheet.ring.starts,
            sheet.ring.columns,
            stepper.bending[0],
            sheet.far.starts,
            sheet.far.columns,
            stepper.bending[1],
            memory.bent,
            memory.elastic,
            memory.bending_energy,
        )
        energies = memory.face_energy, memory.hinge_energy, memory.bending_energy
        self._elastic_energy = float(sum(energy.sum() for energy in energies))

    def touch(self) -> None:
        """Look for contact again where the cloth is now; with the body, unless it hardly moved since."""
        pressed = self.contact is not None and self.contact.move(self.x)
        if self.contact is not None and pressed:
            self.planes = self.contact.planes
            self.stepper.body_points.move(self.x)
        if pressed or self.stepper.self_contact is not None:
            self._meet()
            self.evaluate(stretched=False)

    def check(self) -> None:
        """Refuse a result that cannot be used.

        Raises:
            StepRejected: It is not finite, too fast, or too far from equilibrium.
        """
        if not (math.isfinite(self.energy) and np.isfinite(self.x).all()):
            raise StepRejected("positions are not finite")
        if farther_than(self.x, self.state.positions, FASTEST * self.h):
            speed = float(np.linalg.norm(self.x - self.state.positions, axis=1).max()) / self.h
            raise StepRejected(f"a vertex moves at {speed:.3g} m/s")
        if 9.81 * self.residual_share * self.h**2 > WORST_ERROR:
            raise StepRejected(f"the residual stays at {self.residual_share:.3g} weights")

    def result(self) -> ClothState:
        """The state at the end of the step."""
        if self.contact is not None:
            self.stepper.last_anchors = self.contact.ahead
        sides = self.contact.sides.faces if isinstance(self.contact, SidedContact) else self.state.sides
        penetration = np.clip(self.settings.thickness - self.planes.gap(self.x), 0, self.settings.contact_depth)
        velocities = (self.x - self.state.positions) / self.h
        return ClothState(
            positions=self.x,
            velocities=velocities,
            change=velocities - self.state.velocities,
            load=self.planes.stiffness * penetration,
            pinched=self.state.pinched,
            sides=sides,
            time=self.state.time + self.h,
        )

    def _pin(self, now: Scene) -> None:
        """Put hard pins where the scene wants them; a soft pin's spring and its inertia pull at the mean of both."""
        stepper = self.stepper
        self.x[stepper.pinned] = self.inertial[stepper.pinned] = now.pinned[stepper.hard]
        soft, spring = stepper.held, stepper.spring[:, None]
        inertia = self.pull[soft, None]
        self.inertial[soft] = (inertia * self.inertial[soft] + spring * now.pinned[~stepper.hard]) / (inertia + spring)
        self.pull[soft] += stepper.spring

    def _blow(self) -> None:
        sheet, memory, state = self.sheet, self.memory, self.state
        memory.air[:], memory.air_diagonal[:] = 0, 0
        if math.isinf(self.h) or not (sheet.drag.any() or sheet.lift.any()):
            return
        wind = self.stepper.wind(state.time, state.positions)
        air_by_triangle(
            state.positions,
            state.velocities,
            wind,
            sheet.faces,
            sheet.drag,
            sheet.lift,
            0.5 * self.settings.air_density,
            memory.air_force,
            memory.air_matrix,
        )
        air_at_vertices(
            sheet.corners.starts,
            sheet.corners.columns,
            memory.air_force,
            memory.air_matrix,
            state.velocities,
            1 / self.h,
            memory.air,
            memory.air_diagonal,
        )
