"""Benchmarks of the simulator at rest: settling on a nearby body shape, and derivatives by the pose."""

import time
from typing import Any

import numpy as np

from hemline import bodies, garments, motions
from hemline.bodies import ShapedBody
from hemline.garments import Garment
from hemline.garments.material import MATERIALS
from hemline.garments.pins import Pins
from hemline.garments.rest_metric import rest_edges_of_mesh
from hemline.sim import Rest, Sensitivities, settle

NEIGHBOUR = (0.0, 0.3)
"""Betas of a shape near the mean one."""

SHIRT_OFFSET = 0.01
"""Distance of the synthetic shirt from the skin [m]."""

COVERED = ("pelvis", "spine", "collar", "shoulder")
"""Words in the names of the joints under the shirt."""


def bench_settle() -> dict[str, Any]:
    """Time to settle the light cape (about 4,000 vertices) and a synthetic shirt on a nearby body shape, all cores."""
    from hemline.compiled import use_threads

    use_threads(None)
    body = bodies.load()
    return {
        name: _settle_figures(garment, body.shaped(), body.shaped(NEIGHBOUR))
        for name, garment in (("cape", garments.load("cape-light")), ("shirt", make_shirt(body.shaped())))
    }


def bench_sensitivity() -> dict[str, Any]:
    """Time of the derivatives of the light cape and a synthetic shirt by all 72 joint rotations, all cores."""
    from hemline.compiled import use_threads

    use_threads(None)
    body = bodies.load()
    return {
        name: _derivative_figures(garment, body.shaped(), body.shaped(NEIGHBOUR))
        for name, garment in (("cape", garments.load("cape-light")), ("shirt", make_shirt(body.shaped())))
    }


def make_shirt(shaped: ShapedBody) -> Garment:
    """Makes a cotton shirt without pins from the skin of trunk and upper arms, offset by 1 cm.

    Args:
        shaped: The body; on the shipped one the shirt has about 2,000 vertices.
    """
    body = shaped.body
    heaviest = body.weight_indices[np.arange(len(shaped.vertices)), body.weights.argmax(axis=1)]
    under = np.array([any(part in name for part in COVERED) for name in motions.JOINT_NAMES])
    used, faces = np.unique(body.faces[under[heaviest][body.faces].all(axis=1)], return_inverse=True)
    vertices = (shaped.vertices + SHIRT_OFFSET * shaped.normals)[used].astype(np.float32)
    faces = faces.reshape(-1, 3).astype(np.int32)
    none = np.zeros(0, np.int32)
    return Garment(
        name="shirt",
        vertices=vertices,
        faces=faces,
        rest_edges=rest_edges_of_mesh(vertices, faces),
        material=MATERIALS["cotton"],
        pins=Pins(none, none, np.zeros((0, 3), np.float32), np.zeros(0, np.float32)),
        key_joint="spine3",
        body_name=body.name,
        body_betas=shaped.betas,
    )


def _settle(garment: Garment, shaped: ShapedBody, start: Rest | None) -> tuple[Rest, float]:
    began = time.perf_counter()
    rest = settle(garment, shaped, start=start)
    return rest, time.perf_counter() - began


def _settle_figures(garment: Garment, first: ShapedBody, second: ShapedBody) -> dict[str, Any]:
    start, from_nothing = _settle(garment, first, None)
    _settle(garment, second, start)  # compiles what the first one did not need
    rest, seconds = _settle(garment, second, start)
    return {
        "vertices": len(rest.positions),
        "seconds": seconds,
        "seconds_from_nothing": from_nothing,
        "residual_share": rest.residual_share,
        "worst_share": rest.worst_share,
        "newton_steps": rest.newton_steps,
        "solver_steps": rest.solver_steps,
    }


def _derivative_figures(garment: Garment, first: ShapedBody, second: ShapedBody) -> dict[str, Any]:
    start, _ = _settle(garment, first, None)
    Sensitivities(start).turn(0, np.eye(3)[0])  # compiles
    rest, seconds = _settle(garment, second, start)
    began = time.perf_counter()
    derivatives = Sensitivities(rest)
    derivatives.turn(0, np.eye(3)[0])
    first_one = time.perf_counter() - began
    began = time.perf_counter()
    turns = derivatives.turns()
    each = (time.perf_counter() - began) / (turns.shape[0] * turns.shape[1])
    return {
        "vertices": len(rest.positions),
        "directions": turns.shape[0] * turns.shape[1],
        "seconds_factorisation": first_one - each,
        "seconds_a_direction": each,
        "seconds_settle": seconds,
        "share_of_settle": each / seconds,
    }
