"""Transfer of a garment's state to another level of detail."""

import functools
from dataclasses import replace

import numpy as np

from hemline.arrays import Int
from hemline.collide import LayersState, ProjectorState, WholeCloth, WholeState
from hemline.garments import Garment

from .player.layers import FrameProjector


@functools.lru_cache(maxsize=64)
def nearest_vertices(garment: Garment, other: Garment) -> Int[np.ndarray, " verts"]:
    """Returns, for each vertex of a garment, the nearest vertex of another level at rest."""
    from scipy.spatial import KDTree

    return np.asarray(KDTree(other.vertices).query(garment.vertices)[1])


def transfer_whole_cloth(
    cloth: WholeCloth, other: WholeCloth, state: WholeState, nearest: Int[np.ndarray, " verts"]
) -> WholeState:
    """Transfers the state of the whole-cloth step to another level; its samples search for the skin anew.

    Args:
        cloth: The level to change to.
        other: The level of the state.
        state: The state.
        nearest: Result of `nearest_vertices`.
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
    projector: FrameProjector,
    other: FrameProjector,
    state: ProjectorState | LayersState,
    nearest: Int[np.ndarray, " verts"],
) -> ProjectorState | LayersState:
    """Transfers the state of the projection to another level: displacements fade on, the skin is searched for anew.

    The projection of several garments starts anew.

    Args:
        projector: The projection of the level to change to.
        other: The projection of the level of the state.
        state: The state.
        nearest: Result of `nearest_vertices`.
    """
    fresh = projector.start()
    if not isinstance(state, ProjectorState):
        return fresh
    there = _inverse_order(other.on_body.order)[nearest[projector.on_body.order]]
    return replace(fresh, offsets=state.offsets[there], lively=np.ones_like(fresh.lively))


def _inverse_order(order: Int[np.ndarray, " verts"]) -> Int[np.ndarray, " verts"]:
    numbers = np.empty_like(order)
    numbers[order] = np.arange(len(order))
    return numbers
