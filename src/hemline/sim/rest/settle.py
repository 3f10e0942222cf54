"""Static equilibrium of a garment on a body, in any pose and shape."""

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

if TYPE_CHECKING:
    from hemline.bodies import ShapedBody

TAKE_START_TOLERANCE = 0.05
"""Residual share with which a take may start: dynamics go on from there."""


def settle(
    garment: Garment,
    shaped: "ShapedBody",
    pose: Pose | None = None,
    settings: SimSettings | None = None,
    *,
    start: Rest | None = None,
    tolerance: float = 0.01,
    method: Method = "newton",
) -> Rest:
    r"""A garment at rest on a body: membrane, bending, gravity, contact and static friction in balance, without wind.

    $$-\nabla E(x) + m g + f_n(x) + f_t(x) = 0$$

    with $f_n$ the pressure of contact and $f_t = -\mu |f_n| f_1(|u|) u / |u|$ static friction: Coulomb's, smoothed
    below a slip of 0.2 mm. Friction has a history, so an equilibrium is one of many. The slip $u$ is measured from
    points that ride on the body's triangles: those of `start`, moved with the body, else the place where a vertex first
    touched. What slid farther than the smoothed slip drags its point along. So a garment settled from itself stays as
    it is.

    From the rest pose and the garment's own start positions, or from `start`, the body is moved in stations of at most
    10 cm; from the garment's own shape, too, where dressing it on another one would push it through itself. At each
    station the cloth is carried along by the skin and settled by Newton's method (`statics.EquilibriumSearch`). Where that fails,
    and at first where nothing has settled yet, damped dynamics bring the cloth near.

    Args:
        garment: The garment; on another shape than its own it is dressed first (cut and cloth unchanged).
        shaped: The body.
        pose: Its pose; None: the rest pose.
        settings: Settings; the wind is ignored.
        start: A settled state of this garment, on any shape of this body in any pose.
        tolerance: Mean residual force, over the mean weight of a vertex, that counts as equilibrium.
        method: `newton`; `draping`: one second of plain dynamics, however still the cloth is then; or `walked`: the
            body goes from its rest pose into the pose in the fixed way of `walk.WALK`, wearing the garment (for
            captured poses, in which cloth that is pressed together has no equilibrium; `start` is the rest drape).

    Returns:
        The garment at rest; `pinched` marks vertices without a free place, where the pose folds the body into itself.

    Raises:
        BadInput: `start` is of another garment or body, or for `walked` not the rest drape of this shape; `tolerance`
            is not positive; there is no such `method`.
        SimulationFailed: No equilibrium was found; the message says how large the residual stayed. Or the garment
            crosses itself; the message says where. Or cloth that was walked is not still, or too much of it pinched.

    Source: Wu et al., "AgentDress: Realtime Clothing Synthesis for Virtual Agents using Plausible
        Deformations", 2021, section 3.2: a simulation of one second drapes the clothing.
        Differs: equilibrium by default, `draping` as they did.
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
        return Settling(garment, shaped, pose, settings, start, tolerance, garment).walked()
    return _settle(garment, shaped, pose, settings, start, tolerance, method)


def rest_drape(garment: Garment, shaped: "ShapedBody", settings: SimSettings | None = None) -> Take:
    """The garment settled in the rest pose of a body, as a take of kind `rest` with one frame.

    Where no equilibrium is found, where damped dynamics end: a take goes on from there; `residual_share` says so, of
    the cloth before it is pushed out of the body as at the end of each frame.

    Args:
        garment: The garment.
        shaped: The body.
        settings: Settings; the wind is ignored.

    Raises:
        SimulationFailed: More than 0.5 % of its edges go through it, or a step failed at its shortest.
    """
    return rest_state(garment, shaped, settings).take()


def rest_state(garment: Garment, shaped: "ShapedBody", settings: SimSettings | None = None) -> Rest:
    """As `rest_drape`, with all that is known about it."""
    quiet = replace(settings or SimSettings(), wind=(0.0, 0.0, 0.0), gusts=0.0)
    return _settle(garment, shaped, shaped.rest_pose, quiet, None, TAKE_START_TOLERANCE, refuse=False)


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
) -> Rest:
    """Settled from where it lies once it is dressed on this shape; where that fails, from its own shape, and it follows
    the change of the body: where thighs or arms press together, dressing pushes cloth through itself.

    Raises:
        SimulationFailed: Both failed; the message is that of the first.
    """
    settling = partial(Settling, garment, shaped, pose, settings, start, tolerance)
    # with a start nothing is laid anew
    laid = garment if start is not None else garment.dressed(shaped)
    try:
        return settling(laid).run(method, refuse=refuse)
    except SimulationFailed as failure:
        if laid is garment:
            raise
        try:
            return settling(garment).run(method, refuse=refuse)
        except SimulationFailed:
            raise failure from None


def _check_start(start: Rest, garment: Garment, shaped: "ShapedBody") -> None:
    """Refuse a start that is not of this garment and body.

    Raises:
        BadInput: It is not.
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
    """Refuse a start that is not the rest drape of a shape.

    Raises:
        BadInput: It is not.
    """
    if start.pose.hash != shaped.rest_pose.hash or not np.array_equal(start.shaped.betas, shaped.betas):
        got = f"a pose or shape of its own (betas {start.shaped.betas.tolist()})"
        raise BadInput("'start' must be the rest drape of this shape for method 'walked'", got, "leave it out")
