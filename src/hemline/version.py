"""The version of this package, which files record as their writer."""

VERSION = "0.1.0"
