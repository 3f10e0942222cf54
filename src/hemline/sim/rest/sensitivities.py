"""Derivatives of a settled garment by joint rotations, by the shape of the body and by constants of the material."""

from dataclasses import fields, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from jaxtyping import Float

from hemline.arrays import Faces
from hemline.bodies.skinning_kernels import area_normals
from hemline.bodies.velocities import reshaping_velocity, turning_velocity
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
from .static_step import STICK_SLIP, BodyFaces, StaticStep
from .statics_kernels import closest_on_faces

if TYPE_CHECKING:
    from scipy.sparse.linalg import SuperLU

    from hemline.bodies import PosedBody

CONTACT_DIFFERENCE = 1e-8
"""Step of the finite differences of forces [m]; it changes contact by a hundredth of a weight."""

TURN, RESHAPE = 1e-2, 0.1
"""Steps of the finite differences of pin positions: angle [rad] and shape coefficient."""

SINGULAR_PIVOT = 1e-13
"""A pivot below this fraction of the largest one counts as 0."""

CONSTANTS = ("density", "young", "poisson", "bending", "friction", "thickness", "contact_stiffness")
"""Constants of the material and the settings that `Sensitivities.constant` accepts."""


class Sensitivities:
    r"""Derivatives of a settled garment, by the implicit function theorem.

    In equilibrium the forces $f(x, \theta)$ vanish for every $\theta$, so

    $$\frac{dx}{d\theta} = -\left(\frac{\partial f}{\partial x}\right)^{-1} \frac{\partial f}{\partial \theta}$$

    with the full Hessian. It includes compression, the curvature of the body, friction and its load, which make it
    slightly asymmetric. It is factorised once; each direction takes one solve and one finite difference of the contact
    forces at fixed cloth, which is accurate to 1e-6. Vertices that slide, stick or touch are assumed to go on doing so.

    Args:
        rest: The settled garment. Derivatives are more accurate near equilibrium; a `residual_share` of 0.01 is enough.

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
        """Returns the derivative by a rotation of a joint about an axis of its own frame, R exp(angle axis).

        Args:
            joint: Number or name of the joint.
            axis: Unit axis in the joint's frame; in the T-pose its axes are those of the world.

        Returns:
            Change of each vertex [m/rad].

        Raises:
            BadInput: There is no such joint, or the axis is not a finite vector.
        """
        number = JOINT_NAMES.index(joint) if joint in JOINT_NAMES else joint
        if not isinstance(number, int | np.integer) or not 0 <= number < JOINT_COUNT:
            raise BadInput("no such joint", repr(joint), f"use 0 to {JOINT_COUNT - 1}, or one of {JOINT_NAMES}")
        direction = np.asarray(axis, np.float64)
        if direction.shape != (3,) or not np.isfinite(direction).all():
            raise BadInput("'axis' must be three finite numbers", axis, "give a unit vector in the joint's frame")
        ends, rest = [], self.rest
        for angle in (TURN, -TURN):
            rotations = rest.pose.rotations.astype(np.float64)
            rotations[number] = multiply(rotations[number], from_axis_angle(angle * direction))
            ends.append(rest.shaped.posed(Pose(rotations, rest.pose.translation)))
        return self._derivative(
            turning_velocity(self._posed, int(number), direction), self._pin_velocity(ends[0], ends[1], TURN)
        )

    def turns(self) -> Float[np.ndarray, "joints 3 verts 3"]:
        """Returns the derivatives by each joint about each of its three axes [m/rad]."""
        return np.array([[self.turn(joint, axis) for axis in np.eye(3)] for joint in range(JOINT_COUNT)])

    def beta(self, index: int) -> Positions:
        """Returns the derivative by a shape coefficient of the body.

        Args:
            index: Number of the coefficient.

        Returns:
            Change of each vertex per standard deviation [m].

        Raises:
            BadInput: The body has no such coefficient.
        """
        count = len(self.rest.shaped.betas)
        if not 0 <= index < count:
            raise BadInput("no such shape coefficient", index, f"use 0 to {count - 1}")
        ends, rest = [], self.rest
        for change in (RESHAPE, -RESHAPE):
            betas = rest.shaped.betas.copy()
            betas[index] += change
            ends.append(rest.shaped.body.shaped(betas).posed(rest.pose))
        return self._derivative(reshaping_velocity(self._posed, index), self._pin_velocity(ends[0], ends[1], RESHAPE))

    def constant(self, name: str) -> Positions:
        """Returns the derivative by a constant of the material or of contact.

        Args:
            name: One of `CONSTANTS`.

        Returns:
            Change of each vertex per unit of the constant [m].

        Raises:
            BadInput: There is no such constant.
        """
        if name not in CONSTANTS:
            raise BadInput("no such constant", repr(name), f"use one of {', '.join(CONSTANTS)}")
        of_material = name in {field.name for field in fields(Material)}
        value = getattr(self.rest.garment.material if of_material else self.rest.settings, name)
        step = CONTACT_DIFFERENCE if name == "thickness" else 1e-5 * max(abs(value), 1e-3)
        ends = [self._forces(name, value + change, of_material) for change in (step, -step)]
        return self._solve((ends[0] - ends[1]) / (2 * step), np.zeros((len(self.rest.garment.pins), 3)))

    def _forces(self, name: str, value: float, of_material: bool) -> Positions:
        """Returns the resultant forces on the settled cloth with another constant."""
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
            model, workspace, rest.positions, rest.pinched, scene, rest.friction_anchors, crease_face=rest.face
        ).forces

    def _pin_velocity(self, first: "PosedBody", second: "PosedBody", step: float) -> Positions:
        """Returns the motion of the pins per unit, by central differences."""
        pins = self.rest.garment.pins
        if not len(pins):
            return np.zeros((0, 3))
        return (pins.on(first).astype(np.float64) - pins.on(second)) / (2 * step)

    def _derivative(
        self, velocity: Float[np.ndarray, "body_verts 3"], pinned: Float[np.ndarray, "pins 3"]
    ) -> Positions:
        """Returns the derivative of the garment for a motion of skin and pins."""
        return self._solve(self._body_forces(velocity), pinned)

    def _body_forces(self, velocity: Float[np.ndarray, "body_verts 3"]) -> Positions:
        """Returns the change of the forces on fixed cloth for a motion of the body's vertices."""
        forces, size = np.zeros_like(self.rest.positions), float(np.linalg.norm(velocity, axis=1).max())
        if size == 0:
            return forces
        step, faces, touched = CONTACT_DIFFERENCE / size, self._posed.faces, self.rest.positions[self._touching]
        for move in (step, -step):
            skin, scale = _skin(self._skin.vertices + move * velocity, faces), 1 / (2 * move)
            forces[self._touching] += scale * self._contact_forces(touched, skin)
            forces += scale * self._point_forces(skin)
        return forces

    def _solve(self, forces: Positions, pinned: Float[np.ndarray, "pins 3"]) -> Positions:
        """Returns dx from df at fixed cloth and from the motion of the pins."""
        result, model = np.zeros_like(self.rest.positions), self._dressed.model
        result[model.pinned] = pinned[model.hard]
        forces = forces.copy()
        forces[model.soft_pins] += model.spring[:, None] * pinned[~model.hard]
        matrix, factor = self._system
        right = forces.ravel() - matrix @ result.ravel()
        result.ravel()[self._dofs] = factor.solve(right[self._dofs])
        return result

    @cached_property
    def _system(self) -> tuple[Any, "SuperLU"]:
        """The full Hessian of all vertices, and its factors for the free ones."""
        from scipy.sparse import block_diag, csc_array
        from scipy.sparse.linalg import splu

        rest, dressed, step = self.rest, self._dressed, self._step
        blocks = np.zeros((len(rest.positions), 3, 3))
        touched = rest.positions[self._touching]
        for axis in range(3):
            offset = CONTACT_DIFFERENCE * np.eye(3)[axis]
            ends = [self._contact_forces(touched + sign * offset, self._skin) for sign in (1, -1)]
            blocks[self._touching, :, axis] = -(ends[0] - ends[1]) / (2 * CONTACT_DIFFERENCE)
        blocks[dressed.model.soft_pins] += dressed.model.spring[:, None, None] * np.eye(3)
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
            model,
            workspace,
            rest.positions,
            rest.pinched,
            scene,
            rest.friction_anchors,
            whole=True,
            crease_face=rest.face,
        )

    def _point_forces(self, skin: MovingSkin) -> Positions:
        """Returns the forces of the body's vertices on the cloth, each with its triangle of the cloth and one of the
        body.
        """
        x, points = self.rest.positions, self._step.pair_contacts.points
        result = np.zeros_like(x)
        if points is None:
            return result
        weights, corners, rows = np.zeros((len(points), 2)), points.corners[:, :3].copy(), points.pair_rows()
        vertices = skin.vertices[points.body_vertex].astype(np.float64)
        closest_on_faces(vertices, np.arange(len(points), dtype=np.int32), x, corners, weights)
        weights = np.column_stack([1 - weights.sum(axis=1), weights])
        at = np.einsum("pc,pci->pi", weights, x[corners])
        point, normal = _planes(at, points.contact.places.face, skin, self._posed.faces)
        depth = points.distance - np.einsum("pi,pi->p", normal, at - point)
        load = rows.stiffness * np.clip(depth, 0, rows.thickness) ** 2 / rows.thickness
        np.add.at(result, corners, weights[:, :, None] * (load[:, None] * normal)[:, None])
        return result

    def _contact_forces(self, positions: Positions, skin: MovingSkin) -> Positions:
        """Returns the forces of contact and friction on the touching vertices, each on its own triangle of the body.

        A plain NumPy version of `contact_planes` and `gradient`, in float64 and with the current load.
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


def _planes(positions: Positions, face: BodyFaces, skin: MovingSkin, faces: Faces) -> tuple[Positions, Positions]:
    """Returns the closest point on the given triangle for each position, and the interpolated normal there."""
    weights = np.zeros((len(positions), 2))
    closest_on_faces(positions, face, skin.vertices, faces, weights)
    corners = np.column_stack([1 - weights.sum(axis=1), weights])
    point, normal = (np.einsum("vc,vci->vi", corners, each[faces[face]]) for each in (skin.vertices, skin.normals))
    return point, normal / np.linalg.norm(normal, axis=1, keepdims=True)


def _skin(vertices: Positions, faces: np.ndarray) -> MovingSkin:
    """Returns the skin of the body in float64."""
    normals = np.empty_like(vertices)
    area_normals(vertices, faces, normals)
    return MovingSkin(vertices, normals)
