"""All settings of a simulation, apart from garment, body and motion."""

from dataclasses import dataclass

from hemline.options import check_options, fraction, not_negative, positive

SIMULATOR = 1
"""Version of this simulator. It is one of the inputs of each take, and so part of its name: takes of another version
count as different takes, and are never continued.

Increase it whenever the same garment, body, clip and settings may give different results, even in the last bit of one
vertex: after a change to the solver, to contact, to a term, to settling, to skinning, or to the projection at the
end of a frame. No new version is needed for changes that show in the inputs anyway, such as the default of a setting
or the placement of a clip, nor for code that is moved, renamed or documented.
`tests/sim/step/test_sim_simulator.py` fails if it was forgotten.

Versions only grow; 0 stands for takes that were made before the version was stored.
"""


@dataclass(frozen=True)
class SimSettings:
    """Settings of the simulator. All of them are inputs of a take.

    Raises:
        BadInput: A value makes no sense, such as no substeps or a negative thickness.
    """

    fps: float = positive(30.0)
    """Stored frames per second."""
    substeps: int = positive(4)
    """Steps of backward Euler per frame; the body's pose is interpolated for each."""
    gravity: tuple[float, float, float] = (0.0, -9.81, 0.0)
    """Gravity [m/s^2]."""
    wind: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Wind, or its mean if there are gusts [m/s]."""
    gusts: float = not_negative(0.0)
    """Standard deviation of each component of the wind; 0 for constant wind [m/s]."""
    gust_length: float = positive(2.0)
    """Length scale of the gusts [m]."""
    gust_seconds: float = positive(1.0)
    """Time scale of the gusts [s]."""
    gust_seed: int = not_negative(0)
    """Seed of the gusts."""
    air_density: float = not_negative(1.2)
    """Density of the air [kg/m^3]."""
    thickness: float = not_negative(0.003)
    """Distance that cloth keeps from the body [m]."""
    contact_stiffness: float = not_negative(4e5)
    """Contact pressure per metre of penetration into the thickness [N/m^3]."""
    contact_depth: float = positive(0.01)
    """Penetration beyond which the pressure is constant [m]."""
    contact_reach: float = positive(0.04)
    """Distance from the body's vertices within which contact is searched for, also inwards [m]."""
    pinched_share: float = fraction(0.02)
    """Where two limbs intersect, fraction of the contact stiffness that remains for the one not under the cloth."""
    self_contact: bool = True
    """Whether the cloth collides with itself."""
    self_thickness: float = not_negative(0.002)
    """Distance that cloth keeps from itself [m]; less where edges are shorter than twice that."""
    self_stiffness: float = not_negative(5e4)
    """Pressure of cloth on cloth per metre of penetration into `self_thickness` [N/m^3]."""
    creep: float = positive(0.002)
    """Slip rate below which friction is smoothed [m/s]."""
    newton_steps: int = positive(6)
    """Maximum number of Newton steps per substep."""
    residual_share: float = fraction(0.25)
    """A substep is done when the mean residual force is below this fraction of a vertex's mean weight."""
    solver_share: float = fraction(0.05)
    """Conjugate gradients stop when the preconditioned residual has fallen to this fraction."""
    solver_steps: int = positive(150)
    """Maximum number of steps of conjugate gradients per Newton step."""
    halvings: int = not_negative(5)
    """Maximum number of halvings of a failed substep before the take is given up."""
    lead_in: float = not_negative(1.0)
    """Time from the rest pose to the first pose of the clip [s]."""
    settle: float = not_negative(6.0)
    """Maximum simulated time for settling in the rest pose [s]."""

    def __post_init__(self) -> None:
        check_options(self, "setting")
