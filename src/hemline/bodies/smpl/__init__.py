"""Bodies made of SMPL, SMPL-H and SMPL-X files."""
