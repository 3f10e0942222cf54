"""Contact of the chains of many windows at once, for the torch reference, by the kernels of the step itself."""

import numpy as np

from hemline.animators.ropes.mechanics.kernel_inputs import BodyMotion, Chains, ContactSettings, NodeArrays
from hemline.animators.ropes.mechanics.placed_kernels import PLACED, place_primitives
from hemline.animators.ropes.mechanics.rope_collision_kernels import resolve_chain
from hemline.collide.primitives.body_primitives import Colliders
from hemline.compiled import kernel


@kernel
def resolve_windows(
    chains: Chains,
    colliders: Colliders,
    contact: ContactSettings,
    bodies: BodyMotion,
    starts,
    nodes_out: NodeArrays,
    hit_out,
):
    """Pushes the chains of all windows out of the primitives.

    All arrays of bodies, starts and nodes_out have an additional first axis: the window.

    Reads: chains; colliders; contact; bodies: frames (windows, joints, 3, 4) over the substep; starts (windows, nodes,
        3): positions at its beginning [m].
    Writes: nodes_out: positions, velocities, touched; hit_out (windows, chains): whether any node of the chain touched.
    """
    placed = np.zeros((PLACED, colliders.kinds.shape[0]))
    for w in range(nodes_out.positions.shape[0]):
        body = BodyMotion(bodies.frames_from[w], bodies.frames_to[w], bodies.duration)
        nodes = NodeArrays(nodes_out.positions[w], nodes_out.velocities[w], nodes_out.tensions[w], nodes_out.touched[w])
        place_primitives(colliders, body.frames_from, body.frames_from, placed)
        place_primitives(colliders, body.frames_from, body.frames_to, placed)
        for c in range(chains.offsets.shape[0] - 1):
            hit_out[w, c] = resolve_chain(chains, c, colliders, placed, body, contact, starts[w], nodes)
