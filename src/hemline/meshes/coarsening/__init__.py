"""Meshes with fewer vertices."""
