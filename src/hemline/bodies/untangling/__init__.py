"""Moves limbs out of the torso and out of each other."""
