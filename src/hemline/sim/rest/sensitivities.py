"""How a settled garment changes when the body turns a joint, changes its shape, or the cloth its material."""

from dataclasses import fields, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from jaxtyping import Float

from hemline.arrays import Faces
from hemline.bodies.skinning_kernels import area_normals
from hemline.bodies.velocities import reshaping, turning
from hemline.errors import BadInput, SimulationFailed
from hemline.garments.material import Material
from hemline.motions.motion import JOINT_COUNT, JOINT_NAMES, Pose
from hemline.motions.quaternions import from_axis_angle, multiply
from hemline.sim.cloth.sheet import Positions
from hemline.sim.contact.body.friction_anchors import FrictionAnchors
from hemline.sim.contact.body.surface import MovingSkin
from hemline.sim.step.dressed_body import DressedBody

from .rest import Rest
from .static_hessian import sheet_hessian
from .static_step import STICK_SLIP, CreaseFaces, StaticStep
from .statics_kernels import closest_on_faces

if TYPE_CHECKING:
    from scipy.sparse.linalg import SuperLU

    from hemline.bodies import PosedBody

CONTACT_DIFFERENCE = 1e-8
"""How far vertices and body are moved for differences of forces [m]: by a hundredth of a weight in contact."""

TURN, RESHAPE = 1e-2, 0.1
"""Angle [rad] and shape coefficient over which the way of pins is differenced."""

SINGULAR_PIVOT = 1e-13
"""Share of the largest pivot below which one is 0 but for rounding."""

CONSTANTS = ("density", "young", "poisson", "bending", "friction", "thickness", "contact_stiffness")
"""Constants of material and settings that `Sensitivities.constant` knows."""


