"""Bodies from SMPL, SMPL-H and SMPL-X files."""
