"""All that can be chosen about a simulation, apart from garment, body and motion."""

from dataclasses import dataclass

from hemline.options import check_options, not_negative, positive, share

SIMULATOR = 1
"""Number of this simulator. It is among the inputs of each take and so part of its name: takes of another number are
other takes, and none of them is gone on from.

Raise it whenever the same garment, body, clip and settings may give other bits than before, were it in the last place
of one vertex: a change to the solver, to contact, to a term, to settling, to skinning, or to the projection at the end
of a frame. No new number is needed for what shows in the inputs anyway, such as the default of a setting or how a clip
is placed, nor for code that moves, is renamed or says more. `tests/sim/test_sim_simulator.py` asks for it.

Numbers only grow; 0 is what takes are called that were made before they said it.
"""


@dataclass(frozen=True)
class SimSettings:
    """Settings of the simulator. All of them are part of a take's inputs.

    Raises:
        BadInput: A value that makes no sense, such as no substeps or a negative thickness.
    """

    fps: float = positive(30.0)
    """Frames a second that are stored."""
    substeps: int = positive(4)
    """Steps of backward Euler a frame; the body's pose is interpolated at each."""
    gravity: tuple[float, float, float] = (0.0, -9.81, 0.0)
    """[m/s^2]"""
    wind: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Wind, or its mean where there are gusts [m/s]."""
    gusts: float = not_negative(0.0)
    """Standard deviation of each component of the wind; 0: it is constant [m/s]."""
    gust_length: float = positive(2.0)
    """Distance over which gusts change [m]."""
    gust_seconds: float = positive(1.0)
    """Time in which gusts change [s]."""
    gust_seed: int = not_negative(0)
    """Which of all such gusts."""
    air_density: float = not_negative(1.2)
    """[kg/m^3]"""
    thickness: float = not_negative(0.003)
    """Distance that cloth keeps from the body [m]."""
    contact_stiffness: float = not_negative(4e5)
    """Pressure over penetration of that distance [N/m^3]."""
    contact_depth: float = positive(0.01)
    """Penetration from which the pressure stays constant [m]."""
    contact_reach: float = positive(0.04)
    """How far from the body's vertices contact is looked for, inwards too [m]."""
    pinched_share: float = share(0.02)
    """Share of the contact stiffness that is left to another limb than the cloth's own where both are in each other."""
    self_contact: bool = True
    """Whether the cloth meets itself."""
    self_thickness: float = not_negative(0.002)
    """Distance that cloth keeps from itself [m]; less where edges are shorter than twice that."""
    self_stiffness: float = not_negative(5e4)
    """Pressure of cloth on cloth over penetration of that distance [N/m^3]."""
    creep: float = positive(0.002)
    """Slip below which friction is smoothed [m/s]."""
    newton_steps: int = positive(6)
    """Newton steps a substep, at most."""
    residual_share: float = share(0.25)
    """A substep is done when the mean residual force is below this share of a vertex's mean weight."""
    solver_share: float = share(0.05)
    """Conjugate gradients stop when the preconditioned residual has fallen to this share."""
    solver_steps: int = positive(150)
    """Steps of conjugate gradients a Newton step, at most."""
    halvings: int = not_negative(5)
    """How often a substep that fails is halved before the take is given up."""
    lead_in: float = not_negative(1.0)
    """Time from the rest pose to the first pose of the clip [s]."""
    settle: float = not_negative(6.0)
    """Cloth time that settling in the rest pose may take, at most [s]."""

    def __post_init__(self) -> None:
        check_options(self, "setting")
