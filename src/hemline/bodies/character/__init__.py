"""Bodies made of rigged characters in GLB and VRM files."""
