"""Bodies from rigged characters in GLB and VRM files."""
