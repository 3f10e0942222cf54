"""Contact of the chains of many windows at once, for their twin in torch: the same code as in a step, compiled."""

import numpy as np

from hemline.animators.ropes.mechanics.placed_kernels import PLACED, place_primitives
from hemline.animators.ropes.mechanics.rope_collision_kernels import resolve_chain
from hemline.compiled import kernel


@kernel
def resolve_windows(
    offsets,
    lengths,
    margins,
    kinds,
    joints,
    shapes,
    centres,
    friction,
    choice,
    velocity_choice,
    h,
    frames_from,
    frames_to,
    starts,
    positions_out,
    velocities_out,
    touched_out,
    hit_out,
):
    # model: chains, the primitives   in: choices (floats), substep h, frames (windows, joints, 3, 4) at both its ends,
    #     starts (windows, nodes, 3) at its beginning
    # in/out: positions_out, velocities_out (windows, nodes, 3)
    # out: touched_out (windows, nodes), hit_out (windows, chains): whether any node of it touched
    placed = np.zeros((PLACED, kinds.shape[0]))
    for w in range(positions_out.shape[0]):
        place_primitives(kinds, joints, shapes, centres, frames_from[w], frames_from[w], placed)
        place_primitives(kinds, joints, shapes, centres, frames_from[w], frames_to[w], placed)
        for c in range(offsets.shape[0] - 1):
            hit_out[w, c] = resolve_chain(
                offsets[c],
                offsets[c + 1],
                lengths,
                margins,
                kinds,
                joints,
                shapes,
                placed,
                frames_from[w],
                frames_to[w],
                friction,
                choice,
                velocity_choice,
                h,
                starts[w],
                positions_out[w],
                velocities_out[w],
                touched_out[w],
            )
