"""Named tuples that the kernels of rope chains take: the chains, the settings, the body's motion, the nodes."""

from typing import NamedTuple

import numpy as np

from hemline.arrays import Bool, Float, Int


class Chains(NamedTuple):
    """The chains of a garment, which stay the same while it plays; see `dynamics.RopeChains`."""

    offsets: Int[np.ndarray, " chains_and_one"]
    """First node of each chain, and the number of nodes."""
    lengths: Float[np.ndarray, " nodes"]
    """Longest distance of each node to the node above it [m]."""
    rest_spans: Float[np.ndarray, " nodes"]
    """Distance of each node to the node above it at rest [m]."""
    rest_directions: Float[np.ndarray, "nodes 3"]
    """Unit direction from the node above it at rest."""
    inverse_masses: Float[np.ndarray, " nodes"]
    """1 / mass of each node, 0 for kinematic ones [1/kg]."""
    margins: Float[np.ndarray, " nodes"]
    """Distance that each node keeps from the colliders [m]."""
    joints: Int[np.ndarray, " chains"]
    """Joint that carries the rest directions of each chain."""
    across: Int[np.ndarray, "nodes 2"]
    """The nodes to both sides of each node; the node itself at the edge of the cloth."""
    pairs: Int[np.ndarray, "pairs 2"]
    """Nodes of neighbouring chains joined by lateral springs."""
    pair_spans: Float[np.ndarray, "pairs 2"]
    """Distance of each pair at rest, and the longest that the cloth allows [m]."""
    balance: Float[np.ndarray, "nodes 3"]
    """Accelerations that hold each node in the drape at rest, in the body's rest pose [m/s^2]."""
    rest_loads: Float[np.ndarray, " nodes"]
    """Weight of each node in that drape, plus the tension of the rope below it [N]."""
    kinematic: Int[np.ndarray, " kin"]
    """Nodes that are moved from outside."""


class ContactSettings(NamedTuple):
    """How nodes leave the colliders, see `constants.RopeConstants`."""

    friction: float
    """Coulomb's coefficient [1]."""
    position_push: float
    """Index of `position_push` in `constants.PUSH_OUT`."""
    velocity_push: float
    """Index of `velocity_push` in `constants.PUSH_OUT`."""


class StepSettings(NamedTuple):
    """The constants of a step, see `constants.RopeConstants`."""

    numbers: Float[np.ndarray, " numbers"]
    """Constants of the forces, as `RopeConstants.numbers` orders them."""
    tension_sweeps: int
    """Gauss-Seidel sweeps for the tensions; 0 solves directly."""
    impulse_sweeps: int
    """Gauss-Seidel sweeps for the impulses; 0 solves directly."""
    project: bool
    """Whether a node on a taut rope goes straight on and is put back on its sphere, instead of being turned."""
    contact: ContactSettings
    """How nodes leave the colliders."""


class HalfKick(NamedTuple):
    """One half of the kick of a substep, see `kick_kernels.kick`."""

    h: float
    """Length of the whole substep [s]."""
    is_second: bool
    """Whether this half ends the substep."""
    accelerations: Float[np.ndarray, "nodes 3"]
    """External accelerations; those of the roots are written by the kick [m/s^2]."""
    root_velocities: Float[np.ndarray, "chains 3"]
    """Velocities of the roots at the end of this half [m/s]."""


class BodyMotion(NamedTuple):
    """The body over a time interval: rest-to-world transforms (joints, 3, 4) of its joints."""

    frames_from: Float[np.ndarray, "joints 3 4"]
    """Transforms at the beginning."""
    frames_to: Float[np.ndarray, "joints 3 4"]
    """Transforms at the end."""
    duration: float
    """Length of the interval [s]."""


class NodeArrays(NamedTuple):
    """The state that a step changes, node by node."""

    positions: Float[np.ndarray, "nodes 3"]
    """[m]"""
    velocities: Float[np.ndarray, "nodes 3"]
    """[m/s]"""
    tensions: Float[np.ndarray, " nodes"]
    """Tension of the rope above each node [N]."""
    touched: Bool[np.ndarray, " nodes"]
    """Whether the node was pushed out of a collider."""


class RopeGeometry(NamedTuple):
    """The ropes at one moment, and the tridiagonal matrix of Eq. 4 and 8; row i is the rope above node i."""

    directions: Float[np.ndarray, "nodes 3"]
    """Unit directions from the node above."""
    spans: Float[np.ndarray, " nodes"]
    """Distances to the node above [m]."""
    slack: Float[np.ndarray, " nodes"]
    """What each rope lacks of its length [m]."""
    diagonal: Float[np.ndarray, " nodes"]
    """Diagonal of the matrix [1/kg]."""
    beside: Float[np.ndarray, " nodes"]
    """Entry of the matrix that couples rope i to rope i + 1 [1/kg]."""
    taut: Bool[np.ndarray, " nodes"]
    """Whether the rope may pull."""


class SolverWork(NamedTuple):
    """Working memory of the tensions and impulses of one chain; nothing in it outlives a kernel."""

    wanted: Float[np.ndarray, " nodes"]
    """Right-hand side."""
    upper: Float[np.ndarray, " nodes"]
    """Upper factor of the elimination."""
    values: Float[np.ndarray, " nodes"]
    """Impulses."""
    active: Bool[np.ndarray, " nodes"]
    """Ropes that pull in the present guess."""
    signless: Bool[np.ndarray, " nodes"]
    """Ropes whose value may have either sign."""
