"""Benchmarks of the simulator's statics: settling on a neighbouring shape, and the derivatives there."""

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
"""Betas of the shape next to the mean one."""

OFF = 0.01
"""How far the invented shirt is off the skin [m]."""

COVERED = ("pelvis", "spine", "collar", "shoulder")
"""Parts of the names of the joints under it."""


def bench_settle() -> dict[str, Any]:
    """The light cape (about 4,000 vertices), and an invented shirt, settled on a neighbouring shape, all cores."""
    from hemline.compiled import use_threads

    use_threads(None)
    body = bodies.load()
    return {
        name: _settled(garment, body.shaped(), body.shaped(NEIGHBOUR))
        for name, garment in (("cape", garments.load("cape-light")), ("shirt", make_shirt(body.shaped())))
    }


def bench_sensitivity() -> dict[str, Any]:
    """Change of the light cape and of an invented shirt by all 72 turns of joints, beside the cost of settling."""
    from hemline.compiled import use_threads

    use_threads(None)
    body = bodies.load()
    return {
        name: _derived(garment, body.shaped(), body.shaped(NEIGHBOUR))
        for name, garment in (("cape", garments.load("cape-light")), ("shirt", make_shirt(body.shaped())))
    }


def make_shirt(shaped: ShapedBody) -> Garment:
    """A shirt of cotton, without pins: the skin of trunk and upper arms, 1 cm off.

    Args:
        shaped: The body to wear it; about 2,000 vertices on the shipped one.
    """
    body = shaped.body
    heaviest = body.weight_indices[np.arange(len(shaped.vertices)), body.weights.argmax(axis=1)]
    under = np.array([any(part in name for part in COVERED) for name in motions.JOINT_NAMES])
    used, faces = np.unique(body.faces[under[heaviest][body.faces].all(axis=1)], return_inverse=True)
    vertices = (shaped.vertices + OFF * shaped.normals)[used].astype(np.float32)
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


def _timed_settle(garment: Garment, shaped: ShapedBody, start: Rest | None) -> tuple[Rest, float]:
    began = time.perf_counter()
    rest = settle(garment, shaped, start=start)
    return rest, time.perf_counter() - began


def _settled(garment: Garment, first: ShapedBody, second: ShapedBody) -> dict[str, Any]:
    start, from_nothing = _timed_settle(garment, first, None)
    _timed_settle(garment, second, start)  # compiles what the first one did not need
    rest, seconds = _timed_settle(garment, second, start)
    return {
        "vertices": len(rest.positions),
        "seconds": seconds,
        "seconds_from_nothing": from_nothing,
        "residual_share": rest.residual_share,
        "worst_share": rest.worst_share,
        "newton_steps": rest.newton_steps,
        "solver_steps": rest.solver_steps,
    }


def _derived(garment: Garment, first: ShapedBody, second: ShapedBody) -> dict[str, Any]:
    start, _ = _timed_settle(garment, first, None)
    Sensitivities(start).turn(0, np.eye(3)[0])  # compiles
    rest, seconds = _timed_settle(garment, second, start)
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
