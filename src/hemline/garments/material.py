"""Materials: physical constants of fabrics."""

from dataclasses import asdict, dataclass, fields
from difflib import get_close_matches
from typing import Any

from hemline.errors import BadGarment

from .quote import quote

_LARGEST = 1e300
"""Limit of the magnitude of constants, close to the largest floating-point number."""

_LIMITS = {
    "density": (20.0, "kg/m^2"),
    "young": (1e6, "N/m"),
    "bending": (1.0, "N m"),
    "damping": (1.0, "s"),
    "friction": (10.0, ""),
    "drag": (10.0, ""),
    "lift": (10.0, ""),
}
"""Largest plausible values. A larger one suggests a wrong unit, such as grams, or a modulus per cross-section [Pa]."""


@dataclass(frozen=True)
class Material:
    """Physical constants of an isotropic fabric.

    Raises:
        BadGarment: A constant is not a finite number, or not physical.
    """

    name: str
    """Name in files and error messages."""
    density: float
    """Mass per area [kg/m^2]."""
    young: float
    """Young's modulus of the sheet: force per width at unit strain [N/m]."""
    poisson: float
    """Poisson's ratio of the sheet, from -1 to below 1."""
    bending: float
    """Bending stiffness: moment per width at unit curvature [N m]."""
    damping: float = 0.003
    """Damping proportional to stiffness, as a time constant [s]."""
    friction: float = 0.3
    """Coulomb friction coefficient between cloth and body."""
    drag: float = 1.2
    """Drag coefficient along a triangle's normal, for the dynamic pressure of the air."""
    lift: float = 0.4
    """Lift coefficient across the wind, for the dynamic pressure of the air."""

    def __post_init__(self) -> None:
        for field in fields(self)[1:]:
            value = getattr(self, field.name)
            number = not isinstance(value, bool) and isinstance(value, int | float)
            if not number or not abs(value) < _LARGEST:
                raise BadGarment(
                    f"material '{self.name}': {field.name} must be a finite number",
                    quote(value),
                    "give one in SI units",
                )
            object.__setattr__(self, field.name, float(value))
        for key, (limit, unit) in _LIMITS.items():
            if getattr(self, key) > limit:
                what = f"material '{self.name}': {key} must be at most {limit:g} {unit}".rstrip()
                raise BadGarment(what, getattr(self, key), "give it in SI units, per area of cloth")
        for key in ("density", "young"):
            if getattr(self, key) <= 0:
                raise BadGarment(
                    f"material '{self.name}': {key} must be positive", getattr(self, key), "give it in SI units"
                )
        for key in ("bending", "damping", "friction", "drag", "lift"):
            if getattr(self, key) < 0:
                raise BadGarment(
                    f"material '{self.name}': {key} must not be negative", getattr(self, key), "use 0 or more"
                )
        if not -1 < self.poisson < 1:
            raise BadGarment(f"material '{self.name}': poisson must lie between -1 and 1", self.poisson, "0.3 is usual")

    def as_dict(self) -> dict[str, Any]:
        """Returns all constants by name."""
        return asdict(self)

    @classmethod
    def of(cls, content: "str | dict[str, Any] | Material") -> "Material":
        """Makes a material from a name or a table of constants. Constants that the table omits are those of its `base`.

        Args:
            content: A name of `MATERIALS`, or a dict of constants, with the key `base` naming one of `MATERIALS`
                unless all constants are there. A `Material` is returned as it is.

        Raises:
            BadGarment: Unknown name, unknown or missing constant.
        """
        if isinstance(content, Material):
            return content
        if isinstance(content, str):
            if content not in MATERIALS:
                raise BadGarment("unknown material", quote(content), f"did you mean '{_nearest(content, MATERIALS)}'")
            return MATERIALS[content]
        if not isinstance(content, dict):
            raise BadGarment("material must be a name or a table", quote(content), f"use one of {', '.join(MATERIALS)}")
        known = [field.name for field in fields(cls)]
        for key in content:
            if key not in (*known, "base"):
                raise BadGarment(
                    f"material has no constant {quote(key)}",
                    quote(content[key]),
                    f"did you mean '{_nearest(key, known)}'",
                )
        table: dict[str, Any] = dict(content)
        base = table.pop("base", None)
        start: dict[str, Any] = asdict(cls.of(base)) if base is not None else {}
        table = start | {"name": f"{base} (changed)" if base else "own"} | table
        missing = [key for key in ("density", "young", "poisson", "bending") if key not in table]
        if missing:
            raise BadGarment("material lacks a constant", ", ".join(missing), "give it, or a 'base' material by name")
        return cls(**table)


def _nearest(name: str, known: Any) -> str:
    return (get_close_matches(str(name)[:60], list(known), 1, 0.0) or list(known))[0]


# docs/materials.md has the source of each constant, and says which are chosen rather than measured
MATERIALS: dict[str, Material] = {
    each.name: each
    for each in (
        Material("cotton", density=0.150, young=120.0, poisson=0.3, bending=6e-6, friction=0.4),
        Material("silk", density=0.070, young=60.0, poisson=0.3, bending=2e-6, friction=0.25),
        Material("denim", density=0.350, young=400.0, poisson=0.3, bending=2e-5, friction=0.5),
        Material("wool", density=0.250, young=200.0, poisson=0.3, bending=1.2e-5, friction=0.45),
        Material("jersey", density=0.180, young=50.0, poisson=0.4, bending=3e-6, friction=0.4),
        Material("paper", density=0.100, young=30.0, poisson=0.3, bending=1e-5, friction=0.3),
    )
}
"""Fabrics by name."""
