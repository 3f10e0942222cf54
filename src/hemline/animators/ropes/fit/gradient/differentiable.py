"""Torch reference of the step of the rope chains: trajectories of many windows at once, with gradients."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import torch

from hemline.animators.ropes.mechanics.dynamics import RopeChains
from hemline.animators.ropes.mechanics.joint_frame_kernels import frames_between
from hemline.animators.ropes.mechanics.kick_kernels import SLACK_TOLERANCE
from hemline.animators.ropes.mechanics.rope_step_kernels import place_kinematic
from hemline.animators.ropes.mechanics.tension_kernels import solve_direct
from hemline.arrays import Float, Points
from hemline.collide.primitives.body_primitives import Colliders

from .torch_contact import TorchContact
from .torch_forces import TorchForces, dot, length_of

Tensor = torch.Tensor


@dataclass(frozen=True, eq=False)
class Drive:
    """Motion of the body in several windows with equal numbers of frames and of substeps a frame, float64."""

    roots: Float[np.ndarray, "windows frames ends chains 3"]
    """First nodes of the chains where the frame begins and where each substep ends [m]."""
    velocities: Float[np.ndarray, "windows frames ends chains 3"]
    """Velocities of those nodes [m/s]."""
    turns: Float[np.ndarray, "windows frames ends chains 3 3"]
    """Rotation of the joint that carries each chain, from rest to world."""
    bodies: Float[np.ndarray, "windows frames ends joints 3 4"]
    """Transforms of all joints where the frame begins and where each substep ends."""
    dt: float
    """Length of a frame [s]."""

    @classmethod
    def of(
        cls,
        chains: RopeChains,
        motions: Float[np.ndarray, "windows frames 4 kin 3"],
        poses: Float[np.ndarray, "windows frames_and_one joints 3 4"],
        pivots: Points,
        dt: float,
        steps: int,
    ) -> "Drive":
        """Makes a drive from the arguments of `RopeChains.advance`, frame by frame.

        Args:
            chains: The chains.
            motions: Positions [m] and velocities [m/s] of the kinematic nodes at both ends of each frame.
            poses: Transforms of the joints where the windows begin and at the end of each frame.
            pivots: The joints at rest [m].
            dt: Length of a frame [s].
            steps: Substeps of each frame.
        """
        shape = (*motions.shape[:2], steps + 1, len(chains.chain_joints))
        roots, velocities = np.zeros((2, *shape, 3))
        bodies = np.zeros((*shape[:3], *poses.shape[2:]))
        x, v = np.zeros((2, int(chains.offsets[-1]), 3))
        for window, frame, step in np.ndindex(shape[:3]):
            at, fraction = (window, frame, step), step / steps
            place_kinematic(chains.kinematic, motions[window, frame], dt, fraction, x, v)
            frames_between(poses[window, frame], poses[window, frame + 1], pivots, fraction, bodies[at])
            roots[at], velocities[at] = x[chains.offsets[:-1]], v[chains.offsets[:-1]]
        return cls(roots, velocities, bodies[:, :, :, chains.chain_joints, :, :3], bodies, dt)


def trajectory(
    chains: RopeChains,
    drive: Drive,
    positions: Float[np.ndarray, "windows nodes 3"],
    velocities: Float[np.ndarray, "windows nodes 3"],
    parameters: Mapping[str, Tensor] | None = None,
    colliders: Colliders | None = None,
) -> Tensor:
    """Returns the positions of all nodes of the chains at the end of each frame, as `RopeChains.advance` moves them.

    Args:
        chains: The mechanical system; its tensions are solved directly, whatever its sweeps.
        drive: Motion of the body and of the roots.
        positions: All nodes where the windows begin [m].
        velocities: Velocities of the nodes [m/s].
        parameters: Replacements of fields of `RopeChains` (`masses`, `lengths`, `rest_spans`, `rest_directions`,
            `balance`...) and of constants (`drag`, `lateral`, `rest_angle`...), by name, float64; the trajectory has
            gradients for them.
        colliders: Primitives that nodes are pushed out of; None: no contact.

    Returns:
        (windows, frames, nodes of chains, 3) float64 [m]. Gradients hold for one set of pulling ropes and touching
        nodes, see `TorchContact`: where a rope becomes taut or a node touches, the trajectory has a kink.

    Source: Jin, Omens, Geng, Teran, Kumar, Tashiro, Fedkiw, "A Neural-Network-Based Approach for Loose-Fitting
        Clothing", 2024, Sections 3 to 6; gradients are ours. Differs: no speed limit, no hook.
    """
    forces = TorchForces(chains, parameters or {})
    table, count = forces.table, drive.roots.shape[2] - 1
    x, v = (torch.as_tensor(np.asarray(each, np.float64))[:, table] for each in (positions, velocities))
    roots, root_velocities, turns = (
        torch.as_tensor(np.asarray(each, np.float64)) for each in (drive.roots, drive.velocities, drive.turns)
    )
    tensions = forces.of("rest_tensions")[table].expand(x.shape[:3])
    contact = TorchContact(chains, colliders, drive.bodies, forces.real) if colliders else None
    h, ends = drive.dt / count, []
    for frame in range(drive.roots.shape[1]):
        x, v = _with_roots(x, roots[:, frame, 0]), _with_roots(v, root_velocities[:, frame, 0])
        springs = forces.springs(x, tensions, turns[:, frame, 0], h)
        for step in range(1, count + 1):
            end, end_velocity = roots[:, frame, step], root_velocities[:, frame, step]
            pulling, tensions, v = _kick(forces, x, v, tensions, springs, (end - x[:, :, 0]) / h, h, second=False)
            starts, x = x, _move(forces, x, v, pulling, end, h)
            if contact is not None:
                x, v, hit = contact(x, v, starts, frame, step, h)
                if hit.any():
                    v = _apply_impulses(
                        forces, _Geometry.of(forces, x), v, torch.zeros_like(pulling), h, hit[..., None]
                    )
            springs = forces.springs(x, tensions, turns[:, frame, step], h)
            _, tensions, v = _kick(forces, x, v, tensions, springs, end_velocity, h, second=True)
        ends.append(x[:, forces.real])
    return torch.stack(ends, dim=1)


def _with_roots(values: Tensor, roots: Tensor) -> Tensor:
    return torch.cat([roots[:, :, None], values[:, :, 1:]], dim=2)


def _kick(
    forces: TorchForces,
    x: Tensor,
    v: Tensor,
    tensions: Tensor,
    springs: Tensor,
    root: Tensor,
    h: float,
    *,
    second: bool,
) -> tuple[Tensor, Tensor, Tensor]:
    """Applies half a kick, as `kick_kernels.kick`; returns which ropes pull, their tensions, and the velocities."""
    inverse, geometry = forces.inverse, _Geometry.of(forces, x)
    directions, spans, taut, slack, diagonal, beside = geometry
    accelerations = _with_roots(forces.external(springs, x, v, h), (root - v[:, :, 0]) * 2 / h)
    a, u = accelerations[:, :, 1:] - accelerations[:, :, :-1], v[:, :, 1:] - v[:, :, :-1]
    leaving = dot(u, directions) - slack / h
    none = torch.zeros_like(taut)
    for ahead in (0.0, 0.5 * h):
        pull = tensions[:, :, 1:, None] * directions
        turning = u + ahead * a
        turning[:, :, 1:] += ahead * inverse[:, 1:-1, None] * pull[:, :, :-1]
        turning[:, :, :-1] += ahead * inverse[:, 1:-1, None] * pull[:, :, 1:]
        speed = length_of(turning - dot(turning, directions)[..., None] * directions)
        turn = 2 / h * speed * torch.tan((0.5 * h * speed / spans).clamp(max=0.8))
        wanted = dot(a, directions) + turn + 2 / h * leaving.clamp(max=0)
        tensions = _solve(diagonal, beside, wanted, taut, none, tensions)
    pulling = tensions[:, :, 1:] > 0
    v = v + 0.5 * h * accelerations + 0.5 * h * inverse[..., None] * _rope_forces(directions, tensions)
    return pulling, tensions, _apply_impulses(forces, geometry, v, pulling if second else none, h)


class _Geometry(NamedTuple):
    """Ropes at one moment, as `kick_kernels.measure_ropes`; all (windows, chains, ropes)."""

    directions: Tensor
    spans: Tensor
    taut: Tensor
    slack: Tensor
    diagonal: Tensor
    beside: Tensor

    @classmethod
    def of(cls, forces: TorchForces, x: Tensor) -> "_Geometry":
        inverse, lengths = forces.inverse, forces.of("lengths")[forces.table]
        away = x[:, :, 1:] - x[:, :, :-1]
        spans = length_of(away)
        directions = away / spans[..., None]
        taut = (spans >= lengths[:, 1:] * (1 - SLACK_TOLERANCE)) & forces.free[:, 1:]
        slack = (lengths[:, 1:] - spans).clamp(min=0)
        diagonal = inverse[:, :-1] + inverse[:, 1:] + (~forces.free[:, 1:]).double()
        return cls(
            directions,
            spans,
            taut,
            slack,
            diagonal,
            -dot(directions[:, :, 1:], directions[:, :, :-1]) * inverse[:, 1:-1],
        )


def _apply_impulses(
    forces: TorchForces, ropes: _Geometry, v: Tensor, signless: Tensor, h: float, chosen: Tensor | None = None
) -> Tensor:
    """Returns velocities after impulses along the ropes, of some chains or of all, as `kick_kernels.apply_impulses`."""
    taut = ropes.taut if chosen is None else ropes.taut & chosen
    wanted = dot(v[:, :, 1:] - v[:, :, :-1], ropes.directions) - ropes.slack / h
    impulses = _solve(ropes.diagonal, ropes.beside, wanted, taut, signless, torch.zeros_like(v[..., 0]))
    return v + forces.inverse[..., None] * _rope_forces(ropes.directions, impulses)


def _rope_forces(directions: Tensor, tensions: Tensor) -> Tensor:
    """Returns the force of the ropes on each node."""
    pull = tensions[:, :, 1:, None] * directions
    none = torch.zeros_like(pull[:, :, :1])
    return torch.cat([pull, none], dim=2) - torch.cat([none, pull], dim=2)


def _solve(diagonal: Tensor, beside: Tensor, wanted: Tensor, taut: Tensor, signless: Tensor, start: Tensor) -> Tensor:
    """Returns tensions or impulses (windows, chains, nodes), solved for the pulling ropes, which the kernel finds."""
    windows, rows, count = wanted.shape
    active = np.zeros((windows, rows, count + 1), np.bool_)
    values, upper = start.detach().numpy().copy(), np.zeros(count + 1)
    known = np.zeros((4, windows, rows, count + 1))
    for table, each in zip(known, (diagonal.expand(wanted.shape), beside, wanted), strict=False):
        table[..., 1 : 1 + each.shape[-1]] = each.detach().numpy()
    pulls, fixed = (np.pad(each.numpy(), ((0, 0), (0, 0), (1, 0))) for each in (taut, signless & taut))
    for w in range(windows):
        for c in range(rows):
            at = (w, c)
            solve_direct(known[0][at], known[1][at], known[2][at], pulls[at], fixed[at], values[at], active[at], upper)
    used = torch.as_tensor(active[..., 1:] & (fixed[..., 1:] | (values[..., 1:] > 0))).double()
    side = beside * used[..., 1:] * used[..., :-1]
    matrix = torch.diag_embed(diagonal * used + 1 - used) + torch.diag_embed(side, 1) + torch.diag_embed(side, -1)
    found = torch.linalg.solve(matrix, (wanted * used)[..., None])[..., 0]
    return torch.cat([torch.zeros_like(found[..., :1]), found], dim=2)


def _move(forces: TorchForces, x: Tensor, v: Tensor, pulling: Tensor, roots: Tensor, h: float) -> Tensor:
    """Returns positions, root to tip: turned on the sphere of a rope that pulls, else moved straight up to it."""
    lengths, nodes = forces.of("lengths")[forces.table], [roots]
    for i in range(1, x.shape[2]):
        offset, pulls, length = x[:, :, i] - x[:, :, i - 1], pulling[:, :, i - 1], lengths[:, i]
        flying = v[:, :, i] - (nodes[-1] - x[:, :, i - 1]) / h
        a, b, c = dot(flying, flying), dot(flying, offset), dot(offset, offset) - length**2
        short = (a * h * h + 2 * b * h + c <= 0) & ~pulls
        met = ~pulls & ~short & (a > 0) & (b * b - a * c >= 0)
        safe = torch.where(met, a, torch.ones_like(a))
        root = torch.where(met, b * b - a * c, torch.ones_like(a)).sqrt()
        far, near = (-b + root) / safe, (-b - root) / safe
        near = torch.where((near >= 0) & (near <= h), near, torch.zeros_like(near))
        flown = torch.where(met, torch.where((far >= 0) & (far <= h), far, near), torch.zeros_like(far))
        speed = torch.where(pulls[..., None], v[:, :, i] - v[:, :, i - 1], flying)
        turned = _turn(offset + flown[..., None] * flying, speed, h - flown, length)
        nodes.append(nodes[-1] + torch.where(short[..., None], offset + h * flying, turned))
    return torch.stack(nodes, dim=2)


def _turn(offset: Tensor, velocity: Tensor, time: Tensor, length: Tensor) -> Tensor:
    direction = offset / length_of(offset)[..., None]
    across = velocity - dot(velocity, direction)[..., None] * direction
    speed = length_of(across)
    angle = speed * time / length
    return length[..., None] * (
        torch.cos(angle)[..., None] * direction + (torch.sin(angle) / speed)[..., None] * across
    )
