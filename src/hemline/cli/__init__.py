"""Command line: `main` selects the verb, `verbs` has one file for each, and the other files are shared by verbs."""

from .main import main as main

__all__ = ["main"]
