"""Backward Euler for one sheet on plain arrays: Newton's method, conjugate gradients, a line search."""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float, Int

from hemline.errors import SimulationFailed

from .air_kernels import air_at_vertices, air_by_triangle
from .clusters import Clusters, make_clusters
from .conjugate_kernels import coarse_matrix, conjugate_gradients, factorise
from .contact import Contact
from .membrane_kernels import green_strain, membrane, membrane_blocks
from .settings import SimSettings
from .sheet import Sheet
from .surface import Planes, Skin, Surface, no_planes
from .vertex_kernels import CHUNK, diagonal_blocks, gradient

Positions = Float[np.ndarray, "verts 3"]

Wind = Callable[[float, Positions], Positions]
"""Wind velocity at every vertex [m/s] from time [s] and positions [m]."""


@dataclass(frozen=True)
class ClothState:
    """All that the next step depends on.

    Attributes:
        positions: [m]
        velocities: [m/s]
        change: Of the velocities in the last step [m/s]; where the next step starts to look.
        load: Force with which the body pressed on each vertex in the last step [N].
        pinched: Vertices whose contact yields.
        time: Since the start [s].
    """

    positions: Positions
    velocities: Positions
    change: Positions
    load: Float[np.ndarray, " verts"]
    pinched: Bool[np.ndarray, " verts"]
    time: float = 0.0


@dataclass(frozen=True)
class Scene:
    """What drives the cloth, at one moment.

    Attributes:
        pinned: Positions of the pinned vertices [m].
        skin: The body's surface, or None.
    """

    pinned: Float[np.ndarray, "pins 3"]
    skin: Skin | None = None


@dataclass(frozen=True)
class StepReport:
    """How a step went.

    Attributes:
        residual_share: Mean residual force over the mean weight of a vertex.
        newton_steps: Newton steps taken.
        solver_steps: Steps of conjugate gradients in all of them.
    """

    residual_share: float
    newton_steps: int
    solver_steps: int


class StepRejected(Exception):
    """A step whose result cannot be used; it is tried again in halves."""


