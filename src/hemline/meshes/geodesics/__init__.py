"""Distances along a surface."""
