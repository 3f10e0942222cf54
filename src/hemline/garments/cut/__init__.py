"""Capes and skirts that are cut from a flat pattern and hung on a body."""
