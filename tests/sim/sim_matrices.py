"""The Hessian of a potential as a sparse matrix, put together apart from the solver that multiplies by it."""

import numpy as np
from scipy.sparse import bsr_array, coo_array, csr_array, eye_array, kron

from hemline.sim.solver.block_kernels import PAD


def squares(blocks):
    """Flat blocks by columns as matrices."""
    return blocks[:-PAD].reshape(-1, 3, 3).transpose(0, 2, 1).astype(float)


def assemble_matrix(model, workspace):
    """What the workspace's system holds, without pairs, by vertices."""
    layout, matrix = model.layout, workspace.system.matrix
    count = len(layout.vertex)
    ring = bsr_array((squares(matrix.blocks), layout.ring.columns, layout.ring.starts), shape=(3 * count, 3 * count))
    far = csr_array((layout.far_bending, layout.far.columns, layout.far.starts), shape=(count, count))
    diagonal = bsr_array((squares(matrix.diagonal), np.arange(count), np.arange(count + 1)))
    whole = (ring.tocsr() + kron(far, eye_array(3)).tocsr() + diagonal.tocsr()).tocsr()
    order = (3 * layout.slot.astype(int)[:, None] + np.arange(3)).ravel()
    return whole[order][:, order]


def assemble_pair_matrix(model, pairs):
    """What `PairBlocks` add to it: of each pair its block times the weights of two corners."""
    count = model.sheet.vertex_count
    if not len(pairs.corners):
        return csr_array((3 * count, 3 * count))
    vertex = model.layout.vertex[pairs.corners].astype(int)
    values = np.einsum("pa,pb,pij->paibj", pairs.weights, pairs.weights, squares(pairs.block)).reshape(-1, 12, 12)
    place = (3 * vertex[:, :, None] + np.arange(3)).reshape(-1, 12)
    rows, columns = np.repeat(place, 12, axis=1).ravel(), np.tile(place, (1, 12)).ravel()
    return coo_array((values.ravel(), (rows, columns)), shape=(3 * count, 3 * count)).tocsr()


def vectors(model, flat):
    """A solver's vector by vertices, without the fourth lane."""
    return flat.reshape(-1, 4)[model.layout.slot, :3].ravel()
