"""Static equilibrium of a garment on a body, in any pose and shape."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from hemline.datasets.take import Take
from hemline.errors import BadInput, SimulationFailed
from hemline.garments.garment import Garment
from hemline.motions.motion import Pose
from hemline.sim.settings import SimSettings

from .rest import Rest
from .settling import Method, Settling
from .walk import MAX_PINCHED_RATIO

if TYPE_CHECKING:
    from hemline.bodies import ShapedBody

TAKE_START_TOLERANCE = 0.05
"""Residual with which a take may start, over the mean weight of a vertex; dynamics continue from there."""


def settle(
    garment: Garment,
    shaped: "ShapedBody",
    pose: Pose | None = None,
    settings: SimSettings | None = None,
    *,
    start: Rest | None = None,
    tolerance: float = 0.01,
    method: Method = "newton",
    most_pinched: float = MAX_PINCHED_RATIO,
) -> Rest:
    r"""Settles a garment on a body: membrane, bending, gravity, contact and static friction in balance, without wind.

    $$-\nabla E(x) + m g + f_n(x) + f_t(x) = 0$$

    Here $f_n$ is the pressure of contact and $f_t = -\mu |f_n| f_1(|u|) u / |u|$ is Coulomb's static friction, smoothed
    below a slip of 0.2 mm. Friction depends on history, so that an equilibrium is one of many. The slip $u$ is measured
    from friction anchors, points that ride on the body's triangles: those of `start`, moved with the body, or else the
    place where a vertex first touched. A vertex that slides farther than the smoothed slip drags its anchor along. A
    garment that is settled from its own settled state therefore stays as it is.

    The body moves in stations of at most 10 cm from the rest pose and the garment's start positions, or from `start`.
    It also moves from the garment's own shape if dressing another shape would push the garment through itself. At each
    station the skin carries the cloth along, and Newton's method settles it (`statics.EquilibriumSearch`). Damped
    dynamics bring the cloth near if that fails, and at first if nothing has settled yet.

    Args:
        garment: The garment. It is dressed first if the body has another shape than its own (cut and cloth unchanged).
        shaped: The body.
        pose: Pose of the body; None for the rest pose.
        settings: Settings of the simulator; the wind is ignored.
        start: A settled state of this garment, on any shape of this body in any pose.
        tolerance: Mean residual force that counts as equilibrium, over the mean weight of a vertex.
        method: `newton`, `draping` or `walked`. `draping` takes one second of plain dynamics, however still the cloth
            is then. `walked` moves the body, which wears the garment, from its rest pose into the pose by the protocol
            `walk.WALK`; it is for captured poses, in which cloth that is pressed together has no equilibrium, and
            `start` is the rest drape.
        most_pinched: Maximum fraction of pinched vertices after a walk.

    Returns:
        The garment at rest. `pinched` marks vertices without a free place, where the pose folds the body into itself.

    Raises:
        BadInput: `start` is of another garment or body, or for `walked` not the rest drape of this shape; `tolerance`
            is not positive; there is no such `method`.
        SimulationFailed: No equilibrium was found (the message gives the residual), the garment crosses itself (the
            message names the places), or the cloth is not still after a walk or too much of it is pinched.

    Source: Wu et al., "AgentDress: Realtime Clothing Synthesis for Virtual Agents using Plausible Deformations", 2021,
        section 3.2: a simulation of one second drapes the clothing. Differs: equilibrium by default, `draping` as they
        did.
    """
    if not (np.isfinite(tolerance) and tolerance > 0):
        raise BadInput("'tolerance' must be positive", tolerance, "0.01 is one hundredth of a vertex's weight")
    if method not in ("newton", "draping", "walked"):
        raise BadInput("unknown method", repr(method), "use 'newton', 'draping' or 'walked'")
    settings = replace(settings or SimSettings(), wind=(0.0, 0.0, 0.0), gusts=0.0)
    if start is not None:
        _check_start(start, garment, shaped)
    pose = pose or shaped.rest_pose
    if method == "walked":
        start = start or rest_state(garment, shaped, settings)
        _check_drape(start, shaped)
        walked = Settling(garment, shaped, pose, settings, start, tolerance, garment, refuse=False, max_crossing=1.0)
        return walked.run_walk(most_pinched)
    return _settle(garment, shaped, pose, settings, start, tolerance, method)


def rest_drape(
    garment: Garment,
    shaped: "ShapedBody",
    settings: SimSettings | None = None,
    *,
    on_step: Callable[[], None] | None = None,
) -> Take:
    """Settles a garment in the rest pose of a body; returns a take of kind `rest` with one frame.

    If no equilibrium is found, the result is where damped dynamics end, since a take can continue from there. The
    figure `residual_share` tells; it is measured before the cloth is pushed out of the body as at the end of each
    frame.

    Args:
        garment: The garment.
        shaped: The body.
        settings: Settings of the simulator; the wind is ignored.
        on_step: Called before each frame and each Newton step; what it raises ends the search.

    Raises:
        SimulationFailed: More than 0.5 % of its edges cross the garment, or a step failed at its shortest.
    """
    return rest_state(garment, shaped, settings, on_step=on_step).take()


def rest_state(
    garment: Garment,
    shaped: "ShapedBody",
    settings: SimSettings | None = None,
    *,
    max_crossing: float | None = None,
    on_step: Callable[[], None] | None = None,
) -> Rest:
    """Settles a garment in the rest pose of a body, see `rest_drape`; returns all that is known about the result.

    Args:
        garment: The garment.
        shaped: The body.
        settings: Settings of the simulator; the wind is ignored.
        max_crossing: Largest fraction of edges that may cross the cloth; None for that of `rest_drape`.
        on_step: See `rest_drape`.
    """
    quiet = replace(settings or SimSettings(), wind=(0.0, 0.0, 0.0), gusts=0.0)
    pose, tolerance = shaped.rest_pose, TAKE_START_TOLERANCE
    how = {"refuse": False, "max_crossing": max_crossing, "on_step": on_step}
    return _settle(garment, shaped, pose, quiet, None, tolerance, **how)


def _settle(
    garment: Garment,
    shaped: "ShapedBody",
    pose: Pose,
    settings: SimSettings,
    start: Rest | None,
    tolerance: float,
    method: Method = "newton",
    *,
    refuse: bool = True,
    max_crossing: float | None = None,
    on_step: Callable[[], None] | None = None,
) -> Rest:
    """Settles a garment that is first dressed on the shape of the body.

    If that fails, the garment starts on its own shape and follows the change of the body: where thighs or arms press
    together, dressing pushes cloth through itself.

    Raises:
        SimulationFailed: Both failed; the message is that of the first.
    """
    how = {"refuse": refuse, "max_crossing": max_crossing, "on_step": on_step}
    settling = partial(Settling, garment, shaped, pose, settings, start, tolerance, **how)
    # a settled start needs no dressing
    start_garment = garment if start is not None else garment.dressed(shaped)
    try:
        return settling(start_garment).run(method)
    except SimulationFailed as failure:
        if start_garment is garment:
            raise
        try:
            return settling(garment).run(method)
        except SimulationFailed:
            raise failure from None


def _check_start(start: Rest, garment: Garment, shaped: "ShapedBody") -> None:
    """Checks that a start belongs to this garment and body.

    Raises:
        BadInput: It does not.
    """
    cure = "settle this garment on this body without 'start' first"
    same = np.array_equal(start.garment.faces, garment.faces) and np.array_equal(
        start.garment.rest_edges, garment.rest_edges
    )
    if not same:
        raise BadInput(f"'start' must belong to garment '{garment.name}'", f"one of '{start.garment.name}'", cure)
    if start.shaped.body.hash != shaped.body.hash:
        raise BadInput(f"'start' must be on the body '{shaped.body.name}'", f"one on '{start.shaped.body.name}'", cure)


def _check_drape(start: Rest, shaped: "ShapedBody") -> None:
    """Checks that a start is the rest drape of a shape.

    Raises:
        BadInput: It is not.
    """
    if start.pose.hash != shaped.rest_pose.hash or not np.array_equal(start.shaped.betas, shaped.betas):
        got = f"a pose or shape of its own (betas {start.shaped.betas.tolist()})"
        raise BadInput("'start' must be the rest drape of this shape for method 'walked'", got, "leave it out")
