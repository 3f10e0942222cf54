"""Compiled: the small steps of a frame."""

from typing import NamedTuple

import numpy as np

from hemline.arrays import Float
from hemline.compiled import kernel

from .force_kernels import Surroundings, accelerate
from .skin_push_kernels import PushSettings, find_contact, move_skin, push_out

_index = np.uintp
BUCKLED = np.float32(0.5)
"""Stiffness of a compressed spring over that of a stretched one: the cloth along an edge of a coarse mesh buckles."""


class FrameSettings(NamedTuple):
    """Settings of a frame."""

    steps: int
    """Number of steps."""
    seconds: np.float32
    """Length of a step [s]."""
    kept: int
    """Steps for which the forces of air and bending are kept."""
    surroundings: Surroundings
    """Gravity and air."""
    contact: PushSettings
    """Contact with the body."""


class StepCloth(NamedTuple):
    """Cloth in motion; kernels write to all arrays."""

    positions: Float[np.ndarray, "verts 3"]
    """Positions [m]."""
    velocities: Float[np.ndarray, "verts 3"]
    """Velocities [m/s]."""
    start: Float[np.ndarray, "verts 3"]
    """Positions at the start of the step [m]."""


class PinTargets(NamedTuple):
    """Where the pins are."""

    before: Float[np.ndarray, "pins 3"]
    """At the start of the frame [m]."""
    after: Float[np.ndarray, "pins 3"]
    """At its end [m]."""


@kernel
def predict(seconds, accelerations, cloth):
    """Moves all vertices by their velocities.

    Reads: seconds [s]; accelerations (verts, 3) [m/s^2].
    Writes: cloth: a `StepCloth`.
    """
    positions, velocities, start = cloth.positions.reshape(-1), cloth.velocities.reshape(-1), cloth.start.reshape(-1)
    changes = accelerations.reshape(-1)
    for number in range(len(positions)):
        i = _index(number)
        velocity = velocities[i] + seconds * changes[i]
        start[i], velocities[i] = positions[i], velocity
        positions[i] += seconds * velocity


@kernel
def find_velocities(seconds, cloth):
    """Computes velocities from the positions at the start and the end of a step.

    Reads: seconds [s].
    Writes: cloth: velocities of a `StepCloth`.
    """
    positions, velocities, start = cloth.positions.reshape(-1), cloth.velocities.reshape(-1), cloth.start.reshape(-1)
    over = np.float32(1) / seconds
    for number in range(len(positions)):
        i = _index(number)
        velocities[i] = over * (positions[i] - start[i])


@kernel
def pull_pins(sheet, targets, share, seconds, positions):
    """Moves hard pins to their targets, and soft ones towards them.

    Reads: sheet: a `SpringSheet`; targets: `PinTargets`; share of the frame, 0 to 1; seconds: length of a step [s].
    Writes: positions (verts, 3) [m].
    """
    for number in range(len(sheet.pins)):
        p = _index(number)
        i = _index(sheet.pins[p])
        give, part = sheet.pin_compliances[p] / (seconds * seconds), np.float32(1)
        if sheet.inverse_masses[i] > 0:
            part = sheet.inverse_masses[i] / (sheet.inverse_masses[i] + give)
        for axis in range(3):
            target = targets.before[p, axis] + share * (targets.after[p, axis] - targets.before[p, axis])
            positions[i, axis] += part * (target - positions[i, axis])


@kernel
def edge_factors(sheet, seconds):
    """Computes the factors of each spring that do not change from step to step, one if stretched, one if compressed.

    Model: 1 / (w_a + w_b + alpha / h^2), with alpha / 0.5 where the spring is compressed
    Reads: sheet: a `SpringSheet`; seconds: h [s].
    Returns: The factors (edges, 2) [kg], float32.
    """
    edges, inverse, factors = sheet.edges, sheet.inverse_masses, np.empty((len(sheet.edges), 2), np.float32)
    one = np.float32(1)
    for number in range(len(edges)):
        e = _index(number)
        both = inverse[_index(edges[e, 0])] + inverse[_index(edges[e, 1])]
        give = sheet.compliances[e] / (seconds * seconds)
        factors[e, 0], factors[e, 1] = one / (both + give), one / (both + give / BUCKLED)
    return factors


@kernel
def solve_edges(sheet, factors, backwards, positions):
    """Solves the springs one after the other, each as a constraint with compliance.

    Model: d lambda = -C / (w_a + w_b + alpha / h^2), C = |x_a - x_b| - l (Macklin et al. 2016, Eq. 18, from lambda = 0)
    Reads: sheet: a `SpringSheet`; factors (edges, 2): of `edge_factors`; backwards: whether from the last to the first.
    Writes: positions (verts, 3) [m].
    """
    edges, lengths, inverse, count = sheet.edges, sheet.lengths, sheet.inverse_masses, len(sheet.edges)
    one, tiny = np.float32(1), np.float32(1e-12)
    for number in range(count):
        e = _index(count - 1 - number if backwards else number)
        a, b = _index(edges[e, 0]), _index(edges[e, 1])
        x, y, z = (
            positions[b, 0] - positions[a, 0],
            positions[b, 1] - positions[a, 1],
            positions[b, 2] - positions[a, 2],
        )
        part = one - lengths[e] / np.sqrt(x * x + y * y + z * z + tiny)
        pull = (factors[e, 0] if part > 0 else factors[e, 1]) * part
        for_a, for_b = pull * inverse[a], pull * inverse[b]
        positions[a, 0] += for_a * x
        positions[a, 1] += for_a * y
        positions[a, 2] += for_a * z
        positions[b, 0] -= for_b * x
        positions[b, 1] -= for_b * y
        positions[b, 2] -= for_b * z


@kernel
def advance_frame(sheet, homes, body, pins, wind, settings, contact, cloth):
    """Advances the cloth by a frame, in which the body moves evenly from its first pose to its second.

    Reads: sheet: a `SpringSheet`; homes (verts,): vertex of the skin next to each vertex at rest; body: a
        `MovingBody`; pins: `PinTargets`; wind (verts, 3) [m/s]; settings: `FrameSettings`.
    Writes: contact: a `SkinPlaces`, with the faces of the last frame on entry; cloth: a `StepCloth`.
    """
    h, accelerations, factors = settings.seconds, np.empty_like(cloth.positions), edge_factors(sheet, settings.seconds)
    count = find_contact(body.before, homes, cloth.positions, settings.contact.near, contact)
    for step in range(settings.steps):
        share = np.float32(step + 1) / np.float32(settings.steps)
        if step % settings.kept == 0:
            held = np.float32(settings.kept) * h
            accelerate(sheet, settings.surroundings, wind, held, cloth.positions, cloth.velocities, accelerations)
        predict(h, accelerations, cloth)
        pull_pins(sheet, pins, share, h, cloth.positions)
        solve_edges(sheet, factors, step % 2 == 1, cloth.positions)
        move_skin(body, share)
        push_out(sheet, body, contact, count, (step, settings.steps), settings.contact, cloth)
        find_velocities(h, cloth)
