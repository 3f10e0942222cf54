"""The error that the panel shows."""


class Refused(Exception):
    """An error in words for the user: problem, value and cure."""
