"""Our settings with cloth on cloth, or without."""

from dataclasses import replace

from hemline.sim import SimSettings


def with_self_contact(settings: SimSettings, thickness: float) -> SimSettings:
    """The same settings, with self-contact of a thickness [m]; 0: without."""
    if thickness > 0:
        return replace(settings, self_contact=True, self_thickness=thickness)
    return replace(settings, self_contact=False)
