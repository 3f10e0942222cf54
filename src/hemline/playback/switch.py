"""What of a running garment goes on when it changes to another level of detail."""

import functools
from dataclasses import replace

import numpy as np

from hemline.arrays import Int
from hemline.collide import LayeredProjector, LayersState, Projector, ProjectorState, WholeCloth, WholeState
from hemline.garments import Garment


@functools.lru_cache(maxsize=64)
def nearest_vertices(garment: Garment, other: Garment) -> Int[np.ndarray, " verts"]:
    """For each vertex of a garment the one of another level that is nearest at rest: itself, where it is kept."""
    from scipy.spatial import KDTree

    return np.asarray(KDTree(other.vertices).query(garment.vertices)[1])


def transfer_whole_cloth(
    cloth: WholeCloth, other: WholeCloth, state: WholeState, nearest: Int[np.ndarray, " verts"]
) -> WholeState:
    """The state of one level of a garment as that of another; samples look for the skin anew.

    Args:
        cloth: The level to change to.
        other: The one that the state is of.
        state: The state.
        nearest: As `nearest_vertices`.
    """
    there = _inverse_order(other.on_body.order)[nearest[cloth.on_body.order]]
    shifts = np.einsum("vk,vkx->vx", other.coarse.weights, state.shifts[other.coarse.weight_ids])
    return replace(
        cloth.start(),
        frame=state.frame,
        shifts=np.ascontiguousarray(shifts[there[cloth.coarse.controls]], np.float32),
        offsets=state.offsets[there],
    )


def transfer_projector(
    projector: Projector | LayeredProjector,
    other: Projector | LayeredProjector,
    state: ProjectorState | LayersState,
    nearest: Int[np.ndarray, " verts"],
) -> ProjectorState | LayersState:
    """The same for the projection: displacements fade from where they are, places are looked for anew.

    Those of several garments start anew.

    Args:
        projector: Of the level to change to.
        other: Of the one that the state is of.
        state: The state.
        nearest: As `nearest_vertices`.
    """
    if not (isinstance(projector, Projector) and isinstance(state, ProjectorState)):
        return projector.start()
    there = _inverse_order(other.on_body.order)[nearest[projector.on_body.order]]
    begun = projector.start()
    return replace(begun, offsets=state.offsets[there], lively=np.ones_like(begun.lively))


def _inverse_order(order: Int[np.ndarray, " verts"]) -> Int[np.ndarray, " verts"]:
    numbers = np.empty_like(order)
    numbers[order] = np.arange(len(order))
    return numbers
