"""Scenes, runs, figures and pictures of `reference_engines.py`: hemline beside Blender's cloth and Newton."""
