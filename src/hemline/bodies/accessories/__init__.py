"""Rigid things that a body carries on a joint, such as shoulder pads or a bag, as part of the surface cloth lies on."""
