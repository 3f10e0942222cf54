"""Command line with one file per verb: each parses its options, calls the library and prints the result."""

from .main import main as main

__all__ = ["main"]
