"""Capes and skirts cut from a flat pattern and hung on a body."""