class Stepper:
    """Steps one sheet of cloth; usable without a body.

    Args:
        sheet: The cloth.
        pinned: Vertices whose positions are given.
        surface: The body's mesh, or None.
        settings: Gravity, contact, tolerances; `fps` and `substeps` are not used here.
        wind: Wind over time and place; None: the constant of the settings.

    Example:
        >>> import numpy as np
        >>> from hemline.sim.sheet import Elastic, make_sheet
        >>> corner = np.array([[0.0, 0, 0], [1, 0, 0], [0, 0, 1]])
        >>> stepper = Stepper(make_sheet(np.array([[0, 1, 2]]), np.eye(2)[None], Elastic()))
        >>> state, _ = stepper.advance(stepper.start(corner), 0.1, lambda share: Scene(np.zeros((0, 3))))
        >>> state.velocities[:, 1].round(3)
        array([-0.981, -0.981, -0.981])
    """

    def __init__(
        self,
        sheet: Sheet,
        *,
        pinned: Int[np.ndarray, " pins"] = (),  # type: ignore[assignment]
        surface: Surface | None = None,
        settings: SimSettings | None = None,
        wind: Wind | None = None,
    ):
        self.sheet, self.surface, self.settings, self.wind = sheet, surface, settings or SimSettings(), wind
        self.pinned = np.asarray(pinned, np.int32)
        self.fixed = np.zeros(sheet.vertex_count, bool)
        self.fixed[self.pinned] = True
        young, poisson = sheet.elastic.young, sheet.elastic.poisson
        self.lame, self.shear = young * poisson / (1 - poisson**2), young / (2 * (1 + poisson))
        self.push = self.settings.contact_stiffness * sheet.vertex_area
        self.mean_weight = 9.81 * float(sheet.mass.mean())
        gram = np.einsum("fac,fad->fcd", sheet.shape, sheet.shape)
        self.cap = CAP * sheet.elastic.density * sheet.area / 3 / np.linalg.eigvalsh(gram)[:, 1]
        self.clusters = make_clusters(sheet, self.fixed)
        self._work = _Memory(sheet, self.clusters)

    def start(self, positions: Positions) -> ClothState:
        """At rest at the given positions."""
        count = self.sheet.vertex_count
        x = np.array(positions, np.float64, order="C")
        return ClothState(x, np.zeros((count, 3)), np.zeros((count, 3)), np.zeros(count), np.zeros(count, bool))

    def advance(self, state: ClothState, h: float, scene_at: Callable[[float], Scene]) -> tuple[ClothState, StepReport]:
        """One step of length h; a step that fails is halved and tried again.

        Args:
            state: Where the cloth is.
            h: Length of the step [s].
            scene_at: The scene at a share of the step from 0 to 1.

        Raises:
            SimulationFailed: The shortest step failed too.
        """
        return self._advance(state, h, scene_at, 0.0, 1.0, self.settings.halvings)

    def _advance(self, state, h, scene_at, begin, end, halvings) -> tuple[ClothState, StepReport]:
        try:
            return self.step(state, h * (end - begin), scene_at(begin), scene_at(end))
        except StepRejected as reason:
            if not halvings:
                raise SimulationFailed(f"{reason} in a step of {1000 * h * (end - begin):.3g} ms") from reason
        middle = 0.5 * (begin + end)
        state, _ = self._advance(state, h, scene_at, begin, middle, halvings - 1)
        return self._advance(state, h, scene_at, middle, end, halvings - 1)

    def step(self, state: ClothState, h: float, then: Scene, now: Scene) -> tuple[ClothState, StepReport]:
        """One step of backward Euler, without another try.

        Raises:
            StepRejected: The result is not finite, too fast, or too far from equilibrium.
        """
        step = _Step(self, state, h, then, now)
        taken = solver_steps = 0
        for _ in range(self.settings.newton_steps):
            solver_steps += step.newton()
            taken += 1
            step.touch()
            step.evaluate()
            if step.residual_share < self.settings.residual_share:
                break
        step.check()
        return step.result(), StepReport(step.residual_share, taken, solver_steps)

    def gradient(self, positions: Positions) -> Positions:
        """Gradient of the elastic energy, minus the elastic force [N]; bending included, no inertia, no contact."""
        step = _Step(self, self.start(positions), math.inf, _NOWHERE, _NOWHERE)
        return step.memory.gradient.copy()

    def energy(self, positions: Positions) -> float:
        """Elastic energy [J]."""
        return _Step(self, self.start(positions), math.inf, _NOWHERE, _NOWHERE).energy


class _Memory:
    """Working arrays of one stepper."""

    def __init__(self, sheet: Sheet, clusters: Clusters):
        faces, verts = len(sheet.faces), sheet.vertex_count
        chunks = (verts + CHUNK - 1) // CHUNK
        self.strain = np.zeros((faces, 3))
        self.corner, self.frame, self.tension = np.empty((faces, 9)), np.empty((faces, 6)), np.empty((faces, 3))
        self.face_energy = np.empty(faces)
        self.gradient, self.energy, self.residual = np.empty((verts, 3)), np.empty(chunks), np.empty(chunks)
        self.blocks = np.empty((len(sheet.ring.columns), 9), np.float32)
        self.diagonal, self.inverse = np.empty((verts, 6), np.float32), np.empty((verts, 6), np.float32)
        self.right, self.solution = np.empty((verts, 3), np.float32), np.empty((verts, 3), np.float32)
        self.cg = [np.empty((verts, 3), np.float32) for _ in range(3)]
        patches = len(clusters.members.starts) - 1
        self.band = np.empty((3 * patches, clusters.width))
        self.sums = [np.empty(chunks), np.empty((patches, 4)), np.empty(3 * patches)]
        self.far_bending = sheet.far_bending.astype(np.float32)
        self.air_force, self.air_matrix = np.zeros((faces, 3)), np.zeros((faces, 6))
        self.air, self.air_diagonal = np.zeros((verts, 3)), np.zeros((verts, 6))


