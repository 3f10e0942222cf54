"""The command line: one file a verb; parse, call the library, print."""

from .main import main as main

__all__ = ["main"]
