"""Transfer of a simulated take to bodies of other shapes."""

from collections.abc import Iterator

import numpy as np

from hemline.animators.base import Animator
from hemline.bodies.body import ShapedBody
from hemline.datasets import Take
from hemline.playback.player.frame import Frame
from hemline.playback.player.player import Player


def redress_take(animator: Animator, take: Take, body: ShapedBody) -> Iterator[Frame]:
    """Plays a simulated clip on a body of another shape, frame by frame, without its lead-in.

    Swing and wrinkles of the simulation are kept, and the animator adds the effect of the shape. So one simulation
    serves all shapes.

    Args:
        animator: An animator that was fitted with `--animator agentdress` to the garment of the take.
        take: A simulation on the body of the fit.
        body: The body to show.

    Yields:
        One `Frame` per frame.

    Raises:
        BadInput: Shape or mesh of the take differ from the fit, or the animator does not know shapes.
        BadModel: The animator was fitted on another kind of body.

    Source: Wu et al., "AgentDress: Realtime Clothing Synthesis for Virtual Agents using Plausible Deformations", 2021,
        section 4.4 and Fig. 8b.
    """
    player = Player.prepare(animator, body, placed=True)
    simulated_on, dt = body.body.shaped(take.betas), 1.0 / take.motion.fps
    moving = body.placed(take.motion)
    state = player.start(moving[0], dt=dt)
    for index in np.flatnonzero(~take.lead_in):
        nominal = simulated_on.posed(take.motion[int(index)])
        state, frame = player.redress(state, moving[int(index)], dt, take.vertices[index], nominal)
        yield frame