_NOWHERE = Scene(np.zeros((0, 3)))


class _Step:
    """One step being solved: the iterate, its contact planes, its energy."""

    def __init__(self, stepper: Stepper, state: ClothState, h: float, then: Scene, now: Scene):
        self.stepper, self.state, self.h, self.then, self.now = stepper, state, h, then, now
        self.sheet, self.settings, self.memory = stepper.sheet, stepper.settings, stepper._work
        sheet, x0 = self.sheet, state.positions
        self.over_h2 = 0.0 if math.isinf(h) else 1 / h**2
        self.viscous = 0.0 if math.isinf(h) else sheet.elastic.damping / h
        self.cap = stepper.cap * self.over_h2
        self.x = x0.copy() if math.isinf(h) else x0 + h * state.velocities
        self.inertial = self.x + (0.0 if math.isinf(h) else h**2) * np.array(self.settings.gravity)
        if math.isfinite(h):
            self.x += h * state.change
        self.x[stepper.pinned] = self.inertial[stepper.pinned] = x0[stepper.pinned] if math.isinf(h) else now.pinned
        green_strain(x0, sheet.faces, sheet.shape, self.memory.strain)
        self._blow()
        push = stepper.push * np.where(state.pinched, self.settings.pinched_share, 1.0)
        self.limit = sheet.elastic.friction * state.load
        self.creep = self.settings.creep * h if math.isfinite(h) else 1.0
        self.contact: Contact | None = None
        if stepper.surface is not None and then.skin is not None and now.skin is not None:
            self.contact = Contact(stepper.surface, then.skin, now.skin, x0, self.x, stepper.fixed, push)
        self.planes: Planes = no_planes(sheet.vertex_count) if self.contact is None else self.contact.planes
        self.evaluate()

    def newton(self) -> int:
        """One Newton step with a line search; returns the steps of conjugate gradients."""
        sheet, memory, planes, stepper = self.sheet, self.memory, self.planes, self.stepper
        grow = 1 + self.viscous
        membrane_blocks(
            sheet.edge_corners.starts, sheet.edge_corners.columns, sheet.edge_slots, sheet.shape, sheet.area,
            memory.frame, memory.tension, grow * stepper.lame, grow * stepper.shear, sheet.ring_bending, memory.blocks,
        )  # fmt: skip
        diagonal_blocks(
            self.x, sheet.mass, self.over_h2, sheet.ring.starts, memory.blocks, sheet.far.starts, sheet.far_bending,
            memory.air_diagonal, planes.normal, planes.point, planes.carried, planes.stiffness, self.limit,
            self.settings.thickness, self.settings.contact_depth, self.creep, stepper.fixed,
            memory.diagonal, memory.inverse,
        )  # fmt: skip
        np.negative(memory.gradient, out=memory.right, casting="same_kind")
        clusters = stepper.clusters
        coarse_matrix(
            clusters.members.starts, clusters.members.columns, clusters.label, stepper.fixed, sheet.ring.starts,
            sheet.ring.columns, memory.blocks, sheet.far.starts, sheet.far.columns, memory.far_bending,
            memory.diagonal, memory.band,
        )  # fmt: skip
        if not factorise(memory.band):
            raise StepRejected("the Hessian is not positive")
        steps = conjugate_gradients(
            sheet.ring.starts, sheet.ring.columns, memory.blocks, sheet.far.starts, sheet.far.columns,
            memory.far_bending, memory.diagonal, memory.inverse, clusters.members.starts, clusters.members.columns,
            clusters.label, stepper.fixed, memory.band, memory.right, self.settings.solver_share,
            self.settings.solver_steps, memory.solution, *memory.cg, *memory.sums,
        )  # fmt: skip
        self._search(memory.solution.astype(np.float64))
        return steps

    def _search(self, direction: Positions) -> None:
        before, energy = self.x, self.energy
        for halving in range(8):
            self.x = before + 0.5**halving * direction
            self.evaluate()
            if self.energy <= energy + 1e-10 * abs(energy):
                return
        self.x = before
        self.evaluate()

    def evaluate(self) -> None:
        """Energy, gradient and residual at the iterate."""
        sheet, memory, planes, stepper = self.sheet, self.memory, self.planes, self.stepper
        membrane(
            self.x, sheet.faces, sheet.shape, sheet.area, memory.strain, stepper.lame, stepper.shear, self.viscous,
            self.cap, memory.corner, memory.frame, memory.tension, memory.face_energy,
        )  # fmt: skip
        gradient(
            self.x, self.inertial, sheet.mass, self.over_h2, sheet.corners.starts, sheet.corners.columns,
            memory.corner, sheet.ring.starts, sheet.ring.columns, sheet.ring_bending, sheet.far.starts,
            sheet.far.columns, sheet.far_bending, self.state.positions, memory.air, memory.air_diagonal,
            planes.normal, planes.point, planes.carried, planes.stiffness, self.limit, self.settings.thickness,
            self.settings.contact_depth, self.creep, stepper.fixed, memory.gradient, memory.energy, memory.residual,
        )  # fmt: skip
        self.energy = float(memory.energy.sum() + memory.face_energy.sum())
        free = max(1, self.sheet.vertex_count - len(stepper.pinned))
        self.residual_share = float(memory.residual.sum()) / free / stepper.mean_weight

    def touch(self) -> None:
        """Look for contact again, where the cloth is now."""
        if self.contact is not None:
            self.contact.move(self.x)
            self.planes = self.contact.planes

    def check(self) -> None:
        """Refuse a result that cannot be used."""
        if not (math.isfinite(self.energy) and np.isfinite(self.x).all()):
            raise StepRejected("positions are not finite")
        speed = float(np.sqrt(((self.x - self.state.positions) ** 2).sum(axis=1).max())) / self.h
        if speed > FASTEST:
            raise StepRejected(f"a vertex moves at {speed:.3g} m/s")
        if self.residual_share > WORST_RESIDUAL:
            raise StepRejected(f"the residual stays at {self.residual_share:.3g} weights")

    def result(self) -> ClothState:
        """The state at the end of the step."""
        penetration = np.clip(self.settings.thickness - self.planes.gap(self.x), 0, self.settings.contact_depth)
        velocities = (self.x - self.state.positions) / self.h
        return ClothState(
            positions=self.x,
            velocities=velocities,
            change=velocities - self.state.velocities,
            load=self.planes.stiffness * penetration,
            pinched=self.state.pinched,
            time=self.state.time + self.h,
        )

    def _blow(self) -> None:
        elastic, memory, state = self.sheet.elastic, self.memory, self.state
        memory.air[:], memory.air_diagonal[:] = 0, 0
        if math.isinf(self.h) or (elastic.drag == 0 and elastic.lift == 0):
            return
        wind = np.empty_like(state.positions)
        wind[:] = self.settings.wind if self.stepper.wind is None else self.stepper.wind(state.time, state.positions)
        air_by_triangle(
            state.positions, state.velocities, wind, self.sheet.faces, elastic.drag, elastic.lift,
            0.5 * self.settings.air_density, memory.air_force, memory.air_matrix,
        )  # fmt: skip
        air_at_vertices(
            self.sheet.corners.starts, self.sheet.corners.columns, memory.air_force, memory.air_matrix,
            state.velocities, 1 / self.h, memory.air, memory.air_diagonal,
        )  # fmt: skip


CAP = 0.9
"""Share of the compression that inertia makes harmless which stays in the Hessian."""

FASTEST = 60.0
"""A vertex faster than this is taken for a step that failed [m/s]."""

WORST_RESIDUAL = 20.0
"""So is a mean residual above this many weights."""


def moved(state: ClothState, positions: Positions, velocities: Positions) -> ClothState:
    """The same state with the cloth moved."""
    return replace(state, positions=positions, velocities=velocities)


__all__ = ["ClothState", "Scene", "StepRejected", "StepReport", "Stepper", "Wind", "moved"]
