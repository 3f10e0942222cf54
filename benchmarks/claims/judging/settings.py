"""Our settings with cloth on cloth, where the simulator has it."""

from dataclasses import fields, replace

from hemline.sim import SimSettings


def with_self_contact(settings: SimSettings, thickness: float) -> SimSettings:
    """The same settings, with self-contact of a thickness [m]; 0: as far as it can be chosen, without.

    Raises:
        SystemExit: This simulator has no self-contact.
    """
    known = {field.name for field in fields(SimSettings)}
    if "self_contact" in known:
        chosen = {"self_contact": thickness > 0} | ({"self_thickness": thickness} if thickness > 0 else {})
        return replace(settings, **chosen)
    if thickness > 0:
        raise SystemExit("this simulator has no self-contact yet: leave out --self-contact")
    return settings
