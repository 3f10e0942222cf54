"""The full Hessian of a sheet at rest as a sparse matrix, without the body and pins."""

from typing import Any

import numpy as np
from jaxtyping import Float, Integer

from hemline.sim.cloth.hinge_kernels import hinge_forces
from hemline.sim.cloth.membrane_kernels import membrane_blocks
from hemline.sim.cloth.sheet import Positions
from hemline.sim.contact.pairs.pair_kernels import PairRows, pair_blocks
from hemline.sim.solver.block_kernels import PAD

from .static_step import StaticStep

HINGE_DIFFERENCE = 1e-7
"""Step of the finite differences of hinge forces [m]."""


def sheet_hessian(step: StaticStep) -> Any:
    """Returns second derivatives of membrane, bending, pairs and additional terms, without pins.

    Compression and rest angles are included.

    Args:
        step: A step that was evaluated at the cloth's positions, with `whole`.

    Returns:
        A scipy matrix of 3 verts rows [N/m].
    """
    from scipy.sparse import block_diag, bsr_array

    model, potential = step.model, step.potential
    sheet, count, bending = model.sheet, model.sheet.vertex_count, model.bending
    blocks = np.zeros(9 * len(sheet.ring.columns) + PAD)
    stretch = potential.workspace.stretch
    membrane_blocks(sheet.edge_corners, sheet.edge_slots, model.fabric, stretch, 0.0, bending.ring_bending, blocks)
    ring = blocks[: 9 * len(sheet.ring.columns)].reshape(-1, 3, 3).transpose(0, 2, 1)
    far = bending.far_bending[:, None, None] * np.eye(3)
    rows = [np.repeat(np.arange(count), np.diff(each.starts.astype(np.int64))) for each in (sheet.ring, sheet.far)]
    own = np.zeros((count, 3, 3))
    for row, values in zip(rows, (ring, far), strict=True):
        np.add.at(own, row, -values)
    row = np.concatenate([*rows, np.arange(count)])
    column = np.concatenate([sheet.ring.columns, sheet.far.columns, np.arange(count)]).astype(np.int64)
    values = np.concatenate([ring, far, 0.5 * (own + own.transpose(0, 2, 1))])
    order = np.lexsort((column, row))
    starts = np.concatenate([[0], np.cumsum(np.bincount(row, minlength=count))])
    matrix = bsr_array((values[order], column[order], starts), shape=(3 * count, 3 * count)).tocsc()
    if len(sheet.hinge_rest):
        matrix = matrix + _scatter_blocks(_hinge_blocks(step.x, step), sheet.hinges, count)
    if potential.pairs is not None and len(potential.pairs.pairs):
        rows = potential.pairs.pairs.rows
        matrix = matrix + _scatter_blocks(_pair_blocks(step.x, rows), rows.corners, count)
    if potential.terms:
        diagonal = np.zeros((count, 6))
        for term in potential.terms:
            term.add_blocks(step.x, diagonal)
        symmetric = diagonal[:, [0, 1, 2, 1, 3, 4, 2, 4, 5]].reshape(-1, 3, 3)
        matrix = matrix + block_diag(list(symmetric), format="csc")
    return matrix


def _scatter_blocks(
    entries: Float[np.ndarray, "elements 12 12"], corners: Integer[np.ndarray, "elements 4"], count: int
) -> Any:
    """Returns the sparse matrix of elements with four vertices each."""
    from scipy.sparse import coo_array

    place = (3 * corners.astype(np.int64)[:, :, None] + np.arange(3)).reshape(-1, 12)
    pairs = np.repeat(place, 12, axis=1).ravel(), np.tile(place, (1, 12)).ravel()
    return coo_array((entries.ravel(), pairs), shape=(3 * count, 3 * count)).tocsc()


def _pair_blocks(x: Positions, pairs: PairRows) -> Float[np.ndarray, "pairs 12 12"]:
    """Returns the second derivatives of the pairs along their normals, without friction."""
    flat = np.empty(9 * pairs.size)
    pair_blocks(x, pairs._replace(limit=np.zeros_like(pairs.limit)), 1.0, flat)
    block = flat.reshape(-1, 3, 3)
    weights = pairs.weights.astype(np.float64)
    return np.einsum("pa,pb,pij->paibj", weights, weights, block).reshape(-1, 12, 12)


def _hinge_blocks(x: Positions, step: StaticStep) -> Float[np.ndarray, "hinges 12 12"]:
    """Returns the second derivatives of each hinge by its four vertices, from differences of its forces."""
    sheet, count = step.model.sheet, len(step.model.sheet.hinges)
    apart, own = x[sheet.hinges].reshape(-1, 3), np.arange(4 * count, dtype=np.int32).reshape(-1, 4)
    energy, result = np.empty(count), np.empty((count, 12, 12))
    for coordinate in range(12):
        ends = []
        for offset in (HINGE_DIFFERENCE, -HINGE_DIFFERENCE):
            moved, gradient = apart.copy(), np.empty((count, 12))
            moved.reshape(count, 12)[:, coordinate] += offset
            hinge_forces(moved, own, sheet.hinge_weight, step.model.hinge_rest, gradient, energy)
            ends.append(gradient)
        result[:, :, coordinate] = (ends[0] - ends[1]) / (2 * HINGE_DIFFERENCE)
    return 0.5 * (result + result.transpose(0, 2, 1))