class Sensitivities:
    r"""Derivatives of a settled garment, by the implicit function theorem.

    In equilibrium the forces $f(x, \theta)$ vanish whatever $\theta$ is, so

    $$\frac{dx}{d\theta} = -\left(\frac{\partial f}{\partial x}\right)^{-1} \frac{\partial f}{\partial \theta}$$

    with the whole Hessian: compression, the curvature of the body, friction and its load included, which make it not
    quite symmetric. It is factorised once; each direction takes one solve and one difference of the forces of contact
    at fixed cloth, which holds to 1e-6. Vertices that slide, stick or touch are taken to go on doing so.

    Args:
        rest: The settled garment. The nearer to equilibrium, the truer: a residual share of 0.01 is enough.

    Raises:
        SimulationFailed: The equilibrium is not isolated (cloth that nothing holds in some direction).

    Source: Wu et al., "AgentDress: Realtime Clothing Synthesis for Virtual Agents using Plausible
        Deformations", 2021, section 3.4, the sensitivities of Eq. 7; Xu et al., "Sensitivity-optimized rigging for
        example-based real-time clothing synthesis", 2014. Differs: they difference simulations of turned joints; this
        is the limit of that.
    """

    def __init__(self, rest: Rest):
        self.rest = rest
        self._dressed = DressedBody(rest.garment, rest.shaped, rest.settings)
        self._posed = rest.shaped.posed(rest.pose)
        self._skin = _skin(self._posed.vertices.astype(np.float64), self._posed.faces)
        self._touching = np.flatnonzero(rest.load > 0)
        self._free = np.flatnonzero(~self._dressed.model.fixed)
        self._dofs = (3 * self._free[:, None] + np.arange(3)).ravel()

    def turn(self, joint: int | str, axis: Float[np.ndarray, "3"]) -> Positions:
        """Change of the garment while a joint turns about an axis of its own frame, R exp(angle axis).

        Args:
            joint: Number or name.
            axis: Unit axis in the joint's frame; in the T-pose those are the world's.

        Returns:
            Change of each vertex [m/rad].

        Raises:
            BadInput: No such joint, an axis that is not a finite vector.
        """
        number = JOINT_NAMES.index(joint) if joint in JOINT_NAMES else joint
        if not isinstance(number, int | np.integer) or not 0 <= number < JOINT_COUNT:
            raise BadInput("no such joint", repr(joint), f"use 0 to {JOINT_COUNT - 1}, or one of {JOINT_NAMES}")
        direction = np.asarray(axis, np.float64)
        if direction.shape != (3,) or not np.isfinite(direction).all():
            raise BadInput("'axis' must be three finite numbers", axis, "give a unit vector in the joint's frame")
        ends, rest = [], self.rest
        for way in (TURN, -TURN):
            rotations = rest.pose.rotations.astype(np.float64)
            rotations[number] = multiply(rotations[number], from_axis_angle(way * direction))
            ends.append(rest.shaped.posed(Pose(rotations, rest.pose.translation)))
        return self._moved(turning(self._posed, int(number), direction), self._pins_between(ends[0], ends[1], TURN))

    def turns(self) -> Float[np.ndarray, "joints 3 verts 3"]:
        """Change of the garment for each joint about each of its three axes [m/rad]."""
        return np.array([[self.turn(joint, axis) for axis in np.eye(3)] for joint in range(JOINT_COUNT)])

    def beta(self, index: int) -> Positions:
        """Change of the garment while a shape coefficient of the body grows.

        Args:
            index: Number of the coefficient.

        Returns:
            Change of each vertex [m] a standard deviation.

        Raises:
            BadInput: The body has no such coefficient.
        """
        count = len(self.rest.shaped.betas)
        if not 0 <= index < count:
            raise BadInput("no such shape coefficient", index, f"use 0 to {count - 1}")
        ends, rest = [], self.rest
        for way in (RESHAPE, -RESHAPE):
            betas = rest.shaped.betas.copy()
            betas[index] += way
            ends.append(rest.shaped.body.shaped(betas).posed(rest.pose))
        return self._moved(reshaping(self._posed, index), self._pins_between(ends[0], ends[1], RESHAPE))

    def constant(self, name: str) -> Positions:
        """Change of the garment while a constant of its material, or of contact, grows.

        Args:
            name: One of `CONSTANTS`.

        Returns:
            Change of each vertex [m] a unit of the constant.

        Raises:
            BadInput: No such constant.
        """
        if name not in CONSTANTS:
            raise BadInput("no such constant", repr(name), f"use one of {', '.join(CONSTANTS)}")
        of_material = name in {field.name for field in fields(Material)}
        value = getattr(self.rest.garment.material if of_material else self.rest.settings, name)
        step = CONTACT_DIFFERENCE if name == "thickness" else 1e-5 * max(abs(value), 1e-3)
        ends = [self._forces(name, value + way, of_material) for way in (step, -step)]
        return self._solved((ends[0] - ends[1]) / (2 * step), np.zeros((len(self.rest.garment.pins), 3)))

    def _forces(self, name: str, value: float, of_material: bool) -> Positions:
        """Resultant forces where the cloth is, with another constant."""
        rest, changed = self.rest, {name: value}
        garment, settings = rest.garment, rest.settings
        if of_material:
            pieces = tuple(replace(each, material=replace(each.material, **changed)) for each in garment.pieces)
            garment = replace(garment, material=replace(garment.material, **changed), pieces=pieces)
        else:
            settings = replace(settings, **changed)
        dressed = DressedBody(garment, rest.shaped, settings)
        scene = dressed.scene(self._posed)
        model, workspace = dressed.model, dressed.stepper.workspace
        return StaticStep(
            model, workspace, rest.positions, rest.pinched, scene, rest.friction_anchors, held=rest.face
        ).forces

    def _pins_between(self, first: "PosedBody", second: "PosedBody", way: float) -> Positions:
        """How pins move, by central differences."""
        pins = self.rest.garment.pins
        if not len(pins):
            return np.zeros((0, 3))
        return (pins.on(first).astype(np.float64) - pins.on(second)) / (2 * way)

    def _moved(self, velocity: Float[np.ndarray, "body_verts 3"], pinned: Float[np.ndarray, "pins 3"]) -> Positions:
        """Change of the garment while skin and pins move."""
        return self._solved(self._body_forces(velocity), pinned)

    def _body_forces(self, velocity: Float[np.ndarray, "body_verts 3"]) -> Positions:
        """Change of the forces on the cloth, which stays where it is, while the body's vertices move."""
        forces, size = np.zeros_like(self.rest.positions), float(np.linalg.norm(velocity, axis=1).max())
        if size == 0:
            return forces
        step, faces, touched = CONTACT_DIFFERENCE / size, self._posed.faces, self.rest.positions[self._touching]
        for way in (step, -step):
            skin, share = _skin(self._skin.vertices + way * velocity, faces), 1 / (2 * way)
            forces[self._touching] += share * self._contact(touched, skin)
            forces += share * self._point_forces(skin)
        return forces

    def _solved(self, forces: Positions, pinned: Float[np.ndarray, "pins 3"]) -> Positions:
        """dx from df at fixed cloth, and from the way of the pins."""
        result, model = np.zeros_like(self.rest.positions), self._dressed.model
        result[model.pinned] = pinned[model.hard]
        forces = forces.copy()
        forces[model.held] += model.spring[:, None] * pinned[~model.hard]
        matrix, factor = self._system
        right = forces.ravel() - matrix @ result.ravel()
        result.ravel()[self._dofs] = factor.solve(right[self._dofs])
        return result

    @cached_property
    def _system(self) -> tuple[Any, "SuperLU"]:
        """The whole Hessian of all vertices, and its factors over the free ones."""
        from scipy.sparse import block_diag, csc_array
        from scipy.sparse.linalg import splu

        rest, dressed, step = self.rest, self._dressed, self._step
        blocks = np.zeros((len(rest.positions), 3, 3))
        touched = rest.positions[self._touching]
        for axis in range(3):
            way = CONTACT_DIFFERENCE * np.eye(3)[axis]
            ends = [self._contact(touched + sign * way, self._skin) for sign in (1, -1)]
            blocks[self._touching, :, axis] = -(ends[0] - ends[1]) / (2 * CONTACT_DIFFERENCE)
        blocks[dressed.model.held] += dressed.model.spring[:, None, None] * np.eye(3)
        matrix = csc_array(sheet_hessian(step) + block_diag(list(blocks), format="csc"))
        free = csc_array(matrix[self._dofs][:, self._dofs])
        message = "the equilibrium is not isolated: nothing holds the cloth in some direction; pin it"
        try:
            factor = splu(free, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.01, options={"SymmetricMode": True})
        except RuntimeError as reason:
            raise SimulationFailed(message) from reason
        pivots = np.abs(factor.U.diagonal())
        if not pivots.min() > SINGULAR_PIVOT * pivots.max():
            raise SimulationFailed(message)
        return matrix, factor

    @cached_property
    def _step(self) -> StaticStep:
        rest, dressed = self.rest, self._dressed
        scene = dressed.scene(self._posed)
        model, workspace = dressed.model, dressed.stepper.workspace
        return StaticStep(
            model, workspace, rest.positions, rest.pinched, scene, rest.friction_anchors, whole=True, held=rest.face
        )

    def _point_forces(self, skin: MovingSkin) -> Positions:
        """Forces of the body's vertices on the cloth, each with its triangle of the cloth and one of the body."""
        x, points = self.rest.positions, self._step.meeting.points
        result = np.zeros_like(x)
        if points is None:
            return result
        weights, corners, rows = np.zeros((len(points), 2)), points.corners[:, :3].copy(), points.lay()
        vertices = skin.vertices[points.body_vertex].astype(np.float64)
        closest_on_faces(vertices, np.arange(len(points), dtype=np.int32), x, corners, weights)
        weights = np.column_stack([1 - weights.sum(axis=1), weights])
        at = np.einsum("pc,pci->pi", weights, x[corners])
        point, normal = _planes(at, points.contact.places.face, skin, self._posed.faces)
        depth = points.distance - np.einsum("pi,pi->p", normal, at - point)
        load = rows.stiffness * np.clip(depth, 0, rows.thickness) ** 2 / rows.thickness
        np.add.at(result, corners, weights[:, :, None] * (load[:, None] * normal)[:, None])
        return result

    def _contact(self, positions: Positions, skin: MovingSkin) -> Positions:
        """Forces of contact and friction on the touching vertices, each on its own triangle of the body.

        The plain twin of what `contact_planes` and `gradient` do, in float64 and with the load of the moment.
        """
        rest, faces, which = self.rest, self._posed.faces, self._touching
        settings = rest.settings
        point, normal = _planes(positions, rest.face[which], skin, faces)
        depth = settings.thickness - np.einsum("vi,vi->v", normal, positions - point)
        stiffness = self._dressed.model.contact_stiffness[which] * np.where(
            rest.pinched[which], settings.pinched_share, 1.0
        )
        load = stiffness * np.clip(depth, 0, settings.contact_depth)
        friction_anchors = FrictionAnchors(rest.friction_anchors.face[which], rest.friction_anchors.local[which])
        slip = positions - friction_anchors.points(skin, faces)
        slip -= np.einsum("vi,vi->v", slip, normal)[:, None] * normal
        size = np.linalg.norm(slip, axis=1)
        over = np.where(size < STICK_SLIP, (2 - size / STICK_SLIP) / STICK_SLIP, 1 / np.maximum(size, 1e-12))
        return load[:, None] * (normal - (self._dressed.sheet.friction[which] * over)[:, None] * slip)


def _planes(positions: Positions, face: CreaseFaces, skin: MovingSkin, faces: Faces) -> tuple[Positions, Positions]:
    """Closest point on the given triangle for each position, and the interpolated normal there."""
    weights = np.zeros((len(positions), 2))
    closest_on_faces(positions, face, skin.vertices, faces, weights)
    share = np.column_stack([1 - weights.sum(axis=1), weights])
    point, normal = (np.einsum("vc,vci->vi", share, each[faces[face]]) for each in (skin.vertices, skin.normals))
    return point, normal / np.linalg.norm(normal, axis=1, keepdims=True)


def _skin(vertices: Positions, faces: np.ndarray) -> MovingSkin:
    """The body's surface in float64."""
    normals = np.empty_like(vertices)
    area_normals(vertices, faces, normals)
    return MovingSkin(vertices, normals)
