"""Garments with fewer or more vertices, and a fine garment carried by a coarse one."""
